"""Cameras: pinhole cameras, lenses, paths and keyframes."""

from cagefield.cameras.camera import Camera, turntable

__all__ = ["Camera", "turntable"]
