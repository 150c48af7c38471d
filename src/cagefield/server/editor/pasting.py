"""Pastes in the editor: the initial cage and placement of content from another scene."""

from __future__ import annotations

import numpy as np

from cagefield.edits import Edit, Paste
from cagefield.edits.operations import Operation
from cagefield.edits.paste_placement import placed_paste
from cagefield.errors import CageError, EditError
from cagefield.geometry.cage import Cage
from cagefield.typing import Array

PASTE_VIEW_SHARE = 0.5
"""Longest edge of pasted content, as a share of the view's height at the surface below it."""

PICK_MARGIN_SHARE = 0.05
"""Maximum distance of a picked point from the cage of a paste, as a share of its longest edge."""

NOT_ON_PASTE = (
    'pair {pair}: its first point is not on what edit "{name}" pastes; click on that first, then '
    "on the place where the point belongs"
)
MIRRORED = "the paste is mirrored about the middle of its cage; crop it first, and mirror it then"
BENT = "what is pasted was bent; take the moves of its corners back, then set its cage"
TURNED = "the cage of a paste shrinks, grows and moves in Set mode; turn it in Edit mode (Tab)"


def build_paste(
    source: str, name: str, box: Array, source_up: Array, at: Array, up: Array, view_height: float
) -> Paste:
    """The paste of a whole scene, whose box [2,3] and up direction are given, upright on a point [3]."""
    size = PASTE_VIEW_SHARE * view_height
    return placed_paste(source, box, at, up=up, source_up=source_up, size=size, name=name)


def cage_in_scene(edit: Edit) -> Cage:
    """The cage that Set mode shows and moves: of a paste, where it stands."""
    return edit.deformed if isinstance(edit, Paste) else edit.inner


def crop_paste(edit: Paste, cage: Cage) -> Paste:
    """The paste with another cage, given where it stands, around content that stays where it is.

    Raises EditError where its operations do not allow that.
    """
    if edit.mirrored:
        raise EditError(MIRRORED)
    phi = edit.map_between(edit.inner, edit.deformed).affine
    if phi is None:
        raise EditError(BENT)
    A, b = phi
    there = edit.replace(inner=Cage(cage.corners @ A.T + b, pivot=edit.inner.pivot))
    size = float(np.ptp(cage.corners, axis=0).max())
    if np.abs(there.deformed.corners - cage.corners).max() > 1e-6 * size:
        raise EditError(TURNED)
    return there


def source_points(edit: Paste, points: Array) -> Array:
    """Points [N,3] of the other scene that stand at points [N,3] of this one, where no parent carries them.

    Raises EditError for a point beside the pasted content.
    """
    size = float(np.ptp(edit.deformed.corners, axis=0).max())
    inside = edit.deformed.grown(PICK_MARGIN_SHARE * size).contains(points)
    if not inside.all():
        raise EditError(NOT_ON_PASTE.format(pair=int(np.argmin(inside)) + 1, name=edit.name))
    phi = edit.map_between(edit.inner, edit.deformed)
    if phi.affine is not None:
        A, b = phi.affine
        return np.asarray(points @ A.T + b)
    within, found, _ = phi(points)
    if not within.all():
        raise EditError(NOT_ON_PASTE.format(pair=int(np.argmin(within)) + 1, name=edit.name))
    return found


def points_at_rest(carrier: Array | None, points: Array) -> Array:
    """Points [N,3] where parents, by an affine map [3,4], do not carry them."""
    if carrier is None:
        return points
    return np.asarray(np.linalg.solve(carrier[:, :3], (points - carrier[:, 3]).T).T)


def crop_problem(edit: Paste, operation: Operation) -> str | None:
    """Why an operation of Set mode cannot be done to a paste's cage, not even a little of it; or None."""
    try:
        crop_paste(edit, operation.part(0.01).apply(edit.deformed))
    except EditError as error:
        return str(error)
    except CageError:
        return None
    return None
