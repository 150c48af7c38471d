"""Networks of a NeRF as arrays of layers; `fields.nerf_field` has the notation."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from cagefield.errors import FieldError
from cagefield.typing import Array, Float32

MAX_OCTAVES = 32
"""Maximum number of octaves; more exceed float32 and indicate a misread shape."""


@dataclass(frozen=True, eq=False)
class Linear:
    """Affine layer W x + b: weight [out,in] and bias [out] float32, with a name for messages."""

    weight: Float32
    bias: Float32
    name: str = "layer"

    def __post_init__(self) -> None:
        for attribute, dimensions in (("weight", 2), ("bias", 1)):
            values = np.array(getattr(self, attribute), np.float32, order="C")
            if values.ndim != dimensions:
                raise FieldError(
                    f"{self.name}.{attribute} must have {dimensions} dimensions, not {list(values.shape)}"
                )
            if not np.isfinite(values).all():
                raise FieldError(f"{self.name}.{attribute} must be finite; its training diverged")
            values.setflags(write=False)
            object.__setattr__(self, attribute, values)
        if self.bias.shape != (self.outputs,):
            raise FieldError(
                f"{self.name}.bias must be [{self.outputs}] like the weight, not {list(self.bias.shape)}"
            )

    @property
    def inputs(self) -> int:
        """Number of inputs."""
        return self.weight.shape[1]

    @property
    def outputs(self) -> int:
        """Number of outputs."""
        return self.weight.shape[0]


@dataclass(frozen=True, eq=False)
class Mlp:
    """Network, whose shape follows from the weights.

    Attributes:
        trunk: layers of any width; a layer whose input is wider than the previous output by the position's
            encoding also takes the encoding, as its first inputs.
        density: one output.
        rgb: three outputs.
        feature: layer between trunk and view branch, None without one.
        view: layers of the view branch, the first with input (feature, direction's encoding); empty where the
            trunk gives the color.
        rectified_feature: True where a ReLU follows `feature`.

    Raises:
        FieldError: layers of mismatching shapes; the message names the tensor.
    """

    trunk: tuple[Linear, ...]
    density: Linear
    rgb: Linear
    feature: Linear | None = None
    view: tuple[Linear, ...] = ()
    rectified_feature: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "trunk", tuple(self.trunk))
        object.__setattr__(self, "view", tuple(self.view))
        if not self.trunk:
            raise FieldError("a network must have a layer in its trunk")
        encoded = self.trunk[0].inputs
        _check_encoding(self.trunk[0], encoded)
        for before, layer in zip(self.trunk, self.trunk[1:], strict=False):
            _check_inputs(layer, before.outputs, before.outputs + encoded)
        hidden = self.trunk[-1].outputs
        _check_inputs(self.density, hidden)
        _check_outputs(self.density, 1)
        if (self.feature is None) != (not self.view):
            raise FieldError("a view branch needs both a feature layer and view layers")
        if self.feature is not None:
            _check_inputs(self.feature, hidden)
            first = self.view[0]
            _check_encoding(first, first.inputs - self.feature.outputs)
            for before, layer in zip(self.view, self.view[1:], strict=False):
                _check_inputs(layer, before.outputs)
        _check_inputs(self.rgb, self.view[-1].outputs if self.view else hidden)
        _check_outputs(self.rgb, 3)

    @property
    def position_encoding(self) -> tuple[int, bool]:
        """(octaves, whether the position itself comes first)."""
        return _encoding(self.trunk[0].inputs)

    @property
    def view_encoding(self) -> tuple[int, bool] | None:
        """(octaves, whether the direction itself comes first), or None without a view branch."""
        return None if self.feature is None else _encoding(self.view[0].inputs - self.feature.outputs)

    @property
    def skips(self) -> tuple[bool, ...]:
        """Flags per trunk layer: whether its input includes the position's encoding."""
        return (
            False,
            *(
                layer.inputs != before.outputs
                for before, layer in zip(self.trunk, self.trunk[1:], strict=False)
            ),
        )

    def layers(self) -> Iterator[tuple[str, Linear]]:
        """Yield (name, layer) of all layers: trunk.0, ..., density, feature, view.0, ..., rgb."""
        for index, layer in enumerate(self.trunk):
            yield f"trunk.{index}", layer
        yield "density", self.density
        if self.feature is not None:
            yield "feature", self.feature
        for index, layer in enumerate(self.view):
            yield f"view.{index}", layer
        yield "rgb", self.rgb

    def __str__(self) -> str:
        """Depth, width and octaves, as "8 x 256, 10 + 4 octaves"."""
        octaves = str(self.position_encoding[0])
        if self.view_encoding is not None:
            octaves += f" + {self.view_encoding[0]}"
        return f"{len(self.trunk)} x {self.trunk[0].outputs}, {octaves} octaves"


class NerfParameters(Protocol):
    """Protocol of `NerfField`'s attributes."""

    @property
    def coarse(self) -> Mlp: ...
    @property
    def fine(self) -> Mlp | None: ...
    @property
    def bounds(self) -> Array: ...
    @property
    def bounded(self) -> bool: ...
    @property
    def ndc(self) -> tuple[float, float] | None: ...
    @property
    def near(self) -> float: ...
    @property
    def far(self) -> float: ...
    @property
    def samples(self) -> tuple[int, int]: ...
    @property
    def lindisp(self) -> bool: ...


def _encoding(size: int) -> tuple[int, bool]:
    """(octaves, input included) of an encoding of three coordinates with `size` values."""
    return size // 6, size % 6 == 3


def _check_encoding(layer: Linear, size: int) -> None:
    if size < 3 or size % 3 or size // 6 > MAX_OCTAVES:
        raise FieldError(
            f"{layer.name}.weight is {list(layer.weight.shape)}: {size} of its inputs would be an encoding, "
            "which has 3 + 6 L or 6 L values"
        )


def _check_inputs(layer: Linear, *allowed: int) -> None:
    if layer.inputs not in allowed:
        expected = " or ".join(f"[{layer.outputs}, {n}]" for n in allowed)
        raise FieldError(f"{layer.name}.weight is {list(layer.weight.shape)}, expected {expected}")


def _check_outputs(layer: Linear, outputs: int) -> None:
    if layer.outputs != outputs:
        raise FieldError(
            f"{layer.name}.weight is {list(layer.weight.shape)}, expected [{outputs}, {layer.inputs}]"
        )
