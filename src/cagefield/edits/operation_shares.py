"""Shares of operations that go the same way: the earlier and the later moves of a hand along one handle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cagefield.edits.operations import Bend, Mirror, Operation, Rotate, Scale, Shear, Taper, Twist
from cagefield.typing import Array


def share_of(operation: Operation, other: Operation) -> float | None:
    """r > 0 such that `operation.part(r)` is the other operation, but for rounding; above 1 for a longer one.

    None where there is none, and for operations of which that is not known.
    """
    name = next((each for each in ("by", "degrees", "factor") if hasattr(operation, each)), None)
    if name is None or type(operation) is not type(other):
        return None
    if replace(other, **{name: getattr(operation, name)}) != operation:
        return None
    amounts, others = _amounts(operation), _amounts(other)
    if amounts is None or others is None:
        return None
    largest = int(np.argmax(np.abs(amounts)))
    ratio = float(others[largest] / amounts[largest]) if amounts[largest] else 0.0
    off = np.abs(ratio * amounts - others).max()
    return ratio if ratio > 0.0 and off <= 1e-12 * np.abs(others).max() else None


def _amounts(operation: Operation) -> Array | None:
    """Numbers [k] of an operation of which `part(t)` has t times as much, or None."""
    if isinstance(operation, Rotate):
        # About one axis alone: the angles of parts of other turns are not proportional.
        degrees = np.array(operation.degrees)
        return degrees if np.count_nonzero(degrees) == 1 and np.abs(degrees).max() < 180.0 else None
    if isinstance(operation, Scale):
        return np.log(operation.by) if min(operation.by) > 0.0 else None
    if isinstance(operation, Taper):
        return np.log([operation.factor]) if operation.factor > 0.0 else None
    if isinstance(operation, Bend | Twist):
        return np.array([operation.degrees])
    return None if isinstance(operation, Shear | Mirror) else np.array(operation.by)
