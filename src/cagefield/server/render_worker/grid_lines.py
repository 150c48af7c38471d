"""The faint grid: lines of a regular grid through an edit's outer cage, as the edit bends them.

A line x(s) of the grid lies in canonical space; drawn is the deformed p with phi(p) = x. With the
displacement u(p) = phi(p) - p known at lattice nodes, p = x - u(p) is iterated from the last p; where the map
contracts too much for that to converge, the line has a gap.
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from cagefield.edits import Continuous, Edit, EditStack
from cagefield.typing import Array

LINES_PER_AXIS = 7
"""Lines along each axis, on each of the two axes across, the faces of the outer cage included."""

POINTS_PER_LINE = 33
"""Points of a line."""

LATTICE_NODES = 25
"""Lattice nodes along an axis at which the map is sampled; an edit's own finer lattice shows no more."""

MAX_ITERATIONS = 30
"""Iterations of the inverse, damped by one half."""


def grid_lines(edit: Edit) -> list[list[list[float]]]:
    """Polylines, world units, in deformed space. Raises EditError where the edit cannot be evaluated."""
    from cagefield.edits.device_stack import DeviceStack

    if not isinstance(edit, Continuous):
        return []
    origin, frame = edit.outer.frame
    stack = DeviceStack.from_stack(EditStack([edit.replace(lattice=LATTICE_NODES)]))
    axis = np.linspace(0.0, 1.0, LATTICE_NODES)
    nodes = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    at = (origin + nodes @ frame.T).astype(np.float32)
    along = np.tile(np.array([1.0, 0.0, 0.0], np.float32), (len(at), 1))
    mapped, _, _, _ = stack.to_canonical(at, along)
    inverse = np.linalg.inv(frame)
    u = ((mapped - at).astype(np.float64) @ inverse.T).reshape(LATTICE_NODES, LATTICE_NODES, LATTICE_NODES, 3)
    lines = _straight()
    bent, fine = _bent(lines.reshape(-1, 3), u)
    world = (origin + bent @ frame.T).reshape(lines.shape)
    return [
        piece
        for line, good in zip(world, fine.reshape(lines.shape[:2]), strict=True)
        for piece in _pieces(line, good)
    ]


def _straight() -> Array:
    """Lines [L,POINTS_PER_LINE,3] along each axis, LINES_PER_AXIS^2 of them through its middle plane."""
    s, places = np.linspace(0.0, 1.0, POINTS_PER_LINE), np.linspace(0.0, 1.0, LINES_PER_AXIS)
    found = []
    for axis in range(3):
        a, b = (axis + 1) % 3, (axis + 2) % 3
        for p in places:
            for q in places:
                if min(abs(p - 0.5), abs(q - 0.5)) > 1e-9:
                    continue
                line = np.empty((POINTS_PER_LINE, 3))
                line[:, axis], line[:, a], line[:, b] = s, p, q
                found.append(line)
    return np.stack(found)


def _bent(x: Array, u: Array) -> tuple[Array, Array]:
    """(p, converged) with p + u(p) = x, frame units."""
    p = x.copy()
    residual = np.zeros_like(p)
    for _ in range(MAX_ITERATIONS):
        residual = x - p - _read(u, p)
        p = p + 0.5 * residual
    return p, np.abs(residual).max(axis=1) < 0.01


def _read(u: Array, p: Array) -> Array:
    at = np.clip(p, 0.0, 1.0).T * (LATTICE_NODES - 1)
    return np.stack(
        [ndimage.map_coordinates(u[..., a], at, order=1, mode="nearest") for a in range(3)], axis=1
    )


def _pieces(line: Array, good: Array) -> list[list[list[float]]]:
    """The runs of a line whose points are good, of two points or more."""
    breaks = np.flatnonzero(~good.astype(bool))
    runs = np.split(np.arange(len(line)), breaks)
    kept = [[n for n in run.tolist() if good[n]] for run in runs]
    return [line[run].tolist() for run in kept if len(run) > 1]
