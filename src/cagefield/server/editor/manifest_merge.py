"""Merge of a scene's manifest that another program changed while the editor had the scene open.

`cagefield align` and `cagefield hotspot` write it. A value that the editor left as it was is taken from the
file; one that both changed is a conflict.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from cagefield.errors import SceneError
from cagefield.scene.alignment import Alignment, Direction
from cagefield.scene.hotspots import Hotspot
from cagefield.scene.manifest import read_manifest
from cagefield.server.editor.document import Document
from cagefield.server.editor.hotspot_list import next_number, numbered


class ManifestValues(NamedTuple):
    """Values of a manifest that an editor's document has."""

    preserve_opacity: bool
    meters_per_unit: float | None
    hotspots: tuple[Hotspot, ...]
    up: Direction | None


_NAMES = {
    "preserve_opacity": "the opacity choice",
    "meters_per_unit": "the scale",
    "hotspots": "the hotspots",
    "up": "the up direction",
}
"""Words for the values in a notice."""


def manifest_on_disk(folder: Path) -> ManifestValues | None:
    """Values of a folder's manifest; None where it cannot be read."""
    try:
        manifest = read_manifest(folder)
    except (SceneError, OSError):
        return None
    return manifest_values(manifest.preserve_opacity, manifest.alignment, manifest.hotspots)


def manifest_values(
    preserve_opacity: bool, alignment: Alignment, hotspots: tuple[Hotspot, ...]
) -> ManifestValues:
    """Values of a scene or its manifest."""
    return ManifestValues(preserve_opacity, alignment.meters_per_unit, hotspots, alignment.direction)


def values_of_document(document: Document) -> ManifestValues:
    """The document's values."""
    hotspots = tuple(entry.hotspot for entry in document.hotspots)
    return ManifestValues(document.preserve_opacity, document.meters_per_unit, hotspots, document.up)


def merged(
    document: Document, before: ManifestValues, disk: ManifestValues, first_number: int
) -> tuple[Document, list[str]]:
    """(document with the values that only the file changed, words for those that both changed).

    `before` are the values that both began with; new hotspots are numbered from `first_number`.
    """
    own = values_of_document(document)
    theirs = [
        name for name in _NAMES if getattr(disk, name) not in (getattr(before, name), getattr(own, name))
    ]
    conflicts = [name for name in theirs if getattr(own, name) != getattr(before, name)]
    if "preserve_opacity" in theirs and "preserve_opacity" not in conflicts:
        document = replace(document, preserve_opacity=disk.preserve_opacity)
    if "meters_per_unit" in theirs and "meters_per_unit" not in conflicts:
        document = replace(document, meters_per_unit=disk.meters_per_unit)
    if "up" in theirs and "up" not in conflicts:
        document = replace(document, up=disk.up)
    if "hotspots" in theirs and "hotspots" not in conflicts:
        first = max(first_number, next_number(document.hotspots))
        document = replace(document, hotspots=numbered(disk.hotspots, first))
    return document, [_NAMES[name] for name in conflicts]
