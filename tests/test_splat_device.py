"""The device's splat rasterizer: on whichever device runs here, against the same oracle as the CPU's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from cagefield import Cage, Edit
from cagefield.compute import devices
from cagefield.edits import EditStack
from cagefield.rendering.splats import device_rasterizer, reference_rasterizer
from cagefield.rendering.splats.device_rasterizer import SplatArrays
from cagefield.rendering.splats.kernels.blending import T_MIN
from cagefield.rendering.splats.raster_splats import DeformedSplats
from cagefield.rendering.splats.rasterizer import COLOR, DEPTH, NORMALS, Projection, intrinsics, project
from cagefield.rendering.splats.splat_renderer import SplatRenderer
from splat_scenes import random_splats
from splat_views import NEAR, all_kinds, camera, parameters, single, splats_of, unit


def db(error: NDArray) -> float:
    """Peak signal-to-noise ratio of an error, for a peak of 1."""
    return float(-10.0 * np.log10(max(np.mean(np.square(error)), 1e-30)))


def on_device(splats: DeformedSplats, view, **options) -> device_rasterizer.DeviceProjection:
    return device_rasterizer.project(SplatArrays(splats), view, near=NEAR, **options)


@pytest.mark.parametrize(
    ("lens", "antialiased", "degree", "turned"),
    [
        ("pinhole", False, 0, False),
        ("pinhole", True, 3, True),
        ("opencv", True, 1, False),
        ("opencv_fisheye", False, 2, True),
        ("pinhole", False, 4, True),
    ],
)
def test_pictures_are_those_of_the_oracle(lens: str, antialiased: bool, degree: int, turned: bool) -> None:
    view = camera(lens)
    splats = all_kinds(view.origin, degree, antialiased, turned)
    got = on_device(splats, view).picture(DEPTH)
    seen = reference_rasterizer.project(splats, view, NEAR, intrinsics(view).limits)
    color, through, depth = reference_rasterizer.blend(seen, view.width, view.height)
    assert db(got[..., 0] - through) > 50.0
    assert db(got[..., 1:4] - color) > 50.0
    assert db((got[..., 4] - depth) / np.linalg.norm(view.origin)) > 50.0


@pytest.mark.parametrize("region", [None, (5, 3, 50, 41)])
def test_regions_normals_and_opacities_are_those_of_the_cpu(region) -> None:
    view = camera()
    splats = all_kinds(view.origin)
    chance = np.random.default_rng(0)
    normals = unit(chance.normal(size=(len(splats), 3))).astype(np.float32)
    here = project(splats, view, near=NEAR, region=region, normals=normals)
    there = device_rasterizer.project(SplatArrays(splats, normals), view, near=NEAR, region=region)
    assert db(there.picture(NORMALS) - here.picture(NORMALS)) > 60.0
    pixels = chance.uniform(0, (here.width, here.height), (200, 2))
    distances = chance.uniform(0.2, 6.0, 200)
    want = here.opacity_before(pixels, distances)
    assert np.ptp(want) > 0.9
    assert np.quantile(np.abs(there.opacity_before(pixels, distances) - want), 0.98) < 1e-4


def test_splats_behind_what_lets_less_than_t_min_through_are_not_drawn() -> None:
    view = camera()
    ahead = unit(-view.origin)
    values = parameters(40)
    values["means"] = 0.1 * values["means"] + ahead * np.linspace(-1.0, 3.0, 40)[:, None]
    values["log_scales"][:] = np.log(5.0)
    values["logits"][:] = 1.0
    splats = single(splats_of(values))
    picture = on_device(splats, view).picture(COLOR)
    assert picture[..., 0].max() < T_MIN
    front = DeformedSplats(splats.means[:12], splats.covariances[:12], splats.opacities[:12], splats.sh[:12])
    np.testing.assert_array_equal(on_device(front, view).picture(COLOR), picture)


def test_no_splats_and_none_in_sight() -> None:
    view = camera()
    splats = single(splats_of(parameters(8)))
    nothing = DeformedSplats(splats.means[:0], splats.covariances[:0], splats.opacities[:0], splats.sh[:0])
    behind = replace(splats, means=(splats.means + np.float32(2.0) * view.origin.astype(np.float32)))
    for empty in (nothing, behind):
        seen = on_device(empty, view)
        picture = seen.picture(DEPTH)
        assert seen.ends[-1] == 0
        assert (picture[..., 0] == 1.0).all() and (picture[..., 1:] == 0.0).all()
        assert seen.opacity_before(np.array([[3.5, 4.5]]), np.array([9.0])) == 0.0


def test_values_that_are_extreme_but_finite_leave_no_nan() -> None:
    view = camera()
    chance = np.random.default_rng(3)
    values = parameters(2000, 0, 3)
    values["log_scales"] = chance.uniform(-30.0, 20.0, (2000, 3))
    values["means"][:500] = view.origin + unit(-view.origin) * NEAR * (1.0 + 1e-6)
    values["means"][500:800] *= 1e6
    values["means"][800:900] = view.origin
    values["logits"] = chance.choice([-100.0, -5.0, 0.0, 5.0, 100.0], 2000)
    seen = on_device(single(splats_of(values, antialiased=True)), view)
    assert seen.ends[-1] > 100
    tiles, _ = seen.blend(DEPTH)
    assert np.isfinite(tiles).all()


def test_a_gpu_draws_the_renderers_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """SplatRenderer takes the device's rasterizer where a GPU runs, edited or not."""
    field = random_splats(200)
    inner = Cage.box((0, 0, 0), 0.6)
    edits = EditStack([Edit.move(inner).translate((0.6, 0.4, 0.0))])
    view = camera()
    plain = SplatRenderer(field)
    assert isinstance(plain.project(view), Projection) or devices.is_gpu()
    want = [r.render(view, normals=True, near=0.5) for r in (plain, plain.with_edits(edits))]
    monkeypatch.setattr(devices, "is_gpu", lambda: True)
    renderer = SplatRenderer(field)
    assert isinstance(renderer.project(view), device_rasterizer.DeviceProjection)
    got = [r.render(view, normals=True, near=0.5) for r in (renderer, renderer.with_edits(edits))]
    for a, b in zip(got, want, strict=True):
        assert db(a.rgb - b.rgb) > 50.0
        assert db(a.opacity - b.opacity) > 50.0
        assert np.quantile(np.abs(a.normals - b.normals), 0.98) < 1e-2
    assert db(got[0].rgb - got[1].rgb) < 40.0
    part = renderer.render(view, region=(10, 5, 30, 20))
    np.testing.assert_allclose(part.rgb, renderer.render(view).rgb[5:25, 10:40], atol=2e-3)
