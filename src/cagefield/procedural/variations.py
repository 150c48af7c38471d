"""Variations between the training photos of a capture: persons, a moved backdrop, flash, exposure, white
balance.

A capture's name takes variations after plus signs, in any order: `room-chair+person+exposure`. Held-out
photos show the room alone, in the exposure of the capture without variations: they are the ground truth.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cagefield.cameras.camera import Camera
from cagefield.errors import SceneError
from cagefield.procedural.distractors import place_person_in_view, place_sheet_behind
from cagefield.procedural.hand_held import random_walk
from cagefield.procedural.parts import Part
from cagefield.procedural.scene import ProceduralScene
from cagefield.typing import Float32

VARIATIONS = {
    "person": "a person who stands elsewhere in each of two fifths of the photos",
    "backdrop": "a checkered sheet, held elsewhere behind the object in half of the photos",
    "flash": "a flash at the camera in half of the photos",
    "exposure": "a gain of its own, from 1/1.5 to 1.5, for each photo",
    "balance": "a white balance that drifts by some 8 % from photo to photo",
}

PERSON_SHARE, BACKDROP_SHARE, FLASH_SHARE = 0.4, 0.5, 0.5
"""Shares of the training photos."""

MAX_EXPOSURE_GAIN = 1.5
BALANCE_DEVIATION = 0.08
"""Deviation of the logarithms of the gains of red and of blue."""


@dataclass(frozen=True)
class Changes:
    """Differences of one photo from the capture without variations; gains [3] are of linear light."""

    parts: tuple[Part, ...]
    flash: bool
    gains: Float32

    @property
    def has_other_content(self) -> bool:
        """Whether the photo shows other content, not only another exposure."""
        return bool(self.parts) or self.flash


def split_name(name: str) -> tuple[str, tuple[str, ...]]:
    """(room, variations) of a capture's name. Raises SceneError for unknown variations."""
    room, *names = name.split("+")
    for variation in names:
        if variation not in VARIATIONS:
            raise SceneError(
                f"there is no variation {variation!r} of captures; choose of {', '.join(VARIATIONS)}, "
                f"as in {room}+person+exposure"
            )
        if names.count(variation) > 1:
            raise SceneError(f"the variation {variation!r} is given twice in {name}; give it once")
    return room, tuple(names)


def draw_changes(
    variations: Sequence[str],
    scene: ProceduralScene,
    cameras: Sequence[Camera],
    target: tuple[float, float, float] | None,
    training: Sequence[bool],
    seed: int,
) -> tuple[Changes, ...]:
    """Random changes of each photo; `training` says which photos may differ, `target` [3] is the point they
    look at.

    Each variation has random numbers of its own, so that other variations do not affect it.
    """
    count = len(cameras)
    rngs = {name: np.random.RandomState([seed, 100 + i]) for i, name in enumerate(VARIATIONS)}
    parts: list[list[Part]] = [[] for _ in cameras]
    if "person" in variations:
        remaining = round(PERSON_SHARE * sum(training))
        for index in rngs["person"].permutation(np.flatnonzero(training)):
            person = place_person_in_view(scene, cameras[index], rngs["person"]) if remaining else None
            if person is not None:
                parts[index].append(person)
                remaining -= 1
    if "backdrop" in variations:
        for index in _draw_share(training, BACKDROP_SHARE, rngs["backdrop"]):
            parts[index].append(place_sheet_behind(scene, cameras[index], target, rngs["backdrop"]))
    flash = set(_draw_share(training, FLASH_SHARE, rngs["flash"])) if "flash" in variations else set()
    gains = np.ones((count, 3), np.float32)
    if "exposure" in variations:
        gains *= np.exp(rngs["exposure"].uniform(-1, 1, (count, 1)) * np.log(MAX_EXPOSURE_GAIN)).astype(
            np.float32
        )
    if "balance" in variations:
        gains *= np.exp(
            random_walk(rngs["balance"], count, (BALANCE_DEVIATION, 0.0, BALANCE_DEVIATION))
        ).astype(np.float32)
    gains[~np.asarray(training, bool)] = 1.0
    return tuple(Changes(tuple(parts[i]), i in flash, gains[i]) for i in range(count))


def _draw_share(training: Sequence[bool], share: float, rng: np.random.RandomState) -> list[int]:
    """Random indices of a share of the training photos."""
    names = np.flatnonzero(training)
    return [int(i) for i in rng.permutation(names)[: round(share * len(names))]]
