"""The harmonics against quadrature over the sphere and against scipy's own associated Legendre recursion."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.special

from cagefield.errors import FieldError
from cagefield.fields import sh


def _directions(n: int) -> np.ndarray:
    vectors = np.random.default_rng(3).normal(size=(n, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def test_orthonormal_over_the_sphere():
    # Gauss-Legendre in z times equal steps in azimuth integrates products of degree 8 exactly.
    z, weight = np.polynomial.legendre.leggauss(5)
    azimuth = 2 * np.pi * np.arange(10) / 10
    zz, aa = (grid.ravel() for grid in np.meshgrid(z, azimuth, indexing="ij"))
    rho = np.sqrt(1 - zz**2)
    values = sh.sh_basis(np.stack([rho * np.cos(aa), rho * np.sin(aa), zz], axis=1), sh.MAX_DEGREE)
    weights = np.repeat(weight * 2 * np.pi / 10, 10)
    gram = values.T @ (weights[:, None] * values)
    np.testing.assert_allclose(gram, np.eye(sh.MAX_TERMS), atol=1e-14)  # rounding of 50 additions


def test_equals_scipy_with_condon_shortley_phase():
    d = _directions(50)
    polar, azimuth = np.arccos(d[:, 2]), np.arctan2(d[:, 1], d[:, 0])
    columns = []
    for degree in range(sh.MAX_DEGREE + 1):
        for m in range(-degree, degree + 1):
            y = scipy.special.sph_harm_y(degree, abs(m), polar, azimuth)  # includes (-1)^m
            part = y.real if m >= 0 else y.imag
            columns.append(part * (np.sqrt(2) if m else 1))
    np.testing.assert_allclose(sh.sh_basis(d, sh.MAX_DEGREE), np.stack(columns, axis=1), atol=1e-14)


def test_first_degree_is_minus_y_z_minus_x():
    np.testing.assert_allclose(sh.sh_basis(np.eye(3), 1)[:, 1:] / sh.C1, [[0, 0, -1], [-1, 0, 0], [0, 1, 0]])


@pytest.mark.parametrize("degree", range(sh.MAX_DEGREE + 1))
def test_lower_degrees_are_the_first_columns_and_float32_stays(degree):
    d = _directions(5).astype(np.float32)
    values = sh.sh_basis(d, degree)
    assert values.dtype == np.float32
    np.testing.assert_array_equal(values, sh.sh_basis(d, sh.MAX_DEGREE)[:, : (degree + 1) ** 2])


def test_rejects_degree_and_shape():
    with pytest.raises(FieldError, match="must be 0 to 4, got 5"):
        sh.sh_basis(np.eye(3), 5)
    with pytest.raises(FieldError, match=r"shape \[N,3\], got \[4, 2\]"):
        sh.sh_basis(np.zeros((4, 2)), 1)
