"""Edited splats for download: each is baked and written by a process of its own, while pictures go on."""

from __future__ import annotations

import asyncio
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from cagefield.edits import EditStack
from cagefield.errors import CagefieldError
from cagefield.fields.splat_field import SplatField
from cagefield.files.temporary_folders import TemporaryFolder
from cagefield.selection.element_selection import Selection
from cagefield.server.editor.persistence import SceneStore, stem_of
from cagefield.server.editor.session import Session
from cagefield.server.protocol import server_messages
from cagefield.server.protocol.common import SplatForm
from cagefield.server.render_worker.subprocess_task import run_in_process
from cagefield.server.render_worker.tasks import EditValues, values_of

MAX_KEPT_FILES = 4
"""Finished files that are kept for their download; older ones are removed."""


@dataclass
class _Export:
    """A file that is being written, or is there."""

    number: int
    page: int
    name: str
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

    def begin(self, number: int, page: int, form: SplatForm) -> None:
        """Begins to write the splats as they are now; the page is told when they are there.

        Raises CagefieldError for a scene that has no splats.
        """
        if not isinstance(self._store.scene.field, SplatField):
            raise CagefieldError(
                "the scene holds voxels; `cagefield export SCENE -o x.spz` fits splats to them"
            )
        if self._folder is None:
            self._folder = TemporaryFolder("export", tidy=False)
        export = _Export(number, page, f"{self._name}.{form}")
        self._exports[number] = export
        self._tell(_message(export, "running"))
        export.task = asyncio.ensure_future(self._write(export))

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

    async def _write(self, export: _Export) -> None:
        document = self._session.document
        edits = tuple(entry.edit.without_parent for entry in document.applied if entry.edit.enabled)
        edits = tuple(e for e in edits if e.changes_anything and self._session.problem(e) is None)
        path = self._path(export)
        try:
            await run_in_process(
                write_edited,
                str(self._store.origin),
                values_of(edits),
                document.preserve_opacity,
                str(path),
                document.removed,
                document.meters_per_unit,
            )
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


def write_edited(
    scene: str,
    edits: tuple[EditValues, ...],
    preserve_opacity: bool,
    out: str,
    removed: Selection | None = None,
    meters_per_unit: float | None = None,
) -> int:
    """Writes the splats of a scene's folder under other edits, without other elements, and in another scale
    than its own; returns how many there are."""
    import dataclasses

    from cagefield.exporting import edited_splats, upright
    from cagefield.exporting.similarity import aligned_splats
    from cagefield.formats.splats.splat_files import write_splats
    from cagefield.scene.removed_elements import without_removed
    from cagefield.scene.scene import Scene

    opened = Scene.open(scene, whole=True)
    field = without_removed(opened.field, removed)
    stack = EditStack(values.edit() for values in edits)
    splats = edited_splats(
        dataclasses.replace(opened, field=field, edits=stack, preserve_opacity=preserve_opacity)
    )
    Path(out).parent.mkdir(parents=True, exist_ok=True)
    alignment = dataclasses.replace(opened.alignment, meters_per_unit=meters_per_unit)
    aligned = aligned_splats(splats, dataclasses.replace(opened, alignment=alignment))
    write_splats(upright(aligned, opened.up), out)
    return len(splats)


def _message(export: _Export, state: str, text: str = "") -> server_messages.Job:
    return server_messages.Job.model_validate(
        {
            "job": export.number,
            "page": export.page,
            "what": "splats",
            "state": state,
            "done": int(state == "done"),
            "total": 1,
            "out": export.name,
            "text": text,
        }
    )
