"""Rotated harmonics against the harmonics of rotated directions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cagefield.fields.sh import MAX_DEGREE, sh_basis
from cagefield.fields.sh_rotation import rotate_sh_each, wigner_matrices


@pytest.mark.parametrize("degree", range(MAX_DEGREE + 1))
def test_rotated_coefficients_are_the_function_at_rotated_directions(degree: int) -> None:
    chance = np.random.default_rng(degree)
    sh = chance.normal(size=(40, (degree + 1) ** 2, 3)).astype(np.float32)
    R = Rotation.random(40, random_state=1).as_matrix()
    d = chance.normal(size=(40, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    back = np.einsum("nji,nj->ni", R, d)  # R^T d
    expected = np.einsum("nk,nkc->nc", sh_basis(back, degree), sh)
    got = np.einsum("nk,nkc->nc", sh_basis(d, degree), rotate_sh_each(sh, R))
    # coefficients are rounded to float32: 1e-7 of sums of up to 16 terms
    np.testing.assert_allclose(got, expected, atol=3e-6)


@pytest.mark.parametrize("degree", range(1, MAX_DEGREE + 1))
def test_matrices_are_a_representation_of_rotations(degree: int) -> None:
    first, second = Rotation.random(2, random_state=degree).as_matrix()
    A, B, AB = wigner_matrices(np.stack([first, second, first @ second]), degree)
    np.testing.assert_allclose(A @ B, AB, atol=1e-12)
    np.testing.assert_allclose(A @ A.T, np.eye(2 * degree + 1), atol=1e-12)
    trace = np.trace(A)
    angle = Rotation.from_matrix(first).magnitude()
    # the character of the rotation group: sin((2l + 1) a / 2) / sin(a / 2)
    assert trace == pytest.approx(np.sin((2 * degree + 1) * angle / 2) / np.sin(angle / 2))
