"""A potted plant and a pinecone on a round table."""

from __future__ import annotations

import numpy as np

from cagefield.procedural.building import MATTE, SATIN, at, part, posed, smooth, tube, turned
from cagefield.procedural.parts import Part, place
from cagefield.procedural.scene import ProceduralScene
from cagefield.procedural.shapes import Cylinder, Leaf, Sphere, Torus
from cagefield.procedural.textures import Mottled, Plain, Ramp, Veined, Wood, Zigzag, hexcolor

TABLE_Z = -0.45
POT_X, POT_Y = -0.22, 0.12
CONE_X, CONE_Y = 0.42, -0.3


def plant() -> ProceduralScene:
    """Scene with the parts table, pot, plant, flower and pinecone."""
    return ProceduralScene("plant", (_table(), _pot(), _plant(), _flower(), _pinecone()), lowest=0.0)


def _table() -> Part:
    wood = Wood(hexcolor("#d8b07c"), hexcolor("#a87845"), axis=0, period=0.11)
    legs = [(0.6 * np.cos(a), 0.6 * np.sin(a), -0.72) for a in np.radians([45, 165, 285])]
    return part(
        "table",
        at(Cylinder(0.88, 0.04, 0.025), wood, (0, 0, TABLE_Z - 0.04)),
        at(Torus(0.885, 0.018), Plain(hexcolor("#6f4526")), (0, 0, TABLE_Z - 0.04)),
        at(Cylinder(0.055, 0.22, 0.02), Wood(hexcolor("#a87845"), hexcolor("#6f4526")), legs),
        at(Cylinder(0.62, 0.02, 0.01), Plain(hexcolor("#7d5230")), (0, 0, TABLE_Z - 0.1)),
    )


def _pot() -> Part:
    base = TABLE_Z
    profile = [
        (0.0, base), (0.19, base), (0.21, base + 0.02), (0.285, base + 0.33), (0.32, base + 0.34),
        (0.325, base + 0.42), (0.275, base + 0.42), (0.265, base + 0.36), (0.0, base + 0.36),
    ]  # fmt: skip
    clay = Zigzag(hexcolor("#c4673d"), hexcolor("#f0e2c8"), hexcolor("#2f5d73"), 14, -0.03)
    soil = Mottled(hexcolor("#4a3323"), hexcolor("#6d5038"), 0.05, 0.8)
    return part(
        "pot",
        turned(profile, clay, (POT_X, POT_Y, 0), rounding=0.006),
        at(Cylinder(0.275, 0.02, 0.01), soil, (POT_X, POT_Y, base + 0.37), gloss=MATTE),
    )


def _plant() -> Part:
    stem = smooth([(0, 0), (0.03, 0.2), (-0.02, 0.45), (0.03, 0.68)], 4)
    top = TABLE_Z + 0.38
    leaves, golden = [], 137.5
    for k in range(15):
        up = k / 14
        height, tilt = top + 0.05 + 0.5 * up, 12 + 48 * up
        size = 1.0 - 0.45 * up
        turn = place((POT_X, POT_Y, height), (0, 0, golden * k)) @ place((0, 0, 0), (0, -tilt, 0))
        leaves.append(turn @ place((0.25 * size, 0, 0.0), scale=size))
    leaf = Leaf(0.46, 0.17, 0.012, bend=0.9)
    return part(
        "plant",
        tube([(POT_X + x, POT_Y, top + z - 0.02) for x, z in stem], 0.022, Plain(hexcolor("#5d7a36"))),
        tube([(POT_X + 0.03, POT_Y, TABLE_Z + z) for z in (1.0, 1.15)], 0.018, Plain(hexcolor("#5d7a36"))),
        posed(leaf, Veined(hexcolor("#3f8f3a"), hexcolor("#a9cf6b"), 0.46), leaves),
    )


def _flower() -> Part:
    center = np.array([POT_X + 0.03, POT_Y, TABLE_Z + 1.27])
    face = place(center, (0, 35, -40))
    petals = [
        face @ place((0, 0, 0), (0, 0, k * 40)) @ place((0.12, 0, 0.015), (0, -15, 0)) for k in range(9)
    ]
    return part(
        "flower",
        tube([(POT_X + 0.03, POT_Y, TABLE_Z + 1.17), tuple(center)], 0.018, Plain(hexcolor("#5d7a36"))),
        posed(Leaf(0.2, 0.1, 0.01, bend=0.8), Veined(hexcolor("#e4568a"), hexcolor("#f7b4cb"), 0.2), petals),
        posed(
            Sphere(),
            Mottled(hexcolor("#f3c53b"), hexcolor("#c98a1c"), 0.3, 0.8),
            [face @ place((0, 0, 0.02), scale=(0.065, 0.065, 0.04))],
        ),
    )


def _pinecone() -> Part:
    height, count = 0.42, 72
    axis = place((CONE_X, CONE_Y, TABLE_Z + 0.02))
    scales = []
    for k in range(count):
        up = (k + 0.5) / count
        z = height * (0.06 + 0.9 * up)
        radius = 0.155 * np.sin(np.pi * (0.25 + 0.72 * up)) ** 0.9
        size = 0.35 + 0.65 * np.sin(np.pi * (0.2 + 0.75 * up))
        turn = (
            axis @ place((0, 0, z), (0, 0, 137.508 * k)) @ place((radius * 0.72, 0, 0), (0, -20 - 45 * up, 0))
        )
        scales.append(turn @ place((0, 0, 0), scale=(0.085 * size, 0.06 * size, 0.02 * size)))
    core = [
        (0.0, 0.0),
        (0.06, 0.0),
        *smooth([(0.1, 0.08), (0.12, 0.16), (0.08, 0.3), (0.03, 0.38)], 3),
        (0.0, 0.4),
    ]
    bark = Ramp(hexcolor("#b27a4b"), hexcolor("#ffe2b4"), 0, 0.0, 0.9)
    return part(
        "pinecone",
        turned(core, Plain(hexcolor("#4f2f1a")), (CONE_X, CONE_Y, TABLE_Z + 0.01)),
        posed(Sphere(), bark, scales, gloss=SATIN),
    )
