"""Background tasks of the rendering process, for times when no page waits for an image.

It makes its kernels ready, finds the light of the field as soon as there is a cage or while no page asks for
anything, so that no edit waits for it, measures the lattices of edits, and renders background jobs' pictures.
"""

from __future__ import annotations

from collections.abc import Callable

from cagefield.edits import Continuous, Edit
from cagefield.errors import CagefieldError
from cagefield.server.editor.identity_cache import IdentityCache
from cagefield.server.editor.persistence import SceneStore
from cagefield.server.editor.session import Session
from cagefield.server.protocol import client_messages, common, server_messages
from cagefield.server.render_queue import jobs
from cagefield.server.render_queue.dispatcher import BackgroundTask
from cagefield.server.render_queue.jobs import Job
from cagefield.server.render_queue.splat_downloads import Exports
from cagefield.server.render_worker.tasks import (
    Answered,
    EditValues,
    EndJobTask,
    ErrorTask,
    Failed,
    LightTask,
    Result,
    Stopped,
    WarmStage,
    WarmTask,
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
    ) -> None:
        """`measured` is called when a lattice was, `tell` with jobs' progress for all pages."""
        self._session, self._store = session, store
        self._measured, self._tell = measured, tell
        self._warmed = 0
        self.warming = list(WarmStage)
        self.light_known = False
        self._errors: IdentityCache[Edit, Errors | None] = IdentityCache(64)
        self._jobs: list[Job] = []
        self._ending: list[tuple[Job, str]] = []
        self._numbers = 0
        self.exports = Exports(session, store, tell)

    def next(self, generation: int, expects_edits: bool = False) -> BackgroundTask | None:
        """Next background task, or None; tasks of older generations than `generation` are abandoned.

        `expects_edits` where an edit may follow and there is time to find the light for it.
        """
        if self.warming:
            return self._warm()
        needs_light = any(edit.relight != "none" for edit in self._session.drawn())
        if not self.light_known and (needs_light or expects_edits):
            return BackgroundTask(lambda number: LightTask(number, generation), self._light_done)
        edit = self._unmeasured()
        if edit is not None:
            return self._measure(edit, generation)
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

    # ---- lattices ----

    def errors(self) -> dict[int, Errors]:
        """(max, mean) error of each edit's lattice by its number, voxels, where it is known."""
        found = {}
        for entry in self._session.shown.entries:
            error = self._errors.get(entry.edit.without_parent)
            if error is not None:
                found[entry.id] = error
        return found

    def _unmeasured(self) -> Edit | None:
        if self._session.moving:
            return None
        shown = (edit for edit in self._session.drawn() if isinstance(edit, Continuous))
        edits = (edit for edit in shown if edit.kernel_lattice)
        return next((edit for edit in edits if edit not in self._errors), None)

    def _measure(self, edit: Edit, generation: int) -> BackgroundTask:
        values = EditValues.from_edit(edit)

        def done(result: Result) -> None:
            if isinstance(result, Stopped):
                return
            error = result.value if isinstance(result, Answered) else None
            self._errors.put(edit, error)
            if error is not None:
                self._measured()

        return BackgroundTask(lambda number: ErrorTask(number, values, generation), done)

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

    def export(self, page: int, form: common.SplatForm) -> None:
        """Begins to write the edited splats for a page. Raises CagefieldError where there are none."""
        self._numbers += 1
        self.exports.begin(self._numbers, page, form)

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
