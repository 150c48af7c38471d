"""Cost of refreshing the flow shell's lattice during a drag, and the lattice's error.

    python -m benchmarks.flow_shell_nodes

A refresh is everything from the new edit to its packed lattice: checks, the cage's way, the kernel. "CPU" is
the process's time, all cores together, least over the rounds; the estimate is Python's share of it plus the
kernel's divided by the cores, which is what the wall shows on a machine that does nothing else. Voxels are
those of a grid of 256^3 a quarter wider than the outer cage. The edit is another one in each round.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.common.machine import Machine
from benchmarks.common.tables import Table, number, write_text
from cagefield.compute import devices
from cagefield.edits import Edit, EditStack
from cagefield.edits.device.edit_lattice import LATTICE_STRAIN
from cagefield.edits.device_stack import DeviceStack
from cagefield.edits.operations import (
    MoveCorner,
    MoveEdge,
    MoveFace,
    Operation,
    Rotate,
    Scale,
    Shear,
    Translate,
)
from cagefield.geometry.cage import Cage
from cagefield.warps import FlowShell
from cagefield.warps.continuous import ContinuousWarp
from cagefield.warps.flow_table import table

BOX, OUTER = Cage.box((0, 0, 0), 0.6), Cage.box((0, 0, 0), 1.6)
BENT = Cage.box((0.1, 0, 0), 0.6, (0.05, 0.1, 0.1)).move_corner(2, (-0.15, 0.15, -0.1))
BENT_OUTER = OUTER.move_corner(3, (0.3, 0.2, -0.1)).move_corner(4, (-0.2, 0.1, -0.3))
ROD, SLOT = Cage.box((0, 0, 0), (1.2, 0.3, 0.3)), Cage.box((0, 0, 0), (1.6, 0.8, 0.8))
VOXEL = 1.25 * 1.6 / 255

EDITS: dict[str, Edit] = {
    "translation": Edit.continuous(BOX, OUTER).translate((0.2, 0.1, 0)),
    "turn by 45 degrees": Edit.continuous(BOX, OUTER).rotate((0, 0, np.pi / 4)),
    "turn by 90 degrees": Edit.continuous(BOX, OUTER).rotate((0, 0, np.pi / 2)),
    "turn by 180 degrees": Edit.continuous(BOX, OUTER).rotate((0, 0, np.pi)),
    "scale by 2": Edit.continuous(BOX, OUTER).scale(2.0),
    "rod turned by 180 degrees in a slot": Edit.continuous(ROD, SLOT).rotate((0, 0, np.pi)),
    "corner dragged": Edit.continuous(BOX, OUTER).move_corner(7, (0.2, 0.2, 0.1)),
    "edge dragged": Edit.continuous(BOX, OUTER).move_edge((3, 7), (0.2, 0.15, 0)),
    "corner dragged after a turn by 90": Edit.continuous(BOX, OUTER)
    .rotate((0.5, 0.2, 1.5))
    .move_corner(7, (0.1, -0.2, 0.1)),
    "bent outer cage, turn by 45": Edit.continuous(BOX, BENT_OUTER).rotate((0, 0, np.pi / 4)),
    "both bent, turn by 45": Edit.continuous(BENT, BENT_OUTER).rotate((0, 0, np.pi / 4)),
    "both bent, oblique turn, scale": Edit.continuous(BENT, BENT_OUTER)
    .rotate((1, 0.5, 1))
    .scale((0.9, 0.8, 1)),
}
REACHED: dict[str, tuple[Edit, Operation]] = {
    "translation": (Edit.continuous(BOX, OUTER), Translate((1.0, 0.2, 0))),
    "turn": (Edit.continuous(BOX, OUTER), Rotate((0, 0, 180))),
    "scale": (Edit.continuous(BOX, OUTER), Scale((4, 4, 4))),
    "shear": (Edit.continuous(BOX, OUTER), Shear(xy=3.0)),
    "corner": (Edit.continuous(BOX, OUTER), MoveCorner(7, (1, 1, 0.6))),
    "edge": (Edit.continuous(BOX, OUTER), MoveEdge((3, 7), (0.7, 0.6, 0.1))),
    "face": (Edit.continuous(BOX, OUTER), MoveFace("+x", (1, 0, 0))),
    "both bent, translation": (Edit.continuous(BENT, BENT_OUTER), Translate((1.0, 0.2, 0))),
    "both bent, turn": (Edit.continuous(BENT, BENT_OUTER), Rotate((0, 0, 180))),
    "both bent, corner": (Edit.continuous(BENT, BENT_OUTER), MoveCorner(7, (1, 1, 0.6))),
}


@dataclass(frozen=True)
class Cost:
    """Least milliseconds over the rounds: of the process, and by the wall clock."""

    cpu: float
    wall: float


def cost(action: Callable[[int], object], rounds: int) -> Cost:
    """The cost of an action that is told the round; one round before is not counted."""
    action(-1)
    times = []
    for round_ in range(rounds):
        process, wall = time.process_time(), time.perf_counter()
        action(round_)
        times.append((time.process_time() - process, time.perf_counter() - wall))
    cpu, wall = 1e3 * np.min(times, axis=0)
    return Cost(float(cpu), float(wall))


def nudged(edit: Edit, round_: int) -> Edit:
    """The edit with its cage moved on a little, so that nothing is known of it."""
    return edit.translate((0.0, 0.0, 1e-4 * (round_ + 2)))


def steps_of(edit: Edit) -> FlowShell:
    """The checked edit's shell with the steps of its lattice: all that is done before the kernel."""
    warp = edit.exact_warp
    assert isinstance(warp, ContinuousWarp) and isinstance(warp.shell, FlowShell)
    return warp.shell.with_strain(LATTICE_STRAIN)


def refresh_row(name: str, edit: Edit, rounds: int, cores: int) -> tuple[str, ...]:
    """Cost and error at 32^3 and 64^3."""
    cells = [name]
    before = cost(lambda n: nudged(edit, n).check(), rounds)
    for nodes in (32, 64):
        lattice = edit.replace(lattice=nodes)
        full = cost(lambda n, e=lattice: DeviceStack.from_stack(EditStack([nudged(e, n)])), rounds)  # type: ignore[misc]
        serial = cost(lambda n, e=lattice: table(steps_of(nudged(e, n))), rounds).cpu  # type: ignore[misc]
        serial = min(serial, full.cpu)
        worst, mean = (error / VOXEL for error in edit.lattice_error(nodes))
        cells += [
            number(full.cpu, 1),
            number(serial + (full.cpu - serial) / cores, 1),
            number(full.wall, 1),
            f"{number(worst, 2)} / {number(mean, 3)}",
        ]
    return (*cells, number(before.cpu, 1))


def chain_rows(rounds: int) -> list[tuple[str, ...]]:
    """A refresh of one edit alone, and of one in a stack of ten."""
    rows = []
    for nodes in (32, 64):
        chain = EditStack(
            EDITS["turn by 45 degrees"].rotate((0, 0, 0.01 * n)).replace(lattice=nodes) for n in range(10)
        )

        def refresh(n: int, stack: EditStack) -> None:
            at = len(stack) // 2
            DeviceStack.from_stack(stack.set(at, nudged(stack[at], n)))

        for stack, name in ((EditStack([chain[5]]), "alone"), (chain, "one of ten in the same outer cage")):
            spent = cost(lambda n, s=stack: refresh(n, s), rounds)  # type: ignore[misc]
            rows.append((name, f"{nodes}^3", number(spent.cpu, 1), number(spent.wall, 1)))
    return rows


def main() -> None:
    """Measure, show, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("-o", "--out", type=Path, default=Path("benchmarks/results/flow_shell_nodes.md"))
    options = parser.parse_args()
    devices.start("cpu")
    cores = devices.threads()
    machine = f"Machine: {Machine.here()}"
    command = (
        "Command: `python -m benchmarks.flow_shell_nodes`. CPU: milliseconds of all cores together, least of "
    )
    command += f"{options.rounds} rounds; wall: while the machine did other things, too."
    measured = ("CPU", "estimate", "wall", "voxels")
    columns = ("edit", *(f"{nodes}: {name}" for nodes in ("32^3", "64^3") for name in measured))
    tables = [
        Table(
            "Refresh of a flow lattice",
            (*columns, "check CPU"),
            tuple(refresh_row(name, edit, options.rounds, cores) for name, edit in EDITS.items()),
            (
                "Aims on two cores: 32^3 in 15 ms, 64^3 in 150 ms. The estimate is for an idle machine: "
                f"what runs on one core, and the kernel's share divided by {cores}.",
                "Voxels: largest and mean error of the lattice against the exact map in the shell, in voxels "
                "of a 256^3 grid that is a quarter wider than the outer cage.",
            ),
        ),
        Table(
            "Refresh in a stack",
            ("edit", "lattice", "CPU", "wall"),
            tuple(chain_rows(options.rounds)),
            ("Milliseconds to pack the stack after one edit's change.",),
            names=2,
        ),
        Table(
            "How far an operation may go",
            ("operation", "safe fraction", "CPU"),
            tuple(
                (
                    name,
                    number(edit.safe_fraction(operation), 4),
                    number(cost(lambda _, e=edit, o=operation: e.safe_fraction(o), options.rounds).cpu, 1),  # type: ignore[misc]
                )
                for name, (edit, operation) in REACHED.items()
            ),
            ("Milliseconds of `Edit.safe_fraction`, right to 1e-3.", machine, command),
        ),
    ]
    for each in tables:
        each.show()
    write_text(options.out, "\n".join(each.markdown() for each in tables))


if __name__ == "__main__":
    main()
