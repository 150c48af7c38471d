"""The state of a VoxelField's training in a file: numbers and arrays by name, and what they belong to."""

from __future__ import annotations

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
    """Writes them atomically; `signature` says which training they belong to."""
    contents: dict[str, Any] = {"scalars": json.dumps(scalars), "config": signature, **arrays}
    with replaced_file(path) as draft, open(draft, "wb") as file:
        np.savez(file, **contents)


def read_checkpoint(path: Path, signature: str) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """(scalars, arrays) of a file that `write_checkpoint` wrote with the same signature.

    Raises:
        CagefieldError: no such file, a damaged one, or one of another training.
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
