"""Other scenes that a scene's edits paste from: scene folders, and files of splats.

Pasted content is the other scene with its own edits and pastes applied. So scenes must not paste each other
in a circle, and none itself.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np

from cagefield.cameras.camera_paths import shared_up
from cagefield.completion.pasting.paste_content import SourceContent, check_kinds, content_box
from cagefield.edits import EditStack, PreparedStack
from cagefield.edits.paste_paths import resolved
from cagefield.errors import EditError
from cagefield.files.safe_open import real_path
from cagefield.scene.scene_files import EDITS, FIELD, MANIFEST, is_scene
from cagefield.typing import Array

if TYPE_CHECKING:
    from cagefield.cameras.camera import Camera
    from cagefield.fields.splat_field import SplatField
    from cagefield.fields.voxel_field import VoxelField
    from cagefield.scene.import_splats import ImportedSplats

_SOG = ("meta.json", "lod-meta.json")
"""The files that a folder of splats, an unpacked .sog or a streamed one, is known by."""


@dataclass(frozen=True)
class SourceLook:
    """Extent of a source before its edits: box [2,3] and unit up direction [3]."""

    box: Array
    up: Array


def up_of_cameras(cameras: Mapping[str, tuple[Camera, ...]]) -> Array:
    """The unit direction [3] that is up for cameras by split; z without any."""
    poses = [camera.c2w for group in cameras.values() for camera in group]
    return shared_up(np.stack(poses)) if poses else np.array([0.0, 0.0, 1.0])


def position_beside(box: Array, up: Array, size: Array) -> Array:
    """A point [3] at the foot of a box [2,3], beside it: with room for a box of a size [3], turned anyhow."""
    middle, half = box.mean(axis=0), 0.5 * (box[1] - box[0])
    aside = np.eye(3)[int(np.argmin(np.abs(up)))]
    aside = aside - (aside @ up) * up
    aside /= np.linalg.norm(aside)
    reach = half @ np.abs(aside) + 0.5 * float(np.linalg.norm(size))
    return np.asarray(middle + reach * aside - half @ np.abs(up) * up)


class OpenedScene(Protocol):
    """Protocol of an opened source scene."""

    @property
    def up(self) -> Array: ...

    @property
    def field(self) -> VoxelField | SplatField: ...

    @property
    def preserve_opacity(self) -> bool: ...

    @property
    def prepared_edits(self) -> PreparedStack: ...


class SceneSources:
    """The scenes that one scene pastes from; the one read last is kept."""

    def __init__(
        self,
        folder: Path | None,
        open_scene: Callable[[Path, tuple[Path, ...]], OpenedScene],
        pasting: tuple[Path, ...] = (),
    ) -> None:
        """`folder` is the scene's own; `pasting` are the folders of those that it is being pasted into.

        `open_scene` opens the scene of a folder, which is being pasted into some.
        """
        own = () if folder is None else (real_path(folder),)
        self._folder, self._open, self._pasting = folder, open_scene, (*pasting, *own)
        self._last: tuple[Hashable, SourceContent] | None = None

    def state(self, source: str) -> Hashable:
        """The path of a source, and when it was written. Raises EditError for one that is not there."""
        path = self._path(source)
        parts = [path / name for name in (FIELD, EDITS, MANIFEST)] if is_scene(path) else [path]
        try:
            states = [part.stat() for part in parts]
        except OSError as error:
            raise EditError(f"it cannot be read ({error.strerror or error}); {_CURE}") from None
        return str(path), tuple((state.st_mtime_ns, state.st_size) for state in states)

    def read(self, source: str) -> SourceContent:
        """The scene of a source, edited. Raises CagefieldError where it cannot be read."""
        state = self.state(source)
        if self._last is not None and self._last[0] == state:
            return self._last[1]
        path = self._path(source)
        if is_scene(path):
            scene = self._open(path, self._pasting)
            content = SourceContent(scene.field, scene.prepared_edits, scene.preserve_opacity)
        else:
            content = SourceContent(imported_splats(path).field, EditStack([]))
        self._last = (state, content)
        return content

    def look(self, source: str, field: VoxelField | SplatField) -> SourceLook:
        """The box and the up direction of a source, to be pasted whole into a field.

        Raises CagefieldError where it cannot be.
        """
        self.state(source)
        path = self._path(source)
        if is_scene(path):
            scene = self._open(path, self._pasting)
            other, up = scene.field, scene.up
        else:
            imported = imported_splats(path)
            other, up = imported.field, up_of_cameras(imported.cameras)
        check_kinds(other, field)
        return SourceLook(content_box(other), up)

    def _path(self, source: str) -> Path:
        path = real_path(resolved(source, self._folder))
        if path in self._pasting:
            raise EditError(
                "that is the scene itself; use a copy (keep_source: true, without source)"
                if path == self._pasting[-1]
                else "these scenes paste each other in a circle; take one of the pastes away"
            )
        if not path.exists():
            raise EditError(f"nothing is at {path}; {_CURE}")
        if path.is_dir() and not (is_scene(path) or any((path / name).is_file() for name in _SOG)):
            raise EditError(f"{path} is a folder without a scene; {_CURE}")
        return path


_CURE = "put it back, give another source, or switch the edit off (enabled: false)"


def imported_splats(path: Path) -> ImportedSplats:
    """The splats of a file, or of the folder of a .sog, in the file's coordinates."""
    from cagefield.formats.splats.splat_files import read_splats
    from cagefield.scene.import_splats import import_splats

    return import_splats(read_splats(path))
