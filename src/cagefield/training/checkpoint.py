"""Checkpoint files: named scalars and arrays, and the signature of the training they belong to."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.errors import CagefieldError
from cagefield.files import json_text
from cagefield.files.atomic import replaced_file
from cagefield.files.npz import read_arrays


def write_checkpoint(
    path: Path, signature: str, scalars: Mapping[str, Any], arrays: Mapping[str, Any]
) -> None:
    """Write a checkpoint atomically; `signature` identifies the training."""
    contents: dict[str, Any] = {"scalars": json.dumps(scalars), "config": signature, **arrays}
    with replaced_file(path) as draft, open(draft, "wb") as file:
        np.savez(file, **contents)


def signature_options(config: Any, keys: Mapping[str, str]) -> dict[str, Any]:
    """Options of a configuration dataclass by their keys in signatures; `keys` has those that differ."""
    return {keys.get(name, name): value for name, value in dataclasses.asdict(config).items()}


def read_checkpoint(path: Path, signature: str) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """(scalars, arrays) of a file that `write_checkpoint` wrote with this signature.

    Raises:
        CagefieldError: missing file, damaged file, or checkpoint of another training.
    """
    try:
        arrays = read_arrays(path)
        scalars, written_for = json_text.loads(str(arrays.pop("scalars"))), str(arrays.pop("config"))
    except KeyError as error:
        raise CagefieldError(
            f"{path}: the checkpoint of another kind of training; give the field that it was started with"
        ) from error
    except (OSError, ValueError) as error:
        raise CagefieldError(f"{path}: not a readable checkpoint ({error!s:.160}); start anew") from error
    if not isinstance(scalars, dict):
        raise CagefieldError(f"{path}: not a readable checkpoint (its numbers have no names); start anew")
    if written_for != signature:
        raise CagefieldError(f"{path}: written for other photos or settings; start anew")
    return scalars, arrays
