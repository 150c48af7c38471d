"""Free-form edits against parts that are bent, twisted or pulled in closed form, inside the inner cage.

In the shell between the cages an edit and a bent part differ by design: the part ends at its joint, the field
stays connected. Inside the inner cage they must agree, up to the smoothness of the lattice.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from benchmarks.common.cases import Case
from benchmarks.common.figures import pooled_psnr
from benchmarks.common.workbench import Workbench
from benchmarks.edits.edits_table import Inside
from benchmarks.edits.exact_maps import exact
from cagefield.cameras.camera import Camera
from cagefield.edits import SpaceMap
from cagefield.errors import CagefieldError
from cagefield.geometry.cage import Cage
from cagefield.procedural import ProceduralScene, procedural_scene
from cagefield.procedural.tracing import points_along_rays, trace
from cagefield.typing import AnyArray, Array, Mask


def inside_figures(
    case: Case,
    bench: Workbench,
    cameras: Sequence[Camera],
    unedited: AnyArray,
    edited: AnyArray,
    before: AnyArray,
) -> Inside:
    """Figures of a case from pictures [V,H,W,3] of the field, and photos `before` of the unedited scene."""
    still, deformed = procedural_scene(case.scene), deformed_scene(case)
    edits = case.edits
    inner, mapping = edits[-1].inner, exact(edits)
    was = np.stack([canonical_inside(inner, still, deformed, camera)[0] for camera in cameras])
    now, errors = [], []
    for camera in cameras:
        mask, points, canonical = canonical_inside(inner, deformed, deformed, camera)
        now.append(mask)
        errors.append(map_errors(mapping, points, canonical))
    mask, error = np.stack(now), np.concatenate(errors)
    return Inside(
        unedited=pooled_psnr(unedited, before, was),
        edited=pooled_psnr(edited, bench.deformed(case, cameras), mask),
        pixels=float(mask.mean()),
        mean_error=float(error.mean()),
        max_error=float(error.max()),
    )


def deformed_scene(case: Case) -> ProceduralScene:
    """The scene of a case in closed form. Raises CagefieldError for a case without one."""
    if case.deformed is None:
        raise CagefieldError(f"{case.scene} {case.name} has no truth in closed form")
    return case.deformed(procedural_scene(case.scene))


def canonical_inside(
    inner: Cage, scene: ProceduralScene, deformed: ProceduralScene, camera: Camera
) -> tuple[Mask, Array, Array]:
    """(pixels [H,W] that show a part that `deformed` changes inside the inner cage, points, canonical points
    [N,3] of these, world units) of a camera's picture of `scene`, which is `deformed` or the scene before.
    """
    changed = {
        part.name
        for part in deformed.parts
        if part.deformation is not None or (part.motion != np.eye(4)).any()
    }
    origins, directions = camera.rays()
    d = np.ascontiguousarray(directions.T, np.float32)
    origin = origins[0].astype(np.float64)
    hits = trace(scene.placed, origin, d)
    points = points_along_rays(origin, d, hits.t).astype(np.float64)
    canonical = points.copy()
    mask = np.zeros(points.shape[1], bool)
    for index, item in enumerate(scene.placed):
        rows = np.flatnonzero(hits.primitive == index)
        if item.part.name not in changed or not len(rows):
            continue
        back = np.linalg.inv(item.part.motion)
        p = back[:3, :3] @ points[:, rows] + back[:3, 3:]
        if item.part.deformation is not None:
            p = item.part.deformation.inverse(p)
        canonical[:, rows] = p
        mask[rows] = inner.contains(p.T)
    return mask.reshape(camera.height, camera.width), points.T[mask], canonical.T[mask]


def map_errors(mapping: SpaceMap, points: Array, canonical: Array) -> Array:
    """Distances [N], world units, of a map's canonical points from those [N,3] in closed form."""
    viewdirs = np.broadcast_to(np.array([0.0, 0.0, 1.0]), points.shape)
    mapped = mapping.to_canonical(points, viewdirs)
    error: Array = np.linalg.norm(np.asarray(mapped.points, np.float64) - canonical, axis=1)
    return error
