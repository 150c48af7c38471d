"""Edited splats for download: each is baked and written by a process of its own, while pictures go on."""

from __future__ import annotations

import asyncio
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from cagefield.edits import Edit
from cagefield.errors import CagefieldError
from cagefield.exporting.path_frames import CameraPath
from cagefield.fields.splat_field import SplatField
from cagefield.files.temporary_folders import TemporaryFolder
from cagefield.server.editor.persistence import SceneStore, stem_of
from cagefield.server.editor.session import Session
from cagefield.server.protocol import client_messages, server_messages
from cagefield.server.render_worker.edited_splats import EditedSplats, file_name, keys_of, write_edited
from cagefield.server.render_worker.subprocess_task import run_in_process
from cagefield.server.render_worker.tasks import values_of

MAX_KEPT_FILES = 4
"""Finished files that are kept for their download; older ones are removed."""


@dataclass
class _Export:
    """A file that is being written, or is there."""

    number: int
    page: int
    name: str
    frames: int = 1
    done: int = 0
    task: asyncio.Task[None] | None = None
    is_done: bool = False


class Exports:
    """The exports that go on, and the files that wait to be downloaded."""

    def __init__(
        self, session: Session, store: SceneStore, tell: Callable[[server_messages.ServerMessage], None]
    ) -> None:
        """`tell` is called with the exports' progress, for all pages."""
        self._session, self._store, self._tell = session, store, tell
        self._folder: TemporaryFolder | None = None
        self._exports: dict[int, _Export] = {}

    def begin(self, number: int, page: int, message: client_messages.ExportSplats) -> None:
        """Begins to write the splats as they are now, or those of each frame of the camera path.

        The page is told when they are there.

        Raises CagefieldError for a scene that has no splats, and for frames without a camera path.
        """
        if not isinstance(self._store.scene.field, SplatField):
            raise CagefieldError(
                "the scene holds voxels; `cagefield export SCENE -o x.spz` fits splats to them"
            )
        content = self._content(message)
        frames = 1 if content.path is None else len(content.path.stills())
        if self._folder is None:
            self._folder = TemporaryFolder("export", tidy=False)
        export = _Export(number, page, file_name(self._name, message.form, content.path is not None), frames)
        self._exports[number] = export
        self._tell(_message(export, "running"))
        export.task = asyncio.ensure_future(self._write(export, content))

    @property
    def _name(self) -> str:
        source = self._store.source
        return self._store.path.name if source is None else stem_of(source)

    def running(self) -> list[server_messages.Job]:
        """How far the exports are that go on."""
        return [_message(export, "running") for export in self._exports.values() if not export.is_done]

    def cancel(self, number: int) -> bool:
        """Ends an export; False where there is none of that number that goes on."""
        export = self._exports.get(number)
        if export is None or export.is_done or export.task is None:
            return False
        export.task.cancel()
        return True

    def file(self, number: int) -> Path | None:
        """The file of an export that is done; None where there is none."""
        export = self._exports.get(number)
        return self._path(export) if export is not None and export.is_done else None

    def close(self) -> None:
        """Cancel running exports and remove their files."""
        for export in self._exports.values():
            if export.task is not None:
                export.task.cancel()
        if self._folder is not None:
            self._folder.close()

    def _path(self, export: _Export) -> Path:
        assert self._folder is not None  # made when the first export begins
        return self._folder.path / str(export.number) / export.name

    def _content(self, message: client_messages.ExportSplats) -> EditedSplats:
        """Content of a file: the edits as they are now, numbered from 1 along the path."""
        document = self._session.document
        entries = [entry for entry in document.applied if self._is_shown(entry.edit)]
        path = None
        if message.along_path:
            places = {entry.id: place for place, entry in enumerate(entries, start=1)}
            path = CameraPath(keys_of(document.keys, places), document.loop, message.fps)
        return EditedSplats(
            str(self._store.origin),
            self._name,
            message.form,
            values_of(tuple(entry.edit.without_parent for entry in entries)),
            document.preserve_opacity,
            document.removed,
            document.meters_per_unit,
            path,
            message.splats,
        )

    def _is_shown(self, edit: Edit) -> bool:
        edit = edit.without_parent
        return edit.enabled and edit.changes_anything and self._session.problem(edit) is None

    async def _write(self, export: _Export, content: EditedSplats) -> None:
        def move(done: float) -> None:
            frames = min(int(done * export.frames + 1e-6), export.frames)
            if frames > export.done:
                export.done = frames
                self._tell(_message(export, "running"))

        path = self._path(export)
        try:
            await run_in_process(write_edited, content, str(path), on_progress=move)
        except asyncio.CancelledError:
            self._forget(export)
            self._tell(_message(export, "cancelled"))
            raise
        except CagefieldError as error:
            self._forget(export)
            self._tell(_message(export, "failed", str(error)))
            return
        export.is_done = True
        for old in [e for e in self._exports.values() if e.is_done][:-MAX_KEPT_FILES]:
            self._forget(old)
        self._tell(_message(export, "done"))

    def _forget(self, export: _Export) -> None:
        shutil.rmtree(self._path(export).parent, ignore_errors=True)
        self._exports.pop(export.number, None)


def _message(export: _Export, state: str, text: str = "") -> server_messages.Job:
    return server_messages.Job.model_validate(
        {
            "job": export.number,
            "page": export.page,
            "what": "splats",
            "state": state,
            "done": export.frames if state == "done" else export.done,
            "total": export.frames,
            "out": export.name,
            "text": text,
        }
    )
