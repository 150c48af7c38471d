"""A scene on the machines of a cluster: the folder where they share it, else its files, sent once a worker.

A scene is known by the digest of its files' contents, so that no worker renders another scene than the one
that the client opened.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from cagefield.edits import Paste
from cagefield.errors import SceneError
from cagefield.files.temporary_folders import TemporaryFolder
from cagefield.scene.scene import Scene
from cagefield.scene.scene_files import FILES

_unpacked: dict[str, TemporaryFolder] = {}
"""Temporary folders of this process with the files of scenes, by digest."""


@dataclass(frozen=True)
class SceneSource:
    """Absolute path of a scene folder on the client's machine, and the SHA-256 digest of its contents."""

    folder: Path
    digest: str

    @classmethod
    def read(cls, folder: Path) -> SceneSource:
        """The source of a scene folder that is there."""
        return cls(folder.absolute(), content_digest(folder))

    def is_here(self) -> bool:
        """Whether the folder is on this machine, with the same contents."""
        try:
            return content_digest(self.folder) == self.digest
        except OSError:
            return False

    def find(self) -> Path:
        """The folder of the scene on this machine: its own, or the one that a `SceneArchive` unpacked.

        Raises SceneError where there is neither.
        """
        if self.digest in _unpacked:
            return _unpacked[self.digest].path
        if not self.is_here():
            raise SceneError(
                f"scene {self.folder} is not on this worker, or was changed since the start; start again"
            )
        return self.folder


class SceneArchive:
    """The files of a scene, unpacked where the worker does not see its folder.

    The scheduler sends it once to each worker, also to those that join or are started again later.
    """

    def __init__(self, source: SceneSource, contents: Mapping[str, bytes]) -> None:
        self.source, self.contents = source, dict(contents)
        self.name = f"cagefield-scene-{source.digest}"

    @classmethod
    def packed(cls, source: SceneSource, scene: Scene) -> SceneArchive:
        """The archive of a scene folder.

        Raises SceneError for a scene that pastes from others, which the archive would not hold.
        """
        if any(isinstance(edit, Paste) for edit in scene.edits):
            raise SceneError(
                f"scene {source.folder} pastes from other scenes, and workers do not see its folder; put "
                "the scenes into a folder that all machines share, under the same path"
            )
        return cls(source, {path.name: path.read_bytes() for path in _parts(source.folder)})

    def setup(self) -> None:
        """Unpacks the scene in the worker's process."""
        if self.source.digest in _unpacked or self.source.is_here():
            return
        folder = TemporaryFolder("cluster")
        for name, content in self.contents.items():
            (folder.path / name).write_bytes(content)
        _unpacked[self.source.digest] = folder

    def teardown(self) -> None:
        """Removes the unpacked scene."""
        folder = _unpacked.pop(self.source.digest, None)
        if folder is not None:
            folder.close()


def content_digest(folder: Path) -> str:
    """SHA-256 digest of the names and contents of a scene folder's own files. Raises OSError."""
    digest = hashlib.sha256()
    for path in _parts(folder):
        digest.update(f"{path.name}\0{path.stat().st_size}\0".encode())
        with path.open("rb") as file:
            while chunk := file.read(1 << 20):
                digest.update(chunk)
    return digest.hexdigest()


def _parts(folder: Path) -> list[Path]:
    return [folder / name for name in FILES if (folder / name).is_file()]
