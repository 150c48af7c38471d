"""A scene as other programs want it: splats, a mesh or points, its edits baked in.

Splats of a scene of splats are its own, moved by its edits. To any other field splats are fitted
(`training.splats.fit_splats`): they are trained on the scene's own pictures, edits and all.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from cagefield.cameras.camera import Camera, turntable
from cagefield.edits import EditStack
from cagefield.edits.edit_files import load_edits, parse_edits
from cagefield.errors import CagefieldError, EditError
from cagefield.fields.baking import bake
from cagefield.fields.meshing import Mesh, extract_mesh
from cagefield.fields.sh_rotation import rotate_sh
from cagefield.fields.splat_field import SplatField
from cagefield.geometry.cage import Cage
from cagefield.rendering.edited_field import EditedField, edited_bounds
from cagefield.rendering.splats.bake_splats import baked_splats
from cagefield.rendering.splats.splat_provenance import SplatSet
from cagefield.scene.scene import Scene
from cagefield.training.splats.splat_config import SplatConfig

if TYPE_CHECKING:
    from cagefield.training.result import TrainResult
    from cagefield.training.splats.fit_splats import SurfacePoints

MAX_FITTED_SPLATS = 300_000
"""Splats that are fitted at most, unless more are asked for."""

PIXELS_PER_VOXEL = 0.5
"""Pixels of the pictures that splats are fitted to, in voxels at the middle of the field; see `side_of`."""

MAX_IMAGE_SIDE_PX = 800
MOST_VIEWS, MOST_HELD_OUT = 120, 20

FITTING_RINGS = ((-15.0, 12), (15.0, 16), (40.0, 12), (65.0, 8))
"""Elevation, degrees, and number of cameras around a scene that has none, or whose edits reach beyond it."""

FOV_X = math.radians(45.0)
OnStage = Callable[[str, float, str], None]
Cameras = tuple[tuple[Camera, ...], tuple[Camera, ...]]


def edited_splats(scene: Scene) -> SplatField:
    """The splats of a scene of splats as its edits make them. Raises EditError for an edit that cannot be."""
    splats = scene.rendered_field
    if not isinstance(splats, SplatSet):
        raise CagefieldError("the scene holds voxels, no splats; fit splats to it")
    return baked_splats(splats, scene.prepared_edits, preserve_opacity=scene.preserve_opacity)


def fitted_splats(
    scene: Scene, config: SplatConfig, on_stage: OnStage = lambda stage, done, note: None
) -> TrainResult[SplatField]:
    """Splats fitted to an edited scene of voxels, and how well cameras that they were not fitted to see them.

    Raises CagefieldError where nothing of the field can be seen.
    """
    from cagefield.training.splats.fit_splats import fit_splats
    from cagefield.training.splats.splat_run import max_splats

    cameras, held_out = fitting_cameras(scene)
    config = replace(config, splats=config.splats or min(MAX_FITTED_SPLATS, max_splats(cameras, config)))
    return fit_splats(
        scene.renderer,
        cameras,
        held_out,
        edited_bounds(scene.field.bounds, scene.prepared_edits),
        config,
        unbounded=scene.field.unbounded,
        on_stage=on_stage,
    )


def fitting_cameras(scene: Scene) -> Cameras:
    """The cameras that splats are fitted to a scene from, and those that are held out.

    The scene's train and test cameras; without the latter every eighth is held out. A bounded scene without
    cameras, or with edits that reach beyond its bounds, is also seen from rings around it.
    """
    train = tuple(
        scene.cameras.get("train") or (camera for group in scene.cameras.values() for camera in group)
    )
    test = scene.cameras.get("test", ()) if "train" in scene.cameras else ()
    bounds = edited_bounds(scene.field.bounds, scene.prepared_edits)
    beyond = not np.allclose(bounds, scene.field.bounds)
    if not train or (beyond and not scene.field.unbounded):
        train += _rings(bounds, scene.up)
    if not test:
        train, test = tuple(c for n, c in enumerate(train) if n % 8 or len(train) < 4), train[::8]
    train, test = _evenly(train, MOST_VIEWS), _evenly(test, MOST_HELD_OUT)
    middle, spacing = scene.field.center, scene.field.sample_spacing
    return tuple(_sized(c, middle, spacing) for c in train), tuple(_sized(c, middle, spacing) for c in test)


def upright(splats: SplatField, up: ArrayLike) -> SplatField:
    """The splats by quarter turns as files have them, y down, where `up` [3] is most nearly up.

    Their bounds and harmonics turn with them. Exact but for rounding of the harmonics; the splats themselves
    where y is down already.
    """
    turn = upright_turn(up)
    if (turn == np.eye(3)).all():
        return splats
    x, y, z, w = Rotation.from_matrix(turn).as_quat()
    product = np.array([[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]])
    corners = splats.bounds @ turn.T
    return replace(
        splats,
        means=splats.means @ turn.T.astype(np.float32),
        quaternions=splats.quaternions @ product.T.astype(np.float32),
        sh=rotate_sh(splats.sh, turn),
        bounds=np.stack([corners.min(axis=0), corners.max(axis=0)]),
        offset=tuple((turn @ np.array(splats.offset)).tolist()),
    )


def upright_turn(up: ArrayLike) -> NDArray[np.float64]:
    """The rotation [3,3] by quarter turns that takes the axis nearest to `up` [3] to -y."""
    up = np.asarray(up, np.float64)
    k = int(np.abs(up).argmax())
    axis = np.sign(up[k]) * np.eye(3)[k]
    down = np.array([0.0, 1.0, 0.0])
    # About axis x (-y), by a quarter turn; by none or two about x where the axis is y itself.
    turn = 0.5 * np.pi * np.cross(down, axis) if k != 1 else np.pi * max(axis[1], 0.0) * np.eye(3)[0]
    return np.round(Rotation.from_rotvec(turn).as_matrix()) + 0.0


def scene_mesh(
    scene: Scene, resolution: int | None = None, on_progress: Callable[[float], None] | None = None
) -> Mesh:
    """The surface of an edited scene, of an unbounded one that in its box of interest.

    Where the scene has edits, holds splats or is unbounded, or a `resolution` (voxels along the longest axis)
    is given, it is baked onto an even grid first. Raises FieldError where there is no surface.
    """
    field = scene.field
    edited = bool(scene.edits.active)
    if not isinstance(field, SplatField) and not (edited or field.contracted or resolution):
        return extract_mesh(field)
    bounds = edited_bounds(field.bounds, scene.prepared_edits)
    if isinstance(field, SplatField):
        source: SplatField | EditedField = replace(edited_splats(scene), bounds=bounds)
    else:
        from cagefield.edits.kernel_map import KernelMap

        source = EditedField(field, KernelMap(scene.prepared_edits), bounds, scene.preserve_opacity)
    if resolution is None:
        resolution = int(np.clip((bounds[1] - bounds[0]).max() / field.sample_spacing + 1, 64, 384))
    eyes = [camera.origin for group in scene.cameras.values() for camera in group]
    voxels = bake(
        source,
        resolution,
        bounds=bounds,
        sh_degree=min(field.sh_degree, 2),
        eyes=np.array(eyes) if eyes else None,
        on_progress=on_progress,
    )
    return extract_mesh(voxels)


def scene_points(scene: Scene, count: int, on_stage: OnStage) -> SurfacePoints:
    """At most `count` points of an edited scene's surface, drawn evenly from what its cameras see."""
    from cagefield.training.splats.fit_splats import sample_surface

    cameras, _ = fitting_cameras(scene)
    return sample_surface(scene.renderer, cameras, count, on_stage=on_stage)


def cages_of(selection: str, edits: EditStack) -> tuple[Cage, ...]:
    """The cages, in deformed space, that a selection means.

    An edit's name: its inner cage where the edit has taken it. An edit file's name: those of its edits. Or a
    cage as edit files have it: `{center: [0, 0, 1], size: [1, 1, 2]}`.

    Raises:
        EditError: none of these.
    """
    text = selection.strip()
    if text.startswith("{"):
        found = parse_edits(f"[{{adjustment: discrete, inner: {text}}}]", source="--selection", check=False)
        return tuple(edit.inner for edit in found)
    named = [edit for edit in edits if edit.name == selection]
    if named:
        return tuple(edit.deformed for edit in named)
    if text.lower().endswith((".yaml", ".yml", ".json")):
        return tuple(edit.deformed for edit in load_edits(text, check=False))
    names = ", ".join(f'"{edit.name}"' for edit in edits if edit.name) or "none has a name"
    raise EditError(
        f'--selection "{selection}" is no edit of the scene ({names}); give an edit\'s name, an edit file, '
        "or a cage such as {center: [0, 0, 1], size: [1, 1, 2]}"
    )


def inside(cages: tuple[Cage, ...], positions: NDArray[np.floating]) -> NDArray[np.bool_]:
    """True [N] where one of the cages holds a position [N,3]. Raises CagefieldError where none does."""
    held = np.zeros(len(positions), bool)
    for cage in cages:
        held |= cage.contains(np.asarray(positions, np.float64))
    if not held.any():
        raise CagefieldError("the selection holds nothing of the scene; look where its cage is in the editor")
    return held


def _sized(camera: Camera, middle: NDArray[np.float64], spacing: float) -> Camera:
    """The camera with pixels of PIXELS_PER_VOXEL voxels at the middle of the field, or its own finer ones."""
    own = max(camera.width, camera.height)
    distance = float(np.linalg.norm(camera.origin - middle))
    wanted = own * distance / (camera.fx * PIXELS_PER_VOXEL * spacing)
    side = min(MAX_IMAGE_SIDE_PX, max(own, wanted))
    return camera.resized(max(1, round(camera.width * side / own)), max(1, round(camera.height * side / own)))


def _rings(bounds: NDArray[np.float64], up: NDArray[np.float64]) -> tuple[Camera, ...]:
    radius = 0.5 * float(np.linalg.norm(bounds[1] - bounds[0])) / math.sin(0.5 * FOV_X)
    return tuple(
        camera
        for elevation, count in FITTING_RINGS
        for camera in turntable(
            bounds.mean(axis=0), radius, count, elevation=math.radians(elevation), up=up,
            width=400, height=400, fov_x=FOV_X,
        )
    )  # fmt: skip


def _evenly(cameras: tuple[Camera, ...], most: int) -> tuple[Camera, ...]:
    rows = np.unique(np.linspace(0, len(cameras) - 1, min(most, len(cameras))).round().astype(int))
    return tuple(cameras[row] for row in rows)
