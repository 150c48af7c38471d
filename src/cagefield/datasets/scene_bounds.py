"""Bounds of a captured scene, from the cameras alone or with the depths of a reconstruction.

Notation: o_n are camera positions, d_n unit viewing directions, w_n weights.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from cagefield.cameras.camera import Camera

FloatArray = npt.NDArray[np.float64]

_MIN_AXIS_EIGENVALUE = (
    0.005  # smallest eigenvalue of mean(I - d d^T) below which optical axes say nothing about depth
)
_MIN_AXIS_EIGENVALUE_WITH_DEPTHS = (
    0.05  # the same where depths are known, which say more: axes within 13 degrees
)
_HALF_SIZE_SHARE = 0.7  # half-size of the cube of interest over the median distance of the cameras


def leveling_rotation(poses: FloatArray, up: Sequence[float] | None = None) -> FloatArray:
    """Rotation [3,3] that takes the scene's up to +z and the mean direction of view to y > 0, x = 0.

    `poses` [N,4,4] are OpenGL camera-to-world matrices. Without `up` [3] the up axis is the direction most
    normal to all the cameras' right axes (people hold cameras level), where the cameras turn enough to tell,
    with the sign of the mean up axis; else the mean up axis itself.
    """
    backs = poses[:, :3, 2]
    axis = _estimated_up(poses) if up is None else np.asarray(up, dtype=np.float64)
    if np.linalg.norm(axis) < 1e-6:
        return np.eye(3)
    axis = axis / np.linalg.norm(axis)
    candidates = np.concatenate([-backs.mean(axis=0)[None], np.eye(3)[[1, 0]]])
    horizontal = candidates - (candidates @ axis)[:, None] * axis
    ahead = horizontal[np.argmax(np.linalg.norm(horizontal, axis=1) > 1e-3)]
    ahead = ahead / np.linalg.norm(ahead)
    return np.stack([np.cross(ahead, axis), ahead, axis])


def _estimated_up(poses: FloatArray) -> FloatArray:
    rights, ups = (poses[:, :3, k] for k in range(2))
    mean_up = ups.mean(axis=0)
    values, vectors = np.linalg.eigh(rights.T @ rights / len(poses))
    normal = vectors[:, 0] * (1.0 if vectors[:, 0] @ mean_up >= 0 else -1.0)
    is_conditioned = (
        values[1] > 0.02 and values[0] < 0.1 * values[1]
    )  # turned by 8 degrees rms, rolled by less
    return normal if is_conditioned and normal @ mean_up > 0.5 else mean_up


def focus_point(origins: FloatArray, directions: FloatArray) -> tuple[FloatArray, float]:
    """(point [3] with the least sum of distances to the lines o_n + t d_n, its conditioning).

    Iteratively reweighted least squares: solve sum_n w_n (I - d_n d_n^T) (p - o_n) = 0 with w_n = 1 /
    distance, so that a few stray cameras do not move the point far. The conditioning is the smallest
    eigenvalue of mean(I - d d^T), the mean square sine of the lines' angles to a common direction: 0 for
    parallel lines.
    """
    normal = np.eye(3) - directions[:, :, None] * directions[:, None, :]
    conditioning = float(np.linalg.eigvalsh(normal.mean(axis=0))[0])
    weights = np.ones(len(origins))
    point = origins.mean(axis=0)
    scale = float(np.linalg.norm(origins - point, axis=1).mean()) or 1.0
    for _ in range(30):
        weighted = weights[:, None, None] * normal
        system = weighted.sum(axis=0)
        system += 1e-12 * np.trace(system) * np.eye(3)
        point = np.linalg.solve(system, np.einsum("nij,nj->i", weighted, origins))
        distance = np.linalg.norm(np.einsum("nij,nj->ni", normal, point - origins), axis=1)
        weights = 1.0 / np.maximum(distance, 1e-3 * scale)
    return point, conditioning


def cube_of_interest(
    cameras: Sequence[Camera], depths: FloatArray | None = None, points: FloatArray | None = None
) -> FloatArray:
    """Cube [2,3] (min, max) around the subject of photos of a real place; the rest is background.

    Where the optical axes converge in front of three quarters of the cameras, its center is the point closest
    to all of them (`focus_point`), its half-size 0.7 times the median distance of the cameras to it, and no
    more than holds 95 % of `points` [M,3], the sparse points of a reconstruction, if there are any. Where the
    axes are nearly parallel, as in a forward-facing capture, the cube reaches from the near depth to the far
    depth or to three times the near depth, and is at least as wide as the image there. Near and far are
    medians of `depths` [N,2], of the points' depths, or else 1 and 3 times four times the spread of the
    cameras. Where the cameras look outwards, or at each other along one line, it surrounds them at twice
    their spread.
    """
    origins = np.stack([camera.origin for camera in cameras])
    directions = np.stack([camera.forward for camera in cameras])
    mean_origin = origins.mean(axis=0)
    spread = float(np.median(np.linalg.norm(origins - mean_origin, axis=1))) or 1.0
    if depths is None and points is not None:
        depths = depths_of_points(cameras, points)
    point, conditioning = focus_point(origins, directions)
    if conditioning > (_MIN_AXIS_EIGENVALUE if depths is None else _MIN_AXIS_EIGENVALUE_WITH_DEPTHS):
        ahead = np.einsum("ni,ni->n", point - origins, directions)
        if np.quantile(ahead, 0.25) <= 0.0:
            return _cube(mean_origin, 2.0 * spread)
        half_size = _HALF_SIZE_SHARE * float(np.median(np.linalg.norm(origins - point, axis=1)))
        if points is not None and len(points) >= 20:
            half_size = min(half_size, float(np.quantile(np.abs(points - point).max(axis=1), 0.95)))
        return _cube(point, half_size)
    forward = directions.mean(axis=0)
    if np.linalg.norm(forward) < 0.5:
        return _cube(mean_origin, 2.0 * spread)
    near, far = (4.0 * spread, 12.0 * spread) if depths is None else np.median(depths, axis=0)
    far = min(far, 3.0 * near)
    depth = 0.5 * (near + far)
    tangent = float(np.median([0.5 * max(c.width / c.fx, c.height / c.fy) for c in cameras]))
    return _cube(mean_origin + depth * forward / np.linalg.norm(forward), max(far - depth, depth * tangent))


def _cube(center: FloatArray, half_size: float) -> FloatArray:
    return np.stack([center - half_size, center + half_size])


def depth_range(cameras: Sequence[Camera], points: FloatArray | None) -> tuple[float, float] | None:
    """(nearest, farthest) depth of the points over all images; None where too few are visible."""
    depths_by_image = None if points is None else depths_of_points(cameras, points)
    return (
        None
        if depths_by_image is None
        else (float(depths_by_image[:, 0].min()), float(depths_by_image[:, 1].max()))
    )


def depths_of_points(cameras: Sequence[Camera], points: FloatArray) -> FloatArray | None:
    """Near and far depths [N,2] (1 % and 99 %) of the visible points of each image that has at least 10; None
    for none.
    """
    sample = points[:: max(1, len(points) // 5000)]
    depths_by_image = []
    for camera in cameras:
        positions, depth = camera.project(sample)
        visible = np.all((positions >= 0) & (positions <= (camera.width, camera.height)), axis=1) & (
            depth > 0
        )
        if np.count_nonzero(visible) >= 10:
            depths_by_image.append(np.quantile(depth[visible], (0.01, 0.99)))
    return np.array(depths_by_image) if depths_by_image else None
