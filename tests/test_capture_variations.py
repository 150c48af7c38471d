"""Captures whose training photos disagree, against the same captures without variations."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import binary_dilation

from cagefield.cameras.camera import Camera
from cagefield.datasets import load_dataset
from cagefield.errors import SceneError
from cagefield.images.image_files import read_image
from cagefield.procedural import ProceduralScene, capture, make_capture
from cagefield.procedural.distractors import (
    PERSON_CLEARANCE,
    PERSON_HEIGHT,
    add_distractors,
    build_person,
    place_person_in_view,
    place_sheet_behind,
)
from cagefield.procedural.flash import FLASH_STRENGTH, MIN_FLASH_DISTANCE, FlashLight
from cagefield.procedural.hand_held import render_image
from cagefield.procedural.parts import Part, Primitive, pose_matrix
from cagefield.procedural.rooms import ROOMS
from cagefield.procedural.shapes import Box, Sphere
from cagefield.procedural.srgb import decode_srgb, encode_srgb
from cagefield.procedural.textures import Plain
from cagefield.procedural.variations import (
    BACKDROP_SHARE,
    MAX_EXPOSURE_GAIN,
    PERSON_SHARE,
    Changes,
    draw_changes,
)
from commands import printed, refused

VIEWS, SIZE = 17, 48
TRAINING = [index % 8 != 0 for index in range(VIEWS)]


def made(folder: Path, name: str) -> Path:
    return make_capture(name, folder / name, views=VIEWS, size=SIZE, points=False)


@pytest.fixture(scope="module")
def captures(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("captures")
    names = ("room-chair", "room-chair+person+backdrop", "room-chair+exposure+person", "room-chair+flash")
    return {name: made(folder, name) for name in names}


def photo(folder: Path, index: int) -> np.ndarray:
    return read_image(folder / f"images/frame_{index + 1:05d}.jpg").astype(np.float64) / 255


def changes(name: str) -> tuple[Changes, ...]:
    plan = capture(name)
    cameras = plan.cameras(plan.phone.resized(SIZE), VIEWS, 0)
    return draw_changes(plan.variations, plan.scene, cameras, plan.target, TRAINING, 0)


@pytest.mark.nightly
def test_held_out_photos_are_those_of_the_room_alone(captures):
    for folder in captures.values():
        for view in load_dataset(folder).test:
            plain = captures["room-chair"] / view.name
            assert plain.read_bytes() == (folder / view.name).read_bytes()
    depths = [sorted((f / "depth").iterdir()) for f in captures.values()]
    for files in zip(*depths, strict=True):
        assert len({file.read_bytes() for file in files}) == 1


@pytest.mark.nightly
def test_training_photos_differ_from_the_plain_ones_where_the_distractors_image_is_white(captures):
    plain, changed = captures["room-chair"], captures["room-chair+person+backdrop"]
    different = 0
    for index in range(VIEWS):
        file = changed / f"distractors/frame_{index + 1:05d}.png"
        difference = np.abs(photo(changed, index) - photo(plain, index)).max(-1)
        if not file.exists():
            assert difference.max() == 0
            continue
        mask = read_image(file)[..., 0] > 0
        different += 1
        # a JPEG block that a distractor touches changes as a whole: 8 pixels at most
        assert mask.any() and difference[~binary_dilation(mask, np.ones((3, 3)), iterations=8)].max() == 0
        assert np.mean(difference[mask] > 0.04) > 0.8
    # two fifths and a half of 14 training photos, some of which have both
    assert 7 <= different <= 13
    assert not (plain / "distractors").exists()
    assert all(view.valid_pixels() is None for view in load_dataset(changed).train)


@pytest.mark.parametrize("name", ["room-digger", "room-chair"])
def test_the_image_of_a_distractor_holds_the_pixels_that_it_changes(name):
    plan = capture(f"{name}+person+backdrop")
    cameras = plan.cameras(plan.phone.resized(SIZE), VIEWS, 0)
    index, change = next((i, c) for i, c in enumerate(changes(plan.name)) if len(c.parts) == 2)
    rgb, distance = render_image(plan.scene, cameras[index])
    image, nearest, shown = add_distractors(plan.scene, change.parts, cameras[index], rgb, distance)
    np.testing.assert_array_equal(image[~shown], rgb[~shown])
    np.testing.assert_array_equal(nearest[~shown], distance[~shown])
    assert (nearest <= distance).all() and 0.02 < shown.mean() < 0.9
    assert np.mean(np.abs(image - rgb).max(-1)[shown] > 1e-3) > 0.98


def glowing(name: str, shape: Box | Sphere, color: tuple[float, float, float], at: tuple[float, ...]) -> Part:
    return Part(name, (Primitive(shape, Plain(color, 0.0), pose_matrix(at)[None], luminous=1.0),))


def test_added_parts_hide_and_are_hidden_as_in_a_scene_that_has_them():
    """A ball half in front of a wall and half behind it, among others: as all of them together."""
    wall = glowing("wall", Box((0.8, 0.1, 0.8)), (0.2, 0.3, 0.9), (0, 0, 0))
    ball = glowing("ball", Sphere(0.5), (0.9, 0.2, 0.1), (0.7, 0.2, 0.2))
    near = glowing("near", Sphere(0.15), (0.1, 0.8, 0.1), (-0.2, -1.0, -0.1))
    camera = Camera.look_at((0.3, -4.0, 0.5), (0, 0, 0), width=70, height=60, fov_x=0.6)
    alone, together = ProceduralScene("one", (wall,)), ProceduralScene("all", (wall, ball, near))
    expected, true_distance = render_image(together, camera)
    image, distance, shown = add_distractors(alone, (ball, near), camera, *render_image(alone, camera))
    np.testing.assert_allclose(image, expected, atol=1e-6)
    np.testing.assert_array_equal(distance, true_distance)
    # pixels that show them are neither pure wall nor pure background
    np.testing.assert_array_equal(shown, (expected[..., 0] > 0.2 + 1e-5) | (expected[..., 1] > 0.3 + 1e-5))


@pytest.mark.nightly
def test_exposures_are_gains_of_linear_light_clipped(captures):
    plain, exposed = captures["room-chair"], captures["room-chair+exposure+person"]
    chosen = changes("room-chair+exposure+person")
    gains = np.array([change.gains for change in chosen])
    assert (gains[~np.array(TRAINING)] == 1).all()
    assert gains.min() >= 1 / MAX_EXPOSURE_GAIN - 1e-6 and gains.max() <= MAX_EXPOSURE_GAIN + 1e-6
    assert gains.max() > 1.25 and gains.min() < 0.8
    for index, change in enumerate(chosen):
        if change.parts:
            continue
        before, after = photo(plain, index), photo(exposed, index)
        expected = encode_srgb(np.clip(change.gains * decode_srgb(before), 0, 1))
        # noise of some .006 and JPEG in both photos; where the plain photo is white, nothing is known
        known = before.max(-1) < 0.98
        assert np.abs(after - expected)[known].mean() < 0.012
        assert np.abs((after - expected)[known].mean()) < 0.004
    white = [
        photo(exposed, index)[change.gains * decode_srgb(photo(plain, index)) > 1.1]
        for index, change in enumerate(chosen)
        if not change.parts
    ]
    # a JPEG block's edge is less than white
    assert sum(map(len, white)) > 20 and np.mean(np.concatenate(white) > 0.97) > 0.9


def test_balance_moves_red_and_blue_and_leaves_green():
    gains = np.array([change.gains for change in changes("room-digger+balance")])[TRAINING]
    assert (gains[:, 1] == 1).all()
    assert 0.03 < np.log(gains[:, 0]).std() < 0.15 and 0.03 < np.log(gains[:, 2]).std() < 0.15


def test_a_flash_adds_the_light_of_a_lamp_at_the_camera():
    """A white wall faced from 2.5 away, then a nearer one, and one seen at 60 degrees."""

    def dim(albedo: np.ndarray, *rest: object, **options: object) -> np.ndarray:
        return 0.3 * albedo

    flash = FlashLight(dim, np.array([0.0, 0.0, 2.5]))
    albedo = np.full((3, 3), 0.8, np.float32)
    points = np.array([[0, 0, 0], [0, 0, 2.4], [0, 0, 0.5]], np.float32).T
    tilted = (np.sqrt(0.75), 0, 0.5)
    normals = np.array([(0, 0, 1), (0, 0, 1), tilted], np.float32).T
    rgb = flash(albedo, points, normals, -normals, occlusion=np.ones(3, np.float32), gloss=(0.0, 8.0))
    power = FLASH_STRENGTH * np.array([1 / 2.5**2, 1 / MIN_FLASH_DISTANCE**2, 0.5 / 2.0**2])
    expected = encode_srgb(decode_srgb(np.array(0.24)) + decode_srgb(np.array(0.8)) * power)
    np.testing.assert_allclose(rgb, np.repeat(expected[:, None], 3, 1), rtol=1e-5)
    shiny = flash(albedo, points, normals, -normals, occlusion=np.ones(3, np.float32), gloss=(0.5, 2.0))
    glint = decode_srgb(np.array(0.24)) + (decode_srgb(np.array(0.8)) + 0.5 * np.array([1, 1, 0.25])) * power
    np.testing.assert_allclose(shiny[:, 0], encode_srgb(glint), rtol=1e-5)


@pytest.mark.nightly
def test_a_flash_brightens_half_of_the_training_photos_and_most_what_is_near(captures):
    plain, flashed = captures["room-chair"], captures["room-chair+flash"]
    chosen = [change.flash for change in changes("room-chair+flash")]
    assert sum(chosen) == round(0.5 * sum(TRAINING)) and not any(np.array(chosen) & ~np.array(TRAINING))
    plan = capture("room-chair")
    cameras = plan.cameras(plan.phone.resized(SIZE), VIEWS, 0)
    for index, fired in enumerate(chosen):
        gain = decode_srgb(photo(flashed, index)).mean() / decode_srgb(photo(plain, index)).mean()
        assert gain > 1.02 if fired else gain == 1.0
    index = chosen.index(True)
    distance = render_image(plan.scene, cameras[index])[1]
    added = (decode_srgb(photo(flashed, index)) - decode_srgb(photo(plain, index))).mean(-1)
    near = distance < np.quantile(distance, 0.2)
    assert added[near].mean() > 1.5 * added[distance > np.quantile(distance, 0.8)].mean()


def test_a_variation_is_the_same_beside_others_and_in_any_order():
    alone, both = changes("room-digger+person"), changes("room-digger+exposure+person")
    other = changes("room-digger+person+exposure")
    for one, two, three in zip(alone, both, other, strict=True):
        assert len(one.parts) == len(two.parts) == len(three.parts)
        for a, b, c in zip(one.parts, two.parts, three.parts, strict=True):
            assert np.array_equal(a.bounds, b.bounds) and np.array_equal(a.bounds, c.bounds)
        np.testing.assert_array_equal(two.gains, three.gains)
    assert capture("room-digger+person").scene is capture("room-digger").scene


@pytest.mark.parametrize("name", ROOMS)
def test_persons_stand_in_the_room_in_view_and_sheets_are_behind_the_object(name):
    plan = capture(f"{name}+person+backdrop")
    cameras = plan.cameras(plan.phone.resized(SIZE), VIEWS, 0)
    low, high = np.array(plan.scene.room.low), np.array(plan.scene.room.high)
    rng = np.random.RandomState(3)
    for camera in cameras[::4]:
        build_sheet = place_sheet_behind(plan.scene, camera, plan.target, rng)
        away = np.linalg.norm(build_sheet.bounds.mean(0) - camera.origin)
        if plan.target is not None:
            assert away > np.linalg.norm(np.array(plan.target) - camera.origin) + 0.5
        pixel, ahead = camera.project(build_sheet.bounds.mean(0)[None])
        shift = np.abs(pixel[0] - (camera.cx, camera.cy))
        assert ahead[0] > 0 and (shift < (camera.width, camera.height)).all()
        figure = place_person_in_view(plan.scene, camera, rng)
        if figure is None:
            continue
        middle = figure.bounds.mean(0)
        # bounds of a limb are those of its thickest place
        assert figure.bounds[0, 2] == pytest.approx(low[2], abs=0.2)
        assert (middle > low).all() and (middle < high).all()
        assert np.linalg.norm(middle[:2] - camera.origin[:2]) > PERSON_CLEARANCE - 0.5
    found = changes(plan.name)
    names = [{part.name for part in change.parts} for change in found]
    training = sum(TRAINING)
    assert sum("person" in those for those in names) == round(PERSON_SHARE * training)
    assert sum("backdrop" in those for those in names) == round(BACKDROP_SHARE * training)
    assert not any(those for those, used in zip(names, TRAINING, strict=True) if not used)


def test_a_person_is_a_metre_seventy_tall_and_turns():
    figure = build_person(np.zeros(3), 0.0)
    column = np.array([[0.0, -0.04, z] for z in (PERSON_HEIGHT - 0.02, PERSON_HEIGHT + 0.02)], np.float32)
    sole = np.array([[0.4, 0.16, z] for z in (0.02, -0.05)], np.float32)
    for points in (column, sole):
        inside, outside = ProceduralScene("person", (figure,)).field(eps=0.02).distance(points)[0]
        assert inside < 0 < outside
    low, high = figure.bounds
    turned = build_person(np.array([1.0, 2.0, 0.0]), 90.0).bounds
    np.testing.assert_allclose((turned[1] - turned[0])[[1, 0, 2]], high - low, atol=0.1)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        (
            "room-chair+persn",
            "no variation 'persn' of captures; choose of person, backdrop, flash, expo",
        ),
        ("room-chair+", "no variation ''"),
        ("room-chair+flash+flash", "'flash' is given twice in room-chair"),
        ("room-piano+person", "no built-in room 'room-piano'"),
    ],
)
def test_unknown_variations_are_refused(name, message):
    with pytest.raises(SceneError, match=message):
        capture(name)


def test_the_command_takes_names_with_variations(tmp_path, capsys):
    argv = ("--views", 2, "--size", 32, "--no-points")
    printed(capsys, "make-scene", "room-chair+person", "-o", tmp_path / "a", *argv)
    assert len(load_dataset(tmp_path / "a").train) == 1
    assert "there is no variation 'persn'" in refused(
        capsys, "make-scene", "room-chair+persn", "-o", tmp_path / "b", *argv
    )
    assert not (tmp_path / "b").exists()
