"""Rendered frames as bytes: pictures of a view, and depths in 16 bits."""

from __future__ import annotations

import io
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from cagefield.images.render_result import RenderResult, to_uint8
from cagefield.server.protocol.common import View

NOTHING = 65535
"""Depth value where the picture shows nothing."""

MAX_PLAIN_PIXELS = 16_384
"""Pixels of a picture that is sent as it is, at most."""

Format = Literal["jpeg", "rgb"]

BEHIND = (0.13, 0.13, 0.15)
"""Color behind a scene that has none."""


def picture_of(frame: RenderResult, view: View, reach: tuple[float, float]) -> NDArray[np.uint8]:
    """RGB pixels [H,W,3] of a view; `reach` (near, far) are the distances shown bright and dark."""
    if view == "color":
        return frame.rgb8() if frame.background is not None else frame.over(BEHIND).rgb8()
    opacity = frame.opacity[..., None]
    if view == "opacity":
        return to_uint8(np.repeat(opacity, 3, axis=-1))
    if view == "normals":
        normals = np.zeros_like(frame.rgb) if frame.normals is None else frame.normals
        return to_uint8((0.5 * normals + 0.5) * opacity)
    near, far = reach
    depth = np.where(np.isfinite(frame.depth), frame.depth, far)
    bright = 1.0 - 0.85 * np.clip((depth - near) / max(far - near, 1e-9), 0.0, 1.0)
    return to_uint8(np.repeat(bright[..., None] * opacity, 3, axis=-1))


def plain_or_jpeg(pixels: NDArray[np.uint8], quality: int) -> tuple[bytes, Format]:
    """A picture's bytes and their format: to decode small ones would take a page longer than to read them."""
    if pixels.shape[0] * pixels.shape[1] <= MAX_PLAIN_PIXELS:
        return pixels.tobytes(), "rgb"
    return jpeg(pixels, quality), "jpeg"


def jpeg(pixels: NDArray[np.uint8], quality: int) -> bytes:
    """A JPEG; at qualities of 90 and more the colors have full resolution too."""
    stream = io.BytesIO()
    Image.fromarray(pixels).save(
        stream, format="JPEG", quality=quality, subsampling=0 if quality >= 90 else 2
    )
    return stream.getvalue()


def png(pixels: NDArray[np.uint8]) -> bytes:
    """A PNG."""
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, format="PNG", compress_level=3)
    return stream.getvalue()


def depths(frame: RenderResult, scale: float, stride: int) -> NDArray[np.uint16]:
    """Depths [h,w] in units of `scale`, every `stride`-th pixel; NOTHING where it is half empty."""
    d, opacity = frame.depth[::stride, ::stride], frame.opacity[::stride, ::stride]
    seen = (opacity > 0.5) & np.isfinite(d)
    values = np.clip(np.where(seen, d, 0.0) / scale, 0.0, NOTHING - 1)
    return np.where(seen, values, NOTHING).astype("<u2")
