"""Import of Quadrants without PyTorch, which Quadrants would load where it is installed.

PyTorch costs every process over a second and 150 megabytes, for tensors that only networks hand to kernels.
A PyTorch that is already loaded stays in use, and one loaded later can be used: see `take_tensors`.
"""

from __future__ import annotations

import sys
from typing import Any, cast

_HIDDEN = "torch" not in sys.modules
if _HIDDEN:
    # A name without a module cannot be imported.
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
