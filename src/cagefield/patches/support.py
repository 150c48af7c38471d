"""What a thing stood on, or hung from: the surface that goes on under it, which no photo showed.

A support is found as a plane through surfaces around the part, which the part touches on its upper side; its
height over that plane is a thin-plate spline through those surfaces. In the part's footprint the
densities are those of the surfaces around, at the same height over the support, and the colours are the
membrane that spans the hole: each coefficient solves Laplace's equation between those at the hole's rim.
Columns of the footprint belong to the support where it closes around them: a table ends at its edge.

Source: Perez, Gangnet and Blake, "Poisson image editing" (2003), for the membrane (without guidance).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, sparse
from scipy.interpolate import RBFInterpolator
from scipy.sparse.linalg import factorized

from cagefield.patches.block import Block, world_of
from cagefield.sh import sh_basis
from cagefield.typing import AnyArray, Array, Float32, Mask

TRIALS = 200
"""Planes that are tried."""

NEAR = 1.5
"""A surface vertex belongs to a plane within this distance, voxels."""

ALONG = 0.9
"""Least cosine between its normal and the plane's."""

ROUGH = 0.6
"""The same of all that lie on it, where normals may be noise."""

AGAIN = 4
"""Planes that are looked at."""

WIDE = 3
"""Half the least width of a support, voxels."""

LEAST = 60
"""Vertices of a support, at least."""

DEEP, HIGH = -4.0, 3.0
"""Heights over a support, in voxels, between which its density is made anew."""

BESIDE = 2
"""Columns beside those that no camera sees that are filled too."""

VIEWS = 32
"""Directions from which colours are looked at."""

FIRM = 0.01
"""How firmly colours are held to be the same from all of them."""

KNOTS = 1500
"""Vertices through which the spline goes, at most."""


@dataclass(frozen=True)
class Support:
    """A plane with normal [3], u and v axes [2,3], through a point, in units of voxels of a block."""

    point: Array
    normal: Array
    axes: Array
    members: Array

    def local(self, at: Array) -> tuple[Array, Array]:
        """(u and v [N,2], height [N]) of block coordinates [N,3]."""
        away = at - self.point
        return away @ self.axes.T, away @ self.normal


def support_of(
    part: Mask, at: Array, normals: Array, ring: NDArray[np.bool_], *, seed: int = 0
) -> Support | None:
    """The plane through surfaces of the ring [N] that the part [X,Y,Z] stands on, or just over.

    at, normals [N,3]: block coordinates of all surfaces, and their normals. Each counts by how near the part
    comes to it from above. All that are on the plane are its members.
    """
    ring, content = ring.copy(), np.argwhere(part).astype(np.float64)
    for _ in range(AGAIN):
        if ring.sum() < LEAST or not len(content):
            break
        found = _plane_of(part, content, at[ring], normals[ring], seed)
        if found is None:
            break
        on = np.abs((at - found[0]) @ found[1]) < NEAR
        support = _support(*found, at, normals)
        if _is_wide(support.local(at[on & (normals @ found[1] > ROUGH)])[0]):
            return support
        ring &= ~on
    return None


def _plane_of(part: Mask, content: Array, at: Array, normals: Array, seed: int) -> tuple[Array, Array] | None:
    """(a point [3], the normal [3]) of the plane of surfaces [N] that the part's content [M,3] stands on."""
    size = float(np.median(np.ptp(content, axis=0))) + 1.0
    reach = max(4.0, 0.25 * size)
    from_part = ndimage.distance_transform_edt(~part)
    near = ndimage.map_coordinates(from_part, (at + reach * normals).T, order=1, mode="nearest")
    shade = np.clip(1.0 - near / (2.0 * reach), 0.02, 1.0)
    chance = np.random.default_rng(seed)
    some = chance.choice(len(at), min(len(at), 6000), replace=False)
    probes = content[chance.choice(len(content), min(len(content), 2000), replace=False)]
    best, most = None, 0.0
    for row in chance.choice(len(at), min(TRIALS, len(at)), replace=False, p=shade / shade.sum()):
        n = normals[row].astype(np.float64)
        height = (at[some] - at[row]) @ n
        found = (np.abs(height) < NEAR) & (normals[some] @ n > ALONG)
        score = float(shade[some][found].sum())
        if score <= most:
            continue
        above = (probes - at[row]) @ n
        if (above < -NEAR - 1.0).mean() < 0.05 and np.percentile(above, 3) < max(4.0, 0.3 * size):
            best, most = row, score
    if best is None:
        return None
    n, centre = normals[best].astype(np.float64), at[best]
    for _ in range(3):
        member = np.flatnonzero((np.abs((at - centre) @ n) < NEAR) & (normals @ n > ALONG))
        if len(member) < LEAST:
            return None
        centre = at[member].mean(axis=0)
        spread = np.linalg.eigh(np.cov((at[member] - centre).T))[1][:, 0]
        n = spread if spread @ n > 0.0 else -spread
    return centre, n


def _support(centre: Array, n: Array, at: Array, normals: Array) -> Support:
    """The support on a plane with normal n [3], of surfaces [N]."""
    aside = np.cross(n, np.eye(3)[np.argmin(np.abs(n))])
    aside /= np.linalg.norm(aside)
    member = (np.abs((at - centre) @ n) < 2.0 * NEAR) & (normals @ n > ROUGH)
    # Columns begin at a vertex: between two of them, half of the vertices would share a column.
    vertex = np.round(centre)
    point = vertex + ((centre - vertex) @ n) * n
    return Support(point, n, np.stack([aside, np.cross(n, aside)]), at[member])


def _is_wide(uv: Array) -> bool:
    """False for columns [N,2] that form nothing but strips: a plane that leans on edges."""
    cell = np.round(uv).astype(np.int64)
    cell -= cell.min(axis=0)
    found = np.zeros(cell.max(axis=0) + 2 * WIDE + 1, bool)
    found[tuple((cell + WIDE).T)] = True
    found = ndimage.binary_closing(found, iterations=2)
    return int(ndimage.binary_opening(found, iterations=WIDE).sum()) >= LEAST


@dataclass(frozen=True)
class Footprint:
    """Columns of a support on a grid [U,V] a voxel apart: those in the hole, and those around it.

    surfaced [U,V]: those where the support has a surface; height [U,V] of that, also where it goes on.
    """

    support: Support
    first: NDArray[np.int64]
    hole: Mask
    around: Mask
    surfaced: Mask
    height: Array

    def points(self, block: Block) -> Array:
        """World positions [N,3] of the hole's columns on the surface."""
        cells = np.argwhere(self.hole)
        uv, height = cells + self.first, self.height[tuple(cells.T)]
        at = self.support.point + uv @ self.support.axes + height[:, None] * self.support.normal
        return world_of(block.field, at + block.low)

    def without_air(self, air: NDArray[np.bool_]) -> Footprint:
        """The footprint whose hole lacks columns [N] where cameras see that no support goes on."""
        gone = np.zeros(self.hole.shape, bool)
        gone[tuple(np.argwhere(self.hole)[air].T)] = True
        # Single rays that pass are noise.
        gone = ndimage.binary_opening(ndimage.binary_closing(gone)) & self.hole
        return replace(self, hole=self.hole & ~gone)

    def without(self, known: NDArray[np.bool_], part: Mask) -> Footprint:
        """The footprint whose hole lacks what is known [N] of its columns.

        Only columns where the support has a surface can be. What a part [X,Y,Z] stands on, or comes close to,
        is not: its own crust is there.
        """
        kept = np.zeros(self.hole.shape, bool)
        kept[tuple(np.argwhere(self.hole)[known].T)] = True
        kept &= self.surfaced & ~self.stands(np.argwhere(part))
        # What shows through gaps, and right beside the part, is of no use.
        wide = np.pad(kept | self.around, BESIDE + 1, mode="edge")
        kept = ndimage.binary_opening(ndimage.binary_closing(wide), iterations=BESIDE)
        kept = kept[BESIDE + 1 : -BESIDE - 1, BESIDE + 1 : -BESIDE - 1]
        hole = ndimage.binary_dilation(self.hole & ~kept, iterations=BESIDE) & self.hole
        return replace(self, hole=hole, around=self.around | (self.hole & ~hole))

    def holds(self, at: Array) -> NDArray[np.bool_]:
        """Which block coordinates [N,3] lie at the surface of the hole's columns, or near it."""
        u, v, height = self.column(at)
        return np.asarray((u >= 0) & self.hole[u, v] & (np.abs(height) < HIGH))

    def stands(self, at: NDArray[np.int64]) -> Mask:
        """Columns [U,V] that block coordinates [N,3] of a part stand on, or nearly."""
        u, v, height = self.column(at.astype(np.float64))
        low = (u >= 0) & (height < HIGH + 2.0)
        out = np.zeros(self.hole.shape, bool)
        out[u[low], v[low]] = True
        return out

    def column(self, at: Array) -> tuple[NDArray[np.int64], NDArray[np.int64], Array]:
        """(u [N], v [N], height over the support [N]) of block coordinates [N,3]; u is -1 outside."""
        uv, height = self.support.local(at)
        cell = np.round(uv).astype(np.int64) - self.first
        inside = ((cell >= 0) & (cell < self.hole.shape)).all(axis=1)
        cell[~inside] = 0
        height = height - self.height[cell[:, 0], cell[:, 1]]
        return np.where(inside, cell[:, 0], -1), cell[:, 1], height


def footprint_of(support: Support, part: Mask, close: Array, unsure: Array) -> Footprint | None:
    """The columns under the part, and those of the surfaces close to it, and of those in deep shade.

    close, unsure: block coordinates [N,3] of these.
    """
    uv, own = support.local(support.members)
    content = np.argwhere(part).astype(np.float64)
    where, above = support.local(content)
    tall = float(np.percentile(above, 98))
    low = where[above < max(4.0, 0.25 * tall)]
    dark = support.local(close)
    low = np.concatenate([low, dark[0][np.abs(dark[1]) < 2.0 * NEAR]])
    if len(low) < 4:
        return None
    deep, above = support.local(unsure)
    deep = deep[np.abs(above) < 2.0 * NEAR]
    every = np.concatenate([uv, low, deep])
    first = np.floor(every.min(axis=0)).astype(np.int64) - 3
    size = np.ceil(every.max(axis=0)).astype(np.int64) + 4 - first
    hole, around = np.zeros(size, bool), np.zeros(size, bool)
    hole[tuple((np.round(low).astype(np.int64) - first).T)] = True
    # Parts are hollow.
    hole = ndimage.binary_fill_holes(ndimage.binary_closing(hole, iterations=2))
    hole = ndimage.binary_dilation(hole, iterations=2)
    shade = np.zeros(size, bool)
    shade[tuple((np.round(deep).astype(np.int64) - first).T)] = True
    around[tuple((np.round(uv).astype(np.int64) - first).T)] = True
    around = ndimage.binary_closing(np.pad(around, 2), iterations=2)[2:-2, 2:-2]
    surfaced = around
    hole |= ndimage.binary_closing(shade, iterations=2) & around
    # What the support closes around belongs to it: a disc as wide as the hole is deep decides. Its own
    # surface in the hole counts: beside an edge of the support there may be none around.
    reach = int(np.ceil(ndimage.distance_transform_edt(np.pad(hole, 1)).max())) + 3
    wide = np.pad(around, reach)
    around = around & ~hole
    grown = ndimage.distance_transform_edt(~wide) <= reach
    closed = (ndimage.distance_transform_edt(grown) > reach)[reach:-reach, reach:-reach]
    hole &= closed
    if not hole.any() or not around.any():
        return None
    chance = np.random.default_rng(0)
    near = around[tuple((np.round(uv).astype(np.int64) - first).T)]
    knots = np.flatnonzero(near)
    if len(knots) < LEAST:
        return None
    knots = chance.choice(knots, min(KNOTS, len(knots)), replace=False)
    spline = RBFInterpolator(uv[knots], own[knots], neighbors=64, smoothing=4.0)
    cells = np.argwhere(hole | around)
    height = np.zeros(size)
    height[tuple(cells.T)] = spline((cells + first).astype(np.float64))
    return Footprint(support, first, hole, around, surfaced, height)


def rebuilt(block: Block, footprint: Footprint, removed: Mask) -> Block:
    """The block with the support going on in its hole; `removed` [X,Y,Z] are the vertices of V^c."""
    voxels = np.argwhere(np.ones(block.shape, bool))
    u, v, height = footprint.column(voxels.astype(np.float64))
    known = u >= 0
    voxels, u, v, height = voxels[known], u[known], v[known], height[known]
    hole = footprint.hole[u, v]
    around = footprint.around[u, v] & ~removed[tuple(voxels.T)]
    level = (height >= DEEP) & (height <= HIGH)
    # What stands or hangs above V^c is not of the part, and stays.
    gone = removed[tuple(voxels.T)]
    top = np.full(footprint.hole.shape, -np.inf)
    np.maximum.at(top, (u[gone], v[gone]), height[gone])
    nearest = ndimage.distance_transform_edt(np.isinf(top), return_distances=False, return_indices=True)
    hole &= height <= top[tuple(nearest)][u, v] + 0.5
    profile = _profile(block, voxels[around & level], height[around & level])
    # Crusts of what was taken away, between the support and V^c.
    nearby = ndimage.binary_dilation(removed, iterations=4)
    crust = hole & (height > HIGH) & nearby[tuple(voxels.T)]
    new = hole & level
    where = np.zeros(block.shape, bool)
    where[tuple(voxels[crust].T)] = True
    block = block.with_density(where, np.zeros(int(where.sum()), np.float32))
    where[:] = False
    where[tuple(voxels[new].T)] = True
    values = np.zeros(block.shape, np.float32)
    heights = np.arange(DEEP, HIGH + 0.25, 0.5)
    values[tuple(voxels[new].T)] = np.interp(height[new], heights, profile)
    below = where & (block.density > values)
    deep = np.zeros(block.shape, bool)
    deep[tuple(voxels[new & (height < -1.5)].T)] = True
    values = np.where(below & deep, block.density, values)
    block = block.with_density(where, values[where], slots=True)
    known_columns = (u[around], v[around], height[around])
    return _coloured(block, footprint, voxels[new], (u[new], v[new]), voxels[around], known_columns)


def _profile(block: Block, at: NDArray[np.int64], height: Array) -> Array:
    """Median densities at heights DEEP, DEEP + 1/2, ... HIGH over the support."""
    heights = np.arange(DEEP, HIGH + 0.25, 0.5)
    values = block.density[tuple(at.T)]
    profile = np.zeros(len(heights))
    for number, level in enumerate(heights):
        here = np.abs(height - level) <= 0.3
        profile[number] = np.median(values[here]) if here.any() else profile[number - 1]
    # Photos do not say how dense it is inside; above, nothing rises again.
    top = int(np.argmax(profile))
    profile[:top] = np.maximum(profile[:top], profile[top])
    profile[top:] = np.minimum.accumulate(profile[top:])
    return profile


def _coloured(
    block: Block,
    footprint: Footprint,
    new: NDArray[np.int64],
    column: tuple[NDArray[np.int64], NDArray[np.int64]],
    known: NDArray[np.int64],
    above: tuple[NDArray[np.int64], NDArray[np.int64], Array],
) -> Block:
    """The block with the membrane's coefficients in the hole."""
    u, v, height = above
    shape = footprint.hole.shape
    slot = block.slot[tuple(known.T)]
    rows = (np.abs(height) < 1.6) & (slot >= 0)
    cell = np.ravel_multi_index((u[rows], v[rows]), shape)
    weight = _shown(cell, height[rows], block.depth[tuple(known[rows].T)])
    total = np.bincount(cell, weight, minlength=int(np.prod(shape)))
    given = total > 0.0
    width = int(np.prod(block.sh.shape[1:]))
    table = np.zeros((len(total), width))
    values = _as_seen(block.sh[slot[rows]], footprint.support.normal / np.array(block.spacing))
    values = values.reshape(-1, width)
    for channel in range(width):
        table[:, channel] = np.bincount(cell, weight * values[:, channel], minlength=len(total))
    table[given] /= total[given][:, None]
    given &= footprint.around.reshape(-1)
    table = membrane(footprint.hole, given.reshape(shape), table)
    sh = block.sh.copy()
    place = block.slot[tuple(new.T)]
    kept = place >= 0
    cells = np.ravel_multi_index((column[0][kept], column[1][kept]), shape)
    sh[place[kept]] = table[cells].reshape(-1, *block.sh.shape[1:])
    return Block(block.field, block.low, block.density, block.slot, sh)


def _shown(column: NDArray[np.int64], height: Array, depth: AnyArray) -> Array:
    """The share [N] that vertices have in what is seen of their columns [N] from above.

    height, depth [N]: theirs over the support, and their optical depth.
    """
    order = np.lexsort((-height, column))
    passed = np.cumsum(depth[order].astype(np.float64)) - depth[order]
    first = np.r_[True, np.diff(column[order]) > 0]
    passed -= np.maximum.accumulate(np.where(first, passed, 0.0))
    share = np.zeros(len(column))
    share[order] = np.exp(-passed) * (1.0 - np.exp(-depth[order])) + 1e-6
    return share


def _as_seen(sh: Float32, normal: Array) -> Array:
    """Coefficients [N,K,3] that are as sh [N,K,3] seen from the normal's side [3], and never below black.

    Those of single vertices may be far below, where nothing shows of it; their means would be darker than
    what is seen.
    """
    count = np.arange(VIEWS)
    up = (count + 0.5) / VIEWS
    angle = np.pi * (3.0 - np.sqrt(5.0)) * count
    across = np.sqrt(1.0 - up**2)
    u, v = np.linalg.svd(normal[None])[2][1:]
    n = normal / np.linalg.norm(normal)
    views = -(np.outer(up, n) + np.outer(across * np.cos(angle), u) + np.outer(across * np.sin(angle), v))
    basis = sh_basis(views, int(np.sqrt(sh.shape[1])) - 1)
    seen = np.maximum(0.5 + np.einsum("dk,nkc->ndc", basis, sh), 0.0) - 0.5
    firm = np.eye(sh.shape[1]) * FIRM * VIEWS
    firm[0, 0] = 0.0
    return np.einsum("kd,ndc->nkc", np.linalg.solve(basis.T @ basis + firm, basis.T), seen)


def membrane(hole: Mask, given: Mask, table: Array) -> Array:
    """Rows [U*V,C] with those of the hole [U,V] solved for: each is the mean of its neighbours.

    Neighbours that are neither given nor in the hole do not count.
    """
    unknown = np.flatnonzero(hole.reshape(-1) & ~given.reshape(-1))
    number = np.full(hole.size, -1, np.int64)
    number[unknown] = np.arange(len(unknown))
    height, width = hole.shape
    pulls, sources, degree = [], np.zeros((len(unknown), table.shape[1])), np.full(len(unknown), 1e-6)
    y, x = np.divmod(unknown, width)
    for dy, dx in ((0, 1), (1, 0), (0, -1), (-1, 0)):
        there = (y + dy >= 0) & (y + dy < height) & (x + dx >= 0) & (x + dx < width)
        other = np.where(there, (y + dy) * width + x + dx, 0)
        known = there & given.reshape(-1)[other]
        inner = there & (number[other] >= 0)
        degree += known.astype(float) + inner
        np.add.at(sources, np.flatnonzero(known), table[other[known]])
        pulls.append((np.flatnonzero(inner), number[other[inner]]))
    rows, columns = (np.concatenate(part) for part in zip(*pulls, strict=True))
    pull = sparse.csc_matrix((np.ones(len(rows)), (rows, columns)), (len(unknown),) * 2)
    solve = factorized((sparse.diags(degree) - pull).tocsc())
    out = table.copy()
    mean = table[given.reshape(-1)].mean(axis=0) if given.any() else np.zeros(table.shape[1])
    sources += 1e-6 * mean
    for channel in range(table.shape[1]):
        out[unknown, channel] = solve(sources[:, channel])
    return out
