"""Alignment of a paste with the scene around it, by pairs of points and by the shapes of both."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from cagefield.edits import Paste
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
    from cagefield.scene.scene import Scene

MIN_SURFACE_OPACITY = 0.5
"""Minimum opacity of an element that counts as surface."""

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
) -> AlignedPaste:
    """A paste whose source points [N,3], in the other scene, come to points [N,3] of this scene.

    Its operations are replaced by a scaling, a rotation and a translation. `refine` then brings the surfaces
    of the pasted cage's content nearer to those of this scene (`refine_similarity`); `keep_scale` leaves the
    pairs' scale in that.

    Raises:
        CagefieldError: fewer than three pairs, points on a line, or a source that cannot be read.
    """
    similarity = fit_similarity(source_points, points)
    moved = similarity.transform_points(np.asarray(source_points, np.float64))
    residual = float(np.sqrt(((moved - np.asarray(points)) ** 2).sum(axis=1).mean()))
    refinement = None
    if refine:
        refinement = refine_similarity(
            _surface(scene.sources.read(str(edit.source)).field, edit),
            _surface(scene.field),
            similarity,
            keep_scale=keep_scale,
        )
        similarity = refinement.similarity
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


def _surface(field: object, edit: Paste | None = None) -> Array:
    """Positions [N,3] of the opaque elements of a field; of a paste's field those in its inner cage."""
    elements = elements_of_field(field)  # type: ignore[arg-type]
    is_opaque = elements.opacities >= MIN_SURFACE_OPACITY
    if edit is not None:
        is_opaque &= edit.inner.contains(elements.positions.astype(np.float64))
    if is_opaque.sum() < 3:
        where = "its cage holds no surface of the pasted scene" if edit is not None else "no surface is here"
        raise EditError(f"{where} to be aligned; align by the pairs alone")
    return elements.positions[is_opaque].astype(np.float64)
