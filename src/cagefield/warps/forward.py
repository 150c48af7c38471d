"""A warp's map to deformed space at many points, soon: for splats, which are taken there and not sampled.

Everything but flows is the float64 reference, which is vectorized. A flow goes forwards
through its steps by a kernel, where the reference inverts the way back: they differ by the error of the
integration, which falls with the fourth power of the step, and by the rounding of float32, half of the time
of float64. On boxes of half-size .3 in .8, turned by 140 degrees and scaled by 1.2, that is 4e-7 of the scene
at most, and 1e-5 in the Jacobian.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from cagefield.geometry import hexahedron
from cagefield.geometry.cage import Cage
from cagefield.typing import Array
from cagefield.warps.continuous import ContinuousWarp
from cagefield.warps.flow_shell import FlowShell
from cagefield.warps.flow_table import table_along
from cagefield.warps.free_form import FreeFormFlow
from cagefield.warps.interfaces import Mapped, Shell, Warp

COARSE_STRAIN = 1.0
"""Strain of a step (see `FlowShell`) while something moves: as for lattices of 32^3 nodes.

On the boxes above it costs 2e-7 of the scene for a translation, 2e-3 for the turn by 140 degrees.
"""

POINTS_PER_STEP, COARSE_POINTS_PER_STEP = 65_536, 262_144
"""Points mapped between two calls of `proceed`, exactly and coarsely."""


def to_deformed(
    warp: Warp, points: Array, *, coarse: bool = False, proceed: Callable[[], None] | None = None
) -> Mapped:
    """Canonical points [N,3] in deformed space, as `warp.to_deformed`.

    `coarse` takes a flow shell with long steps. `proceed` is called now and then, and gives the map up by
    raising.
    """
    if isinstance(warp, ContinuousWarp) and isinstance(warp.shell, FlowShell):
        shell = warp.shell.with_strain(COARSE_STRAIN) if coarse else warp.shell
        warp = replace(warp, shell=_ForwardFlow(shell, coarse))
    elif isinstance(warp, ContinuousWarp) and isinstance(warp.shell, FreeFormFlow):
        flow = warp.shell.with_strain(COARSE_STRAIN) if coarse else warp.shell
        warp = replace(warp, shell=_FreeFormForward(flow))
    regions = _AffineRegions.of_warp(warp)
    parts = []
    size = COARSE_POINTS_PER_STEP if coarse else POINTS_PER_STEP
    for first in range(0, max(len(points), 1), size):
        if proceed is not None:
            proceed()
        part = points[first : first + size]
        parts.append(warp.to_deformed(part) if regions is None else regions.to_deformed(part))
    if len(parts) == 1:
        return parts[0]
    return Mapped(
        np.concatenate([part.points for part in parts]),
        np.concatenate([part.jacobian for part in parts]),
        np.concatenate([part.lost for part in parts]),
        np.concatenate([part.inside for part in parts]),
    )


@dataclass(frozen=True)
class _AffineRegions:
    """A continuous warp whose cages are parallelepipeds, mapped region by region by a kernel.

    outer, inner: frames [3,4] of the canonical cages, and the map [3,4] of the inner one, as
    `kernels.affine_regions` takes them.
    """

    shell: Shell
    outer: Array
    inner: Array
    map_of_inner: Array

    @classmethod
    def of_warp(cls, warp: Warp) -> _AffineRegions | None:
        """The regions of a warp, None where one of its cages or its inner map is bent."""
        if not isinstance(warp, ContinuousWarp) or warp.hexahedra is None:
            return None
        onto = warp.hexahedra.inverse
        if onto.affine is None or not (warp.outer.is_affine and onto.deformed.is_affine):
            return None
        A, b = onto.affine
        return cls(warp.shell, _frame(warp.outer), _frame(onto.deformed), np.column_stack([A, b]))

    def to_deformed(self, points: Array) -> Mapped:
        """As `ContinuousWarp.to_deformed`."""
        from cagefield.warps.kernels.affine_regions import SHELL, map_regions, put_rows

        count = len(points)
        images, jacobian = np.empty((count, 3)), np.empty((count, 3, 3))
        region = np.empty(count, np.uint8)
        frames = (self.outer, self.inner, self.map_of_inner)
        map_regions(np.ascontiguousarray(points), *frames, images, jacobian, region)
        mapped = Mapped(images, jacobian, *np.zeros((2, count), dtype=bool))
        rest = np.flatnonzero(region == SHELL)
        if len(rest):
            put_rows(rest, *self.shell.to_deformed(points[rest]), images, jacobian)
        return mapped


def _frame(cage: Cage) -> Array:
    """W, c [3,4] with |W p + c| <= 1 in a cage that is a parallelepiped, its faces as `Cage.contains` has
    them."""
    C = hexahedron.coefficients(cage.corners)
    W = hexahedron.center_inverse(C)
    most = 1.0 + hexahedron.face_tolerance(cage.corners, W)
    return np.column_stack([W, -W @ C[0]]) / most


@dataclass(frozen=True)
class _ForwardFlow:
    """A flow shell whose way to deformed space is the kernel's."""

    flow: FlowShell
    coarse: bool

    def to_canonical(self, points: Array) -> tuple[Array, Array]:
        """As the flow shell."""
        return self.flow.to_canonical(points)

    def to_deformed(self, points: Array) -> tuple[Array, Array]:
        """(deformed points [N,3], Jacobians [N,3,3]) of canonical points [N,3] in the shell."""
        from cagefield.warps.kernels.flow_forward import march

        motion = self.flow.motion
        moved, jacobian = np.empty_like(points), np.empty((len(points), 3, 3))
        lost = np.empty(len(points), dtype=bool)
        steps, followed = (2, 5e-2) if self.coarse else (3, 1e-4)
        march(
            np.ascontiguousarray(points),
            table_along(self.flow, self.flow.knots),
            None if motion.confines.is_affine else True,
            None if motion.is_affine else True,
            steps,
            followed,
            moved,
            jacobian,
            lost,
        )
        if lost.any():
            moved[lost], jacobian[lost] = self.flow.to_deformed(points[lost])
        return moved, jacobian

    def least_ratio(self) -> float:
        """As the flow shell."""
        return self.flow.least_ratio()

    def problem(self) -> str | None:
        """As the flow shell."""
        return self.flow.problem()


@dataclass(frozen=True)
class _FreeFormForward:
    """A free-form flow that goes to deformed space by steps forwards."""

    flow: FreeFormFlow

    def to_canonical(self, points: Array) -> tuple[Array, Array]:
        """As the flow."""
        return self.flow.to_canonical(points)

    def to_deformed(self, points: Array) -> tuple[Array, Array]:
        """(deformed points [N,3], Jacobians [N,3,3]) of canonical points [N,3]."""
        return self.flow.march_to_deformed(points)

    def least_ratio(self) -> float:
        """As the flow."""
        return self.flow.least_ratio()

    def problem(self) -> str | None:
        """As the flow."""
        return self.flow.problem()
