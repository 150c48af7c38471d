"""Nerfacto as a field: its parameters, evaluated with PyTorch on first use."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from cagefield.fields.external.nerfacto_parameters import NerfactoParameters

if TYPE_CHECKING:
    from cagefield.fields.external.torch_field import TorchField


@dataclass(frozen=True, eq=False)
class NerfactoField(NerfactoParameters):
    """Field of `NerfactoParameters` (canonical space, world units)."""

    def _torch_field(self) -> TorchField:
        from cagefield.fields.external.nerfacto_torch import TorchNerfacto

        return TorchNerfacto(self)
