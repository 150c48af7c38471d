"""Flat parameter vectors of tiny-cuda-nn: matrices [out, in] row by row, without biases."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.errors import FieldError
from cagefield.fields.external.hash_network import Layers


class FlatParameters:
    """Vector of parameters, taken from its front."""

    def __init__(self, values: NDArray[Any], name: str) -> None:
        self._values, self._name, self._at = values, name, 0

    def matrix(self, rows: int, columns: int) -> NDArray[np.float32]:
        """The next rows x columns values, float32.

        Raises:
            FieldError: fewer values are left.
        """
        count = rows * columns
        left = len(self._values) - self._at
        if count > left:
            raise FieldError(
                f"{self._name} has {len(self._values)} values, {count - left} fewer than its options say"
            )
        part = self._values[self._at : self._at + count]
        self._at += count
        return part.astype(np.float32).reshape(rows, columns)

    def layers(
        self,
        stored: int,
        inputs: int,
        width: int,
        hidden: int,
        outputs: int,
        alignment: int,
        padding: float,
    ) -> Layers:
        """Layers of a perceptron: `stored` input columns, of which `inputs` are used.

        The other columns get the constant `padding`, which becomes the first bias.
        """
        shapes = [(width, stored)] + [(width, width)] * (hidden - 1) if hidden else []
        last = width if hidden else stored
        matrices = [self.matrix(*shape) for shape in shapes]
        matrices.append(self.matrix(padded(outputs, alignment), last)[:outputs])
        first = matrices[0]
        bias = (padding * first[:, inputs:].sum(axis=1)).astype(np.float32)
        matrices[0] = np.ascontiguousarray(first[:, :inputs])
        biases = [bias, *(np.zeros(len(matrix), np.float32) for matrix in matrices[1:])]
        return tuple(zip(matrices, biases, strict=True))

    def check_end(self) -> None:
        """Raises FieldError where values are left."""
        if self._at != len(self._values):
            raise FieldError(
                f"{self._name} has {len(self._values)} values, {len(self._values) - self._at} more than its "
                "options say"
            )


def padded(count: int, alignment: int) -> int:
    """The multiple of `alignment` from `count` on."""
    return -(-count // alignment) * alignment
