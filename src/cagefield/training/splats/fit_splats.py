"""Splats fitted to any renderable field, including its edits: trained on the renderer's images.

The initial splats lie on the field's surface: at pixels of the rendered images, at their depths, flat along
the density gradient (the rendered normals), in the rendered color. The images then replace photos in the
training (`training.splats.train_splats`), and their depths give the exact free space in front of the surface.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from cagefield.cameras.camera import Camera
from cagefield.datasets.views import Dataset, View
from cagefield.errors import CagefieldError
from cagefield.fields.splat_field import SplatField
from cagefield.files.temporary_folders import TemporaryFolder
from cagefield.images.image_files import write_png
from cagefield.images.render_result import Background, RenderResult
from cagefield.rendering.renderers import Renderer
from cagefield.training.result import TrainResult
from cagefield.training.splats.initialization import InitialSplats, neighbor_spacing
from cagefield.training.splats.plane_sweep import FREE_DISTANCE_SHARE
from cagefield.training.splats.splat_config import SplatConfig
from cagefield.training.splats.splat_run import max_splats
from cagefield.training.splats.splat_state import SplatState
from cagefield.training.splats.train_splats import train_splat
from cagefield.typing import Array, Float32

MIN_SURFACE_OPACITY = 0.9
"""Minimum opacity of a pixel whose depth belongs to one surface."""

INITIAL_SPLAT_SHARE = 0.6
"""Initial number of splats, as a share of the maximum; densification adds the others."""

WIDTH_SPACINGS, THICKNESS_SPACINGS = 0.7, 0.15
"""Initial sigmas along and across the surface, in distances to the neighboring splats."""

MIN_DEPTH_STEP_PIXELS = 8.0
"""Minimum depth difference between neighboring pixels at a depth discontinuity, in pixel footprints."""

INITIAL_OPACITY = 0.7
"""Opacity of an initial splat."""

FREE_BLOCK_PIXELS = 4
"""Side of a pixel block that shares one free distance."""

OnStage = Callable[[str, float, str], None]


@dataclass(frozen=True, eq=False)
class SurfacePoints:
    """M points of a field's surface in rendered images.

    positions [M,3] world units; normals [M,3] unit, towards the camera; rgb [M,3] in [0,1].
    """

    positions: Array
    normals: Float32
    rgb: Float32

    def __len__(self) -> int:
        return len(self.positions)

    @classmethod
    def from_render(cls, image: RenderResult, camera: Camera) -> SurfacePoints:
        """Surface points at an image's opaque pixels. Raises CagefieldError for an image without normals."""
        if image.normals is None:
            raise CagefieldError("a surface needs images with normals; render with normals=True")
        length = np.linalg.norm(image.normals, axis=-1)
        solid = (image.opacity > MIN_SURFACE_OPACITY) & np.isfinite(image.depth) & (length > 0.5)
        solid &= ~_depth_step_mask(image.depth, solid, camera)
        rows, columns = np.nonzero(solid)
        origins, directions = camera.rays(np.stack([columns, rows], axis=1))
        distances = image.depth[solid].astype(np.float64)[:, None]
        premultiplied = image.over(None).rgb[solid]
        return cls(origins + distances * directions, image.normals[solid], premultiplied)

    @classmethod
    def concatenate(cls, parts: Sequence[SurfacePoints]) -> SurfacePoints:
        """Points of all parts. Raises CagefieldError where there are none."""
        if not any(len(part) for part in parts):
            raise CagefieldError("no camera shows a surface of the field; look at it with `cagefield render`")
        return cls(
            np.concatenate([part.positions for part in parts]),
            np.concatenate([part.normals for part in parts]),
            np.concatenate([part.rgb for part in parts]),
        )

    def take(self, rows: NDArray[np.int64]) -> SurfacePoints:
        """Points of the given rows."""
        return SurfacePoints(self.positions[rows], self.normals[rows], self.rgb[rows])


def fit_splats(
    renderer: Renderer,
    cameras: Sequence[Camera],
    held_out: Sequence[Camera],
    bounds: Array,
    config: SplatConfig,
    *,
    unbounded: bool = False,
    on_stage: OnStage = lambda stage, done, note: None,
) -> TrainResult[SplatField]:
    """Splats trained on the renderer's images from `cameras`, and their metrics from `held_out`.

    `bounds` [2,3] is the box of the fitted content. Images of an `unbounded` field have a black background,
    as photos without alpha; others have none. `on_stage` gets a stage's name, its progress, and a note.

    Raises:
        CagefieldError: no cameras, or none that shows a surface.
    """
    background: Background = "black" if unbounded else None
    every = [*cameras, *held_out]
    with TemporaryFolder("fit") as folder:
        rng = np.random.default_rng(config.seed)
        parts, empty, views = list[SurfacePoints](), list[Float32](), list[View]()
        wanted = int(INITIAL_SPLAT_SHARE * max_splats(cameras, config)) if cameras else 0
        for number, image in enumerate(_render_images(renderer, every, background, on_stage)):
            path = folder / f"{number:05d}.png"
            write_png(path, image.rgba8() if background is None else image.rgb8())
            views.append(View(path.stem, every[number], path))
            if number < len(cameras):
                points = SurfacePoints.from_render(image, every[number])
                parts.append(_subsample(points, _points_per_camera(wanted, len(cameras)), rng))
                empty.append(free_distances(image))
        surface = _subsample(SurfacePoints.concatenate(parts), wanted, rng)
        dataset = Dataset(
            name="rendered",
            path=folder,
            train=tuple(views[: len(cameras)]),
            test=tuple(views[len(cameras) :]),
            val=(),
            unbounded=unbounded,
            bounds=bounds,
            white_background=not unbounded,
        )
        return train_splat(
            dataset,
            replace(config, exposure=False),
            seeds=InitialSplats(build_surface_splats(surface, config.sh_degree), empty),
            on_progress=lambda progress: on_stage("Fitting", getattr(progress, "done", 0.0), str(progress)),
        )


def sample_surface(
    renderer: Renderer,
    cameras: Sequence[Camera],
    count: int,
    *,
    seed: int = 0,
    on_stage: OnStage = lambda stage, done, note: None,
) -> SurfacePoints:
    """At most `count` points of the surface visible from the cameras, sampled at random from their pixels.

    Raises CagefieldError where the cameras show no surface.
    """
    rng = np.random.default_rng(seed)
    share = _points_per_camera(count, len(cameras))
    parts = [
        _subsample(SurfacePoints.from_render(image, camera), share, rng)
        for camera, image in zip(cameras, _render_images(renderer, cameras, None, on_stage), strict=True)
    ]
    return _subsample(SurfacePoints.concatenate(parts), count, rng)


def _render_images(
    renderer: Renderer, cameras: Sequence[Camera], background: Background, on_stage: OnStage
) -> Iterator[RenderResult]:
    """Yield the renderer's images with normals, one per camera."""
    for number, camera in enumerate(cameras, start=1):
        image = renderer.render(camera, background=background, normals=True)
        on_stage("Rendering", number / len(cameras), f"image {number} of {len(cameras)}")
        yield image


def _depth_step_mask(depth: Float32, solid: NDArray[np.bool_], camera: Camera) -> NDArray[np.bool_]:
    """Mask [H,W] of pixels beside a depth discontinuity, whose mean depth lies on no surface."""
    from scipy.ndimage import maximum_filter, minimum_filter

    far = maximum_filter(np.where(solid, depth, -np.inf), 3)
    near = minimum_filter(np.where(solid, depth, np.inf), 3)
    with np.errstate(invalid="ignore"):
        return np.asarray(far - near > MIN_DEPTH_STEP_PIXELS * near / camera.fx)


def _points_per_camera(count: int, cameras: int) -> int:
    """Points to take from each camera: an excess, so that cameras with many points make up for others."""
    return 4 * count // cameras + 1


def build_surface_splats(surface: SurfacePoints, sh_degree: int) -> SplatState:
    """Flat splats at surface points, with the third axis along the normal."""
    width = neighbor_spacing(surface.positions)
    state = SplatState.new(surface.positions, width, surface.rgb, INITIAL_OPACITY, sh_degree)
    state.log_scales += np.log(np.array([WIDTH_SPACINGS, WIDTH_SPACINGS, THICKNESS_SPACINGS], np.float32))
    state.quaternions[:] = rotations_from_z(surface.normals)
    return state


def rotations_from_z(normals: NDArray[np.floating]) -> Float32:
    """Quaternions [N,4] (w, x, y, z) of the smallest rotations from the z axis to unit normals [N,3].

    The quaternion is (1 + n_z, z x n), normalized; half a turn about x where n is -z.
    """
    n = np.asarray(normals, np.float64)
    q = np.stack([1.0 + n[:, 2], -n[:, 1], n[:, 0], np.zeros(len(n))], axis=1)
    q[q[:, 0] < 1e-9] = (0.0, 1.0, 0.0, 0.0)
    return np.roll(Rotation.from_quat(np.roll(q, -1, axis=1)).as_quat(), 1, axis=1).astype(np.float32)


def free_distances(image: RenderResult) -> Float32:
    """Free space [2,h,w] of an image: free distance along the rays, and its confidence 0 or 1.

    Values are per block of FREE_BLOCK_PIXELS pixels, with the least distance of the block. Blocks with
    content are known where all their pixels are opaque.
    """
    height, width = (side // FREE_BLOCK_PIXELS * FREE_BLOCK_PIXELS for side in image.opacity.shape)
    if not height or not width:
        return np.zeros((2, 1, 1), np.float32)
    shape = (height // FREE_BLOCK_PIXELS, FREE_BLOCK_PIXELS, width // FREE_BLOCK_PIXELS, FREE_BLOCK_PIXELS)
    opacity = image.opacity[:height, :width].reshape(shape)
    depth = image.depth[:height, :width].reshape(shape).min(axis=(1, 3))
    known = (opacity.min(axis=(1, 3)) > MIN_SURFACE_OPACITY) & np.isfinite(depth)
    return np.stack([np.where(known, FREE_DISTANCE_SHARE * depth, 0.0), known]).astype(np.float32)


def _subsample(surface: SurfacePoints, count: int, rng: np.random.Generator) -> SurfacePoints:
    """At most `count` points, sampled at random."""
    if len(surface) <= count:
        return surface
    return surface.take(np.sort(rng.choice(len(surface), count, replace=False)))
