"""Data sets with disturbed cameras, for benchmarks of what verifies and refines poses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from cagefield.datasets import Dataset, View
from cagefield.typing import Array

ROTATION_DEG = 1.0
"""Angle by which each camera is turned, about an axis of its own."""

OFFSET = 0.01
"""Length of each camera's displacement over its distance from the middle of the data set's bounds."""

MAX_FOCAL_CHANGE = 0.05
"""Largest relative change of a focal length; fx and fy of a photo change by the same factor."""


def perturbed(dataset: Dataset, seed: int = 0) -> Dataset:
    """The data set with every camera disturbed by itself, those of test and validation views too.

    Each is turned about its own position by ROTATION_DEG about a random axis, moved by OFFSET of its distance
    in a random direction, and its focal length scaled by a factor uniform in 1 +- MAX_FOCAL_CHANGE. Points
    and the world stay.
    """
    rng = np.random.default_rng(seed)
    center = dataset.bounds.mean(axis=0)

    def disturbed(view: View) -> View:
        camera = view.camera
        axis, direction = _unit(rng), _unit(rng)
        factor = 1 + rng.uniform(-MAX_FOCAL_CHANGE, MAX_FOCAL_CHANGE)
        pose = camera.c2w.copy()
        pose[:3, :3] = Rotation.from_rotvec(np.radians(ROTATION_DEG) * axis).as_matrix() @ pose[:3, :3]
        pose[:3, 3] += OFFSET * np.linalg.norm(camera.origin - center) * direction
        return replace(view, camera=replace(camera, c2w=pose, fx=factor * camera.fx, fy=factor * camera.fy))

    train, test, val = (
        tuple(disturbed(view) for view in views) for views in (dataset.train, dataset.test, dataset.val)
    )
    return replace(dataset, train=train, test=test, val=val)


def _unit(rng: np.random.Generator) -> Array:
    """A random direction [3], uniform on the sphere."""
    vector = rng.normal(size=3)
    return np.asarray(vector / np.linalg.norm(vector))
