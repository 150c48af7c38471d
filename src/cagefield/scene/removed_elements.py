"""Elements deleted from a scene's field by mask, in a file beside the field, which stays whole."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cagefield.errors import CagefieldError, SceneError
from cagefield.fields.splat_field import SplatField
from cagefield.fields.voxel_field import VoxelField
from cagefield.files import json_text
from cagefield.files.safe_open import read_text
from cagefield.scene.scene_files import REMOVED, check_part
from cagefield.selection.element_selection import Selection
from cagefield.selection.selection_files import dump_selection, parse_selection

if TYPE_CHECKING:
    from cagefield.selection.elements import Elements
    from cagefield.typing import Mask

VERSION = 1


@dataclass(frozen=True, eq=False)
class Removal:
    """The whole field of a scene, and its deleted elements (`elements_of_field`)."""

    field: VoxelField | SplatField
    selection: Selection


def without_removed(field: VoxelField | SplatField, selection: Selection | None) -> VoxelField | SplatField:
    """The field without its deleted elements. Raises CagefieldError where the selection does not fit."""
    if not selection:
        return field
    from cagefield.selection.field_elements import elements_of_field, without_elements

    elements = elements_of_field(field)
    if selection.total != len(elements):
        raise CagefieldError(
            f"the deleted elements are of a field of {selection.total} elements, this one has {len(elements)}"
        )
    return without_elements(field, elements, selection.mask)


def removed_also(
    before: Removal | None, field: VoxelField | SplatField, elements: Elements, mask: Mask
) -> Removal:
    """Removal of more elements: those True in `mask` [N], of the elements of `field`, from which the ones of
    `before` are gone already."""
    from cagefield.selection.field_elements import elements_of_field

    if before is None:
        return Removal(field, Selection.from_mask(mask))
    whole, gone = elements_of_field(before.field), before.selection.mask.copy()
    if elements.kind == "splats":
        gone[np.flatnonzero(~gone)[mask]] = True
    else:
        numbers = np.full(whole.occupancy.shape, -1)
        numbers[tuple(whole.cells.T)] = np.arange(len(whole))
        gone[numbers[tuple(elements.cells[mask].T)]] = True
    return Removal(before.field, Selection.from_mask(gone))


def dump_removed(selection: Selection | None) -> str:
    """Text of the file of deleted elements; None is a selection of none."""
    removed = None if selection is None else dump_selection(selection)
    return json.dumps({"version": VERSION, "removed": removed}) + "\n"


def read_removed(folder: Path) -> Selection | None:
    """Deleted elements of a scene folder; None without any.

    Raises SceneError for a file that cannot be read or is of a newer version.
    """
    path = folder / REMOVED
    if not path.exists():
        return None
    check_part(path)
    try:
        content = json_text.loads(read_text(path))
        if not isinstance(content, dict) or "removed" not in content:
            raise CagefieldError("no deleted elements")
        if content.get("version") != VERSION:
            raise CagefieldError(f"version {content.get('version')!r:.20}, expected {VERSION}")
        value = content["removed"]
        return None if value is None else parse_selection(value) or None
    except (OSError, ValueError) as error:
        raise SceneError(f"{path}: {error!s:.200}; remove the file to restore all elements") from None
