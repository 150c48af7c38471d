"""Images on the compute device: the arrays of a RenderResult, downloaded when they are read."""

from __future__ import annotations

import gc
from dataclasses import replace

import numpy as np
import pytest

from cagefield.compute import devices
from cagefield.compute.device_buffers import empty_array
from cagefield.images.render_result import RenderResult
from cagefield.rendering.device_image import DeviceRenderResult, DeviceSums, SumBuffers
from cagefield.rendering.splats.rasterizer import DEPTH, tiled
from cagefield.rendering.splats.splat_renderer import SplatRenderer, _frame
from splat_scenes import random_splats
from splat_views import camera

WIDTH, HEIGHT = 37, 21


def pictured(transmittance_first: bool) -> np.ndarray:
    """Sums [H,W,5] of pixels of all opacities, 0 and 1 among them; colors above 1 too."""
    chance = np.random.default_rng(3)
    opacity = np.clip(chance.uniform(-0.3, 1.3, (HEIGHT, WIDTH, 1)), 0.0, 1.0)
    rgb = opacity * chance.uniform(0.0, 1.2, (HEIGHT, WIDTH, 3))
    distance = opacity * chance.uniform(1.0, 5.0, (HEIGHT, WIDTH, 1))
    parts = [1.0 - opacity, rgb, distance] if transmittance_first else [rgb, opacity, distance]
    return np.concatenate(parts, axis=-1).astype(np.float32)


def uploaded(values: np.ndarray) -> object:
    devices.start()
    array = empty_array(values.size)
    array.from_numpy(np.ascontiguousarray(values).reshape(-1))
    return array


def results(background: object, in_tiles: bool) -> tuple[DeviceRenderResult, RenderResult]:
    """A result on the device, and the same by NumPy."""
    values = pictured(transmittance_first=True)
    if in_tiles:
        sums = DeviceSums(uploaded(tiled(values)), WIDTH, HEIGHT, DEPTH, 16)
    else:
        sums = DeviceSums(uploaded(pictured(transmittance_first=False)), WIDTH, HEIGHT, 5)
    return DeviceRenderResult.of_sums(sums, background), _frame(values, background, False)  # type: ignore[arg-type]


@pytest.mark.parametrize("in_tiles", [False, True])
@pytest.mark.parametrize("background", ["white", None, (0.2, 0.4, 0.9)])
def test_arrays_are_those_of_numpy(background: object, in_tiles: bool) -> None:
    got, want = results(background, in_tiles)
    assert (got.width, got.height) == (WIDTH, HEIGHT)
    assert np.abs(got.rgb8().astype(int) - want.rgb8()).max() <= 1
    np.testing.assert_allclose(got.rgb, want.rgb, rtol=1e-3, atol=1e-5)
    np.testing.assert_allclose(got.opacity, want.opacity, atol=1e-6)
    np.testing.assert_allclose(got.depth, want.depth, rtol=1e-3)
    assert np.isinf(got.depth).any() and got.normals is None and got.background == want.background
    assert not got.rgb.flags.writeable
    other = "black" if background is None else None
    assert np.abs(got.over(other).rgb8().astype(int) - want.over(other).rgb8()).max() <= 1
    assert np.abs(got.rgba8().astype(int) - want.rgba8()).max() <= 1
    changed = replace(got, depth=got.depth + 1.0)
    assert np.abs(changed.rgb8().astype(int) - want.rgb8()).max() <= 1
    np.testing.assert_array_equal(changed.rgb, got.rgb)


def test_memory_is_lent_again_after_the_last_reader_is_gone() -> None:
    devices.start()
    buffers = SumBuffers()
    sums = DeviceSums(buffers.take(WIDTH * HEIGHT * 5), WIDTH, HEIGHT, 5)
    buffers.lend(sums)
    first, values = DeviceRenderResult.of_sums(sums, "white"), sums.values
    second = first.over("black")
    del sums, first
    gc.collect()
    assert buffers.take(WIDTH * HEIGHT * 5) is not values
    del second
    gc.collect()
    assert buffers.take(WIDTH * HEIGHT * 5) is values


def test_frames_of_splats_keep_their_pixels_while_others_are_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    field = random_splats(40)
    wanted = SplatRenderer(field)
    monkeypatch.setattr(devices, "is_gpu", lambda: True)
    renderer = SplatRenderer(field)
    view = camera()
    away = view.resized(view.width, view.height)
    first = renderer.render(view)
    assert isinstance(first, DeviceRenderResult)
    second = renderer.render(away, background="black")
    monkeypatch.setattr(devices, "is_gpu", lambda: False)
    for got, background in ((first, "white"), (second, "black")):
        want = wanted.render(view, background=background)
        assert np.abs(got.rgb8().astype(int) - want.rgb8()).max() <= 2
        np.testing.assert_allclose(got.opacity, want.opacity, atol=2e-3)
