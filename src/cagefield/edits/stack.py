"""Edits in order, and the map of all of them together."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import SupportsIndex

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cagefield.edits.edit import Edit, bounds_of
from cagefield.edits.options import problem_of_lattices
from cagefield.errors import EditError
from cagefield.fields.voxel_field import VoxelField
from cagefield.fields.voxel_layers import layer_x_offsets
from cagefield.typing import Array, Mask


@dataclass(frozen=True)
class CanonicalSamples:
    """Samples of deformed space, taken to canonical space.

    points [N,3]; viewdirs [N,3] unit, d^c = J d / |J d|, and stretch [N], |J d| for unit d (both None where
    no view directions were given); jacobian [N,3,3], d(canonical)/d(deformed); layer [N], what is read at the
    point: 0 the field, n the n-th of `EditStack.layers`, -1 nothing.
    """

    points: Array
    viewdirs: Array | None
    stretch: Array | None
    jacobian: Array
    layer: NDArray[np.int64]

    @property
    def emptied(self) -> Mask:
        """[N], True where the field must be read as empty."""
        return np.asarray(self.layer < 0)


@dataclass(frozen=True)
class DeformedPoints:
    """Canonical points, taken to deformed space.

    points [N,3]; jacobian [N,3,3], d(deformed)/d(canonical); hidden [N], True where nothing in the deformed
    scene shows the canonical point (deleted, or covered by moved content).
    """

    points: Array
    jacobian: Array
    hidden: Mask


@dataclass(frozen=True)
class LatticeError:
    """How far an edit's lattice is off its exact map, in voxels: at most, and on average over the shell.

    `number` is the edit's place in its stack, from 0.
    """

    number: int
    name: str
    resolution: int
    worst: float
    mean: float


@dataclass(frozen=True)
class EditStack:
    """Edits e_1 ... e_n: the deformed field of e_k is the canonical field of e_(k+1).

    A sample goes through phi_n first and phi_1 last. Edits that are not enabled, or change nothing, are
    passed over.
    """

    edits: tuple[Edit, ...] = ()

    def __init__(self, edits: Iterable[Edit] = ()) -> None:
        object.__setattr__(self, "edits", tuple(edits))
        for number, edit in enumerate(self.edits):
            if not isinstance(edit, Edit):
                raise EditError(f"an edit stack holds edits: item {number} is a {type(edit).__name__}")

    def __len__(self) -> int:
        return len(self.edits)

    def __iter__(self) -> Iterator[Edit]:
        return iter(self.edits)

    def __getitem__(self, number: SupportsIndex) -> Edit:
        return self.edits[number]

    @property
    def active(self) -> tuple[Edit, ...]:
        """The edits that are enabled and change something, in order."""
        return tuple(edit for edit in self.edits if edit.enabled and edit.changes_anything)

    def append(self, edit: Edit) -> EditStack:
        """The stack with one more edit at its end."""
        return EditStack((*self.edits, edit))

    def set(self, number: int, edit: Edit) -> EditStack:
        """The stack with one edit replaced."""
        edits = list(self.edits)
        edits[number] = edit
        return EditStack(edits)

    def remove(self, number: int) -> EditStack:
        """The stack without one edit."""
        edits = list(self.edits)
        del edits[number]
        return EditStack(edits)

    def move(self, number: int, to: int) -> EditStack:
        """The stack with one edit taken out and put in at another place."""
        edits = list(self.edits)
        edits.insert(to, edits.pop(number))
        return EditStack(edits)

    @property
    def layers(self) -> tuple[VoxelField, ...]:
        """The layers of the active edits' patches, in order."""
        return tuple(layer for edit in self.active for layer in edit.layers)

    @property
    def places(self) -> tuple[int, ...]:
        """The places of the layers (`fields.voxel_layers`)."""
        return layer_x_offsets(self.layers)

    @property
    def boxes(self) -> Array:
        """Boxes [B,2,3] (min, max) outside all of which no active edit changes anything.

        Each is in its own edit's deformed space; a point outside all of them goes through the stack as it is.
        """
        return np.concatenate([np.zeros((0, 2, 3)), *(edit.boxes for edit in self.active)])

    @property
    def bounds(self) -> Array:
        """The box [2,3] that holds `boxes`; (inf, -inf) when nothing is changed."""
        return bounds_of(self.boxes)

    def changed_boxes(self, before: EditStack, boxes_of: Callable[[Edit], Array] | None = None) -> Array:
        """Boxes [B,2,3] (min, max) outside all of which this stack maps points as another one does.

        They are those of the edits that the stacks do not share, in deformed space, and of the later edits
        that take points there. `boxes_of` gives an edit's boxes where they are others than its `boxes`.
        """
        boxes_of = boxes_of or _own_boxes
        old, new = before.active, self.active
        least = min(len(old), len(new))
        first = next((n for n in range(least) if old[n] != new[n]), least)
        shared = next((n for n in range(least - first) if old[-1 - n] != new[-1 - n]), least - first)
        replaced = (*old[first : len(old) - shared], *new[first : len(new) - shared])
        changed = np.concatenate([np.zeros((0, 2, 3)), *(boxes_of(edit) for edit in replaced)])
        for edit in new[len(new) - shared :]:
            boxes = boxes_of(edit)
            if _meet(np.concatenate([boxes, edit.inner.aabb[None]]), changed):
                changed = np.concatenate([changed, boxes])
        return changed

    def lattice_errors(self, voxel_size: float, *, samples: int = 5_000) -> tuple[LatticeError, ...]:
        """The errors of the active edits that have a lattice, in voxels of an edge in world units.

        Measured at that many random points of each shell, between the inner and the outer cage. Raises
        `EditError` for an edit that cannot be evaluated, or a voxel size that is not positive.
        """
        if not voxel_size > 0.0:
            raise EditError(f"voxel_size must be positive, the edge of a voxel, got {voxel_size!r}")
        errors = []
        for number, edit in enumerate(self.edits):
            if edit.lattice is None or edit.adjustment == "discrete":
                continue
            if edit.enabled and edit.changes_anything:
                worst, mean = (error / voxel_size for error in edit.lattice_error(samples=samples))
                errors.append(LatticeError(number, edit.name, edit.lattice, worst, mean))
        return tuple(errors)

    def check(self) -> None:
        """Raise `EditError` for the first active edit that cannot be evaluated, or too large lattices."""
        shown = (edit for edit in self.edits if edit.enabled and edit.adjustment == "continuous")
        too_large = problem_of_lattices(edit.lattice for edit in shown)
        if too_large is not None:
            raise EditError(too_large)
        for edit in self.active:
            edit.check()

    def to_canonical(self, points: ArrayLike, viewdirs: ArrayLike | None = None) -> CanonicalSamples:
        """Canonical samples of deformed points [N,3], with view directions [N,3] taken along if given.

        Raises `EditError` where an active edit cannot be evaluated.
        """
        p = _points(points, "points").copy()
        J = np.tile(np.eye(3), (len(p), 1, 1))
        layer = np.zeros(len(p), dtype=np.int64)
        number = 1 + len(self.layers)
        for edit in reversed(self.active):
            rows = np.flatnonzero(_in_any(edit.boxes, p) & (layer == 0))
            mapped = edit.warp.to_canonical(p[rows])
            p[rows], J[rows] = mapped.points, mapped.jacobian @ J[rows]
            number -= len(edit.layers)
            layer[rows[mapped.lost]] = number if edit.under is not None else -1
            if edit.part is not None:
                layer[rows[mapped.inside]] = number + len(edit.layers) - 1
            elif edit.source is not None:
                raise edit.unread()
        if viewdirs is None:
            return CanonicalSamples(p, None, None, J, layer)
        d = _points(viewdirs, "viewdirs")
        if d.shape != p.shape:
            raise EditError(f"viewdirs must have the shape of points, {list(p.shape)}, got {list(d.shape)}")
        along = np.einsum("nij,nj->ni", J, d)
        length = np.linalg.norm(along, axis=1)
        return CanonicalSamples(p, along / length[:, None], length / np.linalg.norm(d, axis=1), J, layer)

    def to_deformed(self, points: ArrayLike) -> DeformedPoints:
        """Deformed positions of canonical points [N,3]; the forward map.

        A copy takes its points to the copy. Raises `EditError` where an active edit cannot be evaluated.
        """
        p = _points(points, "points").copy()
        J = np.tile(np.eye(3), (len(p), 1, 1))
        hidden = np.zeros(len(p), dtype=bool)
        for edit in self.active:
            cages = [edit.inner.aabb] if edit.outer is None else [edit.inner.aabb, edit.outer.aabb]
            reach = np.concatenate([edit.boxes, np.stack(cages)])
            rows = np.flatnonzero(_in_any(reach, p) & ~hidden)
            mapped = edit.warp.to_deformed(p[rows])
            p[rows], J[rows], hidden[rows] = mapped.points, mapped.jacobian @ J[rows], mapped.lost
        return DeformedPoints(p, J, hidden)


def _own_boxes(edit: Edit) -> Array:
    return edit.boxes


def _meet(boxes: Array, others: Array) -> bool:
    """True where one of the boxes [B,2,3] meets one of the others."""
    a, b = boxes[:, None], others[None]
    return bool(((a[:, :, 0] <= b[:, :, 1]) & (b[:, :, 0] <= a[:, :, 1])).all(axis=2).any())


def _in_any(boxes: Array, p: Array) -> Mask:
    inside = np.zeros(len(p), dtype=bool)
    for low, high in boxes:
        inside |= ((p >= low) & (p <= high)).all(axis=1)
    return inside


def _points(value: ArrayLike, name: str) -> Array:
    p = np.asarray(value, dtype=np.float64)
    if p.ndim != 2 or p.shape[1] != 3:
        raise EditError(f"{name} must have shape [N,3], got {list(p.shape)}")
    return p
