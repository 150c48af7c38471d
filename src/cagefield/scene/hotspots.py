"""Hotspots of a scene: points with a title and plain text, for the editor and exported pages.

Positions are world units. A hotspot that follows the edits is kept in canonical space, and shown where they
carry it (`hotspot_motion`); the others are kept in deformed space, where a viewer of the edits sees them.
Titles and texts are plain text everywhere; no program reads markup in them.
"""

from __future__ import annotations

import math
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from cagefield.cameras.camera import Camera
from cagefield.cameras.keyframes import Keyframe
from cagefield.errors import CagefieldError, CameraError, SceneError
from cagefield.files import yaml_text
from cagefield.files.safe_open import read_text

MAX_HOTSPOTS = 200
"""Maximum number of hotspots of a scene."""

MAX_TITLE_CHARACTERS = 120
MAX_TEXT_CHARACTERS = 2000
"""Maximum lengths of a hotspot's title and text."""

MAX_COORDINATE = 1e9
"""Largest magnitude of a coordinate, world units."""

APPROACH = 0.5
"""Distance of a view without an own camera, as a share of the first view's distance from the hotspot."""


@dataclass(frozen=True)
class HotspotView:
    """Camera from which a hotspot is looked at: c2w [16] row by row, vertical field of view in degrees.

    Raises:
        SceneError: a pose that is not rigid, or a field of view out of range.
    """

    c2w: tuple[float, ...]
    fov_y_deg: float

    def __post_init__(self) -> None:
        try:
            Keyframe(self.c2w, self.fov_y_deg)
        except CagefieldError as error:
            raise SceneError(f"the camera of a hotspot: {error}") from None


@dataclass(frozen=True)
class Hotspot:
    """A point of a scene [3], world units, with a title, a text and the camera to look from.

    `follows`: the edits carry the position and the camera, both of canonical space; else they are of the
    edited scene, and stay.

    Raises:
        SceneError: a title without characters, a title or text that is too long or has control characters, a
            position that is not 3 finite numbers.
    """

    title: str
    position: tuple[float, float, float]
    text: str = ""
    view: HotspotView | None = None
    follows: bool = False

    def __post_init__(self) -> None:
        if not isinstance(self.follows, bool):
            raise SceneError(f"follows of a hotspot is {self.follows!r:.60}; it must be true or false")
        _check_text("title", self.title, MAX_TITLE_CHARACTERS, lines=False)
        if not self.title.strip():
            raise SceneError("the title of a hotspot is empty; give it a name")
        _check_text("text", self.text, MAX_TEXT_CHARACTERS, lines=True)
        object.__setattr__(self, "position", _point(self.position))

    def to_dict(self) -> dict[str, object]:
        """Values for a scene's manifest or a file of hotspots; no key where there is nothing to say."""
        values: dict[str, object] = {"title": self.title, "position": list(self.position)}
        if self.text:
            values["text"] = self.text
        if self.view is not None:
            values["camera"] = {"c2w": list(self.view.c2w), "fov_y_deg": self.view.fov_y_deg}
        if self.follows:
            values["follows"] = True
        return values

    @classmethod
    def from_value(cls, value: Any) -> Hotspot:
        """Hotspot of a file's value. Raises SceneError for anything that `to_dict` does not write."""
        if not isinstance(value, dict) or set(value) - {"title", "position", "text", "camera", "follows"}:
            raise SceneError(
                f"a hotspot is {value!r:.80}; it must have title and position, and may have text, camera and"
                " follows"
            )
        if "title" not in value or "position" not in value:
            raise SceneError(f"a hotspot is {value!r:.80}; it lacks title or position")
        camera = value.get("camera")
        view = None if camera is None else _view(camera)
        return cls(
            value["title"], value["position"], value.get("text", ""), view, value.get("follows", False)
        )


def hotspots_from_value(value: Any) -> tuple[Hotspot, ...]:
    """Hotspots of a manifest's or a file's list. Raises SceneError with the number of the faulty one."""
    if not isinstance(value, list | tuple):
        raise SceneError(f"hotspots is {value!r:.80}; it must be a list")
    check_count(len(value))
    hotspots = []
    for number, item in enumerate(value, start=1):
        try:
            hotspots.append(Hotspot.from_value(item))
        except SceneError as error:
            raise SceneError(f"hotspot {number}: {error}") from None
    return tuple(hotspots)


def hotspots_from_file(path: Path) -> tuple[Hotspot, ...]:
    """Hotspots of a YAML or JSON file with a list `hotspots`. Raises SceneError that names file and cure."""
    try:
        document = yaml_text.loads(read_text(path))
    except yaml_text.YamlError as error:
        line = f", line {error.line}" if error.line else ""
        raise SceneError(f"{path}{line}: {error}") from None
    except ValueError as error:
        raise SceneError(f"{path}: {error}") from None
    if not isinstance(document, dict) or set(document) != {"hotspots"}:
        raise SceneError(f"{path} must hold a list with the key hotspots, and nothing else")
    try:
        return hotspots_from_value(document["hotspots"])
    except SceneError as error:
        raise SceneError(f"{path}: {error}") from None


def check_count(count: int) -> None:
    """Raise SceneError for more hotspots than a scene takes."""
    if count > MAX_HOTSPOTS:
        raise SceneError(f"{count} hotspots; a scene has at most {MAX_HOTSPOTS}, remove some")


def resolved_view(hotspot: Hotspot, first: Camera, up: ArrayLike) -> HotspotView:
    """Camera that looks at a hotspot: its own, else one on the line from it to the first view's eye.

    `first` is the view in which the scene opens, `up` [3] the direction that is up.
    """
    if hotspot.view is not None:
        return hotspot.view
    target = np.array(hotspot.position)
    fov = 2.0 * math.atan(0.5 * min(first.width / first.fx, first.height / first.fy))
    offset = first.origin - target
    if not np.linalg.norm(offset) > 0.0:
        offset = first.c2w[:3, 2]
    eye = target + APPROACH * offset
    try:
        camera = Camera.look_at(eye, target, up, width=100, height=100, fov_x=fov)
    except CameraError:  # seen along the vertical
        camera = Camera.look_at(eye, target, first.c2w[:3, 1], width=100, height=100, fov_x=fov)
    return HotspotView(tuple(camera.c2w.reshape(-1).tolist()), math.degrees(fov))


def view_of_camera(camera: Camera) -> HotspotView:
    """View of a scene's camera; its field of view is that of the shorter side."""
    least = min(camera.width / camera.fx, camera.height / camera.fy)
    return HotspotView(tuple(camera.c2w.reshape(-1).tolist()), math.degrees(2.0 * math.atan(0.5 * least)))


def find_hotspot(hotspots: Sequence[Hotspot], name: str) -> int:
    """Index of the hotspot with a title, or with a number from 1. Raises SceneError where there is none."""
    found = [index for index, hotspot in enumerate(hotspots) if hotspot.title == name]
    if len(found) == 1:
        return found[0]
    if not found and name.isascii() and name.isdigit() and 1 <= int(name[:9]) <= len(hotspots):
        return int(name[:9]) - 1
    if found:
        numbers = ", ".join(str(index + 1) for index in found)
        raise SceneError(f'{len(found)} hotspots have the title "{name:.60}"; give one of {numbers}')
    titles = ", ".join(f'"{hotspot.title}"' for hotspot in hotspots) or "there are none"
    raise SceneError(f'"{name:.60}" is no hotspot of the scene: {titles:.400}')


def _check_text(name: str, value: object, most: int, *, lines: bool) -> None:
    if not isinstance(value, str):
        raise SceneError(f"the {name} of a hotspot must be text, got {value!r:.60}")
    if len(value) > most:
        raise SceneError(f"the {name} of a hotspot has {len(value)} characters, at most {most}; shorten it")
    permitted = "\n\t" if lines else ""
    for character in value:
        if unicodedata.category(character) in ("Cc", "Cs") and character not in permitted:
            raise SceneError(
                f"the {name} of a hotspot holds a control character, U+{ord(character):04X}; leave it out"
            )


def _point(values: Any) -> tuple[float, float, float]:
    fits = isinstance(values, list | tuple | np.ndarray) and len(values) == 3
    if not fits or any(isinstance(v, bool) or not isinstance(v, int | float | np.number) for v in values):
        raise SceneError(f"the position of a hotspot is {values!r:.80}; it must be 3 finite numbers")
    x, y, z = (float(v) if abs(v) <= MAX_COORDINATE else math.nan for v in values)
    if not all(map(math.isfinite, (x, y, z))):
        raise SceneError(
            f"the position of a hotspot is {values!r:.80}; it must be 3 finite numbers up to "
            f"{MAX_COORDINATE:g}"
        )
    return x, y, z


def _view(value: Any) -> HotspotView:
    if not isinstance(value, dict) or set(value) != {"c2w", "fov_y_deg"}:
        raise SceneError(f"camera is {value!r:.80}; it must have c2w and fov_y_deg")
    pose, fov = value["c2w"], value["fov_y_deg"]
    numbers = [*pose, fov] if isinstance(pose, list | tuple) else [None]
    if any(isinstance(v, bool) or not isinstance(v, int | float) or not abs(v) < 1e300 for v in numbers):
        raise SceneError(f"camera is {value!r:.80}; c2w must be 16 numbers and fov_y_deg one")
    return HotspotView(tuple(map(float, pose)), float(fov))
