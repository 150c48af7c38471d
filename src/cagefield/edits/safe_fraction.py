"""How far an operation may go: by bisection, or many shares of it tested together."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from cagefield.edits.operations import MoveCorner, MoveEdge, MoveFace, Operation, Rotate, Scale, Translate
from cagefield.errors import CageError
from cagefield.geometry.cage import Cage
from cagefield.geometry.cage_checks import factors
from cagefield.typing import Array, Mask
from cagefield.warps import FlowShell

SHARES_PER_ROUND = 32
SHARE_TOLERANCE = 1e-3


@dataclass(frozen=True)
class Search:
    """Knowledge before a search for the largest safe share of an operation.

    - check: whether a share in [0,1] is safe; None for the check of whom is asked.
    - safe: share from 0 up to which everything is safe.
    - unsafe: share that is not safe; above 1 where none is known.
    """

    check: Callable[[float], bool] | None = None
    safe: float = 0.0
    unsafe: float = np.inf

    @property
    def is_over(self) -> bool:
        """True where the limit is known to the tolerance."""
        return self.unsafe - self.safe <= SHARE_TOLERANCE * (1.0 + 1e-9)


NOTHING_KNOWN = Search()
"""Search of which nothing is known."""


def along(operation: Operation, cage: Cage, t: Array) -> Array:
    """Corners [T,8,3] of the cage after the shares t [T] of an operation, as `operation.part` makes them.

    No check is made: they need not be a valid cage.
    """
    offsets = cage.corners - cage.pivot
    if isinstance(operation, Rotate):
        turn = Rotation.from_euler("XYZ", operation.degrees, degrees=True).as_rotvec()
        M = Rotation.from_rotvec(t[:, None] * turn).as_matrix()
        if operation.axes == "cage":
            M = cage.heading @ M @ cage.heading.T
        return cage.pivot + offsets @ np.transpose(M, (0, 2, 1))
    if isinstance(operation, Scale):
        own = cage.axes if operation.axes == "cage" else np.eye(3)
        M = (own * (factors(operation.by, "scale") ** t[:, None])[:, None]) @ np.linalg.inv(own)
        return cage.pivot + offsets @ np.transpose(M, (0, 2, 1))
    by = np.zeros((8, 3))
    if isinstance(operation, Translate):
        by[:] = operation.by
    elif isinstance(operation, (MoveCorner, MoveEdge, MoveFace)):
        by[list(operation.corners)] = operation.by
    else:
        by = operation.apply(cage).corners - cage.corners
    return cage.corners + t[:, None, None] * by


def flow_reach(operation: Operation, cage: Cage, edit: tuple[Cage, Cage], *, fine: bool) -> float:
    """Largest share of an operation on a deformed cage up to which a flow shell may surround it.

    `edit` is the canonical inner and the outer cage. `FlowShell.may_surround` names the cases left open.
    """

    return largest_of(lambda t: FlowShell.may_surround(*edit, along(operation, cage, t), fine=fine))


def largest_of(safe: Callable[[Array], Mask], tolerance: float = SHARE_TOLERANCE) -> float:
    """Largest t in [0,1], to the tolerance, such that everything from 0 to t is safe.

    `safe` is asked for equal parts of the range, then for parts of the one in which it first is not.
    """
    low, high = 0.0, 1.0
    t = np.linspace(low, high, SHARES_PER_ROUND + 1)
    while True:
        mask = safe(t)
        if mask.all():
            return high
        first = int(np.argmin(mask))
        if t[first] == 0.0:
            return 0.0
        low, high = float(t[first - 1]) if first else low, float(t[first])
        if high - low <= tolerance:
            return low
        t = np.linspace(low, high, min(SHARES_PER_ROUND, int(np.ceil((high - low) / tolerance))) + 1)[1:]


def largest_safe(safe: Callable[[float], bool], search: Search = NOTHING_KNOWN) -> float:
    """Largest t in [0,1], to 1e-3, such that everything from 0 to t is safe; 1.0 where safe(1).

    Goes up in sixteenths to the first that is not safe and bisects in front of it.
    """
    if search.unsafe > 1.0 and safe(1.0):
        return 1.0
    low, high = search.safe, min(search.unsafe, 1.0)
    if not safe(low):
        if low == 0.0:
            return 0.0
        low = 0.0
    for t in (n / 16.0 for n in range(1, 16) if low < n / 16.0 < high):
        if not safe(t):
            high = t
            break
        low = t
    while high - low > SHARE_TOLERANCE:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if safe(middle) else (low, middle)
    return low


def is_valid(operation: Operation, t: float, cage: Cage) -> bool:
    """True where the share t of an operation makes a cage of this one."""
    try:
        operation.part(t).apply(cage)
    except CageError:
        return False
    return True


def format_share(share: float) -> str:
    """A share as text, rounded down to stay safe."""
    return f"{np.floor(100.0 * share) / 100.0:.2f}"
