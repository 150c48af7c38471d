"""Random mesh cages and edits of them."""

from __future__ import annotations

import numpy as np
import trimesh

from cagefield.edits import Continuous, Edit
from cagefield.errors import CagefieldError
from cagefield.geometry.cage import Cage
from cagefield.geometry.mesh_cage import MeshCage
from cagefield.selection.mesh_decimation import decimate

KINDS = ("icosphere", "box", "cylinder", "decimated", "concave")


def random_mesh(rng: np.random.Generator, kind: str) -> MeshCage:
    """A mesh of about unit size, turned at random."""
    if kind == "icosphere":
        mesh = trimesh.creation.icosphere(int(rng.integers(0, 3)), 0.45)
    elif kind == "box":
        mesh = trimesh.creation.box(rng.uniform(0.3, 0.9, 3))
    elif kind == "cylinder":
        mesh = trimesh.creation.cylinder(rng.uniform(0.2, 0.4), rng.uniform(0.4, 0.9), sections=12)
    else:
        mesh = trimesh.creation.icosphere(2, 0.45)
    v, t = np.array(mesh.vertices), np.array(mesh.faces)
    if kind == "decimated":
        v, t = decimate(v, t.astype(np.int32), int(rng.integers(40, 200)))
    if kind == "concave":
        v *= (1.0 - 0.45 * np.cos(3.0 * np.arctan2(v[:, 1], v[:, 0])) ** 2)[:, None]
    cage = MeshCage(v, t)
    moved = cage.rotate(rng.normal(0.0, 1.0, 3)).translate(rng.uniform(-0.1, 0.1, 3))
    assert isinstance(moved, MeshCage)
    return MeshCage(moved.vertices, moved.triangles)


def random_mesh_edit(seed: int) -> Continuous:
    """A possible edit of a mesh in a box, one to three operations, each as far as it goes."""
    rng = np.random.default_rng(seed)
    inner = random_mesh(rng, KINDS[seed % len(KINDS)])
    outer = inner.grown(rng.uniform(0.2, 0.7))
    if rng.random() < 0.4:
        outer = Cage.box((0, 0, 0), rng.uniform(2.0, 2.8, 3), rng.uniform(-0.3, 0.3, 3))
    edit = Edit.continuous(inner, outer)
    for _ in range(rng.integers(1, 4)):
        for share in 0.6 ** np.arange(8):
            try:
                tried = _operated(edit, np.random.default_rng((seed, len(edit.operations))), float(share))
            except CagefieldError:
                continue
            if tried.is_possible:
                edit = tried
                break
    return edit


def _operated(edit: Continuous, rng: np.random.Generator, share: float) -> Continuous:
    kind, by = int(rng.integers(8)), share * rng.normal(0.0, 0.25, 3)
    count, axis = len(edit.inner.handles), "xyz"[int(rng.integers(3))]
    if kind == 0:
        return edit.translate(by)
    if kind == 1:
        return edit.rotate(5.0 * by)
    if kind == 2:
        return edit.scale(np.exp(by))
    if kind == 3:
        return edit.shear(xy=by[0], yz=by[1])
    if kind == 4:
        return edit.move_point(int(rng.integers(count)), by)
    if kind == 5:
        return edit.move_points([int(rng.integers(count))], by, radius=0.5)
    if kind == 6:
        return edit.bend(axis, share * rng.normal(0.0, 1.0))
    return edit.twist(axis, share * rng.normal(0.0, 1.5))
