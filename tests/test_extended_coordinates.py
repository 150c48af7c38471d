"""Space in the coordinates of a cage, however far the cage is bent."""

from __future__ import annotations

import numpy as np
import pytest

from cagefield.errors import CageError
from cagefield.geometry.cage import Cage
from cagefield.typing import Array
from cagefield.warps.extended_coordinates import Extended
from cagefield.warps.trilinear_bend import bends_one_to_one, face_directions, forms
from random_cages import dragged, trilinear, unit_vectors

BOX = Cage.box((0.1, 0.2, 0.3), (1.0, 0.7, 0.8), (0.3, 0.5, 0.1))


def bent_cages(nearness: float, corners: int, count: int) -> list[Cage]:
    """Boxes with some corners moved to a share of what keeps them valid."""
    rng = np.random.default_rng(corners)
    cages: list[Cage] = []
    while len(cages) < count:
        by = np.zeros((8, 3))
        by[rng.choice(8, corners, replace=False)] = rng.uniform(-2.0, 2.0, (corners, 3))
        try:
            cages.append(dragged(BOX, by, nearness))
        except CageError:  # valid again beyond where it is not: less of it is no valid cage
            continue
    return cages


def bends_of(cages: list[Cage]) -> Array:
    return np.stack([Extended.from_cage(cage).bend for cage in cages])


@pytest.mark.parametrize("nearness", [0.7, 0.95, 0.99])
def test_space_goes_on_around_any_cage_with_one_corner_dragged(nearness: float) -> None:
    assert bends_one_to_one(bends_of(bent_cages(nearness, 1, 40))).all()


def test_space_goes_on_around_nearly_all_cages_with_every_corner_dragged() -> None:
    assert bends_one_to_one(bends_of(bent_cages(0.95, 8, 60))).mean() >= 0.98


def test_coordinates_are_found_again_around_cages_bent_to_the_limit() -> None:
    rng = np.random.default_rng(0)
    for cage in bent_cages(0.99, 1, 12) + bent_cages(0.95, 8, 12):
        place = Extended.from_cage(cage)
        if not place.is_one_to_one:
            continue
        xi = rng.uniform(-2.5, 2.5, (400, 3))
        x = place.points(xi)
        # The determinant at the dragged corner is 0.01 of the others: rounding times a hundred, and to spare.
        np.testing.assert_allclose(place.coordinates(x), xi, atol=1e-11)
        h = 1e-6
        slopes = [(place.points(xi + h * e) - place.points(xi - h * e)) / (2 * h) for e in np.eye(3)]
        error = np.abs(place.gradient(xi) @ np.stack(slopes, axis=2) - np.eye(3)).max(axis=(1, 2))
        assert np.quantile(error, 0.98) < 1e-6  # but for the few at a kink


def test_it_is_the_trilinear_map_in_the_cage_and_goes_on_without_a_jump() -> None:
    rng = np.random.default_rng(1)
    for cage in bent_cages(0.95, 2, 6):
        place, u = Extended.from_cage(cage), rng.random((20, 3))
        xi = 2.0 * u - 1.0
        expected = [trilinear(cage.corners, each) for each in u]
        np.testing.assert_allclose(place.points(xi), expected, atol=1e-12)
        xi /= np.abs(xi).max(axis=1, keepdims=True)
        jump = place.points(xi * (1 + 1e-9)) - place.points(xi * (1 - 1e-9))
        assert np.abs(jump).max() < 1e-7


def test_faces_are_tilted_where_they_must_be() -> None:
    # The normals of a face bent little are near its axis, which is kept.
    assert np.abs(forms(bends_of(bent_cages(0.2, 8, 20)))[:, 4:]).max() == 0.0
    tilts = forms(bends_of(bent_cages(0.95, 1, 40)))[:, 4:]
    assert 3 < (np.abs(tilts).max(axis=(1, 2)) > 0.0).sum() < 35
    assert (tilts[:, range(6), np.repeat(range(3), 2)] == 0.0).all()


def test_tilts_change_without_a_jump() -> None:
    start, end = bends_of(bent_cages(0.95, 1, 2))
    t = np.linspace(0.0, 1.0, 4001)[:, None, None]
    tilts = forms((1.0 - t) * start + t * end)[:, 4:]
    assert np.abs(tilts).max() > 0.05
    assert np.abs(np.diff(tilts, axis=0)).max() < 0.01


def test_tilts_are_the_middles_of_the_least_cones_of_normals() -> None:
    rng = np.random.default_rng(2)
    base = unit_vectors(rng, 30)
    n = base[:, None] + 0.6 * rng.normal(size=(30, 4, 3))
    n[:5, 1:] = n[:5, :1]  # all alike
    n[5:10, 2:] = n[5:10, :2]  # two and two
    n /= np.linalg.norm(n, axis=2, keepdims=True)
    found = face_directions(n)
    least = (n @ found[:, :, None]).min(axis=(1, 2))
    others = base[:, None] + rng.normal(size=(30, 4000, 3))
    others /= np.linalg.norm(others, axis=2, keepdims=True)
    best = (others @ np.swapaxes(n, 1, 2)).min(axis=2).max(axis=1)
    hemisphere = best > 0.0  # else no direction will do
    assert hemisphere.sum() > 15
    assert (least[hemisphere] >= best[hemisphere] - 1e-12).all()
    np.testing.assert_allclose(found[:5], n[:5, 0], atol=1e-12)
