"""Hash grids and perceptrons by scalar loops, apart from the package's code."""

from __future__ import annotations

import math
from itertools import product
from typing import Any

import numpy as np

Array = np.ndarray[Any, Any]


def tcnn_levels(levels: int, base: int, growth: float, log2_size: int) -> list[tuple[float, int, int]]:
    """(scale, resolution, entries) of each level, in double precision."""
    found = []
    for level in range(levels):
        scale = base * growth**level - 1.0
        resolution = math.ceil(round(scale, 4)) + 1
        cube = resolution**3
        found.append((scale, resolution, min(cube + (-cube) % 8, 2**log2_size)))
    return found


def hashed(i: int, j: int, k: int) -> int:
    return (i ^ (j * 2654435761 & 0xFFFFFFFF) ^ (k * 805459861 & 0xFFFFFFFF)) & 0xFFFFFFFF


def tcnn_features(x: Array, table: Array, levels: list[tuple[float, int, int]]) -> Array:
    """Features of one point x [3]."""
    out, first = [], 0
    for scale, resolution, entries in levels:
        at = [float(value) * scale + 0.5 for value in x]
        low = [math.floor(value) for value in at]
        total = np.zeros(table.shape[1])
        for bits in product((0, 1), repeat=3):
            weight = math.prod(
                (a - b) if bit else 1 - (a - b) for a, b, bit in zip(at, low, bits, strict=True)
            )
            i, j, k = (b + bit for b, bit in zip(low, bits, strict=True))
            dense = resolution**3 <= entries
            index = (i + resolution * (j + resolution * k) if dense else hashed(i, j, k)) % entries
            total += weight * table[first + index]
        out.append(total)
        first += entries
    return np.concatenate(out)


def torch_features(x: Array, table: Array, levels: int, base: int, growth: float, log2_size: int) -> Array:
    """Features of one point x [3] in nerfstudio's layout."""
    out, size = [], 2**log2_size
    for level in range(levels):
        scale = math.floor(base * growth**level + 1e-4)
        at = [float(value) * scale for value in x]
        total = np.zeros(table.shape[1])
        for bits in product((0, 1), repeat=3):
            weight, corner = 1.0, []
            for value, bit in zip(at, bits, strict=True):
                part = value - math.floor(value)
                weight *= part if bit else 1 - part
                corner.append(math.ceil(value) if bit else math.floor(value))
            total += weight * table[level * size + hashed(*corner) % size]
        out.append(total)
    return np.concatenate(out)


def perceptron(x: Array, matrices: list[Array], biases: list[Array] | None = None) -> Array:
    for index, matrix in enumerate(matrices):
        x = matrix @ x + (0.0 if biases is None else biases[index])
        if index < len(matrices) - 1:
            x = np.maximum(x, 0.0)
    return x


def harmonics(d: Array) -> Array:
    """Values [16] of degree 3 at a vector, as nerfstudio writes them (no Condon-Shortley phase)."""
    x, y, z = (float(value) for value in d)
    pi = math.pi
    a, b = math.sqrt(3 / (4 * pi)), math.sqrt(15 / (4 * pi))
    c, e, f = math.sqrt(35 / (32 * pi)), math.sqrt(105 / (4 * pi)), math.sqrt(21 / (32 * pi))
    return np.array([
        math.sqrt(1 / (4 * pi)), a * y, a * z, a * x,
        b * x * y, b * y * z, math.sqrt(5 / (16 * pi)) * (3 * z * z - 1), b * x * z, b / 2 * (x * x - y * y),
        c * y * (3 * x * x - y * y), e * x * y * z, f * y * (5 * z * z - 1),
        math.sqrt(7 / (16 * pi)) * z * (5 * z * z - 3), f * x * (5 * z * z - 1), e / 2 * z * (x * x - y * y),
        c * x * (x * x - 3 * y * y),
    ])  # fmt: skip


PHASE = np.array([1, -1, 1, -1, 1, -1, 1, -1, 1, -1, 1, -1, 1, -1, 1, -1.0])
"""Condon-Shortley signs of the 16 harmonics."""


def sigmoid(x: Array) -> Array:
    result: Array = 1.0 / (1.0 + np.exp(-x))
    return result
