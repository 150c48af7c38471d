"""Photographs of a procedural scene seen through a map: the truth of continuous edits, as sharp as photos.

Notation: phi takes deformed points to canonical ones, J is its Jacobian; a ray p(t) = o + t d in deformed
space meets a surface where the scene's distance D(phi(p(t))) is 0. Outside the box of what phi changes rays
are traced as they are; inside, from t a step of D / |J d| stays in the empty ball of radius D about phi(p(t))
as long as phi is about linear: a step whose end is outside that ball is taken back and shortened, down to
SHORTEST, where the map jumps; so is one that ends beyond what the map empties. None goes past a face of the
boxes of what phi changes, in which a thin copy may stand. Surfaces have the colors of
their canonical points in direction J d.
Source: Hart, "Sphere tracing" (1996), whose step is divided by the map's stretch.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera
from cagefield.edits import SpaceMap
from cagefield.errors import SceneError
from cagefield.images.render_result import Background, RenderResult
from cagefield.procedural import ProceduralScene
from cagefield.procedural.distance_cells import DistanceCells
from cagefield.procedural.supersampling import photograph
from cagefield.procedural.tracing import HIT_TOLERANCE, Hits, points_along_rays, trace
from cagefield.rendering.reference_renderer import intersect_box
from cagefield.typing import Array, Float32, Int, Mask

SHORTEST = 1e-4
"""Step that is always taken, in world units: half of what `trace` takes for arrived."""

LONGEST = 0.1
"""Longest step inside the map: a shell between cages bends little over it. Pictures of a tenth of it, half as
large a SHARE, are equal to 77 dB or better."""

EMPTIED = 0.02
"""Step through what the map empties, beyond which nothing is known until its far side is found."""

SHARE = 0.95
"""Share of the safe step that is taken: the map is not quite linear along it."""

MAX_STEPS = 400
"""A ray that goes along a surface for longer is taken to pass it."""

_CHUNK = 1 << 16


@dataclass(frozen=True)
class _Samples:
    """Samples of rays: canonical points and unit view directions [3,N], |J d|, and what is nearest there.

    bound  [N] distance to the nearest surface in canonical space, or less; inf where the map empties
    """

    points: Float32
    viewdirs: Float32
    stretch: Float32
    bound: Float32
    primitive: Int
    instance: Int

    @property
    def arrived(self) -> Mask:
        """Whether the surface is as near as `trace` asks for, or the sample inside."""
        near: Mask = (self.bound < np.float32(HIT_TOLERANCE) * self.stretch) & (self.primitive >= 0)
        return near

    def put(self, rows: Int, other: _Samples) -> None:
        """Writes other samples, one for each of these rows."""
        for name in ("points", "viewdirs"):
            getattr(self, name)[:, rows] = getattr(other, name)
        for name in ("stretch", "bound", "primitive", "instance"):
            getattr(self, name)[rows] = getattr(other, name)

    def of(self, rows: Int) -> _Samples:
        """The samples in these rows."""
        return _Samples(
            self.points[:, rows],
            self.viewdirs[:, rows],
            self.stretch[rows],
            self.bound[rows],
            self.primitive[rows],
            self.instance[rows],
        )


@dataclass(frozen=True)
class MappedScene:
    """A procedural scene seen through a point map. Raises SceneError for a scene with mirrors."""

    scene: ProceduralScene
    mapping: SpaceMap

    def __post_init__(self) -> None:
        if any(item.primitive.mirror for item in self.scene.placed):
            raise SceneError(
                f"scene {self.scene.name} has a mirror, which cannot be seen through a map; "
                "choose a scene without one"
            )

    def photograph(
        self, camera: Camera, *, supersample: int = 2, background: Background = "none"
    ) -> RenderResult:
        """Frame of the surfaces, each pixel the mean of supersample^2 rays; normals are canonical."""
        return photograph(self.shoot, camera, supersample=supersample, background=background)

    def shoot(self, origin: Array, directions: Float32) -> tuple[Float32, Float32, Hits]:
        """(rgb [N,3], canonical normals [N,3], hits) of rays from one origin [3], unit directions [3,N]."""
        rgb, normals, hits = self.scene.shoot(origin, directions)
        start = origin.astype(np.float32)
        box = self.mapping.bounds
        if box is None or (np.asarray(box)[0] > np.asarray(box)[1]).any():
            return rgb, normals, hits
        enter, leave = intersect_box(start[None], directions.T, box)
        enter = np.maximum(enter, 0)
        rows = np.flatnonzero((enter < leave) & (hits.t >= enter))
        beyond = trace(self.scene.placed, origin, directions[:, rows], leave[rows])
        hits.t[rows], hits.primitive[rows], hits.instance[rows] = beyond.t, beyond.primitive, beyond.instance
        points = points_along_rays(origin, directions[:, rows], beyond.t)
        rgb[rows], normals[rows] = self.scene.colors(beyond, points, directions[:, rows])
        for first in range(0, len(rows), _CHUNK):
            part = rows[first : first + _CHUNK]
            met, t, found = self._march(start, directions[:, part], enter[part], leave[part])
            part = part[met]
            own = Hits(t, found.primitive, found.instance)
            hits.t[part], hits.primitive[part], hits.instance[part] = own.t, own.primitive, own.instance
            rgb[part], normals[part] = self.scene.colors(own, found.points, found.viewdirs)
        return rgb, normals, hits

    @cached_property
    def _cells(self) -> DistanceCells:
        return DistanceCells(self.scene.placed)

    def _samples(self, start: Float32, directions: Float32, t: Float32) -> _Samples:
        """The samples at distances [N] along rays."""
        points = (start[:, None] + t * directions).T
        mapped = self.mapping.to_canonical(points, np.ascontiguousarray(directions.T))
        if mapped.viewdirs is None or mapped.stretch is None:
            raise SceneError("a map must return viewdirs and stretch when it is given viewdirs")
        canonical = np.ascontiguousarray(mapped.points.T, np.float32)
        nearest = self._cells(canonical)
        bound = np.where((mapped.layer < 0), np.float32(np.inf), nearest.bound)
        viewdirs = np.ascontiguousarray(mapped.viewdirs.T, np.float32)
        stretch = np.where((mapped.layer < 0), np.float32(1), mapped.stretch).astype(np.float32)
        return _Samples(canonical, viewdirs, stretch, bound, nearest.primitive, nearest.instance)

    def _march(
        self, start: Float32, directions: Float32, enter: Float32, leave: Float32
    ) -> tuple[Int, Float32, _Samples]:
        """(rays that meet a surface within [enter, leave], their distances, the samples there)."""
        result = self._samples(start, directions, enter)
        distance = enter.copy()
        met = [np.flatnonzero(result.arrived)]
        active = np.flatnonzero(~result.arrived)
        t, at = enter[active], result.of(active)
        step = _step(at)
        faces = [intersect_box(start[None], directions.T, box) for box in self.mapping.boxes]
        stops = np.array([t for pair in faces for t in pair], np.float32).reshape(-1, len(enter)) + SHORTEST
        for _ in range(MAX_STEPS):
            if not len(active):
                break
            step = np.minimum(step, leave[active] - t)
            to_stops = stops[:, active] - t
            step = np.minimum(step, np.where(to_stops > 1e-6, to_stops, np.inf).min(0, initial=np.inf))
            step = step.astype(np.float32)
            ahead = self._samples(start, directions[:, active], t + step)
            moved = np.linalg.norm(ahead.points - at.points, axis=0)
            passed = np.isinf(at.bound) & ~np.isinf(ahead.bound)
            taken = ((moved <= at.bound) & ~passed) | (step <= np.float32(SHORTEST))
            arrived = taken & ahead.arrived
            rows = np.flatnonzero(arrived)
            ray = active[rows]
            distance[ray] = (t + step)[rows]
            result.put(ray, ahead.of(rows))
            met.append(ray)
            rows = np.flatnonzero(taken)
            t[rows] += step[rows]
            at.put(rows, ahead.of(rows))
            shorter = step * np.clip(SHARE * at.bound / np.maximum(moved, np.float32(1e-9)), 0.1, 0.5)
            step = np.where(taken, _step(at), np.maximum(shorter, np.float32(SHORTEST)))
            going = np.flatnonzero(~arrived & (t < leave[active] - np.float32(1e-6)))
            active, t, at, step = active[going], t[going], at.of(going), step[going]
        rays = np.concatenate(met)
        return rays, distance[rays], result.of(rays)


def _step(at: _Samples) -> Float32:
    """Steps [N] along the rays that the distances allow."""
    safe = np.where(np.isinf(at.bound), np.float32(EMPTIED), np.float32(SHARE) * at.bound / at.stretch)
    steps: NDArray[np.float32] = np.clip(safe, SHORTEST, LONGEST).astype(np.float32)
    return steps
