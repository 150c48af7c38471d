"""One edit of a stack replaced: what is sampled and probed again, and that it is what all would give."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from typing import Any

import numpy as np
import pytest

from cagefield.compute import devices
from cagefield.edits import Edit, EditStack
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.cage import Cage
from cagefield.rendering.voxels.voxel_renderer import VoxelRenderer
from scenes import ball_field
from tiers import nightly_except


@pytest.fixture(scope="module", autouse=True)
def device() -> None:
    devices.start()


def small(number: int) -> Edit:
    """One of ten edits whose outer cages do not meet."""
    middle = 0.55 * np.array([number % 3 - 1, number // 3 % 3 - 1, number // 9 - 0.5])
    return Edit.continuous(Cage.box(middle, 0.2), Cage.box(middle, 0.5), lattice=8).rotate(
        (0, 0, 0.1 + 0.1 * number)
    )


APART = EditStack(small(number) for number in range(10))
HALF = Edit.continuous(Cage.box((-0.3, 0, 0), 0.4), Cage.box((-0.3, 0, 0), 0.9), lattice=8).rotate(
    (0, 0, 0.4)
)
ACROSS = Edit.continuous(Cage.box((0.1, 0, 0), 0.3), Cage.box((0.1, 0, 0), 0.7), lattice=8).translate(
    (0.1, 0, 0)
)
FAR = Edit.continuous(Cage.box((0.7, 0.6, 0.6), 0.2), Cage.box((0.7, 0.6, 0.6), 0.4), lattice=8).translate(
    (0, 0.05, 0)
)
MOVE = Edit.move(Cage.box((0.1, 0.2, 0), 0.3)).translate((0, 0, 0.8))
COPY = Edit.copy(Cage.box((-0.3, 0, 0), 0.2)).translate((0.2, 0.9, 0))

CHANGES: dict[str, tuple[EditStack, EditStack]] = {
    "one of ten apart": (APART, APART.set(4, small(4).translate((0.1, 0.1, 0)))),
    "one under another": (EditStack([HALF, ACROSS, FAR]), EditStack([HALF.scale(1.1), ACROSS, FAR])),
    "one over another": (EditStack([HALF, ACROSS, FAR]), EditStack([HALF, ACROSS.scale(1.1), FAR])),
    "one under a copy of its content": (EditStack([HALF, COPY]), EditStack([HALF.scale(1.2), COPY])),
    "one under a move": (EditStack([HALF, MOVE, FAR]), EditStack([HALF.scale(1.2), MOVE, FAR])),
    "one taken away": (EditStack([HALF, ACROSS, FAR]), EditStack([ACROSS, FAR])),
    "one put in": (EditStack([FAR]), EditStack([FAR, HALF])),
    "order": (EditStack([HALF, ACROSS]), EditStack([ACROSS, HALF])),
    "another outer cage": (
        EditStack([HALF, FAR]),
        EditStack([HALF.replace(outer=Cage.box((-0.2, 0, 0), (0.8, 1.0, 0.7))), FAR]),
    ),
    "nothing": (EditStack([HALF, FAR]), EditStack([HALF, FAR])),
    "the first discrete one": (EditStack([HALF]), EditStack([HALF, MOVE])),
    "all taken away": (EditStack([HALF]), EditStack([])),
}


@pytest.mark.parametrize("name", CHANGES)
def test_stacks_are_the_same_outside_the_changed_boxes(name: str) -> None:
    before, after = CHANGES[name]
    exact = [EditStack(edit.without_lattice() for edit in stack) for stack in (before, after)]
    boxes = exact[1].changed_boxes(exact[0])
    p = np.random.default_rng(0).uniform(-1.3, 1.3, (1500, 3))
    same = np.ones(len(p), dtype=bool)
    for low, high in boxes:
        same &= ~((p >= low) & (p <= high)).all(axis=1)
    assert same.any()
    first, second = (stack.to_canonical(p[same]) for stack in exact)
    assert np.array_equal(first.points, second.points) and np.array_equal(first.emptied, second.emptied)
    if name == "one of ten apart":
        np.testing.assert_array_equal(boxes, np.repeat(small(4).boxes, 2, axis=0))
    assert (len(boxes) == 0) == (name == "nothing")


def field(contracted: bool = False) -> VoxelField:
    """Separate points of a ball, so that what moves shows in the blocks."""
    ball = ball_field(resolution=81, radius=0.95)
    kept = (np.stack(np.unravel_index(ball.vertices, ball.resolution)) % 8 == 0).all(axis=0)
    return VoxelField(
        ball.bounds, ball.resolution, ball.vertices[kept], ball.density[kept], ball.sh[kept], contracted
    )


@pytest.mark.parametrize(
    ("contracted", "name"),
    nightly_except(
        product([False, True], CHANGES),
        *product([False], CHANGES),
        (True, "one over another"),
        (True, "order"),
    ),
)
def test_occupancy_after_a_change_is_that_of_a_new_renderer(name: str, contracted: bool) -> None:
    before, after = CHANGES[name]
    start = VoxelRenderer(field(contracted), before)
    changed, new = start.with_edits(after).occupancy, VoxelRenderer(field(contracted), after).occupancy
    np.testing.assert_array_equal(changed.origin, new.origin)
    np.testing.assert_array_equal(changed.blocks, new.blocks)
    np.testing.assert_array_equal(changed.codes, new.codes)
    if name != "nothing" and not contracted:  # whose box of interest has half as many blocks
        assert not np.array_equal(new.blocks, start.occupancy.blocks)


def counted(monkeypatch: pytest.MonkeyPatch, module: Any, name: str) -> list[int]:
    """Sizes of what a function returned, once for each call."""
    sizes: list[int] = []
    function: Callable[..., Any] = getattr(module, name)

    def counting(*arguments: Any) -> Any:
        result = function(*arguments)
        sizes.append(result.size)
        return result

    monkeypatch.setattr(module, name, counting)
    return sizes


def test_refresh_of_one_edit_in_ten_is_that_of_one_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    from cagefield.rendering.voxels import occupancy_continuous
    from cagefield.warps import flow_shell_nodes

    def work(stack: EditStack, number: int) -> list[list[int]]:
        start = VoxelRenderer(field(), stack)
        counts = [
            counted(monkeypatch, flow_shell_nodes, "sample"),
            counted(monkeypatch, occupancy_continuous, "images_of"),
            counted(monkeypatch, occupancy_continuous, "_refined"),
        ]
        # Another edit each time: an equal one would find its lattice there.
        start.with_edits(stack.set(number, stack[number].translate((0.01 * len(stack), 0, 0))))
        monkeypatch.undo()
        return counts

    alone, chain = work(EditStack([small(4)]), 0), work(APART, 4)
    assert chain[0] == alone[0] == [3 * 8**3]
    # Occupancy: as many points mapped, first for bricks, then for blocks; how many of those pass depends on
    # the little that differs.
    assert chain[1] == alone[1] and len(chain[1]) == 2
    assert sum(chain[2]) == pytest.approx(sum(alone[2]), rel=0.1)


def test_lattices_of_the_others_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    from cagefield.edits.device_stack import DeviceStack
    from cagefield.warps import flow_shell_nodes

    # All in the same outer cage: what one of them costs does not depend on where the others are.
    chain = EditStack(HALF.rotate((0, 0, 0.01 * number)) for number in range(10))
    packed = DeviceStack.from_stack(chain)
    sampled = counted(monkeypatch, flow_shell_nodes, "sample")
    again = DeviceStack.from_stack(chain.set(6, chain[6].scale(1.01)))
    assert sampled == [3 * 8**3]
    others = [n for n in range(10) if n != 6]
    before, after = (stack.lattice.reshape(10, -1) for stack in (packed, again))
    assert np.array_equal(before[others], after[others]) and not np.array_equal(before[6], after[6])


@pytest.mark.parametrize("place", [0, 6, 9])
def test_while_dragged_one_of_ten_in_the_same_outer_cage_is_mapped_alone(
    monkeypatch: pytest.MonkeyPatch, place: int
) -> None:
    from cagefield.rendering.voxels import occupancy_continuous

    mapped: list[tuple[int, int]] = []
    images = occupancy_continuous.images_of

    def counting(grid: Any, stack: Any, *rest: Any) -> Any:
        found = images(grid, stack, *rest)
        mapped.append((stack.n_edits, len(found)))
        return found

    def drag(stack: EditStack, number: int) -> tuple[VoxelRenderer, list[tuple[int, int]]]:
        renderer = VoxelRenderer(field(), stack).with_edits(stack, coarse=True)
        for step in range(1, 4):
            mapped.clear()
            moved = stack[number].translate((0.01 * step, 0.02 * step, 0))
            renderer = renderer.with_edits(stack.set(number, moved), coarse=True)
        return renderer, list(mapped)

    monkeypatch.setattr(occupancy_continuous, "images_of", counting)
    chain = EditStack(HALF.rotate((0, 0, 0.02 * number)) for number in range(10))
    _, alone = drag(EditStack([HALF]), 0)
    quick, together = drag(chain, place)
    assert alone == together and alone[0][0] == 1 and len(alone) == 1
    # It holds what all ten, looked at closely, hold; and is not much larger than what they hold by bricks.
    fine = VoxelRenderer(field(), quick.edits).occupancy
    whole = VoxelRenderer(field(), EditStack([])).with_edits(quick.edits, coarse=True).occupancy
    np.testing.assert_array_equal(fine.origin, quick.occupancy.origin)
    assert not (fine.blocks & ~quick.occupancy.blocks).any()
    assert quick.occupancy.blocks.sum() < 1.6 * whole.blocks.sum()
