"""Field files: safetensors with the kind of field and the version of its layout in the header."""

from __future__ import annotations

import errno
import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from cagefield.atomic_files import replaced_file
from cagefield.devices import lacking_memory
from cagefield.errors import FieldError
from cagefield.regular_files import UnreadableError, check_regular, open_regular

_NUMBERS = ("F64", "F32", "F16", "I64", "I32", "I16", "I8", "U64", "U32", "U16", "U8", "BOOL")
"""Types of tensors that numpy knows and that are real."""


def kind_of(path: str | Path) -> str | None:
    """The kind of field that the header of a field file names; None where it names none.

    Raises:
        FieldError: the file is missing or cannot be read.
    """
    with _opened(path) as file:
        return (file.metadata() or {}).get("kind")


def read_tensors(
    path: str | Path, kind: str, version: str, cure: str
) -> tuple[dict[str, str], dict[str, Any]]:
    """(header, tensors by name) of a field file; `cure` says where a file that is not there comes from.

    Raises:
        FieldError: the file is missing, truncated, of another kind or of a newer version, or has a tensor
            of a type that is not read.
    """
    if not Path(path).exists():
        raise FieldError(f"{path}: no such field file; {cure}")
    with _opened(path) as file:
        metadata = file.metadata() or {}
        if metadata.get("kind") != kind:
            raise FieldError(f"{path}: kind is {metadata.get('kind')!r:.60}, expected {kind!r}")
        if metadata.get("version") != version:
            raise FieldError(
                f"{path}: field format {metadata.get('version')!r:.60}, this cagefield reads "
                f"{version!r}; update cagefield"
            )
        tensors = {}
        for name in file.keys():  # noqa: SIM118
            numbers = file.get_slice(name).get_dtype()
            if numbers not in _NUMBERS:
                raise FieldError(
                    f"{path}: tensor {name!r:.60} is of type {numbers}, which is not read; write it as F32"
                )
            tensors[name] = file.get_tensor(name)
    return metadata, tensors


@contextmanager
def _opened(path: str | Path) -> Iterator[Any]:
    """A safetensors file; what goes wrong within is a FieldError that names it."""
    from safetensors import SafetensorError, safe_open

    try:
        with open_regular(path):  # safetensors calls a file that may not be read one that is not there
            size = check_regular(path)
        if (lacking := lacking_memory(size)) is not None:
            raise FieldError(f"{path}: {lacking}")
        with safe_open(str(path), framework="numpy") as file:
            yield file
    except PermissionError as error:
        raise FieldError(f"{path}: it may not be read ({error.strerror}); make it readable") from error
    except UnreadableError as error:
        raise FieldError(f"{path}: {error}") from None
    except (SafetensorError, OSError) as error:
        raise FieldError(
            f"{path}: not a readable field file ({error!s:.160}); it may be truncated, write it again"
        ) from error


def write_tensors(path: str | Path, tensors: Mapping[str, Any], header: dict[str, str]) -> None:
    """Writes a field file, which others may read as they may any new file; its folder must exist.

    Raises:
        OSError: it cannot be written; names the file, and what was there is as it was.
    """
    from safetensors import SafetensorError
    from safetensors.numpy import save_file

    arrays = {name: np.ascontiguousarray(values) for name, values in tensors.items()}
    with replaced_file(Path(path), parents=False) as draft:
        try:
            save_file(arrays, draft, header)
        except SafetensorError as error:
            raise _system_error(error) from None


def _system_error(error: Exception) -> OSError:
    """What the system refused, of which safetensors has the number in its text alone."""
    found = re.search(r"\(os error (\d+)\)", str(error))
    number = int(found.group(1)) if found else errno.EIO
    return OSError(number, os.strerror(number) if found else " ".join(str(error).split()))
