"""A tracked digger on a ground plate: its arm reaches along +x."""

from __future__ import annotations

import numpy as np

from cagefield.procedural.building import (
    MATTE,
    SHINY,
    arc,
    at,
    band,
    part,
    posed,
    shifted,
    tube,
    turned,
    upright,
)
from cagefield.procedural.parts import Part, place
from cagefield.procedural.scene import ProceduralScene
from cagefield.procedural.shapes import Box, Cylinder
from cagefield.procedural.textures import Checker, Grid, Mottled, Plain, Rosette, Stripes, hexcolor

YELLOW, DEEP, BLACK = hexcolor("#f2b41c"), hexcolor("#d9930f"), hexcolor("#2b2b2e")
STEEL, RUBBER, GLASS = hexcolor("#b9bec4"), hexcolor("#3d3c3b"), hexcolor("#33536b")
PAINT = Mottled(YELLOW, DEEP, scale=0.25, contrast=0.2)
HAZARD = Stripes(YELLOW, BLACK, (0, 1, 1), 0.16)
ARM_Y = -0.11


def digger() -> ProceduralScene:
    """Scene with the parts ground, tracks, body, cabin, boom, stick, bucket and (traffic) cone."""
    parts = (_ground(), _tracks(), _body(), _cabin(), _boom(), _stick(), _bucket(), _cone())
    return ProceduralScene("digger", shifted(parts, (-0.1, 0, 0.14)), lowest=2.0)


def _ground() -> Part:
    soil = Mottled(hexcolor("#b58f62"), hexcolor("#87a04f"), scale=0.16, contrast=0.8)
    rim = Checker(hexcolor("#e8e4da"), hexcolor("#4d5157"), 0.125, (0, 1))
    return part(
        "ground",
        at(Box((0.9, 0.65, 0.03), 0.02), soil, (0.1, 0, -0.58), gloss=MATTE),
        at(Box((0.97, 0.72, 0.025), 0.02), rim, (0.1, 0, -0.615), gloss=MATTE),
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
        lugs += [place((x, y, z - 0.415), (0, np.degrees(angle), 0)) for y in (-0.34, 0.34)]
    hub = Rosette(hexcolor("#6d6a66"), YELLOW, 6, 0.085, ring=hexcolor("#d8d8d8"))
    wheels = [place((x, side * 0.447, -0.415), (side * -90, 0, 0)) for x in (-0.34, 0.34) for side in (-1, 1)]
    rollers = [
        place((x, side * 0.447, -0.455), (side * -90, 0, 0)) for x in (-0.17, 0.0, 0.17) for side in (-1, 1)
    ]
    return part(
        "tracks",
        upright(stadium, (-0.34, 0.34), 0.1, Plain(RUBBER, 0.08), rounding=0.01, gloss=MATTE),
        posed(Box((0.027, 0.105, 0.018), 0.006), Plain(hexcolor("#575553"), variety=0.12), lugs, gloss=MATTE),
        posed(Cylinder(0.09, 0.02, 0.008), hub, wheels),
        posed(Cylinder(0.055, 0.015, 0.006), Rosette(hexcolor("#6d6a66"), YELLOW, 4, 0.05), rollers),
        at(Box((0.24, 0.26, 0.06), 0.02), Plain(BLACK), (0, 0, -0.4)),
        at(Cylinder(0.2, 0.05, 0.01), Stripes(STEEL, BLACK, (1, 0, 0), 0.05), (0, 0, -0.3)),
    )


def _body() -> Part:
    grille = Grid(hexcolor("#5b5a57"), BLACK, 0.06, 0.4)
    return part(
        "body",
        at(Box((0.45, 0.36, 0.045), 0.02), Plain(hexcolor("#4a4b4f")), (-0.1, 0, -0.215)),
        at(Box((0.2, 0.35, 0.17), 0.05), PAINT, (-0.3, 0, -0.01), gloss=SHINY),
        at(Box((0.07, 0.36, 0.16), 0.045), HAZARD, (-0.535, 0, -0.03), gloss=SHINY),
        at(Box((0.13, 0.01, 0.08), 0.008), grille, (-0.3, -0.35, 0.0), rotate_deg=(90, 0, 0)),
        at(Box((0.14, 0.22, 0.02), 0.015), Stripes(DEEP, BLACK, (1, 0, 0), 0.07, 0.4), (-0.3, -0.05, 0.165)),
        at(
            Cylinder(0.03, 0.1, 0.008),
            Stripes(STEEL, BLACK, (0, 0, 1), 0.2, 0.3),
            (-0.36, -0.2, 0.26),
            gloss=SHINY,
        ),
        at(Box((0.14, 0.09, 0.09), 0.03), PAINT, (0.17, -0.25, -0.09), gloss=SHINY),
        at(
            Box((0.06, 0.03, 0.11), 0.015),
            Plain(BLACK),
            [(0.13, ARM_Y - 0.085, -0.1), (0.13, ARM_Y + 0.085, -0.1)],
        ),
    )


def _cabin() -> Part:
    side = [(-0.08, -0.17), (0.32, -0.17), (0.34, 0.02), (0.24, 0.34), (-0.08, 0.34)]
    window = [(-0.04, 0.05), (0.285, 0.05), (0.205, 0.3), (-0.04, 0.3)]
    glass = Mottled(GLASS, hexcolor("#6f9ab5"), scale=0.3, contrast=0.35)
    front = np.degrees(np.arctan2(0.1, 0.32))
    return part(
        "cabin",
        upright(side, 0.2, 0.15, PAINT, rounding=0.012, gloss=SHINY),
        upright(window, (0.048, 0.352), 0.006, glass, rounding=0.004, gloss=SHINY),
        at(
            Box((0.006, 0.11, 0.135), 0.004),
            glass,
            (0.303, 0.2, 0.185),
            rotate_deg=(0, -front, 0),
            gloss=SHINY,
        ),
        at(Box((0.006, 0.11, 0.09), 0.004), glass, (-0.097, 0.2, 0.19), gloss=SHINY),
        at(Box((0.19, 0.17, 0.018), 0.015), Plain(hexcolor("#f4efe2")), (0.08, 0.2, 0.365)),
        at(Cylinder(0.035, 0.03, 0.012), Plain(hexcolor("#e8641b"), 0.02), (-0.02, 0.2, 0.405), gloss=SHINY),
        at(Box((0.1, 0.004, 0.02), 0.003), Plain(BLACK), (0.12, 0.355, -0.03)),
    )


def _boom() -> Part:
    outline = [
        (0.06, -0.12), (0.13, -0.16), (0.2, -0.1), (0.36, 0.31), (0.46, 0.41), (0.72, 0.48), (0.77, 0.53),
        (0.73, 0.58), (0.42, 0.6), (0.26, 0.48), (0.1, 0.05),
    ]  # fmt: skip
    return part(
        "boom",
        upright(outline, ARM_Y, 0.055, PAINT, rounding=0.012, gloss=SHINY),
        at(
            Cylinder(0.045, 0.075, 0.008),
            Plain(STEEL),
            [(0.73, ARM_Y, 0.525), (0.13, ARM_Y, -0.1)],
            rotate_deg=(90, 0, 0),
        ),
        tube([(0.27, ARM_Y, -0.12), (0.46, ARM_Y, 0.34)], (0.032, 0.018), Plain(STEEL), gloss=SHINY),
    )


def _stick() -> Part:
    outline = [(0.64, 0.68), (0.71, 0.71), (0.8, 0.56), (0.87, -0.07), (0.79, -0.07), (0.69, 0.44)]
    return part(
        "stick",
        upright(outline, (ARM_Y - 0.077, ARM_Y + 0.077), 0.02, PAINT, rounding=0.008, gloss=SHINY),
        upright(outline, ARM_Y, 0.06, PAINT),
        tube([(0.42, ARM_Y, 0.66), (0.67, ARM_Y, 0.68)], (0.035, 0.02), Plain(STEEL), gloss=SHINY),
    )


def _bucket() -> Part:
    center, radius = (0.79, -0.3), 0.17
    curve = arc(center, radius, 105, -115, 17)
    cheek = [*arc(center, radius - 0.01, 105, -115, 15)]
    metal = Mottled(hexcolor("#8a8d91"), hexcolor("#5f5a55"), scale=0.1, contrast=0.5)
    lip = np.array(curve[-1])
    teeth = [
        place((lip[0] - 0.05, ARM_Y + y, lip[1] + 0.012), (0, 15, 0)) for y in np.linspace(-0.13, 0.13, 5)
    ]
    return part(
        "bucket",
        upright(band(curve, 0.03), ARM_Y, 0.17, metal, rounding=0.006),
        upright(cheek, (ARM_Y - 0.165, ARM_Y + 0.165), 0.014, Plain(DEEP), rounding=0.004),
        posed(Box((0.06, 0.018, 0.014), 0.006), Plain(STEEL), teeth, gloss=SHINY),
        at(Box((0.05, 0.09, 0.045), 0.01), Plain(BLACK), (0.83, ARM_Y, -0.13)),
    )


def _cone() -> Part:
    orange, white = hexcolor("#e8561c"), hexcolor("#f2efe9")
    profile = [(0.0, -0.51), (0.1, -0.51), (0.025, -0.22), (0.0, -0.22)]
    return part(
        "cone",
        at(Box((0.12, 0.12, 0.016), 0.01), Plain(orange), (0.75, 0.5, -0.528)),
        turned(profile, Stripes(orange, white, (0, 0, 1), 0.135, 0.45), (0.75, 0.5, 0), rounding=0.005),
    )
