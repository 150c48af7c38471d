"""Radiance fields: everything that maps (positions, viewdirs) to (sigma, rgb)."""

from cagefield.fields.analytic import AnalyticField, GaussianBlob, UniformBox, UniformSphere
from cagefield.fields.nerf_field import NerfField
from cagefield.fields.protocol import Field

__all__ = ["AnalyticField", "Field", "GaussianBlob", "NerfField", "UniformBox", "UniformSphere"]
