"""A hash grid followed by a perceptron: arrays, checks, and their names in a field file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.errors import FieldError
from cagefield.fields.external.external_field import frozen_array
from cagefield.fields.external.hash_grid import OPTIONS, HashGrid
from cagefield.typing import Float32

Layers = tuple[tuple[Float32, Float32], ...]
"""(weight [out,in], bias [out]) of each layer, with ReLU between them."""

MAX_NETWORK_LAYERS = 64


@dataclass(frozen=True, eq=False)
class HashNetwork:
    """Perceptron over the features of a hash grid.

    Raises:
        FieldError: layers that do not fit the grid or each other.
    """

    grid: HashGrid
    layers: Layers

    def __post_init__(self) -> None:
        object.__setattr__(self, "layers", checked_layers("layer", self.layers, self.grid.features))

    @property
    def outputs(self) -> int:
        """Number of outputs."""
        return len(self.layers[-1][0])

    def arrays(self, name: str) -> dict[str, NDArray[Any]]:
        """Table and layers by name."""
        return {f"{name}.table": self.grid.table, **layer_arrays(name, self.layers)}

    @classmethod
    def from_arrays(
        cls, name: str, arrays: Mapping[str, NDArray[Any]], options: Mapping[str, Any]
    ) -> HashNetwork:
        """Network of the values of `arrays` and of the grid's options.

        Raises:
            FieldError: missing arrays, or arrays that do not fit.
        """
        table = take_array(arrays, f"{name}.table")
        grid = HashGrid(table, **{key: options[key] for key in OPTIONS})
        return cls(grid, take_layers(arrays, name))


def checked_layers(name: str, layers: Any, inputs: int, outputs: int | None = None) -> Layers:
    """Read-only copies of layers for a number of inputs (and outputs).

    Raises:
        FieldError: shapes that do not fit each other.
    """
    if not 1 <= len(layers) <= MAX_NETWORK_LAYERS:
        raise FieldError(f"a network must have 1 to {MAX_NETWORK_LAYERS} layers, got {len(layers)}")
    found = []
    for index, (weight, bias) in enumerate(layers):
        rows = outputs if index == len(layers) - 1 else None
        weight = frozen_array(f"{name} {index} weight", weight, np.float32, (rows, inputs))
        bias = frozen_array(f"{name} {index} bias", bias, np.float32, (len(weight),))
        found.append((weight, bias))
        inputs = len(weight)
    return tuple(found)


def layer_arrays(name: str, layers: Layers) -> dict[str, NDArray[Any]]:
    """Weights and biases by name."""
    found: dict[str, NDArray[Any]] = {}
    for index, (weight, bias) in enumerate(layers):
        found |= {f"{name}.{index}.weight": weight, f"{name}.{index}.bias": bias}
    return found


def take_layers(arrays: Mapping[str, NDArray[Any]], name: str) -> Layers:
    """Layers that `layer_arrays` named. Raises FieldError where one is missing."""
    count = 0
    while f"{name}.{count}.weight" in arrays:
        count += 1
    return tuple(
        (take_array(arrays, f"{name}.{index}.weight"), take_array(arrays, f"{name}.{index}.bias"))
        for index in range(max(1, count))
    )


def take_array(arrays: Mapping[str, NDArray[Any]], name: str) -> NDArray[Any]:
    """Array of a name. Raises FieldError where it is missing."""
    if name not in arrays:
        raise FieldError(f"tensor missing: {name}")
    return arrays[name]


def describe_layers(layers: Layers) -> str:
    """Hidden widths, such as "2 x 64"."""
    hidden = [len(weight) for weight, _ in layers[:-1]]
    if not hidden:
        return "linear"
    return f"{len(hidden)} x {hidden[0]}" if len(set(hidden)) == 1 else " + ".join(map(str, hidden))
