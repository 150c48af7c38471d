"""Operations that take an inner cage to a given shape, as programs with cages of their own have it.

Notation: A [n,3] are the handles of the inner cage, B [n,3] their target, p the pivot. Two sequences reach B:
a translation and moves of handles; or the affine map x -> M x + t that fits B over A best, as a scale D, a
shear H and a rotation R about p (M = R H D by a QR decomposition, H a unit upper triangle) and a translation,
then moves of handles. The shorter one is taken.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from cagefield.edits import operations as ops
from cagefield.edits.operation_sequence import MAX_OPERATIONS, ImpossibleOperationError, cages_along
from cagefield.edits.operations import Operation
from cagefield.errors import CageError
from cagefield.geometry.cage import Cage
from cagefield.geometry.cage_checks import read_only
from cagefield.typing import Array

TARGET_TOLERANCE_SHARE = 2e-7
"""Distance from the target that counts as reached, as a share of the target's extent, and of its distance
from the origin: a few roundings of float32, in which the programs keep their cages."""

MAX_ROUNDS = 8
"""Rounds in which handles move to their targets, each by an equal share, where one round is not possible."""


def operations_to(inner: Cage, target: ArrayLike) -> tuple[Operation, ...]:
    """Operations that take the handles of an inner cage to target [n,3], within `TARGET_TOLERANCE_SHARE`.

    Raises:
        CageError: a target of another number of points or not finite, or one that no sequence of valid cages
            leads to.
    """
    goal = read_only(target, inner.handles.shape, f"target of the {inner.plural_noun}")
    near = TARGET_TOLERANCE_SHARE * max(float(np.ptp(goal, axis=0).max()), float(np.abs(goal).max()))
    # Handles within half the tolerance of each other's displacement move together.
    plans = [_translation(inner, goal, near), _affine(inner, goal, near)]
    candidates = [(*plan, *_moves(inner, goal, plan, near, rounds=1)) for plan in plans if plan is not None]
    failure: CageError | None = None
    for candidate in sorted(candidates, key=len):
        try:
            return _possible(inner, candidate)
        except CageError as error:
            failure = failure or error
    for rounds in range(2, MAX_ROUNDS + 1):
        for plan in plans[::-1]:
            try:
                return _possible(inner, (*(plan or ()), *_moves(inner, goal, plan or (), near, rounds)))
            except CageError:
                continue
    raise failure or CageError(f"the {inner.plural_noun} cannot be taken to the target; reduce the motion")


def _possible(inner: Cage, operations: Sequence[Operation]) -> tuple[Operation, ...]:
    """The operations. Raises CageError where one makes no cage, or there are too many."""
    if len(operations) > MAX_OPERATIONS:
        raise CageError(f"{len(operations)} operations are too many, an edit has at most {MAX_OPERATIONS}")
    for _ in cages_along(inner, operations):
        pass
    return tuple(operations)


def _translation(inner: Cage, goal: Array, near: float) -> tuple[Operation, ...]:
    """The translation that most handles share; none where no two share one."""
    motion = goal - inner.handles
    group = max(_groups(motion, near), key=len)
    by = motion[group].mean(axis=0)
    return () if len(group) < 2 or np.abs(by).max() <= near else (ops.Translate(_triple(by)),)


def _affine(inner: Cage, goal: Array, near: float) -> tuple[Operation, ...] | None:
    """Scale, shear, rotation and translation of the affine map that fits best; None where it turns over."""
    A, p = inner.handles, inner.pivot
    local = np.concatenate([A - p, np.ones((len(A), 1))], axis=1)
    fit, _, rank, _ = np.linalg.lstsq(local, goal - p, rcond=None)
    M, t = fit[:3].T, fit[3]
    if rank < 4 or not np.linalg.det(M) > 0.0:
        return None
    R, U = np.linalg.qr(M)
    signs = np.sign(np.diag(U))
    R, U = R * signs, U * signs[:, None]  # the diagonal positive, hence R a rotation
    D = np.diag(U)
    H = U / D
    reach = float(np.linalg.norm(A - p, axis=1).max())
    found: list[Operation] = []
    if np.abs(D - 1.0).max() * reach > near:
        found.append(ops.Scale(_triple(D)))
    if max(abs(H[0, 1]), abs(H[0, 2]), abs(H[1, 2])) * reach > near:
        found.append(ops.Shear(xy=float(H[0, 1]), xz=float(H[0, 2]), yz=float(H[1, 2])))
    turn = Rotation.from_matrix(R)
    if turn.magnitude() * reach > near:
        found.append(ops.Rotate.from_rotation(turn))
    if np.abs(t).max() > near:
        found.append(ops.Translate(_triple(t)))
    return tuple(found)


def _moves(
    inner: Cage, goal: Array, plan: Sequence[Operation], near: float, rounds: int
) -> tuple[Operation, ...]:
    """Moves of handles, in rounds of equal shares, from where a plan takes them to the goal [n,3].

    Handles with one displacement, within the tolerance, move together.
    """
    cage = inner
    try:
        for cage in cages_along(inner, plan):  # noqa: B007
            pass
    except ImpossibleOperationError:
        return ()
    motion = goal - cage.handles
    moves: list[Operation] = []
    for group in _groups(motion, near):
        by = motion[group].mean(axis=0)
        if np.abs(by).max() <= near:
            continue
        numbers = tuple(int(k) for k in group)
        share = _triple(by / rounds)
        if inner.is_hexahedron:
            moves.append(
                ops.MoveCorner(numbers[0], share) if len(group) == 1 else ops.MoveCorners(numbers, share)
            )
        else:
            moves.append(
                ops.MovePoint(numbers[0], share) if len(group) == 1 else ops.MovePoints(numbers, share)
            )
    return tuple(moves) * rounds


def _groups(motion: Array, near: float) -> list[Array]:
    """Numbers of the handles whose displacements [n,3] differ by less than the tolerance, group by group."""
    left = np.arange(len(motion))
    groups = []
    while len(left):
        alike = np.abs(motion[left] - motion[left[0]]).max(axis=1) <= 0.5 * near
        groups.append(left[alike])
        left = left[~alike]
    return groups


def _triple(v: Array) -> ops.Triple:
    return ops.displacement(v, "operation")
