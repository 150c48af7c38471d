"""Import of Quadrants without PyTorch, which Quadrants would load where it is installed.

PyTorch costs every process over a second and 150 megabytes, for tensors that only networks hand to kernels.
A PyTorch that is already loaded stays in use, and one loaded later can be used: see `take_tensors`.

Quadrants 1.3 keeps the arguments of launches by the identity of the objects that were passed, as long as the
arrays in them live. A new frozen dataclass at the address of one that is gone would launch with the fields of
the old one, another camera or photo; so no launch is kept.
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
    from quadrants.lang.kernel import LaunchContextBufferCache
finally:
    if _HIDDEN:
        del sys.modules["torch"]

__all__ = ["qd", "take_tensors"]


def _keep_no_launch(*_: object) -> None:
    """Stands for `LaunchContextBufferCache.cache`; see above."""


LaunchContextBufferCache.cache = _keep_no_launch  # type: ignore[method-assign, unused-ignore]


def take_tensors(tensor: type) -> None:
    """Has Quadrants find the kernels that were compiled for a type of tensors again, as for arrays."""
    args_hasher.torch_type = tensor
