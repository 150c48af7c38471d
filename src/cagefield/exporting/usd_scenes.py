"""USD stages of scenes of splats: each scene and each of its pastes a prim, edits as time samples.

With a camera path the stage has a time code for each frame, the splats of that frame, and a camera.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from cagefield.cameras.camera import Camera
from cagefield.edits import Paste
from cagefield.errors import CagefieldError
from cagefield.exporting import upright, upright_turn
from cagefield.exporting.path_frames import IMAGE_SIZE, CameraPath, scene_at
from cagefield.exporting.similarity import aligned_splats
from cagefield.fields.splat_field import Offset, SplatField
from cagefield.formats.splats.axes import PLY_AXES, ConvertedTable, axis_signs
from cagefield.formats.splats.splat_table import FieldTable, SplatTable
from cagefield.formats.splats.usd_stage import USD_AXES, Frame, Pose, StageInfo, camera_pose, prim_names
from cagefield.formats.splats.usd_writer import write_usd_stage
from cagefield.rendering.splats.bake_splats import baked_set
from cagefield.rendering.splats.splat_provenance import SplatSet
from cagefield.scene.scene import Scene
from cagefield.typing import Array

OWN = ""
"""Key of a scene's own splats among its parts."""


@dataclass(frozen=True)
class StageScene:
    """Scene of a stage: its name, and the direction [3] that is up in it."""

    name: str
    scene: Scene
    up: Array

    @property
    def to_stage(self) -> Array:
        """Rotation times scale [3,3] from the scene's coordinates to the stage's, which are aligned."""
        aligned = self.scene.alignment.matrix[:3, :3]
        return np.asarray(np.diag(axis_signs(PLY_AXES, USD_AXES)) @ upright_turn(self.up) @ aligned)

    @property
    def parts(self) -> tuple[str, ...]:
        """Keys of the scene's prims: its own splats, then its pastes."""
        pastes = (_paste_name(edit) for edit in self.scene.edits if isinstance(edit, Paste) and edit.enabled)
        return tuple(dict.fromkeys((OWN, *pastes)))


def edited_parts(scene: Scene) -> dict[str, SplatField]:
    """Edited splats of a scene by part: OWN, and the names of the edits that paste; none is empty.

    All of them together are `edited_splats`. Pastes of one name are one part.

    Raises:
        CagefieldError: a scene of voxels.
    """
    splats = scene.rendered_field
    if not isinstance(splats, SplatSet):
        raise CagefieldError("the scene holds voxels, no splats; export it as splats, import and edit these")
    edits = scene.prepared_edits
    baked = baked_set(splats, edits, preserve_opacity=scene.preserve_opacity)
    names = {-1: OWN}
    for step in edits.steps:
        if isinstance(step.edit, Paste) and step.pasted is not None:
            for number, part in enumerate(baked.parts):
                if part is step.pasted.splats:
                    names.setdefault(number, _paste_name(step.edit))
    result = {}
    for name in dict.fromkeys(names.values()):
        rows = np.isin(baked.origins, [number for number, of in names.items() if of == name])
        if rows.all():
            return {name: baked.field}
        if rows.any():
            result[name] = baked.field.take(rows)
    return result


def write_scenes_usd(
    path: Path,
    scenes: Sequence[StageScene],
    camera_path: CameraPath | None = None,
    *,
    on_progress: Callable[[float], None] = lambda done: None,
) -> StageInfo:
    """Write scenes of splats as one USD stage, y up, and return its content.

    Each scene is turned upright by itself and has a prim of its name, and one for each of its pastes. With a
    camera path, frame n is at time code n: the splats of `path_frames.splats_at`, and the camera of the first
    scene's path. The keyframes' parts are those of the first scene's edits; other scenes stay as they are.

    Raises:
        CagefieldError: a scene of voxels, a name of another format, or no usd-core.
        EditError: an edit that is not possible at a part that the path shows.
    """
    stills = () if camera_path is None else camera_path.stills()
    keys = [(number, part) for number, one in enumerate(scenes) for part in one.parts]
    offsets = [_offset(one) for one in scenes]
    first = scenes[0]
    info = StageInfo(
        prim_names(part or scenes[number].name for number, part in keys),
        max(_sh_degree(one.scene) for one in scenes),
        tuple(offsets[number] for number, _ in keys),
        fps=None if camera_path is None else camera_path.fps,
        frames=max(1, len(stills)),
        camera=tuple(_pose(still.camera, first.to_stage, offsets[0]) for still in stills),
        aspect=IMAGE_SIZE[0] / IMAGE_SIZE[1],
        still=frozenset(n for n, (number, _) in enumerate(keys) if number),
    )
    moments: list[Mapping[int, float] | None] = [still.parts for still in stills] or [None]
    write_usd_stage(path, info, _frames(scenes, keys, moments, info.sh_degree), on_progress)
    return info


def _frames(
    scenes: Sequence[StageScene],
    keys: Sequence[tuple[int, str]],
    moments: Sequence[Mapping[int, float] | None],
    sh_degree: int,
) -> Iterator[Frame]:
    others = [_tables(one, one.scene, sh_degree) for one in scenes[1:]]
    for parts in moments:
        scene = scenes[0].scene if parts is None else scene_at(scenes[0].scene, parts)
        tables = [_tables(scenes[0], scene, sh_degree), *others]
        yield tuple(tables[number].get(part) for number, part in keys)


def _tables(one: StageScene, scene: Scene, sh_degree: int) -> dict[str, SplatTable]:
    return {
        name: ConvertedTable(
            FieldTable(upright(aligned_splats(splats, one.scene), one.up)), USD_AXES, sh_degree
        )
        for name, splats in edited_parts(scene).items()
    }


def _paste_name(edit: Paste) -> str:
    return edit.name or Path(edit.source).stem


def _sh_degree(scene: Scene) -> int:
    splats = scene.rendered_field
    if not isinstance(splats, SplatSet):
        raise CagefieldError("the scene holds voxels, no splats; export it as splats, import and edit these")
    return splats.with_pastes(scene.prepared_edits).field.sh_degree


def _offset(one: StageScene) -> Offset:
    x, y, z = (one.to_stage @ np.array(one.scene.offset) + 0.0).tolist()
    return x, y, z


def _pose(camera: Camera, to_stage: Array, offset: Offset) -> Pose:
    pose = camera_pose(camera, to_stage)
    matrix = pose.matrix.copy()
    matrix[:3, 3] += offset
    return replace(pose, matrix=matrix)
