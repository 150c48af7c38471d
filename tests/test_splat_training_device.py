"""Training of splats on whichever device Quadrants runs on here, against the oracle and the CPU's kernels."""

from __future__ import annotations

from dataclasses import fields, replace
from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera
from cagefield.compute import devices
from cagefield.rendering.splats.kernels.projection import AREA
from cagefield.rendering.splats.rasterizer import NOWHERE, tiled
from cagefield.training.splats.cpu_optimizer import CpuSplatOptimizer
from cagefield.training.splats.device_optimizer import DeviceSplatOptimizer
from cagefield.training.splats.kernels.gauss_newton_splats import StepArgs
from cagefield.training.splats.splat_config import SplatConfig
from cagefield.training.splats.splat_optimizer import Photo, SplatOptimizer
from cagefield.training.splats.splat_run import SplatRun
from cagefield.training.splats.splat_state import SplatState
from cagefield.training.splats.train_splats import train_splat
from splat_captures import around, as_dataset, painted_ball, photos_of, points_near, write_views
from splat_gradients import PARTS, Values, differences, pictures, scene
from splat_views import LENSES, NEAR, camera, parameters
from tiers import nightly_after_first, nightly_except

RULE = StepArgs(
    memory=np.array([0.5, 0.98]),
    rates=np.array([1.0, 1.0, 1.0, 1.0, 0.5]),
    damping=np.array([0.1, 0.01]),
    caps=np.array([0.15, 0.15]),
    terms=4,
    scale_range=np.array([1e-4, 1e3]),
    pull=-0.003,
)
SCRATCH = ("gradients", "curvatures")
"""Arrays of a state that belong to its last step."""


def state_of(values: Values) -> SplatState:
    """Splats in training with these parameters."""
    state = SplatState.new(values["means"], np.ones(len(values["means"])), np.zeros((1, 3)), 0.5, 0)
    parts = {name: np.ascontiguousarray(part, np.float32) for name, part in values.items()}
    return replace(state, **parts)


def photo_of(target: NDArray, background: NDArray, **changes) -> Photo:
    """Photo of an 8-bit target [H,W,3 or 4], of full weight."""
    tiles = tiled(target)
    photo = Photo(
        tiles, np.ones((len(tiles), AREA), np.float32), np.ones(3, np.float32), background.astype(np.float32)
    )
    return photo._replace(**changes)


def pair_of(state: SplatState, antialiased: bool) -> tuple[CpuSplatOptimizer, DeviceSplatOptimizer]:
    """Optimizers on both devices with equal splats."""
    every = np.arange(len(state))
    other = replace(state)
    other.take(every)
    return CpuSplatOptimizer(state, NEAR, antialiased), DeviceSplatOptimizer(other, NEAR, antialiased)


def assert_close(got: NDArray, want: NDArray, share: float, name: str) -> None:
    """Rows equal up to a share of their length and of the median length."""
    got, want = got.reshape(len(got), -1), want.reshape(len(want), -1)
    error, size = np.linalg.norm(got - want, axis=1), np.linalg.norm(want, axis=1)
    assert (error <= share * size + share * np.median(size)).all(), (name, (error / size).max())


@pytest.mark.parametrize(
    ("antialiased", "lens"),
    nightly_except(product([False, True], LENSES), (False, "pinhole"), (True, "opencv_fisheye")),
)
def test_gradients_are_those_of_the_oracle(lens: str, antialiased: bool) -> None:
    view = camera(lens, 40, 27)
    values, target, background = scene(view, antialiased, 0, seed=5)
    target = np.rint(255 * target).astype(np.uint8)
    optimizer = DeviceSplatOptimizer(state_of(values), NEAR, antialiased)
    optimizer.render(view, None)
    optimizer.compare(photo_of(target, background))
    optimizer.backpropagate(NOWHERE, 0.0)
    gradients = optimizer.state.gradients
    drawn = np.flatnonzero(gradients[:, 14] > 0)
    picture = pictures(view, background, antialiased)
    residual = picture(values) - target / 255
    assert {0, 1, 2, 3} <= set(drawn.tolist())
    for name, (first, count) in PARTS.items():
        want = np.array(
            [
                [np.sum(residual * differences(picture, values, name, n, axis)) for axis in range(count)]
                for n in drawn
            ]
        )
        got = gradients[drawn, first : first + count].copy()
        if name == "color":
            # Gradients are before the clamp at 0; the oracle's are 0 there.
            held = np.abs(want) < 1e-12
            assert held.any()
            got[held] = 0.0
        # The device projects in float32: a mean is known to 1e-6 of the image, some 1e-4 pixels.
        assert_close(got, want, 1e-3, name)


def compared(optimizer: SplatOptimizer, view: Camera, photo: Photo, **options) -> NDArray:
    """Tile sums of a photo after gradients were found, with a mask, free space and SSIM as asked for."""
    optimizer.render(view, options.get("kept"))
    sums = optimizer.compare(photo)
    if options.get("ssim"):
        optimizer.add_ssim(options["ssim"])
    optimizer.backpropagate(options.get("free", NOWHERE), options.get("penalty", 0.0))
    return sums


@pytest.mark.parametrize(("lens", "channels"), nightly_except(product(LENSES, [3, 4]), ("pinhole", 3)))
def test_steps_are_those_of_the_cpu(lens: str, channels: int) -> None:
    """Gain, masked pixels, alpha, free space, SSIM, dropout: sums, slopes, gradients, curvatures, steps."""
    view = camera(lens, 75, 50)
    chance = np.random.default_rng(channels)
    state = state_of(parameters(60, 2, seed=3))
    target = chance.integers(0, 256, (view.height, view.width, channels)).astype(np.uint8)
    photo = photo_of(target, chance.uniform(size=3), gain=np.array([0.8, 1.1, 1.2], np.float32))
    photo.weights[:] = chance.choice([0.0, 0.4, 1.0], photo.weights.shape)
    free = np.stack([chance.uniform(2.0, 5.0, (12, 19)), chance.uniform(0.0, 1.0, (12, 19))])
    options = {"free": free.astype(np.float32), "penalty": 0.1, "ssim": 0.02}
    options["kept"] = chance.uniform(size=60) > 0.1
    cpu, device = pair_of(state, antialiased=channels == 3)
    for number in range(3):
        want, got = (compared(one, view, photo, **options) for one in (cpu, device))
        np.testing.assert_allclose(got, want, rtol=1e-3, atol=1e-3)
        assert np.abs(device.slopes() - cpu.slopes()).max() < 4e-3 * np.abs(cpu.slopes()).max()
        if number == 0:
            for name in SCRATCH:
                assert_close(getattr(device.state, name), getattr(cpu.state, name), 1e-3, name)
        for here, there in zip(device.pose_sums(), cpu.pose_sums(), strict=True):
            np.testing.assert_allclose(here, there, atol=1e-3 * np.abs(there).max())
        for optimizer in (cpu, device):
            optimizer.update(RULE)
    for part in fields(SplatState):
        if part.name not in SCRATCH:
            got, want = getattr(device.state, part.name), getattr(cpu.state, part.name)
            if part.name in ("ticks", "hits"):
                np.testing.assert_array_equal(got, want)
            else:
                assert_close(got, want, 1e-2, part.name)


def test_splats_behind_opaque_ones_get_no_gradient_on_either_device() -> None:
    """The GPU leaves a pixel at a transmittance of 1e-4, the CPU a tile at 1e-3."""
    view = camera("pinhole", 40, 27)
    values = parameters(40)
    ahead = -view.origin / np.linalg.norm(view.origin)
    values["means"] = 0.1 * values["means"] + ahead * np.linspace(-1.0, 3.0, 40)[:, None]
    values["log_scales"][:] = np.log(2.0)
    values["logits"][:] = 1.0
    cpu, device = pair_of(state_of(values), False)
    target = np.random.default_rng(0).integers(0, 256, (27, 40, 3)).astype(np.uint8)
    photo = photo_of(target, np.zeros(3))
    want, got = (compared(one, view, photo) for one in (cpu, device))
    np.testing.assert_allclose(got, want, rtol=5e-3)
    weights, expected = device.state.gradients[:, 14], cpu.state.gradients[:, 14]
    assert (expected[-20:] < 1e-3 * expected[0]).all()
    np.testing.assert_allclose(weights, expected, atol=2e-3 * expected[0])
    assert_close(device.state.gradients[:8, :13], cpu.state.gradients[:8, :13], 5e-3, "gradients")


def test_nothing_in_sight_changes_nothing() -> None:
    view = camera("pinhole", 40, 27)
    values = parameters(9)
    values["means"] += 2.0 * view.origin
    before = state_of(values)
    device = pair_of(before, True)[1]
    sums = compared(device, view, photo_of(np.full((27, 40, 3), 51, np.uint8), np.zeros(3)))
    device.update(RULE)
    assert sums[:, 0].sum() == pytest.approx(27 * 40 * 3 * 0.04, rel=1e-5)
    for part in fields(SplatState):
        np.testing.assert_array_equal(getattr(device.state, part.name), getattr(before, part.name))


def test_frozen_splats_take_no_step_on_either_device() -> None:
    """Half of the splats are frozen; the others take the steps that they take beside the same splats."""
    view = camera("pinhole", 40, 27)
    state = state_of(parameters(40, 2, seed=3))
    state.ticks[::2] = -1
    target = np.random.default_rng(0).integers(0, 256, (27, 40, 3)).astype(np.uint8)
    before = replace(state)
    before.take(np.arange(40))
    free = replace(before, ticks=np.zeros(40, np.int32))
    free.take(np.arange(40))
    moving = CpuSplatOptimizer(free, NEAR, True)
    for optimizer in (moving, *pair_of(state, True)):
        compared(optimizer, view, photo_of(target, np.zeros(3)))
        optimizer.update(RULE)
        after = optimizer.state
        for part in fields(SplatState):
            if part.name in SCRATCH or optimizer is moving:
                continue
            np.testing.assert_array_equal(getattr(after, part.name)[::2], getattr(before, part.name)[::2])
        assert_close(after.means[1::2] - before.means[1::2], free.means[1::2] - before.means[1::2], 1e-2, "")
        assert (after.means[1::2] != before.means[1::2]).any()


@pytest.fixture(scope="module")
def capture(tmp_path_factory):
    ball, folder = painted_ball(120), tmp_path_factory.mktemp("device") / "ball"
    splits = {"train": around(6, 0.3, 48), "test": around(2, 0.6, 48)}
    views = {
        name: write_views(folder / name, those, photos_of(ball, those)) for name, those in splits.items()
    }
    return as_dataset(folder, views["train"], views["test"], points_near(ball, count=80))


@pytest.mark.train
@pytest.mark.parametrize(
    "options", nightly_after_first([{"robust": True, "refine_poses": True, "dropout": 0.1}, {}])
)
def test_a_gpu_trains_as_the_cpu_does(capture, monkeypatch: pytest.MonkeyPatch, options, tmp_path) -> None:
    """Same splits, same removals, same splats up to rounding over a whole run, with a checkpoint between."""
    config = SplatConfig(**{"steps": 130, "splats": 150, "sh_degree": 1, "dropout": 0.0, **options})
    want = train_splat(capture, config)
    monkeypatch.setattr(devices, "is_gpu", lambda: True)
    run = SplatRun(capture, config)
    assert isinstance(run._optimizer, DeviceSplatOptimizer)
    while run.step < 70:
        run.advance()
    assert run.progress().splats == len(run.state)
    run.store(tmp_path / "run.npz")
    got = train_splat(replace(capture), config, checkpoint=tmp_path / "run.npz", resume=True)
    assert got.steps == 130 and got.finished
    assert abs(len(got.field) - len(want.field)) <= 0.03 * len(want.field)
    # Sums in another order split other splats: over 130 steps half a decibel either way.
    assert got.test_psnr == pytest.approx(want.test_psnr, abs=1.0)
    assert got.test_psnr > 18
    np.testing.assert_allclose(got.gains, want.gains, atol=0.05)
