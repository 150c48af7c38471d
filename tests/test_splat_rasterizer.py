"""The splat rasterizer against its float64 oracle, closed forms, and itself."""

from __future__ import annotations

import threading
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from cagefield.fields import sh as harmonics
from cagefield.rendering.splats import reference_rasterizer as reference
from cagefield.rendering.splats.kernels.blending import T_MIN
from cagefield.rendering.splats.kernels.projection import PACKED
from cagefield.rendering.splats.raster_splats import DeformedSplats
from cagefield.rendering.splats.rasterizer import (
    COLOR,
    DEPTH,
    NORMALS,
    Buffers,
    intrinsics,
    pairs_of_tiles,
    project,
    tiled,
    untiled,
)
from cagefield.rendering.splats.splat_renderer import SplatRenderer
from splat_scenes import random_splats
from splat_views import LENSES, NEAR, all_kinds, camera, parameters, single, splats_of, unit


def db(error: NDArray) -> float:
    """Peak signal-to-noise ratio of an error, for a peak of 1."""
    return float(-10.0 * np.log10(max(np.mean(np.square(error)), 1e-30)))


def expected(splats: DeformedSplats, view) -> NDArray:
    """The oracle's picture [H,W,5]: T, color, depth times weight."""
    seen = reference.project(splats, view, NEAR, intrinsics(view).limits)
    color, through, depth = reference.blend(seen, view.width, view.height)
    return np.concatenate([through[..., None], color, depth[..., None]], axis=-1)


def assert_agrees(splats: DeformedSplats, view) -> NDArray:
    """Fails unless a picture and its distances (in units of the camera's) are within 50 dB of the oracle."""
    got = project(splats, view, near=NEAR).picture(DEPTH)
    want = expected(splats, view)
    far = np.linalg.norm(view.origin)
    assert np.ptp(want[..., 0]) > 0.3, "the picture shows nothing"
    assert db(got[..., :4] - want[..., :4]) > 50.0
    assert db((got[..., 4] - want[..., 4]) / far) > 50.0
    return got


@pytest.mark.parametrize("antialiased", [False, True])
@pytest.mark.parametrize("lens", LENSES)
@pytest.mark.parametrize("size", [(75, 50), (16, 16), (33, 7)])
def test_pictures_of_all_kinds_of_splats(lens: str, antialiased: bool, size: tuple[int, int]) -> None:
    view = camera(lens, *size)
    assert_agrees(all_kinds(view.origin, antialiased=antialiased), view)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("degree", range(harmonics.MAX_DEGREE + 1))
def test_colors_of_each_degree_and_of_turned_splats(degree: int, turned: bool) -> None:
    view = camera()
    splats = all_kinds(view.origin, degree, turned=turned)
    got = assert_agrees(splats, view)
    if degree:
        flat = replace(splats, sh=np.ascontiguousarray(splats.sh[:, :1]))
        assert db(got[..., 1:4] - project(flat, view, near=NEAR).picture(COLOR)[..., 1:4]) < 30.0
    if degree and turned:
        unturned = project(replace(splats, rotations=None), view, near=NEAR).picture(COLOR)
        assert db(got[..., 1:4] - unturned[..., 1:4]) < 30.0


@pytest.mark.parametrize("kind", [(10, 15), (15, 20), (20, 25)], ids=["huge", "tiny", "edge-on"])
def test_extreme_shapes_alone(kind: tuple[int, int]) -> None:
    """One kind at a time, the worst pixel too: 2e-3 is half a step of the smallest alpha that counts."""
    view = camera()
    rows = slice(*kind)
    whole = all_kinds(view.origin)
    splats = DeformedSplats(whole.means[rows], whole.covariances[rows], whole.opacities[rows], whole.sh[rows])
    got = project(splats, view, near=NEAR).picture(COLOR)
    want = expected(splats, view)[..., :4]
    assert want[..., 0].min() < 0.99
    error = np.abs(got - want).max(axis=-1)
    # A rounded alpha may fall on the other side of ALPHA_MIN now and then.
    assert np.sort(error.ravel())[-3] < 2e-3 and error.max() < 1.1 / 255


@pytest.mark.parametrize("length", [3.0, 30.0])
def test_long_thin_splats_with_their_means_far_outside(length: float) -> None:
    """Lines half a pixel wide, their means up to 1300 pixels away: rounding must not fray them."""
    view = camera(width=160, height=120)
    right, up = view.c2w[:3, 0], view.c2w[:3, 1]
    along = unit(np.array([[1.0, 0.3], [0.2, 1.0], [1.0, -0.8]]))
    axes = along @ np.stack([right, up])
    square = np.stack([-along[:, 1], along[:, 0]], axis=1) @ np.stack([right, up])
    full = length**2 * np.einsum("ni,nj->nij", axes, axes) + 1e-8 * np.einsum("ni,nj->nij", square, square)
    splats = DeformedSplats(
        length * axes + 0.01 * np.arange(3)[:, None] * view.c2w[:3, 2],
        full.reshape(-1, 9)[:, [0, 1, 2, 4, 5, 8]],
        np.full(3, 0.9),
        0.5 * np.eye(3)[:, None] / harmonics.C0,
    )
    got = project(single(splats), view, near=NEAR).picture(COLOR)
    want = expected(single(splats), view)[..., :4]
    assert np.ptp(want[..., 0]) > 0.3
    # Float32 knows a position 1300 pixels away to 1e-4 pixels, and a line .55 wide to as much of its alpha.
    assert db(got - want) > 65.0
    assert np.abs(got - want).max() < 1e-2


def test_no_splats_and_none_in_sight() -> None:
    view = camera()
    splats = single(splats_of(parameters(8)))
    nothing = DeformedSplats(splats.means[:0], splats.covariances[:0], splats.opacities[:0], splats.sh[:0])
    behind = replace(splats, means=(splats.means + np.float32(2.0) * view.origin.astype(np.float32)))
    for empty in (nothing, behind):
        seen = project(empty, view, near=NEAR, normals=np.zeros((len(empty), 3), np.float32))
        picture = seen.picture(NORMALS)
        assert seen.pairs == 0
        assert (picture[..., 0] == 1.0).all() and (picture[..., 1:] == 0.0).all()
        assert seen.opacity_before(np.array([[3.5, 4.5]]), np.array([9.0])) == 0.0


@pytest.mark.parametrize("lens", LENSES)
@pytest.mark.parametrize("region", [(16, 32, 40, 18), (5, 3, 50, 41), (70, 40, 5, 10)])
def test_a_region_is_that_part_of_the_picture(lens: str, region: tuple[int, int, int, int]) -> None:
    view = camera(lens)
    # Nothing opaque: tiles that are left early would be others in the region.
    splats = all_kinds(view.origin)
    splats = replace(splats, opacities=np.minimum(splats.opacities, np.float32(0.3)))
    whole = project(splats, view, near=NEAR).picture(DEPTH)
    part = project(splats, view, near=NEAR, region=region).picture(DEPTH)
    x, y, width, height = region
    error = np.abs(part - whole[y : y + height, x : x + width])
    assert error.max() < 1.1 * 6 / 255
    assert np.quantile(error, 0.999) < 2e-5


def plane(view, normal: NDArray, count: int = 40) -> tuple[DeformedSplats, NDArray]:
    """Flat opaque splats on the plane through the origin, and its distances [H,W] along the camera's rays."""
    across = unit(np.cross(normal, (0.3, 0.5, 0.8)))
    axes = np.stack([across, np.cross(normal, across)])
    grid = np.linspace(-1.6, 1.6, count)
    x, y = (v.ravel() for v in np.meshgrid(grid, grid))
    full = 0.1**2 * (np.eye(3) - np.outer(normal, normal)) + 1e-10 * np.outer(normal, normal)
    splats = DeformedSplats(
        x[:, None] * axes[0] + y[:, None] * axes[1],
        np.broadcast_to(full.reshape(9)[[0, 1, 2, 4, 5, 8]], (len(x), 6)),
        np.full(len(x), 0.9),
        np.zeros((len(x), 1, 3)),
    )
    facing = view.rays()[1].reshape(view.height, view.width, 3) @ normal
    return single(splats), -(view.origin @ normal) / facing


@pytest.mark.parametrize("lens", LENSES)
@pytest.mark.parametrize("slant", [0.0, 60.0, 80.0])
def test_distances_and_normals_of_a_plane(lens: str, slant: float) -> None:
    view = camera(lens)
    ahead = unit(view.origin)
    side = unit(np.cross(ahead, (0, 0, 1)))
    tilt = np.radians(slant)
    normal = np.cos(tilt) * ahead + np.sin(tilt) * np.cross(side, ahead)
    splats, distance = plane(view, normal)
    normals = np.broadcast_to(-normal, (len(splats), 3)).astype(np.float32)
    picture = project(splats, view, near=NEAR, normals=normals).picture(NORMALS)
    solid = picture[..., 0] < 1e-2
    assert solid.mean() > 0.1
    error = np.abs(picture[solid][:, 4] / (1.0 - picture[solid][:, 0]) / distance[solid] - 1.0)
    # Local affine: a splat of .1 units, seen from 4, is off by some of the square of the ratio over cos(80).
    assert np.median(error) < 1e-2
    assert np.quantile(error, 0.95) < 0.03
    # Towards the camera, whichever way they were given.
    np.testing.assert_allclose(
        unit(picture[solid][:, 5:8]), np.broadcast_to(normal, (solid.sum(), 3)), atol=1e-5
    )


@pytest.mark.parametrize("lens", LENSES)
def test_opacity_gathered_before_a_distance(lens: str) -> None:
    view = camera(lens)
    splats = all_kinds(view.origin, antialiased=True)
    chance = np.random.default_rng(1)
    pixels = chance.uniform(0, (view.width, view.height), (500, 2))
    distances = chance.uniform(0.2, 6.0, 500)
    seen = reference.project(splats, view, NEAR, intrinsics(view).limits)
    d = pixels[:, None] - seen.means
    alpha = seen.opacities * np.exp(-0.5 * np.einsum("kni,nij,knj->kn", d, seen.conics, d))
    alpha = np.where(alpha < reference.ALPHA_MIN, 0.0, np.minimum(alpha, reference.ALPHA_MAX))
    nearer = seen.distances + np.einsum("kni,ni->kn", d, seen.slopes) < distances[:, None]
    want = 1.0 - np.prod(1.0 - alpha * nearer, axis=1)
    assert np.ptp(want) > 0.9
    got = project(splats, view, near=NEAR).opacity_before(pixels, distances)
    # Rounding puts a splat on the other side of ALPHA_MIN now and then.
    assert np.quantile(np.abs(got - want), 0.99) < 1e-4
    assert np.abs(got - want).max() < 1.1 / 255


def test_what_is_left_early_is_what_lets_nothing_through() -> None:
    view = camera()
    ahead = unit(-view.origin)
    count = 400
    values = parameters(count)
    values["means"] = 0.5 * values["means"] + ahead * np.linspace(-1.0, 30.0, count)[:, None]
    values["log_scales"][:] = np.log(3.0)
    # Each lets .7 through: after 16 and 24, where tiles are looked at, .003 and 2e-4 are left.
    values["logits"][:] = np.log(0.3 / 0.7)
    splats = single(splats_of(values))
    seen = project(splats, view, near=NEAR)
    tiles, stops = seen.blend(DEPTH)
    picture = untiled(tiles, view.width, view.height)
    assert (stops < seen.starts[1:]).all() and (stops - seen.starts[:-1]).max() <= 48
    want = expected(splats, view)
    assert picture[..., 0].max() < T_MIN
    # All that was left out together weighs no more than what got through.
    brightest = np.abs(splats.sh * harmonics.C0 + 0.5).max()
    assert np.abs(picture[..., 1:4] - want[..., 1:4]).max() < T_MIN * brightest + 1e-5


def test_values_that_are_extreme_but_finite_leave_no_nan() -> None:
    view = camera()
    chance = np.random.default_rng(3)
    values = parameters(4000, 3, 3)
    values["log_scales"] = chance.uniform(-30.0, 20.0, (4000, 3))
    values["means"][:1000] = view.origin + unit(-view.origin) * NEAR * (1.0 + 1e-6)
    values["means"][1000:1500] *= 1e6
    values["means"][1500:1600] = view.origin
    values["logits"] = chance.choice([-100.0, -5.0, 0.0, 5.0, 100.0], 4000)
    for lens in LENSES:
        for antialiased in (False, True):
            splats = single(splats_of(values, antialiased))
            normals = unit(chance.normal(size=(4000, 3))).astype(np.float32)
            seen = project(splats, camera(lens), near=NEAR, normals=normals)
            assert seen.pairs > 1000
            tiles, stops = seen.blend(NORMALS)
            assert np.isfinite(tiles).all()
            assert tiles[:, 0].min() >= 0.0 and tiles[:, 0].max() <= 1.0
            slopes = chance.normal(size=(seen.tiles, 3, 256)).astype(np.float32)
            color = np.ascontiguousarray(tiles[:, 1:4])
            sums = seen.gradients(color, slopes, stops)
            assert np.isfinite(sums[: seen.pairs]).all()
            before = seen.opacity_before(chance.uniform(0, (75, 50), (100, 2)), np.full(100, 5.0))
            assert np.isfinite(before).all()


def test_alpha_in_empty_space_costs_what_it_is() -> None:
    view = camera()
    values = {name: value[:1] for name, value in parameters(4).items()}
    values["means"] = np.zeros((1, 3))
    values["log_scales"] = np.log(0.4) + np.zeros((1, 3))
    splats = single(splats_of(values))
    seen = project(splats, view, near=NEAR)
    tiles, stops = seen.blend(DEPTH)
    picture = untiled(tiles, view.width, view.height)
    alpha, through = 1.0 - picture[..., 0], np.linalg.norm(view.origin)
    # The right half of the picture is half sure to be empty to beyond the splat, the left to before it.
    halves = np.array([[[0.8 * through, 1.2 * through]], [[1.0, 0.5]]], np.float32)
    none = np.zeros((seen.tiles, 3, 256), np.float32)
    sums = seen.gradients(none, none, stops, None, halves, 0.3)[: seen.pairs]
    assert sums[:, 0].sum() == pytest.approx(0.15 * alpha[:, (view.width + 1) // 2 :].sum(), rel=1e-4)
    assert not np.abs(seen.gradients(none, none, stops)[: seen.pairs, :6]).any()


def test_splats_whose_variance_is_not_finite_are_not_drawn() -> None:
    view = camera()
    splats = single(splats_of(parameters(20)))
    # What float32 makes of log scales beyond 44.
    for value in (np.inf, 1e35):
        covariances = splats.covariances.copy()
        covariances[::2, [0, 3, 5]] = value
        wide = replace(splats, covariances=covariances)
        rest = {name: getattr(splats, name)[1::2] for name in ("means", "covariances", "opacities", "sh")}
        want = project(DeformedSplats(**rest), view, near=NEAR).picture()
        got = project(wide, view, near=NEAR).picture()
        np.testing.assert_array_equal(got, want)


def test_threads_that_ask_at_once_get_their_own_pictures() -> None:
    view = camera()
    scenes = [all_kinds(view.origin, seed=seed) for seed in range(4)]
    want = [project(splats, view, near=NEAR).picture() for splats in scenes]
    wrong: list[int] = []

    def ask(n: int) -> None:
        for _ in range(15):
            if not np.array_equal(project(scenes[n], view, near=NEAR).picture(), want[n]):
                wrong.append(n)

    threads = [threading.Thread(target=ask, args=(n,)) for n in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong


def test_threads_that_share_a_renderer_get_their_own_pictures() -> None:
    renderer = SplatRenderer(random_splats(400))
    views = [camera(), camera("opencv"), camera("opencv_fisheye", 64, 64), camera(width=40)]
    want = [renderer.render(view).rgb for view in views]
    pixels, distances = np.full((50, 2), 20.0), np.linspace(0.0, 6.0, 50)
    gathered = [renderer.opacity_before(view, pixels, distances) for view in views]
    wrong: list[int] = []

    def ask(n: int) -> None:
        for _ in range(15):
            same = np.array_equal(renderer.render(views[n]).rgb, want[n])
            if not (same and (renderer.opacity_before(views[n], pixels, distances) == gathered[n]).all()):
                wrong.append(n)

    threads = [threading.Thread(target=ask, args=(n,)) for n in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong


def test_tiles_are_the_picture_cut_up() -> None:
    picture = np.random.default_rng(0).normal(size=(35, 50, 3)).astype(np.float32)
    tiles = tiled(picture)
    assert tiles.shape == (3 * 4, 3, 256)
    assert tiles[5, 2, 16 * 7 + 9] == picture[16 + 7, 16 + 9, 2]
    np.testing.assert_array_equal(untiled(tiles, 50, 35), picture)


def test_pairs_are_those_of_one_part_for_every_number_of_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Parts of the splats, near to far, share the tests of tiles; a tile's splats stay in order of depth."""
    rng = np.random.default_rng(4)
    count, across, down = 3_000, 9, 7
    packed = np.zeros((count, PACKED), np.float32)
    packed[:, 0], packed[:, 1] = rng.uniform(0, 16 * across, count), rng.uniform(0, 16 * down, count)
    packed[:, 2], packed[:, 4], packed[:, 5] = (
        0.004,
        rng.uniform(0.002, 0.1, count),
        rng.uniform(0.1, 1, count),
    )
    packed[:, 3] = rng.uniform(-1.0, 1.0, count)
    low = np.maximum((packed[:, :2] // 16).astype(int) - rng.integers(0, 3, (count, 2)), 0)
    high = np.minimum(low + rng.integers(0, 5, (count, 2)), [across, down])
    tiles = np.stack([low[:, 0], high[:, 0], low[:, 1], high[:, 1]], axis=1).astype(np.int32)
    keys = rng.uniform(1.0, 5.0, count).astype(np.float32)
    monkeypatch.setattr("cagefield.rendering.splats.rasterizer.MIN_PART_TILES", 1)
    found = []
    for parts in (1, 2, 7):
        monkeypatch.setattr("cagefield.compute.devices.parts", lambda parts=parts: parts)
        order, starts, ids, firsts, slots, pairs = pairs_of_tiles(
            np.arange(count), keys, tiles, packed, False, 16 * across, 16 * down, Buffers()
        )
        found.append((order, starts, ids[:pairs].copy(), firsts, slots[:pairs].copy()))
    order, starts, ids, firsts, slots = found[0]
    assert starts[-1] == firsts[-1] == len(ids) > 2_000
    np.testing.assert_array_equal(np.sort(slots), np.arange(len(ids)))
    for q in (0, 1_000, 2_999):
        assert set(ids[slots[firsts[q] : firsts[q + 1]]]) <= {order[q]}
    for t in range(across * down):
        of_tile = ids[starts[t] : starts[t + 1]]
        assert (np.diff(keys[of_tile]) >= 0).all()
        x, y = t % across, t // across
        box = tiles[of_tile]
        assert ((box[:, 0] <= x) & (x < box[:, 1]) & (box[:, 2] <= y) & (y < box[:, 3])).all()
    for other in found[1:]:
        for one, two in zip(found[0], other, strict=True):
            np.testing.assert_array_equal(one, two)
