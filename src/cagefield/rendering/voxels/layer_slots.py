"""Slots of a field and of layers in shared arrays: those of a layer are written once, while it lives.

An edit that is dragged or refined changes one layer of many. The field's own records are not copied for that,
but where the arrays become too short.
"""

from __future__ import annotations

from dataclasses import dataclass
from threading import Lock
from weakref import ref

import numpy as np
from numpy.typing import NDArray

from cagefield.fields.voxel_field import VoxelField
from cagefield.rendering.voxels.occupancy import BRICK
from cagefield.typing import Float32

GROWTH = 1.5
"""Slots of the arrays, as a multiple of those that are needed when they are made."""


@dataclass(frozen=True, eq=False)
class _Stored:
    """Slots, from `first` on, of a layer's vertices [M], and a reference to it: free once it is gone."""

    layer: ref[VoxelField]
    first: int
    slots: NDArray[np.int64]


class LayerSlots:
    """Records of a field in its slots [0, M], those of living layers behind them.

    density [S] and sh [S * 3K] float32 become others where they grow; the ones before keep their contents.
    Slot 0 is that of empty vertices.

    Attributes:
        index: [nx*ny*nz] int32, slot of each of the field's vertices.
    """

    def __init__(self, field: VoxelField) -> None:
        order = brick_order(field.vertices, field.resolution)
        self.index = np.zeros(int(np.prod(field.resolution)), np.int32)
        self.index[field.vertices[order]] = np.arange(1, len(order) + 1, dtype=np.int32)
        self._own = len(order) + 1
        width = 3 * field.sh.shape[1]
        room = int(GROWTH * self._own)
        self._density, self._sh = np.empty(room, np.float32), np.empty(room * width, np.float32)
        self._density[0] = self._sh[:width] = 0.0
        self._density[1 : self._own] = field.density[order]
        self._sh[width : self._own * width] = field.sh[order].reshape(-1)
        self._stored: list[_Stored] = []
        self._lock = Lock()

    def store(self, layers: tuple[VoxelField, ...]) -> tuple[Float32, Float32, list[NDArray[np.int64]]]:
        """(density [S], sh [S * 3K], slots of each layer's vertices); S slots are those up to the last.

        The layers must live as long as their slots are read.
        """
        with self._lock:
            slots = [self._slots_of(layer) for layer in layers]
            used = max((int(each.max(initial=0)) for each in slots), default=0)
            used = max(self._own, used + 1)
            width = len(self._sh) // len(self._density)
            return self._density[:used], self._sh[: used * width], slots

    def _slots_of(self, layer: VoxelField) -> NDArray[np.int64]:
        found = next((stored for stored in self._stored if stored.layer() is layer), None)
        if found is None:
            order = brick_order(layer.vertices, layer.resolution)
            first = self._free_slot(len(order))
            last = first + len(order)
            slots = np.empty(len(order), np.int64)
            slots[order] = np.arange(first, last)
            found = _Stored(ref(layer), first, slots)
            self._stored.append(found)
            width = len(self._sh) // len(self._density)
            self._density[first:last] = layer.density[order]
            self._sh[first * width : last * width] = layer.sh[order].reshape(-1)
        return found.slots

    def _free_slot(self, count: int) -> int:
        """The first of so many free slots; the arrays grow where there are none."""
        self._stored = sorted((s for s in self._stored if s.layer() is not None), key=lambda s: s.first)
        at = self._own
        for stored in self._stored:
            if stored.first - at >= count:
                return at
            at = stored.first + len(stored.slots)
        if at + count > len(self._density):
            room, width = int(GROWTH * (at + count)), len(self._sh) // len(self._density)
            self._density = _grown(self._density, room, at)
            self._sh = _grown(self._sh, room * width, at * width)
        return at


def brick_order(vertices: NDArray[np.int64], resolution: tuple[int, int, int]) -> NDArray[np.int64]:
    """The permutation [M] that sorts linear vertex indices by brick, then by position inside the brick."""
    _, ny, nz = resolution
    x, rest = np.divmod(vertices, ny * nz)
    y, z = np.divmod(rest, nz)
    brick = ((x // BRICK) * (ny // BRICK + 1) + y // BRICK) * (nz // BRICK + 1) + z // BRICK
    return np.asarray(np.lexsort((vertices, brick)))


def _grown(values: Float32, size: int, kept: int) -> Float32:
    """A longer array that begins with the first `kept` values."""
    longer = np.empty(size, np.float32)
    longer[:kept] = values[:kept]
    return longer
