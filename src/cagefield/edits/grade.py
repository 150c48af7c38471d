"""Color grade of an edit: exposure, white balance, hue, saturation and opacity of the content of its cage.

Space. Colors of a field are display-encoded (sRGB), as in its photos, and so are graded colors. Gains are
set in linear light: with the power law L = c^GAMMA of a display, a gain g of linear light is the gain
g^(1/GAMMA) of encoded colors, exactly. Hue and saturation act on encoded colors, as the saturation of an ASC
CDL does. The whole grade is one matrix,

    c' = M c,  M = S H diag(g)^(1/GAMMA),

- g = 2^exposure b / (luminance of b): exposure in stops, and the white balance b as a von Kries scaling of
  the display's primaries. b = (2^(T/2 + t/4), 2^(-t/2), 2^(-T/2 + t/4)), T the temperature: stops between
  red and blue, above 0 warmer; t the tint: above 0 magenta, 3/4 t stops between both of them and green.
- H the rotation by an angle about the gray axis (1, 1, 1); red goes towards green.
- S = s I + (1 - s) 1 w^T, s the saturation, w the weights of Rec. 709's luma.

M keeps the linear form of spherical harmonics: with c = 1/2 + sum_k Y_k(d) c_k, the graded color has the
coefficients M c_k, and the constant (M - I) 1/2 added to band 0. Graded colors are clamped to [0, 1] last.

Opacity. Density is multiplied by a factor f; a splat of opacity a gets 1 - (1 - a)^f, so its optical depth
is multiplied too.

Falloff. A point is graded by its weight w in [0, 1] at its place in canonical space of the edit: color by
I + w (M - I), density by 1 + w (f - 1). So a grade goes along with the content that the edit moves. w is 1
where a discrete edit shows the content of its cage, and `GradeFalloff` of a continuous one.

Sources: ASC CDL (Pines and Reisner 2004: SOP, saturation with Rec. 709 weights); ITU-R BT.709-6, 3.2; von
Kries (1902), diagonal adaptation; Haeberli, "Matrix Operations for Image Processing" (1993), hue about the
gray axis.
"""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass, fields
from functools import cached_property
from typing import Final

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from cagefield.errors import EditError
from cagefield.fields.sh import C0
from cagefield.typing import Array

GAMMA: Final = 2.2
"""Exponent of a display: linear light L = c^GAMMA of an encoded color c."""

LUMA: Final = (0.2126, 0.7152, 0.0722)
"""Weights of Rec. 709 for red, green and blue."""

RANGES: Final[dict[str, tuple[float, float]]] = {
    "exposure": (-10.0, 10.0),
    "temperature": (-4.0, 4.0),
    "tint": (-4.0, 4.0),
    "saturation": (0.0, 4.0),
    "hue_deg": (-360.0, 360.0),
    "opacity": (0.0, 100.0),
}
"""Lowest and highest value of each field of a `Grade`."""


@dataclass(frozen=True)
class Grade:
    """Change of color and opacity of the content of an edit's cage.

    Parameters
    - exposure: stops of linear light, -10 to 10.
    - temperature: stops between red and blue, -4 (colder) to 4 (warmer).
    - tint: magenta above 0, green below, -4 to 4.
    - saturation: factor of the distance from gray, 0 (gray) to 4.
    - hue_deg: rotation of hue in degrees, -360 to 360; from red towards green.
    - opacity: factor of density, and of a splat's optical depth, 0 (invisible) to 100.

    Raises `EditError` for a value out of its range.
    """

    exposure: float = 0.0
    temperature: float = 0.0
    tint: float = 0.0
    saturation: float = 1.0
    hue_deg: float = 0.0
    opacity: float = 1.0

    def __post_init__(self) -> None:
        for name, (low, high) in RANGES.items():
            value = getattr(self, name)
            is_number = isinstance(value, int | float) and not isinstance(value, bool)
            if not (is_number and low <= value <= high):
                raise EditError(f"{name} of a grade must be {low:g} to {high:g}, got {value!r:.40}")
            object.__setattr__(self, name, float(value))

    @classmethod
    def from_gains(cls, gains: npt.ArrayLike) -> Grade:
        """Grade whose matrix is diag(gains [3]), gains of display-encoded red, green and blue.

        Raises `EditError` for gains that are not above 0, or out of a grade's range.
        """
        encoded = np.asarray(gains, np.float64)
        if encoded.shape != (3,) or not (np.isfinite(encoded) & (encoded > 0.0)).all():
            raise EditError(f"gains must be three numbers above 0, got {gains!r:.60}")
        linear = encoded**GAMMA
        red, green, blue = np.log2(linear).tolist()
        return cls(
            exposure=math.log2(float(linear @ LUMA)),
            temperature=red - blue,
            tint=(red + blue - 2.0 * green) / 1.5,
        )

    @property
    def is_neutral(self) -> bool:
        """True where the grade changes nothing."""
        return self == NEUTRAL_GRADE

    def part(self, share: float) -> Grade:
        """Grade on the way from the neutral one (share 0) to this one (share 1): each value linearly."""
        if share >= 1.0:
            return self
        pairs = zip(astuple(NEUTRAL_GRADE), astuple(self), strict=True)
        return Grade(*(start + share * (end - start) for start, end in pairs))

    @cached_property
    def matrix(self) -> Array:
        """M [3,3], float64: a graded color is M c, with c display-encoded rgb."""
        T, t = self.temperature, self.tint
        balance = np.exp2([T / 2 + t / 4, -t / 2, t / 4 - T / 2])
        gains = (2.0**self.exposure * balance / (balance @ LUMA)) ** (1.0 / GAMMA)
        turn = np.eye(3)
        if self.hue_deg:
            turn = Rotation.from_rotvec(np.full(3, math.radians(self.hue_deg) / math.sqrt(3.0))).as_matrix()
        saturate = self.saturation * np.eye(3) + (1.0 - self.saturation) * np.ones((3, 1)) * np.array(LUMA)
        return np.asarray(saturate @ turn * gains)

    def matrices(self, weights: npt.ArrayLike) -> Array:
        """Matrices [N,3,3] of the grade at weights [N] in [0, 1]."""
        w = np.asarray(weights, np.float64)[:, None, None]
        return np.asarray(np.eye(3) + w * (self.matrix - np.eye(3)))

    def density_factors(self, weights: npt.ArrayLike) -> Array:
        """Factors [N] of density at weights [N] in [0, 1]."""
        return np.asarray(1.0 + np.asarray(weights, np.float64) * (self.opacity - 1.0))


NEUTRAL_GRADE: Final = Grade()
"""The grade that changes nothing."""

GRADE_FIELDS: Final = tuple(field.name for field in fields(Grade))


def grade_colors(colors: npt.NDArray[np.floating], matrices: Array) -> npt.NDArray[np.floating]:
    """Graded colors [N,3], clamped to [0, 1], of display-encoded colors [N,3] by matrices [N,3,3]."""
    graded = np.einsum("nij,nj->ni", matrices, colors)
    return np.clip(graded, 0.0, 1.0).astype(colors.dtype)


def grade_sh(coefficients: npt.NDArray[np.float32], matrices: Array) -> npt.NDArray[np.float32]:
    """Harmonics [N,K,3] of colors multiplied by matrices [N,3,3], the constant 0.5 of colors included."""
    out = np.einsum("nij,nkj->nki", matrices, coefficients).astype(np.float32)
    out[:, 0] += (0.5 / C0 * (matrices.sum(axis=2) - 1.0)).astype(np.float32)
    return out


def thinned_opacities(opacities: npt.NDArray[np.floating], factors: Array) -> Array:
    """Opacities [N] of splats whose optical depth is multiplied by factors [N]: 1 - (1 - a)^f."""
    return np.asarray(1.0 - (1.0 - opacities.astype(np.float64)) ** factors)
