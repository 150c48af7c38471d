"""Sphere tracing of procedural scenes in vectorized numpy.

Every primitive is traced on its own, on the rays that meet its bounds, in its own frame: there a world ray
o + t d becomes o' + t d' with the same t, and shape.distance(p) / |d'| is a safe step in t for any pose.
Source: Hart, "Sphere tracing" (1996).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cagefield.procedural.parts import PlacedPrimitive
from cagefield.procedural.shapes import Shape
from cagefield.typing import Float32, Int

HIT_TOLERANCE = 2e-4
"""World distance at which a ray hits: a thirtieth of a pixel of a 400x400 view from distance 4."""

MAX_STEPS = 96


@dataclass(frozen=True)
class Hits:
    """First surfaces along rays [N]: distance t (inf: none), index of the primitive (-1: none), instance."""

    t: Float32
    primitive: Int
    instance: Int


def points_along_rays(origin: NDArray[np.float64], directions: Float32, t: Float32) -> Float32:
    """Points [3,N] at distances t [N] along rays from one origin [3], the origin where t is inf."""
    reached: Float32 = np.where(np.isfinite(t), t, np.float32(0)) * directions
    reached += np.asarray(origin, np.float32)[:, None]
    return reached


def trace(
    placed: Sequence[PlacedPrimitive],
    origin: NDArray[np.float64],
    directions: Float32,
    beyond: Float32 | None = None,
) -> Hits:
    """Nearest surfaces of all primitives along rays from one origin [3] with unit directions [3,N].

    `beyond` [N]: surfaces nearer than these distances are passed over.
    """
    count = directions.shape[1]
    hits = Hits(np.full(count, np.inf, np.float32), np.full(count, -1, np.intp), np.zeros(count, np.intp))
    start = np.asarray(origin, np.float32)
    bundles: dict[str, tuple[Int, Float32]] = {}
    # near primitives first: surfaces behind them are never traced
    order = sorted(
        range(len(placed)), key=lambda i: float(np.linalg.norm(placed[i].shift - start, axis=1).min())
    )
    for index in order:
        part = placed[index].part
        if part.name not in bundles:
            low, high = part.bounds
            ball = ((low + high) / 2 - start).astype(np.float32), np.float32(np.linalg.norm(high - low) / 2)
            rays = np.flatnonzero(_meets(directions, *ball))
            bundles[part.name] = rays, directions[:, rays]
        _trace_primitive(placed[index], index, start, *bundles[part.name], hits, beyond)
    return hits


def _meets(directions: Float32, to_center: Float32, radius: np.float32) -> NDArray[np.bool_]:
    """Whether rays [3,N] from the origin meet a ball (every ray does from inside it)."""
    distance = np.float32(np.linalg.norm(to_center))
    if distance <= radius:
        return np.ones(directions.shape[1], bool)
    x, y, z = to_center / distance
    cosine = x * directions[0] + y * directions[1] + z * directions[2]
    meets: NDArray[np.bool_] = cosine >= np.sqrt(1 - (radius / distance) ** 2) - np.float32(1e-6)
    return meets


def _trace_primitive(
    item: PlacedPrimitive,
    index: int,
    start: Float32,
    rays: Int,
    directions: Float32,
    hits: Hits,
    beyond: Float32 | None,
) -> None:
    """Update the hits of rays (indices [M], directions [3,M]) with one primitive's nearest surfaces."""
    to_center = item.shift - start
    chosen = [np.flatnonzero(_meets(directions, c, r)) for c, r in zip(to_center, item.radii, strict=True)]
    instance = np.repeat(np.arange(len(chosen)), [len(c) for c in chosen])
    pair = np.concatenate(chosen)
    local_direction = item.local_vectors(directions[:, pair], instance)
    local_origin = np.einsum("kij,kj->ik", item.inverse, -to_center)[:, instance]

    enter = np.zeros(len(pair), np.float32) if beyond is None else beyond[rays[pair]]
    leave = hits.t[rays[pair]]
    with np.errstate(divide="ignore", invalid="ignore"):
        for axis in range(3):
            slope = 1 / local_direction[axis]
            middle, half = -local_origin[axis] * slope, item.extent[axis] * np.abs(slope)
            # fmax and fmin ignore the nan of a ray that runs inside a face
            np.fmax(enter, middle - half, out=enter)
            np.fmin(leave, middle + half + np.float32(1e-3), out=leave)
    keep = np.flatnonzero(leave > enter)
    if not len(keep):
        return
    t = _march(
        item.primitive.shape, local_origin[:, keep], local_direction[:, keep], enter[keep], leave[keep]
    )
    hit_rows = np.flatnonzero(t < np.inf)
    ray, instance, t = rays[pair[keep[hit_rows]]], instance[keep[hit_rows]], t[hit_rows]
    if len(chosen) > 1:
        np.minimum.at(hits.t, ray, t)
        nearest = hits.t[ray] == t
        ray, instance, t = ray[nearest], instance[nearest], t[nearest]
    hits.t[ray], hits.primitive[ray], hits.instance[ray] = t, index, instance


def _march(shape: Shape, origin: Float32, direction: Float32, enter: Float32, leave: Float32) -> Float32:
    """Distances [P] of the first surface on o + t d, o and d [3,P], within [enter, leave]; inf for none."""
    distances = np.full(len(enter), np.inf, np.float32)
    pace = 1 / np.sqrt((direction**2).sum(0))
    active = np.arange(len(enter))
    t = enter
    for _ in range(MAX_STEPS):
        step = shape.distance(origin + t * direction) * pace
        arrived = step < HIT_TOLERANCE
        distances[active[arrived]] = t[arrived]
        t = t + step
        going = np.flatnonzero(~arrived & (t < leave))
        if not len(going):
            break
        if len(going) < len(t):
            active, t, leave = active[going], t[going], leave[going]
            origin, direction, pace = origin[:, going], direction[:, going], pace[going]
    return distances
