"""InstantNgp as a field: its parameters, evaluated with PyTorch on first use."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from cagefield.fields.external.instant_ngp_parameters import InstantNgpParameters

if TYPE_CHECKING:
    from cagefield.fields.external.torch_field import TorchField


@dataclass(frozen=True, eq=False)
class InstantNgpField(InstantNgpParameters):
    """Field of `InstantNgpParameters` (canonical space, world units)."""

    def _torch_field(self) -> TorchField:
        from cagefield.fields.external.instant_ngp_torch import TorchInstantNgp

        return TorchInstantNgp(self)
