"""Surface elements, and the planes that they are put on: where light is worked out."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from cagefield.cameras.camera import Camera
from cagefield.completion.lighting.ambient_occlusion import LightModel
from cagefield.completion.surfaces.block_extraction import extract_block
from cagefield.completion.surfaces.plane_snapping import snap_to_planes
from cagefield.completion.surfaces.surfels import (
    FAR_DISTANCE,
    PART_POINTS,
    Surfels,
    build_distance_grid,
    concatenate_surfels,
    extract_cut_faces,
    extract_surfels,
    prefer_visible,
)
from cagefield.compute.cancellation import cancellable
from cagefield.edits import Edit, EditStack
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.cage import Cage
from cagefield.scene.scene import Scene
from cagefield.typing import Array

C0 = 0.28209479177387814
VOXEL = 0.05
DENSE = 60.0
"""Density of what is solid, per world unit."""

TOP = VOXEL - float(np.sqrt(2.0 * np.log(2.0) * VOXEL / DENSE))
"""Where the slab stops half of a ray from above: its density grows evenly from z = VOXEL down to 0, and its
integral over the way s into it is DENSE s^2 / (2 VOXEL)."""


def slab(*, sharp: bool = False) -> VoxelField:
    """A slab up to z = 0, and a box that hangs over it.

    `sharp`: what is empty beside them has a density below zero, as in a trained field.
    """
    axis = np.arange(-20, 21) * VOXEL
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    box = (np.abs(x) < 0.16) & (np.abs(y) < 0.16) & (np.abs(z - 0.5) < 0.16)
    density = np.where(box | ((z < 1e-9) & (z > -0.3)), DENSE, 0.0)
    if sharp:
        density = np.where(density == 0.0, -40.0, density)
    vertices = np.flatnonzero(density)
    rgb = np.broadcast_to([0.6, 0.5, 0.3], (len(vertices), 3))
    return VoxelField(
        np.array([[-1.0] * 3, [1.0] * 3]),
        (41, 41, 41),
        vertices,
        density.reshape(-1)[vertices].astype(np.float32),
        ((rgb - 0.5) / C0).astype(np.float32)[:, None],
    )


def plane(count: int, noise: float, seed: int) -> Surfels:
    """A level square, whose points and normals have noise."""
    chance = np.random.default_rng(seed)
    points = np.concatenate([chance.uniform(-1, 1, (count, 2)), noise * chance.normal(size=(count, 1))], 1)
    normals = np.array([0.0, 0.0, 1.0]) + 0.25 * chance.normal(size=(count, 3))
    return Surfels(points, normals / np.linalg.norm(normals, axis=1, keepdims=True))


def sphere(count: int, center: Array, radius: float, seed: int) -> Surfels:
    normals = np.random.default_rng(seed).normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return Surfels(center + radius * normals, normals)


def test_surfaces_are_where_half_of_the_light_is_stopped() -> None:
    block = extract_block(slab(), EditStack(), np.array([[-0.5, -0.5, -0.2], [0.5, 0.5, 0.25]]))
    surface = extract_surfels(block)
    up = surface.normals[:, 2] > 0.99
    assert up.sum() > 300
    # A step of the walk inwards is a quarter of a voxel.
    assert np.abs(surface.points[up, 2] - TOP).max() < 0.25 * VOXEL
    above = np.array([[0.1, 0.2, TOP + 0.2], [0.1, 0.2, TOP - 0.1], [9.0, 0.0, 0.0]])
    found = surface.distance(above, 0.3)
    assert abs(found[0] - 0.2) < 0.25 * VOXEL and found[1] == 0.0 and found[2] == FAR_DISTANCE


def test_a_block_of_nothing_has_no_surface() -> None:
    block = extract_block(slab(), EditStack(), np.array([[0.5, 0.5, 0.5], [0.9, 0.9, 0.9]]))
    surface = extract_surfels(block)
    assert len(surface.points) == 0 and (surface.distance(np.zeros((2, 3))) == FAR_DISTANCE).all()
    assert (build_distance_grid([surface], 0.1)(np.zeros((2, 3))) == FAR_DISTANCE).all()
    assert surface.downsample(0.1) is surface


def test_distances_on_a_grid_are_those_to_the_nearest() -> None:
    ball = sphere(20_000, np.zeros(3), 0.5, 0)
    asked = np.random.default_rng(1).uniform(-0.9, 0.9, (500, 3))
    asked = asked[np.linalg.norm(asked, axis=1) > 0.55]
    exact, fast = ball.distance(asked), build_distance_grid([ball], 0.02)(asked)
    np.testing.assert_allclose(exact, np.linalg.norm(asked, axis=1) - 0.5, atol=0.02)
    within = (np.abs(asked) < 0.5).all(axis=1)
    np.testing.assert_allclose(fast[within], exact[within], atol=0.035)  # a cell's diagonal
    # Beyond the grid it is the way to the grid, and the distance there: at most a bit more.
    assert (fast > exact - 0.035).all() and (fast < 1.25 * exact + 0.035).all()


def test_only_what_the_way_passed_through_is_deep_shade() -> None:
    """Beneath a sheet seen from above alone all is behind it; inside a box is what its lid hides."""
    ground = Surfels(np.array([[0.0, 0.0, 0.0]]), np.array([[0.0, 0.0, 1.0]]))
    flat = plane(20_000, 0.0, 0).points
    up, down = np.tile([0.0, 0.0, 1.0], (len(flat), 1)), np.tile([0.0, 0.0, -1.0], (len(flat), 1))
    reaches = (0.02, 0.04, 0.08, 0.16, 0.24)
    sheet = Surfels(flat + np.array([0.0, 0.0, 0.2]), up)
    near = concatenate_surfels([ground, sheet]).occlusion_terms(ground, reaches)[0]
    np.testing.assert_allclose(near, [0, 0, 0, 1 - 0.04 / 0.16, 1 - 0.04 / 0.24], atol=0.06)
    lid = Surfels(flat + np.array([0.0, 0.0, 0.1]), down)
    both = concatenate_surfels([ground, sheet, lid]).occlusion_terms(ground, reaches)[0]
    np.testing.assert_allclose(both, [0, 0, 1 - 0.02 / 0.08, 1, 1 - 0.04 / 0.24], atol=0.06)


def test_cages_cut_through_what_is_solid() -> None:
    block = extract_block(slab(), EditStack(), np.array([[-0.9, -0.9, -0.5], [0.9, 0.9, 0.25]]))
    cut = extract_cut_faces(block, Cage.box((0.0, 0.0, 0.0), (0.8, 0.4, 0.4), rotation=(0.0, 0.0, 0.3)))
    assert (np.abs(np.linalg.norm(cut.normals, axis=1) - 1.0) < 1e-12).all()
    assert (cut.points[:, 2] < 0.5 * VOXEL).all()
    floor = cut.normals[:, 2] < -0.99
    assert np.allclose(cut.points[floor, 2], -0.2) and floor.sum() == 16 * 8
    # Of the four walls what is below the slab's top: half of each.
    assert not (cut.normals[:, 2] > 0.01).any() and abs((~floor).sum() - 2 * (16 + 8) * 4) <= 2 * (16 + 8)
    assert ((cut.points * cut.normals)[~floor].sum(axis=1) > 0.19).all()
    nothing = extract_cut_faces(block, Cage.box((0.0, 0.0, 0.15), (0.2, 0.2, 0.1)))
    assert nothing.points.shape == (0, 3)


def test_thinned_surfaces_keep_both_sides() -> None:
    both = concatenate_surfels(
        [plane(4000, 0.0, 0), Surfels(plane(4000, 0.0, 1).points, np.tile([0.0, 0.0, -1.0], (4000, 1)))]
    )
    thin = both.downsample(0.2)
    assert len(thin.points) < 400
    down = thin.normals[:, 2] < 0.0
    assert down.sum() > 80 and (~down).sum() > 80 and (np.abs(thin.normals[down, 2]) > 0.99).all()


def test_surfaces_far_away_are_thinned_too() -> None:
    near = plane(500, 0.0, 8)
    far = Surfels(np.array([[1e9, -1e9, 1e9], [-1e9, 1e9, -1e9]]), np.tile([0.0, 0.0, 1.0], (2, 1)))
    thin = concatenate_surfels([near, far]).downsample(0.01)
    assert len(thin.points) > 400 and (np.abs(thin.points).max(axis=1) > 1e8).sum() == 2


def test_planes_get_their_normals_and_spheres_keep_theirs() -> None:
    floor, ball = plane(6000, 0.004, 2), sphere(3000, np.array([0.0, 0.0, 0.6]), 0.3, 3)
    flat, on = snap_to_planes(concatenate_surfels([floor, ball]), 0.01)
    assert on[:6000].mean() > 0.8 and on[6000:].mean() < 0.12
    assert np.degrees(np.arccos(flat.normals[:6000][on[:6000], 2])).max() < 0.5
    assert np.abs(flat.points[:6000][on[:6000], 2]).max() < 0.001
    stays = ~on[6000:]
    np.testing.assert_array_equal(flat.normals[6000:][stays], ball.normals[stays])


def test_bumps_amid_a_plane_are_put_on_it_and_its_edge_keeps_its_normals() -> None:
    chance = np.random.default_rng(9)
    top = Surfels(chance.uniform(-1.0, 1.0, (6000, 3)) * [1.0, 1.0, 0.0], np.tile([0.0, 0.0, 1.0], (6000, 1)))
    tilted = np.tile([0.7, 0.0, 0.714], (200, 1))
    bumps = Surfels(chance.uniform(-0.8, 0.8, (200, 3)) * [1.0, 1.0, 0.01], tilted)
    rim = np.stack(
        [chance.uniform(1.0, 1.02, 200), chance.uniform(-1.0, 1.0, 200), np.full(200, -0.02)], axis=1
    )
    surface = concatenate_surfels([top, bumps, Surfels(rim, tilted)])
    flat, on = snap_to_planes(surface, 0.05, edges=True)
    assert on[:6000].all() and on[6000:6200].mean() > 0.98 and on[6200:].mean() < 0.02
    np.testing.assert_array_equal(flat.normals[6200:][~on[6200:]], tilted[~on[6200:]])
    _, on = snap_to_planes(surface, 0.05)
    assert on.all()


def test_what_cameras_see_replaces_what_lies_beneath() -> None:
    seen, beneath = plane(3000, 0.0, 4), plane(500, 0.0, 5)
    hidden = Surfels(beneath.points - [0.0, 0.0, 0.03], beneath.normals)
    aside = Surfels(beneath.points - [0.0, 0.0, -0.5], beneath.normals)
    level = Surfels(seen.points, np.tile([0.0, 0.0, 1.0], (3000, 1)))
    found = prefer_visible(concatenate_surfels([hidden, aside]), level, 0.01)
    assert len(found.points) == 3500 and (found.points[:, 2] > -0.01).all()


def test_a_rigid_motion_leaves_a_parts_shade_on_itself() -> None:
    part = concatenate_surfels(
        [sphere(2000, np.zeros(3), 0.3, 6), sphere(2000, np.array([0.7, 0.0, 0.0]), 0.3, 7)]
    )
    light = LightModel((0.1, 0.3), (0.3, 0.4))
    turn = Rotation.from_euler("XYZ", (0.4, -0.8, 1.1)).as_matrix()
    moved = part.transform(part.points @ turn.T + [3.0, -2.0, 1.0], np.broadcast_to(turn, (4000, 3, 3)))
    before, after = light.log_light([part], part), light.log_light([moved], moved)
    assert before.min() < -0.2
    np.testing.assert_allclose(after, before, atol=1e-6)


def test_stacked_edits_keep_densities_below_zero() -> None:
    """They make the surfaces beside them sharp, and their colors show there."""
    field = slab(sharp=True)
    moved = Edit.move(Cage.box((0.0, 0.0, 0.5), 0.5)).translate((0.3, 0.1, 0.2))
    block = extract_block(field, EditStack([moved]), np.array([[-0.1, -0.3, 0.3], [0.7, 0.5, 0.95]]))
    inside = moved.deformed.contains(block.positions(np.ones(block.shape, bool))).reshape(block.shape)
    empty = inside & (block.density < -1.0)
    assert empty.sum() > 50 and (block.slot[empty] >= 0).all()


def test_a_part_that_stands_free_is_not_thinned_by_its_seam() -> None:
    scene = Scene(slab(sharp=True))
    camera = Camera.look_at((1.6, -1.2, 1.5), (0.2, 0.3, 0.6), width=64, height=64, fov_x=0.7)
    # A cage that holds the box as closely as can be.
    edit = Edit.move(Cage.box((0.0, 0.0, 0.5), 0.36), fill="none", relight="none")
    edit = edit.translate((0.3, 0.3, 0.1))
    hard, soft = (
        scene.with_edits(EditStack([dataclasses.replace(edit, feather=width)])).render(
            camera, background="white"
        )
        for width in (0.0, 3.0)
    )
    error = float(((hard.rgb - soft.rgb) ** 2).mean())
    assert -10.0 * np.log10(max(error, 1e-9)) > 36.0


def test_searches_for_neighbors_are_cancelled_between_parts() -> None:
    rng = np.random.default_rng(3)
    surfels = Surfels(rng.normal(size=(500, 3)), rng.normal(size=(500, 3)))
    points = rng.normal(size=(2 * PART_POINTS + 7, 3))
    distances, rows = cKDTree(surfels.points).query(points, k=3, distance_upper_bound=0.4)
    asked: list[int] = []
    with cancellable(lambda: asked.append(len(asked))):
        found = surfels.nearest(points, 3, 0.4)
    np.testing.assert_array_equal(found[0], distances)
    np.testing.assert_array_equal(found[1], rows)
    assert len(asked) >= 3

    class StoppedError(Exception):
        pass

    def stop() -> None:
        raise StoppedError

    with cancellable(stop), pytest.raises(StoppedError):
        surfels.distance(points)
