"""Map of several edits, one after the other, between deformed and canonical space."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import SupportsIndex

import numpy as np
from numpy.typing import ArrayLike

from cagefield.edits.edit import Edit, Paste, bounds_of
from cagefield.edits.mapped_samples import CanonicalSamples, DeformedPoints, KernelSamples, SampleGrade
from cagefield.edits.prepared import PreparedEdit
from cagefield.errors import EditError
from cagefield.fields.voxel_field import VoxelField
from cagefield.fields.voxel_layers import layer_x_offsets
from cagefield.typing import Array, Mask


class SpaceMap(ABC):
    """Map from deformed to canonical space: an `EditMap`, or a `KernelMap` of one."""

    @property
    @abstractmethod
    def boxes(self) -> Array:
        """Deformed-space boxes [B,2,3] (min, max) outside which the map changes nothing."""

    @property
    @abstractmethod
    def layers(self) -> tuple[VoxelField, ...]:
        """Fields that samples of layer 1, 2, ... are read from."""

    @abstractmethod
    def to_canonical(
        self, points: ArrayLike, viewdirs: ArrayLike | None = None
    ) -> CanonicalSamples | KernelSamples:
        """Canonical samples of deformed points [N,3] and unit view directions [N,3]."""

    @property
    def bounds(self) -> Array:
        """The box [2,3] that holds `boxes`; (inf, -inf) when nothing is changed."""
        return bounds_of(self.boxes)


class EditMap(SpaceMap):
    """Map of the steps s_1 ... s_n: the deformed field of s_k is the canonical field of s_(k+1).

    A sample goes through phi_n first and phi_1 last. Abstract: an `EditStack`, or a `PreparedStack`, which
    shows patches too.
    """

    @property
    @abstractmethod
    def steps(self) -> tuple[PreparedEdit, ...]:
        """Edits that are enabled and change something, in order, with the edits that change their light."""

    def followed_by(self, step: PreparedEdit) -> PreparedStack:
        """Map with one more step at its end."""
        return PreparedStack((*self.steps, step))

    @property
    def layers(self) -> tuple[VoxelField, ...]:
        """The layers of the edits' patches, in order."""
        return tuple(layer for step in self.steps for layer in step.layers)

    @property
    def is_graded(self) -> bool:
        """True where an active edit changes color or opacity."""
        return any(step.edit.is_graded for step in self.steps)

    @property
    def places(self) -> tuple[int, ...]:
        """The places of the layers (`fields.voxel_layers`)."""
        return layer_x_offsets(self.layers)

    @property
    def boxes(self) -> Array:
        """Boxes [B,2,3] (min, max) outside all of which no active edit changes anything.

        Each is in its own edit's deformed space; a point outside all of them goes through the stack as it is.
        """
        return np.concatenate([np.zeros((0, 2, 3)), *(step.boxes for step in self.steps)])

    def changed_boxes(
        self, before: EditMap, boxes_of: Callable[[PreparedEdit], Array] | None = None
    ) -> Array:
        """Boxes [B,2,3] (min, max) outside all of which this stack maps points as another one does.

        They are those of the edits that the stacks do not share, in deformed space, and of the later edits
        that take points there. `boxes_of` gives an edit's boxes where they are others than its `boxes`.
        """
        boxes_of = boxes_of or _own_boxes
        old, new = before.steps, self.steps
        least = min(len(old), len(new))
        first = next((n for n in range(least) if old[n] != new[n]), least)
        shared = next((n for n in range(least - first) if old[-1 - n] != new[-1 - n]), least - first)
        replaced = (*old[first : len(old) - shared], *new[first : len(new) - shared])
        changed = np.concatenate([np.zeros((0, 2, 3)), *(boxes_of(step) for step in replaced)])
        for step in new[len(new) - shared :]:
            boxes = boxes_of(step)
            if _meet(np.concatenate([boxes, step.edit.inner.aabb[None]]), changed):
                changed = np.concatenate([changed, boxes])
        return changed

    def to_canonical(self, points: ArrayLike, viewdirs: ArrayLike | None = None) -> CanonicalSamples:
        """Canonical samples of deformed points [N,3], with view directions [N,3] taken along if given.

        Raises `EditError` where an active edit cannot be evaluated.
        """
        p = _points(points, "points").copy()
        J = np.tile(np.eye(3), (len(p), 1, 1))
        layer = np.zeros(len(p), dtype=np.int64)
        number = 1 + len(self.layers)
        grade = SampleGrade.neutral(len(p)) if self.is_graded else None
        for step in reversed(self.steps):
            rows = np.flatnonzero(_in_any(step.boxes, p) & (layer == 0))
            mapped = step.warp.to_canonical(p[rows])
            p[rows], J[rows] = mapped.points, mapped.jacobian @ J[rows]
            if grade is not None and step.edit.is_graded:
                weights = step.edit.grade_weights(mapped.points, mapped.inside)
                grade.colors[rows] = grade.colors[rows] @ step.edit.grading.matrices(weights)
                grade.density[rows] *= step.edit.grading.density_factors(weights)
            number -= len(step.layers)
            layer[rows[mapped.lost]] = number if step.under is not None else -1
            if step.part is not None:
                layer[rows[mapped.inside]] = number + len(step.layers) - 1
            elif isinstance(step.edit, Paste):
                raise step.unread()
        if viewdirs is None:
            return CanonicalSamples(p, None, None, J, layer, grade)
        d = _points(viewdirs, "viewdirs")
        if d.shape != p.shape:
            raise EditError(f"viewdirs must have the shape of points, {list(p.shape)}, got {list(d.shape)}")
        along = np.einsum("nij,nj->ni", J, d)
        length = np.linalg.norm(along, axis=1)
        stretch = length / np.linalg.norm(d, axis=1)
        return CanonicalSamples(p, along / length[:, None], stretch, J, layer, grade)

    def to_deformed(self, points: ArrayLike) -> DeformedPoints:
        """Deformed positions of canonical points [N,3]; the forward map.

        A copy takes its points to the copy. Raises `EditError` where an active edit cannot be evaluated.
        """
        p = _points(points, "points").copy()
        J = np.tile(np.eye(3), (len(p), 1, 1))
        hidden = np.zeros(len(p), dtype=bool)
        for step in self.steps:
            reach = np.concatenate([step.boxes, step.edit.inner.aabb[None]])
            rows = np.flatnonzero(_in_any(reach, p) & ~hidden)
            mapped = step.warp.to_deformed(p[rows])
            p[rows], J[rows], hidden[rows] = mapped.points, mapped.jacobian @ J[rows], mapped.lost
        return DeformedPoints(p, J, hidden)


@dataclass(frozen=True)
class PreparedStack(EditMap):
    """Prepared edits in the order of their document, one for each edit of it."""

    edits: tuple[PreparedEdit, ...] = ()

    def __init__(self, edits: Iterable[Edit | PreparedEdit] = ()) -> None:
        prepared = (PreparedEdit(each) if isinstance(each, Edit) else each for each in edits)
        object.__setattr__(self, "edits", tuple(prepared))

    def __len__(self) -> int:
        return len(self.edits)

    def __iter__(self) -> Iterator[PreparedEdit]:
        return iter(self.edits)

    def __getitem__(self, number: SupportsIndex) -> PreparedEdit:
        return self.edits[number]

    @property
    def steps(self) -> tuple[PreparedEdit, ...]:
        return tuple(step for edit in self.edits for step in edit.steps)

    def without_lattices(self) -> PreparedStack:
        """The stack with all maps evaluated exactly."""
        return PreparedStack(edit.without_lattice() for edit in self.edits)


def _own_boxes(step: PreparedEdit) -> Array:
    return step.boxes


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
