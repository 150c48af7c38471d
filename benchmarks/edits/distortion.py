"""How much a shell map distorts, whatever the method: folding, stretch, distance from rigid motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from benchmarks.edits.methods import BackwardMap
from cagefield.edits import Continuous, Edit
from cagefield.errors import CagefieldError
from cagefield.geometry.cage import Cage
from cagefield.typing import Array
from cagefield.warps.continuous import ContinuousWarp
from cagefield.warps.trilinear_shell import TrilinearShell

SAMPLES = 20_000


@dataclass(frozen=True)
class Distortion:
    """Measures of J, d(canonical)/d(deformed), over points spread evenly over the deformed shell.

    least_det  least of det J and 1/det J; <= 0 where the map folds
    stretch    largest factor by which a length grows or shrinks: the greatest singular value of J or J^-1;
               infinite where the map folds
    rigidity   mean Frobenius norm of J - R, R the rotation nearest to J: 0 for a rigid motion
    folded     share of the shell that the map turns inside out
    """

    least_det: float
    stretch: float
    rigidity: float
    folded: float

    @property
    def folds(self) -> bool:
        """True where the map folds somewhere."""
        return self.least_det <= 0.0


def distortion(warp: BackwardMap, edit: Edit, *, samples: int = SAMPLES, seed: int = 0) -> Distortion:
    """The distortion of a map of a continuous edit, at `samples` random points of its deformed shell.

    The trilinear shell is measured in both directions, as the map back shows one sheet of a fold only, and
    its least determinant is a bound over all of it.
    """
    outer = _outer(edit)
    J = warp.to_canonical(shell_samples(edit.deformed, outer, samples, seed)).jacobian
    det = np.linalg.det(J)
    folded = float((det <= 0.0).mean())
    bound = np.inf
    if isinstance(warp, ContinuousWarp) and isinstance(warp.shell, TrilinearShell):
        forward = np.linalg.det(warp.to_deformed(shell_samples(edit.inner, outer, samples, seed)).jacobian)
        folded = max(folded, float((forward <= 0.0).mean()))
        bound = warp.shell.least_ratio()
    with np.errstate(divide="ignore"):
        least = float(np.minimum(det, np.where(det > 0.0, 1.0 / det, det)).min())
    U, s, Vt = np.linalg.svd(J)
    Vt[np.linalg.det(U @ Vt) < 0.0, 2] *= -1.0
    rigidity = np.linalg.norm(J - U @ Vt, axis=(1, 2)).mean()
    least = min(least, bound)
    stretch = np.inf if least <= 0.0 else float(np.maximum(s[:, 0], 1.0 / s[:, 2]).max())
    return Distortion(least, stretch, float(rigidity), folded)


def shell_points(edit: Edit, count: int, seed: int = 0) -> Array:
    """Random points [count,3], evenly spread over the deformed shell of a continuous edit.

    Raises:
        CagefieldError: an edit without an outer cage, or cages that leave no shell between them.
    """
    return shell_samples(edit.deformed, _outer(edit), count, seed)


def shell_samples(inner: Cage, outer: Cage, count: int, seed: int = 0) -> Array:
    """Random points [count,3], evenly spread over the outer cage without the inner one.

    Raises:
        CagefieldError: cages that leave no shell between them.
    """
    rng = np.random.default_rng(seed)
    origin, frame = outer.frame
    found: list[Array] = []
    tried = 0
    while sum(map(len, found)) < count:
        points = origin + rng.random((2 * count, 3)) @ frame.T
        points = points[outer.contains(points)]
        found.append(points[~inner.contains(points)])
        tried += 2 * count
        if tried > 1000 * count:
            raise CagefieldError("the inner cage fills its outer cage; leave a gap between them")
    return np.concatenate(found)[:count]


def _outer(edit: Edit) -> Cage:
    if not isinstance(edit, Continuous):
        raise CagefieldError(f'edit "{edit.name}" has no outer cage, so there is no shell to measure')
    return edit.outer
