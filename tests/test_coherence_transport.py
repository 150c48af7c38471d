"""Grain: lines of a texture that go on through a hole, and textures that have none."""

from __future__ import annotations

import numpy as np
import pytest

from cagefield.completion.inpainting.coherence_transport import estimate_orientation, transport_colors
from cagefield.completion.inpainting.support_inpainting import solve_membrane
from cagefield.typing import Array, Mask

SIZE = 64


def hole() -> Mask:
    x, y = np.meshgrid(np.arange(SIZE), np.arange(SIZE), indexing="ij")
    return np.asarray((x - 31) ** 2 + (y - 33) ** 2 < 12**2)


def lines(angle: float, bend: float = 0.0) -> Array:
    """Waves of 8 columns, whose lines lie at an angle, and bend."""
    x, y = (a - 32.0 for a in np.meshgrid(np.arange(SIZE), np.arange(SIZE), indexing="ij"))
    across = -np.sin(angle) * x + np.cos(angle) * y
    along = np.cos(angle) * x + np.sin(angle) * y
    return np.asarray(np.sin(2 * np.pi * (across + bend * along**2) / 8.0))


def filled(values: Array, gap: Mask, given: Mask) -> tuple[Array, Array]:
    """(the membrane, the same with the grain) over the gap."""
    table = values.reshape(-1, 1)
    grain = estimate_orientation(values, given, lambda known, rows: solve_membrane(gap, known, rows))
    rows, share = transport_colors(gap, given, table, grain)
    spanned = solve_membrane(gap, given, table)[gap.reshape(-1), 0]
    return spanned, spanned + share * (rows[:, 0] - spanned)


@pytest.mark.parametrize("angle", [0.0, 0.4, 1.2, 2.5])
def test_stripes_go_on_through_a_hole(angle: float) -> None:
    values, gap = lines(angle), hole()
    spanned, grained = filled(np.where(gap, 7.0, values), gap, ~gap)
    wrong, left = ((each - values[gap]).std() for each in (grained, spanned))
    assert wrong < 0.4 * left
    assert spanned.std() < 0.4 * values[gap].std() and grained.std() > 0.7 * values[gap].std()


def test_bent_stripes_are_followed() -> None:
    values, gap = lines(0.7, bend=0.004), hole()
    spanned, grained = filled(np.where(gap, 7.0, values), gap, ~gap)
    assert (grained - values[gap]).std() < 0.75 * (spanned - values[gap]).std()


def test_noise_has_no_grain() -> None:
    values, gap = np.random.default_rng(0).normal(size=(SIZE, SIZE)), hole()
    grain = estimate_orientation(values, ~gap, lambda known, rows: solve_membrane(gap, known, rows))
    assert np.median(grain.coherence[gap]) < 0.1
    spanned, grained = filled(values, gap, ~gap)
    assert (grained - values[gap]).std() < 1.1 * (spanned - values[gap]).std()


def test_lines_that_do_not_come_out_again_bring_nothing() -> None:
    """At the edge of what is known, lines end in nothing: the membrane stays."""
    values, gap = lines(0.0), np.zeros((SIZE, SIZE), bool)
    gap[40:] = True
    grain = estimate_orientation(values, ~gap, lambda known, rows: solve_membrane(gap, known, rows))
    assert np.abs(grain.direction[20:36, 20:36, 0]).min() > 0.95  # they run into the gap
    rows, share = transport_colors(gap, ~gap, values.reshape(-1, 1), grain)
    assert (share == 0.0).all() and (rows == 0.0).all()


def test_nothing_known_has_no_grain() -> None:
    nothing, gap = np.zeros((SIZE, SIZE), bool), hole()
    grain = estimate_orientation(
        np.zeros((SIZE, SIZE)), nothing, lambda known, rows: solve_membrane(gap, known, rows)
    )
    assert not grain.coherence.any()
    assert not transport_colors(gap, nothing, np.zeros((SIZE * SIZE, 3)), grain)[1].any()
