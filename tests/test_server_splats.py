"""The editor on a scene of splats: the rendering process' side, and what pages are sent."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from cagefield.cameras.camera import Camera
from cagefield.cameras.keyframes import Still
from cagefield.compute import devices
from cagefield.edits import Edit, EditStack
from cagefield.errors import EditError
from cagefield.fields.splat_field import SplatField
from cagefield.geometry.cage import Cage
from cagefield.images.metrics import psnr
from cagefield.rendering.splats.raster_splats import DeformedSplats
from cagefield.scene.scene import Scene
from cagefield.server.editor.cage_placement import fit_to_content
from cagefield.server.editor.persistence import SceneStore
from cagefield.server.editor.session import Session
from cagefield.server.render_queue.coordinator import Coordinator
from cagefield.server.render_queue.scheduler import Scheduler
from cagefield.server.render_queue.splat_extent import splat_extent
from cagefield.server.render_worker.refinement import FINAL, Refinement
from cagefield.server.render_worker.renderer_cache import RendererCache
from cagefield.server.render_worker.splat_density import dense_cells
from cagefield.server.render_worker.task_handlers import TaskHandlers
from cagefield.server.render_worker.tasks import (
    Answered,
    ErrorTask,
    FitTask,
    FrameTask,
    PictureDone,
    PictureTask,
    Shown,
    Stopped,
    SurfaceTask,
    WarmStage,
    WarmTask,
    values_of,
)
from cagefield.server.render_worker.view import Display, Region
from cagefield.server.web.launch import hello_of, open_scene
from sent_pictures import pixels_of
from splat_scenes import ball_of_splats, splat_scene

SIDE = 48
INNER = Cage.box((0, 0, 0), 1.2)
MOVED = Edit.continuous(INNER, INNER.grown(0.4), lattice=128, name="ball").translate((0.25, 0, 0))
COPY = Edit.copy(INNER).translate((0, 0.6, 0.6))
CAMERA = Camera.look_at((0, -3, 0.8), (0, 0, 0), width=SIDE, height=SIDE, fov_x=0.8)
PART = Region(0, 0, SIDE, SIDE, SIDE, SIDE)


@pytest.fixture(scope="module")
def renderers() -> RendererCache:
    devices.start()
    return RendererCache(splat_scene())


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    splat_scene().save(tmp_path / "ball")
    return tmp_path / "ball"


def task(
    *edits: Edit,
    display: Display = Display(),  # noqa: B008  immutable
    moving: bool = False,
    refinement: Refinement = FINAL,
) -> PictureTask:
    return PictureTask(1, Shown(values_of(edits)), CAMERA, PART, display, moving, refinement, 0)


def picture(renderers: RendererCache, asked: PictureTask) -> np.ndarray[Any, Any]:
    done = renderers.picture(asked, lambda: False)
    assert isinstance(done, PictureDone)
    return pixels_of(done.picture, done.format, SIDE, SIDE).astype(float)


@pytest.mark.parametrize("edits", [(), (MOVED,), (COPY,), (MOVED, COPY), (Edit.delete(INNER),)])
def test_pictures_are_those_of_the_scene_at_rest_and_near_them_in_a_drag(
    renderers: RendererCache, edits: tuple[Edit, ...]
) -> None:
    frame = renderers.scene.with_edits(EditStack(edits)).render(CAMERA)
    assert np.array_equal(picture(renderers, task(*edits)), frame.rgb8())
    quick = picture(renderers, task(*edits, moving=True, refinement=Refinement.DRAFT))
    # Long steps of the flow, 1e-4 of the scene: a hundredth of a pixel.
    assert psnr(quick / 255.0, frame.rgb8() / 255.0) > 45


def test_views(renderers: RendererCache) -> None:
    depth, opacity, normals = (
        picture(renderers, task(MOVED, display=Display(view=view)))
        for view in ("depth", "opacity", "normals")
    )
    solid = opacity[..., 0] > 200
    assert 300 < solid.sum() < 1500 and (opacity[0, 0] == 0).all()
    assert depth[solid].min() > 30 and not depth[0, 0].any()
    # The ball's left side looks left, its right side right, the top up.
    row, column = np.nonzero(solid)
    assert np.corrcoef(column, normals[solid][:, 0])[0, 1] > 0.7
    assert np.corrcoef(row, normals[solid][:, 2])[0, 1] < -0.7


def test_the_surface_under_the_mouse(renderers: RendererCache) -> None:
    handlers = TaskHandlers(renderers)

    def surface(x: float, y: float, *edits: Edit) -> Any:
        done = handlers.do(SurfaceTask(1, Shown(values_of(edits)), CAMERA, x, y), lambda _: False)
        assert isinstance(done, Answered)
        return done.value

    x, y = CAMERA.project(np.zeros((1, 3)))[0][0] / SIDE
    point, normal = surface(x, y)
    # Splats have a thickness and a distance each: a twentieth of the ball's radius.
    assert np.linalg.norm(point) == pytest.approx(0.5, abs=0.03)
    assert abs(np.dot(point, normal)) / np.linalg.norm(point) > 0.9
    assert surface(0.02, 0.02) is None
    moved, _ = surface(x + 0.25 / 2.4, y, MOVED)
    assert np.linalg.norm(np.subtract(moved, (0.25, 0, 0))) == pytest.approx(0.5, abs=0.05)
    assert surface(x, y, Edit.delete(INNER)) is None


def test_a_cage_is_fitted_to_the_splats_in_it(renderers: RendererCache) -> None:
    handlers = TaskHandlers(renderers)

    def fit(cage: Cage, *edits: Edit) -> Cage:
        done = handlers.do(FitTask(1, Shown(values_of(edits)), cage), lambda _: False)
        assert isinstance(done, Answered)
        return fit_to_content(cage, np.array(done.value))

    low, high = fit(Cage.box((0.1, 0, 0), 1.9)).aabb
    # The ball's box, half a probe more and what the splats on it are wide.
    np.testing.assert_allclose([low, high], [[-0.5] * 3, [0.5] * 3], atol=0.09)
    assert (low < -0.46).all() and (high > 0.46).all()
    aside = fit(Cage.box((0.5, 0, 0), 1.9), Edit.move(INNER).translate((0.5, 0, 0)))
    np.testing.assert_allclose(aside.corners.mean(axis=0), (0.5, 0, 0), atol=0.05)
    with pytest.raises(EditError, match="nothing dense inside the inner cage"):
        fit(Cage.box((0, 0, 0), 1.2), Edit.delete(INNER))


def splats(*ones: tuple[tuple[float, float, float], tuple[float, float, float], float]) -> DeformedSplats:
    """Splats of (mean, scales along the world's axes, opacity)."""
    means, scales, opacities = (np.array([one[n] for one in ones]) for n in range(3))
    field = SplatField(
        means,
        np.log(scales),
        np.tile([1.0, 0, 0, 0], (len(means), 1)),
        opacities,
        np.zeros((len(means), 1, 3)),
    )
    return DeformedSplats.of_field(field)


def test_fog_is_not_dense_and_many_faint_splats_are() -> None:
    cage = Cage.box((0.5, 0.5, 0.5), 1.0)
    fog = ((0.5, 0.5, 0.5), (0.1, 0.1, 0.01), 0.1)
    assert not dense_cells(cage, splats(fog)).any()
    assert dense_cells(cage, splats(*[fog] * 5)).any()
    disc = dense_cells(cage, splats(((0.5, 0.5, 0.5125), (0.06, 0.03, 0.001), 0.9))).reshape(40, 40, 40)
    z, y, x = np.nonzero(disc)
    assert np.array_equal(np.unique(z), [20])
    # One and a half standard deviations, where .29 of the opacity is left: a bit less than .3 of it.
    assert np.ptp(x) * 0.025 == pytest.approx(2 * 1.0 * 0.06, abs=0.06) and np.ptp(x) > 1.5 * np.ptp(y)
    assert not dense_cells(cage, splats(((5.0, 0.5, 0.5), (0.1, 0.1, 0.1), 1.0))).any()


def test_lattices_have_no_error_and_warming_up_is_possible(renderers: RendererCache) -> None:
    handlers = TaskHandlers(renderers)
    done = handlers.do(ErrorTask(7, values_of((MOVED,))[0], 0), lambda _: False)
    assert done == Answered(7, (0.0, 0.0))
    for stage in WarmStage:
        assert handlers.do(WarmTask(1, stage), lambda _: False) == Answered(1)


def test_edits_in_a_drag_keep_their_lattices_and_are_given_up(renderers: RendererCache) -> None:
    renderer = renderers.renderer(Shown(values_of((MOVED,))), Refinement.DRAFT).renderer
    assert renderer.edits[0].edit.lattice == 128
    far = MOVED.translate((0.01, 0, 0))
    assert renderers.picture(task(far), lambda: True) == Stopped(1)


def test_jobs_write_their_pictures(renderers: RendererCache, tmp_path: Path) -> None:
    handlers = TaskHandlers(renderers)
    asked = FrameTask(
        1, 1, 0, 1, "test_views", str(tmp_path), 24.0, Shown(values_of((MOVED,))), Still(CAMERA, {}), 0
    )
    assert handlers.do(asked, lambda _: False) == Answered(1, True)
    written = np.asarray(Image.open(tmp_path / "0000.png"))
    assert np.array_equal(written, renderers.scene.with_edits(EditStack([MOVED])).render(CAMERA).rgb8())


def test_a_page_is_told_of_the_field_and_edits_are_saved(folder: Path) -> None:
    _, hello = open_scene(folder)
    field = ball_of_splats()
    assert hello.voxel == pytest.approx(field.sample_spacing) and hello.bounds[1] == (1.0, 1.0, 1.0)
    assert hello_of(Scene.open(folder), "ball").start.width == 24
    store = SceneStore(Scene.open(folder).with_edits(EditStack([MOVED])), folder)
    session = Session(store.document(), field.bounds, field.sample_spacing)
    assert [entry.edit.name for entry in session.document.entries] == ["ball"]
    store.save(session)
    again = Scene.open(folder)
    assert isinstance(again.field, SplatField) and again.edits == EditStack([MOVED])
    np.testing.assert_array_equal(again.field.means, field.means)


def test_what_differs_is_as_much_larger_as_splats_reach(folder: Path) -> None:
    scene = Scene.open(folder)
    store = SceneStore(scene, folder)
    coordinator = Coordinator(
        Session(store.document(), scene.field.bounds, scene.field.sample_spacing), store
    )
    reach = splat_extent(scene.field)
    size = 2.5 * 0.5 / np.sqrt(600)  # of the ball's discs
    assert reach == pytest.approx(3.0 * size, rel=1e-3)
    assert coordinator.spread == reach and coordinator.dispatcher.scheduler.whole_at_rest
    assert splat_extent(scene.field.take(np.zeros(0, int))) == 0.0


def test_all_of_a_picture_is_drawn_anew_at_rest() -> None:
    part = (0.25, 0.25, 0.5, 0.5)

    def redrawn(whole_at_rest: bool) -> int:
        """Pixels drawn at rest after a change of the edits that differs in a part of the picture."""
        scheduler = Scheduler(lambda *_: part, whole_at_rest=whole_at_rest)
        scheduler.join(1)
        scheduler.camera(1, 1, 80, 80, False, 0.0)

        def drawn_at_rest(now: float) -> int:
            pixels = 0
            while (request := scheduler.next(now)) is not None:
                area = request.region.width * request.region.height
                pixels += 0 if request.moving else area
                scheduler.finished(request, area, 1e-3, 0.0, FINAL)
                scheduler.presented(1, request.number)
            return pixels

        assert drawn_at_rest(1.0) + drawn_at_rest(2.0) == 80 * 80
        scheduler.edits(1, False, 3.0)
        return drawn_at_rest(3.0) + drawn_at_rest(4.0)

    assert redrawn(False) == 24 * 24
    assert redrawn(True) == 80 * 80
