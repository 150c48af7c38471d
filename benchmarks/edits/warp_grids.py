"""Pictures of shell maps: what becomes of a regular lattice in a plane through both cages.

Drawn backwards, as a renderer sees it: a pixel of deformed space shows whether its canonical point lies on a
line of the lattice. So a map that folds shows its lattice more than once; where it is inside out is red.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from PIL import Image, ImageDraw, ImageFont
from scipy import ndimage

from benchmarks.edits.distortion import Distortion, distortion
from benchmarks.edits.methods import BackwardMap, exact_map
from cagefield.edits import Continuous, Edit
from cagefield.errors import CagefieldError
from cagefield.geometry.cage import Cage
from cagefield.typing import Array, UInt8
from cagefield.warps.continuous import ContinuousWarp
from cagefield.warps.trilinear_shell import TrilinearShell

Color = tuple[int, int, int]

INNER, OUTER, VIEW = 0.3, 0.8, 0.86
"""Half-sizes of the two concentric boxes, and of the picture of them."""

CAPTIONS = {
    "flow": "flow",
    "trilinear": "trilinear shell",
    "mean value": "mean value coordinates",
    "harmonic": "harmonic coordinates",
}
NOTES = (
    "What each map shows of a regular lattice, in the middle plane of two concentric boxes,",
    "half-sizes 0.3 and 0.8; the inner one (blue) is turned. Red: the map turns space inside out.",
    "min det J: least over the whole shell, of the map or of its inverse.",
)

_PAPER, _SHELL, _INSIDE, _RED = (255, 255, 255), (245, 244, 240), (214, 230, 248), (229, 62, 62)
_INK, _BLUE, _DARK_RED, _FAINT = (52, 52, 56), (30, 84, 150), (110, 12, 16), (196, 196, 196)
_FINE = 2
"""Outlines and text are drawn this much larger, then averaged."""


@dataclass(frozen=True)
class Style:
    """Sizes in pixels: a panel's side, the gaps between panels; spacing of the lattice in world units."""

    panel: int = 300
    gap: int = 18
    spacing: float = 0.1

    def __post_init__(self) -> None:
        if self.panel < 16:
            raise CagefieldError(f"panel is {self.panel}; it must be at least 16 pixels")


def turned(degrees: float) -> Continuous:
    """The edit of the pictures: a box of half-size 0.3 in one of 0.8, turned about z."""
    edit = Edit.continuous(Cage.box((0, 0, 0), 2 * INNER), Cage.box((0, 0, 0), 2 * OUTER), allow_folding=True)
    return edit.rotate((0.0, 0.0, np.radians(degrees)))


def lattice_picture(warp: BackwardMap, edit: Continuous, side: int, spacing: float) -> UInt8:
    """Picture [side, side, 3] of the plane z = 0 in deformed space, y upwards."""
    points = _plane(side)
    mapped = warp.to_canonical(points)
    pixel = 2.0 * VIEW / side
    line = np.zeros(len(points))
    for axis in range(2):
        # distance to the nearest line in deformed space, to first order
        value = mapped.points[:, axis] / spacing
        slope = np.linalg.norm(mapped.jacobian[:, axis, :2], axis=1)
        away = np.abs(value - np.round(value)) * spacing / np.maximum(slope, 1e-9)
        line = np.maximum(line, (1.05 - away / pixel).clip(0.0, 1.0))
    in_inner = edit.deformed.contains(points)
    in_outer = edit.outer.contains(points)
    red = _inside_out(warp, edit, np.linalg.det(mapped.jacobian), side) * in_outer
    paper, ink = np.empty((2, len(points), 3))
    for colors, plain, shell, inside in ((paper, _PAPER, _SHELL, _INSIDE), (ink, _FAINT, _INK, _BLUE)):
        colors[:] = plain
        colors[in_outer], colors[in_inner] = shell, inside
    paper += red[:, None] * (np.array(_RED) - paper)
    shown = paper + line[:, None] * (ink - paper)
    return (shown + 0.5).astype(np.uint8).reshape(side, side, 3)


def _plane(side: int) -> Array:
    """Pixel centers [side^2, 3] of the plane z = 0, row by row from above."""
    g = VIEW * (2.0 * (np.arange(side) + 0.5) / side - 1.0)
    y, x = np.meshgrid(g[::-1], g, indexing="ij")
    return np.stack([x.ravel(), y.ravel(), np.zeros(side * side)], axis=1)


def _inside_out(warp: BackwardMap, edit: Continuous, det: Array, side: int) -> Array:
    """Share [N] of each pixel that a map of determinant det [N] shows inside out.

    For the trilinear shell, of which a pixel shows one sheet: that any sheet lands on inside out, be it under
    the inner cage.
    """
    if isinstance(warp, ContinuousWarp) and isinstance(warp.shell, TrilinearShell):
        fine = _plane(2 * side)
        fine = fine[warp.outer.contains(fine) & ~edit.inner.contains(fine)]
        there, J = warp.shell.to_deformed(fine)
        landed = there[np.linalg.det(J) <= 0.0]
        row, column = ((at + VIEW) / VIEW * side for at in (-landed[:, 1], landed[:, 0]))
        hit = np.zeros((2 * side, 2 * side))
        hit[row.astype(int).clip(0, 2 * side - 1), column.astype(int).clip(0, 2 * side - 1)] = 1.0
        hit = ndimage.grey_closing(hit, size=(5, 5))
        return np.asarray(hit.reshape(side, 2, side, 2).mean(axis=(1, 3)).ravel())
    plane = det.reshape(side, side)
    slope = np.hypot(*np.gradient(plane)).ravel()
    return (0.5 - det / np.maximum(slope, 1e-12)).clip(0.0, 1.0)


def grids(
    methods: Sequence[str],
    degrees: Sequence[float],
    style: Style | None = None,
    report: Callable[[str], None] = lambda line: None,
) -> UInt8:
    """The picture [H,W,3]: a column for each method, a row for each angle, least determinants below."""
    style = style or Style()
    if not methods or not degrees:
        raise CagefieldError("a picture of lattices needs at least one method and one angle")
    left, top, foot, below = 64, 44, 30, 70
    width = left + len(methods) * (style.panel + style.gap)
    height = top + len(degrees) * (style.panel + foot + style.gap) + below
    canvas = Image.new("RGB", (width * _FINE, height * _FINE), _PAPER)
    draw = ImageDraw.Draw(canvas)
    for row, angle in enumerate(degrees):
        y = top + row * (style.panel + foot + style.gap)
        _text(draw, (left - 14, y + style.panel / 2), f"{angle:g}°", 20, anchor="rm")
        edit = turned(angle)
        for column, name in enumerate(methods):
            x = left + column * (style.panel + style.gap)
            if row == 0:
                _text(draw, (x + style.panel / 2, top / 2), CAPTIONS.get(name, name), 18)
            warp = exact_map(name, edit)
            picture = Image.fromarray(lattice_picture(warp, edit, style.panel, style.spacing))
            larger = picture.resize((style.panel * _FINE,) * 2, Image.Resampling.NEAREST)
            canvas.paste(larger, (x * _FINE, y * _FINE))
            _outlines(draw, edit, (x, y), style.panel)
            measured = distortion(warp, edit)
            color = _DARK_RED if measured.folds else _INK
            _text(draw, (x + style.panel / 2, y + style.panel + foot / 2), caption(measured), 15, color)
            report(f"{name} at {angle:g} degrees: {caption(measured)}, stretch {measured.stretch:.2f}")
    for number, note in enumerate(NOTES):
        _text(draw, (left, height - below + 14 + 20 * number), note, 14, (96, 96, 100), anchor="lm")
    return np.asarray(canvas.resize((width, height), Image.Resampling.BOX))


def caption(measured: Distortion) -> str:
    """Caption of a panel."""
    if not measured.folds:
        return f"min det J {measured.least_det:.2f}"
    return f"folds: min det J {measured.least_det:.2f}"


def _outlines(draw: ImageDraw.ImageDraw, edit: Continuous, at: tuple[int, int], panel: int) -> None:
    """Draws where both cages cut the plane: the outer's box and the turned inner one's."""
    for cage, color in ((edit.outer, _INK), (edit.deformed, _BLUE)):
        corners = 0.5 * (cage.corners[:4] + cage.corners[4:])[[0, 1, 3, 2], :2]
        x = at[0] + (corners[:, 0] + VIEW) / (2 * VIEW) * panel
        y = at[1] + (VIEW - corners[:, 1]) / (2 * VIEW) * panel
        around = [(float(a) * _FINE, float(b) * _FINE) for a, b in zip(x, y, strict=True)]
        draw.line([*around, *around[:2]], fill=color, width=2 * _FINE, joint="curve")


def _text(
    draw: ImageDraw.ImageDraw,
    at: tuple[float, float],
    text: str,
    size: int,
    color: Color = _INK,
    anchor: str = "mm",
) -> None:
    font = ImageFont.load_default(size * _FINE)
    draw.text((at[0] * _FINE, at[1] * _FINE), text, fill=color, font=font, anchor=anchor)
