"""Protocol of radiance fields; no base class, no registration."""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray


@runtime_checkable
class Field(Protocol):
    """Density and color in canonical space: any callable object with `bounds`.

        class Fog:
            bounds = np.array([[-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]])

            def __call__(self, positions, viewdirs):
                n = len(positions)
                return np.full(n, 2.0, np.float32), np.full((n, 3), 0.5, np.float32)

    Positions are canonical, already mapped through the edits, so a field need not know of edits. Arrays are
    NumPy's, float32, with N up to half a million per call; split them where memory is short. Call a PyTorch
    module under `torch.no_grad()` and return its tensors as `.cpu().numpy()`; `examples/own_field.py` is a
    complete program. sigma is per world unit, with the absorption 1 - exp(-sigma s) over a length s: a module
    in coordinates u = c x must return c times its density.

    `render_sampled(field, camera, edits=...)` renders any field, and `fields.baking.bake(field)` bakes it
    into voxels for the fast renderer and the editor. A plain function works too, with an explicit `far` (or
    `bounds`, for baking).

    Optional methods for baking: `signed_density(positions, viewdirs)` [N], negative in empty space, which
    gives sharper surfaces than sigma; and `evaluate_directions(positions [N,3], viewdirs [N,K,3])`, the
    sigma [N] and rgb [N,K,3] of K directions at once, for fields where that is cheaper than K calls.
    """

    @property
    def bounds(self) -> NDArray[Any]:
        """Corners (min, max) [2,3], world units, of the box worth sampling; sigma is negligible outside."""
        ...

    def __call__(
        self, positions: NDArray[np.float32], viewdirs: NDArray[np.float32], /
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """(sigma [N] >= 0 per world unit, rgb [N,3] in [0,1]) at positions [N,3] along viewdirs [N,3].

        Viewdirs are unit and point from the camera into the scene. Positions outside `bounds` are valid.
        """
        ...
