"""Background jobs from beginning to end: the server's side and the rendering process', without processes."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from cagefield.cameras.keyframes import Keyframe
from cagefield.compute import devices
from cagefield.errors import CagefieldError, line_of
from cagefield.scene.scene import Scene
from cagefield.server.editor.persistence import SceneStore
from cagefield.server.editor.session import Session
from cagefield.server.protocol.client_messages import RenderJob
from cagefield.server.render_queue.background import BackgroundWork
from cagefield.server.render_worker.job_files import MARK
from cagefield.server.render_worker.renderer_cache import RendererCache
from cagefield.server.render_worker.task_handlers import TaskHandlers
from cagefield.server.render_worker.tasks import EndJobTask, Failed, FrameTask, Result, Stopped
from full_disks import files_up_to
from scenes import ball_scene, files_of

devices.start()


@dataclass
class Jobs:
    """An editor's jobs, one task after the other; what pages were told."""

    folder: Path
    work: BackgroundWork
    renderers: RendererCache
    handlers: TaskHandlers
    told: list[Any] = field(default_factory=list)

    def render(self, **values: Any) -> None:
        self.work.render(RenderJob(**values))

    def step(self) -> FrameTask | EndJobTask | None:
        """Does the next task; which."""
        background = self.work.next(0)
        if background is None:
            return None
        task: Any = background.make(1)
        result: Result
        try:
            result = self.handlers.do(task, lambda _: False)
        except CagefieldError as error:
            result = Failed(1, str(error))
        except OSError as error:
            result = Failed(1, line_of(error))
        background.done(result)
        return task

    def run(self) -> None:
        """All that there is to do."""
        while self.step() is not None:
            pass

    def lose_renderer(self) -> None:
        """Another process has what comes next; the first one's files are where a kill leaves them."""
        self.handlers = TaskHandlers(self.renderers)

    @property
    def states(self) -> list[tuple[str, int]]:
        return [(message.state, message.done) for message in self.told]


@pytest.fixture
def jobs(tmp_path: Path) -> Jobs:
    """Jobs of the ball, whose camera path takes four pictures."""
    ball_scene().save(tmp_path / "scene")
    scene = Scene.open(tmp_path / "scene")
    store = SceneStore(scene, tmp_path / "scene")
    session = Session(store.document(), scene.field.bounds, scene.field.sample_spacing)
    c2w = tuple(scene.cameras["test"][0].c2w.reshape(-1).tolist())
    session.set_path(tuple(Keyframe(c2w, fov, 1.0) for fov in (40.0, 45.0)), False)
    told: list[Any] = []
    work = BackgroundWork(session, store, lambda: None, told.append)
    work.warming.clear()
    work.light_known = True
    renderers = RendererCache(scene)
    return Jobs(tmp_path, work, renderers, TaskHandlers(renderers), told)


VIDEO: dict[str, Any] = {"what": "camera_path", "out": "r.mp4", "width": 64, "height": 48, "fps": 3.0}
VIEWS: dict[str, Any] = {"what": "test_views", "out": "views", "width": 64, "height": 64}


def test_a_video_is_done_once_its_file_is_there(jobs: Jobs) -> None:
    jobs.render(**VIDEO)
    seen = []
    while (task := jobs.step()) is not None:
        seen.append((type(task), jobs.told[-1].state, (jobs.folder / "r.mp4").exists()))
    *frames, end = seen
    assert len(frames) >= 3 and set(frames) == {(FrameTask, "running", False)}
    assert end == (EndJobTask, "done", True)
    assert [job.state for job in jobs.work.jobs()] == []


def test_a_video_that_does_not_fit_at_its_end_is_not_done(jobs: Jobs) -> None:
    """ffmpeg writes when the last picture has come; the video that was there stays."""
    jobs.render(**VIDEO)
    jobs.run()
    before = files_of(jobs.folder)
    jobs.render(**VIDEO, overwrite=True)
    with files_up_to(100):  # ffmpeg takes the limit when it starts
        for _ in range(jobs.told[-1].total):
            assert isinstance(jobs.step(), FrameTask)
        assert jobs.told[-1].state == "running"
        jobs.run()
    last = jobs.told[-1]
    assert last.state == "failed" and str(jobs.folder / "r.mp4") in last.text
    assert "File too large" in last.text and "/." not in last.text
    assert files_of(jobs.folder) == before


def test_a_video_begins_again_where_its_renderer_is_lost(jobs: Jobs) -> None:
    jobs.render(**VIDEO)
    total = jobs.told[-1].total
    jobs.step()
    jobs.step()
    jobs.lose_renderer()
    jobs.run()
    counts = [("running", n) for n in range(total)]
    assert jobs.states == [*counts[:3], *counts, ("running", total), ("done", total)]
    import imageio.v3 as imageio

    assert len(imageio.imread(jobs.folder / "r.mp4")) == total


def test_a_video_whose_renderer_is_lost_at_its_end_is_not_done(jobs: Jobs) -> None:
    for result in (None, Stopped(1)):
        jobs.render(**VIDEO)
        for _ in range(jobs.told[-1].total):
            jobs.step()
        if result is None:
            jobs.lose_renderer()
            jobs.run()
        else:
            background = jobs.work.next(0)
            assert background is not None
            background.done(result)
        assert jobs.told[-1].state == "failed" and "the renderer was lost" in jobs.told[-1].text
        assert not (jobs.folder / "r.mp4").exists() and jobs.work.next(0) is None


def test_pictures_that_do_not_all_fit_leave_the_old_ones(jobs: Jobs) -> None:
    jobs.render(**VIEWS)
    jobs.run()
    views = jobs.folder / "views"
    before = files_of(views)
    assert set(before) == {MARK, "0000.png", "0001.png"} and jobs.told[-1].state == "done"
    jobs.render(**VIEWS | {"width": 400, "height": 400}, overwrite=True)
    jobs.step()
    assert files_of(views).items() >= before.items()  # the new one waits for the other
    with files_up_to(100):
        jobs.run()
    assert jobs.told[-1].state == "failed" and str(views) in jobs.told[-1].text
    assert "File too large" in jobs.told[-1].text and "/." not in jobs.told[-1].text
    assert files_of(views) == before and len(list(views.iterdir())) == 3
    jobs.render(**VIEWS | {"width": 48, "height": 48}, overwrite=True)
    jobs.run()
    after = files_of(views)
    assert set(after) == set(before) and after["0000.png"] != before["0000.png"]


def test_a_new_folder_keeps_what_fitted(jobs: Jobs) -> None:
    with files_up_to(100):
        jobs.render(**VIEWS)
        jobs.run()
    assert jobs.told[-1].state == "failed" and not (jobs.folder / "views").exists()
    jobs.render(**VIEWS)
    jobs.step()
    with files_up_to(100):
        jobs.run()
    assert jobs.states[-1] == ("failed", 1)
    assert set(files_of(jobs.folder / "views")) == {MARK, "0000.png"}


def test_a_cancelled_job_keeps_its_pictures_and_no_video(jobs: Jobs) -> None:
    for again in (False, True):
        jobs.render(**VIEWS, overwrite=again)
        jobs.step()
        jobs.work.cancel(jobs.told[-1].job)
        assert jobs.told[-1].text == "1 pictures were written and are kept"
        jobs.run()
        assert set(files_of(jobs.folder / "views")) == {MARK, "0000.png"}
    before = set(files_of(jobs.folder))
    jobs.render(**VIDEO)
    jobs.step()
    jobs.work.cancel(jobs.told[-1].job)
    jobs.run()
    assert set(files_of(jobs.folder)) == before
