"""The fused renderer of a VoxelField: one march per ray, empty space leapt over, early stop.

Samples lie at t_in + (k + 1/2) h along each ray, h = `step` voxels; leaps move by whole steps, so that the
image does not depend on skipped space. In a contracted field the step is `step` voxels of contracted
length, so it grows with distance; the march ends half a voxel before infinity.
"""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from dataclasses import dataclass

from cagefield.compute.block_cyclic import Schedule, scheduled_item, turn_count
from cagefield.compute.quadrants import qd
from cagefield.edits.device.kernels.edit_maps import EditArgs, map_sample
from cagefield.edits.device.kernels.grade import grade_sample
from cagefield.rendering.voxels.kernels.edited_ray import (
    BENT,
    LINE,
    STAYED,
    STRAIGHT,
    EditedRay,
    edited_ray,
)
from cagefield.rendering.voxels.kernels.grid import (
    F32,
    GridArgs,
    contract_velocity,
    corner_slots,
    corner_weights,
    gather_density,
    gather_rgb,
    ivec3,
    sh_basis,
    to_grid,
    vec3,
)
from cagefield.rendering.voxels.kernels.map_segments import MapSegment, map_in_segments
from cagefield.rendering.voxels.kernels.ray_grid import (
    OccupancyArgs,
    is_occupied,
    look_ahead,
    safe_inverse,
    slab,
)

mat3 = qd.types.matrix(3, 3, qd.f32)
ivec2 = qd.types.vector(2, qd.i32)
MARCH_TILE_PX = 8


@dataclass(frozen=True, eq=False)
class CameraArgs:
    """A camera as kernels take it: directions [N,3] of its pixels in camera space, and its pose."""

    directions: F32
    width: qd.i32
    rotation: mat3
    origin: vec3


@dataclass(frozen=True, eq=False)
class TileArgs:
    """The tiles, 8 x 8 pixels each, that are marched: `rows` of them from `first_row` on, of a rectangle.

    The rectangle has its top left pixel at `corner` (column, row) and `size` (columns, rows).
    """

    corner: ivec2
    size: ivec2
    first_row: qd.i32
    rows: qd.i32


UNEDITED, EDITED, EDITED_BY_FLOWS, GRADED, GRADED_BY_FLOWS = range(5)
"""Work of a march for edits: none, maps from lattices or closed forms, flows too (even numbers), and
grades of colors with them (from GRADED on)."""


@dataclass(frozen=True, eq=False)
class MarchArgs:
    """How rays are marched: step and nearest distance, in units of t, and the values computed for a
    sample."""

    step: qd.f32
    near: qd.f32
    preserve_opacity: qd.i32


@dataclass(frozen=True, eq=False)
class EmptySpaceArgs:
    """Empty and unedited space, over which rays leap.

    Attributes:
        bricks: occupancy of the deformed field.
        canonical_bricks: occupancy of the field as it was trained; begins at 0.
        edit_boxes: [B,2,3], the deformed-space boxes outside which no edit changes anything.
    """

    bricks: OccupancyArgs
    canonical_bricks: OccupancyArgs
    edit_boxes: F32


@qd.kernel(fastcache=True)
def march_tiles(
    out: F32,
    deal: Schedule,
    camera: CameraArgs,
    tiles: TileArgs,
    march: MarchArgs,
    grid: GridArgs,
    space: EmptySpaceArgs,
    edits: EditArgs,
    K: qd.template(),
    contracted: qd.template(),
    edited: qd.template(),
    with_normals: qd.template(),
):
    """Marches rows of tiles of a rectangle of a camera's picture.

    out: [size.y * size.x, 8]: premultiplied rgb, opacity, sum of w t, and the premultiplied normal, 0 without
    `with_normals`. `edited`: UNEDITED to GRADED_BY_FLOWS.

    The part of a ray that may lie in the edits' boxes is found first; only its samples in occupied blocks
    evaluate the edits' maps.
    """
    across = (tiles.size.x + MARCH_TILE_PX - 1) // MARCH_TILE_PX
    qd.loop_config(block_dim=64)
    for turn in range(turn_count(deal)):
        n = scheduled_item(turn, deal)
        tile = n // (MARCH_TILE_PX * MARCH_TILE_PX)
        x = (tile % across) * MARCH_TILE_PX + n % MARCH_TILE_PX
        y = (tiles.first_row + tile // across) * MARCH_TILE_PX + (n // MARCH_TILE_PX) % MARCH_TILE_PX
        if tile < across * tiles.rows and x < tiles.size.x and y < tiles.size.y:
            pixel = (tiles.corner.y + y) * camera.width + tiles.corner.x + x
            d = camera.rotation @ vec3(
                camera.directions[3 * pixel],
                camera.directions[3 * pixel + 1],
                camera.directions[3 * pixel + 2],
            )
            basis = sh_basis(d, K)
            go = (camera.origin - grid.lower) * grid.scale
            gd = d * grid.scale
            inverse = safe_inverse(gd)
            t = march.near
            t_end = 1e30
            if qd.static(not contracted):
                lo = qd.cast(space.bricks.origin, qd.f32)
                hit = slab(go, inverse, lo, lo + 4.0 * qd.cast(space.bricks.dims, qd.f32))
                t = qd.max(hit.x, march.near) + 0.5 * march.step
                t_end = hit.y
            edit_in = 1e30
            edit_out = -1e30
            ray = EditedRay(until=-1e30)
            segment = MapSegment(end=-1e30)
            turned = basis
            if qd.static(edited != UNEDITED):
                world = safe_inverse(d)
                for k in range(space.edit_boxes.shape[0] // 6):
                    at = 6 * k
                    through = slab(
                        camera.origin,
                        world,
                        vec3(space.edit_boxes[at], space.edit_boxes[at + 1], space.edit_boxes[at + 2]),
                        vec3(space.edit_boxes[at + 3], space.edit_boxes[at + 4], space.edit_boxes[at + 5]),
                    )
                    if through.x <= through.y:
                        edit_in = qd.min(edit_in, through.x)
                        edit_out = qd.max(edit_out, through.y)
            T = 1.0
            rgb = vec3(0.0, 0.0, 0.0)
            normal = vec3(0.0, 0.0, 0.0)
            depth = 0.0
            while t < t_end and T > 1e-3:
                g, h, empty, leap, last = look_ahead(
                    space.bricks, go + t * gd, gd, inverse, grid.half, march.step, contracted
                )
                if qd.static(contracted):
                    if last == 1:
                        t_end = t
                if empty == 1:
                    t += leap
                else:
                    moved = STAYED
                    place = 0
                    view = d
                    if qd.static(edited != UNEDITED):
                        if t >= edit_in and t <= edit_out:
                            if t > ray.until:
                                ray = edited_ray(t, camera.origin, d, edits)
                                segment.end = -1e30
                                if ray.kind == LINE:
                                    turned = sh_basis(ray.velocity / qd.max(ray.velocity.norm(), 1e-20), K)
                            canonical, view, place, moved = map_in_segments(
                                segment, ray, t, h, camera.origin, d, edits, edited % 2 == 0
                            )
                            if moved != STAYED:
                                g = to_grid(canonical, grid, contracted)
                    # The last bricks reach beyond the grid, and an edit may map samples there.
                    if g.min() < 0.0 or (g - qd.cast(grid.resolution - 1, qd.f32)).max() > 0.0:
                        place = -1
                    if qd.static(edited != UNEDITED):
                        if moved != STAYED and place == 0 and not is_occupied(space.canonical_bricks, g):
                            place = -1
                    if place >= 0:
                        cell = qd.max(qd.min(qd.cast(qd.floor(g), qd.i32), grid.resolution - 2), 0)
                        slots = corner_slots(
                            grid.index, cell + ivec3(place, 0, 0), grid.resolution.y, grid.resolution.z
                        )
                        f = g - qd.cast(cell, qd.f32)
                        b = corner_weights(f)
                        raw = gather_density(grid.density, slots, b)
                        if raw > 0.0:
                            if qd.static(edited != UNEDITED):
                                if march.preserve_opacity == 1 and moved != STAYED:
                                    raw *= view.norm()
                            colors = mat3(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
                            if qd.static(edited >= GRADED):
                                if t >= edit_in and t <= edit_out:
                                    colors, thickness = grade_sample(
                                        camera.origin + t * d, edits, edited % 2 == 0
                                    )
                                    raw *= thickness
                            keep = qd.exp(-raw * h)
                            w = T * (1.0 - keep)
                            T *= keep
                            if w > 1e-4:
                                seen = basis
                                if qd.static(edited != UNEDITED):
                                    if moved == STRAIGHT:
                                        seen = turned
                                    elif moved == BENT:
                                        seen = sh_basis(view / qd.max(view.norm(), 1e-20), K)
                                c = gather_rgb(grid.sh, slots, b, seen, K)
                                c = qd.max(qd.min(c, 1.0), 0.0)
                                if qd.static(edited >= GRADED):
                                    c = qd.max(qd.min(colors @ c, 1.0), 0.0)
                                rgb += w * c
                                depth += w * t
                                if qd.static(with_normals):
                                    slope = density_slope(grid.density, slots, f)
                                    if qd.static(contracted):
                                        at_world = (camera.origin + t * d - grid.lower) * grid.scale
                                        slope = pull_back(slope * grid.half, at_world) * grid.scale
                                    else:
                                        slope = slope * grid.scale
                                    if qd.static(edited != UNEDITED):
                                        if moved != STAYED:
                                            slope = through_edits(
                                                slope, camera.origin + t * d, edits, edited % 2 == 0
                                            )
                                    normal -= w * slope / qd.max(slope.norm(), 1e-12)
                    t += h
            at = 8 * (y * tiles.size.x + x)
            for a in qd.static(range(3)):
                out[at + a] = rgb[a]
                out[at + 5 + a] = normal[a]
            out[at + 3] = 1.0 - T
            out[at + 4] = depth


@qd.func
def pull_back(slope: vec3, q: vec3):
    """Gradient with respect to the normalized position q of a gradient with respect to contract(q)."""
    return vec3(
        slope.dot(contract_velocity(q, vec3(1.0, 0.0, 0.0))),
        slope.dot(contract_velocity(q, vec3(0.0, 1.0, 0.0))),
        slope.dot(contract_velocity(q, vec3(0.0, 0.0, 1.0))),
    )


@qd.func
def through_edits(slope: vec3, p: vec3, edits: EditArgs, flows: qd.template()):
    """J^T slope: the gradient in deformed space at p of a gradient in canonical space."""
    out = vec3(0.0, 0.0, 0.0)
    for a in range(3):
        axis = vec3(0.0, 0.0, 0.0)
        if a == 0:
            axis.x = 1.0
        elif a == 1:
            axis.y = 1.0
        else:
            axis.z = 1.0
        _q, v, _place = map_sample(p, axis, edits, flows)
        along = slope.dot(v)
        if a == 0:
            out.x = along
        elif a == 1:
            out.y = along
        else:
            out.z = along
    return out


@qd.func
def density_slope(density: qd.template(), slots: qd.template(), f: vec3):
    """Gradient of the interpolated density in grid coordinates."""
    r = qd.Vector.zero(qd.f32, 8)
    for c in qd.static(range(8)):
        r[c] = density[slots[c]]
    e = 1.0 - f
    x = (
        (r[4] - r[0]) * e.y * e.z
        + (r[5] - r[1]) * e.y * f.z
        + (r[6] - r[2]) * f.y * e.z
        + (r[7] - r[3]) * f.y * f.z
    )
    y = (
        (r[2] - r[0]) * e.x * e.z
        + (r[3] - r[1]) * e.x * f.z
        + (r[6] - r[4]) * f.x * e.z
        + (r[7] - r[5]) * f.x * f.z
    )
    z = (
        (r[1] - r[0]) * e.x * e.y
        + (r[3] - r[2]) * e.x * f.y
        + (r[5] - r[4]) * f.x * e.y
        + (r[7] - r[6]) * f.x * f.y
    )
    return vec3(x, y, z)
