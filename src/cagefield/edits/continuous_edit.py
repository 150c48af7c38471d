"""Map, lattice and checks of a continuous edit."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import KW_ONLY, dataclass, replace
from functools import cached_property
from typing import TypeVar

import numpy as np

from cagefield.compute.weak_memo import memoized_weakly
from cagefield.edits.abstract_edit import AbstractEdit, boxes_of_cages
from cagefield.edits.grade_falloff import GradeFalloff
from cagefield.edits.lattice_distance import lattice_distance
from cagefield.edits.mirror import Mirror
from cagefield.edits.operations import Operation
from cagefield.edits.options import problem_of_lattice
from cagefield.edits.safe_fraction import Search
from cagefield.edits.shell_safety import ShellSafety
from cagefield.edits.shells import SMOOTH_FLOW, ShellKind, ShellSettings
from cagefield.errors import DeviceError
from cagefield.geometry.cage import Cage
from cagefield.geometry.control_points import ControlPoints
from cagefield.geometry.mesh_cage import MeshCage
from cagefield.geometry.reach_cage import ReachCage
from cagefield.typing import Array, Float32, Mask
from cagefield.warps import (
    FlowShell,
    FreeFormFlow,
    LatticeShell,
    MeshShell,
    Shell,
    inner_map_between,
    reach_between,
)
from cagefield.warps.continuous import ContinuousWarp
from cagefield.warps.lattice import Lattice

AnyContinuous = TypeVar("AnyContinuous", bound="ContinuousEdit")

FREE_FORM_LATTICE = 64
"""Nodes per axis with which kernels show an inner cage that is no hexahedron, where nothing else is said."""


@dataclass(frozen=True)
class ContinuousEdit(AbstractEdit):
    """Fields and methods of a `Continuous`."""

    outer: Cage
    _: KW_ONLY
    shell: ShellKind = SMOOTH_FLOW
    lattice: int | None = None
    allow_folding: bool = False

    def __post_init__(self) -> None:
        if not isinstance(self.shell, ShellKind):
            self._refuse(f"shell must be Flow(...) or Trilinear(), got {self.shell!r:.60}")
        self._refuse(self.shell.problem_of_inner(self.inner))
        self._refuse(problem_of_lattice(self.lattice))
        if self.is_graded and isinstance(self.inner, ControlPoints):
            self._refuse(
                "control points have no inside to grade; use a box, a lattice or a mesh as inner cage"
            )
        if any(isinstance(operation, Mirror) for operation in self.operations):
            self._refuse("a mirrored part is cut out of its surroundings; make the edit a move or a copy")
        super().__post_init__()
        if self.outer is None or isinstance(self.outer, ReachCage):
            object.__setattr__(self, "outer", self._reach)
        if not isinstance(self.outer, Cage):
            self._refuse(
                "a continuous edit needs an outer cage; give one (inner.grown(margin), say) or make the"
                " edit discrete"
            )
        if isinstance(self.outer, MeshCage) and not isinstance(self.inner, MeshCage):
            self._refuse(
                "a mesh as outer cage holds a mesh alone; give MeshCage.of_box(inner), or a box as outer cage"
            )
        if self.is_graded and isinstance(self.outer, MeshCage):
            self._refuse("a grade fades to the faces of a box; give a box as outer cage")

    @property
    def _reach(self) -> ReachCage | None:
        """The outer cage where none is given."""
        reach = reach_between(self.inner, self.deformed)
        return None if reach is None else ReachCage.around(reach)

    @property
    def shell_settings(self) -> ShellSettings:
        return ShellSettings(self.outer, self.shell, self.lattice, self.allow_folding)

    def with_shell_settings(self: AnyContinuous, settings: ShellSettings) -> AnyContinuous:
        return self.replace(
            outer=settings.outer,
            shell=settings.shell,
            lattice=settings.lattice,
            allow_folding=settings.allow_folding,
        )

    @cached_property
    def changes_geometry(self) -> bool:
        return self._is_moved

    @cached_property
    def grade_falloff(self) -> GradeFalloff:
        """Weight of the grade between the canonical inner and the outer cage."""
        return GradeFalloff.between(self.inner, self.outer)

    def grade_weights(self, points: Array, inside: Mask) -> Array:
        return self.grade_falloff.weights(points)

    @property
    def boxes(self) -> Array:
        return boxes_of_cages([self.outer] if self.changes_anything else [])

    @cached_property
    def exact_warp(self) -> ContinuousWarp:
        self.check()
        if isinstance(self.inner, ControlPoints) and self.inner.is_unprepared:
            raise self.error(
                "connected control points follow the density of a field, and no field is given; render the"
                " edit as part of a Scene (Scene.prepared_edits), or leave connected out"
            )
        inner = inner_map_between(self.inner, self.deformed)
        return ContinuousWarp(inner, self.outer, self._last_shell)

    @cached_property
    def warp(self) -> ContinuousWarp:
        """The map of this edit, through its lattice if it has one. Raises `EditError` as `check` does.

        The lattice of a flow shell is the kernel's, in float32, where a device starts: in float64 it takes
        minutes.
        """
        exact = self.exact_warp
        if self.lattice is None:
            return exact
        if isinstance(exact.shell, FlowShell | FreeFormFlow | LatticeShell | MeshShell):
            with suppress(DeviceError):
                return replace(exact, lattice=self._kernel_lattice)
        lattice = Lattice.sample(lambda p: exact.to_canonical(p).points, exact.outer, self.lattice)
        return replace(exact, lattice=lattice)

    @property
    def kernel_lattice(self) -> int | None:
        """Nodes per axis from which kernels interpolate the map; None where they evaluate it exactly.

        Kernels have no exact map of an inner cage that is no hexahedron: it has
        `FREE_FORM_LATTICE` of them without a `lattice`.
        """
        if self.lattice is None and not self.inner.is_hexahedron:
            return FREE_FORM_LATTICE
        return self.lattice

    @property
    def lattice_nodes(self) -> Float32:
        """The nodes [R^3,3] of the lattice, displacements in world units, x fastest, sampled by the kernel.

        Kept while this edit, or an equal one, lives. Raises `DeviceError` where no device starts, `EditError`
        without a lattice, without enough free memory, and as `check` does.
        """
        return _lattice_nodes(self.ungraded)

    @property
    def _kernel_lattice(self) -> Lattice:
        """The lattice as the renderer has it, for the float64 reference. Raises as `lattice_nodes` does."""
        origin, frame = self.outer.frame
        grid = self.lattice_nodes.reshape(*3 * (self.kernel_lattice or 0,), 3)
        return Lattice(origin, frame, grid.astype(np.float64))

    @property
    def _safety(self) -> ShellSafety:
        return ShellSafety(self.inner, self.outer, self.shell, self._shell, self.allow_folding)

    def check(self) -> None:
        """Raise `EditError` where the edit cannot be evaluated, naming the fault and the share still safe.

        The inner cage must lie in the outer cage, before and after the operations, and the shell must not
        fold (unless `allow_folding`).
        """
        if not self._safety.is_safe(self.inner):
            message, cure = self._safety.fault(self.inner)
            raise self.error(message + cure)
        if not self._safety.is_safe(self.deformed):
            message, cure = self._safety.fault(self.deformed)
            raise self.error(message + self._safety.safe_part(self.operations) + cure)

    @cached_property
    def is_possible(self) -> bool:
        return self._safety.is_safe_at_rest and self._safety.is_safe(self.deformed)

    def without_lattice(self: AnyContinuous) -> AnyContinuous:
        return self.replace(lattice=None)

    def lattice_error(
        self,
        resolution: int | None = None,
        *,
        samples: int = 5_000,
        proceed: Callable[[], None] | None = None,
    ) -> tuple[float, float]:
        """(max, mean) error of the lattice in world units, measured in the shell; zeros without a lattice.

        Measured at those of `samples` random points of the outer cage's frame that lie in the shell. The
        interpolation's error falls with R^-2 where the map is smooth and with R^-1 at the cages' faces.
        `proceed` is called now and then, and gives the measurement up by raising.
        """
        warp, nodes = self.exact_warp, resolution if resolution is not None else self.kernel_lattice
        if nodes is None:
            return 0.0, 0.0
        # The kernel's, which takes no time: float32's rounding is far below the lattice's error.
        lattice = self.replace(lattice=nodes)._kernel_lattice
        return lattice_distance(warp, lattice, samples, proceed)

    def largest_share(self, operation: Operation, cage: Cage, search: Search) -> float:
        return self._safety.largest_share(operation, cage, search)

    def _shell(self, deformed: Cage) -> Shell:
        if deformed is self.deformed:
            return self._last_shell
        return self.shell.build(self.inner, deformed, self.outer)

    @cached_property
    def _last_shell(self) -> Shell:
        """The shell with all operations done."""
        return self.shell.build(self.inner, self.deformed, self.outer)


@memoized_weakly
def _lattice_nodes(edit: ContinuousEdit) -> Float32:
    from cagefield.edits.device.edit_lattice import sample_nodes

    if edit.kernel_lattice is None:
        raise edit.error("only a continuous edit with a lattice has nodes")
    return sample_nodes(edit.exact_warp, edit.kernel_lattice)
