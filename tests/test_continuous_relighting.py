"""Continuous edits take their contact shadows along: voxels and splats."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage

from cagefield.cameras.camera import Camera, turntable
from cagefield.completion.continuous_relighting import relight_voxels
from cagefield.completion.lighting.ambient_occlusion import LightModel
from cagefield.completion.patch_stages import PatchStage
from cagefield.completion.patcher import Patcher
from cagefield.completion.splat_patch import relight_splats
from cagefield.completion.surfaces.block_extraction import extract_block
from cagefield.edits import Edit, EditStack, PreparedEdit, PreparedStack
from cagefield.edits.patch import SplatPatch
from cagefield.fields.sh import C0
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.cage import Cage
from cagefield.rendering.splats import splitting
from cagefield.rendering.splats.splat_provenance import SplatSet
from cagefield.rendering.voxels.voxel_renderer import VoxelRenderer
from solid_fields import db, solid_field
from splat_rooms import LIGHT, REACH, STRENGTH
from splat_rooms import room as splat_room

VERTICES = 60
FLOOR, TOP = -0.4, 0.0
LIFT = 9 * 2.0 / (VERTICES - 1)
GAP = 0.1
"""Between floor and box: the outer cage ends there."""

INNER = Cage.box((0.1, 0.0, -0.13), (0.6, 0.6, 0.38))
OUTER = Cage.box((0.1, 0.0, 0.13), (1.2, 1.2, 0.94))
RAISED = Edit.continuous(INNER, OUTER, lattice=32).translate((0.0, 0.0, LIFT))


def room(lift: float, resolution: int = VERTICES) -> VoxelField:
    """A gray floor, and a box so high over it beside the gap; both are shaded by how near the other is."""
    axis = np.linspace(-1.0, 1.0, resolution)
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    edge = axis[1] - axis[0]
    floor = (z <= FLOOR) & (z > FLOOR - 4.0 * edge)
    box = (np.abs(x - 0.1) < 0.25) & (np.abs(y) < 0.25) & (z > FLOOR + GAP + lift) & (z < TOP + lift)
    rgb = np.where(box[..., None], (0.8, 0.3, 0.2), 0.6) * np.ones((*box.shape, 1))
    from_box, from_floor = (ndimage.distance_transform_edt(~solid) * edge for solid in (box, floor))
    other = np.where(floor, from_box, from_floor)
    rgb *= (1.0 - STRENGTH * np.clip(1.0 - other / REACH, 0.0, 1.0))[..., None]
    return solid_field(floor | box, rgb)


def cameras() -> tuple[Camera, ...]:
    """Around the floor, from a little above it."""
    return turntable((0.1, 0.0, -0.3), 3.0, 3, elevation=0.35, width=80, height=64, fov_x=0.5)


def seen(field: VoxelField, edits: EditStack) -> NDArray[np.float32]:
    """Pictures of a field under edits."""
    renderer = VoxelRenderer(field).with_edits(edits)
    return np.stack([renderer.render(camera, background="white").rgb for camera in cameras()])


def test_what_is_lifted_takes_its_shade_off_the_ground():
    field, truth = room(0.0), seen(room(LIFT), EditStack())
    light = relight_voxels(field, EditStack(), RAISED, LIGHT)
    assert light is not None
    bare, lit = (
        db(seen(field, EditStack([RAISED])), truth),
        db(seen(field, PreparedStack([light, RAISED])), truth),
    )
    assert lit > bare + 5.0


def test_light_changes_matter_only_right_under_what_is_lifted_and_far_things_keep_theirs():
    field = room(0.0)
    light = relight_voxels(field, EditStack(), RAISED, LIGHT)
    assert light is not None
    block = extract_block(field, PreparedStack([light]), field.bounds)
    plain = extract_block(field, EditStack(), field.bounds)
    where = plain.positions(block.density != plain.density)
    assert np.abs(where[:, :2] - [0.1, 0.0]).max() < 0.4
    assert np.abs(where[:, 2] - FLOOR).max() < 5.0 * plain.spacing[2]
    both = (block.slot >= 0) & (plain.slot >= 0)
    moved = np.abs(block.mean_colors(both) - plain.mean_colors(both)).max(axis=1)
    away = np.linalg.norm(plain.positions(both)[:, :2] - [0.1, 0.0], axis=1)
    assert moved.max() > 0.1 and moved[away > 0.25 * np.sqrt(2.0) + 1.3 * REACH].max() < 0.01


@pytest.mark.nightly
def test_what_was_hidden_under_what_is_lifted_is_ground():
    """Noise in the ground there, that no camera sees, and crumbs over it, do not show."""
    field = room(0.0)
    at = np.stack(np.unravel_index(field.vertices, field.resolution), axis=1)
    where = -1.0 + 2.0 * at / (VERTICES - 1)
    under = (np.abs(where[:, :2] - [0.1, 0.0]) < 0.2).all(axis=1) & (where[:, 2] < FLOOR + 0.5 * GAP)
    chance = np.random.default_rng(0)
    noisy = dataclasses.replace(
        field,
        density=np.where(under, field.density * chance.uniform(0.0, 0.3, len(under)), field.density).astype(
            np.float32
        ),
        sh=np.where(under[:, None, None], chance.normal(0.0, 0.8, field.sh.shape), field.sh).astype(
            np.float32
        ),
    )
    light = relight_voxels(noisy, EditStack(), RAISED, LIGHT)
    assert light is not None
    block = extract_block(noisy, PreparedStack([light]), noisy.bounds)
    top = np.zeros(block.shape, bool)
    top.reshape(-1)[
        field.vertices[under & (np.abs(where[:, 2] - FLOOR + 1.0 / VERTICES) < 1.0 / VERTICES)]
    ] = True
    known = block.mean_colors(top & (block.slot >= 0))
    assert len(known) > 50 and known.std() < 0.05 and abs(known.mean() - 0.6) < 0.1
    assert (block.density[top] > 0.3 * field.density.max()).mean() > 0.9
    light = relight_voxels(noisy, EditStack(), RAISED.replace(fill="none"), LIGHT)
    assert light is not None
    block, plain = (extract_block(noisy, PreparedStack(stack), noisy.bounds) for stack in ([light], []))
    np.testing.assert_array_equal(block.density, plain.density)


@pytest.mark.nightly
def test_fog_between_the_ground_and_what_is_lifted_makes_no_veil():
    """Thin as it was, an edit that lifts a part would draw it out, also beside what is filled."""
    field = room(0.0)
    full = np.zeros(int(np.prod(field.resolution)), np.float32)
    full[field.vertices] = field.density
    axis = np.linspace(-1.0, 1.0, VERTICES)
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    edge = axis[1] - axis[0]
    beside = np.maximum(np.abs(x - 0.1), np.abs(y)) < 0.25 + 4.0 * edge
    fog = beside & (z > FLOOR + 1.2 * edge) & (z < FLOOR + GAP - 0.5 * edge)
    full[(fog.reshape(-1)) & (full == 0.0)] = 0.2 / edge
    vertices = np.union1d(field.vertices, np.flatnonzero(fog))
    sh = np.full((full.size, 1, 3), (0.2 - 0.5) / C0, np.float32)
    sh[field.vertices] = field.sh
    foggy = dataclasses.replace(field, vertices=vertices, density=full[vertices], sh=sh[vertices])
    truth = seen(room(LIFT), EditStack())
    left = []
    for fill in ("none", "surroundings"):
        edit = RAISED.replace(fill=fill)
        light = relight_voxels(foggy, EditStack(), edit, LIGHT)
        assert light is not None
        left.append(db(seen(foggy, PreparedStack([light, edit])), truth))
    assert left[1] > left[0] + 3.0


def test_what_stays_where_it_is_has_no_other_light():
    still = Edit.continuous(INNER, OUTER, lattice=32).translate((0.0, 0.0, 1e-6))
    assert relight_voxels(room(0.0), EditStack(), still, LIGHT) is None


@pytest.mark.parametrize("kind", ["voxels", "splats"])
def test_patchers_put_the_light_before_its_edit(kind: str):
    field = room(0.0) if kind == "voxels" else splat_room(True)
    edit = RAISED.replace(name="raise")
    patcher = Patcher(field, (), lambda camera: pytest.fail("the light is known"))
    patcher.__dict__.update(light_model=LIGHT, _visibility=None)
    (prepared,) = patcher.prepare([edit])
    light, same = prepared.steps
    assert prepared.edit is same.edit is edit and same.light is None
    assert light is prepared.light and light.patch is not None and light.edit.changes_anything
    assert patcher.prepare([edit])[0].light is light
    bare = (PreparedEdit(edit),)
    assert tuple(patcher.prepare([edit], stage=PatchStage.INPAINTED)) == bare
    assert tuple(patcher.prepare([edit], relight_continuous=False)) == bare
    unlit = edit.replace(relight="none")
    assert tuple(patcher.prepare([unlit])) == (PreparedEdit(unlit),)
    patcher.__dict__["light_model"] = LightModel((), ())
    assert tuple(patcher.prepare([edit])) == bare


def test_the_floor_goes_on_under_splats_that_are_lifted():
    """Where the box stood the floor is black; no photo showed it."""
    field = splat_room(True)
    on_floor = np.abs(field.means[:, 2]) < 0.01
    gap = np.where(on_floor, 0.0, 0.15)[:, None].astype(np.float32) * np.array([[0.0, 0.0, 1.0]], np.float32)
    field = dataclasses.replace(field, means=field.means + gap)
    inner, outer = Cage.box((0.1, 0.0, 0.45), (0.62, 0.62, 0.66)), Cage.box((0.1, 0.0, 0.85), (1.3, 1.3, 1.5))
    away = np.linalg.norm(np.maximum(np.abs(field.means[:, :2] - [0.1, 0.0]) - 0.25, 0.0), axis=1)
    under = on_floor & (away == 0.0)
    for fill in ("none", "surroundings"):
        edit = Edit.continuous(inner, outer).translate((0.0, 0.0, 0.4)).replace(fill=fill)
        light = relight_splats(field, EditStack(), edit, LIGHT)
        assert isinstance(light.patch, SplatPatch)
        taken = light.patch.takes_away(field.means.astype(np.float64))
        if fill == "none":
            assert not taken.any() and not len(light.patch.sources)
            continue
        assert taken[under].mean() > 0.9 and not taken[~on_floor].any()
        beside = np.linalg.norm(
            np.maximum(np.abs(light.patch.points[:, :2] - [0.1, 0.0]) - 0.25, 0.0), axis=1
        )
        assert (beside == 0.0).sum() > 0.5 * under.sum() and np.abs(light.patch.points[:, 2]).max() < 0.04
        colors = 0.5 + C0 * field.sh[light.patch.sources, 0] * light.patch.gains
        assert colors.mean() > 0.35


def test_splats_under_what_is_lifted_get_lighter():
    field = splat_room(True)
    on_floor = np.abs(field.means[:, 2]) < 0.01
    means = field.means + np.where(on_floor, 0.0, 0.15)[:, None].astype(np.float32) * [[0.0, 0.0, 1.0]]
    field = dataclasses.replace(field, means=means)
    inner, outer = Cage.box((0.1, 0.0, 0.45), (0.62, 0.62, 0.66)), Cage.box((0.1, 0.0, 0.85), (1.3, 1.3, 1.5))
    light = relight_splats(
        field, EditStack(), Edit.continuous(inner, outer).translate((0.0, 0.0, 0.4)), LIGHT
    )
    assert isinstance(light.patch, SplatPatch)
    log = light.patch.light.at(field.means.astype(np.float64))
    away = np.linalg.norm(np.maximum(np.abs(field.means[:, :2] - [0.1, 0.0]) - 0.25, 0.0), axis=1)
    under, far = on_floor & (away == 0.0), on_floor & (away > 1.3 * REACH)
    assert log[under].mean() > 0.15 and np.abs(log[far]).max() < 0.05


@pytest.mark.nightly
def test_light_that_arrives_leaves_the_splits_of_geometry(monkeypatch: pytest.MonkeyPatch) -> None:
    """The result is the same where both come at once; splats on an edge of the shadow are split by it too."""
    field = splat_room(True)
    on_floor = np.abs(field.means[:, 2]) < 0.01
    wide = field.log_scales + np.where(on_floor, 1.5, 1.0)[:, None].astype(np.float32)
    field = dataclasses.replace(field, log_scales=wide)
    inner, outer = Cage.box((0.1, 0.0, 0.3), (0.62, 0.62, 0.66)), Cage.box((0.1, 0.0, 0.7), (1.3, 1.3, 1.5))
    edit = Edit.continuous(inner, outer).rotate((0.0, 0.6, 0.0)).translate((0.0, 0.0, 0.3))
    light = relight_splats(field, EditStack(), edit.replace(fill="none"), LIGHT)
    assert light.is_light_alone
    bare, lit = PreparedStack((PreparedEdit(edit),)), PreparedStack((PreparedEdit(edit, light=light),))
    at_once = splitting.split_of(dataclasses.replace(field), lit)
    splats = SplatSet.from_field(field)
    geometry = splitting.split_of(splats, bare)
    assert geometry is not None and at_once is not None
    monkeypatch.setattr(splitting, "bent_children", lambda *args: pytest.fail("geometry is split again"))
    later = splitting.split_of(splats, lit)
    assert later is not None and later.parents[geometry.parents].all()
    assert np.count_nonzero(later.parents) > np.count_nonzero(geometry.parents)
    np.testing.assert_array_equal(later.parents, at_once.parents)
    np.testing.assert_array_equal(later.children.field.means, at_once.children.field.means)
