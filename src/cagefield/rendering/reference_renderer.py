"""Plain renderer for any field: midpoint quadrature along every ray, no skipping; slow, and the oracle.

Rays live in deformed space; with edits, each sample is mapped to canonical space before the field sees it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from cagefield.cameras.camera import Camera
from cagefield.edits import SpaceMap
from cagefield.errors import FieldError
from cagefield.fields.protocol import Field
from cagefield.images.render_result import Background, RenderResult
from cagefield.rendering.compositing import composite
from cagefield.rendering.edited_field import EditedField, evaluate
from cagefield.typing import Float32

NORMAL_WEIGHT = 1e-4
"""Samples that contribute less than this to a pixel do not get a normal."""


_UNBOUNDED = np.array([[-np.inf] * 3, [np.inf] * 3])
"""Box [2,3] of a field without bounds."""


def intersect_box(origins: Float32, directions: Float32, bounds: ArrayLike) -> tuple[Float32, Float32]:
    """Distances (enter, leave) [N] at which rays cross a box [2,3]; enter > leave where a ray misses it."""
    box = np.asarray(bounds, np.float32)
    with np.errstate(divide="ignore", invalid="ignore"):
        to_lower, to_upper = (box[0] - origins) / directions, (box[1] - origins) / directions
    # fmin/fmax ignore the 0/0 of a ray that runs inside a face
    enter = np.fmax.reduce(np.fmin(to_lower, to_upper), axis=-1)
    leave = np.fmin.reduce(np.fmax(to_lower, to_upper), axis=-1)
    return enter, leave


def render_sampled(
    field: Field,
    camera: Camera,
    *,
    samples: int = 256,
    background: Background = "white",
    edits: SpaceMap | None = None,
    near: float = 0.0,
    far: float | None = None,
    normals: bool = False,
    preserve_opacity: bool = True,
    chunk: int = 1 << 19,
) -> RenderResult:
    """Frame of a field seen by a camera, from `samples` midpoints on each ray's piece inside the bounds.

    The piece is the ray's intersection with field.bounds (united with edits.bounds), cut to [near, far].
    A field without `bounds` needs `far`. Normals are minus the normalized gradient of sigma by central
    differences in deformed space, weighted like the color. `preserve_opacity` multiplies sigma by |J d|,
    which keeps optical depth under the edits' stretch; without it (the paper) a surface that is pressed
    together lets light through. `chunk` is the number of samples held at a time.
    The error falls with the square of the step for smooth fields, with the step where sigma jumps.

    Raises FieldError when neither bounds nor far is known, or the field returns wrong shapes.
    """
    if samples < 1:
        raise FieldError(f"samples must be at least 1, not {samples}")
    if not 0 <= near < np.inf or (far is not None and not near < far < np.inf):
        raise FieldError(f"near and far must satisfy 0 <= near < far < inf, not near={near}, far={far}")
    bounds = _sampled_bounds(field, edits)
    if far is None and (bounds is None or not np.isfinite(bounds).all()):
        what = "no bounds" if bounds is None else "infinite bounds"
        raise FieldError(f"field has {what}, so far must be given; render_sampled(field, camera, far=...)")

    origins, directions = camera.rays()
    count = len(directions)
    enter, leave = (
        np.full(count, near, np.float32),
        np.full(count, np.inf if far is None else far, np.float32),
    )
    if bounds is not None:
        t0, t1 = intersect_box(origins, directions, bounds)
        enter, leave = np.maximum(enter, t0), np.minimum(leave, t1)

    edited: Field = field
    if edits is not None:
        box = _UNBOUNDED if bounds is None else np.asarray(bounds, np.float64)
        edited = EditedField(field, edits, box, preserve_opacity)
    rgb, depth = np.zeros((count, 3), np.float32), np.full(count, np.inf, np.float32)
    opacity, normal = np.zeros(count, np.float32), np.zeros((count, 3), np.float32)
    reach = leave.max(initial=0.0) - near if bounds is None else np.linalg.norm(bounds[1] - bounds[0])
    crossing = np.flatnonzero(leave > enter)
    for start in range(0, len(crossing), max(chunk // samples, 1)):
        rows = crossing[start : start + max(chunk // samples, 1)]
        delta = (leave[rows] - enter[rows]) / samples
        t = enter[rows, None] + (np.arange(samples) + 0.5).astype(np.float32) * delta[:, None]
        points = np.asarray(origins[rows, None] + t[..., None] * directions[rows, None], np.float32)
        viewdirs = np.broadcast_to(directions[rows, None], points.shape)
        sigma, color = evaluate(edited, points.reshape(-1, 3), viewdirs.reshape(-1, 3))
        sums = composite(sigma.reshape(t.shape), color.reshape(points.shape), t, delta[:, None])
        rgb[rows], opacity[rows], depth[rows] = sums.premultiplied, sums.opacity, sums.depth
        if normals:
            seen = sums.weights > NORMAL_WEIGHT
            slopes = _density_gradient(edited, points[seen], viewdirs[seen], 1e-3 * float(reach))
            length = np.linalg.norm(slopes, axis=-1, keepdims=True)
            weighted = np.zeros_like(points)
            weighted[seen] = -slopes / np.where(length > 0, length, 1.0) * sums.weights[seen][:, None]
            total = weighted.sum(1)
            length = np.linalg.norm(total, axis=-1, keepdims=True)
            normal[rows] = total / np.where(length > 0, length, 1.0)

    shape = (camera.height, camera.width)
    return RenderResult.from_premultiplied(
        rgb.reshape(*shape, 3),
        opacity.reshape(shape),
        depth.reshape(shape),
        normals=normal.reshape(*shape, 3) if normals else None,
        background=background,
    )


@dataclass(frozen=True, eq=False)
class ReferenceRenderer:
    """`render_sampled` with fixed options, as a `Renderer`."""

    field: Field
    edits: SpaceMap | None = None
    preserve_opacity: bool = True
    samples: int = 256
    near: float = 0.0
    far: float | None = None

    def render(
        self, camera: Camera, *, background: Background = "white", normals: bool = False
    ) -> RenderResult:
        """Image of the field seen by `camera`. Raises `FieldError` as `render_sampled` does."""
        return render_sampled(
            self.field,
            camera,
            samples=self.samples,
            background=background,
            edits=self.edits,
            near=self.near,
            far=self.far,
            normals=normals,
            preserve_opacity=self.preserve_opacity,
        )


def _sampled_bounds(field: Field, edits: SpaceMap | None) -> Float32 | None:
    """Box [2,3] of the field and of the regions that edits change; None when the field has no bounds."""
    own = getattr(field, "bounds", None)
    if own is None:
        return None
    box = np.asarray(own, np.float32)
    changed = None if edits is None else edits.bounds
    if changed is None or (np.asarray(changed)[0] > np.asarray(changed)[1]).any():
        return box
    changed = np.asarray(changed, np.float32)
    return np.stack([np.minimum(box[0], changed[0]), np.maximum(box[1], changed[1])])


def _density_gradient(
    field: Callable[[Float32, Float32], tuple[Float32, Float32]],
    points: Float32,
    viewdirs: Float32,
    step: float,
) -> Float32:
    """Central differences [N,3] of sigma in deformed space, per world unit."""
    slopes = np.empty_like(points)
    for axis in range(3):
        offset = np.zeros(3, np.float32)
        offset[axis] = step
        ahead, behind = field(points + offset, viewdirs)[0], field(points - offset, viewdirs)[0]
        slopes[:, axis] = (ahead - behind) / (2 * step)
    return slopes
