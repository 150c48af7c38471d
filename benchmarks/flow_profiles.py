"""Prints least det J and largest stretch of the flow shell for several weights, over a fixed set of edits.

python benchmarks/flow_profiles.py
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cagefield.cages import Cage
from cagefield.edits import Edit
from cagefield.hexahedron import Array
from cagefield.warps import Falloff, FlowShell, flow_shell

BOX, OUTER = Cage.box((0, 0, 0), 0.6), Cage.box((0, 0, 0), 1.6)
ASIDE = Cage.box((0.25, -0.1, 0.1), 0.6, (0.2, 0.1, 0.3))
BENT = Cage.box((0.1, 0, 0), 0.6, (0.05, 0.1, 0.1)).move_corner(2, (-0.15, 0.15, -0.1))
BENT_OUTER = OUTER.move_corner(3, (0.3, 0.2, -0.1)).move_corner(4, (-0.2, 0.1, -0.3))
EDITS = {
    "turn 30": Edit(BOX, OUTER).rotate((0, 0, np.pi / 6)),
    "turn 90": Edit(BOX, OUTER).rotate((0, 0, np.pi / 2)),
    "turn 180": Edit(BOX, OUTER).rotate((0, 0, np.pi)),
    "oblique turn": Edit(BOX, OUTER).rotate((1.9, 0.5, 1.3)),
    "90% of the gap": Edit(BOX, OUTER).translate((0.45, 0, 0)),
    "into a corner": Edit(BOX, OUTER).translate((0.4, 0.4, -0.4)),
    "scale 0.3": Edit(BOX, OUTER).scale(0.3),
    "scale 2": Edit(BOX, OUTER).scale(2.0),
    "corner out": Edit(BOX, OUTER).move_corner(7, (0.3, 0.3, 0.3)),
    "corner in": Edit(BOX, OUTER).move_corner(7, (-0.16, -0.16, -0.16)),
    "shear": Edit(BOX, OUTER).shear(xy=0.6, zx=-0.4),
    "off centre, turn 90": Edit(ASIDE, OUTER).rotate((0, 0, 1.57)),
    "bent cages": Edit(BENT, BENT_OUTER).rotate((1.0, 0.5, 1.0)).scale((0.9, 0.8, 1.0)),
    "turn in a slot": Edit(Cage.box((0, 0, 0), (1.2, 0.3, 0.3)), Cage.box((0, 0, 0), (1.6, 0.8, 0.8))).rotate(
        (0, 0, np.pi)
    ),
}


@dataclass(frozen=True)
class Rational(Falloff):
    """w = r^2 / (r^2 + (1 - r)^2) = 1 / (1 + q^2): no root where p is 2."""

    def weight(self, q: Array) -> tuple[Array, Array]:
        """(w, dw/dq)."""
        w = 1.0 / (1.0 + q * q)
        return w, -2.0 * q * w * w


WEIGHTS: dict[str, tuple[int, Falloff]] = {
    "p=2 smooth": (2, Falloff()),
    "p=4 smooth": (4, Falloff()),
    "p=8 smooth": (8, Falloff()),
    "p=2 linear": (2, Falloff("linear")),
    "p=8 linear": (8, Falloff("linear")),
    "p=2 rational": (2, Rational()),
}


def measure(edit: Edit, falloff: Falloff) -> tuple[float, float]:
    """(least det J, largest stretch either way) of `to_deformed` at 1500 points of the shell."""
    assert edit.outer is not None
    shell = FlowShell(edit.inner, edit.deformed, edit.outer, falloff, strain=0.25)
    origin, frame = edit.outer.frame
    p = origin + np.random.default_rng(0).random((1500, 3)) @ frame.T
    p = p[edit.outer.contains(p)]
    J = shell.to_canonical(p[~edit.deformed.contains(p)])[1]
    s = np.linalg.svd(J, compute_uv=False)
    return float(1.0 / np.linalg.det(J).max()), float(np.maximum(s[:, 0], 1.0 / s[:, 2]).max())


def main() -> None:
    """Print a row per edit and a column per weight."""
    print(f"{'least det J, largest stretch':30s}" + "".join(f"{name:>16s}" for name in WEIGHTS))
    logs = []
    for name, edit in EDITS.items():
        row = []
        for power, falloff in WEIGHTS.values():
            flow_shell.POWER = power
            row.append(measure(edit, falloff))
        logs.append(np.log(np.maximum(row, 1e-6)))
        print(f"{name:30s}" + "".join(f"{least:8.3f}{most:8.2f}" for least, most in row), flush=True)
    means = np.exp(np.mean(logs, axis=0))
    print(f"{'geometric mean':30s}" + "".join(f"{least:8.3f}{most:8.2f}" for least, most in means))


if __name__ == "__main__":
    main()
