"""Quadrants, imported without PyTorch, which it would load where that is installed.

That takes over a second and 150 megabytes of every process, for tensors that only networks hand to kernels.

What is loaded already stays in use, and what is loaded later can be: see `take_tensors`.
"""

from __future__ import annotations

import sys
from typing import Any, cast

_HIDDEN = "torch" not in sys.modules
if _HIDDEN:
    # What has no module cannot be imported.
    sys.modules["torch"] = cast(Any, None)
try:
    import quadrants as qd
    from quadrants.lang._fast_caching import args_hasher
finally:
    if _HIDDEN:
        del sys.modules["torch"]

__all__ = ["qd", "take_tensors"]


def take_tensors(tensor: type) -> None:
    """Has Quadrants find the kernels that were compiled for a type of tensors again, as for arrays."""
    args_hasher.torch_type = tensor
