"""What was held or hidden: cut ends of parts, how strong a shade is around one, and rims of fills."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera
from cagefield.completion.continuous_relighting import relight_voxels
from cagefield.completion.edit_context import EditContext
from cagefield.completion.inpainting.support_inpainting import inpaint_support
from cagefield.completion.lighting.ambient_occlusion import LightModel
from cagefield.completion.lighting.shadow_strength import MAX_STRENGTH, MIN_STRENGTH, fit_shadow_strength
from cagefield.completion.surfaces.block_extraction import extract_block
from cagefield.completion.surfaces.footprint import Footprint
from cagefield.completion.surfaces.support_plane import Support
from cagefield.edits import Edit, EditStack, PreparedStack
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.cage import Cage
from cagefield.scene.scene import Scene
from solid_fields import solid_field
from test_completion import cage, cameras, room
from test_continuous_relighting import INNER, LIGHT, OUTER
from test_continuous_relighting import room as gap_room
from tiers import nightly_after_first


def handle(held: bool) -> VoxelField:
    """A red box on a gray rod that comes from above: hollow and black where that holds it."""
    axis = np.linspace(-1.0, 1.0, 61)
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    box = (np.abs(x + 0.4) < 0.32) & (np.abs(y) < 0.32) & (np.abs(z + 0.3) < 0.22)
    within = (np.hypot(x + 0.4, y) < 0.14) & (z > -0.26) & held
    rod = (np.hypot(x + 0.4, y) < 0.12) & (z > -0.07) & (z < 0.8) & held
    rgb = np.where(rod[..., None], 0.6, (0.8, 0.2, 0.15)) * np.ones((*x.shape, 1))
    rgb[(np.hypot(x + 0.4, y) < 0.2) & (z < -0.2) & held] = 0.0
    return solid_field((box & ~within) | rod, rgb)


@pytest.mark.parametrize("keep_source", nightly_after_first([True, False]))
def test_the_face_of_a_part_goes_on_where_it_was_held(keep_source: bool) -> None:
    inner = Cage.box((-0.4, 0.0, -0.3), (0.72, 0.72, 0.48))
    edit = (Edit.copy if keep_source else Edit.move)(inner, relight="none")
    edit = edit.translate((0.85, 0.0, 0.0))
    camera = Camera.look_at((0.45, -0.9, 1.6), (0.45, 0.0, -0.1), width=48, height=48, fov_x=0.35)

    def error(fill: str) -> float:
        edits = EditStack([edit.replace(fill=fill)])
        held, free = Scene(handle(True)).with_edits(edits), Scene(handle(False)).with_edits(EditStack([edit]))
        return float(np.abs(held.render(camera).rgb - free.render(camera).rgb)[16:32, 16:32].mean())

    assert error("none") > 0.1 and error("surroundings") < 0.04


def test_the_strength_of_a_shade_is_measured_around_it() -> None:
    scene = Scene(room(True), cameras={"train": cameras()})
    field, visibility, model = scene.field, scene.patcher._visibility, scene.patcher.light_model
    assert isinstance(field, VoxelField)

    def strength(times: float, seen: object = visibility) -> float:
        weaker = dataclasses.replace(model, weights=tuple(times * w for w in model.weights))
        context = EditContext.build(field, EditStack(), Edit.delete(cage()), weaker, seen)
        support = context.find_support()
        assert support is not None
        return fit_shadow_strength(
            context.removed,
            context.surroundings,
            context.before,
            context.edit.inner,
            context.visibility,
            weaker,
            support,
        )

    right = strength(1.0)
    assert MIN_STRENGTH < right < MAX_STRENGTH and strength(0.6) > right + 0.15
    assert strength(1.0, None) == 1.0
    bright = dataclasses.replace(visibility, log_brightness=np.zeros_like(visibility.log_brightness))
    assert strength(1.0, bright) < 0.75  # no shade is seen there


def test_a_rim_in_deep_shade_does_not_color_what_is_filled() -> None:
    """A dark ring around the hole, whose light was changed: hole and ring get the colors beyond."""
    axis = np.linspace(-1.0, 1.0, 41)
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    away = np.hypot(x, y)
    rgb = np.where((away < 0.35)[..., None], 0.15, 0.6) * np.ones((*x.shape, 3))
    block = extract_block(solid_field(z < 0.01, rgb), EditStack(), np.array([[-1.0] * 3, [1.0] * 3]))
    far = np.hypot(*(np.stack(np.meshgrid(*[np.arange(-20, 21)] * 2, indexing="ij")))) / 20.0
    hole = far < 0.24
    support = Support(
        np.array([20.0, 20.0, 20.0]), np.array([0.0, 0.0, 1.0]), np.eye(3)[:2], np.zeros((0, 3))
    )
    footprint = Footprint(
        support, np.array([-20, -20]), hole, ~hole, np.ones_like(hole), np.zeros(hole.shape)
    )
    lit = dataclasses.replace(footprint, log_light_change=np.where(far < 0.45, 0.5, 0.0))
    at = (z == axis[20]) & (np.abs(y) < 1e-9)
    none = np.zeros(block.shape, bool)

    def across(which: Footprint) -> NDArray[np.float64]:
        return inpaint_support(block, which, none | (away < 0.2) & (z > 0.0)).mean_colors(at)[:, 0]

    dark, bright = across(footprint), across(lit)
    assert dark[18:23].max() < 0.2 and bright[18:23].min() > 0.5
    assert bright[14] > 0.25 and np.abs(bright - dark)[:10].max() < 1e-6


def test_what_a_lifted_part_hid_takes_the_colors_around() -> None:
    """Deep in the gap under the box the floor is noise, which new light would only make brighter."""
    field = gap_room(0.0)
    chance, rows = np.random.default_rng(0), field.sh.copy()
    axis = np.linspace(-1.0, 1.0, field.resolution[0])
    at = np.stack(np.unravel_index(field.vertices, field.resolution), axis=1)
    x, y, z = axis[at].T
    under = (np.abs(x - 0.1) < 0.2) & (np.abs(y) < 0.2) & (z < -0.35)
    rows[under] += chance.uniform(-0.5, 0.5, (int(under.sum()), 1, 3)).astype(np.float32)
    field = dataclasses.replace(field, sh=rows)
    strong = LightModel(LIGHT.radii, tuple(1.3 * w for w in LIGHT.weights))
    edit = Edit.continuous(INNER, OUTER, lattice=32).translate((0.0, 0.0, 0.35))
    light = relight_voxels(field, EditStack(), edit, strong)
    assert light is not None
    block = extract_block(field, PreparedStack([light]), field.bounds)
    points = block.positions(np.ones(block.shape, bool)).reshape(*block.shape, 3)
    deep = (np.abs(points[..., :2] - [0.1, 0.0]) < 0.12).all(axis=-1) & (np.abs(points[..., 2] + 0.42) < 0.02)
    colors = block.mean_colors(deep & (block.slot >= 0))
    assert len(colors) > 20 and colors.std() < 0.05
