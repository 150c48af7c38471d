"""A stage microphone on a boom stand; the boom rises towards +x."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cagefield.procedural.building import (
    MATTE,
    SHINY,
    build_part,
    place_shape,
    pose_shape,
    revolve,
    shift_parts,
    smooth,
    tube,
)
from cagefield.procedural.parts import Part, pose_matrix
from cagefield.procedural.scene import ProceduralScene
from cagefield.procedural.shapes import Box, Cylinder, Sphere, Torus
from cagefield.procedural.textures import Layered, Mottled, Plain, Rosette, Stripes, Weave, rgb_from_hex

STEEL, DARK, BLACK = rgb_from_hex("#c3c7cc"), rgb_from_hex("#515359"), rgb_from_hex("#2c2c30")
RED, BRASS = rgb_from_hex("#b3262b"), rgb_from_hex("#caa24a")
BRUSHED = Mottled(STEEL, rgb_from_hex("#9a9fa6"), 0.06, 0.4, stretch=(1, 1, 6))
POLE_X = -0.3
KNEE = np.array([POLE_X, 0.0, 0.38])
TILT = 27.0
"""Elevation of the boom in degrees."""


def microphone() -> ProceduralScene:
    """Scene with the parts base, pole, boom, (counter)weight, head and cable."""
    parts = (_base(), _pole(), _boom(), _weight(), _head(), _cable())
    return ProceduralScene("microphone", shift_parts(parts, (0, 0, -0.06)), lowest=-5.0)


def _along(distance: float) -> NDArray[np.float64]:
    """Point [3] of the boom's axis at a distance from the knee."""
    angle = np.radians(TILT)
    return KNEE + distance * np.array([np.cos(angle), 0.0, np.sin(angle)])


def _base() -> Part:
    profile = [
        (0.0, -0.95), (0.56, -0.95), (0.6, -0.92), (0.58, -0.87), (0.34, -0.83), (0.13, -0.8), (0.09, -0.72),
        (0.0, -0.72),
    ]  # fmt: skip
    top = Rosette(BLACK, rgb_from_hex("#666a72"), 12, 0.43, ring=RED)
    feet = [(POLE_X + 0.5 * np.cos(a), 0.5 * np.sin(a), -0.955) for a in np.radians([30, 150, 270])]
    return build_part(
        "base",
        revolve(profile, top, (POLE_X, 0, 0)),
        place_shape(Cylinder(0.07, 0.03, 0.01), Plain(rgb_from_hex("#6b6d70")), feet, gloss=MATTE),
    )


def _pole() -> Part:
    screw = pose_matrix((POLE_X, -0.105, -0.13), (90, 0, 0))
    return build_part(
        "pole",
        place_shape(Cylinder(0.058, 0.3, 0.005), BRUSHED, (POLE_X, 0, -0.45), gloss=SHINY),
        place_shape(
            Cylinder(0.085, 0.095, 0.015), Stripes(BLACK, DARK, (0, 0, 1), 0.055), (POLE_X, 0, -0.13)
        ),
        place_shape(Cylinder(0.045, 0.22, 0.005), BRUSHED, (POLE_X, 0, 0.14), gloss=SHINY),
        pose_shape(Cylinder(0.07, 0.035, 0.012), Rosette(RED, BRASS, 5, 0.06), [screw]),
    )


def _boom() -> Part:
    turn = pose_matrix(KNEE, (0, 90 - TILT, 0))
    knob = pose_matrix(KNEE + np.array([0, -0.115, 0]), (90, 0, 0))
    return build_part(
        "boom",
        pose_shape(Cylinder(0.042, 0.505, 0.005), BRUSHED, [turn @ pose_matrix((0, 0, 0.255))], gloss=SHINY),
        pose_shape(Sphere(0.1), Plain(DARK), [turn], gloss=SHINY),
        pose_shape(Cylinder(0.075, 0.035, 0.012), Rosette(RED, BRASS, 5, 0.065), [knob]),
    )


def _weight() -> Part:
    skin = Stripes(BLACK, RED, (0, 0, 1), 0.22, 0.25, 0.5)
    turn = pose_matrix(KNEE, (0, 90 - TILT, 0))
    return build_part(
        "weight", pose_shape(Cylinder(0.11, 0.12, 0.025), skin, [turn @ pose_matrix((0, 0, -0.38))])
    )


def _head() -> Part:
    """Local z runs from the tail of the microphone to its grille, which looks forwards and down."""
    aim = pose_matrix(_along(0.83), (0, 125, 0))
    grille = Weave(rgb_from_hex("#dfe2e5"), rgb_from_hex("#5b5e63"), 18, 5.5)
    skin = Layered(Plain(BLACK), Stripes(DARK, BLACK, (0, 0, 1), 0.08, 0.3), 2, -0.02)
    body = revolve([(0, -0.4), (0.075, -0.4), (0.09, -0.38), (0.1, -0.2), (0.155, 0.04), (0, 0.04)], skin)
    return build_part(
        "head",
        pose_shape(Sphere(), grille, [aim @ pose_matrix((0, 0, 0.2), scale=(0.22, 0.22, 0.23))], gloss=SHINY),
        pose_shape(Torus(0.205, 0.03), Plain(BRASS), [aim @ pose_matrix((0, 0, 0.16))], gloss=SHINY),
        pose_shape(
            Cylinder(0.165, 0.04, 0.012), Plain(STEEL), [aim @ pose_matrix((0, 0, 0.04))], gloss=SHINY
        ),
        pose_shape(body.shape, skin, [aim @ pose for pose in body.poses]),
        pose_shape(
            Box((0.03, 0.022, 0.06), 0.012), Plain(RED), [aim @ pose_matrix((-0.13, 0, -0.1), (0, 14, 0))]
        ),
        pose_shape(Torus(0.125, 0.03), Plain(DARK), [aim @ pose_matrix((0, 0, -0.12))]),
        pose_shape(Cylinder(0.045, 0.05, 0.01), Plain(DARK), [pose_matrix(_along(0.76), (0, 90 - TILT, 0))]),
    )


def _cable() -> Part:
    start = _along(0.83) - 0.4 * pose_matrix((0, 0, 0), (0, 125, 0))[:3, 2]
    drop = [
        (start[0], start[2]),
        (start[0] - 0.12, start[2] + 0.02),
        (0.0, 0.62),
        (-0.02, 0.2),
        (-0.13, -0.02),
        (-0.25, -0.1),
    ]
    return build_part("cable", tube([(x, 0.07, z) for x, z in smooth(drop, 5)], 0.025, Plain(RED)))
