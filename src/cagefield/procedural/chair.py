"""An upholstered arm chair; it faces +x."""

from __future__ import annotations

import numpy as np

from cagefield.procedural.building import (
    MATTE,
    SATIN,
    SHINY,
    Points2,
    build_part,
    place_shape,
    pose_shape,
    revolve,
    smooth,
    tube,
)
from cagefield.procedural.parts import Part, Primitive, pose_matrix
from cagefield.procedural.scene import ProceduralScene
from cagefield.procedural.shapes import Box, Extrusion, Sphere
from cagefield.procedural.textures import Plain, Texture, Tiled, Wood, rgb_from_hex

LIGHT, DARK = rgb_from_hex("#a9683a"), rgb_from_hex("#6f3d20")
OAK = Wood(LIGHT, DARK)
CLOTH, SPRIG, GOLD = rgb_from_hex("#e9e0c8"), rgb_from_hex("#356b5e"), rgb_from_hex("#c99a3b")
FABRIC = Tiled(CLOTH, SPRIG, GOLD, 0.16)
SEAT_Z = -0.12


def chair() -> ProceduralScene:
    """Scene with the parts seat, cushion, back, four legs and two arm rests.

    Back, cushion and arm rests touch the seat alone, so that a cage can hold one of them alone.
    """
    legs = [
        _leg(f"leg {end} {side}", x, y)
        for end, x in (("front", 0.4), ("back", -0.4))
        for side, y in (("left", 0.4), ("right", -0.4))
    ]
    arms = [_arm("arm rest left", 1.0), _arm("arm rest right", -1.0)]
    return ProceduralScene("chair", (_seat(), _cushion(), _back(), *legs, *arms), lowest=-15.0)


def _seat() -> Part:
    rail = Wood(LIGHT, DARK, axis=0)
    return build_part(
        "seat",
        place_shape(Box((0.47, 0.47, 0.055), 0.02), rail, (0, 0, SEAT_Z)),
        place_shape(Box((0.44, 0.44, 0.02), 0.015), Plain(DARK), (0, 0, SEAT_Z + 0.06)),
    )


def _cushion() -> Part:
    corners = ((1, 1), (-1, 1), (-1, -1), (1, -1))
    piping = [(0.05 + 0.358 * x, 0.358 * y, SEAT_Z + 0.16) for x, y in (*corners, corners[0])]
    buttons = [
        pose_matrix((0.05 + 0.18 * x, 0.18 * y, SEAT_Z + 0.228), scale=(0.025, 0.025, 0.012))
        for x, y in corners
    ]
    return build_part(
        "cushion",
        place_shape(Box((0.36, 0.36, 0.07), 0.065), FABRIC, (0.05, 0, SEAT_Z + 0.16), gloss=MATTE),
        tube(piping, 0.016, Plain(GOLD), gloss=MATTE),
        pose_shape(Sphere(), Plain(GOLD), buttons),
    )


def _back() -> Part:
    """Frame and panel on two stiles, in a plane that leans back: local x across, y up, z to the rear."""
    lean = (
        pose_matrix((-0.4, 0, SEAT_Z + 0.08), (0, -10, 0))
        @ pose_matrix((0, 0, 0), (90, 0, 0))
        @ pose_matrix((0, 0, 0), (0, 90, 0))
    )
    crown: Points2 = smooth(
        [(0.45, 0.72), (0.3, 0.88), (0.12, 0.98), (0, 1.0), (-0.12, 0.98), (-0.3, 0.88), (-0.45, 0.72)], 3
    )
    frame = [(0.41, 0.2), *crown, (-0.41, 0.2)]
    middle = np.array([0.0, 0.6])
    inner = [(0.78 * x, float(middle[1] + 0.78 * (y - middle[1]) + 0.02)) for x, y in frame]

    def panel(
        outline: Points2,
        depth: float,
        half: float,
        texture: Texture,
        rounding: float,
        gloss: tuple[float, float],
    ) -> Primitive:
        centered = tuple((x, y - 0.5) for x, y in outline)
        pose = lean @ pose_matrix((0, 0.5, depth))
        return pose_shape(Extrusion(centered, half - rounding, rounding), texture, [pose], gloss=gloss)

    return build_part(
        "back",
        panel(frame, 0.0, 0.035, Wood(LIGHT, DARK, axis=1), 0.015, SATIN),
        panel(inner, 0.0, 0.065, FABRIC, 0.025, MATTE),
        pose_shape(
            Box((0.03, 0.11, 0.03), 0.01),
            Wood(LIGHT, DARK, axis=1),
            [lean @ pose_matrix((x, 0.117, 0)) for x in (-0.38, 0.38)],
        ),
        pose_shape(Sphere(0.045), Plain(GOLD), [lean @ pose_matrix((0, 1.035, 0))], gloss=SHINY),
    )


def _leg(name: str, x: float, y: float) -> Part:
    top, foot = SEAT_Z - 0.04, -0.93
    vase = [
        (0.045, top - 0.12), (0.07, top - 0.17), (0.04, top - 0.22), (0.058, top - 0.4),
        (0.03, foot + 0.12), (0.055, foot + 0.06), (0.03, foot),
    ]  # fmt: skip
    profile = [(0.0, top), (0.062, top), (0.062, top - 0.1), *smooth(vase), (0.0, foot)]
    return build_part(name, revolve(profile, OAK, (x, y, 0.0)))


def _arm(name: str, side: float) -> Part:
    """Arm rest at +y (side 1) or -y (side -1), on a post that leans outwards from the seat."""
    top, foot, y = SEAT_Z + 0.42, SEAT_Z + 0.115, 0.49 * side
    path = smooth([(-0.32, 0.0), (-0.2, 0.03), (0.1, 0.02), (0.36, -0.01), (0.43, -0.06)], 3)
    post = smooth([(0.33, top - 0.03), (0.37, top - 0.14), (0.4, foot + 0.06), (0.435, foot)], 3)
    lean = np.linspace(y, 0.443 * side, len(post))
    return build_part(
        name,
        tube([(x, y, top + z) for x, z in path], 0.045, Wood(LIGHT, DARK, axis=0)),
        tube([(x, at_y, z) for (x, z), at_y in zip(post, lean, strict=True)], 0.034, OAK),
        place_shape(
            Box((0.13, 0.05, 0.034), 0.03), Plain(SPRIG, 0.08, 0.05), (-0.02, y, top + 0.045), gloss=MATTE
        ),
    )
