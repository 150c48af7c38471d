"""Rotation matrices of unit quaternions (w, x, y, z) and of angles."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


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


def rotation_matrix(theta: ArrayLike) -> NDArray[np.float64]:
    """R_x R_y R_z [3,3], right-handed, for intrinsic XYZ angles [3] in radians."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_euler("XYZ", np.asarray(theta, dtype=np.float64)).as_matrix())
