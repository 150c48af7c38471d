"""Normalization of captures to the worlds of original NeRFs.

A NeRF's encoding has fixed wavelengths, so a capture whose units are arbitrary is moved and scaled first, p
-> R s p + t. A forward-facing capture is moved into normalized device coordinates (NDC): the mean camera at
the origin, looking along -z, nothing nearer than the plane z = -1. In any other capture the cube of interest
becomes [-1, 1]^3.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from cagefield.cameras.camera import Camera
from cagefield.datasets.views import Dataset, View

FloatArray = npt.NDArray[np.float64]

BOUND_FACTOR = 0.75
"""Nearest depth after scaling, inverse: nerf-pytorch scales a capture until this share of its nearest depth
is 1.
"""

MIN_DESCENT_SHARE = 0.1
"""Minimum share of the length of a forward-facing capture's rays that goes down -z."""

MIN_MEAN_DIRECTION_LENGTH = 0.5
"""Minimum length of the mean of a forward-facing capture's unit viewing directions."""


@dataclasses.dataclass(frozen=True, eq=False)
class Similarity:
    """p -> R s p + t: `rigid` [4,4] holds R and t, `scale` is s."""

    rigid: FloatArray
    scale: float

    def transform_camera(self, camera: Camera) -> Camera:
        """Camera in the new world."""
        pose = camera.c2w.copy()
        pose[:3, 3] *= self.scale
        return camera.with_c2w(self.rigid @ pose)

    def transform_points(self, points: FloatArray) -> FloatArray:
        """Points [N,3] in the new world."""
        moved: FloatArray = self.scale * points @ self.rigid[:3, :3].T + self.rigid[:3, 3]
        return moved

    def transform_dataset(self, dataset: Dataset, bounds: FloatArray) -> Dataset:
        """Data set in the new world, with `bounds` [2,3] there."""
        matrix = self.rigid.copy()
        matrix[:3, :3] *= self.scale

        def moved(views: tuple[View, ...]) -> tuple[View, ...]:
            return tuple(
                dataclasses.replace(view, camera=self.transform_camera(view.camera)) for view in views
            )

        depths, points = dataset.depths, dataset.points
        return dataclasses.replace(
            dataset,
            train=moved(dataset.train),
            test=moved(dataset.test),
            val=moved(dataset.val),
            bounds=bounds,
            source_to_world=matrix @ dataset.source_to_world,
            offset=(0.0, 0.0, 0.0),
            depths=None if depths is None else (self.scale * depths[0], self.scale * depths[1]),
            points=None
            if points is None
            else dataclasses.replace(points, positions=self.transform_points(points.positions)),
        )


def all_cameras(dataset: Dataset) -> list[Camera]:
    """Cameras of all splits."""
    return [view.camera for view in (*dataset.train, *dataset.test, *dataset.val)]


def mean_camera_similarity(cameras: Sequence[Camera], nearest: float) -> Similarity:
    """Similarity that takes the mean camera to the origin, looking along -z with +y up, and the depth
    `nearest` to 4/3.

    Source: nerf-pytorch, `load_llff.py`.
    """
    scale = 1.0 / (nearest * BOUND_FACTOR)
    poses = np.stack([camera.c2w for camera in cameras])
    mean = np.eye(4)
    mean[:3, 3] = scale * poses[:, :3, 3].mean(axis=0)
    back = _unit(poses[:, :3, 2].sum(axis=0))
    right = _unit(np.cross(poses[:, :3, 1].sum(axis=0), back))
    mean[:3, :3] = np.stack([right, np.cross(back, right), back], axis=1)
    return Similarity(np.asarray(np.linalg.inv(mean), np.float64), scale)


def normalize_to_unit_cube(dataset: Dataset) -> Dataset:
    """Data set whose cube of interest is [-1, 1]^3; axes keep their directions."""
    center = dataset.bounds.mean(axis=0)
    scale = 2.0 / float((dataset.bounds[1] - dataset.bounds[0]).max())
    rigid = np.eye(4)
    rigid[:3, 3] = -scale * center
    return Similarity(rigid, scale).transform_dataset(dataset, np.array([[-1.0] * 3, [1.0] * 3]))


def normalize_to_ndc(dataset: Dataset) -> tuple[Dataset, tuple[float, float]]:
    """(data set in the world of NDC, bounded by `ndc_box`; the NDC's (width/2f, height/2f)).

    `depths` must be known. `ndc_obstacle` tells whether NDC suit the capture.
    """
    if dataset.depths is None:
        raise ValueError("a data set without depths cannot be placed for NDC")
    cameras = all_cameras(dataset)
    ndc = ndc_ratios(cameras)
    return mean_camera_similarity(cameras, dataset.depths[0]).transform_dataset(dataset, ndc_box(ndc)), ndc


def ndc_ratios(cameras: Sequence[Camera]) -> tuple[float, float]:
    """(width/2f, height/2f) of the widest camera."""
    return max(c.width / (2.0 * c.fx) for c in cameras), max(c.height / (2.0 * c.fy) for c in cameras)


def ndc_box(ndc: tuple[float, float]) -> FloatArray:
    """Box of interest [2,3] whose contraction of space is close to NDC in the cameras' field of view.

    With (a, b) = `ndc` it is [-a, a] x [-b, b] x [-1, 1]: a point of the pyramid |x| <= a|z|, |y| <= b|z|
    beyond z = -1 goes to (2 - 1/|z|) (x / (a|z|), y / (b|z|), -1). A grid there is aligned with the image and
    even in 1/depth, as a forward-facing capture's detail is.
    """
    half = np.array([ndc[0], ndc[1], 1.0])
    return np.stack([-half, half])


def ndc_obstacle(dataset: Dataset) -> str | None:
    """Reason why NDC do not suit a capture, None where they do."""
    if not dataset.unbounded:
        return "it is bounded, and NDC are for forward-facing captures"
    if dataset.depths is None:
        return "nothing is known of its depth, which poses_bounds.npy or a COLMAP model would say"
    mean_forward = np.mean([camera.forward for camera in all_cameras(dataset)], axis=0)
    if np.linalg.norm(mean_forward) < MIN_MEAN_DIRECTION_LENGTH:
        return "its cameras look all around"
    moved = normalize_to_ndc(dataset)[0]
    for view in (*moved.train, *moved.test, *moved.val):
        camera = view.camera
        if camera.origin[2] <= -1.0:
            return f"camera {view.name} stands beyond the nearest depth of the capture"
        last = camera.width - 1, camera.height - 1
        corners = np.array([[0, 0], [last[0], 0], [0, last[1]], last])
        if -camera.rays(corners)[1][:, 2].max() < MIN_DESCENT_SHARE:
            return f"camera {view.name} looks aside: all must look roughly the same way"
    return None


def _unit(vector: FloatArray) -> FloatArray:
    return np.asarray(vector / np.linalg.norm(vector), np.float64)
