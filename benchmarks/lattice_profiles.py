"""Prints least det J and largest stretch of the lattice shell for several settings, over a set of edits.

python -m benchmarks.lattice_profiles
"""

from __future__ import annotations

import numpy as np

from cagefield.edits import Continuous, Edit
from cagefield.geometry.cage import Cage
from cagefield.warps import lattice_flow

ARM = Cage.box((0, 0, 0), (0.3, 0.3, 1.0)).subdivided((1, 1, 4))
CUBE = Cage.box((0, 0, 0), 0.6).subdivided((3, 3, 3))
NARROW, WIDE = Cage.box((0, 0, 0), (1.2, 1.2, 1.6)), Cage.box((0, 0, 0), 2.4)
ROOM = Cage.box((0, 0, 0), 1.6)
EDITS: dict[str, Continuous] = {
    "middle row": Edit.continuous(ARM, NARROW).move_points(range(8, 12), (0.25, 0, 0)),
    "bend 90": Edit.continuous(ARM, WIDE).bend("z", 0.5 * np.pi),
    "bend 180": Edit.continuous(ARM, WIDE).bend("z", np.pi),
    "bend 270": Edit.continuous(ARM, WIDE).bend("z", 1.5 * np.pi, fixed="middle"),
    "twist 180": Edit.continuous(ARM, NARROW).twist("z", np.pi),
    "twist 360": Edit.continuous(ARM, WIDE).twist("z", 2.0 * np.pi),
    "turn 90": Edit.continuous(CUBE, ROOM).rotate((0, 0, 0.5 * np.pi)),
    "90% of the gap": Edit.continuous(CUBE, ROOM).translate((0.45, 0, 0)),
    "scale 2": Edit.continuous(CUBE, ROOM).scale(2.0),
    "face points in": Edit.continuous(CUBE, ROOM).move_points((5, 6, 9, 10), (0, 0, -0.3)),
}
SETTINGS: dict[str, dict[str, float]] = {
    "as it is": {},
    "64 samples": {"MAX_LATTICE_SAMPLES": 64},
    "margin 0.7": {"MARGIN": 0.7},
    "margin 1.4": {"MARGIN": 1.4},
    "slope 0.5": {"SLOPE": 0.5},
    "slope 0.95": {"SLOPE": 0.95},
}


def measure(edit: Continuous) -> tuple[float, float]:
    """(least det J, largest stretch either way) of `to_deformed` around the lattice, at about 4000 points."""
    shell = edit.shell.build(edit.inner, edit.deformed, edit.outer)
    rng, (A, b), (origin, frame) = np.random.default_rng(1), edit.inner.affine, edit.outer.frame
    near = b + rng.uniform(-0.08, 1.08, (3000, 3)) @ A.T
    points = np.concatenate([origin + rng.random((1500, 3)) @ frame.T, near])
    points = points[edit.outer.contains(points) & ~edit.inner.contains(points)]
    J = shell.to_deformed(points)[1]
    s = np.linalg.svd(J, compute_uv=False)
    return float(np.linalg.det(J).min()), float(np.maximum(s[:, 0], 1.0 / s[:, 2]).max())


def main() -> None:
    """Print a line for each setting, then one for each edit."""
    for name, values in SETTINGS.items():
        before = {key: getattr(lattice_flow, key) for key in values}
        for key, value in values.items():
            setattr(lattice_flow, key, value)
        figures = np.array([measure(edit) for edit in EDITS.values()])
        for key, value in before.items():
            setattr(lattice_flow, key, value)
        det, stretch = np.exp(np.log(np.maximum(figures, 1e-4)).mean(axis=0))
        print(f"{name}: least det {det:.3f}, largest stretch {stretch:.1f} (geometric means)", flush=True)
        for edit, (least, most) in zip(EDITS, figures, strict=True):
            print(f"    {edit}: {least:.3f}, {most:.1f}")


if __name__ == "__main__":
    main()
