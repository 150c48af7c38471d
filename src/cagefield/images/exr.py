"""OpenEXR images as 8-bit sRGB: linear light, clipped at 1, with straight alpha.

Channels R, G, B [, A], or Y [, A], of the first part that has them; colors are premultiplied by alpha in the
file (OpenEXR, "Technical Introduction"). Pixels of the data window lie in the display window.
"""

from __future__ import annotations

import contextlib
import ctypes
import io
import os
import threading
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageFile

from cagefield.errors import DatasetError
from cagefield.images.color_conversion import srgb_bytes
from cagefield.typing import UInt8

_MAX_CHANNEL_SAMPLES = 400 << 20  # of all the channels of all the parts, which are decoded at once
_MAX_COORDINATE_PIXELS = 1 << 24

_OUTPUT_LOCK = threading.Lock()

Window = tuple[int, int, int, int]


class ExrImage(ImageFile.ImageFile):
    """OpenEXR file whose pixels are decoded on demand."""

    format = "EXR"
    format_description = "OpenEXR"

    def _open(self) -> None:
        self._path = Path(str(self.filename))
        header, self._part, self._names = _select_part(_read(self._path, header_only=True), self._path)
        left, top, right, bottom = _window(header, "displayWindow")
        self._size = (right - left, bottom - top)
        self._mode = "RGBA" if "A" in self._names else "RGB"

    def load(self) -> Any:
        """Decode the pixels once. Raises ValueError where they differ from the header."""
        if self._im is None:
            file = _read(self._path, header_only=False)
            part = file.parts[self._part]
            self.im = Image.fromarray(_pixels(part, self._names, self.size)).im
        return Image.Image.load(self)


def _read(path: Path, header_only: bool) -> Any:
    try:
        import OpenEXR
    except ImportError:
        raise DatasetError(
            f"{path}: EXR photos need OpenEXR; pip install 'cagefield[exr]', or convert them to 16-bit PNG"
        ) from None
    try:
        with _OUTPUT_LOCK, _discard_output():
            return OpenEXR.File(str(path), separate_channels=True, header_only=header_only, num_threads=1)
    except Exception as error:  # whatever C++ threw
        raise ValueError(f"OpenEXR: {' '.join(str(error).split())[:160]}") from None


@contextlib.contextmanager
def _discard_output() -> Iterator[None]:
    """Discard OpenEXR's messages about damaged files, on Python's output and, from C++, the process's."""
    saved = [os.dup(number) for number in (1, 2)]
    try:
        with open(os.devnull, "wb") as nowhere:
            for number in (1, 2):
                os.dup2(nowhere.fileno(), number)
            with contextlib.redirect_stdout(io.StringIO()):
                yield
    finally:
        with contextlib.suppress(OSError, AttributeError):
            ctypes.CDLL(None).fflush(None)
        for number, copy in zip((1, 2), saved, strict=True):
            os.dup2(copy, number)
            os.close(copy)


def _select_part(file: Any, path: Path) -> tuple[Mapping[str, Any], int, dict[str, str]]:
    """(header, index, channel names by R, G, B, A, or Y, A) of the first part with colors."""
    samples = 0
    chosen: tuple[Mapping[str, Any], int, dict[str, str]] | None = None
    other_names: list[str] = []
    for index, part in enumerate(file.parts):
        header = part.header
        left, top, right, bottom = _window(header, "dataWindow")
        names = [str(channel.name) for channel in header.get("channels", ())]
        samples += len(names) * (right - left) * (bottom - top)
        color_channels = _color_channels(names)
        if color_channels and chosen is None:
            chosen = header, index, color_channels
        other_names += names
    if samples > _MAX_CHANNEL_SAMPLES:
        raise ValueError(
            f"{samples} samples in all channels, at most {_MAX_CHANNEL_SAMPLES} are read; shrink it"
        )
    if chosen is None:
        raise ValueError(f"no channels R, G, B or Y, only {', '.join(other_names)[:120] or 'none'}")
    return chosen


def _color_channels(names: list[str]) -> dict[str, str]:
    """Channel names of the layer without a name; else of the first layer that has colors; else none."""
    layers = sorted({name.rpartition(".")[0] for name in names}, key=lambda layer: (layer != "", layer))
    for layer in layers:
        prefix = f"{layer}." if layer else ""
        for colors in ("RGB", "Y"):
            if all(prefix + color in names for color in colors):
                if colors == "Y" and prefix + "RY" in names:
                    continue  # chroma at half the size
                alpha = "A" if prefix + "A" in names else ""
                return {color: prefix + color for color in colors + alpha}
    return {}


def _window(header: Mapping[str, Any], key: str) -> Window:
    """(left, top, right, bottom) of a window, the last two exclusive. Raises ValueError for an empty
    window.
    """
    (left, top), (right, bottom) = ((int(side) for side in corner) for corner in header[key])
    if max(map(abs, (left, top, right, bottom))) > _MAX_COORDINATE_PIXELS or right < left or bottom < top:
        raise ValueError(f"its {key} is ({left}, {top}) to ({right}, {bottom}); it is damaged")
    return left, top, right + 1, bottom + 1


def _pixels(part: Any, names: Mapping[str, str], size: tuple[int, int]) -> UInt8:
    """Pixels uint8 [H,W,3|4] of the display window; black, or transparent, outside the data window."""
    window = _window(part.header, "displayWindow")
    data = _window(part.header, "dataWindow")
    width, height = size
    if any(name not in part.channels for name in names.values()):
        raise ValueError("its pixels cannot be decoded; it is damaged or cut off")  # OpenEXR goes on without
    channels = {key: np.asarray(part.channels[name].pixels, np.float32) for key, name in names.items()}
    shape = (data[3] - data[1], data[2] - data[0])
    if any(values.shape != shape for values in channels.values()):
        raise ValueError("its channels have different sizes; it is damaged, or its colors are subsampled")
    alpha = channels.pop("A", None)
    pixels = np.zeros((height, width, 3 if alpha is None else 4), np.uint8)
    left, top = max(data[0], window[0]), max(data[1], window[1])
    right, bottom = min(data[2], window[2]), min(data[3], window[3])
    if right <= left or bottom <= top:
        return pixels
    source = np.s_[top - data[1] : bottom - data[1], left - data[0] : right - data[0]]
    target = pixels[top - window[1] : bottom - window[1], left - window[0] : right - window[0]]
    share = None if alpha is None else alpha[source]
    for index, key in enumerate("RGB" if "R" in channels else "YYY"):
        values = channels[key][source]
        if share is not None:
            values = np.divide(values, share, out=np.zeros_like(values), where=share > 0)
        target[..., index] = srgb_bytes(values)
    if share is not None:
        target[..., 3] = np.rint(255 * np.clip(np.where(share > 0, share, 0), 0, 1)).astype(np.uint8)
    return pixels
