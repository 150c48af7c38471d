"""Data sets: posed photos from transforms.json, LLFF and COLMAP."""

from __future__ import annotations

from cagefield.datasets.dataset_loader import Dataset, View, load_dataset

__all__ = ["Dataset", "View", "load_dataset"]
