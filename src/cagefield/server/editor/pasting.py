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


def crop_problem(edit: Paste, operation: Operation) -> str | None:
    """Why an operation of Set mode cannot be done to a paste's cage, not even a little of it; or None."""
    try:
        crop_paste(edit, operation.part(0.01).apply(edit.deformed))
    except EditError as error:
        return str(error)
    except CageError:
        return None
    return None
