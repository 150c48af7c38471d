"""Checkpoints of PyTorch, read without running code that they may hold."""

from __future__ import annotations

import pickle
import re
import warnings
from pathlib import Path
from typing import Any

from cagefield.errors import FieldError


def read_tensors_of(path: Path) -> dict[str, Any]:
    """The dict that `torch.save` wrote; only tensors and plain values are unpickled, no code is run.

    Raises:
        FieldError: no such file, no PyTorch, a file that is damaged or holds other objects.
    """
    if not path.is_file():
        raise FieldError(f"{path}: no such checkpoint; give the .tar or .ckpt file that the training wrote")
    try:
        import torch
    except ImportError as error:
        raise FieldError(
            f"{path}: reading a checkpoint needs PyTorch, which is not installed; "
            "pip install 'cagefield[nerf]'"
        ) from error
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
    except (RuntimeError, EOFError, OSError, ValueError, LookupError, AttributeError, TypeError,
            AssertionError, MemoryError) as error:  # fmt: skip
        # An end too early has no text, a wrong opcode is a KeyError of its number.
        reason = "" if isinstance(error, LookupError) else " ".join(str(error).split())[:120]
        raise FieldError(
            f"{path}: not a readable checkpoint ({reason or 'no file of torch.save'}); it may be truncated, "
            "copy it again"
        ) from error
    if not isinstance(content, dict):
        raise FieldError(f"{path}: holds a {type(content).__name__}, expected a dict, as trainings save it")
    return content
