"""Content of an autosave: the values of a document, as JSON."""

from __future__ import annotations

import dataclasses
import json

from cagefield.cameras.keyframes import Keyframe
from cagefield.edits import parse_edits
from cagefield.edits.edit_files import VERSION
from cagefield.errors import CagefieldError
from cagefield.scene.alignment import Alignment
from cagefield.scene.hotspots import hotspots_from_value
from cagefield.selection.selection_files import dump_selection, parse_selection
from cagefield.server.editor.document import Document


def autosave_content(document: Document, edits: list[object]) -> dict[str, object]:
    """Values of an autosave; `edits` are those of the document's edits, as edit files have them."""
    return {
        "version": 1,
        "edits": {"version": VERSION, "edits": edits},
        "locked": [entry.locked for entry in document.entries],
        "preserve_opacity": document.preserve_opacity,
        "meters_per_unit": document.meters_per_unit,
        "up": document.up,
        "hotspots": [entry.hotspot.to_dict() for entry in document.hotspots],
        "loop": document.loop,
        "removed": None if document.removed is None else dump_selection(document.removed),
        "keys": [
            {
                "c2w": list(key.c2w),
                "fov_y_deg": key.fov_y_deg,
                "seconds": key.seconds,
                "parts": {str(name): part for name, part in key.parts.items()},
            }
            for key in document.placed_keys
        ],
    }


def parse_autosave(content: dict[str, object]) -> Document:
    """The document of an autosave. Raises ValueError and its like for anything else."""
    if content["version"] != 1:
        raise CagefieldError("an autosave of another version")
    stack = parse_edits(
        json.dumps(content["edits"]), format="json", source="autosave", check=False, mend=True
    )
    keys = tuple(
        Keyframe(
            tuple(key["c2w"]),
            key["fov_y_deg"],
            key["seconds"],
            {int(name): part for name, part in key["parts"].items()},
        )
        for key in content["keys"]  # type: ignore[attr-defined]
    )
    removed = content.get("removed")
    alignment = Alignment(content.get("meters_per_unit"), content.get("up"))  # type: ignore[arg-type]
    document = Document.from_edits(
        stack,
        preserve_opacity=bool(content["preserve_opacity"]),
        keys=keys,
        loop=bool(content["loop"]),
        removed=None if removed is None else parse_selection(removed),
        meters_per_unit=alignment.meters_per_unit,
        hotspots=hotspots_from_value(content.get("hotspots", [])),
        up=alignment.direction,
    )
    locked = content["locked"]
    entries = tuple(
        dataclasses.replace(entry, locked=bool(flag))
        for entry, flag in zip(document.entries, locked, strict=True)  # type: ignore[call-overload]
    )
    return dataclasses.replace(document, entries=entries)
