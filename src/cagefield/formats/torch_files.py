"""Checkpoints of PyTorch, read without running code that they may hold."""

from __future__ import annotations

import pickle
import re
import warnings
import zipfile
from pathlib import Path
from typing import Any

from cagefield.errors import FieldError
from cagefield.files.safe_open import UnreadableError, check_regular


def read_tensors_of(path: Path) -> dict[str, Any]:
    """The dict that `torch.save` wrote; only tensors and plain values are unpickled, no code is run.

    Raises:
        FieldError: no such file, no PyTorch, a file that is damaged or holds other objects.
    """
    try:
        check_regular(path)
    except UnreadableError as error:
        raise FieldError(f"{path}: {error}") from None
    except OSError:
        raise FieldError(
            f"{path}: no such checkpoint; give the .tar or .ckpt file that the training wrote"
        ) from None
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
            warnings.simplefilter("ignore")  # torch's, of pickles that are refused anyway
            content = torch.load(path, map_location="cpu", weights_only=True)
    except pickle.UnpicklingError as error:
        found = re.search(r"(?:GLOBAL|class|global) ([\w.]+)", str(error))
        what = f" ({found.group(1)})" if found else ""
        raise FieldError(
            f"{path}: holds Python objects beside tensors{what}, or is no checkpoint; unpickling those can "
            "run any code, so it is refused; save the two state dicts alone with torch.save and read that"
        ) from error
    except Exception as error:  # the unpickler raises what damaged opcodes lead it to
        # An end too early has no text, a wrong opcode is a KeyError of its number.
        reason = "" if isinstance(error, LookupError) else " ".join(str(error).split())[:120]
        raise FieldError(
            f"{path}: not a readable checkpoint ({reason or 'no file of torch.save'}); it may be truncated, "
            "copy it again"
        ) from error
    if not isinstance(content, dict):
        raise FieldError(f"{path}: holds a {type(content).__name__}, expected a dict, as trainings save it")
    _check_sizes(path, content, path.stat().st_size)
    return content


def _check_unpacked(path: Path) -> None:
    """Refuses an archive that is much larger than its file: `torch.save` does not compress."""
    try:
        if not zipfile.is_zipfile(path):
            return
        with zipfile.ZipFile(path) as archive:
            unpacked = sum(entry.file_size for entry in archive.infolist())
    except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError):
        return  # torch says what is wrong with it
    if unpacked > path.stat().st_size:
        raise FieldError(f"{path}: unpacks to {unpacked} bytes, which no torch.save does; copy it again")


def _check_sizes(path: Path, content: Any, left: int) -> None:
    """Refuses tensors that say they hold more numbers than the file has room for.

    A tensor whose strides are 0 is one number in the file, and any number of them once it is copied.
    """
    waiting, seen = [content], 0
    while waiting:
        value = waiting.pop()
        if isinstance(value, dict):
            waiting.extend(value.values())
        elif isinstance(value, (list, tuple)):
            waiting.extend(value)
        elif hasattr(value, "numel") and hasattr(value, "element_size"):
            seen += int(value.numel()) * int(value.element_size())
            if seen > 2 * left:
                raise FieldError(
                    f"{path}: its tensors say that they hold {seen} bytes or more, the file has {left}; "
                    "save them contiguous"
                )
