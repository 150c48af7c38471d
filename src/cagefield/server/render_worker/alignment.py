"""Dominant plane of a scene, and alignment of pastes with it, in the rendering process."""

from __future__ import annotations

import numpy as np

from cagefield.edits import Paste
from cagefield.scene.alignment import dominant_plane
from cagefield.scene.paste_alignment import align_paste
from cagefield.scene.scene import Scene
from cagefield.server.render_worker.tasks import AlignTask, EditValues, FloorTask


def floor_of(scene: Scene, task: FloorTask) -> tuple[list[float], float] | None:
    """(unit normal [3], share of the surfaces) of the dominant plane; None where none is nearly level."""
    surface = scene.patcher.visible_surfels
    plane = dominant_plane(surface.points, surface.normals, task.up, scene.field.sample_spacing)
    return None if plane is None else (plane.normal.tolist(), plane.share)


def aligned_paste(scene: Scene, task: AlignTask) -> tuple[EditValues, float, tuple[float, float] | None]:
    """(aligned edit, distance of the pairs, distances of the surfaces before and after), world units.

    The pairs' distance is a root mean square, those of the surfaces are medians, None without `refine`.
    Raises CagefieldError for points on a line, and where nothing is there to be brought nearer.
    """
    edit = task.edit.edit()
    assert isinstance(edit, Paste)  # nothing else is asked for
    found = align_paste(
        scene,
        edit,
        np.array(task.source_points),
        np.array(task.points),
        refine=task.refine,
        keep_scale=task.keep_scale,
        match_colors=task.match_colors,
    )
    fit = found.refinement
    distances = None if fit is None else (fit.distance_before, fit.distance)
    return EditValues.from_edit(found.edit), found.residual, distances
