"""Edit: an inner cage, the operations that move it, and the kind of edit, one class for each kind."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import KW_ONLY, dataclass, replace
from functools import cached_property
from typing import Any, TypedDict, TypeVar

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from cagefield.compute.weak_memo import memoized_weakly
from cagefield.edits import operations as ops
from cagefield.edits.edit_names import problem_of_name, problem_of_parent, problem_of_source
from cagefield.edits.operation_sequence import ImpossibleOperationError, cages_along, problem_of_count
from cagefield.edits.operations import Operation
from cagefield.edits.options import (
    DEFAULT_FEATHER_VOXELS,
    Fill,
    Relight,
    problem_of_infill,
    problem_of_lattice,
)
from cagefield.edits.safe_fraction import flow_reach, format_share, is_valid, largest_safe
from cagefield.edits.shells import (
    NO_SHELL,
    SMOOTH_FLOW,
    Flow,
    ShellKind,
    ShellSettings,
    problem_of_unused_falloff,
)
from cagefield.errors import CageError, DeviceError, EditError
from cagefield.geometry.cage import Axes, Cage
from cagefield.geometry.cage_checks import format_vector
from cagefield.geometry.control_points import ControlPoints
from cagefield.geometry.face_distance import outside_by
from cagefield.geometry.mesh_cage import MeshCage
from cagefield.geometry.reach_cage import ReachCage
from cagefield.typing import Array, Float32
from cagefield.warps import (
    FlowShell,
    FreeFormFlow,
    LatticeShell,
    MeshShell,
    Shell,
    Warp,
    inner_map_between,
    reach_between,
)
from cagefield.warps.continuous import ContinuousWarp
from cagefield.warps.discrete import DiscreteWarp
from cagefield.warps.hexahedron_map import HexahedronMap
from cagefield.warps.lattice import Lattice

FREE_FORM_LATTICE = 64
"""Nodes per axis with which kernels show an inner cage that is no hexahedron, where nothing else is said."""

CHUNK_POINTS = 500
"""Points at which a lattice is compared with the exact map at a time: hundredths of a second."""

_MAX_SEARCHED_OPERATIONS = 500
"""Maximum number of operations searched for the one from which an impossible edit never recovered."""

AnyEdit = TypeVar("AnyEdit", bound="Edit")


class ImpossibleEditError(EditError):
    """An edit whose operation `number`, counted from 1, makes no cage."""

    def __init__(self, message: str, number: int) -> None:
        super().__init__(message)
        self.number = number


class SharedOptions(TypedDict):
    """Fields that edits of every kind have, but for the operations, which a delete has not."""

    name: str
    enabled: bool
    parent: str
    fill: Fill
    relight: Relight
    feather: float


@dataclass(frozen=True)
class Edit(ABC):
    """Edit of one cage: abstract, a `Continuous`, `Move`, `Copy`, `Delete` or `Paste`. Operations return a
    new edit of the same kind.

    Parameters
    - inner: the canonical inner cage V^c: where the content is in the trained field.
    - operations: operations that move the inner cage, in order; `deformed` is the result.
    - name: name in lists and messages.
    - enabled: False hides the edit in a stack.
    - parent: name of the edit that carries this one, see `chains`; "" for none.
    - fill: infill of the region that a move or a delete uncovers: "surroundings" continues the surface that
      the content stood on, "none" leaves the region as trained, a `Clone` copies a cage. Under a continuous
      edit that relights, "surroundings" fills where the light grows a lot.
    - relight: "occlusion" takes contact shadows along, "shadow" those of a dominant light too, where one is
      found, a `CastShadow` those of a light that is set by hand; "none" leaves all light.
    - feather: of a discrete edit of voxels, width in voxels of the blend along the faces of V.

    Every kind keeps `fill`, `relight` and `feather`, for when the kind of the edit is changed.

    Raises `EditError` for invalid options and impossible operations; cages that do not fit together and
    folded shells are reported by `check`, which every evaluation calls.
    """

    inner: Cage
    _: KW_ONLY
    operations: tuple[Operation, ...] = ()
    name: str = ""
    enabled: bool = True
    parent: str = ""
    fill: Fill = "surroundings"
    relight: Relight = "occlusion"
    feather: float = DEFAULT_FEATHER_VOXELS

    def __post_init__(self) -> None:
        object.__setattr__(self, "operations", tuple(self.operations))
        problem = (
            problem_of_name(self.name)
            or problem_of_parent(self.parent)
            or problem_of_count(len(self.operations))
        )
        if problem is not None:
            raise EditError(f"edit: {problem}")
        self._refuse(problem_of_infill(self.fill, self.relight, self.feather))
        self.deformed  # noqa: B018  an operation that makes an impossible cage is an error here

    # ---- kinds ----

    @staticmethod
    def continuous(
        inner: Cage,
        outer: Cage,
        *,
        shell: ShellKind = SMOOTH_FLOW,
        lattice: int | None = None,
        name: str = "",
        **options: Any,
    ) -> Continuous:
        """Edit whose surroundings give way between an inner and an outer cage; see `Continuous`."""
        return Continuous(inner, outer, shell=shell, lattice=lattice, name=name, **options)

    @staticmethod
    def points(
        points: ArrayLike,
        *,
        radius: float,
        falloff: str = "smooth",
        connected: bool = False,
        outer: Cage | None = None,
        name: str = "",
        **options: Any,
    ) -> Continuous:
        """Edit of control points [n,3], with which everything within the radius follows, less and less.

        `falloff` is one of smooth, sphere, root, sharp, linear; see `ControlPoints`. `connected` measures
        the radius through dense matter, which a `Scene` finds; otherwise it is straight. Without an outer
        cage nothing else confines it. `options` are those of `continuous`.
        """
        cage = ControlPoints(points, radius, falloff, connected=connected)
        return Continuous(cage, outer, name=name, **options)  # type: ignore[arg-type]

    @staticmethod
    def move(cage: Cage, *, name: str = "", **options: Any) -> Move:
        """Edit that takes the content of a cage away and shows it elsewhere; see `Move`."""
        return Move(cage, name=name, **options)

    @staticmethod
    def copy(cage: Cage, *, name: str = "", **options: Any) -> Copy:
        """Edit that shows the content of a cage a second time; see `Copy`."""
        return Copy(cage, name=name, **options)

    @staticmethod
    def delete(cage: Cage, *, name: str = "", **options: Any) -> Delete:
        """Edit that empties a cage; see `Delete`."""
        return Delete(cage, name=name, **options)

    @staticmethod
    def paste(source: str | os.PathLike[str], cage: Cage, *, name: str = "", **options: Any) -> Paste:
        """Edit that copies the content of a cage of another scene: a scene folder, or a file of splats.

        `Scene.paste` makes one of the whole scene, of a size and at a place that suit. See `Paste`.
        """
        return Paste(cage, os.fspath(source), name=name, **options)

    # ---- operations ----

    @cached_property
    def deformed(self) -> Cage:
        """The inner cage after all operations."""
        cage = self.inner
        try:
            for cage in cages_along(self.inner, self.operations):  # noqa: B007
                pass
        except ImpossibleOperationError as error:
            raise ImpossibleEditError(str(self.error(str(error))), error.number) from None
        return cage

    def translate(self: AnyEdit, by: ArrayLike) -> AnyEdit:
        """The edit with its inner cage moved by a vector [3]."""
        return self.then(ops.Translate(ops.displacement(by, "translate")))

    def rotate(self: AnyEdit, rotation: Rotation | ArrayLike, *, axes: Axes = "world") -> AnyEdit:
        """Edit with its inner cage turned about its pivot: SciPy `Rotation`, or XYZ angles [3], radians."""
        return self.then(ops.Rotate.from_rotation(rotation, axes))

    def scale(self: AnyEdit, by: ArrayLike, *, axes: Axes = "world") -> AnyEdit:
        """The edit with its inner cage scaled about its pivot by one factor or three."""
        return self.then(ops.Scale.from_factors(by, axes))

    def shear(self: AnyEdit, *, axes: Axes = "world", **factors: float) -> AnyEdit:
        """The edit with its inner cage sheared about its pivot; factors xy, xz, yx, yz, zx, zy."""
        return self.then(ops.Shear(**factors, axes=axes))

    def move_corner(self: AnyEdit, corner: int, by: ArrayLike) -> AnyEdit:
        """The edit with one corner of its inner cage moved by a vector [3]."""
        return self.then(ops.MoveCorner(corner, ops.displacement(by, "move_corner")))

    def move_edge(self: AnyEdit, edge: tuple[int, int], by: ArrayLike) -> AnyEdit:
        """The edit with an edge (i, j) of its inner cage moved by a vector [3]."""
        return self.then(ops.MoveEdge((edge[0], edge[1]), ops.displacement(by, "move_edge")))

    def move_face(self: AnyEdit, face: str, by: ArrayLike) -> AnyEdit:
        """The edit with a face of its inner cage, such as "+x", moved by a vector [3]."""
        return self.then(ops.MoveFace(face, ops.displacement(by, "move_face")))

    def move_point(self: AnyEdit, point: int, by: ArrayLike) -> AnyEdit:
        """The edit with one control point of its inner cage, numbered x fastest, moved by a vector [3]."""
        return self.then(ops.MovePoint(point, ops.displacement(by, "move_point")))

    def move_points(
        self: AnyEdit,
        points: Iterable[int],
        by: ArrayLike,
        *,
        radius: float = 0.0,
        falloff: str = "smooth",
    ) -> AnyEdit:
        """The edit with control points moved by a vector [3]; see `operations.MovePoints`."""
        by = ops.displacement(by, "move_points")
        return self.then(ops.MovePoints(tuple(points), by, radius, falloff))

    def bend(self: AnyEdit, axis: str, angle: float, *, towards: str = "", fixed: str = "start") -> AnyEdit:
        """The edit with its lattice bent along an axis by an angle in radians; see `operations.Bend`."""
        return self.then(ops.Bend(axis, ops.degrees(angle), towards, fixed))

    def twist(self: AnyEdit, axis: str, angle: float, *, fixed: str = "start") -> AnyEdit:
        """The edit with its lattice twisted about an axis by an angle in radians; see `operations.Twist`."""
        return self.then(ops.Twist(axis, ops.degrees(angle), fixed))

    def taper(self: AnyEdit, axis: str, factor: float, *, fixed: str = "start") -> AnyEdit:
        """The edit with its lattice scaled across an axis to a factor at its end; see `operations.Taper`."""
        return self.then(ops.Taper(axis, float(factor), fixed))

    def then(self: AnyEdit, operation: Operation) -> AnyEdit:
        """The edit with one more operation."""
        return self.replace(operations=(*self.operations, operation))

    def replace(self: AnyEdit, **changes: Any) -> AnyEdit:
        """The edit with some fields changed; its kind stays."""
        return replace(self, **changes)

    def parented_to(self: AnyEdit, parent: Edit | str) -> AnyEdit:
        """The edit carried by another one of its stack, given by itself or by its name; "" for none.

        Cages and operations of the edit stay where the parent's content is at rest; see `chains`. Raises
        `EditError` for a parent without a name.
        """
        name = parent.name if isinstance(parent, Edit) else parent
        if isinstance(parent, Edit) and not name:
            raise self.error("its parent has no name; give it one, name=...")
        return self.replace(parent=name)

    @cached_property
    def without_parent(self: AnyEdit) -> AnyEdit:
        """The edit that nothing carries; itself where nothing does."""
        return self.replace(parent="") if self.parent else self

    @property
    def shared_options(self) -> SharedOptions:
        """Fields that an edit of another kind takes over."""
        return {
            "name": self.name,
            "enabled": self.enabled,
            "parent": self.parent,
            "fill": self.fill,
            "relight": self.relight,
            "feather": self.feather,
        }

    # ---- kind-specific ----

    @property
    @abstractmethod
    def shell_settings(self) -> ShellSettings:
        """Settings of the shell; of a discrete edit those for a change of its kind, without effect."""

    @abstractmethod
    def with_shell_settings(self: AnyEdit, settings: ShellSettings) -> AnyEdit:
        """The edit with other settings of the shell."""

    @property
    @abstractmethod
    def changes_anything(self) -> bool:
        """False where the map is the identity: the inner cage of a move, copy or continuous edit is where it
        was."""

    @property
    @abstractmethod
    def boxes(self) -> Array:
        """Deformed-space boxes [B,2,3] (min, max), B 0 to 2, outside which the edit changes nothing."""

    @property
    @abstractmethod
    def exact_warp(self) -> Warp:
        """The map of this edit without its lattice. Raises `EditError` as `check` does."""

    @property
    @abstractmethod
    def warp(self) -> Warp:
        """The map of this edit, through its lattice if it has one. Raises `EditError` as `check` does."""

    @abstractmethod
    def check(self) -> None:
        """Raise `EditError` where the edit cannot be evaluated, naming the fault and the share still safe."""

    @property
    @abstractmethod
    def is_possible(self) -> bool:
        """True where the edit can be evaluated: where `check` raises nothing. Faster than its message."""

    @abstractmethod
    def without_lattice(self: AnyEdit) -> AnyEdit:
        """The edit evaluated exactly; a discrete edit as it is."""

    @abstractmethod
    def largest_share(self, operation: Operation, cage: Cage) -> float:
        """Largest safe share in [0,1] of an operation on the inner cage when that is at `cage`."""

    # ---- shared ----

    @property
    def bounds(self) -> Array:
        """The box [2,3] that holds `boxes`; (inf, -inf) for an edit that changes nothing."""
        return bounds_of(self.boxes)

    def safe_fraction(self, operation: Operation | None = None) -> float:
        """Largest t in [0,1], to 1e-3, at which the share t of an operation can follow this edit.

        1.0 where the whole operation is safe; otherwise everything from 0 to t is. The default is the last
        operation. A discrete edit is limited only by its cage turning inside out.
        """
        if operation is not None:
            return self.largest_share(operation, self.deformed)
        if not self.operations:
            return 1.0
        *_, before, _ = (self.inner, *cages_along(self.inner, self.operations))
        return self.largest_share(self.operations[-1], before)

    def error(self, message: str) -> EditError:
        """An error that names the edit."""
        return EditError(f'edit "{self.name}": {message}' if self.name else f"edit: {message}")

    def _refuse(self, problem: str | None) -> None:
        if problem is not None:
            raise self.error(problem)

    @cached_property
    def _is_moved(self) -> bool:
        return not self.inner.has_shape_of(self.deformed)


@dataclass(frozen=True)
class Continuous(Edit):
    """Edit whose shell, between the inner and the outer cage, is interpolated: the field stays connected.

    Parameters, besides those of `Edit`
    - outer: the outer cage V^o, which confines the edit. None for control points takes the box around all
      that they reach on their way, a `ReachCage`. A `MeshCage` confines another mesh.
    - shell: kind of the map between the cages, `Flow` (cannot fold) or `Trilinear` (the paper's).
    - lattice: None evaluates the shell exactly at every sample; an integer R interpolates it from R^3 nodes
      (64, 128 or 256 in the paper). The inner region is exact either way.
    - allow_folding: True evaluates a folded shell instead of raising; where it overlaps itself, one of the
      sheets is shown.
    """

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

    @property
    def _reach(self) -> ReachCage | None:
        """The outer cage where none is given."""
        reach = reach_between(self.inner, self.deformed)
        return None if reach is None else ReachCage.around(reach)

    @property
    def shell_settings(self) -> ShellSettings:
        return ShellSettings(self.outer, self.shell, self.lattice, self.allow_folding)

    def with_shell_settings(self, settings: ShellSettings) -> Continuous:
        return self.replace(
            outer=settings.outer,
            shell=settings.shell,
            lattice=settings.lattice,
            allow_folding=settings.allow_folding,
        )

    @property
    def changes_anything(self) -> bool:
        return self._is_moved

    @property
    def boxes(self) -> Array:
        return _aabbs([self.outer] if self.changes_anything else [])

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
        return _lattice_nodes(self)

    @property
    def _kernel_lattice(self) -> Lattice:
        """The lattice as the renderer has it, for the float64 reference. Raises as `lattice_nodes` does."""
        origin, frame = self.outer.frame
        grid = self.lattice_nodes.reshape(*3 * (self.kernel_lattice or 0,), 3)
        return Lattice(origin, frame, grid.astype(np.float64))

    def check(self) -> None:
        """Raise `EditError` where the edit cannot be evaluated, naming the fault and the share still safe.

        The inner cage must lie in the outer cage, before and after the operations, and the shell must not
        fold (unless `allow_folding`).
        """
        if not self._is_safe(self.inner):
            message, cure = self._fault(self.inner)
            raise self.error(message + cure)
        if not self._is_safe(self.deformed):
            message, cure = self._fault(self.deformed)
            raise self.error(message + self._safe_part() + cure)

    @property
    def is_possible(self) -> bool:
        return self._is_safe(self.inner) and self._is_safe(self.deformed)

    def without_lattice(self) -> Continuous:
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
        points, distances = warp.shell_points(samples), [np.zeros(0)]
        for first in range(0, len(points), CHUNK_POINTS):
            if proceed is not None:
                proceed()
            chunk = points[first : first + CHUNK_POINTS]
            difference = lattice.to_canonical(chunk)[0] - warp.to_canonical(chunk).points
            distances.append(np.linalg.norm(difference, axis=1))
        distance = np.concatenate(distances)
        return float(distance.max(initial=0.0)), float(distance.mean()) if len(distance) else 0.0

    def largest_share(self, operation: Operation, cage: Cage) -> float:
        def is_safe(t: float) -> bool:
            try:
                return self._is_safe(operation.part(t).apply(cage))
            except CageError:
                return False

        if isinstance(self.shell, Flow) and self.inner.is_hexahedron:
            if is_safe(1.0):
                return 1.0
            for fine in (False, True):
                reach = flow_reach(operation, cage, (self.inner, self.outer), fine=fine)
                if reach < 1.0 and is_safe(reach):
                    return reach
        return largest_safe(is_safe)

    def _safe_part(self) -> str:
        """Clause with the safe share of the operation after which the edit never recovered."""
        cages = [self.inner, *cages_along(self.inner, self.operations)]
        # Of very many operations only the last are searched, which take a second.
        first = max(0, len(self.operations) - _MAX_SEARCHED_OPERATIONS)
        for number in range(len(self.operations), first, -1):
            if self._is_safe(cages[number - 1]):
                operation = self.operations[number - 1]
                share = format_share(self.largest_share(operation, cages[number - 1]))
                return f"; {share} of this {operation.noun} (operation {number}, {operation}) is safe"
        return ""

    def _is_safe(self, deformed: Cage) -> bool:
        """True where the edit can be evaluated with its inner cage at `deformed`."""
        if isinstance(self.shell, Flow):  # which finds corners outside by itself
            return self._shell(deformed).problem() is None
        if not self.outer.contains(deformed.corners).all():
            return False
        return self.allow_folding or self._shell(deformed).problem() is None

    def _fault(self, deformed: Cage) -> tuple[str, str]:
        """(fault, cure) with the inner cage at a `deformed` that is not safe."""
        handles = deformed.handles
        has_corners = self.inner.is_hexahedron
        outside = np.flatnonzero(~self.outer.contains(handles))
        if len(outside) and isinstance(self.outer, MeshCage):
            k = int(outside[0])
            return (
                f"outer cage must contain the inner cage: {deformed.handle_noun} {k} at"
                f" {format_vector(handles[k])} is outside of its mesh",
                "; enlarge the outer cage",
            )
        if len(outside):
            face, distance, k = max(
                ((*outside_by(self.outer, handles[k]), int(k)) for k in outside),
                key=lambda item: item[1],
            )
            return (
                f"outer cage must contain the inner cage: {deformed.handle_noun} {k} at"
                f" {format_vector(handles[k])} is {distance:.3g} outside face {face}",
                "; enlarge the outer cage"
                + (" or make the edit discrete" if self.inner.is_hexahedron else ""),
            )
        if has_corners:
            cure = "; reduce it, enlarge the outer cage, or make the edit discrete"
        else:
            cure = "; reduce it" if self.outer.follows_edit else "; reduce it, or enlarge the outer cage"
        return (
            f"the {self.shell.name} shell {self._shell(deformed).problem()}",
            "" if deformed is self.inner else cure,
        )

    def _shell(self, deformed: Cage) -> Shell:
        if deformed is self.deformed:
            return self._last_shell
        return self.shell.build(self.inner, deformed, self.outer)

    @cached_property
    def _last_shell(self) -> Shell:
        """The shell with all operations done."""
        return self.shell.build(self.inner, self.deformed, self.outer)


@memoized_weakly
def _lattice_nodes(edit: Continuous) -> Float32:
    from cagefield.edits.device.edit_lattice import sample_nodes

    if edit.kernel_lattice is None:
        raise edit.error("only a continuous edit with a lattice has nodes")
    return sample_nodes(edit.exact_warp, edit.kernel_lattice)


@dataclass(frozen=True)
class Discrete(Edit, ABC):
    """Edit that changes its inner region only: abstract, a `Move`, `Copy`, `Delete` or `Paste`.

    `unused_shell` has no effect, see `ShellSettings`.
    """

    _: KW_ONLY
    unused_shell: ShellSettings = NO_SHELL

    def __post_init__(self) -> None:
        if not self.inner.is_hexahedron:
            self._refuse(
                f"a {type(self).__name__.lower()} needs a cage with 8 corners, not {self.inner.plural_noun};"
                " make the edit continuous, or use a box"
            )
        self._refuse(problem_of_lattice(self.unused_shell.lattice))
        if isinstance(self.unused_shell.shell, Flow):
            self._refuse(problem_of_unused_falloff(self.unused_shell.shell, "discrete edit"))
        super().__post_init__()

    @property
    def shell_settings(self) -> ShellSettings:
        return self.unused_shell

    def with_shell_settings(self: AnyDiscrete, settings: ShellSettings) -> AnyDiscrete:
        return self.replace(unused_shell=settings)

    @property
    def uncovers(self) -> bool:
        """True where the content of V^c is taken away: of a move and a delete."""
        return isinstance(self, Move | Delete)

    @property
    def boxes(self) -> Array:
        if not self.changes_anything:
            return _aabbs([])
        shown = [] if isinstance(self, Delete) else [self.deformed]
        return _aabbs([*shown, self.inner] if self.uncovers else shown)

    @cached_property
    def exact_warp(self) -> DiscreteWarp:
        inner = None if isinstance(self, Delete) else HexahedronMap(self.inner, self.deformed)
        return DiscreteWarp(self.inner, inner, not self.uncovers, pasted=isinstance(self, Paste))

    @property
    def warp(self) -> DiscreteWarp:
        return self.exact_warp

    def check(self) -> None:
        """Nothing: every discrete edit that can be constructed can be evaluated."""

    @property
    def is_possible(self) -> bool:
        return True

    def without_lattice(self: AnyDiscrete) -> AnyDiscrete:
        return self

    def largest_share(self, operation: Operation, cage: Cage) -> float:
        return largest_safe(lambda t: is_valid(operation, t, cage))


AnyDiscrete = TypeVar("AnyDiscrete", bound=Discrete)


@dataclass(frozen=True)
class Move(Discrete):
    """Edit that shows the content of V^c in V; the rest of V^c is emptied, and filled by `fill`."""

    @property
    def changes_anything(self) -> bool:
        return self._is_moved


@dataclass(frozen=True)
class Copy(Discrete):
    """Edit that shows the content of V^c in V too; V^c stays."""

    @property
    def changes_anything(self) -> bool:
        return self._is_moved


@dataclass(frozen=True)
class Delete(Discrete):
    """Edit that empties V^c, which `fill` fills. A delete has no operations."""

    def __post_init__(self) -> None:
        if self.operations:
            self._refuse("a delete has no operations and keeps no source")
        super().__post_init__()

    @property
    def changes_anything(self) -> bool:
        return True


@dataclass(frozen=True)
class Paste(Discrete):
    """Edit that shows the content of a cage of another scene in V.

    - inner: cage in the space of the other scene, which the operations take to its place in this one.
    - source: path of the scene folder or file of splats, relative to the folder of this scene, or absolute.
    """

    source: str

    def __post_init__(self) -> None:
        self._refuse(problem_of_source(self.source))
        super().__post_init__()

    @property
    def changes_anything(self) -> bool:
        return True

    def unread(self) -> EditError:
        """Error of a paste whose source has not been read."""
        return self.cannot_paste("nobody has read it; render the edit as part of a Scene")

    def cannot_paste(self, reason: str) -> EditError:
        """Error of a paste that cannot be shown."""
        return self.error(f"pastes from {self.source}: {reason}")


def bounds_of(boxes: Array) -> Array:
    """The box [2,3] that holds boxes [B,2,3]; (inf, -inf) for none."""
    return np.stack([boxes[:, 0].min(axis=0, initial=np.inf), boxes[:, 1].max(axis=0, initial=-np.inf)])


def _aabbs(cages: list[Cage]) -> Array:
    return np.array([cage.aabb for cage in cages]).reshape(-1, 2, 3)
