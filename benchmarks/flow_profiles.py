"""Prints least det J and largest stretch of the flow shell for several weights, over a fixed set of edits.

python -m benchmarks.flow_profiles

The edits are the nine continuous ones of `cagefield bench edits`, then fourteen of a box; the trilinear shell
is there to compare with.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from benchmarks.common.cases import CASES
from benchmarks.edits.compare_shells import continuous
from benchmarks.edits.distortion import shell_samples
from cagefield.edits import Edit
from cagefield.geometry.cage import Cage
from cagefield.typing import Array
from cagefield.warps import Falloff, FlowShell, TrilinearShell, flow_velocity
from cagefield.warps.extended_coordinates import Extended

BOX, OUTER = Cage.box((0, 0, 0), 0.6), Cage.box((0, 0, 0), 1.6)
ASIDE = Cage.box((0.25, -0.1, 0.1), 0.6, (0.2, 0.1, 0.3))
BENT = Cage.box((0.1, 0, 0), 0.6, (0.05, 0.1, 0.1)).move_corner(2, (-0.15, 0.15, -0.1))
BENT_OUTER = OUTER.move_corner(3, (0.3, 0.2, -0.1)).move_corner(4, (-0.2, 0.1, -0.3))
EDITS = {
    **{f"{c.scene} {c.name}": continuous(c) for c in CASES if c.kind == "continuous"},
    "turn 30": Edit.continuous(BOX, OUTER).rotate((0, 0, np.pi / 6)),
    "turn 90": Edit.continuous(BOX, OUTER).rotate((0, 0, np.pi / 2)),
    "turn 180": Edit.continuous(BOX, OUTER).rotate((0, 0, np.pi)),
    "oblique turn": Edit.continuous(BOX, OUTER).rotate((1.9, 0.5, 1.3)),
    "90% of the gap": Edit.continuous(BOX, OUTER).translate((0.45, 0, 0)),
    "into a corner": Edit.continuous(BOX, OUTER).translate((0.4, 0.4, -0.4)),
    "scale 0.3": Edit.continuous(BOX, OUTER).scale(0.3),
    "scale 2": Edit.continuous(BOX, OUTER).scale(2.0),
    "corner out": Edit.continuous(BOX, OUTER).move_corner(7, (0.3, 0.3, 0.3)),
    "corner in": Edit.continuous(BOX, OUTER).move_corner(7, (-0.16, -0.16, -0.16)),
    "shear": Edit.continuous(BOX, OUTER).shear(xy=0.6, zx=-0.4),
    "off center, turn 90": Edit.continuous(ASIDE, OUTER).rotate((0, 0, 1.57)),
    "bent cages": Edit.continuous(BENT, BENT_OUTER).rotate((1.0, 0.5, 1.0)).scale((0.9, 0.8, 1.0)),
    "turn in a slot": Edit.continuous(
        Cage.box((0, 0, 0), (1.2, 0.3, 0.3)), Cage.box((0, 0, 0), (1.6, 0.8, 0.8))
    ).rotate((0, 0, np.pi)),
}


SMOOTH = Falloff()


@dataclass(frozen=True)
class Rational(Falloff):
    """w = r^2 / (r^2 + (1 - r)^2) = 1 / (1 + q^2): no root where p is 2."""

    def weight(self, q: Array, coefficients: tuple[float, float]) -> tuple[Array, Array]:
        """(w, dw/dq)."""
        w = 1.0 / (1.0 + q * q)
        return w, -2.0 * q * w * w


@dataclass(frozen=True)
class Weight:
    """A weight: the norm's p, the falloff, and its coefficients where the shell does not choose them."""

    power: int = 4
    falloff: Falloff = SMOOTH
    coefficients: tuple[float, float] | None = None


def blended(linear: float) -> Weight:
    """g^2 (3 - 2 g) and the linear profile, mixed."""
    return Weight(coefficients=(linear, 1.0 - linear))


def ending(slope: float) -> Weight:
    """The smooth profile with the same slope at the outer cage for all edits."""
    return Weight(coefficients=(slope, 1.0 - slope * 17.0 / 18.0))


WEIGHTS: dict[str, Weight] = {
    "smooth": Weight(),
    "p=2": Weight(2),
    "p=8": Weight(8),
    "a=0": ending(0.0),
    "a=0.5": ending(0.5),
    "a=0.95": ending(0.95),
    "half linear": blended(0.5),
    "linear": Weight(falloff=Falloff("linear")),
    "p=2 rational": Weight(2, Rational()),
}


def measure(edit: Edit, weight: Weight | None) -> tuple[float, float]:
    """(least det J, largest stretch either way) of `to_deformed` at about 2000 points of the shell.

    Half of them are near the inner cage. Without a weight, of the trilinear shell.
    """
    assert edit.outer is not None
    shell: FlowShell | TrilinearShell
    if weight is None:
        shell = TrilinearShell(edit.inner, edit.deformed, edit.outer)
    else:
        flow_velocity.POWER = weight.power
        shell = FlowShell(edit.inner, edit.deformed, edit.outer, weight.falloff, strain=0.25)
        if weight.coefficients is not None:
            shell.__dict__["coefficients"] = weight.coefficients
    near = np.random.default_rng(0).uniform(-1.0, 1.0, (1000, 3))
    near *= np.linspace(1.0, 1.2, len(near))[:, None] / np.abs(near).max(axis=1, keepdims=True)
    p = Extended.from_cage(edit.deformed).points(near)
    p = p[edit.outer.contains(p) & ~edit.deformed.contains(p)]
    J = shell.to_canonical(np.concatenate([p, shell_samples(edit.deformed, edit.outer, 1000)]))[1]
    det = np.linalg.det(J)
    s = np.linalg.svd(J, compute_uv=False)
    if (det <= 0.0).any():
        return 0.0, np.inf
    return float(1.0 / det.max()), float(np.maximum(s[:, 0], 1.0 / s[:, 2]).max())


def main() -> None:
    """Print a row per edit and a column per weight."""
    names = ["trilinear", *WEIGHTS]
    print(f"{'least det J, largest stretch':24s}" + "".join(f"{name:>15s}" for name in names))
    logs = []
    for name, edit in EDITS.items():
        row = [measure(edit, weight) for weight in (None, *WEIGHTS.values())]
        logs.append(np.log(np.maximum(row, 1e-6)))
        print(f"{name:24s}" + "".join(f"{least:8.3f}{most:7.1f}" for least, most in row), flush=True)
    built_in = sum(case.kind == "continuous" for case in CASES)
    for what, part in (("geometric mean", logs), ("of the first nine", logs[:built_in])):
        means = np.exp(np.mean(part, axis=0))
        print(f"{what:24s}" + "".join(f"{least:8.3f}{most:7.2f}" for least, most in means))


if __name__ == "__main__":
    main()
