"""SplatField: a mixture of anisotropic 3D Gaussians with spherical-harmonic colour.

Notation: splat n has the mean m, the scales s = exp(log_scales) (standard deviations along its own axes), the
rotation R of its unit quaternion (w, x, y, z), hence the covariance C = R diag(s^2) R^T, the opacity o in
[0, 1] and harmonics k. Its colour seen along d is max(0, 0.5 + sum_l Y_l(d) k_l). A picture of splats shows
each with alpha = o exp(-e^T Q e / 2) at a pixel's offset e from its projected mean, Q the inverse of its
projected covariance, sorted by depth (`cagefield.rendering.splats.reference_rasterizer`). What the splats
are at points,
for code that samples, follows from that: see `cagefield.fields.splat_mixture`.

Source: Kerbl et al., "3D Gaussian Splatting for Real-Time Radiance Field Rendering" (2023), equations 1 to 6.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cagefield.errors import FieldError
from cagefield.fields.field_files import read_tensors, write_tensors
from cagefield.fields.sh import MAX_DEGREE
from cagefield.files import json_text
from cagefield.typing import Float32

if TYPE_CHECKING:
    from cagefield.fields.splat_mixture import SplatMixture


FORMAT_VERSION = "1"

Offset: TypeAlias = tuple[float, float, float]
NO_OFFSET: Offset = (0.0, 0.0, 0.0)

BLOCK = 1 << 16
"""Splats that are checked at a time."""


@dataclass(frozen=True, eq=False)
class SplatField:
    """3D Gaussian splats (canonical space, world units).

    Arrays that may be written to are copied; read-only ones are taken as they are, and must stay so.

    Attributes:
        means: [N,3] float32.
        log_scales: [N,3] float32, natural logarithms of the standard deviations along the splats' axes.
        quaternions: [N,4] float32, (w, x, y, z), unit: those given are normalised.
        opacities: [N] float32, in [0, 1].
        sh: [N, (degree+1)^2, 3] float32 colour coefficients, degree 0 to `sh.MAX_DEGREE`.
        antialiased: opacity is scaled so that what a splat adds to a picture does not grow with the filter of
            .3 pixels^2 that every splat gets (Mip-Splatting's 2D filter).
        discs: splats are the discs of 2DGS, across their third axes, and pictures show each where the pixels'
            rays meet it (`cagefield.rendering.splats.reference_discs`).
        bounds: [2,3] float64: the box of interest; left out, the box of the middle 98 % of the means.
        unbounded: True where splats beyond `bounds` are the background.
        offset: coordinates of the file that the splats are from, less those of the field: what float32 could
            not hold of them. Exports add it.

    Raises:
        FieldError: shapes that do not fit, NaN or infinity, opacities outside [0, 1].
    """

    means: Float32
    log_scales: Float32
    quaternions: Float32
    opacities: Float32
    sh: Float32
    antialiased: bool = False
    bounds: NDArray[np.float64] = None  # type: ignore[assignment]
    unbounded: bool = False
    discs: bool = False
    offset: Offset = NO_OFFSET

    def __post_init__(self) -> None:
        fix = object.__setattr__
        count = np.shape(self.means)[0] if np.ndim(self.means) else 0
        shapes = {
            "means": (count, 3),
            "log_scales": (count, 3),
            "quaternions": (count, 4),
            "opacities": (count,),
        }
        for name in (*shapes, "sh"):
            fix(self, name, _frozen(getattr(self, name), np.float32))
        for name, shape in shapes.items():
            if getattr(self, name).shape != shape:
                raise FieldError(f"{name} must be {list(shape)}, got {list(getattr(self, name).shape)}")
        if self.sh.ndim != 3 or self.sh.shape[0] != count or self.sh.shape[1:] not in _SH_SHAPES:
            terms = "|".join(str(terms) for terms, _ in _SH_SHAPES)
            raise FieldError(
                f"sh must be [{count}, {terms}, 3] (degree 0 to {MAX_DEGREE}), got {list(self.sh.shape)}"
            )
        for name in (*shapes, "sh"):
            values = getattr(self, name)
            for rows in _blocks(count):
                finite = np.isfinite(values[rows]).all(axis=tuple(range(1, values.ndim)))
                if not finite.all():
                    bad = rows.start + int(np.argmin(finite))
                    raise FieldError(f"{name} must be finite, splat {bad} of {count} is not; remove it")
        if count and not (self.opacities.min() >= 0.0 and self.opacities.max() <= 1.0):
            raise FieldError(
                f"opacities must lie in [0, 1], got {self.opacities.min():g} to {self.opacities.max():g}"
            )
        unit = np.empty((count, 4), np.float32)
        for rows in _blocks(count):
            norm = np.linalg.norm(self.quaternions[rows].astype(np.float64), axis=1, keepdims=True)
            if not norm.min() > 0.0:
                bad = rows.start + int(np.argmin(norm))
                raise FieldError(f"quaternion {bad} of {count} is 0; a rotation has length 1")
            unit[rows] = self.quaternions[rows] / norm
        fix(self, "quaternions", _read_only(unit))
        bounds = _box_of(self.means) if self.bounds is None else np.asarray(self.bounds, np.float64)
        if bounds.shape != (2, 3) or not np.isfinite(bounds).all() or not (bounds[0] < bounds[1]).all():
            raise FieldError(f"bounds must be 2 finite corners [2,3], lower < upper, got {bounds.tolist()}")
        fix(self, "bounds", _frozen(bounds, np.float64))
        offset = tuple(float(value) for value in self.offset)
        if len(offset) != 3 or not np.isfinite(offset).all():
            raise FieldError(f"offset must be 3 finite numbers, got {list(offset)}")
        fix(self, "offset", offset)

    def __len__(self) -> int:
        return len(self.means)

    @property
    def sh_degree(self) -> int:
        """Degree of the colour's spherical harmonics, 0 to `sh.MAX_DEGREE`."""
        return _SH_SHAPES.index(self.sh.shape[1:])

    @property
    def center(self) -> NDArray[np.float64]:
        """Centre [3] of `bounds`."""
        return np.asarray(self.bounds.mean(axis=0))

    @property
    def half_size(self) -> NDArray[np.float64]:
        """Half of the edge lengths [3] of `bounds`."""
        return np.asarray((self.bounds[1] - self.bounds[0]) / 2)

    @property
    def sample_spacing(self) -> float:
        """World length between two samples that miss no detail: what most splats are wide.

        The median of the middle one of the three scales, weighted by opacity, of the splats in `bounds`: the
        smallest says how thin surfaces are, which is no detail that a picture shows. A thousandth of the
        largest edge of `bounds` where there are no splats.
        """
        inside = ((self.means >= self.bounds[0]) & (self.means <= self.bounds[1])).all(axis=1)
        weights = np.where(inside, self.opacities, 0.0).astype(np.float64)
        if not weights.sum() > 0.0:
            return float(2e-3 * self.half_size.max())
        middle = np.median(self.log_scales, axis=1)
        order = np.argsort(middle)
        half = np.searchsorted(np.cumsum(weights[order]), 0.5 * weights.sum())
        return float(np.exp(np.float64(middle[order[half]])))

    def __call__(self, positions: ArrayLike, viewdirs: ArrayLike) -> tuple[Float32, Float32]:
        """(sigma [N] per world unit, rgb [N,3]) at canonical positions [N,3] along unit viewdirs [N,3].

        The density whose integral along any ray is what a picture of the splats takes from it; the colours of
        the splats at a point, weighted by their densities (`cagefield.fields.splat_mixture`).
        """
        sigma, rgb = self.mixture.along(np.asarray(positions), np.asarray(viewdirs)[:, None])
        return sigma[:, 0], np.clip(rgb[:, 0], 0.0, 1.0)

    def seen_along(self, positions: ArrayLike, viewdirs: ArrayLike) -> tuple[Float32, Float32]:
        """(sigma [N], rgb [N,K,3]) at positions [N,3] along unit viewdirs [N,K,3]; sigma is their mean."""
        sigma, rgb = self.mixture.along(np.asarray(positions), np.asarray(viewdirs))
        return sigma.mean(axis=1), np.clip(rgb, 0.0, 1.0)

    def grid_sigma(self, positions: ArrayLike) -> Float32:
        """The density [N] at positions [N,3] for grids: smoother, the same for all directions."""
        return self.mixture.grid_sigma(np.asarray(positions))

    @cached_property
    def mixture(self) -> SplatMixture:
        """The splats, ready to be asked at points; made on first use."""
        from cagefield.fields.splat_mixture import SplatMixture

        return SplatMixture.of(self.means, self.log_scales, self.quaternions, self.opacities, self.sh)

    def take(self, rows: NDArray[Any]) -> SplatField:
        """The splats of these rows, or where a mask is True, in the same box."""
        return SplatField(
            _read_only(self.means[rows]),
            _read_only(self.log_scales[rows]),
            _read_only(self.quaternions[rows]),
            _read_only(self.opacities[rows]),
            _read_only(self.sh[rows]),
            self.antialiased,
            self.bounds,
            self.unbounded,
            self.discs,
            self.offset,
        )

    def save(self, path: str | Path) -> None:
        """Writes the field to a safetensors file (float32); the folder must exist."""
        tensors = {name: getattr(self, name) for name in (*_TENSORS, "bounds")}
        header = {
            "kind": "SplatField",
            "version": FORMAT_VERSION,
            "antialiased": str(int(self.antialiased)),
            "unbounded": str(int(self.unbounded)),
            "discs": str(int(self.discs)),
        }
        if any(self.offset):
            header["offset"] = json.dumps(self.offset)
        write_tensors(path, tensors, header)

    @classmethod
    def load(cls, path: str | Path) -> SplatField:
        """The field in a safetensors file.

        Raises:
            FieldError: the file is missing, truncated, of another kind or newer than this version.
        """
        cure = "train one with `cagefield train DATA -o SCENE --field splat`"
        metadata, tensors = read_tensors(path, "SplatField", FORMAT_VERSION, cure)
        missing = {*_TENSORS, "bounds"} - tensors.keys()
        if missing:
            raise FieldError(f"{path}: tensors missing: {', '.join(sorted(missing))}")
        try:
            return cls(
                **{name: _read_only(tensors[name]) for name in _TENSORS},
                antialiased=metadata.get("antialiased") == "1",
                bounds=tensors["bounds"],
                unbounded=metadata.get("unbounded") == "1",
                discs=metadata.get("discs") == "1",
                offset=json_text.loads(metadata.get("offset", "[0, 0, 0]")),
            )
        except (FieldError, TypeError) as error:
            raise FieldError(f"{path}: {error}") from error
        except ValueError:
            raise FieldError(f"{path}: its offset is {metadata['offset']!r:.60}; write it again") from None


_TENSORS = ("means", "log_scales", "quaternions", "opacities", "sh")
_SH_SHAPES = tuple(((degree + 1) ** 2, 3) for degree in range(MAX_DEGREE + 1))


def _box_of(means: Float32) -> NDArray[np.float64]:
    """The box of the middle 98 % of the means, never flat; the unit cube where there are none."""
    if not len(means):
        return np.array([[-1.0] * 3, [1.0] * 3])
    # One axis at a time: large fields are not copied as a whole.
    low, high = np.stack([np.quantile(axis.astype(np.float64), (0.01, 0.99)) for axis in means.T], axis=1)
    least = max(1e-3 * float((high - low).max()), 1e-6)
    flat = high - low < least
    return np.stack([np.where(flat, low - least, low), np.where(flat, high + least, high)])


def _blocks(count: int) -> Iterator[slice]:
    """Rows of `count`, so many at a time that what is worked out from them takes little memory."""
    for start in range(0, count, BLOCK):
        yield slice(start, min(start + BLOCK, count))


def _frozen(values: ArrayLike, dtype: Any) -> NDArray[Any]:
    """The values, read-only; copied unless they are that already."""
    if (
        isinstance(values, np.ndarray)
        and values.dtype == dtype
        and values.flags.c_contiguous
        and not values.flags.writeable
    ):
        return values
    return _read_only(np.array(values, dtype=dtype, order="C"))


def _read_only(values: NDArray[Any]) -> NDArray[Any]:
    values.setflags(write=False)
    return values
