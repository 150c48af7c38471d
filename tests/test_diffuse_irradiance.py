"""Where surfaces face is found to matter, and a part that is turned is lit as it then faces."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera, turntable
from cagefield.completion.lighting.diffuse_irradiance import DiffuseLight, fit_diffuse_light
from cagefield.completion.surfaces.surfels import Surfels
from cagefield.edits import Edit, EditStack
from cagefield.fields.sh import C0
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.cage import Cage
from cagefield.scene.scene import Scene
from solid_fields import db, solid_field
from tiers import nightly_after_first

FLOOR, RADIUS = -0.4, 0.3
MIDDLE = np.array([0.0, 0.0, FLOOR + RADIUS])
TOWARDS = np.array([0.45, -0.2, 0.2])


def balls(towards: NDArray[np.float64], resolution: int = 64) -> VoxelField:
    """A gray ball on a floor, lit by 1 + towards . n, without shadows."""
    axis = np.linspace(-1.0, 1.0, resolution)
    at = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1)
    edge = axis[1] - axis[0]
    floor = (at[..., 2] <= FLOOR) & (at[..., 2] > FLOOR - 3.0 * edge)
    away = at - MIDDLE
    length = np.linalg.norm(away, axis=-1)
    ball = (length < RADIUS) & (at[..., 2] > FLOOR)
    normal = np.where(ball[..., None], away / np.maximum(length, 1e-9)[..., None], (0.0, 0.0, 1.0))
    texture = np.where(ball, 0.5, 0.5 + 0.05 * np.sin(9.0 * at[..., 0]) * np.sin(7.0 * at[..., 1]))
    light = texture * (1.0 + normal @ towards)
    return solid_field(floor | ball, np.repeat(light[..., None], 3, axis=-1))


def cameras() -> tuple[Camera, ...]:
    """Around the floor, from above."""
    return turntable((0.0, 0.0, -0.2), 3.0, 6, elevation=0.5, width=96, height=96, fov_x=0.5)


@pytest.fixture(scope="module")
def lit() -> Scene:
    return Scene(balls(TOWARDS), cameras={"train": cameras()})


def seen(shown: Scene) -> NDArray[np.float32]:
    """Pictures of a scene from some of its cameras."""
    return np.stack([shown.render(camera).rgb for camera in cameras()[::3]])


def turned(relight: str, adjustment: str) -> EditStack:
    """The ball turned about the vertical axis through its middle, which leaves it a ball."""
    cage = Cage.box((0.0, 0.0, MIDDLE[2] + 0.02), (0.7, 0.7, 0.62))
    if adjustment == "continuous":
        outer = Cage.box((0.0, 0.0, MIDDLE[2] + 0.02), (1.3, 1.3, 0.9))
        edit = Edit.continuous(cage, outer, relight=relight, fill="none")
        return EditStack([edit.rotate((0.0, 0.0, 40.0))])
    return EditStack([Edit.move(cage, relight=relight, fill="none").rotate((0.0, 0.0, 80.0))])


@pytest.mark.parametrize("adjustment", nightly_after_first(["discrete", "continuous"]))
def test_a_turned_ball_looks_as_it_did(lit: Scene, adjustment: str) -> None:
    before = seen(lit)
    kept, relit = (db(seen(lit.with_edits(turned(way, adjustment))), before) for way in ("none", "occlusion"))
    assert relit > kept + 5.0, (kept, relit)


def test_where_light_comes_from_is_found_in_pictures(lit: Scene) -> None:
    facing = lit.patcher.light_model.diffuse
    assert facing is not None
    found = np.array(facing.gradient)
    assert found @ TOWARDS > np.cos(np.radians(25.0)) * np.linalg.norm(found) * np.linalg.norm(TOWARDS)
    assert 0.5 < np.linalg.norm(found) / np.linalg.norm(TOWARDS) < 1.1


@pytest.mark.nightly
def test_where_all_sides_are_alike_none_is_found() -> None:
    dull = Scene(balls(np.zeros(3)), cameras={"train": cameras()})
    facing = dull.patcher.light_model.diffuse
    assert facing is None or np.linalg.norm(facing.gradient) < 0.05


def test_pairs_tell_of_light_amid_textures_and_little_or_nothing_of_none() -> None:
    chance = np.random.default_rng(2)
    normals = chance.normal(size=(2, 4000, 3))
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    points = chance.random((4000, 3))
    first, second = (Surfels(points, each) for each in normals)
    texture = chance.normal(0.0, 0.1, 4000) + np.where(
        chance.random(4000) < 0.2, chance.normal(0.0, 1.0, 4000), 0.0
    )
    light = DiffuseLight((0.3, -0.1, 0.4))
    change = light.log_light(second.normals) - light.log_light(first.normals)
    found = fit_diffuse_light(first, second, change + texture)
    assert found is not None and np.abs(np.subtract(found.gradient, light.gradient)).max() < 0.05
    assert fit_diffuse_light(first, second, texture) is None
    # What is so on one side alone is no light from far away.
    half = points[:, 0] > 0.5
    assert fit_diffuse_light(first, second, np.where(half, 1.0, -1.0) * change + texture) is None
    assert fit_diffuse_light(first.take(np.arange(90)), second.take(np.arange(90)), change[:90]) is None


def test_what_is_all_dark_or_all_on_one_plane_says_nothing() -> None:
    chance = np.random.default_rng(3)
    normals = chance.normal(size=(2, 2000, 3))
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    flat = np.ones((2000, 3))
    for points in (chance.random((2000, 3)), flat):
        first, second = (Surfels(points, each) for each in normals)
        assert fit_diffuse_light(first, second, np.zeros(2000)) is None
    assert fit_diffuse_light(first, second, chance.normal(size=2000)) is None


@pytest.mark.nightly
def test_a_black_scene_can_be_edited() -> None:
    lit = balls(np.zeros(3), 32)
    black = dataclasses.replace(lit, sh=np.full_like(lit.sh, -0.5 / C0))
    scene = Scene(black, cameras={"train": cameras()})
    assert scene.patcher.light_model.diffuse is None
    assert seen(scene.with_edits(turned("occlusion", "discrete"))).shape == seen(scene).shape
