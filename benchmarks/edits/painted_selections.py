"""Writes the edit files of painted parts: brush strokes on a trained scene, and the cage that they become.

    python -m benchmarks.edits.painted_selections cone SCENE --out digger_move_painted_cone.yaml
    python -m benchmarks.edits.painted_selections flower SCENE --out plant_turn_painted_flower.yaml
    python -m benchmarks.edits.painted_selections helmet SCENE --out docs/edits/biker_painted_helmet.yaml

SCENE: a folder of the digger, or of the plant, trained; their files are examples of the package. For the
helmet, `biker.compressed.ply` of PlayCanvas' examples, imported.

Strokes are those of a person with the brush of the editor, in shares of the image of a camera; they paint as
the editor's brush does, depth-limited, each added to the others, cut to a range of hues, grown. The cage is
that of the key that makes a selection a cage, in world units, rounded to 1e-4.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import tyro

from benchmarks.common.tables import write_text
from cagefield.cameras.camera import Camera
from cagefield.edits import Edit, EditStack
from cagefield.edits.edit_files import dump_edits
from cagefield.geometry import MeshCage
from cagefield.geometry.cage import Cage
from cagefield.procedural.writer import FOV_X_RAD
from cagefield.scene.scene import Scene
from cagefield.selection import Stroke, deformed_positions, elements_in_region, elements_of_field, grow
from cagefield.selection.elements import Elements
from cagefield.selection.selection_cages import CageShape, cage_around, outer_cage_of_shape
from cagefield.typing import Mask

Vec3 = tuple[float, float, float]

PIXELS = 320
"""Width and height of the pictures that are painted on."""

FACES = 160
"""Triangles of a mesh cage, at most."""

DEPTH_TOLERANCE = 1.0
"""Depth limit of the brush, in radii of an element, where a part names none."""


@dataclass(frozen=True)
class Painted:
    """A part as it is painted: strokes seen from eyes, hues, steps of growth, its cage, its motion.

    Strokes are in shares of the image of the camera at their eye, which looks at `target`; its picture has
    `pixels` and a field of view `fov_x` in radians. Without a range of hues all that is painted stays. The
    depth limit of the brush, `depth`, is in radii of an element; `margin` of the cage is in cells. The motion
    turns about `pivot`, None for that of the cage.
    """

    title: str
    strokes: tuple[tuple[Vec3, Stroke], ...]
    cage: CageShape
    translate: Vec3
    hue: tuple[float, float] | None = None
    grown: int = 0
    margin: float = 1.0
    rotate_deg: Vec3 = (0.0, 0.0, 0.0)
    pivot: Vec3 | None = None
    discrete: bool = False
    target: Vec3 = (0.0, 0.0, 0.0)
    up: Vec3 = (0.0, 0.0, 1.0)
    pixels: tuple[int, int] = (PIXELS, PIXELS)
    fov_x: float = FOV_X_RAD
    depth: float = DEPTH_TOLERANCE
    field: str = "a field trained on 60 photos"


CONE_EYES: tuple[Vec3, Vec3] = ((3.2, 1.6, 1.3), (1.2, 3.4, 1.2))
HELMET_EYES: tuple[Vec3, Vec3, Vec3] = ((-1.6, -1.4, 2.6), (-3.0, -1.4, 0.6), (-2.0, -1.6, -2.2))
FLOWER_EYES: tuple[Vec3, Vec3] = ((2.0, -3.1, 1.6), (-2.6, 2.4, 1.9))

PAINTED: dict[str, Painted] = {
    "cone": Painted(
        "move the painted cone",
        (
            (CONE_EYES[0], Stroke(((0.571, 0.66), (0.57, 0.7)), 0.014)),
            (CONE_EYES[0], Stroke(((0.569, 0.72), (0.568, 0.77)), 0.03)),
            (CONE_EYES[0], Stroke(((0.53, 0.785), (0.608, 0.785)), 0.015)),
            (CONE_EYES[1], Stroke(((0.304, 0.625), (0.306, 0.67)), 0.014)),
            (CONE_EYES[1], Stroke(((0.307, 0.69), (0.31, 0.735)), 0.03)),
            (CONE_EYES[1], Stroke(((0.272, 0.752), (0.352, 0.752)), 0.015)),
        ),
        "box",
        (0.0, -0.97, 0.0),
        hue=(0.0, 0.07),
        discrete=True,
    ),
    "flower": Painted(
        "turn the painted flower",
        (
            (FLOWER_EYES[0], Stroke(((0.45, 0.17), (0.49, 0.2)), 0.065)),
            (FLOWER_EYES[1], Stroke(((0.46, 0.255), (0.58, 0.21)), 0.03)),
        ),
        "mesh",
        (0.1, -0.1, 0.12),
        grown=1,
        margin=2.0,
        rotate_deg=(0.0, 25.0, 0.0),
        pivot=(-0.18, 0.11, 0.83),
    ),
    "helmet": Painted(
        "turn the painted helmet",
        (
            (HELMET_EYES[0], Stroke(((0.5, 0.47), (0.53, 0.53), (0.53, 0.6)), 0.08)),
            (HELMET_EYES[0], Stroke(((0.62, 0.5), (0.66, 0.53)), 0.03)),
            (HELMET_EYES[1], Stroke(((0.36, 0.47), (0.36, 0.56), (0.42, 0.58)), 0.09)),
            (HELMET_EYES[1], Stroke(((0.48, 0.45), (0.52, 0.5), (0.5, 0.56)), 0.05)),
            (HELMET_EYES[2], Stroke(((0.4, 0.44), (0.38, 0.52), (0.4, 0.57)), 0.09)),
        ),
        "mesh",
        (-0.03, 0.0, 0.1),
        grown=1,
        rotate_deg=(0.0, -40.0, 0.0),
        target=(-0.25, -1.4, 0.2),
        up=(0.0, -1.0, 0.0),
        pixels=(320, 480),
        fov_x=0.5,
        depth=3.0,
        field="a capture in splats",
    ),
}
"""Painted parts, by the name that the command line takes."""


def select(scene: Scene, elements: Elements, painted: Painted) -> Mask:
    """Mask [N] of the elements of a scene without edits that are painted."""
    seen = deformed_positions(elements.positions, EditStack())
    reach = painted.depth * np.maximum(elements.radii, elements.cell_edge)[seen.element]
    mask = np.zeros(len(elements), bool)
    for eye, stroke in painted.strokes:
        width, height = painted.pixels
        camera = Camera.look_at(
            eye, painted.target, painted.up, width=width, height=height, fov_x=painted.fov_x
        )
        frame = scene.render(camera)
        depth = np.where(frame.opacity > 0.5, frame.depth, np.inf).astype(np.float32)
        mask |= elements_in_region(stroke, camera, seen, len(elements), depth=depth, tolerance=reach)
    if painted.hue is not None:
        mask &= elements.in_range("hue", *painted.hue)
    return grow(elements, mask, painted.grown) if painted.grown else mask


def edit_of(elements: Elements, mask: Mask, painted: Painted) -> Edit:
    """The edit that moves the painted elements, its cage rounded to 1e-4 world units."""
    points = elements.positions[mask].astype(np.float64)
    radii = elements.radii[mask]
    cage = cage_around(painted.cage, points, painted.margin * elements.cell_edge, radii, faces=FACES)
    inner = rounded(cage, painted.pivot)
    edit = (
        Edit.move(inner, name=painted.title)
        if painted.discrete
        else Edit.continuous(inner, rounded(outer_cage_of_shape(inner)), name=painted.title)
    )
    moved = edit.translate(painted.translate)
    return moved.rotate(np.radians(painted.rotate_deg)) if any(painted.rotate_deg) else moved


def rounded(cage: Cage, pivot: Vec3 | None = None) -> Cage:
    """A cage whose corners or vertices are whole multiples of 1e-4 world units."""
    if isinstance(cage, MeshCage):
        return MeshCage(cage.vertices.round(4), cage.triangles, pivot=pivot)
    return Cage(cage.corners.round(4), pivot=cage.pivot if pivot is None else np.asarray(pivot, np.float64))


def text_of(edits: EditStack, comments: Sequence[str]) -> str:
    """An edit file with comments before it."""
    return "".join(f"# {line}\n" for line in comments) + dump_edits(edits)


@dataclass(frozen=True)
class Arguments:
    """A painted part of a trained scene, written as an edit file."""

    name: tyro.conf.Positional[Literal["cone", "flower", "helmet"]]
    scene: tyro.conf.Positional[Path]
    out: Path | None = None
    """Edit file; left out, it is printed."""


def main() -> None:
    """Paint, print the number of elements, write the edit file."""
    arguments = tyro.cli(Arguments)
    painted, scene = PAINTED[arguments.name], Scene.open(arguments.scene)
    elements = elements_of_field(scene.field)
    mask = select(scene, elements, painted)
    print(f"{np.count_nonzero(mask)} of {len(mask)} elements painted")
    comments = [
        f"{painted.title.capitalize()}: {len(painted.strokes)} strokes of the brush on {painted.field},",
        f"and the {painted.cage} that the key which makes a selection a cage puts around them:",
        f"  python -m benchmarks.edits.painted_selections {arguments.name} SCENE",
    ]
    text = text_of(EditStack([edit_of(elements, mask, painted)]), comments)
    if arguments.out is None:
        print(text)
    else:
        write_text(arguments.out, text)


if __name__ == "__main__":
    main()
