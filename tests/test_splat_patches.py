"""Patches of splats: what edits uncover is filled with splats, and light goes along, whatever draws it."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from cagefield.cages import Cage
from cagefield.cameras import Camera, turntable
from cagefield.edits import Edit, EditStack
from cagefield.edits.options import Clone
from cagefield.edits.patch import SplatPatch
from cagefield.fields.splat import SplatField
from cagefield.formats.page_splat_edits import (
    decode_page_splat_edits,
    encode_page_splat_edits,
)
from cagefield.patches.light import Ambience
from cagefield.patches.patcher import Patcher
from cagefield.patches.splats import splat_patch_of
from cagefield.patches.voxelised import voxelised
from cagefield.quaternions import quaternions_of
from cagefield.rendering.baked_splats import baked_splats
from cagefield.rendering.deformed_splats import changed_splats, deformed_splats
from cagefield.rendering.moved_splats import moved_splats
from cagefield.rendering.splat_renderer import SplatRenderer
from cagefield.rendering.splat_splitting import split_of
from cagefield.scene import Scene
from cagefield.sh import C0

STEP = 0.05
REACH, STRENGTH = 0.3, 0.7
"""How far a corner lacks light, and how much of it."""

LIGHT = Ambience((REACH,), (STRENGTH,))
BOX = Cage.box((0.1, 0.0, 0.3), (0.5, 0.5, 0.6))
"""The box on the floor, z = 0."""


def cage() -> Cage:
    """Around the box, from half of a splat above the floor on."""
    return Cage.box((0.1, 0.0, 0.35), (0.62, 0.62, 0.64))


def room(box: bool, scale: float = 1.0, by: tuple[float, float] = (0.0, 0.0)) -> SplatField:
    """A coloured floor of flat splats, and a box on it, each shaded by how near the other is.

    Under the box, which no photo would show, the floor is black.
    """
    axis = np.arange(-1.0, 1.0 + 0.5 * STEP, STEP)
    x, y = (part.reshape(-1) for part in np.meshgrid(axis, axis, indexing="ij"))
    floor = np.stack([x, y, np.zeros_like(x)], axis=1)
    colour = np.stack([0.45 + 0.2 * x, 0.55 + 0.15 * y, 0.5 - 0.1 * x], axis=1)
    points, rgb, normals = [floor], [colour], [np.tile([0.0, 0.0, 1.0], (len(x), 1))]
    if box:
        low, high = BOX.aabb + np.array([*by, 0.0])
        away = np.linalg.norm(np.maximum(np.maximum(low - floor, floor - high), 0.0), axis=1)
        colour *= 1.0 - STRENGTH * np.clip(1.0 - away / REACH, 0.0, 1.0)[:, None]
        colour[away == 0.0] = 0.0
        along = np.arange(-0.225, 0.25, STEP)
        for axis_number in range(3):
            for side in (-1.0, 1.0):
                u, v = (part.reshape(-1) for part in np.meshgrid(along, along * 1.2, indexing="ij"))
                face = np.zeros((len(u), 3))
                others = [k for k in range(3) if k != axis_number]
                half = 0.5 * (high - low)
                face[:, others[0]], face[:, others[1]] = u, v
                face[:, axis_number] = side * half[axis_number]
                normal = np.zeros(3)
                normal[axis_number] = side
                face = face + 0.5 * (low + high)
                points.append(face)
                shade = 1.0 - STRENGTH * np.clip(1.0 - face[:, 2] / REACH, 0.0, 1.0)
                rgb.append(np.array([0.8, 0.3, 0.2]) * shade[:, None])
                normals.append(np.tile(normal, (len(face), 1)))
    means, n = np.concatenate(points), np.concatenate(normals)
    aside = np.cross(n, np.eye(3)[(np.argmax(np.abs(n), axis=1) + 1) % 3])
    frames = np.stack([aside, np.cross(n, aside), n], axis=2)
    return SplatField(
        scale * means,
        np.broadcast_to(np.log(scale * np.array([0.7, 0.7, 0.1]) * STEP), means.shape),
        quaternions_of(frames),
        np.full(len(means), 0.95),
        ((np.concatenate(rgb) - 0.5) / C0)[:, None],
        bounds=scale * np.array([[-1.0, -1.0, -0.1], [1.0, 1.0, 0.7]]),
    )


def cameras(scale: float = 1.0) -> tuple[Camera, ...]:
    """Around the floor, from above."""
    return turntable((0.0, 0.0, 0.0), 3.0 * scale, 3, elevation=0.8, width=96, height=96, fov_x=0.6)


def seen(field: SplatField, edits: EditStack, scale: float = 1.0) -> NDArray[np.float32]:
    """Pictures [3,H,W,3] of a field under edits."""
    renderer = SplatRenderer(field).with_edits(edits)
    return np.stack([renderer.render(camera, background="white").rgb for camera in cameras(scale)])


def db(a: NDArray[np.floating], b: NDArray[np.floating]) -> float:
    """PSNR of two pictures."""
    return float(-10.0 * np.log10(max(float(((a - b) ** 2).mean()), 1e-12)))


def patched(field: SplatField, edit: Edit, light: Ambience | None = LIGHT) -> EditStack:
    """The edit with its patch."""
    return EditStack([edit.replace(patch=splat_patch_of(field, EditStack(), edit, light))])


def test_a_deleted_box_leaves_a_floor_without_a_hole_or_a_shadow():
    field, truth = room(True), seen(room(False), EditStack())
    edit = Edit.delete(cage())
    left = db(seen(field, EditStack([edit])), truth)
    filled = db(seen(field, patched(field, edit, None)), truth)
    relit = db(seen(field, patched(field, edit)), truth)
    assert left < 24.0 and filled > left + 1.5 and relit > left + 9.0


@pytest.mark.parametrize("scale", [0.01, 100.0])
def test_units_make_no_difference(scale):
    field = room(True, scale)
    size = cage().aabb[1] - cage().aabb[0]
    edit = Edit.delete(Cage.box(scale * cage().aabb.mean(axis=0), scale * size))
    light = Ambience((scale * REACH,), (STRENGTH,))
    there = seen(field, patched(field, edit, light), scale)
    usual = room(True)
    assert db(there, seen(usual, patched(usual, Edit.delete(cage())))) > 36.0


def test_a_moved_box_takes_its_shadow_along():
    field = room(True)
    edit = Edit(cage(), adjustment="discrete").translate([-0.5, 0.25, 0.0])
    truth = seen(room(True, by=(-0.5, 0.25)), EditStack())
    bare, both = db(seen(field, EditStack([edit])), truth), db(seen(field, patched(field, edit)), truth)
    assert both > bare + 5.0


def test_later_edits_take_the_fill_along_and_a_pages_splats_are_the_same():
    field = room(True)
    first = Edit.delete(cage())
    patch = splat_patch_of(field, EditStack(), first, LIGHT)
    spot = Cage.box((0.1, 0.0, 0.0), (0.5, 0.5, 0.2))
    second = Edit(spot, adjustment="discrete", fill="none", relight="none").translate([0.0, 0.0, 0.4])
    stack = EditStack([first.replace(patch=patch), second])
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
    patch = splat_patch_of(field, EditStack(), edit, None)
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
    (made,) = scene.patched_edits
    assert isinstance(made.patch, SplatPatch) and len(made.patch.sources) > 50
    (kept,) = scene.with_edits(EditStack([edit.replace(fill="none", relight="none")])).patched_edits
    assert kept.patch is None
    patcher = Patcher(field, cameras(), lambda camera: pytest.fail("a drag found out about the light"))
    (moving,) = patcher.patched([edit], moving=True)
    assert isinstance(moving.patch, SplatPatch) and moving.patch.part is None


def test_voxelised_splats_are_as_opaque_and_as_coloured():
    field = room(False)
    voxels = voxelised(field, np.array([[-0.5, -0.5, -0.2], [0.5, 0.5, 0.2]]), 0.025)
    z = voxels.vertices % voxels.resolution[2]
    low = voxels.bounds[0, 2]
    column = np.bincount(voxels.vertices // voxels.resolution[2], voxels.density * 0.025)
    heights = low + 0.025 * z
    assert np.abs(np.average(heights, weights=voxels.density)) < 0.005
    # What a ray straight down loses of a layer of splats of opacity .95 that overlap.
    middle = column.reshape(-1)[column > 0].mean()
    assert 1.5 < middle < 12.0
    x = voxels.bounds[0, 0] + 0.025 * (voxels.vertices // (voxels.resolution[1] * voxels.resolution[2]))
    red = 0.5 + C0 * voxels.sh[:, 0, 0]
    np.testing.assert_allclose(red, 0.45 + 0.2 * x, atol=0.02)


def test_nothing_to_fill_and_no_splats_at_all_make_empty_patches():
    field = room(False)
    nowhere = Edit.delete(Cage.box((0.0, 0.0, 3.0), (0.4, 0.4, 0.4)))
    patch = splat_patch_of(field, EditStack(), nowhere, LIGHT)
    assert not len(patch.sources) and not patch.gone.any()
    none = field.take(np.zeros(len(field), bool))
    assert not len(splat_patch_of(none, EditStack(), Edit.delete(cage()), LIGHT).sources)
