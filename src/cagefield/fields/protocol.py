"""The one interface a radiance field needs; no base class, no registration."""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray


@runtime_checkable
class Field(Protocol):
    """Density and colour of canonical space.

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
