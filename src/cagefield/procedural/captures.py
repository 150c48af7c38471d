"""Captures of the built-in rooms by name: the room and the path of the phone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

from cagefield.cameras.camera import Camera
from cagefield.errors import SceneError
from cagefield.procedural.hand_held import Phone, look_outwards, orbit_target
from cagefield.procedural.rooms import ROOMS
from cagefield.procedural.scene import ProceduralScene
from cagefield.procedural.variations import split_name


@dataclass(frozen=True)
class Capture:
    """Capture of a room: `cameras(phone, number of photos, seed)` returns its cameras.

    target      the point that the cameras go round, None where they look outwards
    variations  names of `variations.VARIATIONS`, by which its training photos differ
    """

    name: str
    phone: Phone
    views: int
    cameras: Callable[[Phone, int, int], tuple[Camera, ...]]
    target: tuple[float, float, float] | None = None
    variations: tuple[str, ...] = ()

    @property
    def scene(self) -> ProceduralScene:
        """Room and its contents; one cached object per room, whose light is computed once."""
        return _room(split_name(self.name)[0])


@cache
def _room(name: str) -> ProceduralScene:
    return ROOMS[name]()


_DIGGER, _CHAIR, _MICROPHONE = (0.0, 0.0, -0.05), (0.2, 0.3, 0.1), (0.1, 0.0, 0.2)
"""Points that the cameras go round."""


def _circle(phone: Phone, count: int, seed: int) -> tuple[Camera, ...]:
    return orbit_target(
        phone, _DIGGER, count=count, seed=seed + 1, start_deg=-90, sweep_deg=360, turns=2,
        distance=(2.2, 3.1), height=(0.5, 2.2),
    )  # fmt: skip


def _arc(phone: Phone, count: int, seed: int) -> tuple[Camera, ...]:
    return orbit_target(
        phone, _CHAIR, count=count, seed=seed + 2, start_deg=-105, sweep_deg=75,
        distance=(2.9, 3.9), height=(0.2, 1.5),
    )  # fmt: skip


def _close_up(phone: Phone, count: int, seed: int) -> tuple[Camera, ...]:
    return orbit_target(
        phone, _MICROPHONE, count=count, seed=seed + 3, start_deg=-190, sweep_deg=200, turns=2,
        distance=(1.3, 1.9), height=(-0.1, 1.0), sway=0.12,
    )  # fmt: skip


def _tour(phone: Phone, count: int, seed: int) -> tuple[Camera, ...]:
    return look_outwards(
        phone, (0.5, -0.5, 1.2), count=count, seed=seed + 4, radius=2.6, drop_deg=14, turns=3
    )


CAPTURES = {
    capture.name: capture
    for capture in (
        Capture("room-digger", Phone(distortion=(0.045, -0.02, 0.0, 0.0)), 64, _circle, _DIGGER),
        Capture("room-chair", Phone(640, 360, 66.0), 48, _arc, _CHAIR),
        Capture(
            "room-microphone",
            Phone(distortion=(-0.03, 0.0, 0.0008, -0.0006), adapts=0.7),
            56,
            _close_up,
            _MICROPHONE,
        ),
        Capture("room-plant", Phone(fov_x_deg=58.0), 96, _tour),
    )
}


def is_capture(name: str) -> bool:
    """Whether `name` is a built-in room, with variations or without."""
    return name.split("+")[0] in CAPTURES


def capture(name: str) -> Capture:
    """Capture of a name, with the variations after plus signs.

    Raises SceneError that lists the names.
    """
    room, variations = split_name(name)
    if room not in CAPTURES:
        raise SceneError(f"there is no built-in room {room!r}; choose one of {', '.join(CAPTURES)}")
    return replace(CAPTURES[room], name=name, variations=variations) if variations else CAPTURES[room]
