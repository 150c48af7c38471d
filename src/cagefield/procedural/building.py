"""Builders of textured primitives: profiles, slabs, solids of revolution, tubes.

Notation: gloss is (strength, exponent) of a highlight; MATTE, SATIN and SHINY are its usual values.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cagefield.procedural.parts import Part, Primitive, pose_matrix
from cagefield.procedural.shapes import Extrusion, Revolution, Shape, Tube
from cagefield.procedural.textures import Texture

Points2 = Sequence[tuple[float, float]]
MATTE, SATIN, SHINY = (0.05, 8.0), (0.12, 14.0), (0.25, 22.0)


def build_part(name: str, *primitives: Primitive) -> Part:
    """Part of a name and primitives."""
    return Part(name, primitives)


def arc(
    center: tuple[float, float], radius: float, start_deg: float, end_deg: float, count: int = 9
) -> Points2:
    """Points of a circular arc, ends included."""
    angles = np.radians(np.linspace(start_deg, end_deg, count))
    return [(float(center[0] + radius * np.cos(a)), float(center[1] + radius * np.sin(a))) for a in angles]


def band(path: Points2, thickness: float) -> Points2:
    """Outline of a strip of constant thickness along a path."""
    points = np.array(path)
    tangent = np.gradient(points, axis=0)
    normal = np.stack([-tangent[:, 1], tangent[:, 0]], 1) / np.linalg.norm(tangent, axis=1)[:, None]
    outer, inner = points + normal * thickness / 2, points - normal * thickness / 2
    return [(float(x), float(y)) for x, y in np.concatenate([outer, inner[::-1]])]


def smooth(profile: Points2, count: int = 4) -> Points2:
    """Catmull-Rom curve through the points of an open profile, `count` pieces between neighbors."""
    points = np.array([profile[0], *profile, profile[-1]], np.float64)
    t = np.linspace(0, 1, count, endpoint=False)[:, None]
    pieces = []
    for a, b, c, d in zip(points, points[1:], points[2:], points[3:], strict=False):
        cubic = b + 0.5 * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)))
        pieces.append(cubic)
    curve = np.concatenate([*pieces, points[-1:]])
    return [(float(x), float(y)) for x, y in curve]


def upright_slab(
    outline: Points2,
    y: float | Sequence[float],
    half_thickness: float,
    texture: Texture,
    *,
    rounding: float = 0.0,
    gloss: tuple[float, float] = SATIN,
) -> Primitive:
    """Slab with an outline in the xz plane, `2 half_thickness` thick along y, at one y or several."""
    polygon, (x, z) = _center_outline(outline)
    shape = Extrusion(polygon, half_thickness - rounding, rounding)
    poses = [pose_matrix((x, level, z), (90, 0, 0)) for level in np.atleast_1d(y)]
    return Primitive(shape, texture, np.stack(poses), gloss)


def flat_slab(
    outline: Points2,
    z: float,
    half_thickness: float,
    texture: Texture,
    *,
    rounding: float = 0.0,
    gloss: tuple[float, float] = SATIN,
) -> Primitive:
    """Slab with an outline in the xy plane, `2 half_thickness` thick along z."""
    polygon, (x, y) = _center_outline(outline)
    return place_shape(
        Extrusion(polygon, half_thickness - rounding, rounding), texture, (x, y, z), gloss=gloss
    )


def revolve(
    profile: Points2,
    texture: Texture,
    positions: ArrayLike = ((0, 0, 0),),
    *,
    rotate_deg: ArrayLike = (0, 0, 0),
    rounding: float = 0.0,
    gloss: tuple[float, float] = SATIN,
) -> Primitive:
    """Solids of revolution about z with a profile (radius, z), at positions [K,3], rotated about these."""
    polygon = np.array(profile)
    middle = float(polygon[:, 1].min() + polygon[:, 1].max()) / 2
    centered = tuple((float(r), float(z - middle)) for r, z in polygon)
    poses = [pose_matrix(p, rotate_deg) @ pose_matrix((0, 0, middle)) for p in np.atleast_2d(positions)]
    return Primitive(Revolution(centered, rounding), texture, np.stack(poses), gloss)


def place_shape(
    shape: Shape,
    texture: Texture,
    positions: ArrayLike = ((0, 0, 0),),
    *,
    rotate_deg: ArrayLike = (0, 0, 0),
    scale: ArrayLike = 1.0,
    gloss: tuple[float, float] = SATIN,
) -> Primitive:
    """Primitive of a shape at one position or several [K,3], with one rotation and scale."""
    poses = [pose_matrix(p, rotate_deg, scale) for p in np.atleast_2d(np.asarray(positions, np.float64))]
    return Primitive(shape, texture, np.stack(poses), gloss)


def pose_shape(
    shape: Shape,
    texture: Texture,
    poses: Iterable[NDArray[np.float64]],
    *,
    gloss: tuple[float, float] = SATIN,
) -> Primitive:
    """Primitive of a shape placed by matrices [4,4]."""
    return Primitive(shape, texture, np.stack(list(poses)), gloss)


def tube(
    path: Sequence[tuple[float, float, float]],
    radii: float | Sequence[float],
    texture: Texture,
    *,
    gloss: tuple[float, float] = SATIN,
) -> Primitive:
    """Round bar along a polyline."""
    points = np.array(path, np.float64)
    thickness = tuple(float(r) for r in np.atleast_1d(radii))
    middle = (points.min(0) + points.max(0)) / 2
    centered = tuple((float(x), float(y), float(z)) for x, y, z in points - middle)
    return place_shape(Tube(centered, thickness), texture, middle, gloss=gloss)


def shift_parts(parts: Iterable[Part], by: ArrayLike) -> tuple[Part, ...]:
    """Parts with all primitives moved by a vector."""
    move = pose_matrix(by)
    return tuple(
        replace(p, primitives=tuple(replace(item, poses=move @ item.poses) for item in p.primitives))
        for p in parts
    )


def _center_outline(outline: Points2) -> tuple[tuple[tuple[float, float], ...], tuple[float, float]]:
    """(outline about the center of its box, that center): bounds are tight only about the origin."""
    points = np.array(outline, np.float64)
    middle = (points.min(0) + points.max(0)) / 2
    return tuple((float(x), float(y)) for x, y in points - middle), (float(middle[0]), float(middle[1]))
