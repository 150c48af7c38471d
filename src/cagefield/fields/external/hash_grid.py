"""Multiresolution hash grids: arrays and options, in the layouts of two implementations.

Notation: x in [0,1]^3, level l of L, growth b, base resolution N, T = 2^log2_size entries of F features.

    "tcnn":  s_l = N b^l - 1, corners floor(s_l x + 1/2) and one more, resolution R_l = ceil(s_l) + 1
             index dense, i + j R_l + k R_l^2, where R_l^3 <= T, else hashed; always modulo the entries
             min(R_l^3 rounded up to 8, T) of the level
    "torch": s_l = floor(N b^l), corners floor(s_l x) and ceil(s_l x), every level hashed into T entries
    hash:    (i xor j 2654435761 xor k 805459861) modulo 2^32

Features of a level are interpolated trilinearly between the 8 corners; the levels' are concatenated.

Source: Mueller et al., "Instant Neural Graphics Primitives" (2022), section 3; layouts of
github.com/NVlabs/tiny-cuda-nn, include/tiny-cuda-nn/encodings/grid.h, and of
github.com/nerfstudio-project/nerfstudio, nerfstudio/field_components/encodings.py.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from cagefield.errors import FieldError
from cagefield.fields.external.external_field import frozen_array, number, whole_number
from cagefield.typing import Float32

HASH_GRID_LAYOUTS = ("tcnn", "torch")
MAX_DENSE_RESOLUTION = 0x659
"""Maximum resolution whose cube fits 32 bits; finer levels of tcnn are hashed."""


HASH_PRIMES = (1, 2654435761, 805459861)

OPTIONS = ("layout", "levels", "base", "growth", "log2_size")


@dataclass(frozen=True, eq=False)
class HashGrid:
    """Features of a multiresolution hash grid over the unit cube.

    Attributes:
        table: [entries of all levels, F] float32, level after level.
        layout: one of HASH_GRID_LAYOUTS.
        levels: number of levels. base: resolution N of the coarsest. growth: factor b between levels.
        log2_size: binary logarithm of the maximum number of entries of a level.

    Raises:
        FieldError: a table whose size does not fit the options.
    """

    table: Float32
    layout: str
    levels: int
    base: int
    growth: float
    log2_size: int

    def __post_init__(self) -> None:
        def fix(name: str, value: Any) -> None:
            object.__setattr__(self, name, value)

        if self.layout not in HASH_GRID_LAYOUTS:
            raise FieldError(f"layout of the hash grid is {self.layout!r:.40}; expected tcnn or torch")
        fix("levels", whole_number("number of levels", self.levels, 1, 128))
        fix("base", whole_number("base resolution", self.base, 1, 1 << 16))
        fix("growth", number("growth between levels", self.growth, 0.5, 1e4))
        fix("log2_size", whole_number("log2_hashmap_size", self.log2_size, 1, 30))
        finest = self.base * self.growth ** (self.levels - 1)
        if not finest <= 1 << 24:
            raise FieldError(f"the finest level of the hash grid has resolution {finest:.3g}, above 2^24")
        fix("table", frozen_array("table of the hash grid", self.table, np.float32, (None, None)))
        if len(self.table) != self.offsets[-1]:
            raise FieldError(
                f"the hash grid has {len(self.table)} entries; {self.levels} levels from {self.base} by "
                f"{self.growth:.6g} with at most 2^{self.log2_size} entries have {self.offsets[-1]}"
            )

    @property
    def features(self) -> int:
        """Number of outputs: features of all levels."""
        return self.levels * self.table.shape[1]

    @property
    def scales(self) -> tuple[float, ...]:
        """Scale s_l of each level with the layout "tcnn", in float32 as there."""
        logarithm = np.log2(np.float32(self.growth))
        return tuple(
            float(np.exp2(np.float32(level) * logarithm) * np.float32(self.base) - np.float32(1.0))
            for level in range(self.levels)
        )

    @property
    def resolutions(self) -> tuple[int, ...]:
        """Vertices R_l along each axis of each level with the layout "tcnn"."""
        return tuple(math.ceil(scale) + 1 for scale in self.scales)

    @property
    def offsets(self) -> tuple[int, ...]:
        """First entry of each level, and the number of all entries."""
        return entry_offsets(self.layout, self.resolutions, self.log2_size)

    def options(self) -> dict[str, Any]:
        """JSON values of everything but the table."""
        return {name: getattr(self, name) for name in OPTIONS}

    def __str__(self) -> str:
        """Levels, resolutions, size."""
        finest = self.base * self.growth ** (self.levels - 1)
        levels = f"{self.levels} levels {self.base} to {finest:.0f}"
        if self.levels == 1:
            levels = f"1 level {self.base}"
        return f"{levels}, {self.table.shape[1]} features, 2^{self.log2_size} entries"


def entry_offsets(layout: str, resolutions: tuple[int, ...], log2_size: int) -> tuple[int, ...]:
    """First entry of each level, and the number of all entries."""
    offsets = [0]
    for resolution in resolutions:
        entries = 1 << log2_size
        if layout == "tcnn":
            entries = min(-(-(resolution**3) // 8) * 8, entries)
        offsets.append(offsets[-1] + entries)
    return tuple(offsets)


def expected_entries(layout: str, levels: int, base: int, growth: float, log2_size: int) -> int:
    """Number of entries of a grid of these options.

    Raises:
        FieldError: options out of range.
    """
    whole_number("number of levels", levels, 1, 128)
    whole_number("base resolution", base, 1, 1 << 16)
    whole_number("log2_hashmap_size", log2_size, 1, 30)
    number("growth between levels", growth, 0.5, 1e4)
    if not base * growth ** (levels - 1) <= 1 << 24:
        raise FieldError("the finest level of the hash grid has a resolution above 2^24")
    grid = object.__new__(HashGrid)
    for name, value in (("levels", levels), ("base", base), ("growth", growth)):
        object.__setattr__(grid, name, value)
    return entry_offsets(layout, grid.resolutions, log2_size)[-1]
