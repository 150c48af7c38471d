"""Edited splats and pages for download: each is written by a process of its own, while pictures go on."""

from __future__ import annotations

import asyncio
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cagefield.cameras.keyframes import Keyframe
from cagefield.edits import Edit
from cagefield.errors import CagefieldError
from cagefield.exporting.path_frames import CameraPath
from cagefield.fields.splat_field import SplatField
from cagefield.files.temporary_folders import TemporaryFolder
from cagefield.scene.alignment import Alignment
from cagefield.server.editor.document import Entry
from cagefield.server.editor.persistence import SceneStore, stem_of
from cagefield.server.editor.session import Session
from cagefield.server.protocol import client_messages, server_messages
from cagefield.server.render_worker.edited_splats import EditedPage, EditedSplats, keys_of
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
    kind: str = "splats"


class Exports:
    """The exports that go on, and the files that wait to be downloaded."""

    def __init__(
        self,
        session: Session,
        store: SceneStore,
        tell: Callable[[server_messages.ServerMessage], None],
        device: str = "auto",
    ) -> None:
        """`tell` is called with the exports' progress, for all pages; `device` computes pages."""
        self._session, self._store, self._tell, self._device = session, store, tell, device
        self._folder: TemporaryFolder | None = None
        self._exports: dict[int, _Export] = {}

    def begin(
        self, number: int, page: int, message: client_messages.ExportSplats | client_messages.ExportPage
    ) -> None:
        """Begins to write the splats as they are now, those of each frame of the camera path, or a page.

        The asking page is told when they are there.

        Raises CagefieldError for a scene that has no splats, and for frames without a camera path.
        """
        has_splats = isinstance(self._store.scene.field, SplatField)
        content: EditedSplats | EditedPage
        if isinstance(message, client_messages.ExportPage):
            if message.levels:
                self._check_levels()
            content = self._page(message)
        elif has_splats:
            content = self._splats(message)
        else:
            raise CagefieldError(
                "the scene holds voxels; `cagefield export SCENE -o x.spz` fits splats to them"
            )
        if self._folder is None:
            self._folder = TemporaryFolder("export", tidy=False)
        kind = "page" if isinstance(content, EditedPage) else "splats"
        export = _Export(number, page, content.file_name, content.frames, kind=kind)
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

    def _check_levels(self) -> None:
        """Raises CagefieldError for a scene whose page has no levels of detail as files."""
        from cagefield.pages.page_nodes import COARSE_SPLATS

        field = self._store.scene.field
        if not isinstance(field, SplatField):
            raise CagefieldError("the scene holds voxels, whose pages have levels already; choose a page")
        if len(field) <= COARSE_SPLATS:
            raise CagefieldError(
                f"the scene has {len(field)} splats, no more than a coarse level: it needs no levels of "
                "detail; choose a page without"
            )

    def _splats(self, message: client_messages.ExportSplats) -> EditedSplats:
        """Content of a file of splats: the edits as they are now, numbered from 1 along the path."""
        path = None
        if message.along_path:
            if message.form == "lod":
                raise CagefieldError(
                    "a streamed SOG has the splats of a moment; choose another format for frames"
                )
            path = CameraPath(self._keys(), self._session.document.loop, message.fps)
        return EditedSplats(form=message.form, path=path, splats=message.splats, **self._scene())

    def _page(self, message: client_messages.ExportPage) -> EditedPage:
        """Content of a page: the edits as they are now, the camera path and the hotspots."""
        document = self._session.document
        return EditedPage(
            keys=self._keys(),
            loop=document.loop,
            hotspots=tuple(entry.hotspot for entry in document.hotspots),
            levels=message.levels,
            budget=message.budget if message.levels else None,
            device=self._device,
            **self._scene(),
        )

    def _scene(self) -> dict[str, Any]:
        """Fields of an `EditedScene`."""
        document = self._session.document
        return {
            "scene": str(self._store.origin),
            "name": self._name,
            "edits": values_of(tuple(entry.edit.without_parent for entry in self._entries())),
            "preserve_opacity": document.preserve_opacity,
            "removed": document.removed,
            "alignment": Alignment.from_direction(document.meters_per_unit, document.up),
        }

    def _entries(self) -> list[Entry]:
        """The shown entries in the order of application."""
        return [entry for entry in self._session.document.applied if self._is_shown(entry.edit)]

    def _keys(self) -> tuple[Keyframe, ...]:
        """The keyframes, with shown edits named by their place from 1."""
        places = {entry.id: place for place, entry in enumerate(self._entries(), start=1)}
        return keys_of(self._session.document.keys, places)

    def _is_shown(self, edit: Edit) -> bool:
        edit = edit.without_parent
        return edit.enabled and edit.changes_anything and self._session.problem(edit) is None

    async def _write(self, export: _Export, content: EditedSplats | EditedPage) -> None:
        def move(done: float) -> None:
            frames = min(int(done * export.frames + 1e-6), export.frames)
            if frames > export.done:
                export.done = frames
                self._tell(_message(export, "running"))

        path = self._path(export)
        try:
            await run_in_process(content.write, str(path), on_progress=move)
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
            "what": export.kind,
            "state": state,
            "done": export.frames if state == "done" else export.done,
            "total": export.frames,
            "out": export.name,
            "text": text,
        }
    )
