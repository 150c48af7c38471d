"""The one interface a radiance field needs; no base class, no registration."""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray


@runtime_checkable
class Field(Protocol):
    """Density and colour of canonical space: any object with `bounds` that can be called.

        class Fog:
            bounds = np.array([[-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]])

            def __call__(self, positions, viewdirs):
                n = len(positions)
                return np.full(n, 2.0, np.float32), np.full((n, 3), 0.5, np.float32)

    It is asked at canonical positions, already taken through the edits: it need not know of them. Arrays are
    numpy's, float32, N up to half a million in one call; split them where memory is short. A PyTorch module
    is called under `torch.no_grad()` and its tensors handed back as `.cpu().numpy()`; `examples/own_field.py`
    is a whole program. sigma is per world unit, absorption over a length s being 1 - exp(-sigma s): a module
    that works in coordinates of its own, u = c x, must return c times its density.

    `render_sampled(field, camera, edits=...)` renders any field, and `fields.baking.bake(field)` makes the
    voxels for the fast renderer and the editor. A plain function works too, where `far` (or, to bake,
    `bounds`) is given.

    A field may also have, for baking: `signed_density(positions, viewdirs)` [N], negative where it is empty,
    which keeps surfaces sharper than sigma does; and `seen_along(positions [N,3], viewdirs [N,K,3])`, the
    sigma [N] and rgb [N,K,3] of K directions at once, where that costs less than K calls.
    """

    @property
    def bounds(self) -> NDArray[Any]:
        """Corners (min, max) [2,3], world units, of the box worth sampling; sigma is negligible outside."""
        ...

    def __call__(
        self, positions: NDArray[np.float32], viewdirs: NDArray[np.float32], /
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """(sigma [N] >= 0 per world unit, rgb [N,3] in [0,1]) at positions [N,3] seen along viewdirs [N,3].

        A viewdir is unit and points from the camera into the scene. Positions outside `bounds` are valid.
        """
        ...
