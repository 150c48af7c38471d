"""Shadows that a dominant light casts are found, and go along with edits that ask for it."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera, turntable
from cagefield.completion.lighting import directional_light
from cagefield.completion.lighting.directional_light import hemisphere_directions
from cagefield.edits import Edit, EditStack, dump_edits, parse_edits
from cagefield.edits.options import CastShadow
from cagefield.errors import EditError, EditFileError
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.cage import Cage
from cagefield.scene.scene import Scene
from solid_fields import db, solid_field
from tiers import nightly_after_first

FLOOR, TOP, HALF = -0.4, 0.1, 0.2
SUN = np.array([0.6, 0.3, 0.74]) / np.linalg.norm([0.6, 0.3, 0.74])
SHARE = 0.65
AT, TO = (0.3, 0.1), (-0.2, -0.3)


def room(at: tuple[float, float] | None, *, sun: float = SHARE, resolution: int = 44) -> VoxelField:
    """A floor and a box on it, or none, in the light of the sun; under the box the floor is as dark."""
    axis = np.linspace(-1.0, 1.0, resolution)
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    edge = axis[1] - axis[0]
    floor = (z <= FLOOR) & (z > FLOOR - 3.0 * edge)
    rgb = np.where(floor[..., None], np.stack([0.6 + 0.1 * x, 0.65 + 0.1 * y, 0.6 + 0.0 * z], axis=-1), 0.0)
    light = np.where(floor, 1.0 - sun + sun * SUN[2], 0.0)
    box = np.zeros_like(floor)
    if at is not None:
        away = np.stack([x - at[0], y - at[1]], axis=-1)
        box = (np.abs(away).max(axis=-1) < HALF) & (z > FLOOR) & (z < TOP)
        rgb[box] = (0.8, 0.4, 0.3)
        # What the sun's rays meet on their way: the box as slabs, from the floor on.
        low, high = np.array([-HALF, -HALF, 0.0]), np.array([HALF, HALF, TOP - FLOOR])
        start = np.concatenate([away, np.zeros((*x.shape, 1))], axis=-1)
        near, far = (low - start) / SUN, (high - start) / SUN
        shaded = np.minimum(near, far).max(axis=-1) < np.maximum(near, far).min(axis=-1)
        light[floor & shaded & (np.maximum(near, far).min(axis=-1) > 0.0)] = 1.0 - sun
        faces = np.stack([*(np.abs(away[..., k]) - HALF for k in (0, 1)), z - TOP], axis=-1)
        face = faces.argmax(axis=-1)
        out = np.concatenate([away, np.ones((*x.shape, 1))], axis=-1)
        sides = np.sign(np.take_along_axis(out, face[..., None], -1)[..., 0])
        light[box] = (1.0 - sun + sun * np.maximum(sides * SUN[face], 0.0))[box]
    rgb = rgb * light[..., None]
    return solid_field(floor | box, rgb)


def cameras() -> tuple[Camera, ...]:
    """Around the floor, from above."""
    return turntable((0.0, 0.0, -0.3), 3.0, 6, elevation=0.8, width=52, height=52, fov_x=0.6)


def scene(field: VoxelField) -> Scene:
    return Scene(field, cameras={"train": cameras()})


def seen(shown: Scene) -> NDArray[np.float32]:
    """Pictures of a scene from some of its cameras."""
    return np.stack([shown.render(camera).rgb for camera in cameras()[::3]])


def moved(relight: str | CastShadow) -> EditStack:
    """The box elsewhere."""
    cage = Cage.box((*AT, 0.5 * (FLOOR + TOP) + 0.02), (0.5, 0.5, TOP - FLOOR + 0.02))
    edit = Edit.move(cage, relight=relight)  # type: ignore[arg-type]
    return EditStack([edit.translate((TO[0] - AT[0], TO[1] - AT[1], 0.0))])


@pytest.fixture(autouse=True)
def few_pairs(monkeypatch: pytest.MonkeyPatch) -> None:
    """A quarter of the usual pairs: enough for one box, and most of the time is theirs."""
    monkeypatch.setattr(directional_light, "MAX_SHADOW_PAIRS", 1500)


@pytest.fixture(scope="module")
def lit() -> Scene:
    return scene(room(AT))


def test_the_sun_is_found_in_pictures(lit: Scene) -> None:
    edit = moved("shadow")[0]
    sun = lit.patcher._model_for(edit).directional
    assert sun is not None
    assert np.dot(sun.direction, SUN) > np.cos(np.radians(20.0)) and abs(sun.share - SHARE) < 0.25


@pytest.mark.nightly
def test_no_sun_is_found_where_none_shines() -> None:
    dull = scene(room(AT, sun=0.0))
    assert dull.patcher._model_for(moved("shadow")[0]).directional is None


@pytest.mark.nightly
@pytest.mark.parametrize("relight", nightly_after_first(["shadow", CastShadow((6.0, 3.0, 7.4))]))
def test_a_moved_box_takes_its_cast_shadow_along(lit: Scene, relight: str | CastShadow) -> None:
    truth = seen(scene(room(TO)))
    there = {way: db(seen(lit.with_edits(moved(way))), truth) for way in ("none", "occlusion", relight)}
    assert there[relight] > max(there["none"], there["occlusion"]) + 3.0, there


def test_edit_files_say_how_shadows_go_along() -> None:
    for way in ("shadow", CastShadow((1.0, -2.0, 3.0))):
        assert parse_edits(dump_edits(moved(way))) == moved(way)
    with pytest.raises(EditError, match="direction to a light"):
        moved(CastShadow((0.0, 0.0, 0.0)))
    text = dump_edits(moved(CastShadow((1.0, -2.0, 3.0))))
    with pytest.raises(EditFileError):
        parse_edits(text.replace("shadow:", "sunshine:"))


def test_directions_that_are_tried_lie_evenly_over_half_a_sphere() -> None:
    tried = hemisphere_directions()
    np.testing.assert_allclose(np.linalg.norm(tried, axis=1), 1.0)
    nearest = np.sort(tried @ tried.T, axis=1)[:, -2]
    assert tried[:, 2].min() > 0.0 and np.degrees(np.arccos(nearest)).max() < 20.0
