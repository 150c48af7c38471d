"""Checkpoints of other programs, told apart by their content."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from cagefield.errors import FieldError
from cagefield.files.npz import array_headers
from cagefield.files.safe_open import UnreadableError, check_regular
from cagefield.formats.external.checkpoint import ExternalCheckpoint, format_names
from cagefield.formats.external.instant_ngp import is_instant_ngp, read_instant_ngp
from cagefield.formats.external.nerfacto import is_nerfacto, read_nerfacto
from cagefield.formats.external.plenoctree import is_plenoctree, read_plenoctree
from cagefield.formats.external.svox2 import is_svox2, read_svox2
from cagefield.formats.external.svraster import is_svraster, read_svraster
from cagefield.formats.external.tensorf import is_tensorf, read_tensorf
from cagefield.formats.nerf.nerf_pytorch import KRRISH94, YENCHENLIN
from cagefield.formats.torch_files import read_torch_tensors

Headers = dict[str, tuple[tuple[int, ...], np.dtype[Any]]]
"""(shape, type) of the arrays of an .npz by name."""

_TORCH: tuple[
    tuple[Callable[[Mapping[str, Any]], bool], Callable[[Mapping[str, Any]], ExternalCheckpoint]], ...
] = ((is_tensorf, read_tensorf), (is_svraster, read_svraster))
"""(test, reader) of dictionaries that `torch.save` wrote."""

_NPZ: tuple[tuple[Callable[[Headers], bool], Callable[[Path, Headers], ExternalCheckpoint]], ...] = (
    (is_svox2, read_svox2),
    (is_plenoctree, read_plenoctree),
)
"""(test, reader) of files that `numpy.savez` wrote."""


def read_external(path: Path | str, config: Path | None = None) -> ExternalCheckpoint | None:
    """Field of another program's checkpoint; None for nerf-pytorch's.

    Raises:
        FieldError: a checkpoint of another program, a config for another checkpoint than nerfacto's, missing
            or damaged file, objects beside tensors and plain values (which are not unpickled), missing or
            misshapen tensors, missing PyTorch.
    """
    path = Path(path)
    if not os.path.exists(path):  # also where the name is too long for a file
        raise FieldError(f"{path}: no such checkpoint; give the file that the training wrote")
    try:
        if is_instant_ngp(path):
            _check_no_config(config)
            return read_instant_ngp(path)
        if path.suffix.lower() == ".npz":
            _check_no_config(config)
            return _read_npz(path)
        content = read_torch_tensors(path)
        if is_nerfacto(content):
            return read_nerfacto(content, path, config)
        for test, reader in _TORCH:
            if test(content):
                _check_no_config(config)
                return reader(content)
        if not any(name in content for name in (YENCHENLIN[0], KRRISH94[0])):
            raise FieldError(_unknown(content))
    except FieldError as error:
        message = str(error)
        raise FieldError(message if message.startswith(str(path)) else f"{path}: {message}") from None
    return None


def _unknown(content: Mapping[str, Any]) -> str:
    if "pipeline" in content:
        return "a checkpoint of nerfstudio, of another model than nerfacto and splatfacto; train one of these"
    return (
        f"a checkpoint of no program that is read: it holds {format_names(content)}; these are nerf-pytorch, "
        "TensoRF, nerfacto, splatfacto, SVRaster, Instant-NGP, svox2 and svox"
    )


def _check_no_config(config: Path | None) -> None:
    if config is not None:
        raise FieldError(f"a checkpoint of this program holds its options; leave out the config {config}")


def _read_npz(path: Path) -> ExternalCheckpoint:
    try:
        check_regular(path)
        headers = array_headers(path)
        for test, reader in _NPZ:
            if test(headers):
                return reader(path, headers)
    except UnreadableError as error:
        raise FieldError(f"{path}: {error}") from None
    except (ValueError, OSError) as error:
        if isinstance(error, FieldError):
            raise
        reason = getattr(error, "strerror", None) or str(error)
        raise FieldError(f"{path}: not a readable .npz ({reason:.160}); copy it again") from error
    raise FieldError(
        f"{path}: no field that is read: it holds {format_names(headers)}; expected those of svox2 or svox"
    )
