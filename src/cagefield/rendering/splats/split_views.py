"""Split splats by view: one is drawn whole again where the pixels are too coarse to show its children.

Children stand for a splat that an edit bends or cuts (`splitting`), at any distance. Where a pixel covers
more than the group's size (`kernels.split_sizes`) the picture of the splat, as the edit's affine part at its
mean takes it, differs from theirs by little, and is drawn instead: once in place of many times, and
widened by the pixel's filter once, as the splats around it. The choice is made for each view on CPUs; GPUs,
discs, clusters, pages and files have all children.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cagefield.edits import EditMap
from cagefield.rendering.splats.kernels.splat_args import CameraArgs
from cagefield.rendering.splats.kernels.split_sizes import sizes_of
from cagefield.rendering.splats.raster_splats import DeformedSplats, Places, deformed_splats, deformed_where
from cagefield.rendering.splats.splat_motion import moved_splats
from cagefield.rendering.splats.splat_provenance import SplatSet
from cagefield.rendering.splats.splitting import Split
from cagefield.typing import Float32, Mask

LIMIT = 0.05
"""Root of the integral over the picture, in pixels, of the squared difference of two alphas, by the root of
the number of splats that need not be drawn: so the error of a picture is the least for their number."""

MOST_ROWS = 64
"""Groups of more children and parents have no size: these are always split."""


@dataclass(frozen=True, eq=False)
class SplitViews:
    """Splats with children and, behind these, parents, of which a view draws the one or the other.

    Attributes:
        splats: the M splats that are in every view, C children, and P parents.
        count: M.
        starts, rows: group g has the children and parents rows[starts[g]:starts[g+1]] of those C + P.
        groups: [C + P], the group of each.
        is_parent: [C + P].
        sizes: [G], world units: larger pixels show parents.
        places: [3, C + P], means of the children and parents in the order of `rows`.
    """

    splats: DeformedSplats
    count: int
    starts: NDArray[np.int64]
    rows: NDArray[np.int64]
    groups: NDArray[np.int64]
    is_parent: Mask
    sizes: Float32
    places: Float32

    def split(self) -> DeformedSplats:
        """The splats of every view, and all children."""
        kept = slice(self.count + int(np.count_nonzero(~self.is_parent)))
        every = self.splats
        return DeformedSplats(
            every.means[kept],
            every.covariances[kept],
            every.opacities[kept],
            every.sh[kept],
            None if every.rotations is None else every.rotations[kept],
            every.antialiased,
            None if every.tangents is None else every.tangents[kept],
        )

    def chosen(self, view: CameraArgs) -> Mask:
        """[C + P], True for the children and parents that a view draws."""
        toward = view.world_to_camera[2].astype(np.float32)
        x, y, z = self.places
        depths = x * toward[0] + y * toward[1] + z * toward[2]
        nearest = np.minimum.reduceat(depths, self.starts[:-1]) - np.float32(
            view.world_to_camera[2] @ view.origin
        )
        is_split = nearest < self.sizes * np.float32(view.focal.max())
        return np.asarray(is_split[self.groups] != self.is_parent)


def split_views(
    splats: SplatSet,
    edits: EditMap,
    split: Split,
    *,
    preserve_opacity: bool = True,
    proceed: Callable[[], None] | None = None,
) -> SplitViews:
    """Splats under edits, those of a split both with children and whole; as `deformed_splats`.

    Raises:
        EditError: an edit that cannot be evaluated.
    """
    splats = splats.with_pastes(edits)
    moved = moved_splats(splats, edits, proceed=proceed)
    others = moved_splats(split.children, edits, proceed=proceed)
    whole = moved.without(~split.parents)
    children = deformed_where(split.children.field, others, preserve_opacity)
    parents = deformed_where(splats.field, whole, preserve_opacity)
    every = deformed_splats(
        splats, edits, preserve_opacity=preserve_opacity, split=split, whole=parents, proceed=proceed
    )
    numbers = np.concatenate([split.sources[Places(others).rows], Places(whole).rows])
    is_parent = np.repeat([False, True], [len(children), len(parents)])
    _, groups = np.unique(numbers, return_inverse=True)
    rows = np.argsort(groups, kind="stable")
    starts = np.searchsorted(groups[rows], np.arange(groups.max(initial=-1) + 2))
    sizes = np.empty(len(starts) - 1, np.float32)
    count = len(every) - len(numbers)
    weights = np.where(is_parent, -1.0, 1.0).astype(np.float32) * every.opacities[count:]
    spared = np.bincount(groups, np.where(is_parent, -1, 1), len(sizes))
    limits = LIMIT * np.sqrt(np.maximum(spared, 1.0))
    sizes_of(starts, rows, every.means[count:], every.covariances[count:], weights, limits, MOST_ROWS, sizes)
    places = np.ascontiguousarray(every.means[count:][rows].T)
    return SplitViews(every, count, starts, rows, groups, is_parent, sizes, places)
