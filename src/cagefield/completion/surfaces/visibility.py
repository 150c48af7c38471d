"""Visibility of a field's surfaces from its cameras: visible surfels, depth maps, and pairs of neighbors."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from cagefield.cameras.camera import Camera
from cagefield.completion.surfaces.surfels import Surfels, concatenate_surfels
from cagefield.compute.cancellation import check_cancelled
from cagefield.edits import EditMap
from cagefield.images.render_result import RenderResult
from cagefield.typing import Array, Mask

CAMERA_COUNT = 28
"""Maximum number of rendered images."""

IMAGE_SIZE_PIXELS = 280
"""Longer edge of a rendered image, pixels."""

PAIR_DISTANCE_PIXELS = (4, 84)
"""Minimum and maximum distance of a pair of neighbors, pixels."""

MAX_PAIRS = 12_000
"""Maximum number of pairs of neighbors."""

MAX_SURFELS = 300_000
"""Maximum number of visible surfels."""

NORMAL_WINDOW_PIXELS = 3
"""Edge of the window over which the normal of a pixel is computed, pixels."""

MARGIN_PIXELS = 4
"""Pixels around those that show a surface that its edges and normals depend on."""

MIN_SURFACE_OPACITY = 0.5
"""Minimum opacity of a pixel that shows a surface."""

DEPTH_TOLERANCE_VOXELS = 0.7
"""Depth tolerance, voxels: a point at most this far behind the rendered depth counts as visible."""

MIN_VIEWS = 2
"""Minimum number of cameras that see a surface whose stored color is trusted."""

MIN_EDGE_DEPTH_SHARE = 0.03
"""Minimum jump in depth between neighboring pixels at an edge, as a share of the depth."""


@dataclass(frozen=True)
class SurfacePairs:
    """Pairs of neighbors on surfaces: first and second surfel [N] of each.

    log_change [N]: log of the second mean color over the first.
    """

    first: Surfels
    second: Surfels
    log_change: Array


@dataclass(frozen=True, eq=False)
class CameraVisibility:
    """Visible surfaces of a field, from some of its cameras.

    Attributes:
        pairs: neighbors on its surfaces.
        surface: visible surfels [N].
        log_brightness: [N], log of the surfels' mean over the color channels.
        hue: [N,3], the surfels' colors over that mean.
        cameras: the cameras.
        depths: for each camera the distance [H,W] along the pixels' rays to the surface, inf without one.
    """

    pairs: SurfacePairs
    surface: Surfels
    log_brightness: Array
    hue: Array
    cameras: tuple[Camera, ...]
    depths: tuple[Array, ...]

    def count_views(self, points: Array, tolerance: float) -> NDArray[np.int64]:
        """Number of cameras [N] that see canonical points [N,3].

        tolerance: maximum distance of a visible point behind the rendered depth, world units; a negative
        tolerance counts the cameras that see past the point.
        """
        count = np.zeros(len(points), np.int64)
        for camera, depth in zip(self.cameras, self.depths, strict=True):
            image, ahead = camera.project(points)
            is_inside = np.isfinite(image).all(axis=1) & (ahead > 0.0)
            pixel = np.floor(np.where(is_inside[:, None], image, -1.0)).astype(np.int64)
            is_inside &= ((pixel >= 0) & (pixel < (camera.width, camera.height))).all(axis=1)
            distance = np.linalg.norm(points[is_inside] - camera.origin, axis=1)
            count[is_inside] += depth[pixel[is_inside, 1], pixel[is_inside, 0]] > distance - tolerance
        return count


def count_edited_views(
    points: Array, below: EditMap, visibility: CameraVisibility, tolerance: float
) -> NDArray[np.int64]:
    """Number of cameras [N] that see points [N,3] of the deformed space of the edits below.

    A point in a layer of an edit counts as seen by MIN_VIEWS cameras: the layer is the best that is known
    there. For a negative `tolerance` (`CameraVisibility.count_views`) such a point counts as seen by none.
    """
    mapped = below.to_canonical(points)
    count = visibility.count_views(mapped.points, tolerance)
    return np.where(mapped.layer != 0, MIN_VIEWS if tolerance >= 0.0 else 0, count)


def render_visibility(
    render: Callable[[Camera], RenderResult], cameras: Sequence[Camera], bounds: Array, *, seed: int = 0
) -> CameraVisibility:
    """Visibility of a field from some of its cameras, by images that `render` makes of them.

    Without cameras, from cameras around the bounds [2,3].
    """
    rng = np.random.default_rng(seed)
    numbers = {int(n) for n in np.linspace(0, len(cameras) - 1, CAMERA_COUNT)} if cameras else set()
    used = tuple(
        downscale_camera(camera) for camera in [cameras[n] for n in sorted(numbers)] or orbit_cameras(bounds)
    )
    views = _in_background(lambda camera, image: _view_surfaces(camera, image, rng), render, used)
    all_pairs = [view.pairs for view in views]
    first, second = (
        concatenate_surfels([getattr(pairs, name) for pairs in all_pairs]) for name in ("first", "second")
    )
    log_change = np.concatenate([pairs.log_change for pairs in all_pairs])
    surface = concatenate_surfels([view.surface for view in views])
    surfel_rows = _sample_rows(len(surface.points), MAX_SURFELS, rng)
    rows = _sample_rows(len(log_change), MAX_PAIRS, rng)
    return CameraVisibility(
        SurfacePairs(first.take(rows), second.take(rows), log_change[rows]),
        surface.take(surfel_rows),
        np.concatenate([view.log_brightness for view in views])[surfel_rows],
        np.concatenate([view.hue for view in views])[surfel_rows],
        used,
        tuple(view.depth for view in views),
    )


@dataclass(frozen=True, eq=False)
class _ViewSurfaces:
    """Surfaces that one camera sees; attributes as in `CameraVisibility`."""

    pairs: SurfacePairs
    surface: Surfels
    log_brightness: Array
    hue: Array
    depth: Array


def _in_background(
    process: Callable[[Camera, RenderResult], _ViewSurfaces],
    render: Callable[[Camera], RenderResult],
    cameras: Sequence[Camera],
) -> list[_ViewSurfaces]:
    """Surfaces of each camera's image, in order; an image is processed while the next one is rendered."""
    pool = ThreadPoolExecutor(1)
    try:
        views = []
        for camera in cameras:
            check_cancelled()
            image = render(camera)
            views.append(pool.submit(copy_context().run, process, camera, image))
        return [view.result() for view in views]
    finally:
        pool.shutdown(cancel_futures=True)


def _view_surfaces(camera: Camera, image: RenderResult, rng: np.random.Generator) -> _ViewSurfaces:
    """Surfaces of one camera's image."""
    check_cancelled()
    is_surface = (image.opacity > MIN_SURFACE_OPACITY) & np.isfinite(image.depth)
    rows = _rows_around(is_surface)
    surface, solid = _image_surfels(image, camera, rows)
    check_cancelled()
    colors = np.clip(image.rgb[rows].reshape(-1, 3), 0.02, 1.0)
    mean = colors.mean(axis=1)
    log_mean = np.log(mean)
    is_known = solid.reshape(-1) & ((surface.normals**2).sum(axis=1) > 0.5)
    return _ViewSurfaces(
        _sample_pairs(log_mean, surface, solid, rng),
        surface.take(is_known),
        log_mean[is_known],
        (colors / mean[:, None])[is_known],
        np.where(is_surface, image.depth, np.inf).astype(np.float64),
    )


def _sample_rows(count: int, max_count: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """Random row numbers [M] of `count` rows in increasing order; M is `max_count` at most."""
    if count <= max_count:
        return np.arange(count)
    return np.sort(rng.choice(count, max_count, replace=False))


def downscale_camera(camera: Camera) -> Camera:
    """Camera with IMAGE_SIZE_PIXELS along its longer edge."""
    share = IMAGE_SIZE_PIXELS / max(camera.width, camera.height)
    return camera.resized(max(1, round(share * camera.width)), max(1, round(share * camera.height)))


def orbit_cameras(bounds: Array) -> list[Camera]:
    """CAMERA_COUNT cameras around a box [2,3], on a spiral on the upper half of a sphere."""
    center, radius = bounds.mean(axis=0), 0.5 * float(np.linalg.norm(bounds[1] - bounds[0]))
    cameras = []
    for n in range(CAMERA_COUNT):
        height = 0.1 + 0.8 * n / CAMERA_COUNT
        aside = np.sqrt(1.0 - height**2) * np.array([np.cos(2.4 * n), np.sin(2.4 * n)])
        eye = center + 2.5 * radius * np.array([*aside, height])
        cameras.append(
            Camera.look_at(
                tuple(eye), tuple(center), width=IMAGE_SIZE_PIXELS, height=IMAGE_SIZE_PIXELS, fov_x=0.9
            )
        )
    return cameras


def _rows_around(mask: Mask) -> tuple[slice, slice]:
    """Rows and columns around the pixels of a mask [H,W], with room for the windows of `_image_surfels`."""
    slices = []
    for axis in (1, 0):
        pixels = np.flatnonzero(mask.any(axis=axis))
        first, last = (int(pixels[0]), int(pixels[-1])) if len(pixels) else (0, 0)
        slices.append(slice(max(first - MARGIN_PIXELS, 0), last + 1 + MARGIN_PIXELS))
    return slices[0], slices[1]


def _image_surfels(image: RenderResult, camera: Camera, rows: tuple[slice, slice]) -> tuple[Surfels, Mask]:
    """(surfel of each pixel [h*w], mask [h,w] of the pixels that show a surface) in a part of an image."""
    depth = image.depth[rows]
    solid = (image.opacity[rows] > 0.98) & np.isfinite(depth)
    padded_depth = np.where(solid, depth, 1e6)
    jump = ndimage.maximum_filter(padded_depth, 3) - ndimage.minimum_filter(padded_depth, 3)
    solid &= ~ndimage.binary_dilation(jump > MIN_EDGE_DEPTH_SHARE * np.where(solid, depth, 1.0), iterations=1)
    origins, directions = camera.rays()
    directions = directions.reshape(*image.depth.shape, 3)[rows]
    points = origins[0] + np.where(solid, depth, 0.0)[..., None] * directions
    check_cancelled()
    return Surfels(points.reshape(-1, 3), _image_normals(points, origins[0], solid)), solid


def _sample_pairs(
    log_brightness: Array, surface: Surfels, solid: Mask, rng: np.random.Generator
) -> SurfacePairs:
    """Pairs of one image, from its log brightness [H*W], pixel surfels [H*W] and mask [H,W] of surfaces."""
    points, normals = surface.points, surface.normals
    y, x = np.nonzero(solid)
    distance, angle = rng.integers(*PAIR_DISTANCE_PIXELS, len(x)), rng.uniform(0.0, 2.0 * np.pi, len(x))
    to_x = np.round(x + distance * np.cos(angle)).astype(int)
    to_y = np.round(y + distance * np.sin(angle)).astype(int)
    height, width = solid.shape
    is_valid = (to_x >= 0) & (to_x < width) & (to_y >= 0) & (to_y < height)
    first, second = (y * width + x)[is_valid], (to_y * width + to_x)[is_valid]
    offset = points[second] - points[first]
    length = np.linalg.norm(offset, axis=1)
    is_flat = np.abs((offset * normals[first]).sum(axis=1)) < 0.25 * length
    faces_alike = (normals[first] * normals[second]).sum(axis=1) > 0.95
    is_valid = solid.reshape(-1)[second] & is_flat & faces_alike
    first, second = first[is_valid], second[is_valid]
    return SurfacePairs(
        surface.take(first), surface.take(second), log_brightness[second] - log_brightness[first]
    )


def _image_normals(points: Array, eye: Array, solid: Mask) -> Array:
    """Unit normals [H*W,3], towards the eye [3], of pixels' points [H,W,3] on a surface.

    Normals come from points since the gradient of a field's density has noise of its own; normals across
    pixels that show no surface are wrong.
    """
    share = np.maximum(ndimage.uniform_filter(solid.astype(float), NORMAL_WINDOW_PIXELS), 1e-9)[..., None]
    smooth = (
        ndimage.uniform_filter(
            np.where(solid[..., None], points, 0.0), (NORMAL_WINDOW_PIXELS, NORMAL_WINDOW_PIXELS, 1)
        )
        / share
    )
    down, right = np.gradient(smooth, NORMAL_WINDOW_PIXELS, axis=(0, 1))
    normals = np.cross(right, down).reshape(-1, 3)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    faces_away = ((points.reshape(-1, 3) - eye) * normals).sum(axis=1, keepdims=True) > 0.0
    return np.where(faces_away, -normals, normals)
