"""One edit: two cages, the operations that move the inner one, and the kind of adjustment."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from cagefield.edits import operations as ops
from cagefield.edits.edit_names import problem_of_name
from cagefield.edits.operation_sequence import ImpossibleOperationError, cages_along, problem_of_count
from cagefield.edits.operations import Operation
from cagefield.edits.options import FEATHER, Adjustment, Fill, Relight, problem_of_options
from cagefield.edits.paste_paths import problem_of_source
from cagefield.edits.patch import Pasted, Patch, SplatPatch
from cagefield.edits.safe_fraction import as_text, flow_reach, largest_safe
from cagefield.errors import CageError, DeviceError, EditError
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.cage import Axes, Cage, outside_by
from cagefield.geometry.cage_checks import format_vector
from cagefield.typing import Array
from cagefield.warps import SHELLS, Falloff, FlowShell, Shell, Warp
from cagefield.warps.continuous import ContinuousWarp
from cagefield.warps.discrete import DiscreteWarp
from cagefield.warps.hexahedron_map import HexahedronMap
from cagefield.warps.lattice import Lattice

AT_ONCE = 500
"""Points at which a lattice is compared with the exact map at a time: hundredths of a second."""

_SEARCHED = 500
"""Operations among which the one is sought that an impossible edit never recovered from."""


class ImpossibleEditError(EditError):
    """An edit whose operation `number`, counted from 1, makes no cage."""

    def __init__(self, message: str, number: int) -> None:
        super().__init__(message)
        self.number = number


@dataclass(frozen=True)
class Edit:
    """An inner cage that moves, and what becomes of the rest. Operations return a new edit.

    Parameters
    - inner: the canonical inner cage V^c: where the content is in the trained field.
    - outer: the outer cage V^o, which confines a continuous edit; ignored by a discrete one.
    - adjustment: "continuous" (the shell between the cages is interpolated and the field stays connected) or
      "discrete" (only the inner region changes: moved, with `keep_source` copied, with `deleted` removed).
    - shell: the continuous map between the cages, a name in `warps.SHELLS`: "flow" cannot fold, "trilinear"
      is the paper's.
    - operations: what moved the inner cage, in order; `deformed` is the result.
    - lattice: None evaluates the shell exactly at every sample; an integer R interpolates it from R^3 nodes
      (64, 128 or 256 in the paper). The inner region is exact either way.
    - enabled: False hides the edit in a stack.
    - falloff: how the motion fades through a flow shell, "smooth" or "linear".
    - width: how much of the flow shell moves, in (0, 1]: from "only near the inner cage" to the whole shell.
    - allow_folding: True evaluates a folded shell instead of raising; where it overlaps itself, one of the
      sheets is shown.
    - fill: what a move or a delete uncovers: "surroundings" goes on with the surface that it stood on, "none"
      leaves it as it was trained, a `Clone` copies a cage. Under a continuous edit that takes its light along
      "surroundings" does so where that grows a lot.
    - relight: "occlusion" takes contact shadows along, "shadow" those of a dominant light too, where one is
      found, a `CastShadow` those of a light that is set by hand; "none" leaves all.
    - feather: of a discrete edit of voxels, how many voxels along the faces of V blend into what is there.
    - source: None, or the scene folder or file of splats that a copy is taken from: a *paste*. `inner` is
      then a cage in that scene's space, which the operations take to where it stands in this one. Relative
      to the folder of this scene, or absolute. See `Edit.paste`.
    - patch: of a discrete edit, what the field that it was made for shows where something was taken away
      (`cagefield.completion`); no part of edit files, as `pasted`, what a paste shows there.

    Raises `EditError` for impossible combinations and operations; cages that do not fit together and folded
    shells are reported by `check`, which every evaluation calls.
    """

    inner: Cage
    outer: Cage | None = None
    adjustment: Adjustment = "continuous"
    shell: str = "flow"
    keep_source: bool = False
    name: str = ""
    operations: tuple[Operation, ...] = ()
    lattice: int | None = None
    enabled: bool = True
    allow_folding: bool = False
    deleted: bool = False
    falloff: str = "smooth"
    width: float = 1.0
    fill: Fill = "surroundings"
    relight: Relight = "occlusion"
    feather: float = FEATHER
    source: str | None = None
    patch: Patch | SplatPatch | None = None
    pasted: Pasted | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "operations", tuple(self.operations))
        problem = problem_of_name(self.name) or problem_of_count(len(self.operations))
        if problem is not None:
            raise EditError(f"edit: {problem}")
        problem = problem_of_options(
            self.adjustment,
            self.shell,
            has_outer=self.outer is not None,
            has_operations=bool(self.operations),
            keep_source=self.keep_source,
            deleted=self.deleted,
            fading=(self.falloff, self.width),
            lattice=self.lattice,
            surroundings=(self.fill, self.relight, self.feather),
        ) or problem_of_source(
            self.source, is_copy=self.adjustment == "discrete" and self.keep_source and not self.deleted
        )
        if problem is not None:
            raise self._error(problem)
        self.deformed  # noqa: B018  an operation that makes an impossible cage is an error here

    @classmethod
    def delete(cls, cage: Cage, *, name: str = "") -> Edit:
        """The edit that empties a cage."""
        return cls(cage, adjustment="discrete", deleted=True, name=name)

    @classmethod
    def paste(cls, source: str | os.PathLike[str], cage: Cage, *, name: str = "") -> Edit:
        """The edit that copies what a cage holds in another scene: a scene folder, or a file of splats.

        `Scene.paste` makes one of the whole scene, of a size and at a place that suit.
        """
        return cls(cage, adjustment="discrete", keep_source=True, source=os.fspath(source), name=name)

    @cached_property
    def deformed(self) -> Cage:
        """The inner cage after all operations."""
        cage = self.inner
        try:
            for cage in cages_along(self.inner, self.operations):  # noqa: B007
                pass
        except ImpossibleOperationError as error:
            raise ImpossibleEditError(str(self._error(str(error))), error.number) from None
        return cage

    def translate(self, by: ArrayLike) -> Edit:
        """The edit with its inner cage moved by a vector [3]."""
        return self.then(ops.Translate(ops.displacement(by, "translate")))

    def rotate(self, theta: ArrayLike, *, axes: Axes = "world") -> Edit:
        """The edit with its inner cage turned about its pivot, intrinsic XYZ angles [3] in radians."""
        return self.then(ops.Rotate.from_rotation(theta, axes))

    def scale(self, by: ArrayLike, *, axes: Axes = "world") -> Edit:
        """The edit with its inner cage scaled about its pivot by one factor or three."""
        return self.then(ops.Scale.of(by, axes))

    def shear(self, *, axes: Axes = "world", **factors: float) -> Edit:
        """The edit with its inner cage sheared about its pivot; factors xy, xz, yx, yz, zx, zy."""
        return self.then(ops.Shear(**factors, axes=axes))

    def move_corner(self, corner: int, by: ArrayLike) -> Edit:
        """The edit with one corner of its inner cage moved by a vector [3]."""
        return self.then(ops.MoveCorner(corner, ops.displacement(by, "move_corner")))

    def move_edge(self, edge: tuple[int, int], by: ArrayLike) -> Edit:
        """The edit with an edge (i, j) of its inner cage moved by a vector [3]."""
        return self.then(ops.MoveEdge((edge[0], edge[1]), ops.displacement(by, "move_edge")))

    def move_face(self, face: str, by: ArrayLike) -> Edit:
        """The edit with a face of its inner cage, such as "+x", moved by a vector [3]."""
        return self.then(ops.MoveFace(face, ops.displacement(by, "move_face")))

    def then(self, operation: Operation) -> Edit:
        """The edit with one more operation."""
        return self.replace(operations=(*self.operations, operation))

    def replace(self, **changes: Any) -> Edit:
        """The edit with some fields changed."""
        return replace(self, **changes)

    @cached_property
    def changes_anything(self) -> bool:
        """False when the inner cage is where it was (and not deleted or pasted): the map is the identity."""
        if self.deleted or self.source is not None:
            return True
        return not np.array_equal(self.inner.corners, self.deformed.corners)

    @property
    def under(self) -> VoxelField | None:
        """What its region shows instead of nothing, if that is a layer."""
        return self.patch.under if isinstance(self.patch, Patch) else None

    @property
    def part(self) -> VoxelField | None:
        """What V shows instead of the field, if that is a layer."""
        if self.pasted is not None:
            return self.pasted.part
        return self.patch.part if isinstance(self.patch, Patch) else None

    @property
    def layers(self) -> tuple[VoxelField, ...]:
        """`under` and `part`, those of them that there are."""
        return tuple(layer for layer in (self.under, self.part) if layer is not None)

    @property
    def boxes(self) -> Array:
        """Deformed-space boxes [B,2,3] (min, max), B 0 to 2, outside which the edit changes nothing."""
        cages: list[Cage] = []
        if self.changes_anything:
            if self.adjustment == "continuous" and self.outer is not None:
                cages = [self.outer]
            else:
                cages = [] if self.deleted else [self.deformed]
                if self.patch is not None:
                    cages.append(self.patch.region)
                elif not self.keep_source:
                    cages.append(self.inner)
        return np.array([cage.aabb for cage in cages]).reshape(-1, 2, 3)

    @property
    def bounds(self) -> Array:
        """The box [2,3] that holds `boxes`; (inf, -inf) for an edit that changes nothing."""
        return bounds_of(self.boxes)

    @cached_property
    def exact_warp(self) -> Warp:
        """The map of this edit without its lattice. Raises `EditError` as `check` does."""
        self.check()
        place = None if self.pasted is None else self.pasted.place
        inner = HexahedronMap(place or self.inner, self.deformed)
        if self.adjustment == "discrete" or self.outer is None:
            region = None if self.patch is None else self.patch.read_instead
            foreign = self.source is not None
            return DiscreteWarp(
                self.inner, None if self.deleted else inner, self.keep_source, region, foreign
            )
        return ContinuousWarp(inner, self.outer, self._last_shell)

    @cached_property
    def warp(self) -> Warp:
        """The map of this edit, through its lattice if it has one. Raises `EditError` as `check` does.

        The lattice of a flow shell is the kernel's, in float32, where a device starts: in float64 it takes
        minutes.
        """
        exact = self.exact_warp
        if self.lattice is None or not isinstance(exact, ContinuousWarp):
            return exact
        if isinstance(exact.shell, FlowShell):
            from cagefield.edits.device.edit_lattice import lattice_of

            with suppress(DeviceError):
                return replace(exact, lattice=lattice_of(self))
        lattice = Lattice.sample(lambda p: exact.to_canonical(p).points, exact.outer, self.lattice)
        return replace(exact, lattice=lattice)

    def check(self) -> None:
        """Raise `EditError` where the edit cannot be evaluated, naming what is wrong and what is still safe.

        A continuous edit's inner cage must lie in its outer cage, before and after the operations, and its
        shell must not fold (unless `allow_folding`).
        """
        if not self._is_safe(self.inner):
            message, cure = self._problem(self.inner)
            raise self._error(message + cure)
        if not self._is_safe(self.deformed):
            message, cure = self._problem(self.deformed)
            raise self._error(message + self._safe_part() + cure)

    @property
    def is_possible(self) -> bool:
        """True where the edit can be evaluated: where `check` raises nothing. Sooner than its message."""
        return self._is_safe(self.inner) and self._is_safe(self.deformed)

    def safe_fraction(self, operation: Operation | None = None) -> float:
        """Largest t in [0,1], to 1e-3, at which the share t of an operation can follow this edit.

        1.0 where the whole operation is safe; otherwise everything from 0 to t is. The last operation is
        meant where none is given. A discrete edit is limited only by its cage turning inside out.
        """
        if operation is not None:
            return self._largest_part(operation, self.deformed)
        if not self.operations:
            return 1.0
        *_, before, _ = (self.inner, *cages_along(self.inner, self.operations))
        return self._largest_part(self.operations[-1], before)

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
        warp, nodes = self.exact_warp, resolution if resolution is not None else self.lattice
        if nodes is None or not isinstance(warp, ContinuousWarp):
            return 0.0, 0.0
        # The kernel's, which takes no time: float32's rounding is far below the lattice's error.
        from cagefield.edits.device.edit_lattice import lattice_of

        lattice = lattice_of(self.replace(lattice=nodes))
        points, distances = warp.shell_points(samples), [np.zeros(0)]
        for first in range(0, len(points), AT_ONCE):
            if proceed is not None:
                proceed()
            part = points[first : first + AT_ONCE]
            difference = lattice.to_canonical(part)[0] - warp.to_canonical(part).points
            distances.append(np.linalg.norm(difference, axis=1))
        distance = np.concatenate(distances)
        return float(distance.max(initial=0.0)), float(distance.mean()) if len(distance) else 0.0

    def _largest_part(self, operation: Operation, cage: Cage) -> float:
        """Largest share of an operation on the inner cage, when that is at `cage`, that is safe."""

        def safe(t: float) -> bool:
            try:
                return self._is_safe(operation.part(t).apply(cage))
            except CageError:
                return False

        if self.adjustment == "continuous" and self.shell == "flow" and self.outer is not None:
            if safe(1.0):
                return 1.0
            for fine in (False, True):
                reach = flow_reach(operation, cage, (self.inner, self.outer), fine=fine)
                if reach < 1.0 and safe(reach):
                    return reach
        return largest_safe(safe)

    def _safe_part(self) -> str:
        """What is still safe of the operation after which the edit never recovered, as a clause."""
        cages = [self.inner, *cages_along(self.inner, self.operations)]
        # Of very many operations only the last are searched, which take a second.
        for number in range(len(self.operations), max(0, len(self.operations) - _SEARCHED), -1):
            if self._is_safe(cages[number - 1]):
                operation = self.operations[number - 1]
                share = as_text(self._largest_part(operation, cages[number - 1]))
                return f"; {share} of this {operation.noun} (operation {number}, {operation}) is safe"
        return ""

    def _is_safe(self, deformed: Cage) -> bool:
        """True where the edit can be evaluated with its inner cage at `deformed`."""
        if self.adjustment == "discrete" or self.outer is None:
            return True
        if self.shell == "flow":  # which finds corners outside by itself
            return self._shell(deformed).problem() is None
        if not self.outer.contains(deformed.corners).all():
            return False
        return self.allow_folding or self._shell(deformed).problem() is None

    def _problem(self, deformed: Cage) -> tuple[str, str]:
        """(what is wrong, the cure) with the inner cage at a `deformed` that is not safe."""
        if self.outer is not None:
            outside = np.flatnonzero(~self.outer.contains(deformed.corners))
            if len(outside):
                face, distance, k = max(
                    ((*outside_by(self.outer, deformed.corners[k]), int(k)) for k in outside),
                    key=lambda item: item[1],
                )
                return (
                    f"outer cage must contain the inner cage: inner corner {k} at"
                    f" {format_vector(deformed.corners[k])} is {distance:.3g} outside face {face}",
                    '; enlarge the outer cage or use adjustment="discrete"',
                )
        cure = '; reduce it, enlarge the outer cage, or use adjustment="discrete"'
        return (
            f"the {self.shell} shell {self._shell(deformed).problem()}",
            "" if deformed is self.inner else cure,
        )

    def _shell(self, deformed: Cage) -> Shell:
        if self.outer is None:
            raise self._error("a shell needs an outer cage")
        if deformed is self.deformed:
            return self._last_shell
        return SHELLS[self.shell](self.inner, deformed, self.outer, Falloff(self.falloff, self.width))

    @cached_property
    def _last_shell(self) -> Shell:
        """The shell with all operations done."""
        if self.outer is None:
            raise self._error("a shell needs an outer cage")
        falloff = Falloff(self.falloff, self.width)
        return SHELLS[self.shell](self.inner, self.deformed, self.outer, falloff)

    def unread(self) -> EditError:
        """The error of a paste without what it pastes."""
        return self.cannot_paste("nobody has read it; render the edit as part of a Scene")

    def cannot_paste(self, why: str) -> EditError:
        """The error of a paste that cannot be shown."""
        return self._error(f"pastes from {self.source}: {why}")

    def _error(self, message: str) -> EditError:
        return EditError(f'edit "{self.name}": {message}' if self.name else f"edit: {message}")


def bounds_of(boxes: Array) -> Array:
    """The box [2,3] that holds boxes [B,2,3]; (inf, -inf) for none."""
    return np.stack([boxes[:, 0].min(axis=0, initial=np.inf), boxes[:, 1].max(axis=0, initial=-np.inf)])
