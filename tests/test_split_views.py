"""Split splats that coarse views draw whole: sizes against sums over pixels, and pictures on both sides."""

from __future__ import annotations

import numpy as np
import pytest

from cagefield import Cage, Camera, Edit, EditStack
from cagefield.fields.splat_field import SplatField
from cagefield.images.metrics import psnr
from cagefield.rendering.splats import split_views as views_module
from cagefield.rendering.splats.kernels.projection import BLUR
from cagefield.rendering.splats.kernels.split_sizes import sizes_of, squared_difference
from cagefield.rendering.splats.raster_splats import deformed_splats
from cagefield.rendering.splats.rasterizer import camera_args
from cagefield.rendering.splats.splat_provenance import SplatSet
from cagefield.rendering.splats.splat_renderer import SplatRenderer
from cagefield.rendering.splats.split_views import split_views
from cagefield.rendering.splats.splitting import split_of
from splat_scenes import random_splats

INNER = Cage.box((0, 0, 0), 0.6)
EDITS = {
    "move": Edit.move(INNER).translate((0.5, 0.1, 0.0)),
    "copy": Edit.copy(INNER).translate((0.9, 0.1, 0.0)),
    "delete": Edit.delete(INNER),
    "turn": Edit.continuous(Cage.box((0, 0, 0), 0.4), Cage.box((0, 0, 0), 1.4)).rotate((0, 0, 1.2)),
}


def field(count: int = 300) -> SplatField:
    """Splats about and across the cages."""
    return random_splats(count, degree=1)


def camera(distance: float, pixels: int = 60) -> Camera:
    """A camera that sees all splats from a distance, or their middle."""
    return Camera.look_at((0.2, -distance, 0.1), (0, 0, 0), width=pixels, height=pixels, fov_x=0.6)


def symmetric(chance: np.random.Generator, count: int) -> np.ndarray:
    """Covariances [count,6] of splats a few tenths long."""
    A = chance.normal(0.0, 0.2, (count, 3, 3))
    return (A @ A.transpose(0, 2, 1)).reshape(-1, 9)[:, [0, 1, 2, 4, 5, 8]].astype(np.float32)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("pixel", [0.0, 0.4])
def test_differences_are_those_of_pictures(axis: int, pixel: float) -> None:
    chance = np.random.default_rng(axis)
    means = chance.normal(0.0, 0.3, (4, 3)).astype(np.float32)
    covariances = symmetric(chance, 4)
    weights = np.array([0.7, 0.4, 0.2, -0.9], np.float32)
    kept = [k for k in range(3) if k != axis]
    edge = np.linspace(-4.0, 4.0, 401)
    at = np.stack(np.meshgrid(edge, edge, indexing="ij"), axis=-1)
    picture = np.zeros(at.shape[:2])
    for mean, c, weight in zip(means, covariances, weights, strict=True):
        C = np.array([[c[0], c[1], c[2]], [c[1], c[3], c[4]], [c[2], c[4], c[5]]], np.float64)
        S = C[np.ix_(kept, kept)]
        wide = S + BLUR * pixel**2 * np.eye(2)
        d = at - mean[kept]
        share = np.sqrt(np.linalg.det(S) / np.linalg.det(wide))
        picture += weight * share * np.exp(-0.5 * np.einsum("...i,ij,...j", d, np.linalg.inv(wide), d))
    wanted = float((picture**2).sum()) * (edge[1] - edge[0]) ** 2
    got = squared_difference(axis, BLUR * pixel**2, means, covariances, weights, np.arange(4))
    assert got == pytest.approx(wanted, rel=1e-3)


def test_a_size_is_where_the_difference_is_the_limit() -> None:
    chance = np.random.default_rng(5)
    means = chance.normal(0.0, 0.2, (9, 3)).astype(np.float32)
    covariances, limit = symmetric(chance, 9), 0.2
    weights = np.array([0.5, 0.5, -0.8] * 3, np.float32)
    starts, rows, sizes = np.array([0, 3, 6, 9]), np.arange(9), np.empty(3, np.float32)
    limits = np.full(3, limit)
    sizes_of(starts, rows, means, covariances, weights, limits, 64, sizes)
    for group, size in enumerate(sizes):
        worst = max(
            squared_difference(
                axis, BLUR * float(size) ** 2, means, covariances, weights, rows[3 * group : 3 * group + 3]
            )
            for axis in range(3)
        )
        # No more than the limit, and not much less: the size is known to a part of its interval.
        assert 0.5 * limit < np.sqrt(worst) / size <= limit * (1.0 + 1e-5)
    sizes_of(starts, rows, means, covariances, weights, limits, 2, sizes)
    assert np.isinf(sizes).all()


@pytest.mark.parametrize("name", EDITS)
def test_near_views_have_all_children_and_far_ones_the_parents(name: str) -> None:
    edits, splats = EditStack([EDITS[name]]), SplatSet.from_field(field())
    split = split_of(splats, edits)
    assert split is not None
    views = split_views(splats, edits, split)
    fine = views.chosen(camera_args(camera(4.0, 100_000), 0.01))
    finite = np.isfinite(views.sizes[views.groups])
    assert np.array_equal(fine, ~views.is_parent)
    coarse = views.chosen(camera_args(camera(1e5, 8), 0.01))
    assert np.array_equal(coarse, views.is_parent == finite)
    # Both are the splats of the edit: with children, and as it is without any.
    every = deformed_splats(splats, edits, split=split)
    own, whole = views.split(), deformed_splats(splats, edits)
    for attribute in ("means", "covariances", "opacities", "sh"):
        assert np.array_equal(getattr(own, attribute), getattr(every, attribute))
    if finite.all():
        shown = views.splats.means[np.append(np.ones(views.count, bool), coarse)]
        assert sorted(map(tuple, shown.tolist())) == sorted(map(tuple, whole.means.tolist()))


@pytest.mark.parametrize("name", EDITS)
def test_pictures_of_chosen_splats_are_those_of_all_children(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    splats, edits = field(), EditStack([EDITS[name]])
    chosen = SplatRenderer(splats, edits)
    picture = chosen.render(camera(9.0, 24)).rgb
    assert chosen._split_views is not None
    drawn = chosen._split_views.chosen(camera_args(camera(9.0, 24), 0.01))
    assert np.count_nonzero(drawn & chosen._split_views.is_parent) > 0
    with_normals = chosen.render(camera(9.0, 24), normals=True)
    assert np.array_equal(with_normals.rgb, picture) and with_normals.normals is not None
    monkeypatch.setattr(views_module, "LIMIT", 1e-9)
    every = SplatRenderer(splats, edits).render(camera(9.0, 24)).rgb
    assert psnr(picture, every) > 40.0


def test_pictures_do_not_jump_where_splats_become_whole() -> None:
    # Distances at which the largest number of groups passes its size within a step of 1 %.
    renderer = SplatRenderer(field(), EditStack([EDITS["move"]]))
    views = renderer._split_views
    assert views is not None
    still = camera(6.0, 48)
    focal = camera_args(still, 0.01).focal.max()
    sizes = views.sizes.copy()
    ratio = 6.0 / (sizes[np.isfinite(sizes) & (sizes > 0.0)] * focal)
    steps = np.geomspace(ratio.min(), ratio.max(), 40)
    counts = np.histogram(ratio, steps)[0]
    at = int(counts.argmax())
    pictures = []
    for factor in steps[at : at + 2]:
        views.sizes[:] = sizes * factor
        pictures.append(renderer.render(still).rgb)
    assert counts[at] > 0 and not np.array_equal(*pictures)
    assert psnr(*pictures) > 45.0
