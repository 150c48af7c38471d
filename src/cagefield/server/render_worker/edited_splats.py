"""An edited scene as a file for download: its splats, at a moment or along the camera path, or a page."""

from __future__ import annotations

import dataclasses
import zipfile
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from cagefield.cameras.keyframes import Keyframe
from cagefield.edits import EditStack, Paste
from cagefield.exporting.path_frames import CameraPath
from cagefield.fields.splat_field import SplatField
from cagefield.formats.splats.usd_writer import USD_SUFFIXES
from cagefield.scene.alignment import Alignment
from cagefield.scene.hotspots import Hotspot
from cagefield.scene.scene import Scene
from cagefield.selection.element_selection import Selection
from cagefield.server.protocol.common import SplatForm
from cagefield.server.render_worker.tasks import EditValues


@dataclass(frozen=True, kw_only=True)
class EditedScene:
    """A scene's folder under other edits, without other elements, with other alignment than its own."""

    scene: str
    name: str
    edits: tuple[EditValues, ...] = ()
    preserve_opacity: bool = True
    removed: Selection | None = None
    alignment: Alignment = dataclasses.field(default_factory=Alignment)

    def opened(self) -> Scene:
        """Scene with these edits, elements and alignment."""
        from cagefield.scene.removed_elements import without_removed

        scene = Scene.open(self.scene, whole=True)
        return dataclasses.replace(
            scene,
            field=without_removed(scene.field, self.removed),
            edits=EditStack(values.edit() for values in self.edits),
            preserve_opacity=self.preserve_opacity,
            alignment=self.alignment,
        )


@dataclass(frozen=True, kw_only=True)
class EditedSplats(EditedScene):
    """Edited splats as a file of a format.

    The keyframes of `path` name the edits by their place in `edits`, from 1; without a path the file has the
    splats of a moment.
    """

    form: SplatForm
    path: CameraPath | None = None
    splats: int | None = None
    """Maximum number of splats of a moment, beyond which they are merged; None keeps all."""

    @property
    def file_name(self) -> str:
        """Name of the file; the frames of a path are a zip archive, but for USD, and so is a streamed SOG."""
        is_archive = self.form == "lod" or (self.path is not None and not is_usd(self.form))
        return f"{self.name}.{self.form}.zip" if is_archive else f"{self.name}.{self.form}"

    @property
    def frames(self) -> int:
        """Number of frames."""
        return 1 if self.path is None else len(self.path.stills())

    def write(self, out: str, *, on_progress: Callable[[float], None] = lambda done: None) -> None:
        """Write the file; see `write_edited`."""
        write_edited(self, out, on_progress=on_progress)


@dataclass(frozen=True, kw_only=True)
class EditedPage(EditedScene):
    """A page of the edited scene (`pages.scene_page`) with its camera path and hotspots.

    Keyframes name the edits by their place in `edits`, from 1.
    """

    keys: tuple[Keyframe, ...] = ()
    loop: bool = False
    hotspots: tuple[Hotspot, ...] = ()
    levels: bool = False
    """Whether it has levels of detail; the file is then a zip archive of a folder for a web site."""
    budget: int | None = None
    device: str = "auto"

    @property
    def file_name(self) -> str:
        """Name of the file."""
        return f"{self.name}.page.zip" if self.levels else f"{self.name}.html"

    @property
    def frames(self) -> int:
        """Number of frames."""
        return 1

    def write(self, out: str, *, on_progress: Callable[[float], None] = lambda done: None) -> None:
        """Write the file. Raises CagefieldError as `ScenePage.build` does."""
        from cagefield.compute import devices
        from cagefield.files.atomic import replaced_file
        from cagefield.pages.scene_page import ScenePage

        devices.start(self.device)
        scene = dataclasses.replace(self.opened(), hotspots=self.hotspots)
        page = ScenePage.build(
            scene,
            self.name,
            self.keys,
            loop=self.loop,
            levels=self.levels,
            budget=self.budget,
            on_progress=on_progress,
        )
        path = Path(out)
        path.parent.mkdir(parents=True, exist_ok=True)
        with replaced_file(path) as draft:
            if self.levels:
                with zipfile.ZipFile(draft, "w", zipfile.ZIP_STORED) as archive:
                    for name, data in page.folder().items():
                        archive.writestr(f"{self.name}/{name}", data)
            else:
                draft.write_text(page.one_file(), encoding="utf-8")


def is_usd(form: SplatForm) -> bool:
    """Whether a format is one of USD: it holds several prims, and frames as time samples."""
    return f".{form}" in USD_SUFFIXES


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
    """Write edited splats: `out` ends as `EditedSplats.file_name`. Pastes are prims of their own in USD.

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
        turned = upright(aligned_splats(splats, scene), scene.up)
        if content.form == "lod":
            _write_levels(turned, content.name, path, on_progress)
        else:
            write_splats(turned, path, on_progress=on_progress)


def _write_levels(field: SplatField, name: str, path: Path, on_progress: Callable[[float], None]) -> None:
    """Write splats as an archive of a streamed SOG in a folder `name`."""
    from cagefield.files.atomic import replaced_file
    from cagefield.files.temporary_folders import TemporaryFolder
    from cagefield.formats.splats.detection import LOD_META
    from cagefield.formats.splats.splat_files import write_splats

    with TemporaryFolder("splats") as scratch, replaced_file(path) as draft:
        folder = scratch / "scene"
        write_splats(field, folder / LOD_META, on_progress=on_progress)
        with zipfile.ZipFile(draft, "w", zipfile.ZIP_STORED) as archive:
            for file in sorted(folder.rglob("*")):
                if file.is_file():
                    archive.write(file, f"{name}/{file.relative_to(folder).as_posix()}")
