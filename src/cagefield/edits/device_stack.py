"""An edit stack packed for kernels: its edits' rows, their lattices and flow tables, and their boxes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from cagefield.compute import devices
from cagefield.compute.block_cyclic import block_cyclic_schedule
from cagefield.compute.device_buffers import rows_for_kernels, vectors_for_kernels
from cagefield.compute.weak_memo import memoized_weakly
from cagefield.edits.buffer_pool import BufferPool
from cagefield.edits.device.kernels.device_stack import grade_samples, map_samples
from cagefield.edits.device.kernels.edit_maps import EditArgs
from cagefield.edits.device.packing import (
    AFFINE,
    ALONE,
    BASE_PLACE,
    CENTER,
    CHANGED_BOX,
    CONTINUOUS,
    FIRST,
    FLOW,
    GRADED,
    IMAGE,
    IS_CUT,
    LAST,
    MATRIX,
    OFFSET,
    PART_PLACE,
    RECORD,
    RECORDS,
    RESOLUTION,
    STILL,
    UNDER_PLACE,
    WIDTH,
    pack_grade,
    pack_warp,
    widened,
)
from cagefield.edits.edit import Continuous, Discrete, Edit, Paste
from cagefield.edits.edit_map import EditMap
from cagefield.edits.mapped_samples import SampleGrade
from cagefield.edits.prepared import PreparedEdit
from cagefield.typing import Mask
from cagefield.warps import flow_table
from cagefield.warps.flow_shell import FlowShell

_pool = BufferPool()


@dataclass(frozen=True)
class DeviceStack:
    """An edit stack packed for kernels.

    params [max(E,1), WIDTH] float32; lattice [M,3] float32, all edits' nodes one after the other (x fastest),
    displacements in world units, and the tables of exact flow shells (see `flow_table`); n_edits E; boxes
    [B,2,3] float32 (min, max), one or two for each edit, outside all of which a sample is canonical as it is.
    """

    params: NDArray[np.float32]
    lattice: NDArray[np.float32]
    n_edits: int
    boxes: NDArray[np.float32]

    @classmethod
    def from_stack(cls, stack: EditMap) -> DeviceStack:
        """The stack's enabled edits that change something. Raises `EditError` where one cannot be evaluated.

        Lattices are sampled here, by the kernel, and kept for as long as their edit lives.
        """
        steps = stack.steps
        params = np.zeros((max(len(steps), 1), WIDTH), dtype=np.float32)
        lattices: list[NDArray[np.float32]] = []
        offset = 0
        for number, step in enumerate(steps):
            row = params[number]
            row[:] = _row_of(step)
            nodes = _nodes_of(step.edit)
            if len(nodes):
                row[OFFSET], row[OFFSET + 1] = divmod(offset, 65536)
                offset += len(nodes)
                lattices.append(nodes)
        nodes = np.zeros((1, 3), dtype=np.float32)
        if lattices:
            nodes = lattices[0] if len(lattices) == 1 else _pool.join(lattices)
        places = iter(stack.places)
        for number, step in enumerate(steps):
            for column, layer in ((UNDER_PLACE, step.under), (PART_PLACE, step.part)):
                if layer is not None:
                    params[number, column] = next(places)
        for number, step in enumerate(steps):
            met = _meets(params[:number], params[number])
            base = _base_place(params[:number][met], params[number])
            params[number, ALONE], params[number, BASE_PLACE] = base is not None, base or 0.0
            is_cut = isinstance(step.edit, Discrete) and not step.is_light
            params[number, IS_CUT] = is_cut or params[:number][met, IS_CUT].any()
        boxes = widened(np.concatenate([np.zeros((0, 2, 3))] + [step.boxes for step in steps]))
        packed = cls(params, nodes, len(steps), boxes.astype(np.float32))
        for array in (packed.params, packed.lattice, packed.boxes):
            array.setflags(write=False)
        return packed

    @cached_property
    def args(self) -> EditArgs:
        """The stack as kernels take it; on a GPU its arrays are uploaded once and stay there."""
        devices.start()
        return EditArgs(rows_for_kernels(self.params), vectors_for_kernels(self.lattice), self.n_edits)

    @cached_property
    def has_flows(self) -> bool:
        """True where a flow shell is evaluated exactly: kernels without one leave its code out."""
        return bool((self.params[:, RESOLUTION] == FLOW).any())

    @cached_property
    def is_graded(self) -> bool:
        """True where an edit grades colors: kernels leave the code out where none does."""
        return bool((self.params[:, GRADED] > 0.0).any())

    def grade(self, points: NDArray[np.float32]) -> SampleGrade:
        """Grade of deformed points [N,3], by `grade_sample`."""
        devices.start()
        out = np.empty((len(points), 10), dtype=np.float32)
        if len(points):
            schedule = block_cyclic_schedule(len(points))
            grade_samples(np.ascontiguousarray(points, np.float32), schedule, out, self.args, self.has_flows)
        return SampleGrade(out[:, :9].reshape(-1, 3, 3).astype(np.float64), out[:, 9].astype(np.float64))

    def to_canonical(
        self, points: NDArray[np.float32], viewdirs: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32], NDArray[np.int32]]:
        """(points [N,3], viewdirs [N,3], stretch [N], places [N]) of samples, by `map_sample`."""
        devices.start()
        n = len(points)
        out = np.empty((n, 8), dtype=np.float32)
        samples = np.ascontiguousarray(np.concatenate([points, viewdirs], axis=1), dtype=np.float32)
        if n:
            map_samples(samples, block_cyclic_schedule(len(samples)), out, self.args, self.has_flows)
        return out[:, :3], out[:, 3:6], out[:, 6], out[:, 7].astype(np.int32)


def _row_of(step: PreparedEdit) -> NDArray[np.float32]:
    """The row of an edit, see `packing.pack_warp`. Raises `EditError` where the edit cannot be evaluated."""
    return _row_of_edit(step.edit) if step.is_bare else _row_of_step(step)


@memoized_weakly
def _row_of_edit(edit: Edit) -> NDArray[np.float32]:
    return _packed(PreparedEdit(edit))


@memoized_weakly
def _row_of_step(step: PreparedEdit) -> NDArray[np.float32]:
    return _packed(step)


def _packed(step: PreparedEdit) -> NDArray[np.float32]:
    edit = step.edit
    if isinstance(edit, Paste) and step.part is None:
        raise edit.unread()
    lattice = edit.kernel_lattice if isinstance(edit, Continuous) else None
    row = pack_warp(step.exact_warp, step.boxes, lattice)
    pack_grade(row, edit.grading, edit.grade_falloff if isinstance(edit, Continuous) else None)
    row[STILL] = isinstance(edit, Continuous) and not edit.changes_geometry
    return row


def _nodes_of(edit: Edit) -> NDArray[np.float32]:
    """Nodes [R^3,3] of an edit's lattice, or the table [T,3] of its exact flow shell; [0,3] without."""
    if not isinstance(edit, Continuous):
        return np.zeros((0, 3), dtype=np.float32)
    return _flow_table(edit) if edit.kernel_lattice is None else edit.lattice_nodes


@memoized_weakly
def _flow_table(edit: Continuous) -> NDArray[np.float32]:
    """The table [T,3] of an exact flow shell, see `flow_table`; [0,3] of another shell."""
    shell = edit.exact_warp.shell
    return flow_table.table(shell) if isinstance(shell, FlowShell) else np.zeros((0, 3), dtype=np.float32)


def _base_place(met: NDArray[np.float32], row: NDArray[np.float32]) -> float | None:
    """Place at which all that an edit moves is read beneath it, None where there are several.

    `met` [E,WIDTH] are the earlier edits that it meets (`_meets`). A layer of the last one's region is that
    place, where the region holds all of it.
    """
    boxes = _moved_boxes(row)
    if not len(met) or not boxes:
        return 0.0
    last, region = met[-1], met[-1, RECORDS + RECORD : RECORDS + 2 * RECORD]
    if last[CONTINUOUS] > 0.5 or last[FIRST] < 0.5 or last[LAST] < 1.5 or region[AFFINE] < 0.5:
        return None
    W, center = region[MATRIX : MATRIX + 9].reshape(3, 3), region[CENTER : CENTER + 3]
    corners = np.concatenate([np.stack(np.meshgrid(*box.T), -1).reshape(-1, 3) for box in boxes])
    is_inside = np.abs((corners - center) @ W.T).max(initial=0.0) <= 1.0
    return float(last[UNDER_PLACE]) if is_inside else None


def _meets(others: NDArray[np.float32], row: NDArray[np.float32]) -> Mask:
    """Rows [E] that move samples, in a box that meets that of `row` or that of what it moves."""
    meets = np.zeros(len(others), bool)
    for low, high in (row[CHANGED_BOX : CHANGED_BOX + 6].reshape(2, 3), *_moved_boxes(row)):
        near = others[:, CHANGED_BOX : CHANGED_BOX + 3] <= high
        meets |= (near & (others[:, CHANGED_BOX + 3 : CHANGED_BOX + 6] >= low)).all(axis=1)
    return meets & (others[:, STILL] < 0.5)


def _moved_boxes(row: NDArray[np.float32]) -> list[NDArray[np.float32]]:
    """Boxes [2,3] that hold the points at which an edit shows the field in place of its samples'."""
    boxes = [row[CHANGED_BOX : CHANGED_BOX + 6].reshape(2, 3)] if row[CONTINUOUS] > 0.5 else []
    if row[FIRST] == 0 and row[PART_PLACE] == 0:
        image = row[RECORDS + IMAGE : RECORDS + RECORD].reshape(8, 3)
        reach = np.abs(image[1:]).sum(axis=0)
        boxes.append(np.stack([image[0] - reach, image[0] + reach]))
    return boxes
