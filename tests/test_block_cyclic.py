"""Every item of a loop is scheduled_item once, and to all threads alike."""

import numpy as np
import pytest
import quadrants as qd

from cagefield.compute import block_cyclic, devices
from cagefield.compute.block_cyclic import Schedule, scheduled_item, turn_count

Counts = qd.types.ndarray(dtype=qd.i32, ndim=1)


@qd.kernel
def _visit(visits: Counts, order: Counts, deal: Schedule):
    for n in range(turn_count(deal)):
        i = scheduled_item(n, deal)
        if i < visits.shape[0]:
            visits[i] += 1
            order[i] = n


@pytest.mark.parametrize("unit", [1, 8, 64])
@pytest.mark.parametrize("items", [1, 2, 63, 511, 1024, 1025, 70_001])
def test_every_item_has_its_turn(items: int, unit: int) -> None:
    devices.start()
    visits, order = np.zeros(items, np.int32), np.zeros(items, np.int32)
    _visit(visits, order, block_cyclic.block_cyclic_schedule(items, unit))
    assert (visits == 1).all()


def test_parts_get_their_share_of_any_piece_of_the_items() -> None:
    devices.start()
    parts, items = devices.parts(), 6400
    visits, order = np.zeros(items, np.int32), np.zeros(items, np.int32)
    deal = block_cyclic.block_cyclic_schedule(items, 1)
    _visit(visits, order, deal)
    part = order // deal[0]
    for first in range(0, items, 640):
        share = np.bincount(part[first : first + 640], minlength=parts)
        assert share.min() >= 640 // parts


def test_few_items_go_to_different_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(devices, "parts", lambda: 4)
    length, parts, unit = block_cyclic.block_cyclic_schedule(4, 1)
    assert (length, parts, unit) == (block_cyclic.MIN_PART_TURNS, 4, 1)


def test_a_gpu_keeps_the_order(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(devices, "is_gpu", lambda: True)
    assert block_cyclic.block_cyclic_schedule(1000, 1).tolist() == [1000, 1, 1]
