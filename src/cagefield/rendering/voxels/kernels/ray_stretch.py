"""The march through one stretch of a ray, by how its samples are mapped.

Stretches end where a ray enters or leaves an edit (`edited_ray`). Samples that stay in place have a loop of
their own, in which they cost what they cost in an unedited field. Samples in a lattice lie on arcs, each from
three lookups. Empty space is leapt over without regard to stretches: the next begins at the first sample in
an occupied block.
"""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from dataclasses import dataclass

from cagefield.compute.quadrants import qd
from cagefield.edits.device.kernels.edit_maps import EditArgs, map_sample
from cagefield.edits.device.kernels.grade import grade_sample
from cagefield.edits.device.kernels.lattice import displacement
from cagefield.rendering.voxels.kernels.edited_ray import LATTICE, LINE, MIXED
from cagefield.rendering.voxels.kernels.grid import (
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
from cagefield.rendering.voxels.kernels.ray_grid import OccupancyArgs, is_occupied, look_ahead

mat3 = qd.types.matrix(3, 3, qd.f32)

UNEDITED, EDITED, EDITED_BY_FLOWS, GRADED, GRADED_BY_FLOWS = range(5)
"""Work of a march for edits: none, maps from lattices or closed forms, flows too (even numbers), and
grades of colors with them (from GRADED on)."""

MIN_LIGHT_LEFT = 1e-3
"""Share of the light at which a ray ends."""

MIN_WEIGHT = 1e-4
"""Weight in the picture below which a sample's color is not read."""


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
        edit_lower, edit_upper: the box outside which no edit changes anything, in grid coordinates or, in a
            contracted field, normalized ones.
    """

    bricks: OccupancyArgs
    canonical_bricks: OccupancyArgs
    edit_lower: vec3
    edit_upper: vec3


MarchedRay = qd.types.struct(
    origin=vec3,
    d=vec3,
    go=vec3,
    gd=vec3,
    inverse=vec3,
    t=qd.f32,
    t_end=qd.f32,
    edit_in=qd.f32,
    edit_out=qd.f32,
    T=qd.f32,
    depth=qd.f32,
    rgb=vec3,
    normal=vec3,
)
"""A ray o + t d of a pixel, and what its samples up to now add up to.

go, gd, inverse: origin, velocity and 1 / velocity in grid coordinates or, in a contracted field, normalized
ones; t, t_end: the next sample, and where the field ends; edit_in, edit_out: the part outside of which no
edit changes anything. T: share of the light that is left; depth: sum of w t; rgb, normal: premultiplied.
"""


MAX_ARC_STEPS = 10.0
"""Length of an arc in a lattice at most, in steps; few rays take as many samples of a shell in a row, and an
arc's end amid them is a branch that processors mispredict."""

MAX_ARC_NODES = 6.0
"""Length of an arc of several steps at most, in nodes of its lattice."""

Arc = qd.types.struct(start=vec3, velocity=vec3, bow=vec3, middle=qd.f32, until=qd.f32, u=vec3)
"""The curve start + t velocity + (t - middle)^2 bow in canonical space, of the samples up to t = until.

In a lattice it is the parabola through the displacements at both ends and in the middle; u: that at its end.
"""


@qd.func
def next_arc(
    arc: qd.template(), stretch: qd.template(), t: qd.f32, h: qd.f32, ray: qd.template(), edits: EditArgs
):
    """The arc of a stretch in a lattice on which the sample at t lies, and those that follow every h.

    It begins where the one before ends, or at t if empty space lies between.
    """
    begin = arc.until
    u0 = arc.u
    if t > begin + 1.01 * h:
        begin = t
        u0 = displacement_at(begin, stretch, edits)
    steps = qd.floor(MAX_ARC_NODES / (h * qd.abs(stretch.velocity).max()))
    end = begin + qd.max(qd.min(steps, MAX_ARC_STEPS), 1.0) * h
    end = qd.max(qd.min(end, stretch.until), t + 0.5 * h)
    arc.middle = 0.5 * (begin + end)
    length = end - begin
    u = displacement_at(arc.middle, stretch, edits)
    u1 = displacement_at(end, stretch, edits)
    rise = (u1 - u0) / length
    arc.bow = (2.0 * (u0 + u1) - 4.0 * u) / (length * length)
    arc.start = ray.origin + u - arc.middle * rise
    arc.velocity = ray.d + rise
    arc.until = end
    arc.u = u1


@qd.func
def displacement_at(t: qd.f32, stretch: qd.template(), edits: EditArgs):
    """The displacement at t of a stretch in a lattice."""
    at = stretch.start + t * stretch.velocity
    u, _along = displacement(at, stretch.velocity, edits.lattice, stretch.first, stretch.resolution)
    return u


@qd.func
def march_stretch(
    ray: qd.template(),
    stretch: qd.template(),
    basis: qd.template(),
    march: MarchArgs,
    grid: GridArgs,
    space: EmptySpaceArgs,
    edits: EditArgs,
    K: qd.template(),
    contracted: qd.template(),
    edited: qd.template(),
    with_normals: qd.template(),
    is_mapped: qd.template(),
):
    """Adds the samples of an `EditedRay` to a `MarchedRay`, from its t on, which becomes that after the last.

    `is_mapped`: False where they are IN_PLACE. `basis`: the harmonics of d.
    """
    segment = MapSegment(end=-1e30)
    arc = Arc(start=stretch.start, velocity=stretch.velocity, until=1e30)
    straight = basis
    if qd.static(is_mapped):
        if stretch.kind == LATTICE:
            arc.until = -1e30
        elif stretch.kind == LINE:
            straight = basis_along(arc.velocity, K)
    is_in = 1
    while is_in == 1 and ray.t < ray.t_end and ray.T > MIN_LIGHT_LEFT:
        t = ray.t
        g, h, empty, leap, last = look_ahead(
            space.bricks, ray.go + t * ray.gd, ray.gd, ray.inverse, grid.half, march.step, contracted
        )
        if qd.static(contracted):
            if last == 1:
                ray.t_end = t
        if empty == 1:
            ray.t += leap
        elif edited != UNEDITED and t > stretch.until:
            is_in = 0
        else:
            place = stretch.place
            moved = 0
            view = ray.d
            if qd.static(is_mapped):
                if stretch.kind == MIXED:
                    canonical, view, place, moved = map_in_segments(
                        segment, stretch, t, h, ray.origin, ray.d, edits, edited % 2 == 0
                    )
                    if moved == 1:
                        g = to_grid(canonical, grid, contracted)
                else:
                    moved = 1
                    if t > arc.until + 0.01 * h:
                        next_arc(arc, stretch, t, h, ray, edits)
                    x = t - arc.middle
                    g = to_grid(arc.start + t * arc.velocity + x * x * arc.bow, grid, contracted)
                    view = arc.velocity + (2.0 * x) * arc.bow
            # The last bricks reach beyond the grid, and an edit may map samples there.
            if g.min() < 0.0 or (g - qd.cast(grid.resolution - 1, qd.f32)).max() > 0.0:
                place = -1
            if qd.static(is_mapped):
                if moved == 1 and place == 0 and not is_occupied(space.canonical_bricks, g):
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
                    if qd.static(is_mapped):
                        if march.preserve_opacity == 1 and moved == 1:
                            raw *= view.norm()
                    colors = mat3(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
                    if qd.static(edited >= GRADED):
                        if t >= ray.edit_in and t <= ray.edit_out:
                            colors, thickness = grade_sample(ray.origin + t * ray.d, edits, edited % 2 == 0)
                            raw *= thickness
                    keep = qd.exp(-raw * h)
                    w = ray.T * (1.0 - keep)
                    ray.T *= keep
                    if w > MIN_WEIGHT:
                        seen = straight
                        if qd.static(is_mapped):
                            if moved == 1 and stretch.kind != LINE:
                                seen = basis_along(view, K)
                        c = gather_rgb(grid.sh, slots, b, seen, K)
                        c = qd.max(qd.min(c, 1.0), 0.0)
                        if qd.static(edited >= GRADED):
                            c = qd.max(qd.min(colors @ c, 1.0), 0.0)
                        ray.rgb += w * c
                        ray.depth += w * t
                        if qd.static(with_normals):
                            slope = density_slope(grid.density, slots, f)
                            if qd.static(contracted):
                                at_world = (ray.origin + t * ray.d - grid.lower) * grid.scale
                                slope = pull_back(slope * grid.half, at_world) * grid.scale
                            else:
                                slope = slope * grid.scale
                            if qd.static(is_mapped):
                                if moved == 1:
                                    slope = through_edits(
                                        slope, ray.origin + t * ray.d, edits, edited % 2 == 0
                                    )
                            ray.normal -= w * slope / qd.max(slope.norm(), 1e-12)
            ray.t += h


@qd.func
def basis_along(velocity: vec3, K: qd.template()):
    """The harmonics of the direction of a velocity in canonical space."""
    return sh_basis(velocity / qd.max(velocity.norm(), 1e-20), K)


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
