"""Unit quaternions (w, x, y, z) as rotations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def rotation_matrices(quaternions: NDArray[np.floating]) -> NDArray[np.floating]:
    """Rotations [N,3,3] of unit quaternions [N,4] (w, x, y, z)."""
    w, x, y, z = quaternions.T
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def quaternions_from_matrices(rotations: NDArray[np.floating]) -> NDArray[np.floating]:
    """Unit quaternions [N,4] (w, x, y, z) of rotations [N,3,3]."""
    from scipy.spatial.transform import Rotation

    if not len(rotations):
        return np.zeros((0, 4))
    return np.asarray(Rotation.from_matrix(rotations).as_quat()[:, [3, 0, 1, 2]])
