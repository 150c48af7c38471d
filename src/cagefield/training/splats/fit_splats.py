"""Splats fitted to any field that has a renderer, its edits in them: trained on the renderer's own pictures.

The splats begin on the field's surface: at pixels of the rendered pictures, at their depths, flat along the
gradient of the density (the pictures' normals), in the colour that the field's harmonics show there. The
pictures then take the place of photos in the training (`training.splats.train_splats`), and their depths say
exactly what
lies empty before the surface.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from cagefield.cameras.camera import Camera
from cagefield.datasets.views import Dataset, View
from cagefield.errors import CagefieldError
from cagefield.files.temporary_folders import TemporaryFolder
from cagefield.images.image_files import write_png
from cagefield.images.render_result import Background, RenderResult
from cagefield.training.splats.initialization import Seeds, neighbour_distance
from cagefield.training.splats.plane_sweep import CLEAR
from cagefield.training.splats.splat_config import SplatConfig
from cagefield.training.splats.splat_run import most_splats
from cagefield.training.splats.splat_state import SplatState
from cagefield.training.splats.train_splats import SplatTrainResult, train_splat
from cagefield.typing import Array, Float32

SOLID = 0.9
"""Opacity of a pixel whose depth is that of a surface, and no mean of several."""

SEED_SHARE = 0.6
"""Splats to begin with, in shares of the most that there may be; the others come where error is left."""

WIDTH, THICKNESS = 0.7, 0.15
"""Sigmas of a first splat along and across the surface, in distances to its neighbours."""

STEP = 8.0
"""Pixels of depth from a pixel to its neighbours that are a step, and no slope."""

FIRST_OPACITY = 0.7
EMPTY_STEP = 4  # pixels along a side that share a distance up to which there is nothing

OnStage = Callable[[str, float, str], None]


class _Renderer(Protocol):
    """What draws the field: `rendering.voxels.voxel_renderer.Renderer`, or another with its `render`."""

    def render(
        self, camera: Camera, *, background: Background = "white", normals: bool = False
    ) -> RenderResult | None: ...


@dataclass(frozen=True, eq=False)
class Surface:
    """M points of a field's surface, as pictures show it.

    positions [M,3] world units; normals [M,3] unit, towards the camera's side; rgb [M,3] in [0,1].
    """

    positions: Array
    normals: Float32
    rgb: Float32

    def __len__(self) -> int:
        return len(self.positions)

    @classmethod
    def seen_in(cls, picture: RenderResult, camera: Camera) -> Surface:
        """The points at a picture's solid pixels; its normals must have been rendered."""
        if picture.normals is None:
            raise CagefieldError("a surface needs pictures with normals; render with normals=True")
        length = np.linalg.norm(picture.normals, axis=-1)
        solid = (picture.opacity > SOLID) & np.isfinite(picture.depth) & (length > 0.5)
        solid &= ~_is_step(picture.depth, solid, camera)
        rows, columns = np.nonzero(solid)
        origins, directions = camera.rays(np.stack([columns, rows], axis=1))
        distances = picture.depth[solid].astype(np.float64)[:, None]
        premultiplied = picture.over(None).rgb[solid]
        return cls(origins + distances * directions, picture.normals[solid], premultiplied)

    @classmethod
    def joined(cls, parts: Sequence[Surface]) -> Surface:
        """All parts' points. Raises CagefieldError where there are none."""
        if not any(len(part) for part in parts):
            raise CagefieldError("no camera shows a surface of the field; look at it with `cagefield render`")
        return cls(
            np.concatenate([part.positions for part in parts]),
            np.concatenate([part.normals for part in parts]),
            np.concatenate([part.rgb for part in parts]),
        )

    def take(self, rows: NDArray[np.int64]) -> Surface:
        """The points of these rows."""
        return Surface(self.positions[rows], self.normals[rows], self.rgb[rows])


def fit_splats(
    renderer: _Renderer,
    cameras: Sequence[Camera],
    held_out: Sequence[Camera],
    bounds: Array,
    config: SplatConfig,
    *,
    unbounded: bool = False,
    on_stage: OnStage = lambda stage, done, note: None,
) -> SplatTrainResult:
    """Splats that look from the cameras as the renderer's pictures do, and their figures from `held_out`.

    `bounds` [2,3] is the box of what is fitted. Of an `unbounded` field the pictures are taken over black,
    as photos without alpha; of others without any background. `on_stage` is told what is done, how far that
    is, and a note.

    Raises:
        CagefieldError: no cameras, or none that shows a surface.
    """
    behind: Background = "black" if unbounded else None
    every = [*cameras, *held_out]
    with TemporaryFolder("fit") as folder:
        chance = np.random.default_rng(config.seed)
        parts, empty, views = list[Surface](), list[Float32](), list[View]()
        wanted = int(SEED_SHARE * most_splats(cameras, config)) if cameras else 0
        for number, picture in enumerate(_pictures(renderer, every, behind, on_stage)):
            file = folder / f"{number:05d}.png"
            write_png(file, picture.rgba8() if behind is None else picture.rgb8())
            views.append(View(file.stem, every[number], file))
            if number < len(cameras):
                seen = Surface.seen_in(picture, every[number])
                parts.append(_some(seen, _share(wanted, len(cameras)), chance))
                empty.append(empty_distances(picture))
        surface = _some(Surface.joined(parts), wanted, chance)
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
            seeds=Seeds(surface_splats(surface, config.sh_degree), empty),
            on_progress=lambda progress: on_stage("Fitting", getattr(progress, "done", 0.0), str(progress)),
        )


def surface_seen(
    renderer: _Renderer,
    cameras: Sequence[Camera],
    count: int,
    *,
    seed: int = 0,
    on_stage: OnStage = lambda stage, done, note: None,
) -> Surface:
    """At most `count` points of the surface that the cameras see, drawn by chance from their pixels.

    Raises CagefieldError where they show none.
    """
    chance = np.random.default_rng(seed)
    share = _share(count, len(cameras))
    parts = [
        _some(Surface.seen_in(picture, camera), share, chance)
        for camera, picture in zip(cameras, _pictures(renderer, cameras, None, on_stage), strict=True)
    ]
    return _some(Surface.joined(parts), count, chance)


def _pictures(
    renderer: _Renderer, cameras: Sequence[Camera], behind: Background, on_stage: OnStage
) -> Iterator[RenderResult]:
    """The renderer's pictures with their normals, one after the other."""
    for number, camera in enumerate(cameras, start=1):
        picture = renderer.render(camera, background=behind, normals=True)
        if picture is None:
            raise CagefieldError("a picture of the field was given up; try again")
        on_stage("Rendering", number / len(cameras), f"picture {number} of {len(cameras)}")
        yield picture


def _is_step(depth: Float32, solid: NDArray[np.bool_], camera: Camera) -> NDArray[np.bool_]:
    """True [H,W] beside a step in depth: there a pixel's mean lies between two surfaces, and on none."""
    from scipy.ndimage import maximum_filter, minimum_filter

    far = maximum_filter(np.where(solid, depth, -np.inf), 3)
    near = minimum_filter(np.where(solid, depth, np.inf), 3)
    with np.errstate(invalid="ignore"):
        return np.asarray(far - near > STEP * near / camera.fx)


def _share(count: int, cameras: int) -> int:
    """Points to take from each of the cameras: those that see little leave room for those that see much."""
    return 4 * count // cameras + 1


def surface_splats(surface: Surface, sh_degree: int) -> SplatState:
    """Flat splats on a surface's points, their third axes along its normals."""
    width = neighbour_distance(surface.positions)
    state = SplatState.new(surface.positions, width, surface.rgb, FIRST_OPACITY, sh_degree)
    state.log_scales += np.log(np.array([WIDTH, WIDTH, THICKNESS], np.float32))
    state.quaternions[:] = turns_to(surface.normals)
    return state


def turns_to(normals: NDArray[np.floating]) -> Float32:
    """Quaternions [N,4] (w, x, y, z) of the least turns that take the axis z to unit normals [N,3].

    That is (1 + n_z, z × n), normalised; half a turn about x where n is -z.
    """
    n = np.asarray(normals, np.float64)
    q = np.stack([1.0 + n[:, 2], -n[:, 1], n[:, 0], np.zeros(len(n))], axis=1)
    q[q[:, 0] < 1e-9] = (0.0, 1.0, 0.0, 0.0)
    return np.roll(Rotation.from_quat(np.roll(q, -1, axis=1)).as_quat(), 1, axis=1).astype(np.float32)


def empty_distances(picture: RenderResult) -> Float32:
    """[2,h,w]: distances along the rays up to which a picture shows nothing, and 1 where that is known.

    For squares of EMPTY_STEP pixels, each with the least distance of its pixels: those that show anything are
    known where all of them are solid.
    """
    height, width = (side // EMPTY_STEP * EMPTY_STEP for side in picture.opacity.shape)
    if not height or not width:
        return np.zeros((2, 1, 1), np.float32)
    shape = (height // EMPTY_STEP, EMPTY_STEP, width // EMPTY_STEP, EMPTY_STEP)
    opacity = picture.opacity[:height, :width].reshape(shape)
    depth = picture.depth[:height, :width].reshape(shape).min(axis=(1, 3))
    known = (opacity.min(axis=(1, 3)) > SOLID) & np.isfinite(depth)
    return np.stack([np.where(known, CLEAR * depth, 0.0), known]).astype(np.float32)


def _some(surface: Surface, count: int, chance: np.random.Generator) -> Surface:
    """At most `count` points, drawn by chance."""
    if len(surface) <= count:
        return surface
    return surface.take(np.sort(chance.choice(len(surface), count, replace=False)))
