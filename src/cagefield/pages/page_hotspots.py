"""Hotspots of an exported page: texts, places and views in the edited scene, and places along its path."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from cagefield.cameras.keyframes import Still
from cagefield.exporting.path_frames import scene_at
from cagefield.scene.hotspot_motion import moving_edits, shown_hotspots
from cagefield.scene.hotspots import resolved_view
from cagefield.scene.scene import Scene

Place = list[float] | None
"""Position [3] of a hotspot, None where it is not to be seen."""


def hotspot_entries(scene: Scene, stills: Sequence[Still]) -> list[dict[str, Any]]:
    """Hotspots that the edited scene shows, for a page's header.

    `along` of an entry has its places (deformed space) at the images of the camera path, where the edits
    carry it along; entries that stay have none.

    Raises:
        EditError: an edit that cannot be evaluated, also at a part that the path shows.
    """
    first, up = scene.first_camera, scene.up
    shown = shown_hotspots(scene.hotspots, moving_edits(scene))
    along = _places_along(scene, stills)
    entries = []
    for hotspot, places in zip(shown, along, strict=True):
        if hotspot is None:
            continue
        view = resolved_view(hotspot, first, up)
        entry: dict[str, Any] = {
            "title": hotspot.title,
            "text": hotspot.text,
            "position": list(hotspot.position),
            "view": {"c2w": list(view.c2w), "fov_y_deg": view.fov_y_deg},
        }
        if any(place != entry["position"] for place in places):
            entry["along"] = places
        entries.append(entry)
    return entries


def _places_along(scene: Scene, stills: Sequence[Still]) -> list[list[Place]]:
    """Places of each hotspot at each image of a path; of images with the same parts the same lists."""
    known: dict[tuple[tuple[int, float], ...], list[Place]] = {}
    moments = []
    for still in stills:
        key = tuple(sorted(still.parts.items()))
        if key not in known:
            known[key] = _places(scene, still.parts)
        moments.append(known[key])
    return [[moment[number] for moment in moments] for number in range(len(scene.hotspots))]


def _places(scene: Scene, parts: Mapping[int, float]) -> list[Place]:
    there = scene_at(scene, parts) if parts else scene
    found = shown_hotspots(there.hotspots, moving_edits(there))
    return [None if hotspot is None else list(hotspot.position) for hotspot in found]
