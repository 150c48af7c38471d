"""What of a field's surfaces its cameras see: where they are, and pairs of neighbours on them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from cagefield.cameras.camera import Camera
from cagefield.completion.surfaces.surfels import Surfels, concatenate_surfels
from cagefield.edits.stack import EditStack
from cagefield.images.render_result import RenderResult
from cagefield.typing import Array, Mask

CAMERA_COUNT = 28
"""Maximum number of rendered images."""

IMAGE_SIZE_PIXELS = 280
"""Longer edge of a rendered image, pixels."""

PAIR_DISTANCE_PIXELS = (4, 84)
"""Distance of a pair, in pixels."""

MAX_PAIRS = 40_000
"""Maximum number of pairs of neighbors."""

MAX_SURFELS = 300_000
"""Maximum number of visible surfels."""

NORMAL_WINDOW_PIXELS = 3
"""Pixels along an edge of the window that normals are found in."""

MIN_SURFACE_OPACITY = 0.5
"""Opacity from which on a pixel shows a surface."""

DEPTH_TOLERANCE_VOXELS = 0.7
"""What is so little behind what a camera shows, in voxels, is seen."""

MIN_VIEWS = 2
"""Cameras that see a surface from which on it counts as known."""

MIN_EDGE_DEPTH_SHARE = 0.03
"""A jump in depth between neighbouring pixels by this share of it is an edge."""


@dataclass(frozen=True)
class SurfacePairs:
    """Pairs of neighbours on surfaces, the first and the second [N] of each.

    log_change [N] is the log of the second's mean colour over the first's.
    """

    first: Surfels
    second: Surfels
    log_change: Array


@dataclass(frozen=True, eq=False)
class CameraVisibility:
    """What some cameras of a field see of it.

    pairs: neighbours on its surfaces; surface: what of these is seen at all, bright [N] the log of its mean
    colours, and hue [N,3] its colours over their means. depths: of each camera the distance [H,W] along the
    pixels' rays at which they end, inf where they do not.
    """

    pairs: SurfacePairs
    surface: Surfels
    bright: Array
    hue: Array
    cameras: tuple[Camera, ...]
    depths: tuple[Array, ...]

    def views_of(self, points: Array, within: float) -> NDArray[np.int64]:
        """How many of the cameras see each of some canonical points [N,3], or what is `within` before it."""
        count = np.zeros(len(points), np.int64)
        for camera, depth in zip(self.cameras, self.depths, strict=True):
            image, ahead = camera.project(points)
            shown = np.isfinite(image).all(axis=1) & (ahead > 0.0)
            pixel = np.floor(np.where(shown[:, None], image, -1.0)).astype(np.int64)
            shown &= ((pixel >= 0) & (pixel < (camera.width, camera.height))).all(axis=1)
            away = np.linalg.norm(points[shown] - camera.origin, axis=1)
            count[shown] += depth[pixel[shown, 1], pixel[shown, 0]] > away - within
        return count


def count_edited_views(
    points: Array, below: EditStack, sight: CameraVisibility, within: float
) -> NDArray[np.int64]:
    """How many cameras see points [N,3], of surfaces as the edits below make them; `within` in world units.

    What an edit below made up is as good as it gets.
    """
    mapped = below.to_canonical(points)
    count = sight.views_of(mapped.points, within)
    return np.where(mapped.layer != 0, MIN_VIEWS if within >= 0.0 else 0, count)


def render_visibility(
    render: Callable[[Camera], RenderResult], cameras: Sequence[Camera], bounds: Array, *, seed: int = 0
) -> CameraVisibility:
    """What some of a field's cameras see, by pictures.

    Without cameras it is looked at from around its bounds [2,3].
    """
    chance = np.random.default_rng(seed)
    picked = {int(n) for n in np.linspace(0, len(cameras) - 1, CAMERA_COUNT)} if cameras else set()
    chosen = tuple(
        downscale_camera(camera) for camera in [cameras[n] for n in sorted(picked)] or orbit_cameras(bounds)
    )
    pairs, surfaces, bright, hue, depths = [], [], [], [], []
    for camera in chosen:
        picture = render(camera)
        surface, solid = _image_surfels(picture, camera)
        colours = np.clip(picture.rgb.reshape(-1, 3), 0.02, 1.0)
        mean = colours.mean(axis=1)
        log = np.log(mean)
        pairs.append(_sample_pairs(log, surface, solid, chance))
        known = solid.reshape(-1) & ((surface.normals**2).sum(axis=1) > 0.5)
        surfaces.append(surface.take(known))
        bright.append(log[known])
        hue.append((colours / mean[:, None])[known])
        ends = (picture.opacity > MIN_SURFACE_OPACITY) & np.isfinite(picture.depth)
        depths.append(np.where(ends, picture.depth, np.inf).astype(np.float64))
    first, second = (
        concatenate_surfels([getattr(pair, name) for pair in pairs]) for name in ("first", "second")
    )
    seen = SurfacePairs(first, second, np.concatenate([pair.log_change for pair in pairs]))
    surface = concatenate_surfels(surfaces)
    shown = _sample_rows(len(surface.points), MAX_SURFELS, chance)
    rows = _sample_rows(len(seen.log_change), MAX_PAIRS, chance)
    seen = SurfacePairs(first.take(rows), second.take(rows), seen.log_change[rows])
    brightness, hues = (np.concatenate(each)[shown] for each in (bright, hue))
    return CameraVisibility(seen, surface.take(shown), brightness, hues, chosen, tuple(depths))


def _sample_rows(count: int, most: int, chance: np.random.Generator) -> NDArray[np.int64]:
    """Which of so many are looked at, in order: `most`, or all where there are fewer."""
    if count <= most:
        return np.arange(count)
    return np.sort(chance.choice(count, most, replace=False))


def downscale_camera(camera: Camera) -> Camera:
    """The camera with IMAGE_SIZE_PIXELS along its longer edge."""
    share = IMAGE_SIZE_PIXELS / max(camera.width, camera.height)
    return camera.resized(max(1, round(share * camera.width)), max(1, round(share * camera.height)))


def orbit_cameras(bounds: Array) -> list[Camera]:
    """CAMERA_COUNT cameras around a box [2,3], a spiral on the upper half of a sphere."""
    centre, radius = bounds.mean(axis=0), 0.5 * float(np.linalg.norm(bounds[1] - bounds[0]))
    cameras = []
    for n in range(CAMERA_COUNT):
        height = 0.1 + 0.8 * n / CAMERA_COUNT
        aside = np.sqrt(1.0 - height**2) * np.array([np.cos(2.4 * n), np.sin(2.4 * n)])
        eye = centre + 2.5 * radius * np.array([*aside, height])
        cameras.append(
            Camera.look_at(
                tuple(eye), tuple(centre), width=IMAGE_SIZE_PIXELS, height=IMAGE_SIZE_PIXELS, fov_x=0.9
            )
        )
    return cameras


def _image_surfels(picture: RenderResult, camera: Camera) -> tuple[Surfels, Mask]:
    """(the surface element of each pixel [H*W], the mask [H,W] of those that show one)."""
    depth = picture.depth
    solid = (picture.opacity > 0.98) & np.isfinite(depth)
    filled = np.where(solid, depth, 1e6)
    jump = ndimage.maximum_filter(filled, 3) - ndimage.minimum_filter(filled, 3)
    solid &= ~ndimage.binary_dilation(jump > MIN_EDGE_DEPTH_SHARE * np.where(solid, depth, 1.0), iterations=1)
    origins, directions = camera.rays()
    points = origins + np.where(solid, depth, 0.0).reshape(-1, 1) * directions
    return Surfels(points, _image_normals(points.reshape(*solid.shape, 3), origins[0], solid)), solid


def _sample_pairs(log: Array, surface: Surfels, solid: Mask, chance: np.random.Generator) -> SurfacePairs:
    """The pairs of one picture, by its pixels' logs [H*W]: the `solid` ones [H,W] show the surface [H*W]."""
    points, normals = surface.points, surface.normals
    y, x = np.nonzero(solid)
    distance, angle = chance.integers(*PAIR_DISTANCE_PIXELS, len(x)), chance.uniform(0.0, 2.0 * np.pi, len(x))
    to_x = np.round(x + distance * np.cos(angle)).astype(int)
    to_y = np.round(y + distance * np.sin(angle)).astype(int)
    height, width = solid.shape
    kept = (to_x >= 0) & (to_x < width) & (to_y >= 0) & (to_y < height)
    first, second = (y * width + x)[kept], (to_y * width + to_x)[kept]
    away = points[second] - points[first]
    length = np.linalg.norm(away, axis=1)
    flat = np.abs((away * normals[first]).sum(axis=1)) < 0.25 * length
    alike = (normals[first] * normals[second]).sum(axis=1) > 0.95
    kept = solid.reshape(-1)[second] & flat & alike
    first, second = first[kept], second[kept]
    return SurfacePairs(surface.take(first), surface.take(second), log[second] - log[first])


def _image_normals(points: Array, eye: Array, solid: Mask) -> Array:
    """Unit normals [H*W,3] of the surface that pixels' points [H,W,3] lie on, towards the eye [3].

    Of points, as a field's density has noise of its own; across pixels that show nothing they are wrong.
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
    away = ((points.reshape(-1, 3) - eye) * normals).sum(axis=1, keepdims=True) > 0.0
    return np.where(away, -normals, normals)
