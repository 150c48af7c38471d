"""The files of background jobs, in the rendering process: pictures in a folder, or one growing video.

Pictures that take the places of others do so together, when the job ends.
"""

from __future__ import annotations

import os
import shutil
from contextlib import AbstractContextManager, suppress
from pathlib import Path
from typing import Any

from cagefield.files.atomic import merged_folder
from cagefield.files.stale_files import remove_leftovers
from cagefield.images.image_files import video_writer, write_png
from cagefield.images.render_result import RenderResult
from cagefield.server.render_worker.cancellation import GivenUpError
from cagefield.server.render_worker.encoding import BEHIND
from cagefield.server.render_worker.tasks import FrameTask

MARK = ".cagefield-pictures"
"""An empty file in folders of pictures that jobs wrote, and may write again."""


class JobFiles:
    """Unfinished files of jobs."""

    def __init__(self) -> None:
        self._jobs: dict[int, tuple[AbstractContextManager[Any], Any]] = {}
        """Job -> (context that publishes its files, the folder or the function that takes images)."""

    def misses(self, task: FrameTask) -> bool:
        """Whether a job's pictures before this one are gone: another process has rendered them."""
        return task.index > 0 and task.job not in self._jobs

    def add(self, task: FrameTask, frame: RenderResult) -> None:
        """One picture of a job more."""
        if task.job not in self._jobs:
            context: AbstractContextManager[Any]
            if task.what == "test_views":
                remove_leftovers(Path(task.out), inside=True)
                context = merged_folder(Path(task.out))
            else:
                context = video_writer(task.out, (frame.height, frame.width), task.fps)
            self._jobs[task.job] = (context, context.__enter__())
        try:
            self._write(task, frame, self._jobs[task.job][1])
        except OSError as error:
            self._give_up(task.job, error)  # which may name its place
            raise

    def _write(self, task: FrameTask, frame: RenderResult, to: Any) -> None:
        if task.what == "camera_path":
            shown = frame if frame.background is not None else frame.over(BEHIND)
            to(shown.rgb8())
            return
        digits = max(4, len(str(task.total - 1)))
        pixels = frame.rgba8() if frame.background is None else frame.rgb8()
        if task.index == 0:
            to.mkdir(parents=True, exist_ok=True)
            (to / MARK).touch()
        write_png(to / f"{task.index:0{digits}d}.png", pixels)

    def end(self, job: int, keep: bool) -> bool:
        """Publish or remove the files of an ended job; False where it has none.

        Raises OSError where they cannot appear.
        """
        if job not in self._jobs:
            return False
        if keep:
            context, _ = self._jobs.pop(job)
            context.__exit__(None, None, None)
        else:
            self._give_up(job, GivenUpError())
        return True

    def _give_up(self, job: int, error: Exception) -> None:
        context, to = self._jobs.pop(job)
        with suppress(type(error)):
            context.__exit__(type(error), error, None)
        if isinstance(to, Path) and to.is_dir() and os.listdir(to) == [MARK]:
            shutil.rmtree(to, ignore_errors=True)

    def close(self) -> None:
        """Cancel all jobs and remove their files where possible."""
        for job in list(self._jobs):
            with suppress(OSError):
                self.end(job, keep=False)
