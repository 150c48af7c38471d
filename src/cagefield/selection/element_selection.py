"""Selection as a value: a mask over the elements of a field, packed and compressed."""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from cagefield.errors import CagefieldError
from cagefield.typing import Mask

Mode: TypeAlias = Literal["replace", "add", "subtract", "intersect"]


@dataclass(frozen=True)
class Selection:
    """Mask over N elements, equal where the masks are.

    Attributes:
        total: N.
        count: number of selected elements.
        bits: the mask, 8 elements a byte, compressed by zlib: a history has hundreds of them.
    """

    total: int
    count: int
    bits: bytes

    @classmethod
    def from_mask(cls, mask: Mask) -> Selection:
        """Selection of the elements that are True in `mask` [N]."""
        return cls(len(mask), int(np.count_nonzero(mask)), zlib.compress(np.packbits(mask).tobytes(), 1))

    @classmethod
    def none(cls, total: int) -> Selection:
        """Selection of none of N elements."""
        return cls.from_mask(np.zeros(total, bool))

    @property
    def mask(self) -> Mask:
        """[N] bool."""
        packed = np.frombuffer(zlib.decompress(self.bits), np.uint8)
        return np.unpackbits(packed, count=self.total).astype(bool)

    def __len__(self) -> int:
        return self.count

    @property
    def inverse(self) -> Selection:
        """Selection of all other elements."""
        return Selection.from_mask(~self.mask)

    def combine(self, picked: Selection, mode: Mode) -> Selection:
        """Selection after picking some elements: they replace it, join it, leave it, or are all that stays.

        Raises CagefieldError where the two are of different numbers of elements, or for another mode.
        """
        if picked.total != self.total:
            raise CagefieldError(
                f"a selection of {picked.total} elements does not fit one of {self.total}; select anew"
            )
        if mode == "replace":
            return picked
        if mode == "add":
            return Selection.from_mask(self.mask | picked.mask)
        if mode == "subtract":
            return Selection.from_mask(self.mask & ~picked.mask)
        if mode == "intersect":
            return Selection.from_mask(self.mask & picked.mask)
        raise CagefieldError(f'mode "{mode}" must be replace, add, subtract or intersect')
