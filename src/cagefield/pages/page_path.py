"""The edits of a page along its camera path: states of the stack, and straight ways from one to the next.

    times      [S] float32, seconds from the path's begin, rising
    states     [S] uint16, the state at each of these times; a state that comes again is stored once
    occupancy  [bx, by, bz] uint16, codes of a grid of bricks that holds the field in all states
    lattice.k  [2, 3 N] uint8, halves as in `page_edits`. Entry n of the header's `lattices` says which of
               them the edits of state n have
    layer.k.*  as `page_layers` has them. Entry n of the header's `layers` has those of state n: [k, place,
               first, end], see `page_layers.bricks_of`
    rows.n     as `page_edits` has them, of state n

Only rows and nodes differ from state to state, so that a state is a mean of two where both have the same
kinds of edits (`mixed`): inner cages and shells then follow chords of their ways.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.edits import EditMap, PreparedEdit
from cagefield.edits.device.packing import (
    AFFINE,
    CHANGED_BOX,
    CONTINUOUS,
    FIRST,
    LAST,
    LOW,
    OFFSET,
    PART_PLACE,
    RECORD,
    RECORDS,
    RESOLUTION,
    SIMPLE,
    UNDER_PLACE,
)
from cagefield.edits.device_stack import DeviceStack
from cagefield.fields.voxel_field import VoxelField
from cagefield.pages.page_edits import page_rows
from cagefield.pages.page_file import byte_planes, pack
from cagefield.pages.page_layers import bricks_of, encode_layer, layer_key
from cagefield.rendering.voxels.occupancy import BRICK, Occupancy, encode, masks_of

MAGIC, VERSION = b"cagepath", 2


@dataclass(frozen=True)
class PathState:
    """A stack on the way: its active edits and, packed, their numbers and nodes; its layers' places."""

    edits: tuple[PreparedEdit, ...]
    packed: DeviceStack
    places: tuple[int, ...]

    @classmethod
    def from_edits(cls, edits: EditMap) -> PathState:
        """Raises EditError for a stack that cannot be evaluated."""
        return cls(edits.steps, DeviceStack.from_stack(edits), edits.places)

    @property
    def lattices(self) -> list[NDArray[np.float32]]:
        """The nodes [N,3] of each lattice."""
        sizes = [round(max(row[RESOLUTION], 0.0)) ** 3 for row in self.packed.params[: len(self.edits)]]
        ends = np.cumsum([size for size in sizes if size], dtype=int)
        return np.split(self.packed.lattice[: ends[-1]], ends[:-1]) if len(ends) else []


def encode_page_path(
    field: VoxelField,
    times: Sequence[float],
    order: Sequence[int],
    states: Sequence[PathState],
    occupancy: Occupancy,
    *,
    preserve_opacity: bool,
) -> bytes:
    """The file of `states` of a field, of which number `order[k]` is shown at `times[k]`.

    All states have lattices of the same sizes in the same order. Raises EditError for more edits than a page
    takes.
    """
    arrays: dict[str, NDArray[Any]] = {
        "times": np.asarray(times, np.float32),
        "states": np.asarray(order, np.uint16),
        "occupancy": occupancy.codes.astype(np.uint16),
    }
    for number, state in enumerate(states):
        arrays[f"rows.{number}"] = page_rows(state.edits, state.packed)
    known: dict[bytes, int] = {}
    lattices: list[list[int]] = []
    for state in states:
        lattices.append([])
        for lattice in state.lattices:
            place = known.setdefault(lattice.tobytes(), len(known))
            arrays.setdefault(f"lattice.{place}", byte_planes(lattice.reshape(-1).astype(np.float16)))
            lattices[-1].append(place)
    held: dict[str, int] = {}
    layers: list[list[list[int]]] = []
    for state in states:
        layers.append([])
        found = (layer for edit in state.edits for layer in edit.layers)
        for layer, place in zip(found, state.places, strict=True):
            key = layer_key(layer)
            if key not in held:
                held[key] = len(held)
                arrays.update(encode_layer(layer, field, f"layer.{held[key]}"))
            layers[-1].append([held[key], *bricks_of(layer, place).values()])
    header = {
        "edits": [len(state.edits) for state in states],
        "boxes": [len(state.packed.boxes) if state.edits else 0 for state in states],
        "lattices": lattices,
        "stored": len(known),
        "layers": layers,
        "layer_keys": list(held),
        "preserve_opacity": preserve_opacity,
        "origin": occupancy.origin.tolist(),
        "dims": list(occupancy.codes.shape),
    }
    return pack(MAGIC, VERSION, header, arrays)


_KINDS = [FIRST, LAST, CONTINUOUS, RESOLUTION, OFFSET, OFFSET + 1, SIMPLE, UNDER_PLACE, PART_PLACE]
_KINDS += [RECORDS + number * RECORD + AFFINE for number in range(2)]
"""Columns with the kind of an edit and the offsets of its layers."""


def mixable(one: PathState, other: PathState) -> bool:
    """Whether the page goes straight from one state to the other: the same kinds of edits in order."""
    a, b = one.packed, other.packed
    if len(one.edits) != len(other.edits) or len(a.boxes) != len(b.boxes):
        return False
    return bool(np.array_equal(a.params[:, _KINDS], b.params[:, _KINDS]))


def mixed(one: PathState, other: PathState, share: float) -> DeviceStack:
    """The stack that the page evaluates at a share of the way from one state to the other."""
    a, b = one.packed, other.packed
    params = (1.0 - share) * a.params + share * b.params
    # Boxes hold those of both.
    for low in (CHANGED_BOX, *(RECORDS + number * RECORD + LOW for number in range(2))):
        first, last = slice(low, low + 3), slice(low + 3, low + 6)
        params[:, first] = np.minimum(a.params[:, first], b.params[:, first])
        params[:, last] = np.maximum(a.params[:, last], b.params[:, last])
    boxes = np.stack(
        [np.minimum(a.boxes[:, 0], b.boxes[:, 0]), np.maximum(a.boxes[:, 1], b.boxes[:, 1])], axis=1
    )
    lattice = (1.0 - share) * a.lattice + share * b.lattice
    return DeviceStack(
        params.astype(np.float32), lattice.astype(np.float32), a.n_edits, boxes.astype(np.float32)
    )


def joined_occupancy(found: Sequence[Occupancy]) -> Occupancy:
    """Union of occupancies of one grid."""
    low = np.min([each.origin for each in found], axis=0)
    high = np.max([each.origin + BRICK * np.array(each.codes.shape) for each in found], axis=0)
    blocks = np.zeros((high - low) // BRICK * 2, bool)
    for each in found:
        first = (each.origin - low) // BRICK * 2
        x, y, z = first + 2 * np.array(each.codes.shape)
        blocks[first[0] : x, first[1] : y, first[2] : z] |= each.blocks
    return Occupancy(low, encode(masks_of(blocks)))
