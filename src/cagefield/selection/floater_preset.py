"""Preset for floaters: artifacts of training that hang in empty space.

Voxels: clouds that are small beside the largest one. Splats: these, splats whose nearest neighbors are far
away, and splats that are large and faint at once. All bounds are ratios to the field's own medians, so that
no constant depends on the scene's units.
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from cagefield.errors import CagefieldError
from cagefield.selection.elements import Elements
from cagefield.selection.neighborhoods import NEIGHBORS
from cagefield.typing import Mask

CLOUD_OPACITY = 0.1
"""Opacity from which on a cell without a splat's mean joins the clouds beside it."""

NEIGHBOR_RANK = 8
"""Isolation of a splat is measured to its neighbor of this rank."""


def floaters(elements: Elements, strength: float = 0.5) -> Mask:
    """Mask [N] of probable floaters; `strength` in [0,1] from certain ones to many.

    With s the strength, an element is a floater
    - in a cloud with at most 10^(4 s - 5) of the elements of the largest one (0.5: a thousandth);
    - splats: whose eighth neighbor is further away than 12 / 4^s medians of that distance over the field and
      than as many of its own radii;
    - splats: wider than 16 / 4^s medians and more transparent than 0.05 * 8^s.

    Raises CagefieldError for a strength outside [0, 1].
    """
    if not 0.0 <= strength <= 1.0:
        raise CagefieldError(f"the strength of floaters lies in [0, 1], not {strength:g}")
    if not len(elements):
        return np.zeros(0, bool)
    found = _in_small_clouds(elements, 10.0 ** (4.0 * strength - 5.0))
    if elements.kind == "splats":
        found |= _isolated(elements, 12.0 / 4.0**strength)
        wide = elements.sizes > 16.0 / 4.0**strength * np.median(elements.sizes)
        found |= wide & (elements.opacities < 0.05 * 8.0**strength)
    return found


def _in_small_clouds(elements: Elements, max_share: float) -> Mask:
    """[N], True in clouds with at most a share of the largest cloud's elements."""
    rows = np.flatnonzero(elements.in_grid)
    cells = tuple(elements.cells[rows].T)
    occupied = elements.occupancy >= CLOUD_OPACITY
    occupied[cells] = True
    labels, _ = ndimage.label(occupied, NEIGHBORS)
    cloud = labels[cells]
    found = np.zeros(len(elements), bool)
    if len(rows):
        counts = np.bincount(cloud)
        found[rows] = counts[cloud] <= max_share * counts.max()
    return found


def _isolated(elements: Elements, ratio: float) -> Mask:
    """[N], True for splats whose neighbor of NEIGHBOR_RANK is far away."""
    rank = min(NEIGHBOR_RANK, len(elements) - 1)
    if rank < 1:
        return np.zeros(len(elements), bool)
    distance = elements.tree.query(elements.positions, k=[rank + 1], workers=-1)[0][:, 0]
    return np.asarray((distance > ratio * np.median(distance)) & (distance > ratio * elements.radii))
