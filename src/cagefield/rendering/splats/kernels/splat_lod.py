"""Level of detail of splats: clusters, their boxes and visibility, representatives of groups (Numba).

Notation: C is a splat's covariance, o its opacity, A = sqrt(I2(C)) its area, with I2 the sum of the
principal minors of C: the root of the mean square of its projected area, times sqrt(3). Its
picture takes the optical depth 2 pi Li2(o) a from the light, a the area of its projection, Li2 the
dilogarithm: the integral of -log(1 - o exp(-r^2 / 2)) over the plane.

A group's representative keeps the moments of its splats, weighted by w = Li2(o) A: mean, covariance (with
the spread of the means), color, and its optical depth, as if all projected areas a were in the proportion
of the areas A. Its opacity follows from the depth per screen area: see `projection.project`.

The oracle is in the tests: sums over the groups in float64, and every splat projected.

Source: moment-preserving merging as in Kerbl et al., "A Hierarchical 3D Gaussian Representation" (2024),
equations 3 to 6; the optical depth derived here.
"""

from __future__ import annotations

import numpy as np

from cagefield.compute.numba_cache import FAST, njit
from cagefield.compute.parallel_kernels import parallel_njit
from cagefield.rendering.splats.kernels.projection import ALPHA_MAX, ALPHA_MIN, MAX_WORLD_VARIANCE

CLUSTER_FLOATS = 7
"""Floats of a cluster: 0-2 center and 3-5 half-size of the box of its means, 6 the largest distance from its
mean, in world units, at which one of its splats still shows."""

FARTHEST = np.sqrt(-2.0 * np.log(ALPHA_MIN))
"""Standard deviations at which an opaque splat's alpha is ALPHA_MIN."""


@njit(inline="always", **FAST)
def dilogarithm(o):
    """Li2(o), o in [0, ALPHA_MAX]: its series; above 1/2, Li2(o) = pi^2/6 - log(o) log(1-o) - Li2(1-o)."""
    x = o if o <= 0.5 else 1.0 - o
    total, power = 0.0, 1.0
    for n in range(1, 25):
        power *= x
        total += power / (n * n)
    if o > 0.5:
        total = np.pi * np.pi / 6.0 - np.log(o) * np.log(1.0 - o) - total
    return total


@njit(inline="always", **FAST)
def area(c):
    """A of a covariance [6]; never 0."""
    minors = c[0] * c[3] - c[1] * c[1] + c[0] * c[5] - c[2] * c[2] + c[3] * c[5] - c[4] * c[4]
    return np.sqrt(max(minors, 1e-60))


@parallel_njit(lambda means, *_: len(means), **FAST)
def codes(begin, end, means, low, scale, out):
    """Morton codes [N] of means [N,3], 10 bits an axis, of (mean - low) scale."""
    for i in range(begin, end):
        code = np.uint32(0)
        for axis in range(3):
            cell = np.uint32(min(1023.0, max(0.0, (means[i, axis] - low[axis]) * scale[axis])))
            cell = (cell | (cell << np.uint32(16))) & np.uint32(0x030000FF)
            cell = (cell | (cell << np.uint32(8))) & np.uint32(0x0300F00F)
            cell = (cell | (cell << np.uint32(4))) & np.uint32(0x030C30C3)
            cell = (cell | (cell << np.uint32(2))) & np.uint32(0x09249249)
            code |= cell << np.uint32(axis)
        out[i] = code


@parallel_njit(lambda *args: len(args[-1]), **FAST)
def boxes(begin, end, means, covariances, opacities, order, size, out):
    """Writes the boxes [clusters,CLUSTER_FLOATS] of each `size` splats of `order`."""
    low, high = np.empty(3), np.empty(3)
    for k in range(begin, end):
        for axis in range(3):
            low[axis], high[axis] = 1e30, -1e30
        reach = 0.0
        for q in range(k * size, min((k + 1) * size, order.size)):
            i = order[q]
            C = covariances[i]
            if opacities[i] <= ALPHA_MIN or not C[0] + C[3] + C[5] < MAX_WORLD_VARIANCE:
                continue
            for axis in range(3):
                low[axis] = min(low[axis], np.float64(means[i, axis]))
                high[axis] = max(high[axis], np.float64(means[i, axis]))
            # The Frobenius norm bounds the largest variance.
            square = 0.0
            for j in range(6):
                twice = 1.0 if j == 0 or j == 3 or j == 5 else 2.0
                square += twice * np.float64(C[j]) * np.float64(C[j])
            most = 2.0 * np.log(np.float64(opacities[i]) / ALPHA_MIN)
            reach = max(reach, np.sqrt(most * np.sqrt(square)))
        for axis in range(3):
            out[k, axis] = 0.5 * (low[axis] + high[axis])
            out[k, 3 + axis] = 0.5 * (high[axis] - low[axis])
        out[k, 6] = reach


@njit(inline="always", **FAST)
def farthest(box, direction):
    """The largest direction . x of the points x of a box."""
    total = 0.0
    for j in range(3):
        total += direction[j] * box[j] + abs(direction[j]) * box[3 + j]
    return total


@parallel_njit(lambda boxes, *_: len(boxes), **FAST)
def seen(begin, end, boxes, origin, W, planes, reaches, near, out):
    """Writes the least depth of each cluster that the camera may see, or -1.

    A cluster is out of sight where all its splats are nearer than `near`, or for one of the `planes` [P,3]
    (world axes, from the camera) p . (x - origin) < -reaches[p] times its reach.
    """
    box = np.empty(6)
    for k in range(begin, end):
        out[k] = -1.0
        for j in range(3):
            box[j] = boxes[k, j] - origin[j]
            box[3 + j] = boxes[k, 3 + j]
        if not farthest(box, W[2]) >= near * (1.0 - 1e-6):
            continue
        inside = True
        for p in range(planes.shape[0]):
            inside = inside and farthest(box, planes[p]) >= -reaches[p] * boxes[k, 6]
        if inside:
            out[k] = max(near, -farthest(box, -W[2]))


@njit(**FAST)
def rows_of(chosen, order, size, out):
    """Writes the splats of the chosen clusters; returns their number."""
    n = 0
    for c in range(chosen.size):
        for q in range(chosen[c] * size, min((chosen[c] + 1) * size, order.size)):
            out[n] = order[q]
            n += 1
    return n


@parallel_njit(lambda *args: len(args[-1].means), **FAST)
def merge(begin, end, splats, masses, order, size, merged):
    """Write the `MergedSplats` of each `size` consecutive elements of `order` of the `SplatArgs`.

    masses [N,2] of the merged elements: sum of w over its own area, sum of Li2(o), or no rows for splats.
    apart [M]: rms distance of the means from the representative's.
    """
    means, covariances, opacities, sh, rotations = splats
    out_means, out_covariances, out_sh, out_rotations, out_masses, out_apart = merged
    terms = sh.shape[1]
    turned = rotations.shape[0] > 0
    mean, C, spread, own = np.empty(3), np.empty(6), np.empty(6), np.empty(6)
    color = np.empty((terms, 3))
    first = np.empty(3)
    for g in range(begin, end):
        for j in range(3):
            mean[j] = 0.0
        for j in range(6):
            C[j] = spread[j] = 0.0
        for j in range(terms):
            for ch in range(3):
                color[j, ch] = 0.0
        mass = count = most = 0.0
        heaviest = order[g * size]
        for j in range(3):
            first[j] = means[heaviest, j]
        for q in range(g * size, min((g + 1) * size, order.size)):
            i = order[q]
            c = covariances[i]
            if not c[0] + c[3] + c[5] < MAX_WORLD_VARIANCE:
                continue
            for j in range(6):
                own[j] = c[j]
            if masses.shape[0] > 0:
                weight, number = masses[i, 0] * area(own), np.float64(masses[i, 1])
            else:
                number = dilogarithm(min(ALPHA_MAX, np.float64(opacities[i])))
                weight = number * area(own)
            if not weight > 0.0:
                continue
            mass += weight
            count += number
            if weight > most:
                most, heaviest = weight, i
            dx, dy, dz = means[i, 0] - first[0], means[i, 1] - first[1], means[i, 2] - first[2]
            mean[0] += weight * dx
            mean[1] += weight * dy
            mean[2] += weight * dz
            spread[0] += weight * dx * dx
            spread[1] += weight * dx * dy
            spread[2] += weight * dx * dz
            spread[3] += weight * dy * dy
            spread[4] += weight * dy * dz
            spread[5] += weight * dz * dz
            for j in range(6):
                C[j] += weight * c[j]
            for j in range(terms):
                for ch in range(3):
                    color[j, ch] += weight * sh[i, j, ch]
        inverse = 1.0 / max(mass, 1e-300)
        for j in range(3):
            mean[j] *= inverse
            out_means[g, j] = first[j] + mean[j]
        at = 0
        apart = 0.0
        for m in range(3):
            for n in range(m, 3):
                between = spread[at] * inverse - mean[m] * mean[n]
                C[at] = C[at] * inverse + between
                out_covariances[g, at] = C[at]
                if m == n:
                    apart += between
                at += 1
        out_apart[g] = np.sqrt(max(0.0, apart))
        for j in range(terms):
            for ch in range(3):
                out_sh[g, j, ch] = color[j, ch] * inverse
        out_masses[g, 0] = mass / area(C)
        out_masses[g, 1] = count
        if turned:
            for m in range(3):
                for n in range(3):
                    out_rotations[g, m, n] = rotations[heaviest, m, n]


@parallel_njit(lambda *args: args[-1].size, **FAST)
def spreads(begin, end, apart, size, out):
    """Writes the root mean square of each `size` values."""
    for k in range(begin, end):
        total, number = 0.0, 0
        for g in range(k * size, min((k + 1) * size, apart.size)):
            total += np.float64(apart[g]) * apart[g]
            number += 1
        out[k] = np.sqrt(total / number)
