"""Clusters of splats: exact where they cull, moments kept where they merge."""

from __future__ import annotations

import gc
from dataclasses import replace
from weakref import ref

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import spence

from cagefield import Cage, Edit
from cagefield.cameras.camera import Camera
from cagefield.edits import EditStack
from cagefield.fields.splat_field import SplatField
from cagefield.rendering.splats import splat_lod, splat_renderer
from cagefield.rendering.splats.kernels.projection import ALPHA_MAX, DEEPEST
from cagefield.rendering.splats.kernels.splat_lod import dilogarithm
from cagefield.rendering.splats.raster_splats import DeformedSplats
from cagefield.rendering.splats.rasterizer import DEPTH, intrinsics, project, world_to_camera
from cagefield.rendering.splats.splat_lod import CLUSTER, Clusters, View
from cagefield.rendering.splats.splat_renderer import SplatRenderer
from splat_scenes import ball_of_splats, random_splats
from splat_views import LENSES, all_kinds, camera

NEAR = 0.05


def many(count: int = 6000, seed: int = 0) -> DeformedSplats:
    """Small splats all over a box, one in a hundred of them large, some opacities too low to show."""
    field = random_splats(count, 1, seed)
    chance = np.random.default_rng(seed)
    large = np.where(chance.random((count, 1)) < 0.01, 0.0, -2.0)
    opacities = np.where(chance.random(count) < 0.01, 0.003, field.opacities)
    return DeformedSplats.of_field(
        replace(field, log_scales=field.log_scales + np.float32(large), opacities=opacities)
    )


def views() -> dict[str, Camera]:
    """Cameras outside and inside the box [-1, 1]^3, of all lenses."""
    inside = Camera.look_at((0.1, 0.2, 0.0), (1.0, 0.5, 0.3), width=64, height=48, fov_x=0.7)
    narrow = Camera.look_at((4.0, 1.0, 0.5), (0.5, 0.3, 0.2), width=40, height=60, fov_x=0.06)
    return {"inside": inside, "narrow": narrow, **{lens: camera(lens) for lens in LENSES}}


@pytest.mark.parametrize("name", ["inside", "narrow", *LENSES])
@pytest.mark.parametrize("region", [None, (5, 3, 20, 31)])
def test_pictures_are_the_same_bit_for_bit(name: str, region: tuple[int, int, int, int] | None) -> None:
    splats, view = many(), views()[name]
    plain = project(splats, view, near=NEAR, region=region)
    culled = project(splats, view, near=NEAR, region=region, clusters=Clusters.build(splats))
    np.testing.assert_array_equal(culled.order, plain.order)
    np.testing.assert_array_equal(culled.picture(DEPTH), plain.picture(DEPTH))
    assert len(plain.order) > 20, "the picture shows too little"


@pytest.mark.parametrize("antialiased", [False, True])
def test_splats_of_all_kinds_are_kept(antialiased: bool) -> None:
    view = camera()
    splats = all_kinds(view.origin, antialiased=antialiased)
    plain = project(splats, view, near=NEAR).picture(DEPTH)
    np.testing.assert_array_equal(
        project(splats, view, near=NEAR, clusters=Clusters.build(splats)).picture(DEPTH), plain
    )


def seen_by(clusters: Clusters, view: Camera, detail: float = 0.0) -> list[NDArray[np.int32]]:
    lens = intrinsics(view)
    frustum = View.from_region(
        view.origin, world_to_camera(view), lens.focal, lens.center, (view.width, view.height), lens.limits,
        NEAR, pinhole=True,
    )  # fmt: skip
    return clusters.rows(frustum, detail)


def test_what_is_out_of_sight_is_not_projected() -> None:
    splats = many(60_000)
    for name in ("narrow", "inside"):
        (rows,) = seen_by(Clusters.build(splats), views()[name])
        shown = project(splats, views()[name], near=NEAR).order
        assert np.isin(shown, rows).all()
        # 234 clusters of splats a tenth of the box wide: most of the box is near the frustum.
        assert len(rows) < 0.4 * len(splats)


def test_dilogarithm_is_scipys() -> None:
    shares = np.linspace(1e-6, ALPHA_MAX, 200)
    np.testing.assert_allclose([dilogarithm(o) for o in shares], spence(1.0 - shares), rtol=1e-7)
    assert pytest.approx(DEEPEST, rel=1e-9) == spence(1.0 - ALPHA_MAX)


def test_representatives_keep_the_moments() -> None:
    """Against sums in float64: mean, covariance and color of each group, its optical depth."""
    splats = many(2000)
    clusters = Clusters.build(splats)
    fine, coarse = clusters.levels
    values = [np.asarray(v, np.float64) for v in (splats.means, splats.covariances, splats.sh)]
    means, covariances, sh = (v[clusters.order] for v in values)
    full = covariances[:, [0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(-1, 3, 3)
    variances = np.maximum(np.linalg.eigvalsh(full), 0.0)
    squares = np.stack([np.prod(np.delete(variances, k, 1), axis=1) for k in range(3)])
    number = spence(1.0 - np.minimum(ALPHA_MAX, splats.opacities[clusters.order].astype(np.float64)))
    weights = number * np.sqrt(squares.sum(axis=0))
    for level, size in ((fine, 8), (coarse, 64)):
        for group in range(0, len(level.splats), 7):
            rows = slice(group * size, (group + 1) * size)
            w = weights[rows] / weights[rows].sum()
            mean = w @ means[rows]
            offset = means[rows] - mean
            spread = np.einsum("n,ni,nj->ij", w, offset, offset)
            C = np.einsum("n,nij->ij", w, full[rows]) + spread
            np.testing.assert_allclose(level.splats.means[group], mean, atol=3e-6)
            np.testing.assert_allclose(
                level.splats.covariances[group], C[[0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2]], atol=1e-5
            )
            np.testing.assert_allclose(level.splats.sh[group], np.einsum("n,nkc->kc", w, sh[rows]), atol=1e-5)
            minors = sum(C[i, i] * C[j, j] - C[i, j] ** 2 for i, j in ((0, 1), (0, 2), (1, 2)))
            depth = weights[rows].sum() / np.sqrt(minors)
            # Minors of rounded covariances: thin splats know their areas to 1e-3.
            np.testing.assert_allclose(level.masses[group], (depth, number[rows].sum()), rtol=2e-3)


@pytest.mark.parametrize("antialiased", [False, True])
@pytest.mark.parametrize("width", [0.5, 1e-4])
def test_coincident_splats_are_as_opaque_as_one_after_the_other(width: float, antialiased: bool) -> None:
    """Eight round splats of a pixel or of none at one place take 8 times the optical depth from the light."""
    count, opacity = 8, 0.04
    view = Camera.look_at((0, 0, 50.0), (0, 0, 0), width=48, height=48, fov_x=0.5, up=(0, 1, 0))
    scale = width * 50.0 / view.fx * 8.0
    field = SplatField(
        np.zeros((count, 3)), np.full((count, 3), np.log(scale)), np.tile([1.0, 0, 0, 0], (count, 1)),
        np.full(count, opacity), np.zeros((count, 1, 3)), antialiased, np.array([[-1.0] * 3, [1.0] * 3]),
    )  # fmt: skip
    splats = DeformedSplats.of_field(field)
    each = project(splats, view, near=NEAR).picture(DEPTH)[..., 0]
    merged = project(splats, view, near=NEAR, clusters=Clusters.build(splats), detail=1.0)
    if antialiased and width < 0.1:
        assert not len(merged.order) and (each == 1.0).all()
        return
    assert len(merged.order) == 1
    depths = [-np.log(values).sum() for values in (each, merged.picture(DEPTH)[..., 0])]
    # What lies under ALPHA_MIN is cut: a tenth of each splat's depth, a sixtieth of the denser one's.
    assert 1.0 < depths[1] / depths[0] < 1.12


def test_representatives_where_groups_lie_within_a_pixel() -> None:
    """Far away, few are drawn, and the light that is let through stays what it was."""
    field = ball_of_splats(40_000)
    splats = DeformedSplats.of_field(field)
    clusters = Clusters.build(splats)
    view = Camera.look_at((0.0, -9.0, 2.0), (0, 0, 0), width=48, height=48, fov_x=0.2)
    plain = project(splats, view, near=NEAR)
    few = project(splats, view, near=NEAR, clusters=clusters, detail=1.0)
    assert len(few.order) < 0.2 * len(plain.order)
    got, want = few.picture(DEPTH), plain.picture(DEPTH)
    error = -10.0 * np.log10(np.mean(np.square(got[..., :4] - want[..., :4])))
    # One color, so that what remains is the outline: representatives are a little wider than their splats.
    assert error > 28.0
    assert abs(got[..., 0].mean() - want[..., 0].mean()) < 1e-2


def test_a_renderer_uses_them_with_edits_too(monkeypatch: pytest.MonkeyPatch) -> None:
    field = ball_of_splats(20_000)
    view = Camera.look_at((0.0, -3.0, 1.0), (0, 0, 0), width=32, height=32, fov_x=0.4)
    inner = Cage.box((0.0, 0.0, 0.3), 0.2)
    stacks = [EditStack(), EditStack([Edit.continuous(inner, inner.grown(0.4)).translate((0.1, 0.0, 0.1))]),
              EditStack([Edit.delete(inner)])]  # fmt: skip
    want = [SplatRenderer(field, stack).render(view) for stack in stacks]
    monkeypatch.setattr(splat_renderer, "MIN_CLUSTERED_SPLATS", 1000)
    renderer = SplatRenderer(field)
    # Few edited splats are drawn one by one, while something moves, too.
    few = renderer.with_edits(stacks[1])
    np.testing.assert_array_equal(few.render(view, step=1.0).rgb, few.render(view).rgb)
    monkeypatch.setattr(splat_renderer, "MIN_MERGED_SPLATS", 1000)
    for stack, expected in zip(stacks, want, strict=True):
        edited = renderer.with_edits(stack)
        got, moving = edited.render(view), edited.render(view, step=1.0)
        assert got is not None and moving is not None and expected is not None
        np.testing.assert_array_equal(got.rgb, expected.rgb)
        np.testing.assert_array_equal(got.depth, expected.depth)
        assert 0.0 < np.abs(moving.rgb - expected.rgb).mean() < 0.02


def test_clusters_are_made_once_and_in_the_order_of_others() -> None:
    splats = many(1000)
    first = Clusters.build(splats)
    assert Clusters.build(splats) is first
    moved = replace(splats, means=splats.means + np.float32(1.0))
    assert Clusters.build(moved, first).order is first.order
    assert len(first.boxes) == -(-1000 // CLUSTER) and sorted(first.order) == list(range(1000))
    none = DeformedSplats(splats.means[:0], splats.covariances[:0], splats.opacities[:0], splats.sh[:0])
    assert project(none, camera(), near=NEAR, clusters=Clusters.build(none), detail=1.0).pairs == 0
    assert splat_lod.MIN_CLUSTERED_SPLATS > CLUSTER


def test_clusters_do_not_keep_their_splats_in_memory() -> None:
    """Each state of a drag has splats of its own."""
    splats = all_kinds(camera().origin)
    clusters, alive = Clusters.build(splats), ref(splats)
    assert len(clusters.levels) > 0 and Clusters.build(splats) is clusters
    del splats
    gc.collect()
    assert alive() is None
