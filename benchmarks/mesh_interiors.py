"""Prints how well each interior of a mesh cage bends an arm: the map against the closed-form bend.

python -m benchmarks.mesh_interiors

The vertices of a cylinder go where `procedural.deformations.Bend` takes them; inside, the map should do that
too. Distances are shares of the arm's radius.
"""

from __future__ import annotations

import numpy as np

from cagefield.edits import Edit, MovePoint
from cagefield.errors import CagefieldError
from cagefield.geometry.cage import Cage
from cagefield.geometry.mesh_cage import INTERIORS, MeshCage
from cagefield.procedural.deformations import Bend
from cagefield.typing import Array

RADIUS, LENGTH, RINGS, AROUND = 0.2, 1.2, 9, 12


def arm(interior: str) -> MeshCage:
    """A closed cylinder along z, of rings of vertices."""
    angles = 2.0 * np.pi * np.arange(AROUND) / AROUND
    rings = [
        [(RADIUS * np.cos(a), RADIUS * np.sin(a), z) for a in angles]
        for z in np.linspace(-LENGTH / 2, LENGTH / 2, RINGS)
    ]
    v = np.concatenate([np.reshape(rings, (-1, 3)), [(0, 0, -LENGTH / 2), (0, 0, LENGTH / 2)]])
    bottom, top, last = len(v) - 2, len(v) - 1, (RINGS - 1) * AROUND
    t: list[tuple[int, int, int]] = []
    for k in range(AROUND):
        n = (k + 1) % AROUND
        t += [(bottom, n, k), (top, last + k, last + n)]
        for ring in range(RINGS - 1):
            i, j = ring * AROUND + k, ring * AROUND + n
            t += [(i, j, i + AROUND), (j, j + AROUND, i + AROUND)]
    return MeshCage(v, t, interior=interior)


def truth(angle: float, points: Array) -> Array:
    """Points [N,3] of the arm bent towards +x by an angle in radians, from its lower end on."""
    bend = Bend(start=(0, 0, -LENGTH / 2), axis=(0, 0, 1), towards=(1, 0, 0), length=LENGTH, angle=angle)
    return np.asarray(bend.forward(points.T).T)


def main() -> None:
    """Print a line for each angle and interior."""
    rng = np.random.default_rng(0)
    a, r = rng.uniform(0, 2 * np.pi, 2000), 0.9 * RADIUS * np.sqrt(rng.random(2000))
    z = rng.uniform(-0.47 * LENGTH, 0.47 * LENGTH, 2000)
    points = np.stack([r * np.cos(a), r * np.sin(a), z], axis=1)
    for degrees in (20, 45, 70):
        for interior in INTERIORS:
            cage = arm(interior)
            by = truth(np.radians(degrees), cage.vertices) - cage.vertices
            edit = Edit.continuous(cage, Cage.box((0.2, 0, 0), 2.6))
            edit = edit.replace(operations=[MovePoint(k, tuple(step)) for k, step in enumerate(by)])
            try:
                off = edit.exact_warp.to_deformed(points).points - truth(np.radians(degrees), points)
            except CagefieldError as error:
                print(f"{degrees} degrees, {interior}: {error}", flush=True)
                continue
            distance = np.linalg.norm(off, axis=1) / RADIUS
            print(
                f"{degrees} degrees, {interior}: mean {distance.mean():.3f}, largest {distance.max():.3f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
