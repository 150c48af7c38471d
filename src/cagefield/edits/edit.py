"""Edit: an inner cage, the operations that move it, and the kind of edit, one class for each kind."""

from __future__ import annotations

import os
from abc import ABC
from dataclasses import KW_ONLY, dataclass
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from cagefield.edits.abstract_edit import AbstractEdit, bounds_of, boxes_of_cages
from cagefield.edits.abstract_edit import ImpossibleEditError as ImpossibleEditError
from cagefield.edits.continuous_edit import ContinuousEdit
from cagefield.edits.edit_names import problem_of_source
from cagefield.edits.mirror import mirrored_axes
from cagefield.edits.operations import Operation
from cagefield.edits.options import problem_of_lattice
from cagefield.edits.safe_fraction import Search, is_valid, largest_safe
from cagefield.edits.shells import (
    NO_SHELL,
    SMOOTH_FLOW,
    Flow,
    ShellKind,
    ShellSettings,
    problem_of_unused_falloff,
)
from cagefield.errors import EditError
from cagefield.geometry.cage import Cage
from cagefield.geometry.control_points import ControlPoints
from cagefield.typing import Array, Mask
from cagefield.warps.discrete import DiscreteWarp
from cagefield.warps.hexahedron_map import HexahedronMap

__all__ = [
    "Continuous",
    "Copy",
    "Delete",
    "Discrete",
    "Edit",
    "ImpossibleEditError",
    "Move",
    "Paste",
    "bounds_of",
]


@dataclass(frozen=True)
class Edit(AbstractEdit, ABC):
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
    - grading: change of color and opacity of what the cage contains, see `Grade`; `grade` sets its values.

    Every kind keeps `fill`, `relight` and `feather`, for when the kind of the edit is changed.

    Raises `EditError` for invalid options and impossible operations; cages that do not fit together and
    folded shells are reported by `check`, which every evaluation calls.
    """

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


@dataclass(frozen=True)
class Continuous(ContinuousEdit, Edit):
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

    @cached_property
    def mirrored(self) -> tuple[int, ...]:
        """Axes 0 to 2 of the cage along which its content is reflected."""
        return mirrored_axes(self.operations)

    def map_between(self, canonical: Cage, deformed: Cage) -> HexahedronMap:
        """Map of the second cage onto the first one, mirrored as the operations say."""
        return HexahedronMap(canonical, deformed, self.mirrored)

    @property
    def _is_moved(self) -> bool:
        return bool(self.mirrored) or super()._is_moved

    def grade_weights(self, points: Array, inside: Mask) -> Array:
        return inside.astype(np.float64)

    @property
    def uncovers(self) -> bool:
        """True where the content of V^c is taken away: of a move and a delete."""
        return isinstance(self, Move | Delete)

    @property
    def boxes(self) -> Array:
        if not self.changes_anything:
            return boxes_of_cages([])
        shown = [] if isinstance(self, Delete) else [self.deformed]
        return boxes_of_cages([*shown, self.inner] if self.uncovers else shown)

    @cached_property
    def exact_warp(self) -> DiscreteWarp:
        inner = None if isinstance(self, Delete) else self.map_between(self.inner, self.deformed)
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

    def largest_share(self, operation: Operation, cage: Cage, search: Search) -> float:
        return largest_safe(search.check or (lambda t: is_valid(operation, t, cage)), search)


AnyDiscrete = TypeVar("AnyDiscrete", bound=Discrete)


@dataclass(frozen=True)
class Move(Discrete):
    """Edit that shows the content of V^c in V; the rest of V^c is emptied, and filled by `fill`."""

    @cached_property
    def changes_geometry(self) -> bool:
        return self._is_moved


@dataclass(frozen=True)
class Copy(Discrete):
    """Edit that shows the content of V^c in V too; V^c stays."""

    @cached_property
    def changes_geometry(self) -> bool:
        return self._is_moved


@dataclass(frozen=True)
class Delete(Discrete):
    """Edit that empties V^c, which `fill` fills. A delete has no operations."""

    def __post_init__(self) -> None:
        if self.operations:
            self._refuse("a delete has no operations and keeps no source")
        if self.is_graded:
            self._refuse(
                "a delete shows nothing to grade; leave grade out, or make it a move, copy or continuous"
            )
        super().__post_init__()

    @property
    def changes_geometry(self) -> bool:
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
    def changes_geometry(self) -> bool:
        return True

    def unread(self) -> EditError:
        """Error of a paste whose source has not been read."""
        return self.cannot_paste("nobody has read it; render the edit as part of a Scene")

    def cannot_paste(self, reason: str) -> EditError:
        """Error of a paste that cannot be shown."""
        return self.error(f"pastes from {self.source}: {reason}")
