"""A tracked digger on a ground plate: its arm reaches along +x."""

from __future__ import annotations

import numpy as np

from cagefield.procedural.building import (
    MATTE,
    SHINY,
    arc,
    band,
    build_part,
    place_shape,
    pose_shape,
    revolve,
    shift_parts,
    tube,
    upright_slab,
)
from cagefield.procedural.parts import Part, pose_matrix
from cagefield.procedural.scene import ProceduralScene
from cagefield.procedural.shapes import Box, Cylinder
from cagefield.procedural.textures import Checker, Grid, Mottled, Plain, Rosette, Stripes, rgb_from_hex

YELLOW, DEEP, BLACK = rgb_from_hex("#f2b41c"), rgb_from_hex("#d9930f"), rgb_from_hex("#2b2b2e")
STEEL, RUBBER, GLASS = rgb_from_hex("#b9bec4"), rgb_from_hex("#3d3c3b"), rgb_from_hex("#33536b")
PAINT = Mottled(YELLOW, DEEP, scale=0.25, contrast=0.2)
HAZARD = Stripes(YELLOW, BLACK, (0, 1, 1), 0.16)
ARM_Y = -0.11


def digger() -> ProceduralScene:
    """Scene with the parts ground, tracks, body, cabin, boom, stick, bucket and (traffic) cone."""
    parts = (_ground(), _tracks(), _body(), _cabin(), _boom(), _stick(), _bucket(), _cone())
    return ProceduralScene("digger", shift_parts(parts, (-0.1, 0, 0.14)), lowest=2.0)


def _ground() -> Part:
    soil = Mottled(rgb_from_hex("#b58f62"), rgb_from_hex("#87a04f"), scale=0.16, contrast=0.8)
    rim = Checker(rgb_from_hex("#e8e4da"), rgb_from_hex("#4d5157"), 0.125, (0, 1))
    return build_part(
        "ground",
        place_shape(Box((0.9, 0.65, 0.03), 0.02), soil, (0.1, 0, -0.58), gloss=MATTE),
        place_shape(Box((0.97, 0.72, 0.025), 0.02), rim, (0.1, 0, -0.615), gloss=MATTE),
    )


def _tracks() -> Part:
    stadium = [*arc((0.34, 0), 0.115, -90, 90, 9), *arc((-0.34, 0), 0.115, 90, 270, 9)]
    stadium = [(x, z - 0.415) for x, z in stadium]
    lugs = []
    straight, round_ = 0.68, np.pi * 0.12
    for along in np.linspace(0, 2 * (straight + round_), 30, endpoint=False):
        if along < straight:
            x, z, angle = -0.34 + along, 0.12, 0.0
        elif along < straight + round_:
            angle = (along - straight) / 0.12
            x, z = 0.34 + 0.12 * np.sin(angle), 0.12 * np.cos(angle)
        elif along < 2 * straight + round_:
            x, z, angle = 0.34 - (along - straight - round_), -0.12, np.pi
        else:
            angle = np.pi + (along - 2 * straight - round_) / 0.12
            x, z = -0.34 + 0.12 * np.sin(angle), 0.12 * np.cos(angle)
        lugs += [pose_matrix((x, y, z - 0.415), (0, np.degrees(angle), 0)) for y in (-0.34, 0.34)]
    hub = Rosette(rgb_from_hex("#6d6a66"), YELLOW, 6, 0.085, ring=rgb_from_hex("#d8d8d8"))
    wheels = [
        pose_matrix((x, side * 0.447, -0.415), (side * -90, 0, 0)) for x in (-0.34, 0.34) for side in (-1, 1)
    ]
    rollers = [
        pose_matrix((x, side * 0.447, -0.455), (side * -90, 0, 0))
        for x in (-0.17, 0.0, 0.17)
        for side in (-1, 1)
    ]
    return build_part(
        "tracks",
        upright_slab(stadium, (-0.34, 0.34), 0.1, Plain(RUBBER, 0.08), rounding=0.01, gloss=MATTE),
        pose_shape(
            Box((0.027, 0.105, 0.018), 0.006), Plain(rgb_from_hex("#575553"), variety=0.12), lugs, gloss=MATTE
        ),
        pose_shape(Cylinder(0.09, 0.02, 0.008), hub, wheels),
        pose_shape(Cylinder(0.055, 0.015, 0.006), Rosette(rgb_from_hex("#6d6a66"), YELLOW, 4, 0.05), rollers),
        place_shape(Box((0.24, 0.26, 0.06), 0.02), Plain(BLACK), (0, 0, -0.4)),
        place_shape(Cylinder(0.2, 0.05, 0.01), Stripes(STEEL, BLACK, (1, 0, 0), 0.05), (0, 0, -0.3)),
    )


def _body() -> Part:
    grille = Grid(rgb_from_hex("#5b5a57"), BLACK, 0.06, 0.4)
    return build_part(
        "body",
        place_shape(Box((0.45, 0.36, 0.045), 0.02), Plain(rgb_from_hex("#4a4b4f")), (-0.1, 0, -0.215)),
        place_shape(Box((0.2, 0.35, 0.17), 0.05), PAINT, (-0.3, 0, -0.01), gloss=SHINY),
        place_shape(Box((0.07, 0.36, 0.16), 0.045), HAZARD, (-0.535, 0, -0.03), gloss=SHINY),
        place_shape(Box((0.13, 0.01, 0.08), 0.008), grille, (-0.3, -0.35, 0.0), rotate_deg=(90, 0, 0)),
        place_shape(
            Box((0.14, 0.22, 0.02), 0.015), Stripes(DEEP, BLACK, (1, 0, 0), 0.07, 0.4), (-0.3, -0.05, 0.165)
        ),
        place_shape(
            Cylinder(0.03, 0.1, 0.008),
            Stripes(STEEL, BLACK, (0, 0, 1), 0.2, 0.3),
            (-0.36, -0.2, 0.26),
            gloss=SHINY,
        ),
        place_shape(Box((0.14, 0.09, 0.09), 0.03), PAINT, (0.17, -0.25, -0.09), gloss=SHINY),
        place_shape(
            Box((0.06, 0.03, 0.11), 0.015),
            Plain(BLACK),
            [(0.13, ARM_Y - 0.085, -0.1), (0.13, ARM_Y + 0.085, -0.1)],
        ),
    )


def _cabin() -> Part:
    side = [(-0.08, -0.17), (0.32, -0.17), (0.34, 0.02), (0.24, 0.34), (-0.08, 0.34)]
    window = [(-0.04, 0.05), (0.285, 0.05), (0.205, 0.3), (-0.04, 0.3)]
    glass = Mottled(GLASS, rgb_from_hex("#6f9ab5"), scale=0.3, contrast=0.35)
    front = np.degrees(np.arctan2(0.1, 0.32))
    return build_part(
        "cabin",
        upright_slab(side, 0.2, 0.15, PAINT, rounding=0.012, gloss=SHINY),
        upright_slab(window, (0.048, 0.352), 0.006, glass, rounding=0.004, gloss=SHINY),
        place_shape(
            Box((0.006, 0.11, 0.135), 0.004),
            glass,
            (0.303, 0.2, 0.185),
            rotate_deg=(0, -front, 0),
            gloss=SHINY,
        ),
        place_shape(Box((0.006, 0.11, 0.09), 0.004), glass, (-0.097, 0.2, 0.19), gloss=SHINY),
        place_shape(Box((0.19, 0.17, 0.018), 0.015), Plain(rgb_from_hex("#f4efe2")), (0.08, 0.2, 0.365)),
        place_shape(
            Cylinder(0.035, 0.03, 0.012),
            Plain(rgb_from_hex("#e8641b"), 0.02),
            (-0.02, 0.2, 0.405),
            gloss=SHINY,
        ),
        place_shape(Box((0.1, 0.004, 0.02), 0.003), Plain(BLACK), (0.12, 0.355, -0.03)),
    )


def _boom() -> Part:
    outline = [
        (0.06, -0.12), (0.13, -0.16), (0.2, -0.1), (0.36, 0.31), (0.46, 0.41), (0.72, 0.48), (0.77, 0.53),
        (0.73, 0.58), (0.42, 0.6), (0.26, 0.48), (0.1, 0.05),
    ]  # fmt: skip
    return build_part(
        "boom",
        upright_slab(outline, ARM_Y, 0.055, PAINT, rounding=0.012, gloss=SHINY),
        place_shape(
            Cylinder(0.045, 0.075, 0.008),
            Plain(STEEL),
            [(0.73, ARM_Y, 0.525), (0.13, ARM_Y, -0.1)],
            rotate_deg=(90, 0, 0),
        ),
        tube([(0.27, ARM_Y, -0.12), (0.46, ARM_Y, 0.34)], (0.032, 0.018), Plain(STEEL), gloss=SHINY),
    )


def _stick() -> Part:
    outline = [(0.64, 0.68), (0.71, 0.71), (0.8, 0.56), (0.87, -0.07), (0.79, -0.07), (0.69, 0.44)]
    return build_part(
        "stick",
        upright_slab(outline, (ARM_Y - 0.077, ARM_Y + 0.077), 0.02, PAINT, rounding=0.008, gloss=SHINY),
        upright_slab(outline, ARM_Y, 0.06, PAINT),
        tube([(0.42, ARM_Y, 0.66), (0.67, ARM_Y, 0.68)], (0.035, 0.02), Plain(STEEL), gloss=SHINY),
    )


def _bucket() -> Part:
    center, radius = (0.79, -0.3), 0.17
    curve = arc(center, radius, 105, -115, 17)
    cheek = [*arc(center, radius - 0.01, 105, -115, 15)]
    metal = Mottled(rgb_from_hex("#8a8d91"), rgb_from_hex("#5f5a55"), scale=0.1, contrast=0.5)
    lip = np.array(curve[-1])
    teeth = [
        pose_matrix((lip[0] - 0.05, ARM_Y + y, lip[1] + 0.012), (0, 15, 0))
        for y in np.linspace(-0.13, 0.13, 5)
    ]
    return build_part(
        "bucket",
        upright_slab(band(curve, 0.03), ARM_Y, 0.17, metal, rounding=0.006),
        upright_slab(cheek, (ARM_Y - 0.165, ARM_Y + 0.165), 0.014, Plain(DEEP), rounding=0.004),
        pose_shape(Box((0.06, 0.018, 0.014), 0.006), Plain(STEEL), teeth, gloss=SHINY),
        place_shape(Box((0.05, 0.09, 0.045), 0.01), Plain(BLACK), (0.83, ARM_Y, -0.13)),
    )


def _cone() -> Part:
    orange, white = rgb_from_hex("#e8561c"), rgb_from_hex("#f2efe9")
    profile = [(0.0, -0.51), (0.1, -0.51), (0.025, -0.22), (0.0, -0.22)]
    return build_part(
        "cone",
        place_shape(Box((0.12, 0.12, 0.016), 0.01), Plain(orange), (0.75, 0.5, -0.528)),
        revolve(profile, Stripes(orange, white, (0, 0, 1), 0.135, 0.45), (0.75, 0.5, 0), rounding=0.005),
    )
