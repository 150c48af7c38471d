"""The rendering process' side of the editor, called directly."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from PIL import Image

from cagefield.cameras.camera import Camera
from cagefield.cameras.keyframes import Keyframe, Still
from cagefield.compute import devices
from cagefield.edits import Edit, EditStack
from cagefield.errors import CagefieldError, EditError
from cagefield.geometry.cage import Cage
from cagefield.images.image_files import write_video
from cagefield.server.editor.cage_placement import PROBES_PER_AXIS, fit_to_content, probes
from cagefield.server.editor.document import Document
from cagefield.server.editor.path_edits import edits_at_time
from cagefield.server.render_queue import jobs
from cagefield.server.render_queue.background import BackgroundWork
from cagefield.server.render_worker.grid_lines import grid_lines
from cagefield.server.render_worker.job_files import MARK
from cagefield.server.render_worker.refinement import FINAL, Refinement
from cagefield.server.render_worker.renderer_cache import RendererCache
from cagefield.server.render_worker.task_handlers import SAMPLES, TaskHandlers
from cagefield.server.render_worker.tasks import (
    Answered,
    EndJobTask,
    ErrorTask,
    FitTask,
    FrameTask,
    LightTask,
    PictureDone,
    PictureTask,
    Shown,
    Stopped,
    WarmStage,
    WarmTask,
    values_of,
)
from cagefield.server.render_worker.view import Display, Region
from scenes import ball_scene
from sent_pictures import pixels_of

# Kernels: imported once a device runs.
devices.start()

from cagefield.rendering.voxels.kernels.mapped_lattice import map_points  # noqa: E402
from cagefield.rendering.voxels.kernels.march import march_tiles  # noqa: E402
from cagefield.rendering.voxels.kernels.occupancy_continuous import occupied_points  # noqa: E402
from cagefield.rendering.voxels.kernels.occupancy_discontinuous import occupied_corners  # noqa: E402

SIDE = 48
INNER = Cage.box((0, 0, 0), 1.2)
MOVED = Edit.continuous(INNER, INNER.grown(0.4), lattice=24, name="ball").translate((0.25, 0, 0))
COPY = Edit.copy(INNER).translate((0, 0.6, 0.6))
CAMERA = Camera.look_at((0, -3, 0.8), (0, 0, 0), width=SIDE, height=SIDE, fov_x=0.8)
WHOLE = Region(0, 0, SIDE, SIDE, SIDE, SIDE)


@pytest.fixture(scope="module")
def renderers() -> RendererCache:
    devices.start()
    return RendererCache(ball_scene())


def task(
    *edits: Edit,
    region: Region = WHOLE,
    display: Display = Display(),  # noqa: B008  immutable
    moving: bool = False,
    refinement: Refinement = FINAL,
) -> PictureTask:
    return PictureTask(1, Shown(values_of(edits)), CAMERA, region, display, moving, refinement, 0)


def picture(renderers: RendererCache, asked: PictureTask) -> np.ndarray[Any, Any]:
    done = renderers.picture(asked, lambda: False)
    assert isinstance(done, PictureDone)
    return pixels_of(done.picture, done.format, asked.region.width, asked.region.height).astype(float)


def test_pictures_are_those_of_the_scene(renderers: RendererCache) -> None:
    frame = renderers.scene.with_edits(EditStack([MOVED])).render(CAMERA)
    # JPEG at quality 95 with full-resolution color: errors of a few levels.
    assert np.abs(picture(renderers, task(MOVED)) - frame.rgb8()).mean() < 2.0


def test_tiles_put_together_are_the_whole_picture(renderers: RendererCache) -> None:
    whole = renderers.part(
        task(MOVED), renderers.renderer(task(MOVED).shown, FINAL).renderer, WHOLE, lambda: False
    )
    assert whole is not None
    joined = np.zeros_like(whole.rgb)
    for x, width in ((0, 16), (16, 13), (29, 19)):
        for y, height in ((0, 21), (21, 27)):
            part = renderers.part(
                task(MOVED),
                renderers.renderer(task(MOVED).shown, FINAL).renderer,
                Region(x, y, width, height, SIDE, SIDE),
                lambda: False,
            )
            assert part is not None
            joined[y : y + height, x : x + width] = part.rgb
    np.testing.assert_array_equal(joined, whole.rgb)


@pytest.mark.parametrize("edits", [(MOVED,), (COPY,), (MOVED, COPY)], ids=["continuous", "copy", "both"])
def test_quick_pictures_show_the_same(renderers: RendererCache, edits: tuple[Edit, ...]) -> None:
    # Shadows do not go along before a cage is let go, and seams do not blend.
    shown = Shown(values_of(tuple(edit.replace(relight="none", feather=0.0) for edit in edits)))
    quick = renderers.part(
        task(*edits), renderers.renderer(shown, Refinement.DRAFT).renderer, WHOLE, lambda: False
    )
    exact = renderers.part(task(*edits), renderers.renderer(shown, FINAL).renderer, WHOLE, lambda: False)
    assert quick is not None and exact is not None
    # The lattices are the same here (24 nodes), and what the coarse occupancy adds is empty; but arcs in a
    # lattice begin at the first sample in an occupied block.
    np.testing.assert_allclose(quick.rgb, exact.rgb, rtol=0.0, atol=1e-3)


def test_a_quick_lattice_is_coarser_and_close(renderers: RendererCache) -> None:
    fine = MOVED.replace(lattice=96)
    quick = renderers.renderer(Shown(values_of((fine,))), Refinement.DRAFT).renderer
    assert quick.edits[0].edit.lattice == 32
    near = renderers.part(task(fine), quick, WHOLE, lambda: False)
    assert near is not None
    exact = renderers.scene.with_edits(EditStack([fine])).render(CAMERA)
    assert np.abs(near.rgb - exact.rgb).mean() < 0.003


def test_before_leaves_the_edits_out_left_of_the_split(renderers: RendererCache) -> None:
    plain, edited = picture(renderers, task()), picture(renderers, task(MOVED))
    assert np.abs(plain - edited).max() > 100
    half = picture(renderers, task(MOVED, display=Display(split=0.5)))
    # Blocks of 8 pixels beside the split mix in a JPEG.
    assert np.abs(half[:, :16] - plain[:, :16]).max() < 12
    assert np.abs(half[:, 32:] - edited[:, 32:]).max() < 12
    assert np.abs(picture(renderers, task(MOVED, display=Display(before=True))) - plain).max() < 12
    tile = Region(32, 0, 16, SIDE, SIDE, SIDE)
    right = picture(renderers, task(MOVED, region=tile, display=Display(split=0.5)))
    assert np.abs(right - edited[:, 32:]).max() < 12


def test_views(renderers: RendererCache) -> None:
    frame = renderers.plain.render(CAMERA, background="white", normals=True)
    assert frame is not None and frame.normals is not None
    opacity = picture(renderers, task(display=Display("opacity")))
    assert np.abs(opacity[..., 0] / 255 - frame.opacity).mean() < 0.01
    normals = picture(renderers, task(display=Display("normals"))) / 127.5 - 1.0
    seen = frame.opacity > 0.99
    assert np.abs(normals[seen] - frame.normals[seen]).mean() < 0.05
    depth = picture(renderers, task(display=Display("depth")))[..., 0]
    middle, edge = depth[SIDE // 2, SIDE // 2], depth[SIDE // 2, np.flatnonzero(seen[SIDE // 2])[0]]
    assert middle > edge > 0 and depth[0, 0] < 5


def test_depths_are_distances_along_the_rays(renderers: RendererCache) -> None:
    done = renderers.picture(task(), lambda: False)
    assert isinstance(done, PictureDone)
    depth = np.frombuffer(done.depth, "<u2").reshape(SIDE, SIDE)
    frame = renderers.plain.render(CAMERA)
    assert frame is not None
    seen = frame.opacity > 0.5
    assert ((depth == 65535) == ~seen).all()
    # Rounded down to whole units of the scale.
    assert np.abs(depth[seen] * done.depth_scale - frame.depth[seen]).max() <= done.depth_scale * 1.01


def test_a_tile_nobody_wants_any_more_is_stopped(renderers: RendererCache) -> None:
    assert isinstance(renderers.picture(task(MOVED), lambda: True), Stopped)


def test_edits_that_stay_are_not_prepared_again(renderers: RendererCache) -> None:
    first = renderers.edits(values_of((MOVED, COPY)))
    again = renderers.edits(values_of((MOVED, COPY.translate((0.1, 0, 0)))))
    assert again[0] is first[0] and again[1] is not first[1]
    shown = Shown(values_of((MOVED,)))
    assert renderers.renderer(shown, FINAL) is renderers.renderer(shown, Refinement.DRAFT)


def test_an_impossible_edit_is_an_error(renderers: RendererCache) -> None:
    with pytest.raises(EditError, match="outer cage must contain"):
        renderers.picture(task(MOVED.translate((0.4, 0, 0))), lambda: False)


def test_warming_up_is_possible_for_every_stage(renderers: RendererCache) -> None:
    handlers = TaskHandlers(renderers)
    for stage in WarmStage:
        assert isinstance(handlers.do(WarmTask(1, stage), lambda _: False), Answered)


def test_what_is_warm_is_not_compiled_again_by_drags(renderers: RendererCache) -> None:
    used = [kernel._primal for kernel in (march_tiles, map_points, occupied_points, occupied_corners)]
    for kernel in used:
        kernel.reset()
    assert not any(kernel.materialized_kernels for kernel in used)
    handlers = TaskHandlers(renderers)
    for stage in WarmStage:
        handlers.do(WarmTask(1, stage), lambda _: False)
    warm = [set(kernel.materialized_kernels) for kernel in used]
    assert all(warm)
    for edit in (MOVED, Edit.delete(Cage.box((0.3, 0.1, 0.0), 0.2))):
        for moving, refinement in ((True, Refinement.DRAFT), *((False, each) for each in Refinement)):
            renderers.picture(replace(task(edit), moving=moving, refinement=refinement), lambda: False)
    assert [set(kernel.materialized_kernels) for kernel in used] == warm


def test_a_cage_is_fitted_to_what_the_edits_below_left_in_it(renderers: RendererCache) -> None:
    handlers = TaskHandlers(renderers)
    cage = Cage.box((0, 0, 0), 1.9)
    low, high = (
        fit_to_content(cage, np.array(found.value)).aabb
        for found in (
            handlers.do(FitTask(1, Shown(values_of(edits)), cage), lambda _: False)
            for edits in ((), (MOVED,))
        )
        if isinstance(found, Answered)
    )
    # The ball has radius 0.5, its density fades out over a voxel, 0.125, and probes lie 1.9 / 40 apart.
    np.testing.assert_allclose(low, [[-0.6] * 3, [0.6] * 3], atol=0.08)
    np.testing.assert_allclose(high[:, 0], low[:, 0] + 0.25, atol=0.08)
    with pytest.raises(EditError, match="nothing dense inside"):
        fit_to_content(cage, np.zeros(PROBES_PER_AXIS**3, bool))


def test_specks_do_not_count_when_a_cage_is_fitted() -> None:
    cage = Cage.box((0, 0, 0), 2.0, (0.0, 0.0, 0.4))
    points = probes(cage)
    dense = np.linalg.norm(points, axis=1) < 0.5
    dense[0] = True
    expected = Cage.box((0, 0, 0), 1.0, (0.0, 0.0, 0.4))
    np.testing.assert_allclose(fit_to_content(cage, dense).corners, expected.corners, atol=0.13)


def session_of(drawn: Callable[[], tuple[Edit, ...]], moving: bool = False) -> Any:
    """A session as background work asks it, without connected control points."""

    class Shown(SimpleNamespace):
        @property
        def applied(self) -> list[Any]:
            return [SimpleNamespace(edit=edit) for edit in drawn()]

    return SimpleNamespace(
        moving=moving,
        drawn=drawn,
        drawn_below=lambda number: drawn()[:number],
        shown=Shown(removed=None, preserve_opacity=True),
        detours_wanted=lambda: None,
    )


def test_the_grid_bends_with_the_edit() -> None:
    devices.start()
    lines = grid_lines(MOVED.replace(lattice=None))
    warp = MOVED.replace(lattice=None).warp
    points = np.concatenate([np.array(line) for line in lines])
    canonical = warp.to_canonical(points).points
    assert MOVED.outer is not None
    origin, frame = MOVED.outer.frame
    u = (canonical - origin) @ np.linalg.inv(frame).T
    # Each point lies on a line of the grid in canonical space: two of its coordinates are sixths, one of them
    # a half. 33 lattice nodes over 2.0 with a map that bends at the cages' faces: 1 % of the outer cage.
    off = np.sort(np.abs(u * 6 - np.round(u * 6)) / 6, axis=1)
    assert np.quantile(off[:, 1], 0.95) < 0.012
    assert np.abs(points - canonical).max() > 0.2
    assert grid_lines(COPY) == []


def test_the_error_of_a_lattice_is_told_in_voxels(renderers: RendererCache) -> None:
    found = TaskHandlers(renderers).do(ErrorTask(1, values_of((MOVED,))[0], 0), lambda _: False)
    assert isinstance(found, Answered)
    most, mean = MOVED.lattice_error(samples=SAMPLES)
    np.testing.assert_allclose(found.value, (most / 0.125, mean / 0.125))


def test_measuring_a_lattice_is_given_up_and_done_again_later(renderers: RendererCache) -> None:
    task = ErrorTask(1, values_of((MOVED,))[0], 0)
    stopped = TaskHandlers(renderers).do(task, lambda _: True)
    assert isinstance(stopped, Stopped)
    session = session_of(lambda: (MOVED,))
    measured = []
    background = BackgroundWork(session, Any, lambda: measured.append(1), lambda _: None)  # type: ignore[arg-type]
    background.warming, background.light_known = [], True
    background._lit.put(MOVED, True)
    # Right after a drag another one may follow.
    assert background.next(0, rested=False) is None
    background_task = background.next(0)
    assert background_task is not None
    background_task.done(stopped)
    again = background.next(1)
    assert again is not None and again.make(2) == replace(task, number=2, generation=1)
    again.done(Answered(2, (0.5, 0.1)))
    assert measured == [1] and background.next(2) is None


def test_light_is_found_once_a_cage_needs_it_and_again_where_it_was_cancelled() -> None:
    edits: tuple[Edit, ...] = (MOVED.replace(relight="none"),)
    session = session_of(lambda: edits)
    background = BackgroundWork(session, Any, lambda: None, lambda _: None)  # type: ignore[arg-type]
    background.warming = []
    background._errors.put(edits[0], None)
    assert background.next(0) is None
    edits = (MOVED,)
    background._errors.put(MOVED, None)
    for result in (Stopped(1), Answered(1)):
        light = background.next(3)
        assert light is not None and light.make(1) == LightTask(1, 3)
        light.done(result)
    for result in (Stopped(1), Answered(1)):
        around = background.next(3)
        assert around is not None and around.make(1) == LightTask(1, 3, Shown(values_of((MOVED,))))
        around.done(result)
    assert background.next(3) is None
    # Another cage above it.
    edits = (MOVED, MOVED.replace(name="second"))
    background._errors.put(edits[1], None)
    around = background.next(4)
    assert around is not None and around.make(1) == LightTask(1, 4, Shown(values_of(edits)))


def test_light_is_found_before_the_first_cage_while_there_is_time() -> None:
    session = session_of(lambda: ())
    background = BackgroundWork(session, Any, lambda: None, lambda _: None)  # type: ignore[arg-type]
    background.warming = []
    assert background.next(0) is None
    light = background.next(1, expects_edits=True)
    assert light is not None and light.make(1) == LightTask(1, 1)


def test_kernels_of_drags_are_prepared_before_light_and_those_of_light_after_it() -> None:
    session = session_of(lambda: (MOVED,))
    background = BackgroundWork(session, Any, lambda: None, lambda _: None)  # type: ignore[arg-type]
    background._errors.put(MOVED, None)
    tasks: list[WarmStage | type] = []
    while (task := background.next(0)) is not None:
        made = task.make(1)
        tasks.append(made.stage if isinstance(made, WarmTask) else type(made))
        task.done(Answered(1))
    stages = list(WarmStage)
    assert stages[-2:] == [WarmStage.LIGHT, WarmStage.BENT_CAGE]
    assert tasks == [*stages[:-2], LightTask, LightTask, *stages[-2:]]


def test_jobs_write_pictures_and_a_video_that_is_there_when_it_is_whole(
    renderers: RendererCache, tmp_path: Path
) -> None:
    handlers = TaskHandlers(renderers)
    still = Still(CAMERA, {})

    def frame(job: int, index: int, what: Any, out: Path, generation: int = 0) -> FrameTask:
        return FrameTask(1, job, index, 3, what, str(out), 10.0, Shown(()), still, generation)

    for index in range(3):
        handlers.do(frame(1, index, "test_views", tmp_path / "views"), lambda _: False)
        handlers.do(frame(2, index, "camera_path", tmp_path / "a.mp4"), lambda _: False)
        handlers.do(frame(3, index, "camera_path", tmp_path / "b.mp4"), lambda _: False)
    assert not (tmp_path / "a.mp4").exists()
    handlers.do(EndJobTask(1, 2, keep=True), lambda _: False)
    handlers.do(EndJobTask(1, 3, keep=False), lambda _: False)
    assert sorted(file.name for file in tmp_path.iterdir()) == ["a.mp4", "views"]
    shots = sorted((tmp_path / "views").glob("*.png"))
    assert [file.name for file in shots] == ["0000.png", "0001.png", "0002.png"]
    expected = renderers.scene.render(CAMERA).rgb8()
    np.testing.assert_array_equal(np.asarray(Image.open(shots[0])), expected)
    assert isinstance(
        handlers.do(frame(4, 0, "test_views", tmp_path / "no", generation=0), lambda wanted: True), Stopped
    )
    assert not (tmp_path / "no").exists()


KEYS = tuple(
    Keyframe(tuple(np.eye(4).reshape(-1)), 40.0, 1.0, parts) for parts in ({1: 0.0, 2: 0.0}, {1: 1.0})
)


def test_edits_are_blended_along_a_path() -> None:
    gone = Edit.delete(Cage.box((0.5, 0, 0), 0.1))
    document = Document.from_edits([MOVED, gone, MOVED.replace(enabled=False)], keys=KEYS)
    assert edits_at_time(document, {1: 0.0, 2: 0.0}) == ()
    half = edits_at_time(document, {1: 0.5, 2: 0.5})
    np.testing.assert_allclose(half[0].deformed.pivot, (0.125, 0, 0))
    assert half[1] == gone
    assert edits_at_time(document, {}) == (MOVED, gone)


def test_jobs_refuse_what_they_could_not_write(tmp_path: Path) -> None:
    document = Document.from_edits([], keys=KEYS)
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "a").write_text("")
    (tmp_path / "a.mp4").write_text("")
    path = jobs.camera_path
    with pytest.raises(CagefieldError, match="exists already; give another name"):
        path(1, document, tmp_path / "a.mp4", (8, 8), 24.0, overwrite=False)
    with pytest.raises(CagefieldError, match=r"ends in \.mp4"):
        path(1, document, tmp_path / "a.avi", (8, 8), 24.0, overwrite=False)
    with pytest.raises(CagefieldError, match="needs at least one keyframe"):
        path(1, Document(), tmp_path / "b.mp4", (8, 8), 24.0, overwrite=False)
    with pytest.raises(CagefieldError, match="is not empty"):
        jobs.test_views(1, document, (CAMERA,), tmp_path / "full", (8, 8), overwrite=False)
    with pytest.raises(CagefieldError, match="is a file"):
        jobs.test_views(1, document, (CAMERA,), tmp_path / "a.mp4", (8, 8), overwrite=False)
    with pytest.raises(CagefieldError, match="no cameras to render from"):
        jobs.test_views(1, document, (), tmp_path / "new", (8, 8), overwrite=False)
    with pytest.raises(CagefieldError, match="is a video that cagefield did not make, and stays"):
        path(1, document, tmp_path / "a.mp4", (8, 8), 24.0, overwrite=True)
    with pytest.raises(CagefieldError, match="holds what no editor rendered"):
        jobs.test_views(1, document, (CAMERA,), tmp_path / "full", (24, 96), overwrite=True)
    write_video(tmp_path / "a.mp4", [np.zeros((8, 8, 3), np.uint8)])
    (tmp_path / "full" / MARK).touch()
    assert path(1, document, tmp_path / "a.mp4", (8, 8), 24.0, overwrite=True).total == 25
    job = jobs.test_views(1, document, (CAMERA,), tmp_path / "full", (24, 96), overwrite=True)
    assert (job.stills[0].camera.width, job.stills[0].camera.height) == (24, 24)
