"""Field under edits, evaluated at points of deformed space."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cagefield.edits import EditMap, SpaceMap
from cagefield.edits.grade import grade_colors
from cagefield.errors import FieldError
from cagefield.fields.protocol import Field
from cagefield.typing import Array, Float32


@dataclass(frozen=True, eq=False)
class EditedField:
    """A `Field` in deformed space: sigma(p) = |J d| sigma_c(p_c) of the canonical field along d.

    |J d| is 1 where `preserve_opacity` is False. sigma is 0 where an edit left nothing; the color there is
    the field's at the same point, for vertices of meshes that lie on a cut.

    Parameters
    - edits: the map, an `EditMap` in float64 or a `KernelMap` in float32.
    - bounds: box [2,3] of the edited field, see `edited_bounds`.

    Raises `FieldError` for a field that returns wrong shapes.
    """

    field: Field
    edits: SpaceMap
    bounds: NDArray[np.float64]
    preserve_opacity: bool = True

    def __call__(self, positions: Float32, viewdirs: Float32) -> tuple[Float32, Float32]:
        """(sigma [N], rgb [N,3]) at deformed positions [N,3] along unit viewdirs [N,3]."""
        mapped = self.edits.to_canonical(positions, viewdirs)
        if mapped.viewdirs is None or mapped.stretch is None:
            raise FieldError("edits.to_canonical must return viewdirs and stretch when it is given viewdirs")
        points, along = np.asarray(mapped.points, np.float32), np.asarray(mapped.viewdirs, np.float32)
        sigma, rgb = np.zeros(len(points), np.float32), np.zeros((len(points), 3), np.float32)
        for number, field in enumerate((self.field, *self.edits.layers)):
            rows = np.flatnonzero(mapped.layer == number)
            if len(rows):
                sigma[rows], rgb[rows] = evaluate(field, points[rows], along[rows])
                if self.preserve_opacity:
                    sigma[rows] *= np.asarray(mapped.stretch[rows], np.float32)
                if mapped.grade is not None:
                    sigma[rows] *= mapped.grade.density[rows].astype(np.float32)
                    rgb[rows] = grade_colors(rgb[rows], mapped.grade.colors[rows])
        emptied = np.flatnonzero((mapped.layer < 0) & np.isfinite(points).all(axis=1))
        if len(emptied):
            rgb[emptied] = evaluate(self.field, points[emptied], along[emptied])[1]
        return sigma, rgb


def evaluate(field: Field, points: Float32, viewdirs: Float32) -> tuple[Float32, Float32]:
    """(sigma [N], rgb [N,3]) of a field at points [N,3]. Raises `FieldError` for wrong shapes."""
    sigma, rgb = field(points, viewdirs)
    if sigma.shape != (len(points),) or rgb.shape != (len(points), 3):
        raise FieldError(
            f"field must return sigma [{len(points)}] and rgb [{len(points)}, 3], "
            f"not {list(sigma.shape)} and {list(rgb.shape)}"
        )
    return sigma, rgb


def edited_bounds(bounds: Array, edits: EditMap) -> NDArray[np.float64]:
    """The box [2,3] of a field's bounds and of all that active edits move somewhere else."""
    boxes = np.concatenate([bounds[None], *(step.boxes for step in edits.steps)])
    return np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])
