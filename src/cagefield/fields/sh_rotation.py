"""Rotations of real spherical harmonics: Wigner matrices, in the order and with the signs of `sh`.

A function f(d) = sum_k Y_k(d) c_k on the sphere, rotated by R, is f(R^T d). It has harmonics of the same
degrees, so c'_l = M_l(R) c_l for each degree l, M_l [2l+1, 2l+1] orthogonal. With fixed directions D and
A = Y_l(D), M_l(R) = A^-1 Y_l(R^T D): exact, since 2l+1 directions in general position determine the function.

Source: Green, "Spherical Harmonic Lighting: The Gritty Details" (2003), for rotations degree by degree; the
matrices by projection are those of Ivanic and Ruedenberg (1996).
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from cagefield.fields.sh import sh_basis
from cagefield.typing import AnyArray, Array

CHUNK_ROWS = 1 << 16
"""Number of coefficient sets rotated at a time."""


def rotate_sh_each(sh: AnyArray, rotations: AnyArray) -> NDArray[np.float32]:
    """Coefficients [N,K,3] of functions rotated by one rotation each [N,3,3]; exact to rounding, float32."""
    degree = int(np.sqrt(sh.shape[1])) - 1
    rotated = np.array(sh, np.float32)
    for first in range(0, len(sh) if degree else 0, CHUNK_ROWS):
        chunk = slice(first, first + CHUNK_ROWS)
        for l in range(1, degree + 1):  # noqa: E741
            rows = slice(l * l, (l + 1) ** 2)
            rotated[chunk, rows] = wigner_matrices(rotations[chunk], l) @ sh[chunk, rows].astype(np.float64)
    return rotated


def rotate_sh(sh: AnyArray, rotation: AnyArray) -> NDArray[np.float32]:
    """Coefficients [N,K,3] of functions rotated by a common rotation [3,3]; exact to rounding."""
    rotated = np.array(sh, np.float32)
    for l in range(1, int(np.sqrt(sh.shape[1]))):  # noqa: E741
        rows = slice(l * l, (l + 1) ** 2)
        matrix = wigner_matrices(np.asarray(rotation)[None], l)[0].astype(np.float32)
        rotated[:, rows] = np.einsum("jk,nkc->njc", matrix, rotated[:, rows])
    return rotated


def wigner_matrices(rotations: AnyArray, degree: int) -> Array:
    """Wigner matrices M_l [N,2l+1,2l+1] of rotations [N,3,3]."""
    directions, inverse = _directions(degree)
    # R^T d for each of the directions, as rows d^T R
    rotated = directions @ rotations.astype(np.float64)
    values = sh_basis(rotated.reshape(-1, 3), degree)[:, degree**2 :]
    return np.asarray(inverse @ values.reshape(len(rotations), len(directions), -1))


@cache
def _directions(degree: int) -> tuple[Array, Array]:
    """(directions D [2l+1,3], inverse of Y_l(D)), the best-conditioned of 200 random sets."""
    rng = np.random.default_rng(degree)
    trials = []
    for _ in range(200):
        d = rng.normal(size=(2 * degree + 1, 3))
        d /= np.linalg.norm(d, axis=1, keepdims=True)
        trials.append((float(np.linalg.cond(sh_basis(d, degree)[:, degree**2 :])), d))
    best = min(trials, key=lambda pair: pair[0])[1]
    return best, np.linalg.inv(sh_basis(best, degree)[:, degree**2 :])
