"""Conversion between linear light and sRGB-encoded values."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def decode_srgb(rgb: NDArray[np.floating]) -> NDArray[np.floating]:
    """Linear light of sRGB-encoded values >= 0. Source: IEC 61966-2-1."""
    return np.where(rgb <= 0.04045, rgb / 12.92, ((np.maximum(rgb, 0.04045) + 0.055) / 1.055) ** 2.4)


def encode_srgb(light: NDArray[np.floating]) -> NDArray[np.floating]:
    """sRGB-encoded values of linear light >= 0. Source: IEC 61966-2-1."""
    return np.where(
        light <= 0.0031308, 12.92 * light, 1.055 * np.maximum(light, 0.0031308) ** (1 / 2.4) - 0.055
    )
