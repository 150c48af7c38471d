"""A potted plant and a pinecone on a round table."""

from __future__ import annotations

import numpy as np

from cagefield.procedural.building import (
    MATTE,
    SATIN,
    build_part,
    place_shape,
    pose_shape,
    revolve,
    smooth,
    tube,
)
from cagefield.procedural.parts import Part, pose_matrix
from cagefield.procedural.scene import ProceduralScene
from cagefield.procedural.shapes import Cylinder, Leaf, Sphere, Torus
from cagefield.procedural.textures import Mottled, Plain, Ramp, Veined, Wood, Zigzag, rgb_from_hex

TABLE_Z = -0.45
POT_X, POT_Y = -0.22, 0.12
CONE_X, CONE_Y = 0.42, -0.3


def plant() -> ProceduralScene:
    """Scene with the parts table, pot, plant, flower and pinecone."""
    return ProceduralScene("plant", (_table(), _pot(), _plant(), _flower(), _pinecone()), lowest=0.0)


def _table() -> Part:
    wood = Wood(rgb_from_hex("#d8b07c"), rgb_from_hex("#a87845"), axis=0, period=0.11)
    legs = [(0.6 * np.cos(a), 0.6 * np.sin(a), -0.72) for a in np.radians([45, 165, 285])]
    return build_part(
        "table",
        place_shape(Cylinder(0.88, 0.04, 0.025), wood, (0, 0, TABLE_Z - 0.04)),
        place_shape(Torus(0.885, 0.018), Plain(rgb_from_hex("#6f4526")), (0, 0, TABLE_Z - 0.04)),
        place_shape(
            Cylinder(0.055, 0.22, 0.02), Wood(rgb_from_hex("#a87845"), rgb_from_hex("#6f4526")), legs
        ),
        place_shape(Cylinder(0.62, 0.02, 0.01), Plain(rgb_from_hex("#7d5230")), (0, 0, TABLE_Z - 0.1)),
    )


def _pot() -> Part:
    base = TABLE_Z
    profile = [
        (0.0, base), (0.19, base), (0.21, base + 0.02), (0.285, base + 0.33), (0.32, base + 0.34),
        (0.325, base + 0.42), (0.275, base + 0.42), (0.265, base + 0.36), (0.0, base + 0.36),
    ]  # fmt: skip
    clay = Zigzag(rgb_from_hex("#c4673d"), rgb_from_hex("#f0e2c8"), rgb_from_hex("#2f5d73"), 14, -0.03)
    soil = Mottled(rgb_from_hex("#4a3323"), rgb_from_hex("#6d5038"), 0.05, 0.8)
    return build_part(
        "pot",
        revolve(profile, clay, (POT_X, POT_Y, 0), rounding=0.006),
        place_shape(Cylinder(0.275, 0.02, 0.01), soil, (POT_X, POT_Y, base + 0.37), gloss=MATTE),
    )


def _plant() -> Part:
    stem = smooth([(0, 0), (0.03, 0.2), (-0.02, 0.45), (0.03, 0.68)], 4)
    top = TABLE_Z + 0.38
    leaves, golden = [], 137.5
    for k in range(15):
        up = k / 14
        height, tilt = top + 0.05 + 0.5 * up, 12 + 48 * up
        size = 1.0 - 0.45 * up
        turn = pose_matrix((POT_X, POT_Y, height), (0, 0, golden * k)) @ pose_matrix((0, 0, 0), (0, -tilt, 0))
        leaves.append(turn @ pose_matrix((0.25 * size, 0, 0.0), scale=size))
    leaf = Leaf(0.46, 0.17, 0.012, bend=0.9)
    return build_part(
        "plant",
        tube([(POT_X + x, POT_Y, top + z - 0.02) for x, z in stem], 0.022, Plain(rgb_from_hex("#5d7a36"))),
        tube(
            [(POT_X + 0.03, POT_Y, TABLE_Z + z) for z in (1.0, 1.15)], 0.018, Plain(rgb_from_hex("#5d7a36"))
        ),
        pose_shape(leaf, Veined(rgb_from_hex("#3f8f3a"), rgb_from_hex("#a9cf6b"), 0.46), leaves),
    )


def _flower() -> Part:
    center = np.array([POT_X + 0.03, POT_Y, TABLE_Z + 1.27])
    face = pose_matrix(center, (0, 35, -40))
    petals = [
        face @ pose_matrix((0, 0, 0), (0, 0, k * 40)) @ pose_matrix((0.12, 0, 0.015), (0, -15, 0))
        for k in range(9)
    ]
    return build_part(
        "flower",
        tube([(POT_X + 0.03, POT_Y, TABLE_Z + 1.17), tuple(center)], 0.018, Plain(rgb_from_hex("#5d7a36"))),
        pose_shape(
            Leaf(0.2, 0.1, 0.01, bend=0.8),
            Veined(rgb_from_hex("#e4568a"), rgb_from_hex("#f7b4cb"), 0.2),
            petals,
        ),
        pose_shape(
            Sphere(),
            Mottled(rgb_from_hex("#f3c53b"), rgb_from_hex("#c98a1c"), 0.3, 0.8),
            [face @ pose_matrix((0, 0, 0.02), scale=(0.065, 0.065, 0.04))],
        ),
    )


def _pinecone() -> Part:
    height, count = 0.42, 72
    axis = pose_matrix((CONE_X, CONE_Y, TABLE_Z + 0.02))
    scales = []
    for k in range(count):
        up = (k + 0.5) / count
        z = height * (0.06 + 0.9 * up)
        radius = 0.155 * np.sin(np.pi * (0.25 + 0.72 * up)) ** 0.9
        size = 0.35 + 0.65 * np.sin(np.pi * (0.2 + 0.75 * up))
        turn = (
            axis
            @ pose_matrix((0, 0, z), (0, 0, 137.508 * k))
            @ pose_matrix((radius * 0.72, 0, 0), (0, -20 - 45 * up, 0))
        )
        scales.append(turn @ pose_matrix((0, 0, 0), scale=(0.085 * size, 0.06 * size, 0.02 * size)))
    core = [
        (0.0, 0.0),
        (0.06, 0.0),
        *smooth([(0.1, 0.08), (0.12, 0.16), (0.08, 0.3), (0.03, 0.38)], 3),
        (0.0, 0.4),
    ]
    bark = Ramp(rgb_from_hex("#b27a4b"), rgb_from_hex("#ffe2b4"), 0, 0.0, 0.9)
    return build_part(
        "pinecone",
        revolve(core, Plain(rgb_from_hex("#4f2f1a")), (CONE_X, CONE_Y, TABLE_Z + 0.01)),
        pose_shape(Sphere(), bark, scales, gloss=SATIN),
    )
