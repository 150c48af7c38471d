"""Images of any mode as 8-bit sRGB: depth, linear light, color profiles, palettes.

16 bits a channel are divided by 257, floats are linear light and get the sRGB transfer function, clipped at
1; colors with another profile than sRGB are converted by it. Pillow reads 16-bit RGB by its upper bytes.

Source: IEC 61966-2-1 (sRGB).
"""

from __future__ import annotations

import io
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from PIL import Image, ImageCms

from cagefield.typing import UInt8

_MAX_COLOR_DIFFERENCE_LEVELS = (
    2  # levels by which a profile's colors may differ from sRGB's, and be called the same
)
_MAX_PROFILE_BYTES = 4 << 20
_PROFILE_SPACES = {"RGB": "RGB ", "RGBA": "RGB ", "L": "GRAY", "CMYK": "CMYK"}

Convert = Callable[[Image.Image], Image.Image]


def has_alpha(image: Image.Image) -> bool:
    """Whether an image has an alpha channel or a transparent color, which `rgb_converter` keeps."""
    if image.mode in ("I", "F") or image.mode.startswith("I;16"):
        return False
    return image.mode in ("RGBA", "LA", "PA", "RGBa", "La") or "transparency" in image.info


def describe_conversion(image: Image.Image) -> str | None:
    """Loss by reading an image as 8-bit sRGB, in words; None for no loss.

    The image's pixels must not have been loaded yet.
    """
    if image.format == "EXR" or image.mode == "F":
        return "in linear light, converted to 8-bit sRGB and clipped at 1"
    bits = _bits_per_channel(image)
    if bits > 8:
        return f"of {bits} bits a channel, converted to 8"
    profile = _profile_conversion(image)
    if profile is not None:
        return f"with the color profile {profile[1]}, converted to sRGB"
    return None


def rgb_converter(image: Image.Image) -> Convert:
    """Function that converts parts of an image to "RGB", or "RGBA" where `has_alpha`."""
    mode = "RGBA" if has_alpha(image) else "RGB"
    if image.mode == "F":
        return lambda part: Image.fromarray(srgb_bytes(np.asarray(part))).convert(mode)
    if image.mode == "I" or image.mode.startswith("I;16"):
        return lambda part: _from_16_bits(part).convert(mode)
    conversion = _profile_conversion(image)
    if conversion is None:
        return lambda part: part.convert(mode)
    transform, source = conversion[0], _profiled_mode(image)

    def convert(part: Image.Image) -> Image.Image:
        converted = ImageCms.applyTransform(part.convert(source), transform)
        assert converted is not None  # it is not done in place
        return converted

    return convert


def srgb_bytes(linear: ArrayLike) -> UInt8:
    """8-bit sRGB of linear light, where 1 is white; NaN and negative values are black."""
    light = np.asarray(linear, np.float32)
    light = np.minimum(np.where(light > 0, light, np.float32(0)), np.float32(1))
    encoded = np.where(
        light <= 0.0031308, 12.92 * light, 1.055 * np.power(light, np.float32(1 / 2.4)) - np.float32(0.055)
    )
    return np.rint(255 * encoded).astype(np.uint8)


def _from_16_bits(part: Image.Image) -> Image.Image:
    values = np.clip(np.asarray(part).astype(np.int64), 0, 65535)
    return Image.fromarray((values / 257.0 + 0.5).astype(np.uint8))


def _bits_per_channel(image: Image.Image) -> int:
    """Bits a channel in the file, as far as they are known; else 8."""
    if image.mode == "I" or image.mode.startswith("I;16"):
        return 16
    depth = image.info.get("bit_depth")
    if isinstance(depth, int):
        return depth
    tiles: list[Any] = list(getattr(image, "tile", ()))
    arguments = tiles[0][3] if tiles else None
    raw = arguments[0] if isinstance(arguments, tuple) and arguments else arguments
    return 16 if isinstance(raw, str) and ";16" in raw else 8


def _profiled_mode(image: Image.Image) -> str:
    """Mode in which an image's color profile is applied."""
    if image.mode == "CMYK":
        return "CMYK"
    if image.mode == "L" and not has_alpha(image):
        return "L"
    return "RGBA" if has_alpha(image) else "RGB"


def _profile_conversion(image: Image.Image) -> tuple[ImageCms.ImageCmsTransform, str] | None:
    """(conversion of an image's colors to sRGB, name of its profile); None where they are sRGB.

    Profiles that cannot be read, or of another kind of color than the image's, are ignored.
    """
    content = image.info.get("icc_profile")
    if image.mode == "F" or not isinstance(content, bytes) or not 0 < len(content) <= _MAX_PROFILE_BYTES:
        return None
    return _transform(content, _profiled_mode(image))


@lru_cache(maxsize=8)
def _transform(content: bytes, mode: str) -> tuple[ImageCms.ImageCmsTransform, str] | None:
    try:
        profile = ImageCms.ImageCmsProfile(io.BytesIO(content))
        if profile.profile.xcolor_space != _PROFILE_SPACES[mode]:
            return None
        transform = ImageCms.buildTransform(
            profile,
            ImageCms.createProfile("sRGB"),
            mode,
            "RGBA" if mode == "RGBA" else "RGB",
            ImageCms.Intent.RELATIVE_COLORIMETRIC,
            ImageCms.Flags.NOCACHE | ImageCms.Flags.BLACKPOINTCOMPENSATION,
        )
        name = " ".join((profile.profile.profile_description or "without a name").split())[:60]
        probe = _probe(mode)
        converted = ImageCms.applyTransform(probe, transform)
    except (ImageCms.PyCMSError, OSError, ValueError, TypeError):
        return None
    if converted is None:
        return None
    difference = np.asarray(converted.convert("RGB"), int) - np.asarray(probe.convert("RGB"), int)
    return None if np.abs(difference).max() <= _MAX_COLOR_DIFFERENCE_LEVELS else (transform, name)


def _probe(mode: str) -> Image.Image:
    """Image of colors from all over the cube; of grays in mode "L"."""
    levels = np.arange(0, 256, 51, dtype=np.uint8)
    if mode == "L":
        return Image.fromarray(levels[None])
    cube = np.stack(np.meshgrid(levels, levels, levels, indexing="ij"), axis=-1).reshape(1, -1, 3)
    return Image.fromarray(cube).convert(mode)
