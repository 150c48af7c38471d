"""Splats that edits paste from other scenes, behind a field's own.

What is made of splats by edits is worked out on one SplatField: the scene's own splats first, then those of
each paste, in the other scene's space. These are not shown where they are, but where their paste takes them.
"""

from __future__ import annotations

from dataclasses import replace
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from cagefield.edits import Edit, EditStack
from cagefield.fields.splat import SplatField
from cagefield.typing import Float32, Mask

KEPT = 3
"""Joined fields that are kept of one field."""

Pasted = tuple[SplatField, ...]

_joined: WeakKeyDictionary[SplatField, list[tuple[Pasted, SplatField]]] = WeakKeyDictionary()
_parts: WeakKeyDictionary[SplatField, tuple[int, Pasted]] = WeakKeyDictionary()
"""Of a joined field, how many splats are the scene's own, and what comes behind them."""


def with_pasted(field: SplatField, edits: EditStack) -> SplatField:
    """The field with what active edits paste behind its splats: itself where that is nothing, or is there.

    The same field for the same pastes, while it lives. Harmonics get the higher degree of both.
    """
    if field in _parts:
        return field
    pasted = tuple(dict.fromkeys(edit.patch.splats for edit in edits.active if _pastes(edit) and edit.patch))
    splats = tuple(part for part in pasted if part is not None)
    if not splats:
        return field
    known = _joined.setdefault(field, [])
    found = next((joined for parts, joined in known if parts == splats), None)
    if found is None:
        found = _behind(field, splats)
        _parts[found] = (len(field), splats)
    known[:] = [(splats, found), *(each for each in known if each[1] is not found)][:KEPT]
    return found


def own_count(field: SplatField) -> int:
    """How many splats of a joined field, or of any other, are shown where they are."""
    return _parts[field][0] if field in _parts else len(field)


def pasted_rows(field: SplatField, edit: Edit) -> slice:
    """The rows of a joined field that an edit pastes; none for an edit that does not.

    Raises EditError for a paste without what it pastes.
    """
    if not _pastes(edit):
        return slice(0, 0)
    first, parts = _parts.get(field, (len(field), ()))
    for part in parts:
        if edit.patch is not None and part is edit.patch.splats:
            return slice(first, first + len(part))
        first += len(part)
    raise edit.unread()


def at_rest(field: SplatField) -> Mask:
    """[N], True where a splat is pasted: it is not shown at its own place."""
    hidden = np.ones(len(field), bool)
    hidden[: own_count(field)] = False
    return hidden


def _pastes(edit: Edit) -> bool:
    return edit.source is not None


def _behind(field: SplatField, pasted: Pasted) -> SplatField:
    terms = max(part.sh.shape[1] for part in (field, *pasted))
    names = ("means", "log_scales", "quaternions", "opacities")
    means, log_scales, quaternions, opacities = (
        _read_only(np.concatenate([getattr(part, name) for part in (field, *pasted)])) for name in names
    )
    sh = np.zeros((len(means), terms, 3), np.float32)
    first = 0
    for part in (field, *pasted):
        sh[first : first + len(part), : part.sh.shape[1]] = part.sh
        first += len(part)
    return replace(
        field,
        means=means,
        log_scales=log_scales,
        quaternions=quaternions,
        opacities=opacities,
        sh=_read_only(sh),
    )


def _read_only(values: NDArray[np.float32]) -> Float32:
    values.setflags(write=False)
    return values
