"""PyTorch checkpoints, read without executing pickled code.

Tensors, plain values and NumPy arrays and scalars are read. NumPy's own constructors allocate whatever
shape a pickle names; those used here allocate nothing before the bytes are there.
"""

from __future__ import annotations

import pickle
import re
import warnings
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from cagefield.errors import FieldError
from cagefield.files.safe_open import UnreadableError, check_regular


def read_torch_tensors(path: Path) -> dict[str, Any]:
    """Dictionary written by `torch.save`; only tensors and plain values are unpickled.

    Raises:
        FieldError: missing file, missing PyTorch, a damaged file, or one with other objects.
    """
    try:
        check_regular(path)
    except UnreadableError as error:
        raise FieldError(f"{path}: {error}") from None
    except OSError:
        raise FieldError(f"{path}: no such checkpoint; give the file that the training wrote") from None
    try:
        import torch
    except ImportError as error:
        raise FieldError(
            f"{path}: reading a checkpoint needs PyTorch, which is not installed; "
            "pip install 'cagefield[nerf]'"
        ) from error
    _check_unpacked(path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # torch warns about pickles that are refused below
            with torch.serialization.safe_globals(_numpy_globals()):
                content = torch.load(path, map_location="cpu", weights_only=True)
    except pickle.UnpicklingError as error:
        match = re.search(r"(?:GLOBAL|class|global) ([\w.]+)", str(error))
        class_name = f" ({match.group(1)})" if match else ""
        raise FieldError(
            f"{path}: holds Python objects beside tensors{class_name}, or is no checkpoint; unpickling those "
            "can run any code, so it is refused; save the two state dicts alone with torch.save and read that"
        ) from error
    except Exception as error:  # damaged opcodes raise any exception
        # A truncated file has no message; an invalid opcode is a KeyError of its number.
        reason = "" if isinstance(error, LookupError) else " ".join(str(error).split()).split(". ")[0][:120]
        raise FieldError(
            f"{path}: not a readable checkpoint ({reason or 'no file of torch.save'}); it may be truncated, "
            "copy it again"
        ) from error
    if not isinstance(content, dict):
        raise FieldError(f"{path}: holds a {type(content).__name__}, expected a dict, as trainings save it")
    _check_sizes(path, content, path.stat().st_size)
    return content


def _numpy_globals() -> list[Any]:
    """NumPy's names in pickles, of versions 1 and 2, with their meaning here."""
    found: list[Any] = [np.ndarray, np.dtype]
    found += [type(np.dtype(kind)) for kind in ("?", *np.typecodes["AllInteger"], *np.typecodes["Float"])]
    for module in ("numpy.core.multiarray", "numpy._core.multiarray"):
        found += [(_empty_array, f"{module}._reconstruct"), (_numpy_scalar, f"{module}.scalar")]
    return found


def _empty_array(*_: Any) -> np.ndarray[Any, Any]:
    """Array without elements, to which unpickling gives its shape, type and bytes."""
    return np.empty(0, np.uint8)


def _numpy_scalar(kind: Any, raw: Any) -> Any:
    """NumPy number of a type, from its bytes."""
    number = np.dtype(kind)
    if number.kind not in "biuf" or not isinstance(raw, (bytes, str)):
        raise ValueError(f"a NumPy scalar of {number}")
    content = raw.encode("latin-1") if isinstance(raw, str) else raw
    return np.frombuffer(content, number, 1)[0]


def _check_unpacked(path: Path) -> None:
    """Refuse an archive that unpacks to more than its file size; `torch.save` does not compress."""
    try:
        if not zipfile.is_zipfile(path):
            return
        with zipfile.ZipFile(path) as archive:
            unpacked = sum(entry.file_size for entry in archive.infolist())
    except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError):
        return  # torch.load reports the problem
    if unpacked > path.stat().st_size:
        raise FieldError(f"{path}: unpacks to {unpacked} bytes, which no torch.save does; copy it again")


def _check_sizes(path: Path, content: Any, file_bytes: int) -> None:
    """Refuse tensors whose number of elements exceeds the file's size.

    A tensor with strides of 0 stores one number, but has any number of elements once it is copied.
    """
    pending, tensor_bytes = [content], 0
    while pending:
        value = pending.pop()
        if isinstance(value, dict):
            pending.extend(value.values())
        elif isinstance(value, (list, tuple)):
            pending.extend(value)
        elif isinstance(value, np.ndarray) or (hasattr(value, "numel") and hasattr(value, "element_size")):
            tensor_bytes += int(value.nbytes)
            if tensor_bytes > 2 * file_bytes:
                raise FieldError(
                    f"{path}: its tensors say that they hold {tensor_bytes} bytes or more, the "
                    f"file has {file_bytes}; save them contiguous"
                )
