"""Real spherical harmonics of degree 0 to 4, in the order and with the signs of 3DGS and Plenoxels.

With d = (x, y, z) a unit direction, the (L+1)^2 values are
  l=0   C0
  l=1   -C1 y, C1 z, -C1 x
  l=2   C2[0] xy, C2[1] yz, C2[2] (2 z^2 - x^2 - y^2), C2[3] xz, C2[4] (x^2 - y^2)
  l=3   C3[0] y (3 x^2 - y^2), C3[1] xyz, C3[2] y (4 z^2 - x^2 - y^2), C3[3] z (2 z^2 - 3 x^2 - 3 y^2),
        C3[4] x (4 z^2 - x^2 - y^2), C3[5] z (x^2 - y^2), C3[6] x (x^2 - 3 y^2)
  l=4   C4[0] xy (x^2 - y^2), C4[1] yz (3 x^2 - y^2), C4[2] xy (6 z^2 - s), C4[3] yz (4 z^2 - 3 s),
        C4[4] (8 z^4 - 24 z^2 s + 3 s^2), C4[5] xz (4 z^2 - 3 s), C4[6] (x^2 - y^2) (6 z^2 - s),
        C4[7] xz (x^2 - 3 y^2), C4[8] (x^4 - 6 x^2 y^2 + y^4), with s = x^2 + y^2
They are orthonormal over the sphere: the integral of Y_i Y_j is 1 for i = j, else 0. The order is
m = -l..l; the Condon-Shortley phase is included, so odd m have the opposite sign of tables without it.

Source: Ramamoorthi and Hanrahan 2001; constants as in PlenOctrees (Yu et al. 2021), which has all five
degrees, and 3DGS (Kerbl et al. 2023).
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import numpy.typing as npt

from cagefield.errors import FieldError

MAX_DEGREE: Final = 4
"""Maximum degree: that of .spz files."""
MAX_TERMS: Final = (MAX_DEGREE + 1) ** 2
"""Number of harmonics up to the maximum degree."""
C0: Final = 0.28209479177387814
C1: Final = 0.4886025119029199
C2: Final = (
    1.0925484305920792,
    -1.0925484305920792,
    0.31539156525252005,
    -1.0925484305920792,
    0.5462742152960396,
)
C3: Final = (
    -0.5900435899266435,
    2.890611442640554,
    -0.4570457994644658,
    0.3731763325901154,
    -0.4570457994644658,
    1.445305721320277,
    -0.5900435899266435,
)
C4: Final = (
    2.5033429417967046,
    -1.7701307697799304,
    0.9461746957575601,
    -0.6690465435572892,
    0.10578554691520431,
    -0.6690465435572892,
    0.47308734787878004,
    -1.7701307697799304,
    0.6258357354491761,
)


def sh_basis(viewdirs: npt.ArrayLike, degree: int) -> npt.NDArray[np.floating[Any]]:
    """Values [N,(degree+1)^2] of the harmonics at unit directions `viewdirs` [N,3].

    Oracle of `rendering.voxels.kernels.grid.sh_basis`.

    float32 directions give float32, others float64. Directions are not normalized.

    Raises FieldError for a degree outside 0..MAX_DEGREE or directions of another shape.
    """
    if degree not in range(MAX_DEGREE + 1):
        raise FieldError(f"degree of the spherical harmonics must be 0 to {MAX_DEGREE}, got {degree}")
    d = np.asarray(viewdirs)
    if d.ndim != 2 or d.shape[1] != 3:
        raise FieldError(f"viewdirs must have the shape [N,3], got {list(d.shape)}")
    if d.dtype != np.float32:
        d = d.astype(np.float64)
    x, y, z = d.T
    values = np.empty((len(d), (degree + 1) ** 2), dtype=d.dtype)
    values[:, 0] = C0
    if degree >= 1:
        values[:, 1] = -C1 * y
        values[:, 2] = C1 * z
        values[:, 3] = -C1 * x
    if degree >= 2:
        values[:, 4] = C2[0] * x * y
        values[:, 5] = C2[1] * y * z
        values[:, 6] = C2[2] * (2 * z * z - x * x - y * y)
        values[:, 7] = C2[3] * x * z
        values[:, 8] = C2[4] * (x * x - y * y)
    if degree >= 3:
        values[:, 9] = C3[0] * y * (3 * x * x - y * y)
        values[:, 10] = C3[1] * x * y * z
        values[:, 11] = C3[2] * y * (4 * z * z - x * x - y * y)
        values[:, 12] = C3[3] * z * (2 * z * z - 3 * x * x - 3 * y * y)
        values[:, 13] = C3[4] * x * (4 * z * z - x * x - y * y)
        values[:, 14] = C3[5] * z * (x * x - y * y)
        values[:, 15] = C3[6] * x * (x * x - 3 * y * y)
    if degree >= 4:
        s, t = x * x + y * y, z * z
        values[:, 16] = C4[0] * x * y * (x * x - y * y)
        values[:, 17] = C4[1] * y * z * (3 * x * x - y * y)
        values[:, 18] = C4[2] * x * y * (6 * t - s)
        values[:, 19] = C4[3] * y * z * (4 * t - 3 * s)
        values[:, 20] = C4[4] * (8 * t * t - 24 * t * s + 3 * s * s)
        values[:, 21] = C4[5] * x * z * (4 * t - 3 * s)
        values[:, 22] = C4[6] * (x * x - y * y) * (6 * t - s)
        values[:, 23] = C4[7] * x * z * (x * x - 3 * y * y)
        values[:, 24] = C4[8] * (x * x * (x * x - 3 * y * y) - y * y * (3 * x * x - y * y))
    return values


def scale_sh_colors(
    coefficients: npt.NDArray[np.float32], gains: npt.NDArray[np.floating[Any]]
) -> npt.NDArray[np.float32]:
    """Coefficients [N,K,3] of colors multiplied by gains [N,3], including the constant 0.5 of colors."""
    out = coefficients * gains[:, None].astype(np.float32)
    out[:, 0] += (0.5 / C0 * (gains - 1.0)).astype(np.float32)
    return out
