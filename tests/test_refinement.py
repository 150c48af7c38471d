"""Refinements of edited pictures: each nearer to the final one, none awaited by a drag, all cancelled."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cagefield.cameras.camera import Camera
from cagefield.completion import patch_cache, removal_cache
from cagefield.completion import patcher as patcher_module
from cagefield.completion.lighting.ambient_occlusion import LightModel, occlusion_radii
from cagefield.completion.patch_stages import PatchStage
from cagefield.completion.surfaces import visibility
from cagefield.edits import Edit, EditStack, Move
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.cage import Cage
from cagefield.images.render_result import RenderResult
from cagefield.scene.scene import Scene
from cagefield.server.render_worker import edited_renderers, renderer_cache
from cagefield.server.render_worker.cancellation import GivenUpError
from cagefield.server.render_worker.edited_renderers import attained_refinement
from cagefield.server.render_worker.refinement import FINAL, Refinement
from cagefield.server.render_worker.renderer_cache import RendererCache
from cagefield.server.render_worker.tasks import Shown, WarmStage, values_of
from cagefield.warps.kernels import flow_forward
from cagefield.warps.kernels.affine_regions import map_regions, put_rows
from scenes import ball_field
from splat_scenes import splat_scene
from tiers import nightly_except

CAMERA = Camera.look_at((0, -3, 0.8), (0, 0, 0), width=96, height=96, fov_x=0.6)
INNER = Cage.box((0.3, 0.0, 0.2), (0.5, 0.7, 0.5))
BENT = Edit.continuous(INNER, INNER.grown(0.3), lattice=64).rotate((0.0, 0.3, 0.2)).translate((0.1, 0, 0.1))
MOVED = Edit.move(INNER).translate((0.3, 0.0, 0.4))
DELETED = Edit.delete(INNER)
EDITS = {"continuous": BENT, "move": MOVED, "delete": DELETED}


@pytest.fixture(params=["voxels", "splats"])
def cache(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> RendererCache:
    """A ball whose colors are said to follow its openness; nothing of it is on disk."""
    monkeypatch.setattr(patch_cache, "cache_root", lambda: tmp_path)
    monkeypatch.setattr(patch_cache, "MIN_CACHED_SECONDS", math.inf)
    monkeypatch.setattr(visibility, "CAMERA_COUNT", 8)
    monkeypatch.setattr(visibility, "IMAGE_SIZE_PIXELS", 120)
    scene = Scene(ball_field(resolution=49)) if request.param == "voxels" else splat_scene()
    radii = occlusion_radii(scene.patcher._voxel_field)
    scene.patcher.__dict__["light_model"] = LightModel(radii, (0.1, 0.2, 0.2, 0.2, 0.2))
    return RendererCache(scene)


def cancelled_after(checks: int) -> Callable[[], None]:
    """A `proceed` callback that raises once it was called so often."""
    numbers = itertools.count()

    def proceed() -> None:
        if next(numbers) >= checks:
            raise GivenUpError

    return proceed


@pytest.mark.parametrize("name", nightly_except(EDITS, "continuous", "move"))
def test_each_refinement_is_nearer_to_the_final_picture(cache: RendererCache, name: str) -> None:
    shown = Shown(values_of((EDITS[name],)))
    attained, distances = [], []
    final = cache.scene.with_edits(EditStack([EDITS[name]])).render(CAMERA).rgb
    for refinement in Refinement:
        made = cache.renderer(shown, refinement)
        frame = made.renderer.render(CAMERA, background=cache.scene.background)
        attained.append(made.refinement)
        distances.append(float(np.abs(frame.rgb - final).mean()))
    assert attained == sorted(attained) and attained[-1] == FINAL
    assert all(made >= asked for made, asked in zip(attained, Refinement, strict=True))
    # Nothing flickers back: 1e-4 is less than a level of 8 bits in one pixel of forty.
    assert all(b <= a + 1e-4 for a, b in itertools.pairwise(distances)), distances
    assert distances[-1] == 0.0
    if name == "continuous":
        assert distances[0] > 1e-4


@pytest.mark.parametrize("name", EDITS)
def test_a_draft_computes_no_patch(cache: RendererCache, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*args: Any, **kwargs: Any) -> None:
        raise AssertionError("a drag's picture waits for it")

    names = "build_patch build_splat_patch relight_voxels relight_splats fit_light_model render_visibility"
    for function in names.split():
        monkeypatch.setattr(patcher_module, function, refuse)
    made = cache.renderer(Shown(values_of((EDITS[name],))), Refinement.DRAFT)
    assert made.refinement < FINAL
    assert np.isfinite(made.renderer.render(CAMERA, background="white").rgb).all()


def test_maps_of_light_are_compiled_before_the_first_edit_needs_them(
    cache: RendererCache, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(renderer_cache, "numba_kernel_folder", lambda: tmp_path)
    kernels = [kernel.block for kernel in (flow_forward.march, map_regions, put_rows)]
    for kernel in kernels:
        kernel._reset_overloads()
    for stage in WarmStage:
        cache.warm(stage)
    ready = [kernel.signatures for kernel in kernels]
    assert all(ready)
    for edit in (BENT, BENT.move_corner(7, (0.05, 0.0, 0.05))):
        cache.renderer(Shown(values_of((edit,))), FINAL)
    assert [kernel.signatures for kernel in kernels] == ready
    for kernel in kernels:
        kernel._reset_overloads()
    cache.warm(WarmStage.BENT_CAGE)
    assert not any(kernel.signatures for kernel in kernels), "cached kernels are loaded by their first edit"


@pytest.mark.parametrize("name", nightly_except(EDITS, "continuous", "move"))
def test_patches_are_cancelled_from_within_and_made_whole_later(cache: RendererCache, name: str) -> None:
    patcher, edits = cache.scene.patcher, [EDITS[name]]
    calls = 0

    def count() -> None:
        nonlocal calls
        calls += 1

    patcher.prepare(edits, proceed=count)
    whole = patcher.prepare(edits)
    assert calls > 10, "work that cannot be cancelled for long"
    patcher._cache.clear()
    patcher._removals.clear()
    patcher._light_block = None
    for name in ("_visibility", "_surfels"):
        patcher.__dict__.pop(name, None)
    with pytest.raises(GivenUpError):
        patcher.prepare(edits, proceed=cancelled_after(calls // 2))
    assert patcher.prepare(edits, stage=PatchStage.CACHED)[0].patch is None
    again = patcher.prepare(edits)
    first, second = (cache.plain.with_edits(stack).render(CAMERA).rgb for stack in (whole, again))
    np.testing.assert_array_equal(first, second)


def test_visible_surfels_are_those_of_whole_images(monkeypatch: pytest.MonkeyPatch) -> None:
    """Only the part of an image around the content is processed: less margin than its windows would show."""
    monkeypatch.setattr(visibility, "IMAGE_SIZE_PIXELS", 90)
    bounds = np.array([[-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]])

    def render(camera: Camera) -> RenderResult:
        """A ramp with sharp edges in a part of the image."""
        y, x = np.mgrid[: camera.height, : camera.width].astype(np.float32)
        is_ramp = (abs(x - 0.6 * camera.width) < 20) & (abs(y - 0.4 * camera.height) < 15)
        depth = np.where(is_ramp, 3.0 + 0.002 * x + 0.001 * y, np.float32(np.inf))
        rgb = np.stack([0.2 + 0.005 * x, 0.3 + 0.004 * y, 0.5 + 0.0 * x], axis=-1)
        return RenderResult(rgb, is_ramp.astype(np.float32), depth)

    cropped, whole = [], []
    for margin, found in ((visibility.MARGIN_PIXELS, cropped), (10_000, whole)):
        monkeypatch.setattr(visibility, "MARGIN_PIXELS", margin)
        seen = visibility.render_visibility(render, [CAMERA, CAMERA.resized(128, 96)], bounds)
        found += [seen.surface.points, seen.surface.normals, seen.log_brightness, seen.hue, *seen.depths]
        found += [seen.pairs.first.points, seen.pairs.second.normals, seen.pairs.log_change]
    assert len(cropped[0]) > 500
    for part, all_pixels in zip(cropped, whole, strict=True):
        np.testing.assert_array_equal(part, all_pixels)


def test_visibility_keeps_its_images_where_it_is_cancelled(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(patch_cache, "cache_root", lambda: tmp_path)
    monkeypatch.setattr(visibility, "IMAGE_SIZE_PIXELS", 40)
    scene = Scene(ball_field(resolution=33))
    rendered: list[Camera] = []
    render = scene.patcher._render

    def counted(camera: Camera) -> Any:
        rendered.append(camera)
        return render(camera)

    patcher = scene.patcher
    patcher._render = counted  # type: ignore[method-assign]
    with pytest.raises(GivenUpError):
        patcher.warm(proceed=cancelled_after(10))
    assert 0 < len(rendered) < 28
    patcher.warm()
    # The picture that was cancelled in its middle is rendered again.
    assert 28 <= len(rendered) <= 29 and not patcher._images


def test_light_around_a_cage_is_known_before_it_is_dragged(
    cache: RendererCache, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The block around the outer cage is made at rest; a drag elsewhere takes it, and shows the same."""
    patcher, at_rest = cache.scene.patcher, BENT.replace(operations=())
    whole = cache.renderer(Shown(values_of((BENT,))), Refinement.LIT).renderer.render(CAMERA)
    patcher._cache.clear()
    patcher._light_block = None
    with pytest.raises(GivenUpError):
        patcher.warm([at_rest], proceed=cancelled_after(0))
    assert patcher._light_block is None
    cache.warm_light(Shown(values_of((at_rest,))), lambda: None)
    assert patcher._light_block is not None
    for name in ("extract_voxel_block", "extract_splat_block"):
        monkeypatch.setattr(patcher_module, name, lambda *args: pytest.fail("the block is known"))
    stack = patcher.prepare([BENT])
    assert stack[0].light is not None
    np.testing.assert_array_equal(cache.plain.with_edits(stack).render(CAMERA).rgb, whole.rgb)


@pytest.mark.parametrize(
    ("edit", "attained"),
    [
        (BENT, Refinement.INPAINTED),
        (BENT.replace(relight="none"), Refinement.INPAINTED),
        (MOVED, Refinement.DRAFT),
        (MOVED.replace(fill="none", relight="none", feather=0.0), FINAL),
        (BENT.replace(enabled=False), FINAL),
    ],
)
def test_refinements_that_change_nothing_are_known(edit: Edit, attained: Refinement) -> None:
    patcher = Scene(ball_field(resolution=33)).patcher
    patches = patcher.attained_stage(patcher.prepare([edit], stage=PatchStage.CACHED))
    assert attained_refinement(Refinement.DRAFT, [edit], patches, splits=False) == attained
    # Splats are split where an edit cuts them, which is no part of a draft.
    least = min(attained, Refinement.INPAINTED) if edit.enabled else attained
    assert attained_refinement(Refinement.DRAFT, [edit], patches, splits=True) == least
    made = FINAL if edit.relight == "none" else Refinement.EXACT
    if isinstance(edit, Move) and made < FINAL:
        return  # without its patch, which the picture of that refinement has
    for splits in (False, True):
        found = attained_refinement(Refinement.EXACT, [edit], patches, splits=splits)
        assert found == (made if edit.enabled else FINAL)


def test_what_a_part_leaves_is_found_once_for_all_its_drags(
    cache: RendererCache, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At rest, before the part moves; a drag shows the same as one for which nothing was known."""
    patcher, at_rest = cache.scene.patcher, MOVED.replace(operations=())
    whole = cache.renderer(Shown(values_of((MOVED,))), FINAL).renderer.render(CAMERA)
    patcher._cache.clear()
    patcher._removals.clear()
    cache.warm_light(Shown(values_of((at_rest,))), lambda: None)
    assert len(patcher._removals) == 1
    for name in ("remove_part", "remove_splats"):
        monkeypatch.setattr(removal_cache, name, lambda *args, **kwargs: pytest.fail("it is known"))
    for edit in (MOVED.translate((0.1, 0.0, 0.0)), MOVED):
        for stage in (PatchStage.INPAINTED, PatchStage.LIT):
            stack = patcher.prepare([edit], stage=stage)
            assert patcher.attained_stage(stack) is PatchStage.INPAINTED
    np.testing.assert_array_equal(cache.plain.with_edits(stack).render(CAMERA).rgb, whole.rgb)


def test_the_renderer_of_a_next_drag_is_made_at_rest(
    cache: RendererCache, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A part that has moved: its next drag finds the patch of a drag in the renderer that is kept."""
    for refinement in (Refinement.INPAINTED, FINAL):
        cache.renderer(Shown(values_of((MOVED,))), refinement)
    drafts = []
    renderer = cache.edited.renderer

    def kept(edits: Sequence[Edit], preserve_opacity: bool, refinement: Refinement, *args: Any) -> Any:
        drafts.append((edits[-1], refinement))
        return renderer(edits, preserve_opacity, refinement, *args)

    monkeypatch.setattr(cache.edited, "renderer", kept)
    cache.warm_light(Shown(values_of((MOVED,))), lambda: None)
    (edit, refinement), *others = drafts
    assert refinement is Refinement.DRAFT and edit.inner == MOVED.inner and not others
    shift = edit.deformed.corners - MOVED.deformed.corners
    assert 0.0 < np.abs(shift).max() < 0.01 * cache.scene.field.sample_spacing
    at_rest = MOVED.replace(operations=())
    cache.warm_light(Shown(values_of((at_rest,))), lambda: None)
    assert len(drafts) == 1


@pytest.mark.parametrize("quick", [False, True])
def test_a_drag_after_the_first_begins_with_its_infill(
    cache: RendererCache, quick: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A draft has it, which is then no draft; the final picture comes next where light takes no longer."""
    monkeypatch.setattr(edited_renderers, "MAX_MERGED_SECONDS", math.inf if quick else -1.0)
    first, second = (Shown(values_of((edit,))) for edit in (MOVED, MOVED.translate((0.1, 0.0, 0.0))))
    assert cache.renderer(first, Refinement.DRAFT).refinement is Refinement.DRAFT
    made = cache.renderer(first, Refinement.INPAINTED)
    is_sampled = isinstance(cache.scene.field, VoxelField)
    inpainted = Refinement.EXACT if is_sampled else Refinement.INPAINTED
    assert made.refinement is (FINAL if quick else inpainted)
    cache.renderer(first, FINAL)
    draft = cache.renderer(second, Refinement.DRAFT)
    assert draft.refinement is inpainted
    final = cache.renderer(second, Refinement(draft.refinement + 1))
    assert final.refinement is (FINAL if quick or is_sampled else Refinement.EXACT)
    exact = cache.scene.with_edits(EditStack([second.edits[0].edit()])).render(CAMERA).rgb
    shown = cache.renderer(second, FINAL).renderer.render(CAMERA, background=cache.scene.background).rgb
    np.testing.assert_array_equal(shown, exact)
