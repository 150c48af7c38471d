"""Provenance of splats: those of the scene, and those that edits paste from other scenes.

Edits of splats are evaluated on one SplatField: the scene's own splats first, then those of
each paste, in the other scene's space. These are not shown where they are, but where their paste takes them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any
from weakref import WeakKeyDictionary, ref

import numpy as np
from numpy.typing import NDArray

from cagefield.edits import EditMap, Paste, PreparedEdit
from cagefield.fields.splat_field import SplatField
from cagefield.typing import Float32, Mask

MAX_KEPT_FIELDS = 3
"""Joined fields that are kept of one field."""

Pasted = tuple[SplatField, ...]


@dataclass(frozen=True, eq=False)
class _Origins:
    """Origins of a field's splats: index [N] into `pasted`, -1 for the scene's own.

    `scene` is the scene's field, whose rows come first, None of splats that stand for others.
    """

    number: NDArray[np.int32]
    pasted: Pasted
    scene: ref[SplatField] | None = None


_joined: WeakKeyDictionary[SplatField, list[tuple[Pasted, SplatField]]] = WeakKeyDictionary()
_origins: WeakKeyDictionary[SplatField, _Origins] = WeakKeyDictionary()


def with_pasted(field: SplatField, edits: EditMap) -> SplatField:
    """Field with the splats that active edits paste behind its own; itself without pastes, or with them
    joined.

    Equal pastes give the same object while it lives. Harmonics get the higher degree of both.
    """
    if field in _origins:
        return field
    pasted = tuple(dict.fromkeys(step.pasted.splats for step in edits.steps if step.pasted is not None))
    splats = tuple(part for part in pasted if part is not None)
    if not splats:
        return field
    known = _joined.setdefault(field, [])
    found = next((joined for parts, joined in known if parts == splats), None)
    if found is None:
        found = _behind(field, splats)
        counts = [len(field), *(len(part) for part in splats)]
        numbers = np.repeat(np.arange(-1, len(splats), dtype=np.int32), counts)
        _origins[found] = _Origins(numbers, splats, ref(field))
    known[:] = [(splats, found), *(each for each in known if each[1] is not found)][:MAX_KEPT_FIELDS]
    return found


def pasted_rows(field: SplatField, step: PreparedEdit) -> NDArray[np.int64]:
    """The rows of a joined field that an edit pastes; none for an edit that does not.

    Raises EditError for a paste without its content.
    """
    if not isinstance(step.edit, Paste):
        return np.zeros(0, np.int64)
    origins = _origins.get(field)
    for number, part in enumerate(() if origins is None else origins.pasted):
        if origins is not None and step.pasted is not None and part is step.pasted.splats:
            return np.flatnonzero(origins.number == number)
    raise step.edit.unread()


def at_rest(field: SplatField) -> Mask:
    """[N], True where a splat is pasted: it is not shown at its own place."""
    origins = _origins.get(field)
    return np.zeros(len(field), bool) if origins is None else origins.number >= 0


def of_same_scene(field: SplatField, other: SplatField) -> bool:
    """True where rows of one field are rows of the other, whatever comes behind them."""
    return _scene_of(field) is _scene_of(other)


def _scene_of(field: SplatField) -> SplatField | None:
    origins = _origins.get(field)
    return origins.scene() if origins is not None and origins.scene is not None else field


def descend(field: SplatField, ancestor: SplatField, rows: NDArray[Any]) -> SplatField:
    """The field, whose splats are known to stand for rows (or those True in a mask) of another one."""
    origins = _origins.get(ancestor)
    if origins is not None:
        _origins[field] = _Origins(origins.number[rows], origins.pasted)
    return field


def descend_from_all(field: SplatField, ancestors: Sequence[SplatField]) -> SplatField:
    """Field with the origins of the splats of several fields, one after the other."""
    known = [_origins[each] for each in ancestors if each in _origins]
    if known:
        _origins[field] = _Origins(np.concatenate([each.number for each in known]), known[0].pasted)
    return field


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
