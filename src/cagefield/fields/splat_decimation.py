"""Decimation of splats: fewer splats for levels of detail, by pairwise merges of least cost.

Notation: splat n has the mean m, the covariance C, the opacity o, the color c (its first harmonic), and the
area A = sqrt(trace(cof C)), between those of its projections. Splats are seen through a blur of the spacing
that the wanted number leaves: C' = C + e^2 I, amplitude a' = Li2(o) A / A'. Then

    <i, j> = integral of G_i G_j = sqrt(|C'_i| |C'_j| / |C'_i + C'_j|) exp(-d^T (C'_i + C'_j)^-1 d / 2)

up to a factor, d = m_i - m_j, and merging i and j into k costs || f_i + f_j - f_k ||^2 with f = a' (1, c) G';
removing i costs || f_i ||^2. A merged splat has the moments of the two, weighted by their optical depth
A Li2(o), and that depth (Li2 is the dilogarithm: the integral of -log(1 - o exp(-r^2 / 2)) over the plane is
2 pi Li2(o)).

In each round merges with neighbors and removals are done from the cheapest on, at most one of a splat; the
next round's costs are those of the splats that are left.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.special import spence

from cagefield.errors import FieldError
from cagefield.fields.sh import C0
from cagefield.fields.splat_field import SplatField
from cagefield.geometry.quaternions import quaternions_from_matrices, rotation_matrices
from cagefield.typing import Array

MERGE_CANDIDATES = 6
"""Nearest splats with which one may merge."""

BLUR_SPACINGS = 0.5
"""Standard deviation of the blur, in spacings of the wanted number of splats over their areas."""

ROUND_SHARE = 0.125
"""Share of the splats by which a round makes them fewer: smaller shares find better partners."""

MAX_MERGED_OPACITY = 0.999
"""Maximum opacity of a merged splat."""


@dataclass
class _Splats:
    """Splats on their way: means [N,3], covariances [N,6] (xx, xy, xz, yy, yz, zz), opacities [N], sh
    [N,K,3], row [N] of the splat in the field, -1 for a merged one."""

    means: Array
    covariances: Array
    opacities: Array
    sh: NDArray[np.float32]
    row: NDArray[np.int64]

    @classmethod
    def of_field(cls, field: SplatField) -> _Splats:
        """All splats of a field."""
        covariances = np.empty((len(field), 6))
        for start in range(0, len(field), _BLOCK):
            rows = slice(start, start + _BLOCK)
            axes = rotation_matrices(field.quaternions[rows].astype(np.float64))
            axes = axes * np.exp(field.log_scales[rows].astype(np.float64))[:, None, :]
            covariances[rows] = (axes @ axes.transpose(0, 2, 1)).reshape(-1, 9)[:, _UPPER]
        means, opacities = field.means.astype(np.float64), field.opacities.astype(np.float64)
        return cls(means, covariances, opacities, field.sh, np.arange(len(field)))

    def take(self, rows: NDArray[np.int64]) -> _Splats:
        """Splats of the given rows."""
        return _Splats(
            self.means[rows], self.covariances[rows], self.opacities[rows], self.sh[rows], self.row[rows]
        )

    def followed_by(self, others: _Splats) -> _Splats:
        """These splats, and others after them."""
        return _Splats(
            np.concatenate([self.means, others.means]),
            np.concatenate([self.covariances, others.covariances]),
            np.concatenate([self.opacities, others.opacities]),
            np.concatenate([self.sh, others.sh]),
            np.concatenate([self.row, others.row]),
        )


def decimate_splats(
    field: SplatField, count: int, on_progress: Callable[[float], None] = lambda _: None
) -> SplatField:
    """Field of `count` splats that looks like `field` (canonical space); itself where it has no more.

    Splats that were not merged stay as they are, bit for bit, and in their order; merged ones follow.
    `on_progress` gets the share done.

    Raises:
        FieldError: `count` below 1.
    """
    if count < 1:
        raise FieldError(f"a field has at least 1 splat, got {count}")
    if len(field) <= count:
        return field
    splats = _Splats.of_field(field)
    covered = 2.0 * np.pi * float((splats.opacities * _areas(splats.covariances)).sum())
    blur = BLUR_SPACINGS**2 * covered / count
    surplus = len(field) - count
    while len(splats.means) > count:
        splats = _fewer(splats, count, blur)
        on_progress(1.0 - (len(splats.means) - count) / surplus)
    return _field_of(splats, field)


def _fewer(splats: _Splats, count: int, blur: float) -> _Splats:
    """Splats after one round, `count` of them or more; blur: e^2."""
    from cagefield.fields.kernels import splat_decimation as kernels

    number = len(splats.means)
    _, near = cKDTree(splats.means).query(splats.means, k=min(MERGE_CANDIDATES + 1, number), workers=-1)
    near = np.ascontiguousarray(near[:, 1:])
    costs, own = merge_costs(splats, near, blur)
    every = np.concatenate([costs.reshape(-1), own])
    first = np.concatenate([np.repeat(np.arange(number), near.shape[1]), np.arange(number)])
    second = np.concatenate([near.reshape(-1), np.full(number, -1)])
    limit = min(number - count, max(1, int(ROUND_SHARE * number)))
    chosen = np.empty(limit, np.int64)
    stays = np.ones(number, bool)
    chosen = chosen[: kernels.choose(np.argsort(every, kind="stable"), first, second, stays, chosen)]
    pairs = chosen[second[chosen] >= 0]
    return splats.take(np.flatnonzero(stays)).followed_by(merge(splats, first[pairs], second[pairs]))


def merge_costs(splats: _Splats, near: NDArray[np.int64], blur: float) -> tuple[Array, Array]:
    """(costs [N,K] of merging splats with neighbors near [N,K], costs [N] of removing them); blur: e^2."""
    from cagefield.fields.kernels import splat_decimation as kernels

    areas = _areas(splats.covariances)
    blurred = splats.covariances + blur * _IDENTITY
    colors = 0.5 + C0 * splats.sh[:, 0].astype(np.float64)
    depths = areas * dilogarithm(splats.opacities)
    amplitudes = depths / np.maximum(_areas(blurred), 1e-300)
    channels = amplitudes[:, None] * np.concatenate([np.ones((len(areas), 1)), colors], axis=1)
    # |C'| |C'| / |2 C'| = |C'| / 8
    own = (channels**2).sum(axis=1) * np.sqrt(np.maximum(_determinants(blurred), 0.0) / 8.0)
    costs = np.empty(near.shape)
    kernels.merge_costs(
        splats.means,
        splats.covariances,
        blurred,
        channels,
        depths,
        colors,
        own,
        near,
        blur,
        MAX_OPTICAL_DEPTH,
        costs,
    )
    return costs, own


def merge(splats: _Splats, first: NDArray[np.int64], second: NDArray[np.int64]) -> _Splats:
    """The merged splats [P] of pairs of rows."""
    depths = [dilogarithm(splats.opacities[k]) * _areas(splats.covariances[k]) for k in (first, second)]
    total = depths[0] + depths[1]
    share = np.where(total > 0.0, depths[1] / np.maximum(total, 1e-300), 0.5)[:, None]
    apart = splats.means[second] - splats.means[first]
    between = (apart[:, :, None] * apart[:, None, :]).reshape(-1, 9)[:, _UPPER]
    covariances = (
        (1.0 - share) * splats.covariances[first]
        + share * splats.covariances[second]
        + share * (1.0 - share) * between
    )
    sh = (1.0 - share)[..., None] * splats.sh[first] + share[..., None] * splats.sh[second]
    return _Splats(
        splats.means[first] + share * apart,
        covariances,
        np.interp(total / np.maximum(_areas(covariances), 1e-300), _DEPTHS, _OPACITIES),
        sh.astype(np.float32),
        np.full(len(first), -1),
    )


def dilogarithm(opacities: Array) -> Array:
    """Li2 [N] of opacities [N], of at most MAX_MERGED_OPACITY."""
    return np.asarray(spence(1.0 - np.minimum(opacities, MAX_MERGED_OPACITY)))


def _areas(covariances: Array) -> Array:
    """Areas A [N] of covariances [N,6]."""
    xx, xy, xz, yy, yz, zz = covariances.T
    minors = xx * yy - xy**2 + yy * zz - yz**2 + xx * zz - xz**2
    return np.asarray(np.sqrt(np.maximum(minors, 0.0)))


def _determinants(covariances: Array) -> Array:
    """Determinants [N] of covariances [N,6]."""
    xx, xy, xz, yy, yz, zz = covariances.T
    return np.asarray(xx * (yy * zz - yz**2) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz))


def _field_of(splats: _Splats, field: SplatField) -> SplatField:
    """The field of splats that came from `field`."""
    kept, merged = np.flatnonzero(splats.row >= 0), splats.take(np.flatnonzero(splats.row < 0))
    kept = kept[np.argsort(splats.row[kept])]
    rows = splats.row[kept]
    variances, axes = np.linalg.eigh(merged.covariances[:, _FULL].reshape(-1, 3, 3))
    # The largest axis first: discs are normal to the third one.
    variances, axes = variances[:, ::-1], axes[:, :, ::-1].copy()
    axes[np.linalg.det(axes) < 0.0, :, 2] *= -1.0
    least = float(np.exp(2.0 * field.log_scales.min()))
    columns: dict[str, Array] = {
        "means": merged.means,
        "log_scales": 0.5 * np.log(np.maximum(variances, least)),
        "quaternions": quaternions_from_matrices(axes).astype(np.float64),
        "opacities": merged.opacities,
        "sh": merged.sh.astype(np.float64),
    }
    new: dict[str, Any] = {
        name: np.concatenate([getattr(field, name)[rows], values.astype(np.float32)])
        for name, values in columns.items()
    }
    return replace(field, **new)


_UPPER = np.array([0, 1, 2, 4, 5, 8])
_FULL = np.array([0, 1, 2, 1, 3, 4, 2, 4, 5])
_IDENTITY = np.array([1.0, 0.0, 0.0, 1.0, 0.0, 1.0])
MAX_OPTICAL_DEPTH = float(dilogarithm(np.array([1.0]))[0])
"""Li2 of MAX_MERGED_OPACITY."""
_DEPTHS = np.linspace(0.0, MAX_OPTICAL_DEPTH, 4096)
_FINE = np.linspace(0.0, MAX_MERGED_OPACITY, 65536)
_OPACITIES = np.interp(_DEPTHS, dilogarithm(_FINE), _FINE)
_BLOCK = 1 << 16
"""Splats whose covariances are computed at a time."""
