"""Edited splats as a file for download: those of a moment, or of each frame of the camera path."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from cagefield.cameras.keyframes import Keyframe
from cagefield.edits import EditStack, Paste
from cagefield.exporting.path_frames import CameraPath
from cagefield.formats.splats.usd_writer import USD_SUFFIXES
from cagefield.scene.scene import Scene
from cagefield.selection.element_selection import Selection
from cagefield.server.protocol.common import SplatForm
from cagefield.server.render_worker.tasks import EditValues


@dataclass(frozen=True)
class EditedSplats:
    """Splats of a scene's folder under other edits, without other elements, in another scale than its own.

    The keyframes of `path` name the edits by their place in `edits`, from 1; without a path the file has the
    splats of a moment.
    """

    scene: str
    name: str
    form: SplatForm
    edits: tuple[EditValues, ...]
    preserve_opacity: bool = True
    removed: Selection | None = None
    meters_per_unit: float | None = None
    path: CameraPath | None = None
    splats: int | None = None
    """Maximum number of splats of a moment, beyond which they are merged; None keeps all."""

    def opened(self) -> Scene:
        """Scene with these edits, elements and scale."""
        from cagefield.scene.removed_elements import without_removed

        scene = Scene.open(self.scene, whole=True)
        return dataclasses.replace(
            scene,
            field=without_removed(scene.field, self.removed),
            edits=EditStack(values.edit() for values in self.edits),
            preserve_opacity=self.preserve_opacity,
            alignment=dataclasses.replace(scene.alignment, meters_per_unit=self.meters_per_unit),
        )


def is_usd(form: SplatForm) -> bool:
    """Whether a format is one of USD: it holds several prims, and frames as time samples."""
    return f".{form}" in USD_SUFFIXES


def file_name(scene: str, form: SplatForm, along_path: bool) -> str:
    """Name of the file of a scene's splats; the frames of a path are a zip archive, but for USD."""
    return f"{scene}.{form}.zip" if along_path and not is_usd(form) else f"{scene}.{form}"


def keys_of(keys: Iterable[Keyframe], places: Mapping[int, int]) -> tuple[Keyframe, ...]:
    """Keyframes whose parts name edits by their places; parts of edits without a place are left out."""
    return tuple(
        dataclasses.replace(
            key, parts={places[number]: part for number, part in key.parts.items() if number in places}
        )
        for key in keys
    )


def write_edited(
    content: EditedSplats, out: str, *, on_progress: Callable[[float], None] = lambda done: None
) -> None:
    """Write edited splats: `out` has a name of `file_name`. Pastes are prims of their own in USD.

    Raises:
        CagefieldError: a scene of voxels, a format whose library is missing.
        EditError: an edit that is not possible at a part that the path shows.
    """
    from cagefield.exporting import edited_splats, upright
    from cagefield.exporting.sequences import write_sequence_archive
    from cagefield.exporting.similarity import aligned_splats
    from cagefield.exporting.usd_scenes import StageScene, write_scenes_usd
    from cagefield.fields.splat_decimation import decimate_splats
    from cagefield.formats.splats.splat_files import write_splats

    scene, path = content.opened(), Path(out)
    path.parent.mkdir(parents=True, exist_ok=True)
    has_prims = content.splats is None and any(isinstance(edit, Paste) for edit in scene.edits)
    if is_usd(content.form) and (content.path is not None or has_prims):
        stage = [StageScene(content.name, scene, scene.up)]
        write_scenes_usd(path, stage, content.path, on_progress=on_progress)
    elif content.path is not None:
        pattern = f"{content.name.replace('%', '_')}_%04d.{content.form}"
        write_sequence_archive(scene, content.path, path, pattern, scene.up, on_progress=on_progress)
    else:
        splats = edited_splats(scene)
        if content.splats is not None:
            splats = decimate_splats(splats, content.splats)
        write_splats(upright(aligned_splats(splats, scene), scene.up), path)
