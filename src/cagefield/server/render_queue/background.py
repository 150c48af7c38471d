"""Background tasks of the rendering process, for times when no page waits for an image.

It makes its kernels ready, finds the light of the field as soon as there is a cage or while no page asks for
anything, and the light around the last cage, so that no edit waits for either; it measures the lattices of
edits, and renders background jobs' pictures.
"""

from __future__ import annotations

from collections.abc import Callable

from cagefield.edits import Continuous, Copy, Delete, Edit, Move
from cagefield.errors import CagefieldError
from cagefield.server.editor.connected_edits import Wanted
from cagefield.server.editor.identity_cache import IdentityCache
from cagefield.server.editor.persistence import SceneStore
from cagefield.server.editor.session import Session
from cagefield.server.protocol import client_messages, server_messages
from cagefield.server.render_queue import jobs
from cagefield.server.render_queue.dispatcher import BackgroundTask
from cagefield.server.render_queue.jobs import Job
from cagefield.server.render_queue.splat_downloads import Exports
from cagefield.server.render_worker.tasks import (
    Answered,
    DetoursTask,
    EditValues,
    EndJobTask,
    ErrorTask,
    Failed,
    LightTask,
    Result,
    Shown,
    Stopped,
    WarmStage,
    WarmTask,
    values_of,
)

Errors = tuple[float, float]


class BackgroundWork:
    """Hands out one background task after the other."""

    def __init__(
        self,
        session: Session,
        store: SceneStore,
        measured: Callable[[], None],
        tell: Callable[[server_messages.ServerMessage], None],
        connected: Callable[[], None] = lambda: None,
        device: str = "auto",
    ) -> None:
        """`measured` is called when a lattice was, `tell` with jobs' progress for all pages, `connected` when
        detours of control points are known. Pages to download are computed on `device`.
        """
        self._session, self._store = session, store
        self._measured, self._connected, self._tell = measured, connected, tell
        self._warmed = 0
        self.warming = list(WarmStage)
        self.light_known = False
        self._lit: IdentityCache[Edit, bool] = IdentityCache(64)
        """Edits around which light is known."""
        self._errors: IdentityCache[Edit, Errors | None] = IdentityCache(64)
        self._jobs: list[Job] = []
        self._ending: list[tuple[Job, str]] = []
        self._numbers = 0
        self.exports = Exports(session, store, tell, device)

    def next(
        self, generation: int, expects_edits: bool = False, rested: bool = True
    ) -> BackgroundTask | None:
        """Next background task, or None; tasks of older generations than `generation` are abandoned.

        `expects_edits` where an edit may follow and there is time to find the light for it; not `rested`
        where a user may drag on at once: lattices are measured later.
        """
        wanted = None if self._session.moving else self._session.detours_wanted()
        if wanted is not None:
            return self._detours(wanted, generation)
        if self.warming and self.warming[0].is_for_moving:
            return self._warm()
        needs_light = any(edit.relight != "none" for edit in self._session.drawn())
        if not self.light_known and (needs_light or expects_edits):
            return BackgroundTask(lambda number: LightTask(number, generation), self._light_done)
        unlit = self._unlit()
        if unlit:
            return self._light_around(unlit, generation)
        if self.warming:
            return self._warm()
        measured = self._unmeasured() if rested else None
        if measured is not None:
            return self._measure(*measured, generation)
        if self._ending:
            return self._finish(*self._ending[0])
        return self._picture(generation) if self._jobs else None

    # ---- kernels ----

    def preparing(self) -> server_messages.Preparing:
        """How many of the stages of `RendererCache.warm` are done."""
        return server_messages.Preparing(done=self._warmed, of=len(WarmStage))

    def _warm(self) -> BackgroundTask:
        stage = self.warming.pop(0)

        def done(_: Result) -> None:
            self._warmed += 1
            self._tell(self.preparing())

        return BackgroundTask(lambda number: WarmTask(number, stage), done)

    def _light_done(self, result: Result) -> None:
        """A field whose light cannot be found says so where an edit needs it."""
        self.light_known = self.light_known or not isinstance(result, Stopped)

    def _unlit(self) -> tuple[Edit, ...]:
        """The last cage with light or infill that follows it, after the edits below; none where it is known.

        Also a cage that moves nothing yet: its first drag takes the light around it, and the infill.
        """
        if self._session.moving:
            return ()
        entries = list(self._session.shown.applied)
        for number in reversed(range(len(entries))):
            edit = entries[number].edit.without_parent
            if _depends_on_surroundings(edit):
                return () if edit in self._lit else (*self._session.drawn_below(number), edit)
        return ()

    def _light_around(self, edits: tuple[Edit, ...], generation: int) -> BackgroundTask:
        document = self._session.shown
        shown = Shown(values_of(edits), document.preserve_opacity, removed=document.removed)

        def done(result: Result) -> None:
            if not isinstance(result, Stopped):
                self._lit.put(edits[-1], True)

        return BackgroundTask(lambda number: LightTask(number, generation, shown), done)

    # ---- connected control points ----

    def _detours(self, wanted: Wanted, generation: int) -> BackgroundTask:
        below = Shown(values_of(wanted.below), removed=wanted.removed)

        def done(result: Result) -> None:
            if isinstance(result, Answered):
                self._session.detours_found(wanted, result.value)
            elif isinstance(result, Failed):
                self._session.detours_found(wanted, result.text)
            else:
                return
            self._connected()

        return BackgroundTask(lambda task: DetoursTask(task, wanted.points, below, generation), done)

    # ---- lattices ----

    def errors(self) -> dict[int, Errors]:
        """(max, mean) error of each edit's lattice by its number, voxels, where it is known."""
        found = {}
        for entry in self._session.shown.entries:
            error = self._errors.get(entry.edit.without_parent)
            if error is not None:
                found[entry.id] = error
        return found

    def _unmeasured(self) -> tuple[Edit, tuple[Edit, ...]] | None:
        """An edit whose lattice is to be measured, and those below it."""
        if self._session.moving:
            return None
        drawn = self._session.drawn()
        for number, edit in enumerate(drawn):
            if isinstance(edit, Continuous) and edit.kernel_lattice and edit not in self._errors:
                return edit, drawn[:number]
        return None

    def _measure(self, edit: Edit, below: tuple[Edit, ...], generation: int) -> BackgroundTask:
        values = EditValues.from_edit(edit)
        shown = Shown(values_of(below), removed=self._session.shown.removed)

        def done(result: Result) -> None:
            if isinstance(result, Stopped):
                return
            error = result.value if isinstance(result, Answered) else None
            self._errors.put(edit, error)
            if error is not None:
                self._measured()

        return BackgroundTask(lambda number: ErrorTask(number, values, generation, shown), done)

    # ---- jobs ----

    def jobs(self) -> list[server_messages.Job]:
        """How far the jobs that go on are."""
        finishing = (job for job, state in self._ending if state == "done")
        return [*(_message(job, "running") for job in (*finishing, *self._jobs)), *self.exports.running()]

    def render(self, message: client_messages.RenderJob) -> None:
        """Begins a job. Raises CagefieldError where it could not write its result."""
        out = self._store.place(message.out)
        self._numbers += 1
        document, size = self._session.document, (message.width, message.height)
        if message.what == "camera_path":
            job = jobs.camera_path(self._numbers, document, out, size, message.fps, message.overwrite)
        else:
            cameras = self._store.scene.cameras
            views = cameras.get("test") or next((c for c in cameras.values() if c), ())
            job = jobs.test_views(self._numbers, document, views, out, size, message.overwrite)
        self._jobs.append(job)
        self._tell(_message(job, "running"))

    def export(self, page: int, message: client_messages.ExportSplats | client_messages.ExportPage) -> None:
        """Begins to write the edited splats, or a page of the scene, for a page to download.

        Raises CagefieldError where there are no splats, or no keyframes for the frames of a path.
        """
        self._numbers += 1
        self.exports.begin(self._numbers, page, message)

    def cancel(self, number: int) -> None:
        """Ends a job. Raises CagefieldError where it is over already."""
        if self.exports.cancel(number):
            return
        job = next((job for job in self._jobs if job.number == number), None)
        if job is None:
            raise CagefieldError(f"job {number} is over already")
        self._end(job, "cancelled", "")

    def _picture(self, generation: int) -> BackgroundTask | None:
        job = self._jobs[0]
        try:
            job.task(0, generation)
        except CagefieldError as error:
            self._end(job, "failed", str(error))
            return self.next(generation)

        def done(result: Result) -> None:
            if job not in self._jobs:
                return
            if isinstance(result, Failed):
                self._end(job, "failed", result.text)
            elif isinstance(result, Answered):
                job.done = job.done + 1 if result.value else 0  # from the beginning, in another process
                if job.done == job.total:
                    self._end(job, "done", "")
                else:
                    self._tell(_message(job, "running"))

        return BackgroundTask(lambda number: job.task(number, generation), done)

    def _end(self, job: Job, state: str, text: str) -> None:
        """A job is over; one that is done is so once its files are there."""
        self._jobs.remove(job)
        self._ending.append((job, state))
        if state == "cancelled" and job.what == "test_views" and job.done:
            text = f"{job.done} pictures were written and are kept"
        self._tell(_message(job, "running" if state == "done" else state, text))

    def _finish(self, job: Job, state: str) -> BackgroundTask:
        keep = state == "done" or (state == "cancelled" and job.what == "test_views")

        def done(result: Result) -> None:
            self._ending.remove((job, state))
            if state != "done":
                return
            if isinstance(result, Answered) and result.value:
                self._tell(_message(job, "done"))
            else:
                text = result.text if isinstance(result, Failed) else "the renderer was lost; render it again"
                self._tell(_message(job, "failed", text))

        return BackgroundTask(lambda number: EndJobTask(number, job.number, keep), done)


def _depends_on_surroundings(edit: Edit) -> bool:
    """Whether light around an edit, or infill, is worth to be known before the edit moves."""
    if not edit.enabled:
        return False
    if isinstance(edit, Move | Delete) and edit.fill != "none":
        return True
    return isinstance(edit, Continuous | Move | Delete | Copy) and edit.relight != "none"


def _message(job: Job, state: str, text: str = "") -> server_messages.Job:
    return server_messages.Job.model_validate(
        {
            "job": job.number,
            "what": job.what,
            "state": state,
            "done": job.done,
            "total": job.total,
            "out": str(job.out),
            "text": text,
        }
    )
