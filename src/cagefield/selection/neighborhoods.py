"""Neighborhoods in the occupancy grid: growing, shrinking and flooding of masks over elements.

Cells that share a face, an edge or a corner are neighbors. Elements beyond the grid have none.
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from cagefield.errors import CagefieldError
from cagefield.selection.elements import Elements
from cagefield.typing import Mask

NEIGHBORS = np.ones((3, 3, 3), bool)
"""Structuring element of the 26 neighbors of a cell."""

FLOOD_OPACITY = 0.3
"""Default opacity from which on a flood goes through a cell."""


def grow(elements: Elements, mask: Mask, steps: int = 1) -> Mask:
    """Mask [N] of the elements within `steps` cells of selected ones, these included."""
    if steps < 1:
        raise CagefieldError(f"a selection grows by 1 cell or more, not by {steps}")
    reached = ndimage.binary_dilation(_occupied(elements, mask), NEIGHBORS, iterations=steps)
    return mask | _in_cells(elements, np.asarray(reached))


def shrink(elements: Elements, mask: Mask, steps: int = 1) -> Mask:
    """Mask [N] of the selected elements that are not within `steps` cells of ones that are not selected.

    A selection without neighbors that are not selected stays whole, as "select less" has it for meshes.
    """
    if steps < 1:
        raise CagefieldError(f"a selection shrinks by 1 cell or more, not by {steps}")
    return mask & ~grow(elements, ~mask, steps)


def flood(
    elements: Elements, seed: int, threshold: float = FLOOD_OPACITY, reach: float | None = None
) -> Mask:
    """Mask [N] of the elements connected to element `seed` by cells of an opacity from `threshold` on.

    `reach` bounds the flood to cells within that distance of the seed's, world units; None floods on.
    The seed's own cell belongs to the flood, however transparent.

    Raises CagefieldError for a threshold outside (0, 1], a reach <= 0, or a seed beyond the grid.
    """
    if not 0.0 < threshold <= 1.0:
        raise CagefieldError(f"the flood's threshold is an opacity in (0, 1], not {threshold:g}")
    if reach is not None and not reach > 0.0:
        raise CagefieldError(f"the flood's reach must be a length > 0, got {reach:g}")
    cell = elements.cells[seed]
    if cell[0] < 0:
        raise CagefieldError(
            "a flood begins in the field's box of interest, and this lies beyond; use a brush or a lasso"
        )
    passable = elements.occupancy >= threshold
    passable[tuple(cell)] = True
    if reach is not None:
        axes = (np.arange(n) - c for n, c in zip(passable.shape, cell, strict=True))
        x, y, z = np.meshgrid(*axes, indexing="ij", sparse=True)
        passable &= (x * x + y * y + z * z) * elements.cell_edge**2 <= reach * reach
        passable[tuple(cell)] = True
    labels, _ = ndimage.label(passable, NEIGHBORS)
    return _in_cells(elements, labels == labels[tuple(cell)])


def interior(elements: Elements, mask: Mask) -> Mask:
    """Mask [N] of the selected elements in cells whose neighbors across all six faces are selected too."""
    return mask & _in_cells(elements, ndimage.binary_erosion(_occupied(elements, mask)))


def _occupied(elements: Elements, mask: Mask) -> Mask:
    """[X,Y,Z], True where a cell has a selected element."""
    out = np.zeros(elements.occupancy.shape, bool)
    out[tuple(elements.cells[mask & elements.in_grid].T)] = True
    return out


def _in_cells(elements: Elements, chosen: Mask) -> Mask:
    """[N], True for elements in chosen cells [X,Y,Z]."""
    out = np.zeros(len(elements), bool)
    rows = np.flatnonzero(elements.in_grid)
    out[rows] = chosen[tuple(elements.cells[rows].T)]
    return out
