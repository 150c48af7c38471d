"""Pytest plugin (`-p without_torch`): PyTorch cannot be imported, as after the README's installation."""

from __future__ import annotations

import importlib.abc
import importlib.util
import sys
from importlib.machinery import ModuleSpec


class _Refusal(importlib.abc.MetaPathFinder):
    """Finder that finds no PyTorch."""

    def find_spec(self, fullname: str, path: object = None, target: object = None) -> None:
        if fullname.partition(".")[0] == "torch":
            raise ModuleNotFoundError(f"No module named {fullname!r}", name=fullname)


def _find_spec(name: str, package: str | None = None) -> ModuleSpec | None:
    """Stands for `importlib.util.find_spec`, which raises where a finder does."""
    return None if name == "torch" else _found(name, package)


_found = importlib.util.find_spec
importlib.util.find_spec = _find_spec
sys.meta_path.insert(0, _Refusal())
