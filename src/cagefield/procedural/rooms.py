"""Built-in scenes in rooms: white walls, a window with an outside, a floor, polished tables.

World as in the scenes alone: z up, the object within about [-1,1]^3, some 25 cm a unit. The window is in the
+y wall.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from cagefield.procedural.building import MATTE, SATIN, SHINY, build_part, place_shape, revolve
from cagefield.procedural.chair import chair
from cagefield.procedural.digger import digger
from cagefield.procedural.microphone import microphone
from cagefield.procedural.parts import Part, Primitive, pose_matrix
from cagefield.procedural.plant import plant
from cagefield.procedural.room_light import Room
from cagefield.procedural.scene import ProceduralScene
from cagefield.procedural.shapes import Box, Cylinder
from cagefield.procedural.textures import (
    Grid,
    Layered,
    Mottled,
    Plain,
    Ramp,
    Rgb,
    Stripes,
    Texture,
    rgb_from_hex,
)

WALL_THICKNESS = 0.6
"""Thickness of walls, floor and ceiling, room units."""

WHITE, CREAM = rgb_from_hex("#f3f1ec"), rgb_from_hex("#efe7d6")
FRAME = Plain(rgb_from_hex("#fbfaf6"), 0.0)
SKY_DISTANCE = 60.0
"""Distance of the sky outside, room units."""


def room_digger() -> ProceduralScene:
    """The digger on a dark, polished table in the middle of a white room."""
    room = Room((-7.5, -8.0, -3.5), (7.5, 7.0, 6.5), ((-3.2, -0.3), (2.2, 4.4)))
    table = _table((0.0, 0.1), (2.3, 1.7), -0.5, room.low[2], Plain(rgb_from_hex("#54382a"), 0.015), 0.06)
    return _build_room_scene(
        "room-digger", room, (*digger().parts, table), floor=Plain(rgb_from_hex("#b9b2a6"), 0.008)
    )


def room_chair() -> ProceduralScene:
    """The chair on a floor of boards, near the corner of a cream room."""
    room = Room((-3.2, -9.0, -0.93), (9.0, 3.4, 9.0), ((2.2, 1.4), (6.6, 6.2)), brightness=8.0)
    floor = _boards(rgb_from_hex("#a98a66"), rgb_from_hex("#86694a"), 1.1)
    things = (*_turn_parts(chair().parts, -40.0), _framed_print(room, 0.2, 2.6, 1.0, 0.75))
    return _build_room_scene("room-chair", room, things, floor=floor, walls=Plain(CREAM, 0.004))


def room_microphone() -> ProceduralScene:
    """The microphone on a white, polished table close to the window."""
    room = Room((-6.0, -9.0, -4.0), (8.0, 4.2, 6.0), ((-4.4, -0.4), (1.0, 3.6)), brightness=5.0)
    table = _table((0.2, 0.0), (2.0, 1.5), -1.045, room.low[2], Plain(rgb_from_hex("#e6e3dc"), 0.004), 0.09)
    book = build_part(
        "book",
        place_shape(
            Box((0.42, 0.3, 0.07), 0.01),
            Layered(Plain(WHITE), Plain(rgb_from_hex("#3f6b8c"), 0.02), 2, 0.05),
            (1.2, -0.6, -0.975),
            rotate_deg=(0, 0, 24),
        ),
    )
    return _build_room_scene("room-microphone", room, (*microphone().parts, table, book))


def room_plant() -> ProceduralScene:
    """A larger room with the plant on its table, the chair, the digger on a shelf, and a lamp."""
    room = Room(
        (-11.0, -10.0, -3.0), (11.0, 9.0, 7.5), ((-3.5, -0.2), (4.5, 5.0)), brightness=6.5, detail=0.05
    )
    floor = room.low[2]
    plants = _move_parts(plant().parts, (-1.0, 5.0, floor + 1.97), 2.1)
    chairs = _move_parts(_turn_parts(chair().parts, 200.0), (6.8, 0.5, floor + 1.95), 2.1)
    diggers = _move_parts(_turn_parts(digger().parts, 115.0), (-8.9, -2.0, floor + 2.66), 1.2)
    shelf = _table(
        (-9.2, -2.0), (1.6, 2.6), floor + 2.06, floor, Plain(rgb_from_hex("#d9d4c8"), 0.004), 0.05, "shelf"
    )
    lamp = build_part(
        "lamp",
        place_shape(Cylinder(0.9, 0.05, 0.03), Plain(rgb_from_hex("#3a3a3c")), (7.8, -7.2, floor + 0.05)),
        place_shape(Cylinder(0.06, 2.6), Plain(rgb_from_hex("#3a3a3c")), (7.8, -7.2, floor + 2.6)),
        revolve(
            [(0.0, 0.0), (1.1, 0.0), (0.7, 1.2), (0.0, 1.2)],
            Plain(rgb_from_hex("#f1e3c0"), 0.01),
            (7.8, -7.2, floor + 5.0),
            rounding=0.03,
        ),
    )
    parts = (
        *plants,
        *(replace(p, name=f"chair {p.name}") for p in chairs),
        *(replace(p, name=f"digger {p.name}") for p in diggers),
        shelf,
        lamp,
        _framed_print(room, -7.0, 2.2, 1.5, 1.1),
        _door(room),
    )
    return _build_room_scene(
        "room-plant", room, parts, floor=_boards(rgb_from_hex("#c3b39a"), rgb_from_hex("#a89678"), 1.6)
    )


ROOMS: dict[str, Callable[[], ProceduralScene]] = {
    "room-digger": room_digger,
    "room-chair": room_chair,
    "room-microphone": room_microphone,
    "room-plant": room_plant,
}


def _build_room_scene(
    name: str,
    room: Room,
    things: Sequence[Part],
    *,
    floor: Texture | None = None,
    walls: Texture | None = None,
) -> ProceduralScene:
    """Scene of a room and the things in it."""
    shell = _shell(room, floor or Plain(rgb_from_hex("#c9c4ba"), 0.006), walls or Plain(WHITE, 0.004))
    room = replace(room, shell=tuple(p.name for p in shell))
    return ProceduralScene(name, (*things, *shell), room=room)


def _shell(room: Room, floor: Texture, walls: Texture) -> tuple[Part, ...]:
    """Parts of the room itself: walls with a window, floor, ceiling, skirting boards, and the outside."""
    (x0, y0, z0), (x1, y1, z1) = room.low, room.high
    (u0, v0), (u1, v1) = room.window
    t = WALL_THICKNESS

    def slab(
        texture: Texture, low: tuple[float, float, float], high: tuple[float, float, float]
    ) -> Primitive:
        corners = np.array([low, high])
        half = (corners[1] - corners[0]) / 2
        return place_shape(
            Box((float(half[0]), float(half[1]), float(half[2]))), texture, corners.mean(0), gloss=MATTE
        )

    ceiling = Plain(rgb_from_hex("#f7f6f2"), 0.003)
    window_wall = (
        slab(walls, (x0, y1, z0), (u0, y1 + t, z1)),
        slab(walls, (u1, y1, z0), (x1, y1 + t, z1)),
        slab(walls, (u0, y1, z0), (u1, y1 + t, v0)),
        slab(walls, (u0, y1, v1), (u1, y1 + t, z1)),
    )
    closed_walls = (
        slab(walls, (x0 - t, y0 - t, z0), (x0, y1 + t, z1)),
        slab(walls, (x1, y0 - t, z0), (x1 + t, y1 + t, z1)),
        slab(walls, (x0, y0 - t, z0), (x1, y0, z1)),
    )
    bar, deep, middle = 0.14, 0.12, (u0 + u1) / 2
    frame = (
        slab(FRAME, (u0, y1 + 0.2, v0), (u0 + bar, y1 + 0.2 + deep, v1)),
        slab(FRAME, (u1 - bar, y1 + 0.2, v0), (u1, y1 + 0.2 + deep, v1)),
        slab(FRAME, (middle - bar / 2, y1 + 0.2, v0), (middle + bar / 2, y1 + 0.2 + deep, v1)),
        slab(FRAME, (u0, y1 + 0.2, v0), (u1, y1 + 0.2 + deep, v0 + bar)),
        slab(FRAME, (u0, y1 + 0.2, v1 - bar), (u1, y1 + 0.2 + deep, v1)),
        slab(FRAME, (u0 - 0.15, y1 - 0.25, v0 - 0.1), (u1 + 0.15, y1, v0)),
    )
    foot, rise = 0.05, 0.32
    skirting = (
        slab(FRAME, (x0, y0, z0), (x0 + foot, y1, z0 + rise)),
        slab(FRAME, (x1 - foot, y0, z0), (x1, y1, z0 + rise)),
        slab(FRAME, (x0, y0, z0), (x1, y0 + foot, z0 + rise)),
        slab(FRAME, (x0, y1 - foot, z0), (x1, y1, z0 + rise)),
    )
    return (
        Part("walls", (*closed_walls, *window_wall)),
        Part("floor", (slab(floor, (x0 - t, y0 - t, z0 - t), (x1 + t, y1 + t, z0)),)),
        Part("ceiling", (slab(ceiling, (x0 - t, y0 - t, z1), (x1 + t, y1 + t, z1 + t)),)),
        Part("window frame", frame),
        Part("skirting", skirting),
        _outside(y1),
    )


def _outside(wall: float) -> Part:
    """Sky with hills below it and some houses in front, all brighter than white paper in the room."""
    haze, blue = rgb_from_hex("#f4f7fa"), rgb_from_hex("#9cc3ea")
    sky = Layered(
        Mottled(rgb_from_hex("#8fa57e"), rgb_from_hex("#b4c09c"), 6.0, 0.5),
        Ramp(haze, blue, 2, -20.0, 40.0, 0.0),
        2,
        -16.0,
        2.0,
    )
    grass = Mottled(rgb_from_hex("#8ea36c"), rgb_from_hex("#a8b884"), 3.0, 0.5)
    back = wall + SKY_DISTANCE

    def bright(primitive: Primitive, factor: float = 1.12) -> Primitive:
        return replace(primitive, luminous=factor)

    houses = []
    for index, (x, y, half, tall) in enumerate(
        [(-16.0, 24.0, 4.0, 7.0), (-3.0, 36.0, 5.0, 10.0), (9.0, 27.0, 3.5, 5.5), (24.0, 40.0, 7.0, 9.0)]
    ):
        paint = (
            rgb_from_hex("#d9b48f"),
            rgb_from_hex("#cfd3d6"),
            rgb_from_hex("#c98f7a"),
            rgb_from_hex("#e2d9b8"),
        )[index]
        front = Grid(rgb_from_hex("#6d7f90"), paint, 1.9, 0.55, (0, 2), 0.08)
        houses.append(place_shape(Box((half, 2.0, tall)), front, (x, wall + y, tall - 20.0)))
    return build_part(
        "outside",
        bright(place_shape(Box((2 * SKY_DISTANCE, 1.0, SKY_DISTANCE)), sky, (0, back, 0))),
        bright(
            place_shape(
                Box((1.0, SKY_DISTANCE, SKY_DISTANCE)),
                sky,
                [(-2 * SKY_DISTANCE, wall + SKY_DISTANCE, 0), (2 * SKY_DISTANCE, wall + SKY_DISTANCE, 0)],
            )
        ),
        bright(
            place_shape(
                Box((2 * SKY_DISTANCE, SKY_DISTANCE, 1.0)),
                Plain(blue, 0.0),
                (0, wall + SKY_DISTANCE, SKY_DISTANCE),
            )
        ),
        bright(
            place_shape(
                Box((2 * SKY_DISTANCE, SKY_DISTANCE / 2, 1.0)),
                grass,
                (0, wall + SKY_DISTANCE / 2 + 2.0, -21.0),
            ),
            1.0,
        ),
        *(bright(house, 0.95) for house in houses),
    )


def _table(
    middle: tuple[float, float],
    half: tuple[float, float],
    top: float,
    floor: float,
    texture: Texture,
    mirror: float,
    name: str = "table",
) -> Part:
    """Table with a polished top at height `top` and four legs down to `floor`."""
    (x, y), (a, b) = middle, half
    board = place_shape(Box((a, b, 0.07), 0.03), texture, (x, y, top - 0.07), gloss=SHINY)
    height = (top - 0.14 - floor) / 2
    corners = [(x + i * (a - 0.25), y + j * (b - 0.25), floor + height) for i in (-1, 1) for j in (-1, 1)]
    legs = place_shape(Box((0.1, 0.1, height), 0.02), texture, corners, gloss=SATIN)
    return build_part(name, replace(board, mirror=mirror), legs)


def _framed_print(room: Room, x: float, z: float, half_width: float, half_height: float) -> Part:
    """Framed print on the +y wall."""
    y = room.high[1]
    print_ = Mottled(rgb_from_hex("#2f5f7a"), rgb_from_hex("#e0b25c"), 0.7, 0.9)
    return build_part(
        "picture",
        place_shape(
            Box((half_width, 0.05, half_height), 0.01), Plain(rgb_from_hex("#3b3029"), 0.02), (x, y - 0.05, z)
        ),
        place_shape(
            Box((half_width - 0.12, 0.06, half_height - 0.12)), print_, (x, y - 0.06, z), gloss=MATTE
        ),
    )


def _door(room: Room) -> Part:
    """White door in the -y wall."""
    y, floor = room.low[1], room.low[2]
    leaf = Plain(rgb_from_hex("#e9e5da"), 0.004)
    return build_part(
        "door",
        place_shape(
            Box((1.7, 0.06, 4.0)), Plain(rgb_from_hex("#d8d3c6"), 0.004), (2.0, y + 0.06, floor + 4.0)
        ),
        place_shape(Box((1.5, 0.08, 3.85), 0.02), leaf, (2.0, y + 0.08, floor + 3.85)),
        place_shape(
            Cylinder(0.09, 0.14, 0.02),
            Plain(rgb_from_hex("#b7b9bb")),
            (3.2, y + 0.2, floor + 3.9),
            rotate_deg=(90, 0, 0),
        ),
    )


def _boards(first: Rgb, second: Rgb, width: float) -> Texture:
    """Texture of a floor of boards along y: thin seams alone."""
    return Stripes(first, second, (1, 0, 0), width, 0.02, 0.3, 0.01)


def _turn_parts(parts: Sequence[Part], degrees: float) -> tuple[Part, ...]:
    """Parts rotated about the z axis."""
    return _pose_parts(parts, pose_matrix((0, 0, 0), (0, 0, degrees)))


def _move_parts(parts: Sequence[Part], by: ArrayLike, scale: float = 1.0) -> tuple[Part, ...]:
    """Parts magnified about the origin, then moved."""
    return _pose_parts(parts, pose_matrix(by, scale=scale))


def _pose_parts(parts: Sequence[Part], pose: np.ndarray) -> tuple[Part, ...]:
    return tuple(
        replace(p, primitives=tuple(replace(item, poses=pose @ item.poses) for item in p.primitives))
        for p in parts
    )
