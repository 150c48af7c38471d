"""Sums of a batch's gradients on GPUs: samples are listed by cell, and each vertex sums those around it.

The march notes each sample once and links it into the list of its cell, by one atomic exchange. A vertex then
goes through the lists of its 8 cells. Adding a sample to its corners' records instead takes 8 (4 + 3K) atomic
additions, 248 for SH degree 2, nearly all of a batch's time; samples beyond the lists' room are added so.
"""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from dataclasses import dataclass

from cagefield.compute.quadrants import qd
from cagefield.rendering.voxels.kernels.grid import F32, I32, U8, ivec3, sh_basis, vec3
from cagefield.training.voxels.kernels.accumulators import HEADER_FLOATS

NOTE_FLOATS = 16
"""Floats of a note: place in the cell [3], density gradient, density and color curvature, weight, color
gradient [3], view direction [3], and 3 unused ones, which align it."""


@dataclass(frozen=True, eq=False)
class SampleListArgs:
    """Samples of a batch by cell; a single value in each array where there are no lists (on CPUs).

    Attributes:
        heads: [nx*ny*nz] number, from 1, of the last sample noted in the cell above each grid vertex, or 0.
        links: [room] number of the sample noted before in the same cell, or 0.
        notes: [room * NOTE_FLOATS].
        count: [1] number of samples, those without room included.
        room: number of samples that can be noted.
    """

    heads: I32
    links: I32
    notes: F32
    count: I32
    room: qd.i32


@qd.func
def note_sample(
    lists: SampleListArgs, number: qd.i32, cell: qd.i32, place: vec3, sums: qd.template(), pull: vec3, d: vec3
):
    """Note a sample, number from 0 and below the room; sums: values 3 to 6 of its note."""
    at = NOTE_FLOATS * number
    for a in qd.static(range(3)):
        lists.notes[at + a] = place[a]
        lists.notes[at + 7 + a] = pull[a]
        lists.notes[at + 10 + a] = d[a]
    for a in qd.static(range(4)):
        lists.notes[at + 3 + a] = sums[a]
    lists.links[number] = qd.atomic_exchange(lists.heads[cell], number + 1)


@qd.kernel(fastcache=True)
def gather_samples(
    lists: SampleListArgs,
    accumulator: F32,
    met: U8,
    vertex_at: I32,
    slots: qd.i32,
    group_bits: qd.i32,
    resolution: ivec3,
    K: qd.template(),
):
    """Add the listed samples to the records of the slots around them, set their flags, empty the lists."""
    qd.loop_config(block_dim=128)
    for slot in range(1, slots):
        at = vertex_at[slot]
        nyz = resolution.y * resolution.z
        x = at // nyz
        y = (at - x * nyz) // resolution.z
        z = at - x * nyz - y * resolution.z
        sums = qd.Vector.zero(qd.f32, HEADER_FLOATS + 3 * K)
        for corner in range(8):
            i = corner >> 2
            j = (corner >> 1) & 1
            k = corner & 1
            cell = ivec3(x - i, y - j, z - k)
            number = 0
            if cell.min() >= 0:
                number = lists.heads[(cell.x * resolution.y + cell.y) * resolution.z + cell.z]
            while number > 0:
                note = NOTE_FLOATS * (number - 1)
                f = vec3(lists.notes[note], lists.notes[note + 1], lists.notes[note + 2])
                b = (
                    qd.select(i == 1, f.x, 1.0 - f.x)
                    * qd.select(j == 1, f.y, 1.0 - f.y)
                    * qd.select(k == 1, f.z, 1.0 - f.z)
                )
                for a in qd.static(range(3)):
                    sums[a] += b * lists.notes[note + 3 + a]
                sums[3] = qd.max(sums[3], b * lists.notes[note + 6])
                pull = b * vec3(lists.notes[note + 7], lists.notes[note + 8], lists.notes[note + 9])
                basis = sh_basis(
                    vec3(lists.notes[note + 10], lists.notes[note + 11], lists.notes[note + 12]), K
                )
                for term in qd.static(range(K)):
                    for a in qd.static(range(3)):
                        sums[HEADER_FLOATS + 3 * term + a] += basis[term] * pull[a]
                number = lists.links[number - 1]
        if sums[2] > 0.0:
            met[slot >> group_bits] = qd.u8(1)
            to = slot * (HEADER_FLOATS + 3 * K)
            accumulator[to + 3] = qd.max(accumulator[to + 3], sums[3])
            for a in qd.static(range(HEADER_FLOATS + 3 * K)):
                if qd.static(a != 3):
                    accumulator[to + a] = accumulator[to + a] + sums[a]
    qd.loop_config(block_dim=256)
    for cell in range(lists.heads.shape[0]):
        lists.heads[cell] = 0
    for _ in range(1):
        lists.count[0] = 0
