"""Captures moved into the worlds that original NeRFs are trained in.

A NeRF's encoding has fixed wavelengths, so a capture whose units are arbitrary is moved and scaled first,
p -> R s p + t. A forward-facing one goes where normalised device coordinates (NDC) want it: the mean camera
at the origin, looking along -z, nothing nearer than the plane z = -1. Any other goes to where its cube of
interest is [-1, 1]^3.
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
"""nerf-pytorch scales a capture until this share of its nearest depth is 1."""

LEAST_DESCENT = 0.1
"""A ray of a forward-facing capture goes down -z by at least this share of its length."""

LEAST_AGREEMENT = 0.5
"""Length of the mean of a forward-facing capture's viewing directions, at least."""


@dataclasses.dataclass(frozen=True, eq=False)
class Similarity:
    """p -> R s p + t: `rigid` [4,4] holds R and t, `scale` is s."""

    rigid: FloatArray
    scale: float

    def camera(self, camera: Camera) -> Camera:
        """The camera in the new world."""
        pose = camera.c2w.copy()
        pose[:3, 3] *= self.scale
        return camera.with_c2w(self.rigid @ pose)

    def points(self, points: FloatArray) -> FloatArray:
        """Points [N,3] in the new world."""
        moved: FloatArray = self.scale * points @ self.rigid[:3, :3].T + self.rigid[:3, 3]
        return moved

    def dataset(self, dataset: Dataset, bounds: FloatArray) -> Dataset:
        """The data set in the new world, with `bounds` [2,3] there."""
        matrix = self.rigid.copy()
        matrix[:3, :3] *= self.scale

        def moved(views: tuple[View, ...]) -> tuple[View, ...]:
            return tuple(dataclasses.replace(view, camera=self.camera(view.camera)) for view in views)

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
            else dataclasses.replace(points, positions=self.points(points.positions)),
        )


def all_cameras(dataset: Dataset) -> list[Camera]:
    """The cameras of all splits."""
    return [view.camera for view in (*dataset.train, *dataset.test, *dataset.val)]


def to_mean_camera(cameras: Sequence[Camera], nearest: float) -> Similarity:
    """The mean camera to the origin, looking along -z with +y up, the depth `nearest` to 4/3 of 1.

    As nerf-pytorch places LLFF captures.
    """
    scale = 1.0 / (nearest * BOUND_FACTOR)
    poses = np.stack([camera.c2w for camera in cameras])
    mean = np.eye(4)
    mean[:3, 3] = scale * poses[:, :3, 3].mean(axis=0)
    back = _unit(poses[:, :3, 2].sum(axis=0))
    right = _unit(np.cross(poses[:, :3, 1].sum(axis=0), back))
    mean[:3, :3] = np.stack([right, np.cross(back, right), back], axis=1)
    return Similarity(np.asarray(np.linalg.inv(mean), np.float64), scale)


def in_unit_cube(dataset: Dataset) -> Dataset:
    """The data set where its cube of interest is [-1, 1]^3; axes keep their directions."""
    middle = dataset.bounds.mean(axis=0)
    scale = 2.0 / float((dataset.bounds[1] - dataset.bounds[0]).max())
    rigid = np.eye(4)
    rigid[:3, 3] = -scale * middle
    return Similarity(rigid, scale).dataset(dataset, np.array([[-1.0] * 3, [1.0] * 3]))


def in_ndc_world(dataset: Dataset) -> tuple[Dataset, tuple[float, float]]:
    """The data set where NDC hold, bounded by `ndc_box`, and the NDC's (width/2f, height/2f).

    `depths` must be known. Whether NDC suit the capture is for `why_not_ndc` to say.
    """
    if dataset.depths is None:
        raise ValueError("a data set without depths cannot be placed for NDC")
    cameras = all_cameras(dataset)
    ndc = ndc_ratios(cameras)
    return to_mean_camera(cameras, dataset.depths[0]).dataset(dataset, ndc_box(ndc)), ndc


def ndc_ratios(cameras: Sequence[Camera]) -> tuple[float, float]:
    """(width/2f, height/2f), of the widest camera."""
    return max(c.width / (2.0 * c.fx) for c in cameras), max(c.height / (2.0 * c.fy) for c in cameras)


def ndc_box(ndc: tuple[float, float]) -> FloatArray:
    """The box of interest [2,3] whose contraction of space is much like NDC where the cameras look.

    With (a, b) = `ndc` it is [-a, a] x [-b, b] x [-1, 1]: a point of the pyramid |x| <= a|z|, |y| <= b|z|
    beyond z = -1 goes to (2 - 1/|z|) (x / (a|z|), y / (b|z|), -1). A grid there is aligned with the picture
    and even in 1/depth, as a forward-facing capture's detail is.
    """
    half = np.array([ndc[0], ndc[1], 1.0])
    return np.stack([-half, half])


def why_not_ndc(dataset: Dataset) -> str | None:
    """Why NDC do not suit a capture, None where they do."""
    if not dataset.unbounded:
        return "it is bounded, and NDC are for forward-facing captures"
    if dataset.depths is None:
        return "nothing is known of its depth, which poses_bounds.npy or a COLMAP model would say"
    ahead = np.mean([camera.forward for camera in all_cameras(dataset)], axis=0)
    if np.linalg.norm(ahead) < LEAST_AGREEMENT:
        return "its cameras look all around"
    moved = in_ndc_world(dataset)[0]
    for view in (*moved.train, *moved.test, *moved.val):
        camera = view.camera
        if camera.origin[2] <= -1.0:
            return f"camera {view.name} stands beyond the nearest depth of the capture"
        last = camera.width - 1, camera.height - 1
        corners = np.array([[0, 0], [last[0], 0], [0, last[1]], last])
        if -camera.rays(corners)[1][:, 2].max() < LEAST_DESCENT:
            return f"camera {view.name} looks aside: all must look roughly the same way"
    return None


def _unit(vector: FloatArray) -> FloatArray:
    return np.asarray(vector / np.linalg.norm(vector), np.float64)
