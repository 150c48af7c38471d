"""Field files: safetensors with the kind of field and its format version in the header."""

from __future__ import annotations

import errno
import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from cagefield.errors import FieldError
from cagefield.fields.tensor_file import Tensor, read_header
from cagefield.files.atomic import replaced_file
from cagefield.files.memory import memory_shortage
from cagefield.files.safe_open import UnreadableError, check_regular, open_regular


def read_field_kind(path: str | Path) -> str | None:
    """Kind of field in the header of a field file; None for a header without kind.

    Raises:
        FieldError: the file is missing or unreadable.
    """
    with _opened(path) as (_, metadata, _):
        return metadata.get("kind")


def read_tensors(
    path: str | Path, kind: str, version: str, cure: str
) -> tuple[dict[str, str], dict[str, Any]]:
    """(header, tensors by name) of a field file; `cure` tells where a missing file comes from.

    Raises:
        FieldError: the file is missing, truncated, of another kind or a newer version, or has a tensor of an
            unsupported type.
    """
    if not Path(path).exists():
        raise FieldError(f"{path}: no such field file; {cure}")
    with _opened(path) as (file, metadata, known):
        if metadata.get("kind") != kind:
            raise FieldError(f"{path}: kind is {metadata.get('kind')!r:.60}, expected {kind!r}")
        if metadata.get("version") != version:
            raise FieldError(
                f"{path}: field format {metadata.get('version')!r:.60}, this cagefield reads "
                f"{version!r}; update cagefield"
            )
        for name, tensor in known.items():
            if not tensor.is_number:
                raise FieldError(
                    f"{path}: tensor {name!r:.60} is of type {tensor.kind:.20}, which is not read; "
                    "write it as F32"
                )
        tensors = {name: tensor.read(file) for name, tensor in known.items()}
    return metadata, tensors


@contextmanager
def _opened(path: str | Path) -> Iterator[tuple[BinaryIO, dict[str, str], dict[str, Tensor]]]:
    """(open file, its metadata, its tensors); errors within the context become FieldErrors."""
    try:
        with open_regular(path) as file:
            if (lacking := memory_shortage(check_regular(path))) is not None:
                raise FieldError(f"{path}: {lacking}")
            yield file, *read_header(file)
    except PermissionError as error:
        raise FieldError(f"{path}: it may not be read ({error.strerror}); make it readable") from error
    except UnreadableError as error:
        raise FieldError(f"{path}: {error}") from None
    except FieldError:
        raise
    except (ValueError, OSError) as error:
        raise FieldError(
            f"{path}: not a readable field file ({error!s:.160}); it may be truncated, write it again"
        ) from error


def write_tensors(path: str | Path, tensors: Mapping[str, Any], header: dict[str, str]) -> None:
    """Write a field file with default permissions; its folder must exist.

    Raises:
        OSError: the file cannot be written; the message names it, and an existing file stays unchanged.
    """
    from safetensors import SafetensorError
    from safetensors.numpy import save_file

    arrays = {name: np.ascontiguousarray(values) for name, values in tensors.items()}
    # Some file systems report a full disk only when a file is closed, which safetensors does not check: a
    # second open handle gets the error.
    with replaced_file(Path(path), parents=False) as draft, draft.open("r+b") as known:
        try:
            save_file(arrays, draft, header)
        except SafetensorError as error:
            raise _system_error(error) from None
        os.fsync(known.fileno())


def _system_error(error: Exception) -> OSError:
    """OSError of a failed write, whose number safetensors gives only in its message."""
    found = re.search(r"\(os error (\d+)\)", str(error))
    number = int(found.group(1)) if found else errno.EIO
    return OSError(number, os.strerror(number) if found else " ".join(str(error).split()))
