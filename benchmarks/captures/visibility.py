"""Which surfaces of an edited scene were hidden before: by what was moved, or from all photos."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cagefield.cameras.camera import Camera
from cagefield.procedural.parts import Part, transform_vectors
from cagefield.procedural.scene import ProceduralScene
from cagefield.procedural.tracing import trace
from cagefield.typing import Mask

REACH = 0.008
"""A photo's ray may end within this distance of a surface, in world units: a voxel. It is followed to a point
so far above it: what is seen through a gap narrower than that, a pixel or less, no photo resolves."""


def unseen_pixels(
    moved: ProceduralScene,
    camera: Camera,
    photographed: ProceduralScene,
    photos: Sequence[Camera],
    where: Mask | None = None,
) -> Mask:
    """Pixels [H,W] of `moved` whose surface none of the photos of `photographed` showed.

    `moved` was made from `photographed` by moving, copying or removing parts; the ray through each pixel's
    center is followed to its surface, and that point of its part back to where the photos were taken. A photo
    shows it where its ray comes to REACH above it.
    Only pixels of the mask `where` [H,W] are tested; others, and those without a surface, are False.
    """
    shape = (camera.height, camera.width)
    pixels = np.flatnonzero(np.ones(shape, bool) if where is None else where)
    directions = transform_vectors(camera.c2w[:3, :3], camera.local_directions()[pixels].T)
    hits = trace(moved.placed, camera.origin, directions)
    met = np.flatnonzero(hits.primitive >= 0)
    points = camera.origin[:, None] + hits.t[met] * directions[:, met].astype(np.float64)
    normals = np.zeros_like(points)
    for index, placed in enumerate(moved.placed):
        rows = np.flatnonzero(hits.primitive[met] == index)
        instance = hits.instance[met[rows]]
        local = placed.local(np.ascontiguousarray(points[:, rows], np.float32), instance)
        normals[:, rows] = placed.world_gradient(placed.local_gradient(local, instance), instance)
        back = _original(placed.part, photographed).motion @ np.linalg.inv(placed.part.motion)
        points[:, rows] = back[:3, :3] @ points[:, rows] + back[:3, 3:]
        normals[:, rows] = np.linalg.inv(back[:3, :3]).T @ normals[:, rows]
    points += REACH * normals / np.maximum(np.linalg.norm(normals, axis=0), 1e-12)
    hidden = np.ones(len(met), bool)
    for photo in photos:
        rows = np.flatnonzero(hidden)
        if not len(rows):
            break
        at, depth = photo.project(points[:, rows].T)
        rows = rows[((at >= 0) & (at < (photo.width, photo.height))).all(axis=1) & (depth > 0)]
        toward = points[:, rows] - photo.origin[:, None]
        distance = np.linalg.norm(toward, axis=0)
        ends = trace(photographed.placed, photo.origin, (toward / distance).astype(np.float32)).t
        hidden[rows[ends > distance - REACH]] = False
    result = np.zeros(shape, bool)
    result.reshape(-1)[pixels[met[hidden]]] = True
    return result


def uncovered_pixels(moved: ProceduralScene, camera: Camera, before: ProceduralScene) -> Mask:
    """Pixels [H,W] of `moved` that show a surface which a part hid in `before` that was moved or removed.

    The ray through the pixel's center met that part, and now meets another.
    """
    known = {part.name: part for part in moved.parts}
    gone = {
        part.name
        for part in before.parts
        if part.name not in known or not np.array_equal(known[part.name].motion, part.motion)
    }
    directions = transform_vectors(camera.c2w[:3, :3], camera.local_directions().T)
    first, now = (trace(scene.placed, camera.origin, directions).primitive for scene in (before, moved))
    # the last name is that of no surface, whose index is -1
    names = np.array([item.part.name for item in before.placed] + [""])[first]
    others = np.array([item.part.name for item in moved.placed] + [""])[now]
    uncovered: Mask = np.isin(names, list(gone)) & (now >= 0) & (names != others)
    return uncovered.reshape(camera.height, camera.width)


def _original(part: Part, scene: ProceduralScene) -> Part:
    """The part of the scene that `part` was moved or copied from."""
    return next(known for known in scene.parts if known.primitives is part.primitives)
