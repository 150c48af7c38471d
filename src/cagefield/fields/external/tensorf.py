"""TensoRF as a field; notation and source as in `tensorf_parameters`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from cagefield.errors import FieldError
from cagefield.fields.external.external_field import ExternalField
from cagefield.fields.external.tensorf_parameters import TensorfParameters

if TYPE_CHECKING:
    from cagefield.fields.external.torch_field import TorchField

_OPTIONS = (
    "shading", "activation", "density_shift", "distance_scale", "step", "near_far", "color_weight",
    "position_octaves", "view_octaves", "feature_octaves",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class TensorfField(TensorfParameters, ExternalField):
    """TensoRF model as a field (canonical space, world units); attributes as in `TensorfParameters`."""

    KIND: ClassVar[str] = "TensorfField"

    @property
    def bounds(self) -> NDArray[np.float64]:
        """Corners [2,3] of the box."""
        return self.box

    @property
    def model(self) -> str:
        """VM (plane and line products) or CP (line products)."""
        return "VM" if self.density_planes else "CP"

    def describe(self) -> str:
        """Model, grid, components, shading."""
        grid = " x ".join(str(line.shape[1]) for line in reversed(self.density_lines))
        counts = [
            "+".join(str(len(line)) for line in (lines if self.density_planes else lines[:1]))
            for lines in (self.density_lines, self.appearance_lines)
        ]
        masked = "" if self.mask is None else ", alpha mask"
        return (
            f"TensoRF: {self.model} {grid}, {counts[0]} density and {counts[1]} appearance components, "
            f"{self.shading} shading{masked}"
        )

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Planes, lines, basis, MLP and mask by name."""
        found: dict[str, NDArray[Any]] = {"box": self.box, "basis": self.basis}
        for name in ("density_planes", "density_lines", "appearance_planes", "appearance_lines"):
            found |= {f"{name}.{index}": array for index, array in enumerate(getattr(self, name))}
        for index, (weight, bias) in enumerate(self.mlp):
            found |= {f"mlp.{index}.weight": weight, f"mlp.{index}.bias": bias}
        if self.mask is not None and self.mask_box is not None:
            found |= {"mask": self.mask, "mask_box": self.mask_box}
        return found

    def options(self) -> dict[str, Any]:
        """Shading, activation, sampling."""
        return {name: getattr(self, name) for name in _OPTIONS}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[Any]], options: Mapping[str, Any]) -> TensorfField:
        """Field of the values of `arrays` and `options`. Raises FieldError where they do not fit."""

        def take(name: str) -> NDArray[Any]:
            if name not in arrays:
                raise FieldError(f"tensor missing: {name}")
            return arrays[name]

        def group(name: str) -> tuple[NDArray[Any], ...]:
            return tuple(take(f"{name}.{i}") for i in range(3)) if f"{name}.0" in arrays else ()

        mlp = tuple(
            (take(f"mlp.{i}.weight"), take(f"mlp.{i}.bias")) for i in range(3) if "mlp.0.weight" in arrays
        )
        return cls(
            take("box"),
            group("density_planes"),
            group("density_lines"),
            group("appearance_planes"),
            group("appearance_lines"),
            take("basis"),
            mlp,
            arrays.get("mask"),
            arrays.get("mask_box"),
            **{name: options[name] for name in _OPTIONS},
        )

    def _torch_field(self) -> TorchField:
        from cagefield.fields.external.tensorf_torch import TorchTensorf

        return TorchTensorf(self)
