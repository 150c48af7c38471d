"""Places of hotspots along the camera path, where its edits are done in part: for marks in its preview."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cagefield.cameras.keyframes import Timeline
from cagefield.edits import Edit
from cagefield.errors import CagefieldError
from cagefield.scene.hotspot_motion import shown_hotspots
from cagefield.server.editor.document import Document
from cagefield.server.editor.path_edits import edits_at_time

MOMENTS_PER_SECOND, MAX_MOMENTS = 12.0, 600
"""Density of the places, which pages interpolate; those of a longer path are further apart."""

Track = list[tuple[float, float, float] | None]
"""Positions (deformed space) at even times from the path's beginning to its end, None where hidden."""


def hotspot_tracks(document: Document, problem_of: Callable[[Edit], str | None]) -> dict[int, Track]:
    """Track of each hotspot that follows the edits, by its number; empty for a path without parts.

    `problem_of` says why a whole edit cannot be shown, or None. Raises CameraError for a path that does not
    move.
    """
    following = [entry for entry in document.hotspots if entry.hotspot.follows]
    timeline = Timeline(document.keys, loop=document.loop)
    count = min(max(2, round(timeline.seconds * MOMENTS_PER_SECOND) + 1), MAX_MOMENTS)
    parts = timeline.parts(np.linspace(0.0, timeline.seconds, count))
    if not following or not parts:
        return {}
    known: dict[tuple[float, ...], Track] = {}
    tracks: dict[int, Track] = {entry.id: [] for entry in following}
    for moment in range(count):
        now = {name: float(values[moment]) for name, values in parts.items()}
        key = tuple(now.values())
        if key not in known:
            known[key] = _places(document, now, problem_of)
        for track, place in zip(tracks.values(), known[key], strict=True):
            track.append(place)
    return tracks


def _places(document: Document, parts: dict[int, float], problem_of: Callable[[Edit], str | None]) -> Track:
    """Positions of the following hotspots at parts of the edits; all hidden where an edit is not possible."""
    hotspots = [entry.hotspot for entry in document.hotspots if entry.hotspot.follows]
    try:
        shown = shown_hotspots(hotspots, edits_at_time(document, parts, problem_of))
    except CagefieldError:
        return [None] * len(hotspots)
    return [None if hotspot is None else hotspot.position for hotspot in shown]
