"""Cost of refreshing a renderer for one edit of ten that share an outer cage, against that edit alone.

    python -m benchmarks.chain_refresh SCENE [-o benchmarks/results/chain_refresh.md]

A refresh is everything until a picture can be rendered: the edit's lattice, and where the edited field is
occupied. "Dragging" is what the editor does while the mouse moves (the coarse occupancy), "at rest" the fine
one. The two are refreshed in turn; each round moves the edit a little further.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

from benchmarks.common.machine import Machine
from benchmarks.common.tables import Table, number, write_text
from cagefield.compute import devices
from cagefield.edits import Edit, EditStack
from cagefield.geometry.cage import Cage
from cagefield.rendering.voxels.voxel_renderer import VoxelRenderer
from cagefield.scene.scene import Scene

WARM_UP = 3
DRAGGED = 4
"""Place of the edit that moves, in the chain."""


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scene", type=Path, help="scene folder; only its field is used")
    parser.add_argument("-n", "--rounds", type=int, default=25, help="refreshes counted of each kind")
    parser.add_argument("-o", "--out", type=Path, help="file for the table")
    args = parser.parse_args()
    devices.start("cpu")
    renderer = VoxelRenderer(Scene.open(args.scene).field)
    rows = []
    for name, coarse, lattice in (("dragging, lattice 32", True, 32), ("at rest, lattice 64", False, 64)):
        alone, of_ten = (1e3 * seconds for seconds in measured(renderer, coarse, lattice, args.rounds))
        ratio = float(np.median(of_ten / alone))
        times = (f"{number(float(np.median(each)), 1)} ms" for each in (alone, of_ten))
        rows.append((name, *times, f"x{number(ratio, 2)}"))
    table = Table(
        "One edit of ten in one outer cage",
        ("refresh", "alone", "of ten", "of ten / alone"),
        tuple(rows),
        (
            "Medians of wall times; the ratio is the median of the pairs'.",
            f"Machine: {Machine.here()}",
            "Command: `python -m benchmarks.chain_refresh SCENE`",
        ),
    )
    print(table.markdown())
    if args.out is not None:
        write_text(args.out, table.markdown())


def measured(
    renderer: VoxelRenderer, coarse: bool, lattice: int, rounds: int
) -> tuple[np.ndarray[tuple[int], np.dtype[np.float64]], np.ndarray[tuple[int], np.dtype[np.float64]]]:
    """Seconds [rounds] of each refresh of the edit alone, and of the chain."""
    chain = edits(renderer, lattice)
    kept = [renderer.with_edits(EditStack(stack), coarse=coarse) for stack in ([chain[DRAGGED]], chain)]
    step = 1e-3 * float(np.ptp(renderer.field.bounds, axis=0).max())
    seconds = np.zeros((2, WARM_UP + rounds))
    for n in range(WARM_UP + rounds):
        for which in range(2):
            # Nothing that one has computed can be of use to the other.
            edit = chain[DRAGGED].translate((step * (n + 1), 1e-3 * step * which, 0))
            stack = [edit] if which == 0 else [*chain[:DRAGGED], edit, *chain[DRAGGED + 1 :]]
            began = time.perf_counter()
            kept[which] = kept[which].with_edits(EditStack(stack), coarse=coarse)
            seconds[which, n] = time.perf_counter() - began
    return seconds[0, WARM_UP:], seconds[1, WARM_UP:]


def edits(renderer: VoxelRenderer, lattice: int) -> list[Edit]:
    """Ten edits about the middle of the field, in one outer cage of two thirds of it."""
    rng = np.random.default_rng(0)
    lower, upper = renderer.field.bounds
    middle, size = 0.5 * (lower + upper), upper - lower
    outer = Cage.box(middle, 0.66 * size)
    found = []
    for _ in range(10):
        inner = Cage.box(middle + rng.uniform(-0.12, 0.12, 3) * size, 0.12 * size)
        edit = Edit.continuous(inner, outer, lattice=lattice).translate(rng.uniform(-0.03, 0.03, 3) * size)
        found.append(edit.rotate(rng.uniform(-0.3, 0.3, 3)))
    return found


if __name__ == "__main__":
    main()
