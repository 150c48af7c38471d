"""Checkpoints of other programs, told apart by their content."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from cagefield.errors import FieldError
from cagefield.formats.external.checkpoint import ExternalCheckpoint
from cagefield.formats.external.instant_ngp import is_instant_ngp, read_instant_ngp
from cagefield.formats.external.nerfacto import is_nerfacto, read_nerfacto
from cagefield.formats.external.tensorf import is_tensorf, read_tensorf
from cagefield.formats.torch_files import read_torch_tensors

_TORCH: tuple[
    tuple[Callable[[Mapping[str, Any]], bool], Callable[[Mapping[str, Any]], ExternalCheckpoint]], ...
] = ((is_tensorf, read_tensorf),)
"""(test, reader) of dictionaries that `torch.save` wrote."""


def read_external(path: Path | str, config: Path | None = None) -> ExternalCheckpoint | None:
    """Field of another program's checkpoint; None for a PyTorch file of none of them, as nerf-pytorch's.

    Raises:
        FieldError: missing or damaged file, objects beside tensors and plain values (which are not
            unpickled), missing or misshapen tensors, missing PyTorch.
    """
    path = Path(path)
    try:
        if is_instant_ngp(path):
            return read_instant_ngp(path)
        content = read_torch_tensors(path)
        if is_nerfacto(content):
            return read_nerfacto(content, path, config)
        for test, reader in _TORCH:
            if test(content):
                return reader(content)
    except FieldError as error:
        message = str(error)
        raise FieldError(message if message.startswith(str(path)) else f"{path}: {message}") from None
    return None
