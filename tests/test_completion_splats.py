"""Patches of splats: what edits uncover is filled with splats, and light goes along, whatever draws it."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera, turntable
from cagefield.completion.continuous_relighting import light_edit
from cagefield.completion.lighting.ambient_occlusion import LightModel
from cagefield.completion.patch_stages import PatchStage
from cagefield.completion.patcher import Patcher
from cagefield.completion.splat_patch import build_splat_patch
from cagefield.completion.surfaces.splat_voxelization import voxelize_splats
from cagefield.edits import Edit, EditStack, PreparedEdit, PreparedStack
from cagefield.edits.options import Clone
from cagefield.edits.patch import NewLight, SplatPatch
from cagefield.fields.sh import C0
from cagefield.fields.splat_field import SplatField
from cagefield.geometry.cage import Cage
from cagefield.pages.page_splat_edits import (
    decode_page_splat_edits,
    encode_page_splat_edits,
)
from cagefield.rendering.splats import split_children
from cagefield.rendering.splats.bake_splats import baked_splats
from cagefield.rendering.splats.raster_splats import changed_splats, deformed_splats
from cagefield.rendering.splats.splat_motion import moved_splats
from cagefield.rendering.splats.splat_provenance import SplatSet
from cagefield.rendering.splats.splat_renderer import SplatRenderer
from cagefield.rendering.splats.splitting import split_of
from cagefield.scene.scene import Scene
from solid_fields import db
from splat_rooms import LIGHT, REACH, STEP, STRENGTH, cage, room
from tiers import nightly_after_first


def cameras(scale: float = 1.0) -> tuple[Camera, ...]:
    """Around the floor, from above."""
    return turntable((0.0, 0.0, 0.0), 3.0 * scale, 3, elevation=0.8, width=96, height=96, fov_x=0.6)


def seen(field: SplatField, edits: EditStack, scale: float = 1.0) -> NDArray[np.float32]:
    """Pictures [3,H,W,3] of a field under edits."""
    renderer = SplatRenderer(field).with_edits(edits)
    return np.stack([renderer.render(camera, background="white").rgb for camera in cameras(scale)])


def patched(field: SplatField, edit: Edit, light: LightModel | None = LIGHT) -> PreparedStack:
    """The edit with its patch."""
    return PreparedStack([PreparedEdit(edit, build_splat_patch(field, EditStack(), edit, light))])


def test_a_deleted_box_leaves_a_floor_without_a_hole_or_a_shadow():
    field, truth = room(True), seen(room(False), EditStack())
    edit = Edit.delete(cage())
    left = db(seen(field, EditStack([edit])), truth)
    filled = db(seen(field, patched(field, edit, None)), truth)
    relit = db(seen(field, patched(field, edit)), truth)
    assert left < 24.0 and filled > left + 1.5 and relit > left + 9.0


def test_a_patch_is_evaluated_once_while_its_part_is_dragged(monkeypatch):
    field, edit = room(True), Edit.move(cage())
    first, later = (edit.translate((by, 0.0, 0.0)) for by in (0.1, 0.5))
    patch = build_splat_patch(field, EditStack(), first, LIGHT, include_destination=False)
    assert isinstance(patch, SplatPatch)
    splats, evaluated, at = SplatSet.from_field(field), [], NewLight.at

    def counted(light: NewLight, points: NDArray[np.float64]) -> NDArray[np.float64]:
        evaluated.append(len(points))
        return at(light, points)

    monkeypatch.setattr(NewLight, "at", counted)
    moved_splats(splats, PreparedStack([PreparedEdit(first, patch)]))
    known = sum(evaluated)
    moved = moved_splats(splats, PreparedStack([PreparedEdit(later, patch)]))
    assert sum(evaluated) == known > 100
    alone = room(True)
    anew = moved_splats(alone, PreparedStack([PreparedEdit(later, dataclasses.replace(patch, field=alone))]))
    for name in ("left", "source", "points", "jacobian", "gains"):
        np.testing.assert_array_equal(getattr(moved, name), getattr(anew, name))


@pytest.mark.parametrize("scale", nightly_after_first([0.01, 100.0]))
def test_units_make_no_difference(scale):
    field = room(True, scale)
    size = cage().aabb[1] - cage().aabb[0]
    edit = Edit.delete(Cage.box(scale * cage().aabb.mean(axis=0), scale * size))
    light = LightModel((scale * REACH,), (STRENGTH,))
    there = seen(field, patched(field, edit, light), scale)
    usual = room(True)
    # The box's lowest row lies on the cage's floor: rounding decides on which side, which leaves a thin line.
    assert db(there, seen(usual, patched(usual, Edit.delete(cage())))) > 35.0


def test_fill_is_of_splats_of_its_color_that_look_the_same_all_around():
    """Whatever the nearest ones are: every other splat shimmers, and what is in shade is dark."""
    field = room(True)
    sh = np.zeros((len(field), 4, 3), np.float32)
    sh[:, :1] = field.sh
    sh[::2, 1:] = 0.8
    field = dataclasses.replace(field, sh=sh)
    patch = build_splat_patch(field, EditStack(), Edit.delete(cage()), LIGHT)
    assert len(patch.sources) > 50
    assert (np.abs(field.sh[patch.sources, 1:]).max(axis=(1, 2)) == 0.0).mean() > 0.95
    assert (np.abs(np.log(patch.gains)) < 0.3).mean() > 0.95


def strips() -> SplatField:
    """A gray floor of splats that are long along x."""
    y = np.arange(-0.8, 0.81, 0.05)
    x = np.tile([-0.4, 0.4], len(y))
    means = np.stack([x, np.repeat(y, 2), np.zeros(2 * len(y))], axis=1)
    return SplatField(
        means,
        np.broadcast_to(np.log([0.3, 0.04, 0.005]), means.shape),
        np.tile([1.0, 0.0, 0.0, 0.0], (len(means), 1)),
        np.full(len(means), 0.95),
        np.full((len(means), 1, 3), 0.2 / C0),
        bounds=np.array([[-1.0, -1.0, -0.1], [1.0, 1.0, 0.1]]),
    )


@pytest.mark.parametrize("across", ["an end", "the middle"])
def test_a_shadow_has_an_edge_on_splats_that_are_longer_than_that(
    across: str, monkeypatch: pytest.MonkeyPatch
):
    field, none = strips(), np.zeros((0, 3))
    shape, spacing = (41, 41, 5), np.array([0.05, 0.05, 0.05])
    x = np.linspace(-1.0, 1.0, 41)
    log = (
        -np.clip(0.5 - x / 0.3, 0.0, 1.0) if across == "an end" else -np.exp(-((np.abs(x) - 0.4) ** 2) / 0.02)
    )
    values = np.broadcast_to(log[:, None, None], shape).astype(np.float32)
    light = NewLight(np.array([-1.0, -1.0, -0.1]), spacing, values, np.ones(shape, np.float32))
    patch = SplatPatch(
        field,
        Cage.box((0.0, 0.0, 0.0), (2.0, 2.0, 0.2)),
        np.zeros((1, 1, 1), bool),
        light,
        None,
        np.zeros(0, np.int64),
        none,
        np.zeros((0, 3, 3)),
        none,
    )
    edit = light_edit(Edit.delete(cage()), patch)
    camera = Camera.look_at((0.0, 0.001, 3.0), (0.0, 0.0, 0.0), width=96, height=96, fov_x=0.5)
    origins, directions = camera.rays()
    where = (origins - directions * (origins[:, 2:] / directions[:, 2:]))[:, 0].reshape(96, 96)
    plain = SplatRenderer(field).render(camera, background="black")
    wanted = plain.rgb * np.exp(np.interp(where, x, log))[..., None]

    def off() -> float:
        shown = SplatRenderer(field).with_edits(PreparedStack([edit])).render(camera, background="black")
        return db(shown.rgb, wanted)

    split = off()
    monkeypatch.setattr(split_children, "SHADE", np.inf)
    whole = off()
    assert split > 30.0 and split > whole + 2.0


def test_a_moved_box_takes_its_shadow_along():
    field = room(True)
    edit = Edit.move(cage()).translate([-0.5, 0.25, 0.0])
    truth = seen(room(True, by=(-0.5, 0.25)), EditStack())
    bare, both = db(seen(field, EditStack([edit])), truth), db(seen(field, patched(field, edit)), truth)
    assert both > bare + 5.0


def test_later_edits_take_the_fill_along_and_a_pages_splats_are_the_same():
    field = room(True)
    first = Edit.delete(cage())
    patch = build_splat_patch(field, EditStack(), first, LIGHT)
    spot = Cage.box((0.1, 0.0, 0.0), (0.5, 0.5, 0.2))
    second = Edit.move(spot, fill="none", relight="none").translate([0.0, 0.0, 0.4])
    stack = PreparedStack([PreparedEdit(first, patch), second])
    drawn = deformed_splats(field, stack)
    lifted = drawn.means[(np.abs(drawn.means - [0.1, 0.0, 0.4]) < [0.2, 0.2, 0.05]).all(axis=1)]
    assert len(patch.sources) > 50 and len(lifted) > 30
    split = split_of(field, stack)
    for found in (None, split):
        changed = changed_splats(field, stack, split=found)
        whole = deformed_splats(field, stack, split=found)
        means = np.concatenate([field.means[~changed.hidden], changed.splats.means])
        sh = np.concatenate([field.sh[~changed.hidden], changed.splats.sh])
        order, other = (np.lexsort(np.round(m, 5).T) for m in (means, whole.means))
        np.testing.assert_allclose(means[order], whole.means[other], atol=1e-5)
        np.testing.assert_allclose(np.sort(sh[:, 0, 0]), np.sort(whole.sh[:, 0, 0]), atol=1e-5)
        file = decode_page_splat_edits(encode_page_splat_edits(field, changed))
        assert changed.gains is not None
        np.testing.assert_allclose(file.gains, changed.gains, rtol=0.003)
    baked = baked_splats(field, stack)
    pictures = [SplatRenderer(baked).render(camera, background="white").rgb for camera in cameras()]
    assert db(np.stack(pictures), seen(field, stack)) > 45.0


def test_a_clone_is_made_of_the_splats_of_its_cage():
    field = room(True)
    source = Cage.box((-0.6, -0.5, 0.05), (0.62, 0.62, 0.3))
    edit = Edit.delete(Cage.box((0.1, 0.0, 0.05), (0.62, 0.62, 0.3))).replace(fill=Clone(source))
    patch = build_splat_patch(field, EditStack(), edit, None)
    inside = source.contains(field.means.astype(np.float64))
    assert sorted(patch.sources) == list(np.flatnonzero(inside))
    np.testing.assert_allclose(patch.points, field.means[patch.sources] + [0.7, 0.5, 0.0], atol=1e-5)


def test_a_patch_of_another_field_adds_none_of_its_splats():
    field = room(True)
    stack = patched(field, Edit.delete(cage()))
    (edit,) = stack
    assert isinstance(edit.patch, SplatPatch)
    other = room(True)
    assert len(moved_splats(other, stack).source) == len(moved_splats(field, stack).source) - len(
        edit.patch.sources
    )


def test_scenes_fill_and_relight_splats_unless_told_not_to():
    field = room(True)
    edit = Edit.delete(cage())
    scene = Scene(field, edits=EditStack([edit]), cameras={"train": cameras()})
    (made,) = scene.prepared_edits
    assert isinstance(made.patch, SplatPatch) and len(made.patch.sources) > 50
    (kept,) = scene.with_edits(EditStack([edit.replace(fill="none", relight="none")])).prepared_edits
    assert kept.patch is None
    patcher = Patcher(field, cameras(), lambda camera: pytest.fail("a drag found out about the light"))
    (moving,) = patcher.prepare([edit], stage=PatchStage.INPAINTED)
    assert isinstance(moving.patch, SplatPatch) and moving.patch.part is None
    # Without light a patch does not depend on where the part is put down.
    move = Edit.move(cage(), relight="none").translate((0.5, 0.0, 0.0))
    further = move.translate((0.1, 0.0, 0.0))
    there, further = (scene.patcher.prepare([each])[0] for each in (move, further))
    assert there.patch is further.patch is not None


def test_voxelised_splats_are_as_opaque_and_as_colored():
    field = room(False)
    voxels = voxelize_splats(field, np.array([[-0.5, -0.5, -0.2], [0.5, 0.5, 0.2]]), 0.025)
    z = voxels.vertices % voxels.resolution[2]
    low = voxels.bounds[0, 2]
    column = np.bincount(voxels.vertices // voxels.resolution[2], voxels.density * 0.025)
    heights = low + 0.025 * z
    assert np.abs(np.average(heights, weights=voxels.density)) < 0.005
    # A ray straight down loses, in the mean, the integral of -log(1 - o G) of a splat on its square, times
    # how much of that a grid has face on (`fields.splat_mixture`), with splats widened to .6 voxels.
    wide = np.array([0.7 * STEP, 0.7 * STEP, 0.6 * 0.025])
    lost = 2.0 * np.pi * wide[0] ** 2 * sum(0.95**k / k**2 for k in range(1, 200)) / STEP**2
    lost *= wide[2] * np.sqrt((wide**-2.0).mean())
    assert column[column > 0.0].mean() == pytest.approx(lost, rel=0.05)
    x = voxels.bounds[0, 0] + 0.025 * (voxels.vertices // (voxels.resolution[1] * voxels.resolution[2]))
    red = 0.5 + C0 * voxels.sh[:, 0, 0]
    np.testing.assert_allclose(red, 0.45 + 0.2 * x, atol=0.02)


def test_nothing_to_fill_and_no_splats_at_all_make_empty_patches():
    field = room(False)
    nowhere = Edit.delete(Cage.box((0.0, 0.0, 3.0), (0.4, 0.4, 0.4)))
    patch = build_splat_patch(field, EditStack(), nowhere, LIGHT)
    assert not len(patch.sources) and not patch.gone.any()
    none = field.take(np.zeros(len(field), bool))
    assert not len(build_splat_patch(none, EditStack(), Edit.delete(cage()), LIGHT).sources)
