"""Alignment of a paste with the scene around it, by pairs of points and by the shapes of both."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from cagefield.edits import Paste
from cagefield.edits.grade import Grade
from cagefield.edits.operations import Rotate, Scale, Translate
from cagefield.errors import EditError
from cagefield.geometry.point_alignment import (
    RefinedSimilarity,
    Similarity,
    fit_similarity,
    refine_similarity,
)
from cagefield.selection.field_elements import elements_of_field
from cagefield.typing import Array

if TYPE_CHECKING:
    from cagefield.fields.splat_field import SplatField
    from cagefield.fields.voxel_field import VoxelField
    from cagefield.scene.scene import Scene

MIN_SURFACE_OPACITY = 0.5
"""Minimum opacity of an element that counts as surface."""

MIN_MATCHED_COLOR = 0.03
"""Minimum value of a channel whose ratio counts for a match of colors."""

MAX_MATCHED_ELEMENTS = 20_000
"""Maximum number of elements whose colors are compared."""

MATCHED_QUANTILE = 0.7
"""Share of the elements, the nearest to those of the scene, whose colors are compared."""

REACH_RESIDUALS, REACH_SHARE = 4.0, 0.03
"""Maximum distance between surfaces of both scenes that are held for one, after the pairs: so many times the
pairs' distance, and at least a share of the diagonal of the pasted content."""

_DECIMALS = 9
"""Decimals of operations, as a person would read them."""


@dataclass(frozen=True, eq=False)
class AlignedPaste:
    """The aligned edit; residual: root mean square of the pairs' distances, world units of the scene.

    refinement: the fit of the shapes, None where only the pairs were fitted.
    """

    edit: Paste
    residual: float
    refinement: RefinedSimilarity | None


def align_paste(
    scene: Scene,
    edit: Paste,
    source_points: ArrayLike,
    points: ArrayLike,
    *,
    refine: bool = False,
    keep_scale: bool = False,
    match_colors: bool = False,
) -> AlignedPaste:
    """A paste whose source points [N,3], in the other scene, come to points [N,3] of this scene.

    Its operations are replaced by a scaling, a rotation and a translation. `refine` then brings the surfaces
    of the pasted cage's content nearer to those of this scene (`refine_similarity`); `keep_scale` leaves the
    pairs' scale in that. `match_colors` replaces the edit's grade by the exposure and white balance of the
    median ratio of colors between elements of this scene and those of the other that come beside them. Of
    both scenes only surfaces that the pairs bring side by side count.

    Raises:
        CagefieldError: fewer than three pairs, points on a line, or a source that cannot be read.
    """
    source = scene.sources.read(str(edit.source)).field if refine or match_colors else None
    similarity = fit_similarity(source_points, points)
    moved = similarity.transform_points(np.asarray(source_points, np.float64))
    residual = float(np.sqrt(((moved - np.asarray(points)) ** 2).sum(axis=1).mean()))
    refinement = None
    if source is not None:
        theirs, ours = _surface(source, edit), _surface(scene.field)
        extent = float(np.linalg.norm(np.ptp(similarity.transform_points(theirs.positions), axis=0)))
        reach = max(REACH_RESIDUALS * residual, REACH_SHARE * extent)
        if refine:
            refinement = refine_similarity(
                theirs.positions, ours.positions, similarity, keep_scale=keep_scale, reach=reach
            )
            similarity = refinement.similarity
        if match_colors:
            edit = edit.replace(grading=Grade.from_gains(_gains(theirs, ours, similarity, reach)))
    return AlignedPaste(placed(edit, similarity), residual, refinement)


def placed(edit: Paste, similarity: Similarity) -> Paste:
    """The paste with the operations that take its inner cage where a similarity takes it."""
    edit = edit.replace(operations=())
    if (scale := float(f"{similarity.scale:.9g}")) != 1.0:
        edit = edit.then(Scale.from_factors(scale))
    rotation = Rotate.from_rotation(Rotation.from_matrix(similarity.rotation))
    if any(rotation.degrees):
        edit = edit.then(rotation)
    goal = similarity.transform_points(edit.inner.corners).mean(axis=0)
    x, y, z = np.round(goal - edit.deformed.corners.mean(axis=0), _DECIMALS).tolist()
    return edit.then(Translate((x, y, z)))


@dataclass(frozen=True, eq=False)
class _Surface:
    """Opaque elements: positions [N,3], canonical space, and display-encoded colors [N,3]."""

    positions: Array
    rgb: Array


def _surface(field: VoxelField | SplatField, edit: Paste | None = None) -> _Surface:
    """The opaque elements of a field; of a paste's field those in its inner cage."""
    elements = elements_of_field(field)
    is_opaque = elements.opacities >= MIN_SURFACE_OPACITY
    if edit is not None:
        is_opaque &= edit.inner.contains(elements.positions.astype(np.float64))
    if is_opaque.sum() < 3:
        where = "its cage holds no surface of the pasted scene" if edit is not None else "no surface is here"
        raise EditError(f"{where} to be aligned; align by the pairs alone")
    return _Surface(
        elements.positions[is_opaque].astype(np.float64), elements.rgb[is_opaque].astype(np.float64)
    )


def _gains(theirs: _Surface, ours: _Surface, similarity: Similarity, reach: float, *, seed: int = 0) -> Array:
    """Median ratios [3] of our colors to theirs, of elements that a similarity brings side by side.

    Raises CagefieldError where none comes within `reach` of ours.
    """
    tree = cKDTree(ours.positions)
    distance, nearest = tree.query(similarity.transform_points(theirs.positions), workers=-1)
    rows = np.flatnonzero(distance <= reach)
    if len(rows) == 0:
        raise EditError(
            "the pairs bring none of the surfaces side by side; match no colors, or choose better ones"
        )
    if len(rows) > MAX_MATCHED_ELEMENTS:
        rows = np.random.default_rng(seed).choice(rows, MAX_MATCHED_ELEMENTS, replace=False)
    distance, nearest = distance[rows], nearest[rows]
    count = max(1, int(MATCHED_QUANTILE * len(rows)))
    near = np.argpartition(distance, count - 1)[:count]
    theirs_rgb, ours_rgb = theirs.rgb[rows[near]], ours.rgb[nearest[near]]
    gains = np.ones(3)
    for channel in range(3):
        a, b = theirs_rgb[:, channel], ours_rgb[:, channel]
        bright = (a > MIN_MATCHED_COLOR) & (b > MIN_MATCHED_COLOR)
        if bright.any():
            gains[channel] = np.exp(np.median(np.log(b[bright] / a[bright])))
    return gains
