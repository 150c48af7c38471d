"""Mixture of anisotropic 3D Gaussians with spherical-harmonic color.

Notation: splat n has the mean m, the scales s = exp(log_scales) (standard deviations along its axes), the
rotation R of its unit quaternion (w, x, y, z), hence the covariance C = R diag(s^2) R^T, the opacity o in
[0, 1] and harmonics k. Its color along d is max(0, 0.5 + sum_l Y_l(d) k_l). An image of splats blends
each with alpha = o exp(-e^T Q e / 2) at a pixel's offset e from its projected mean, Q the inverse of its
projected covariance, sorted by depth (`cagefield.rendering.splats.reference_rasterizer`).
`cagefield.fields.splat_mixture` derives a density and a color at points, for renderers that sample.

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

BLOCK_SPLATS = 1 << 16
"""Number of splats checked at a time."""


@dataclass(frozen=True, eq=False)
class SplatField:
    """3D Gaussian splats (canonical space, world units).

    Writable arrays are copied; read-only ones are shared and must stay unchanged.

    Attributes:
        means: [N,3] float32.
        log_scales: [N,3] float32, natural logarithms of the standard deviations along the splats' axes.
        quaternions: [N,4] float32, (w, x, y, z); normalized on construction.
        opacities: [N] float32, in [0, 1].
        sh: [N, (degree+1)^2, 3] float32 color coefficients, degree 0 to `sh.MAX_DEGREE`.
        antialiased: opacities are scaled so that the pixel filter of .3 pixels^2 does not increase a splat's
            contribution to an image (Mip-Splatting's 2D filter).
        discs: splats are the discs of 2DGS, normal to their third axes, rendered by ray-disc intersection
            (`cagefield.rendering.splats.reference_discs`).
        bounds: [2,3] float64 box of interest; None takes the box of the central 98 % of the means.
        unbounded: True where splats beyond `bounds` are the background.
        offset: coordinates of the source file less those of the field, for coordinates beyond the precision
            of float32. Exports add the offset.

    Raises:
        FieldError: mismatching shapes, NaN or infinity, opacities outside [0, 1].
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
        bounds = _central_box(self.means) if self.bounds is None else np.asarray(self.bounds, np.float64)
        if bounds.shape != (2, 3) or not np.isfinite(bounds).all() or not (bounds[0] < bounds[1]).all():
            raise FieldError(f"bounds must be 2 finite corners [2,3], lower < upper, got {bounds.tolist()}")
        fix(self, "bounds", _frozen(bounds, np.float64))
        offset = tuple(float(value) for value in self.offset)
        if len(offset) != 3 or not np.isfinite(offset).all():
            raise FieldError(f"offset must be 3 finite numbers, got {list(offset)}")
        fix(self, "offset", offset)

    def __len__(self) -> int:
        return len(self.means)

    @classmethod
    def from_gsplat(
        cls, means: ArrayLike, quats: ArrayLike, scales: ArrayLike, opacities: ArrayLike, sh: ArrayLike
    ) -> SplatField:
        """SplatField from the arguments of `gsplat.rasterization`, after their activations.

        means [N,3]; quats [N,4] (w, x, y, z); scales [N,3], standard deviations > 0; opacities [N] in [0, 1];
        sh [N, (degree+1)^2, 3], the `colors` of a call with `sh_degree`. Tensors on the CPU are arrays here.

        Raises FieldError for scales that are not positive, and as the class.
        """
        widths = np.asarray(scales, dtype=np.float32)
        if not (widths > 0.0).all():
            raise FieldError(
                f"scales must be positive standard deviations, got {widths.min():g}; apply exp to gsplat's "
                "trained parameters"
            )
        as_float32 = (np.asarray(value, dtype=np.float32) for value in (means, quats, opacities, sh))
        positions, quaternions, opacity, harmonics = as_float32
        return cls(positions, np.log(widths), quaternions, opacity, harmonics)

    @property
    def scales(self) -> Float32:
        """Standard deviations [N,3] float32 along the splats' axes, world units."""
        return np.exp(self.log_scales)

    @property
    def sh_degree(self) -> int:
        """Degree of the color's spherical harmonics, 0 to `sh.MAX_DEGREE`."""
        return _SH_SHAPES.index(self.sh.shape[1:])

    @property
    def center(self) -> NDArray[np.float64]:
        """Center [3] of `bounds`."""
        return np.asarray(self.bounds.mean(axis=0))

    @property
    def half_size(self) -> NDArray[np.float64]:
        """Half of the edge lengths [3] of `bounds`."""
        return np.asarray((self.bounds[1] - self.bounds[0]) / 2)

    @property
    def sample_spacing(self) -> float:
        """World length between samples that resolve all detail: the typical splat width.

        The opacity-weighted median, over the splats in `bounds`, of the middle of the three scales: the
        smallest scale is the thickness of surfaces, which images do not resolve. Without splats, a thousandth
        of the largest edge of `bounds`.
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

        The integral of sigma along any ray gives the opacity of the splats' image; colors are the
        density-weighted means of the splats at a point (`cagefield.fields.splat_mixture`).
        """
        sigma, rgb = self.mixture.evaluate(np.asarray(positions), np.asarray(viewdirs)[:, None])
        return sigma[:, 0], np.clip(rgb[:, 0], 0.0, 1.0)

    def evaluate_directions(self, positions: ArrayLike, viewdirs: ArrayLike) -> tuple[Float32, Float32]:
        """(sigma [N], rgb [N,K,3]) at positions [N,3] along unit viewdirs [N,K,3]; sigma is the mean."""
        sigma, rgb = self.mixture.evaluate(np.asarray(positions), np.asarray(viewdirs))
        return sigma.mean(axis=1), np.clip(rgb, 0.0, 1.0)

    def grid_sigma(self, positions: ArrayLike) -> Float32:
        """Density [N] at positions [N,3] for grids: smoother, and independent of the direction."""
        return self.mixture.grid_sigma(np.asarray(positions))

    @cached_property
    def mixture(self) -> SplatMixture:
        """Spatial index of the splats for evaluation at points; built on first use."""
        from cagefield.fields.splat_mixture import SplatMixture

        return SplatMixture.build(self.means, self.log_scales, self.quaternions, self.opacities, self.sh)

    def take(self, rows: NDArray[Any]) -> SplatField:
        """Splats of the given rows or mask, with equal bounds."""
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
        """Write the field to a safetensors file (float32); the folder must exist."""
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
        """SplatField of a safetensors file.

        Raises:
            FieldError: the file is missing, truncated, of another kind or a newer version.
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


def _central_box(means: Float32) -> NDArray[np.float64]:
    """Box [2,3] of the central 98 % of the means, never flat; the cube [-1, 1]^3 without splats."""
    if not len(means):
        return np.array([[-1.0] * 3, [1.0] * 3])
    # One axis at a time, to avoid a copy of a large field.
    low, high = np.stack([np.quantile(axis.astype(np.float64), (0.01, 0.99)) for axis in means.T], axis=1)
    least = max(1e-3 * float((high - low).max()), 1e-6)
    flat = high - low < least
    return np.stack([np.where(flat, low - least, low), np.where(flat, high + least, high)])


def _blocks(count: int) -> Iterator[slice]:
    """Slices of at most BLOCK_SPLATS rows, which bound the memory of intermediate results."""
    for start in range(0, count, BLOCK_SPLATS):
        yield slice(start, min(start + BLOCK_SPLATS, count))


def _frozen(values: ArrayLike, dtype: Any) -> NDArray[Any]:
    """Read-only values; copied unless they are read-only already."""
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
