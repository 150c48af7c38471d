"""The files of background jobs, in the rendering process: pictures in a folder, or one growing video."""

from __future__ import annotations

from contextlib import AbstractContextManager, suppress
from pathlib import Path
from typing import Any

from cagefield.rendering.images import video_writer, write_png
from cagefield.rendering.render_result import RenderResult
from cagefield.server.render_worker.cancellation import GivenUpError
from cagefield.server.render_worker.encoding import BEHIND
from cagefield.server.render_worker.tasks import FrameTask

MARK = ".cagefield-pictures"
"""An empty file in folders of pictures that jobs wrote, and may write again."""


class JobFiles:
    """What jobs have written so far."""

    def __init__(self) -> None:
        self._videos: dict[int, tuple[AbstractContextManager[Any], Any]] = {}

    def add(self, task: FrameTask, frame: RenderResult) -> None:
        """One picture of a job more."""
        if task.what == "test_views":
            digits = max(4, len(str(task.total - 1)))
            pixels = frame.rgba8() if frame.background is None else frame.rgb8()
            if task.index == 0:
                Path(task.out).mkdir(parents=True, exist_ok=True)
                (Path(task.out) / MARK).touch()
            write_png(Path(task.out) / f"{task.index:0{digits}d}.png", pixels)
            return
        if task.job not in self._videos:
            context = video_writer(task.out, (frame.height, frame.width), task.fps)
            self._videos[task.job] = (context, context.__enter__())
        shown = frame if frame.background is not None else frame.over(BEHIND)
        self._videos[task.job][1](shown.rgb8())

    def end(self, job: int, keep: bool) -> None:
        """A job ends: its video appears, or the unfinished file is removed."""
        if job not in self._videos:
            return
        context, _ = self._videos.pop(job)
        if keep:
            context.__exit__(None, None, None)
            return
        error = GivenUpError()
        with suppress(GivenUpError):
            context.__exit__(type(error), error, None)

    def close(self) -> None:
        """Gives up all jobs; what of their files cannot be removed stays."""
        for job in list(self._videos):
            with suppress(OSError):
                self.end(job, keep=False)
