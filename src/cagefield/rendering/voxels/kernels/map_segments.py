"""Maps of edits along a ray in segments: evaluated at their ends, interpolated between them.

A segment is SPAN samples long. With the displacement u(t) = q - p and its derivative at both ends, u between
them is the cubic Hermite interpolant. It is used where the ends bear it out: where u' were linear, its
trapezoid rule

    u(end) - u(begin) = (u'(begin) + u'(end)) (end - begin) / 2

would hold; the defect is of third order in the length, the interpolant's error of fourth. Where the defect is
above TOLERANCE, as where a face of a cage lies between the ends, or where a discrete edit is on the ray, each
sample is mapped by itself.
"""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from cagefield.compute.quadrants import qd
from cagefield.edits.device.kernels.edit_maps import EditArgs, map_sample
from cagefield.rendering.voxels.kernels.grid import vec3

SPAN = 5
"""Samples from the beginning of a segment to its end."""

TOLERANCE = 0.05
"""Largest defect of an interpolated segment, of the distance between samples."""

END_WIDTH = 0.01
"""Distance, of that between samples, within which a sample lies at the end of a segment."""

MapSegment = qd.types.struct(
    begin=qd.f32,
    end=qd.f32,
    is_smooth=qd.i32,
    u0=vec3,
    v0=vec3,
    place0=qd.i32,
    moved0=qd.i32,
    u1=vec3,
    v1=vec3,
    place1=qd.i32,
    moved1=qd.i32,
)
"""A stretch of a ray: begin, end (ray parameters), whether it is interpolated, and the map at both ends.

u0, u1: displacements; v0, v1: J d; place: as `map_sample` returns it; moved: 1 where it moved the end.
"""


@qd.func
def map_in_segments(
    segment: qd.template(),
    ray: qd.template(),
    t: qd.f32,
    h: qd.f32,
    origin: vec3,
    d: vec3,
    edits: EditArgs,
    flows: qd.template(),
):
    """As `map_sample` at o + t d, and 1 where that was moved.

    `ray`: the stretch, whose samples are MIXED; h: the distance between samples; `segment`: that of the
    sample before, which becomes the one in which t lies.
    """
    # Stages: 0 and 1 map the ends of a new segment, 2 the sample alone. One call for all, as maps are long.
    stage = 3
    if ray.is_continuous == 0:
        stage = 2
        segment.end = -1e30
    elif t > segment.end + END_WIDTH * h:
        stage = 0
        if t < segment.end + (SPAN - 0.5) * h:
            segment.begin = segment.end
            segment.u0 = segment.u1
            segment.v0 = segment.v1
            segment.place0 = segment.place1
            segment.moved0 = segment.moved1
            stage = 1
        else:
            segment.begin = t
        segment.end = segment.begin + SPAN * h
        segment.is_smooth = 0
    elif segment.is_smooth == 0 and t < segment.end - END_WIDTH * h:
        stage = 2
    q = origin + t * d
    v = segment.v1
    place = segment.place1
    moved = segment.moved1
    alone = 0
    while stage < 3:
        at = t
        if stage == 0:
            at = segment.begin
        elif stage == 1:
            at = segment.end
        p = origin + at * d
        q, v, place = map_sample(p, d, edits, flows)
        moved = 0
        if qd.abs(q - p).max() > 0.0:
            moved = 1
        if stage == 0:
            segment.u0 = q - p
            segment.v0 = v
            segment.place0 = place
            segment.moved0 = moved
            stage = 1
        elif stage == 1:
            segment.u1 = q - p
            segment.v1 = v
            segment.place1 = place
            segment.moved1 = moved
            stage = 3
            length = segment.end - segment.begin
            defect = segment.u1 - segment.u0 - (0.5 * length) * (segment.v0 + segment.v1 - 2.0 * d)
            if segment.place0 == place and segment.moved0 == 1 and moved == 1:
                if qd.abs(defect).max() <= TOLERANCE * h:
                    segment.is_smooth = 1
            if segment.is_smooth == 0 and t > segment.begin:
                stage = 2
        else:
            alone = 1
            stage = 3
    if alone == 0:
        if segment.is_smooth == 1:
            length = segment.end - segment.begin
            x = (t - segment.begin) / length
            a = (segment.v0 - d) * length
            b = (segment.v1 - d) * length
            rise = segment.u1 - segment.u0
            # u0 + a x + c2 x^2 + c3 x^3
            c2 = 3.0 * rise - 2.0 * a - b
            c3 = a + b - 2.0 * rise
            q = origin + t * d + segment.u0 + x * (a + x * (c2 + x * c3))
            v = d + (a + x * (2.0 * c2 + 3.0 * x * c3)) / length
            place = segment.place0
            moved = 1
        elif t <= segment.begin:
            q = origin + t * d + segment.u0
            v = segment.v0
            place = segment.place0
            moved = segment.moved0
        else:
            q = origin + t * d + segment.u1
            v = segment.v1
            place = segment.place1
            moved = segment.moved1
    return q, v, place, moved
