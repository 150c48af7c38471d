"""The edits of a scene on their way along its camera path, as a page shows them, and how exactly."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from cagefield.cameras.keyframes import Keyframe, Timeline
from cagefield.completion.patch_stages import PatchStage
from cagefield.completion.patcher import Patcher
from cagefield.edits import Continuous, Delete, EditStack, PreparedEdit, PreparedStack
from cagefield.edits.chains import application_order
from cagefield.edits.mirror import mirrored_axes
from cagefield.edits.partial_edit import partial_edit
from cagefield.edits.patch import Patch, SplatPatch
from cagefield.errors import EditError
from cagefield.pages.page_edits import LATTICE, for_pages
from cagefield.pages.page_path import PathState, encode_page_path, joined_occupancy, mixable, mixed
from cagefield.rendering.voxels.occupancy import Occupancy
from cagefield.rendering.voxels.voxel_renderer import VoxelRenderer

STATES_A_SECOND = 12.0
"""Where edits move; the page goes straight between two. A quarter turn in two seconds is 4 degrees a state:
chords are .0006 of the radius beside the circle."""

MOST_STATES = 120
"""Longer motions have fewer states a second."""

BUDGET = 8 << 20
"""Bytes of nodes that move, before they are compressed to about a third."""

SIZES = (LATTICE, 48, 32, 24, 16)
"""Nodes an axis of the lattices of edits that move: the most that fit into the budget."""

LEAST = 1e-3
"""Part that replaces 0, so that an edit before its start has all its numbers too, almost at the identity."""

PROBES = 4000
"""Points at which the page's edits are compared with the exact ones, half-way between two states."""


@dataclass(frozen=True)
class PathEdits:
    """Edits along a path in a page: the file, the number of states, the nodes per axis of lattices (None for
    splats).

    `error` is the distance (mean, 99th percentile) of points half-way between states from where the stack of
    that moment, with the lattices of `for_pages`, takes them, in world units.
    """

    data: bytes
    states: int
    nodes: int | None
    error: tuple[float, float]
    split: bool = False
    """Whether splats are split on the way as the whole edits split them."""


def path_edits(
    renderer: VoxelRenderer,
    edits: EditStack,
    keys: Sequence[Keyframe],
    loop: bool,
    patcher: Patcher,
    *,
    on_progress: Callable[[float], None] = lambda done: None,
) -> PathEdits | None:
    """The states of `edits` along the path of `keys`; None where all of them have gone all the way all along.

    `renderer` draws the field. `on_progress` is told the share that is done. Raises EditError for an edit
    that is not possible at a part that is shown.

    Of an edit in motion, `patcher` fills the uncovered region after its start, and takes its light along at
    its end: a patch of every state would take some hundred KB each.
    """
    if len(keys) < 2:
        return None
    edits, keys = in_application_order(edits, keys)
    line = Timeline(keys, loop=loop)
    times = state_times(line, edits, MOST_STATES)
    if times is None:
        return None
    kept = renderer.preserve_opacity
    on_way = for_pages(patcher.prepare(edits.edits, stage=PatchStage.INPAINTED, preserve_opacity=kept))
    whole = for_pages(patcher.prepare(edits.edits, preserve_opacity=kept, relight_continuous=False))
    knots = [parts_at(line, edits, t) for t in times]
    unique = list(dict.fromkeys(knots))
    moving = [n for n in range(len(edits)) if len({parts[n] for parts in unique}) > 1]
    shells = [n for n in moving if isinstance(edits[n], Continuous)]
    lattices = sum(len({parts[n] for parts in unique}) for n in shells)
    nodes = next((r for r in SIZES if 6 * r**3 * lattices <= BUDGET), SIZES[-1])
    stacks = {parts: stack_at(whole, parts, moving, nodes, on_way) for parts in unique}
    middles = [k for k in range(len(knots) - 1) if knots[k] != knots[k + 1]]
    total = len(stacks) + len(middles)
    states = {parts: PathState.from_edits(stack) for parts, stack in stacks.items()}
    found: list[Occupancy] = []
    errors: list[NDArray[np.float64]] = []
    for stack in stacks.values():
        renderer = renderer.with_edits(stack)
        found.append(renderer.occupancy)
        on_progress(len(found) / total)
    for k in middles:
        middle = stack_at(whole, parts_at(line, edits, 0.5 * (times[k] + times[k + 1])), (), nodes, on_way)
        renderer = renderer.with_edits(middle)
        found.append(renderer.occupancy)
        one, other = states[knots[k]], states[knots[k + 1]]
        if mixable(one, other):
            errors.append(_distances(PathState.from_edits(middle), one, other))
        on_progress(len(found) / total)
    data = encode_page_path(
        renderer.field,
        times,
        [unique.index(parts) for parts in knots],
        list(states.values()),
        joined_occupancy(found),
        preserve_opacity=renderer.preserve_opacity,
    )
    off = np.concatenate(errors) if errors else np.zeros(1)
    return PathEdits(data, len(unique), nodes, (float(off.mean()), float(np.percentile(off, 99))))


def in_application_order(edits: EditStack, keys: Sequence[Keyframe]) -> tuple[EditStack, list[Keyframe]]:
    """The stack in the order of application, without parents, and keyframes whose parts have its numbers.

    Parts of edits that are not in the stack are left out: nothing shows them. Raises EditError for parents
    that are not possible.
    """
    numbers = {old + 1: new for new, old in enumerate(application_order(edits.edits), start=1)}
    renumbered = [
        replace(key, parts={numbers[old]: part for old, part in key.parts.items() if old in numbers})
        for key in keys
    ]
    return EditStack(edits.resolved), renumbered


Parts = tuple[float, ...]


def state_times(line: Timeline, edits: EditStack, most: int) -> list[float] | None:
    """Seconds at which states are taken, at most so many: where edits move, and where they begin and end to.

    None where all edits have gone all the way all along.
    """
    count = max(2, round(line.seconds * STATES_A_SECOND) + 1)
    while True:
        at = np.linspace(0.0, line.seconds, count)
        rows = [parts_at(line, edits, t) for t in at]
        if all(part == 1.0 for row in rows for part in row):
            return None
        last = count - 1
        kept = [n for n in range(count) if n in (0, last) or not rows[n - 1] == rows[n] == rows[n + 1]]
        if len(kept) <= most or count <= 2:
            return [float(at[n]) for n in kept]
        count = max(2, int(count * most / len(kept)))


def parts_at(line: Timeline, edits: EditStack, seconds: float) -> Parts:
    """How far each edit has gone, 1 for those that the path does not name."""
    named = line.parts(np.array([seconds]))
    shown = [number for number, edit in enumerate(edits, 1) if edit.enabled and edit.changes_anything]
    return tuple(
        round(float(named[number][0]), 5) if number in named and number in shown else 1.0
        for number in range(1, len(edits) + 1)
    )


def stack_at(
    edits: PreparedStack,
    parts: Parts,
    moving: Sequence[int] = (),
    nodes: int = LATTICE,
    on_way: PreparedStack | None = None,
) -> PreparedStack:
    """The stack at these parts; the lattices of edits that move have at most `nodes` an axis.

    `on_way` has the patches of edits that have begun and not gone all the way; without, they are as `edits`'.
    """
    found: list[PreparedEdit] = []
    for number, (step, part) in enumerate(zip(edits, parts, strict=True)):
        try:
            least = 0.0 if mirrored_axes(step.edit.operations) else LEAST
            there = partial_edit(step.edit, max(part, least))
            if there is not None and there.enabled and not there.is_possible:
                there.check()
        except EditError as error:
            raise EditError(f"the camera path shows an edit at {part:.0%} of its way: {error}") from None
        if there is None:
            continue
        if number in moving and isinstance(there, Continuous) and there.kernel_lattice is not None:
            there = there.replace(lattice=min(nodes, there.kernel_lattice))
        patch = _patch(edits, on_way or edits, parts, number)
        found.append(PreparedEdit(there, patch, step.pasted))
    return PreparedStack(found)


def _patch(
    edits: PreparedStack, on_way: PreparedStack, parts: Parts, number: int
) -> Patch | SplatPatch | None:
    """The patch that an edit has at these parts.

    Patches show the result of the complete edits before them: there is none while one of these that reaches
    into its region is in motion.
    """
    step, part = edits[number], parts[number]
    if part < 1.0 and not isinstance(step.edit, Delete):
        step = on_way[number]
    if step.patch is None or part <= 0.0:
        return None
    low, high = step.patch.region.aabb
    for before, there in zip(edits.edits[:number], parts, strict=False):
        meets = (before.boxes[:, 0] <= high) & (before.boxes[:, 1] >= low)
        if there < 1.0 and before.edit.enabled and meets.all(axis=1).any():
            return None
    return step.patch


def _distances(exact: PathState, one: PathState, other: PathState) -> NDArray[np.float64]:
    """How far the page's map half-way between two states is from the map of that moment, [PROBES]."""
    rng = np.random.default_rng(0)
    boxes = exact.packed.boxes
    box = rng.integers(len(boxes), size=PROBES)
    points = rng.uniform(boxes[box, 0], boxes[box, 1]).astype(np.float32)
    ahead = np.tile(np.array([0.0, 0.0, 1.0], np.float32), (PROBES, 1))
    ours = mixed(one, other, 0.5).to_canonical(points, ahead)
    theirs = exact.packed.to_canonical(points, ahead)
    # A point on the other side of a cut, at the surface of a cage that moves alone, is no error of the map.
    same = ours[3] == theirs[3]
    return np.asarray(np.linalg.norm(ours[0] - theirs[0], axis=1)[same], np.float64)
