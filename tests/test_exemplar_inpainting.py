"""Patterns that go on through a hole: as strong as around it, like it, and true where it repeats."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from cagefield.completion.inpainting import exemplar_inpainting
from cagefield.completion.inpainting.exemplar_inpainting import inpaint_texture
from cagefield.completion.inpainting.support_inpainting import solve_membrane
from cagefield.typing import Array, Mask
from tiers import nightly_after_first

SIZE = 96


def hole(radius: float = 14.0) -> Mask:
    x, y = np.meshgrid(np.arange(SIZE), np.arange(SIZE), indexing="ij")
    return np.asarray((x - 45) ** 2 + (y - 50) ** 2 < radius**2)


def spots(seed: int = 0) -> Array:
    """Soft spots of two colors, some ten columns wide."""
    chance = np.random.default_rng(seed)
    noise = ndimage.gaussian_filter(chance.normal(size=(SIZE, SIZE)), 3.0)
    share = 1.0 / (1.0 + np.exp(-noise / (0.3 * noise.std())))
    return np.asarray(share[..., None] * np.array([0.6, 0.2, 0.1]) + 0.2)


def tiles() -> Array:
    x, y = np.meshgrid(np.arange(SIZE), np.arange(SIZE), indexing="ij")
    wave = np.sin(2 * np.pi * x / 9.0) * np.sin(2 * np.pi * y / 12.0)
    return np.asarray(0.5 + 0.4 * np.stack([wave, wave, -wave], axis=-1))


def spanned(colors: Array, gap: Mask) -> Array:
    return solve_membrane(gap, ~gap, colors.reshape(-1, 3)).reshape(colors.shape)


def filled(colors: Array, gap: Mask) -> tuple[Array, Array]:
    """(the membrane, the same with the pattern)."""
    hidden = np.where(gap[..., None], 9.0, colors)
    start = spanned(hidden, gap)
    return start, inpaint_texture(gap, ~gap, hidden, start, np.zeros(gap.shape))


def test_what_repeats_goes_on_as_it_is() -> None:
    colors, gap = tiles(), hole()
    start, found = filled(colors, gap)
    wrong, left = (np.abs(each - colors)[gap].mean() for each in (found, start))
    assert wrong < 0.2 * left


def test_a_large_hole_goes_by_patches_farther_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    colors, gap = tiles(), hole()
    start, found = filled(colors, gap)
    monkeypatch.setattr(exemplar_inpainting, "MAX_DENSE_PATCHES", 100)
    wrong, less, left = (np.abs(each - colors)[gap].mean() for each in (found, filled(colors, gap)[1], start))
    assert not np.array_equal(wrong, less) and less < 0.3 * left


def test_spots_go_on() -> None:
    """Of the colors that are there, without a seam, and not as weak as those of a membrane."""
    gap, inner = hole(), hole(9.0)
    strength = []
    for seed in range(2):
        colors = spots(seed)
        start, found = filled(colors, gap)
        strength.append([each[inner, 0].std() / colors[~gap, 0].std() for each in (start, found)])
        assert found[gap].min() >= colors.min() - 1e-9 and found[gap].max() <= colors.max() + 1e-9
        whole = np.where(gap[..., None], found, colors)
        rim = np.abs(np.diff(whole, axis=0))[gap[1:] != gap[:-1]]
        assert rim.mean() < 2.0 * np.abs(np.diff(colors, axis=0)).mean()
    left, now = np.mean(strength, axis=0)
    assert now > 0.55 and now > 2.0 * left


def test_one_color_stays_one() -> None:
    colors, gap = np.full((SIZE, SIZE, 3), 0.25), hole()
    np.testing.assert_allclose(filled(colors, gap)[1][gap], 0.25, atol=1e-9)


def test_a_pattern_that_does_not_fit_is_left_out() -> None:
    """Beside a rim of a color that is nowhere else spots would show where the hole was."""
    colors, gap = spots(), hole()
    colors[hole(15.5) & ~gap] = (0.2, 0.4, 3.0)
    start, found = filled(colors, gap)
    assert np.abs(found - start)[gap].mean() < 0.02


def test_where_little_is_known_all_stays_as_it_begins() -> None:
    colors, gap = spots(), ~hole(5.0)
    start, found = filled(colors, gap)
    np.testing.assert_array_equal(found[gap], start[gap])
    nothing = np.zeros((SIZE, SIZE), bool)
    np.testing.assert_array_equal(inpaint_texture(nothing, ~nothing, colors, colors, nothing * 1.0), colors)
    start = spanned(colors[:5, :7], hole()[:5, :7])
    np.testing.assert_array_equal(
        inpaint_texture(gap[:5, :7], ~gap[:5, :7], colors[:5, :7], start, np.zeros((5, 7))), start
    )


@pytest.mark.parametrize("seed", nightly_after_first([0, 1]))
def test_the_pattern_fits_to_what_is_half_known(seed: int) -> None:
    colors, gap = spots(), hole()
    ring = gap & ~hole(9.0)
    hidden = np.where((gap & ~ring)[..., None], 9.0, colors)
    start = spanned(np.where(gap[..., None], 9.0, colors), gap)
    alone, fitted = (
        inpaint_texture(gap, ~gap, hidden, start, firm * ring, seed=seed)[ring] for firm in (0.0, 0.8)
    )
    assert np.abs(fitted - colors[ring]).mean() < 0.6 * np.abs(alone - colors[ring]).mean()
