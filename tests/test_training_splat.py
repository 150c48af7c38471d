"""Training of splats end to end on photos of known splats, and its parts: seeds, growth, checkpoints."""

from __future__ import annotations

import os
import signal
from dataclasses import fields, replace

import numpy as np
import pytest

from cagefield.cameras.camera import turntable
from cagefield.datasets.nerf_normalization import Similarity
from cagefield.datasets.views import Dataset, SparsePoints
from cagefield.errors import CagefieldError
from cagefield.images.metrics import psnr
from cagefield.rendering.splats.splat_renderer import SplatRenderer
from cagefield.training.checkpoint import write_checkpoint
from cagefield.training.evaluation import evaluate_views
from cagefield.training.splats.densification import prune_mask, split_splats
from cagefield.training.splats.initialization import (
    infer_free_distances,
    initialize_splats,
    sweep_surface_points,
)
from cagefield.training.splats.splat_config import SplatConfig
from cagefield.training.splats.splat_run import SplatRun
from cagefield.training.splats.splat_state import SplatState
from cagefield.training.splats.train_splats import train_splat
from cagefield.training.splats.training_views import load_views
from splat_captures import BOX, around, as_dataset, painted_ball, photos_of, points_near, write_views
from splat_scenes import assert_same_splats

CONFIG = SplatConfig(steps=240, splats=600, sh_degree=1)


@pytest.fixture(scope="module")
def ball():
    return painted_ball()


@pytest.fixture(scope="module")
def capture(ball, tmp_path_factory) -> Dataset:
    folder = tmp_path_factory.mktemp("capture") / "ball"
    splits = {"train": [*around(14, 0.3), *around(6, -0.4)], "test": around(4, 0.6)}
    views = {
        name: write_views(folder / name, those, photos_of(ball, those)) for name, those in splits.items()
    }
    return as_dataset(folder, views["train"], views["test"], points_near(ball))


@pytest.fixture(scope="module")
def trained(capture):
    return train_splat(capture, CONFIG)


def plain_capture(folder, color, size=32, count=6, points=None) -> Dataset:
    """Photos of one color, of 3 or 4 channels."""
    cameras = around(count, 0.3, size)
    photos = [np.full((size, size, len(color)), color, np.uint8) for _ in cameras]
    return as_dataset(folder, write_views(folder, cameras, photos), points=points, white=len(color) == 4)


def ran(dataset: Dataset, steps: int, **settings) -> SplatRun:
    """A run after so many steps, all of whose numbers are finite."""
    run = SplatRun(dataset, SplatConfig(**{"steps": steps, "splats": 400, "sh_degree": 1, **settings}))
    while run.done < 1.0:
        run.advance()
    for part in fields(run.state):
        assert np.isfinite(getattr(run.state, part.name)).all(), part.name
    assert np.isfinite(run.gains).all() and np.isfinite(run.running_loss)
    return run


def test_it_learns_views_it_has_not_seen(capture, trained):
    before = evaluate_views(SplatRun(capture, CONFIG).field(), capture.test).psnr
    assert trained.finished and trained.steps == 240
    assert trained.test_psnr > before + 6
    assert trained.test_ssim > 0.7
    assert trained.train_psnr > trained.test_psnr - 1


@pytest.mark.nightly
def test_the_seed_decides(capture, trained):
    again = train_splat(capture, CONFIG, evaluate=False)
    assert_same_splats(again.field, trained.field)
    one, other = (ran(capture, 20, seed=seed).state for seed in (0, 1))
    assert len(one) != len(other) or not np.array_equal(one.means, other.means)


def test_interrupted_and_resumed_is_as_uninterrupted(capture, trained, tmp_path):
    checkpoint = tmp_path / "run.npz"

    def press_ctrl_c(progress):
        if progress.step == 70:  # after a growth
            os.kill(os.getpid(), signal.SIGINT)

    first = train_splat(capture, CONFIG, checkpoint=checkpoint, on_progress=press_ctrl_c, evaluate=False)
    assert not first.finished and 70 <= first.steps < 80
    assert np.isnan(first.test_psnr)
    second = train_splat(capture, CONFIG, checkpoint=checkpoint, resume=True, evaluate=False)
    assert second.finished and second.steps == 240
    assert_same_splats(second.field, trained.field)
    np.testing.assert_array_equal(second.gains, trained.gains)

    def no_step(progress):
        raise AssertionError("a finished run took a step")

    third = train_splat(
        capture, CONFIG, checkpoint=checkpoint, resume=True, on_progress=no_step, evaluate=False
    )
    assert third.finished and third.steps == 240
    assert_same_splats(third.field, trained.field)


def test_a_stored_run_goes_on_alike(capture, tmp_path):
    config = replace(CONFIG, steps=40)
    run, other = SplatRun(capture, config), SplatRun(capture, config)
    for _ in range(7):
        run.advance()
    run.store(tmp_path / "run.npz")
    other.restore(tmp_path / "run.npz")
    for _ in range(7):
        run.advance()
        other.advance()
    assert other.step == 14 and other.running_loss == run.running_loss
    for part in fields(run.state):
        np.testing.assert_array_equal(getattr(other.state, part.name), getattr(run.state, part.name))


@pytest.mark.nightly
def test_a_damaged_or_foreign_checkpoint_is_refused(capture, tmp_path):
    config = replace(CONFIG, steps=3)
    with pytest.raises(CagefieldError, match=r"no checkpoint at .* start anew"):
        train_splat(capture, config, checkpoint=tmp_path / "none.npz", resume=True)
    file = tmp_path / "run.npz"
    SplatRun(capture, config).store(file)
    whole = file.read_bytes()
    file.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(CagefieldError, match=r"not a readable checkpoint .* start anew"):
        train_splat(capture, config, checkpoint=file, resume=True)
    file.write_bytes(whole)
    with pytest.raises(CagefieldError, match="other photos or settings; start anew"):
        train_splat(capture, replace(config, seed=4), checkpoint=file, resume=True)
    with pytest.raises(CagefieldError, match="other photos or settings"):
        fewer = replace(capture, train=capture.train[1:])
        train_splat(fewer, config, checkpoint=file, resume=True)
    write_checkpoint(file, "another kind", {}, {"density": np.zeros(3)})
    with pytest.raises(CagefieldError, match="other photos or settings"):
        train_splat(capture, config, checkpoint=file, resume=True)
    np.savez(file, density=np.zeros(3))
    with pytest.raises(CagefieldError, match="another kind of training"):
        train_splat(capture, config, checkpoint=file, resume=True)


def test_the_world_s_units_and_axes_do_not_matter(capture):
    # As many splats as there are surface points, which are thinned.
    config = replace(CONFIG, steps=120, splats=40_000)
    begun = SplatRun(capture, config)
    expected = train_splat(capture, config)
    a, b = 0.7, -1.1
    turned = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
    turned = turned @ np.array([[1, 0, 0], [0, np.cos(b), -np.sin(b)], [0, np.sin(b), np.cos(b)]])
    for scale, turn in ((0.01, np.eye(3)), (100.0, turned)):
        rigid = np.eye(4)
        rigid[:3, :3], rigid[:3, 3] = turn, scale * np.array([0.3, -0.2, 0.5])
        moved = Similarity(rigid, scale)
        dataset = moved.transform_dataset(
            capture, moved.transform_points(BOX.mean(axis=0)[None]) + scale * BOX
        )
        assert len(SplatRun(dataset, config).state) == pytest.approx(len(begun.state), rel=0.01)
        result = train_splat(dataset, config)
        assert result.test_psnr == pytest.approx(expected.test_psnr, abs=0.2)
        assert result.test_psnr > 20


def test_cut_outs_stay_transparent_where_the_photos_are(ball, tmp_path):
    """Stray points around the object are given too; a random background finds all of them out."""
    cameras, held_out = [*around(10, 0.3, 48), *around(5, -0.4, 48)], around(2, 0.6, 48)
    train = write_views(tmp_path / "train", cameras, photos_of(ball, cameras, cut_out=True))
    test = write_views(tmp_path / "test", held_out, photos_of(ball, held_out, cut_out=True))
    stray = np.random.default_rng(0).uniform(-0.9, 0.9, (60, 3))
    near = points_near(ball).positions
    points = SparsePoints(np.concatenate([near, stray]), np.full((len(near) + 60, 3), 128, np.uint8))
    result = train_splat(as_dataset(tmp_path, train, test, points, white=True), CONFIG)
    np.testing.assert_array_equal(result.gains, 1.0)
    assert result.test_psnr > 20
    renderer = SplatRenderer(result.field)
    for view in test:
        alpha = view.load()[..., 3]
        frame = renderer.render(view.camera)
        assert frame.opacity[alpha == 0].mean() < 0.05
        assert frame.opacity[alpha > 250].mean() > 0.85


@pytest.mark.nightly
def test_exposures_of_the_photos_are_found(capture, tmp_path):
    views = capture.train
    gains = np.random.default_rng(1).uniform(0.6, 1.0, (len(views), 3))
    photos = [np.rint(view.load() * gain).astype(np.uint8) for view, gain in zip(views, gains, strict=True)]
    darker = write_views(tmp_path / "photos", [view.camera for view in views], photos)
    dataset = replace(capture, train=darker, test=())
    found = train_splat(dataset, replace(CONFIG, steps=400), evaluate=False).gains
    np.testing.assert_allclose(found.mean(axis=0), 1.0, atol=1e-5)
    wrong = np.log(found / gains)
    wrong -= wrong.mean(axis=0)
    # The gains themselves differ by a factor of up to 1.7, with a standard deviation of 0.15 of their log.
    assert wrong.std() < 0.06
    off = train_splat(dataset, replace(CONFIG, steps=5, exposure=False), evaluate=False)
    np.testing.assert_array_equal(off.gains, 1.0)


@pytest.mark.nightly
def test_more_and_more_splats_are_left_out_of_the_pictures_by_chance(capture):
    def seen(dropout: float, done: float) -> int:
        run = SplatRun(capture, SplatConfig(steps=100, splats=400, dropout=dropout))
        run.step_photo(0, done)
        return int(run.state.hits.sum())

    everything = seen(0.0, 0.5)
    assert seen(0.8, 0.0) == everything > 100
    assert seen(0.8, 0.5) == pytest.approx(0.6 * everything, rel=0.15)
    assert seen(1.0, 1.0) == 0


def test_splats_become_more_up_to_the_most_that_may_be(capture):
    run = SplatRun(capture, SplatConfig(steps=320, splats=340, sh_degree=0))
    begun = len(run.state)
    counts = set()
    for _ in range(190):
        run.advance()
        counts.add(len(run.state))
        assert len(run.state) == len(run.state.momentum) == len(run.state.running) <= 340
    assert begun < 340 and max(counts) > begun and len(counts) > 2


def state_of(opacities, log_scales) -> SplatState:
    """Splats beside each other along x, of these opacities and log scales, turned."""
    count = len(opacities)
    state = SplatState.new(np.zeros((count, 3)), np.ones(count), np.full((count, 3), 0.5), 0.5, 1)
    state.means[:, 0] = 0.6 * np.arange(count)
    state.logits[:] = np.log(np.array(opacities) / (1 - np.array(opacities)))
    state.log_scales[:] = log_scales
    state.quaternions[:] = np.array([0.9, 0.3, -0.2, 0.25]) / np.linalg.norm([0.9, 0.3, -0.2, 0.25])
    return state


@pytest.mark.parametrize(("opacity", "tolerance"), [(0.05, 0.1), (0.3, 0.12), (0.7, 0.2)])
def test_the_two_halves_of_a_splat_look_as_it_did(opacity, tolerance):
    (camera,) = turntable((0, 0, 0), 3.0, 1, elevation=0.2, width=64, height=64, fov_x=0.5)
    state = state_of([opacity], np.log([0.22, 0.08, 0.05]))
    before = SplatRenderer(state.to_field(False, BOX, False)).render(camera).opacity
    state.momentum[:], state.running[:] = 3.0, 4.0
    split_splats(state, np.array([0]))
    assert len(state) == 2
    np.testing.assert_allclose(state.means.mean(axis=0), 0.0, atol=1e-6)
    after = SplatRenderer(state.to_field(False, BOX, False)).render(camera).opacity
    # Two Gaussians are not one. With the opacity of the whole each they would show 0.25 to 0.4 too much.
    assert after.sum() == pytest.approx(before.sum(), rel=tolerance)
    assert np.abs(after - before).max() < 0.2 * opacity
    assert (state.momentum == 0).all() and (state.running == 2).all()
    assert np.sort(state.log_scales[0]) == pytest.approx(np.sort(state.log_scales[1]))


def test_no_row_to_split_changes_nothing():
    state = state_of([0.5, 0.5], np.log(0.1))
    split_splats(state, np.zeros(0, np.int64))
    assert len(state) == 2


def test_splats_that_show_nothing_or_are_huge_are_taken_out():
    state = state_of([0.5, 0.004, 0.02, 0.5], np.log(0.1))
    state.log_scales[3, 1] = np.log(50.0)
    assert prune_mask(state, 0.01, 20.0).tolist() == [False, True, False, True]
    # A line without width; a disc without thickness stays.
    state.log_scales[0] = np.log([1e-4, 0.1, 1e-4])
    state.log_scales[2] = np.log([1e-4, 0.1, 0.1])
    assert prune_mask(state, 0.01, 20.0).tolist() == [True, True, False, True]


def test_all_of_a_splat_goes_with_its_row():
    state = state_of([0.2, 0.4, 0.6], np.log(0.1))
    for part in fields(state):
        values = getattr(state, part.name)
        values[:] = np.arange(3).reshape(3, *[1] * (values.ndim - 1))
    state.take(np.array([2, 0, 2]))
    for part in fields(state):
        values = getattr(state, part.name)
        assert len(values) == 3 and (values[0] == 2).all() and (values[1] == 0).all(), part.name
        assert (values[2] == 2).all()
    state.append(state_of([0.5], np.log(0.1)))
    assert all(len(getattr(state, part.name)) == 4 for part in fields(state))


def test_without_points_surfaces_are_found_from_random_ones(capture):
    config = SplatConfig(splats=600)
    dataset = replace(capture, points=None)
    state, _ = initialize_splats(dataset, load_views(dataset.train), config, 600)
    assert 100 < len(state) <= 600
    # The ball has radius 0.5; random points fill the box.
    radius = np.linalg.norm(state.means, axis=1)
    assert abs(np.median(radius) - 0.5) < 0.08 and np.ptp(np.quantile(radius, (0.2, 0.8))) < 0.2


def test_no_fog_stays_where_space_is_known_to_be_empty(capture):
    """Splats stand between the ball and its cameras; the middle of each photo knows where it begins."""
    chance = np.random.default_rng(0)
    places = chance.normal(size=(150, 3))
    places *= chance.uniform(0.8, 1.3, (150, 1)) / np.linalg.norm(places, axis=1, keepdims=True)
    points = SparsePoints(
        np.concatenate([capture.points.positions, places]),
        np.concatenate([capture.points.rgb, np.full((150, 3), 128, np.uint8)]),
    )
    dataset, fog = replace(capture, points=points), []
    for penalty in (0.0, 0.1):
        run = SplatRun(dataset, SplatConfig(steps=200, splats=800, sh_degree=1, empty_space_penalty=penalty))
        for view, empty in zip(run.views, run.free_distances, strict=True):
            empty[0, 20:-20, 20:-20] = np.linalg.norm(view.cameras[0].origin) - 0.6
            empty[1, 20:-20, 20:-20] = 1.0
        while run.done < 1.0:
            run.advance()
        renderer, before = SplatRenderer(run.field()), []
        for view in capture.test:
            middle = np.mgrid[-6:7, -6:7].reshape(2, -1).T + view.camera.width / 2
            distance = np.full(len(middle), np.linalg.norm(view.camera.origin) - 0.7)
            before.append(renderer.opacity_before(view.camera, middle, distance))
        fog.append(float(np.mean(np.concatenate(before) > 0.1)))
    assert fog[1] < 0.02 < 0.3 < fog[0]


def test_what_points_say_of_empty_space_is_known_in_the_photos_that_see_them(capture):
    one = np.array([[0.0, 0.1, 0.3]])
    names = [frozenset({capture.train[0].name})]
    few = replace(
        capture, train=capture.train[:2], points=SparsePoints(one, np.zeros((1, 3), np.uint8), names)
    )
    _, (here, elsewhere) = initialize_splats(few, load_views(few.train), CONFIG, 600)
    camera = few.train[0].camera
    (x, y), distance = camera.project(one)[0][0], np.linalg.norm(one - camera.origin)
    row, column = int(y * here.shape[1] / camera.height), int(x * here.shape[2] / camera.width)
    assert np.count_nonzero(here[1] == 1.0) == 1 and not elsewhere.any()
    assert here[1, row, column] == 1.0 and 0.9 * distance < here[0, row, column] < distance


def test_what_is_known_of_a_pixel_speaks_for_those_around_it_with_care():
    distances = np.zeros((40, 60), np.float32)
    distances[5, 5], distances[5, 9] = 2.0, 1.0
    spread_out, sure = infer_free_distances(distances)
    # The nearest square that has anything known, and the least there.
    assert (spread_out[5, 5], sure[5, 5]) == (2.0, 1.0) and (spread_out[5, 9], sure[5, 9]) == (1.0, 1.0)
    np.testing.assert_allclose((spread_out[5, 4], spread_out[5, 7], spread_out[6, 10]), (1.7, 0.85, 0.85))
    assert 0 < sure[5, 4] < 1 and sure[5, 4] == sure[6, 10]
    # Too far away to say anything.
    assert spread_out[35, 55] == 0 and sure[35, 55] == 0
    assert not infer_free_distances(np.zeros((8, 8), np.float32)).any()


@pytest.mark.parametrize("count", [1, 2])
def test_one_or_two_photos_are_trained_on(capture, count):
    for points in (capture.points, None):
        few = replace(capture, train=capture.train[:count], points=points)
        begun, run = ran(few, 1), ran(few, 30)
        assert run.running_loss < begun.running_loss


def test_points_that_are_all_the_same_do_no_harm(capture):
    points = SparsePoints(np.full((80, 3), 0.1), np.full((80, 3), 90, np.uint8))
    few = replace(capture, train=capture.train[:2], points=points)
    run = ran(few, 5)
    assert len(run.state) == 1
    twice = SparsePoints(np.tile(capture.points.positions, (2, 1)), np.tile(capture.points.rgb, (2, 1)))
    # Two photos: no points are added by sweeping.
    once, _ = initialize_splats(replace(few, points=capture.points), load_views(few.train), CONFIG, 600)
    again, _ = initialize_splats(replace(few, points=twice), load_views(few.train), CONFIG, 600)
    assert len(once) == len(capture.points)
    np.testing.assert_array_equal(again.means, once.means)
    np.testing.assert_array_equal(again.log_scales, once.log_scales)


@pytest.mark.nightly
def test_photos_of_another_size_and_distance_do_not_mislead_the_sweep(ball, capture, tmp_path):
    """They are left out of it, with their depths."""
    cameras = turntable((0, 0, 0), 4.5, 2, elevation=0.1, width=60, height=48, fov_x=0.4)
    others = write_views(tmp_path / "others", cameras, photos_of(ball, cameras))
    alike = capture.train[:14]
    mixed = (alike[0], others[0], *alike[1:8], others[1], *alike[8:])
    positions = capture.points.positions
    expected, colors, _ = sweep_surface_points(load_views(alike), positions, 300, 0)
    assert len(expected) > 50 and abs(np.median(np.linalg.norm(expected, axis=1)) - 0.5) < 0.08
    got, rgb, empty = sweep_surface_points(load_views(mixed), positions, 300, 0)
    assert [bool(one.any()) for one in empty] == [n not in (1, 9) for n in range(len(mixed))]
    np.testing.assert_array_equal(got, expected)
    np.testing.assert_array_equal(rgb, colors)
    ran(replace(capture, train=mixed), 20)


def test_photos_smaller_than_any_level_are_trained_on_whole(ball, tmp_path):
    cameras = turntable((0, 0, 0), 2.2, 6, elevation=0.3, width=40, height=30, fov_x=0.6)
    dataset = as_dataset(tmp_path, write_views(tmp_path, cameras, photos_of(ball, cameras)))
    (first, *_) = load_views(dataset.train)
    assert len(first.cameras) == 1 and first.level(2)[0].width == 40
    ran(replace(dataset, points=points_near(ball)), 20)


def test_levels_are_box_filtered_with_alpha_as_weight(tmp_path):
    pixels = np.zeros((96, 96, 4), np.uint8)
    pixels[::2, :, :] = (200, 100, 50, 255)
    pixels[1::2, :, :3] = 255  # what transparent pixels hide
    (view,) = write_views(tmp_path, around(1, 0.3, 96), [pixels])
    (loaded,) = load_views([view])
    camera, tiles = loaded.level(2)
    assert (camera.width, len(loaded.cameras), loaded.has_alpha) == (48, 2, True)
    np.testing.assert_array_equal(tiles[0, :, 0], (200, 100, 50, 128))


def test_photos_with_and_without_alpha_are_trained_on_together(ball, tmp_path):
    cameras = around(4, 0.3, 48)
    photos = photos_of(ball, cameras, cut_out=True)
    photos[0] = np.ascontiguousarray(photos[0][..., :3])
    views = load_views(write_views(tmp_path / "mixed", cameras, photos))
    assert all(view.has_alpha and view.tiles[0].shape[1] == 4 for view in views)
    assert (views[0].tiles[0][:, 3] == 255).all() and (views[1].tiles[0][:, 3] == 0).any()
    plain = load_views(write_views(tmp_path / "plain", cameras[:1], photos[:1]))
    assert not plain[0].has_alpha and plain[0].tiles[0].shape[1] == 3


def test_an_unbounded_capture_begins_with_at_most_as_many_splats_as_it_may_have(capture):
    dataset = replace(capture, unbounded=True)
    for most in (100, 250):
        state, _ = initialize_splats(dataset, load_views(dataset.train), SplatConfig(splats=most), most)
        far = np.linalg.norm(state.means, axis=1) > 10
        assert len(state) <= most and far.any() and not far.all()
    ran(dataset, 5)


@pytest.mark.parametrize("level", [0, 255])
def test_black_and_white_photos_give_black_and_white_pictures(ball, tmp_path, level):
    points = points_near(ball)
    points = replace(points, rgb=np.full_like(points.rgb, level))
    dataset = plain_capture(tmp_path, (level,) * 3, points=points)
    run = ran(dataset, 130)
    np.testing.assert_allclose(run.gains, 1.0, atol=0.3)
    frame = SplatRenderer(run.field()).render(dataset.train[0].camera, background="black")
    shown = frame.rgb[12:20, 12:20] if level else frame.rgb
    assert abs(shown.mean() - level / 255) < 0.15


def test_cut_outs_that_show_nothing_leave_nothing_to_see(ball, tmp_path):
    dataset = plain_capture(tmp_path, (90, 90, 90, 0), points=points_near(ball))
    run = ran(dataset, 240)
    frame = SplatRenderer(run.field()).render(dataset.train[0].camera)
    # They begin with an opacity of 0.3; the pull on opacities leaves a little of the last ones.
    assert frame.opacity.max() < 0.15


def test_a_run_by_the_clock_ends(capture):
    result = train_splat(capture, SplatConfig(minutes=0.002, splats=300), evaluate=False)
    assert result.finished and result.steps >= 1
    assert result.seconds >= 0.12


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"steps": 0}, "steps is 0; it must be from 1"),
        ({"splats": 5}, "splats is 5; it must be from 100"),
        ({"sh_degree": 4}, "sh_degree is 4; it must be from 0 to 3"),
        ({"minutes": -1.0}, "minutes is -1.0; it must be above 0"),
    ],
)
def test_impossible_settings_are_named(settings, message):
    with pytest.raises(CagefieldError, match=message):
        SplatConfig(**settings)


def test_a_run_says_where_it_stands(capture):
    run = SplatRun(capture, replace(CONFIG, steps=4))
    run.advance()
    run.advance()
    progress = run.progress()
    assert (progress.done, progress.step, progress.splats) == (0.5, 2, len(run.state))
    assert progress.psnr == pytest.approx(psnr_of(progress.loss))
    assert str(progress).startswith(f"loss {progress.loss:.5f}, PSNR {progress.psnr:.1f} dB")


def psnr_of(loss: float) -> float:
    """PSNR of a picture with this mean squared error."""
    return psnr(np.zeros((1, 1, 3)), np.full((1, 1, 3), loss**0.5))
