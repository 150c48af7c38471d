"""Images on the compute device, as RenderResults that are downloaded when and as far as they are read.

A renderer's sums over the samples of each pixel become an 8-bit image, or opacity and depth, on the device:
at 1920x1080, 6 or 16 MB cross the bus in place of 41 to 66, and nothing is left to the host.
"""

from __future__ import annotations

import weakref
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.compute.device_buffers import empty_array
from cagefield.compute.devices import floats
from cagefield.images.render_result import Background, RenderResult, background_rgb
from cagefield.rendering.kernels.device_image import MIN_OPACITY, SumArgs, write_planes, write_rgb, write_rgb8
from cagefield.typing import Float32


@dataclass(frozen=True, eq=False)
class DeviceSums:
    """Sums of an image on the device, as `SumArgs`; `values` belong to this object."""

    values: Any
    width: int
    height: int
    channels: int
    tile_px: int = 0

    def args(self) -> SumArgs:
        """Kernel arguments."""
        return SumArgs(self.values, self.width, self.height, self.channels, self.tile_px)


@dataclass(eq=False)
class SumBuffers:
    """Memory for the sums of images, free for the next image once nobody reads the last one."""

    size: int = 0
    free: list[Any] = field(default_factory=list)

    def take(self, size: int) -> Any:
        """Uninitialized array of `size` float32."""
        if size != self.size:
            self.size, self.free = size, []
        return self.free.pop() if self.free else empty_array(size)

    def lend(self, sums: DeviceSums) -> None:
        """Take the values of `sums` back when it is collected."""
        weakref.finalize(sums, _return, self.free, sums.values).atexit = False


def _return(free: list[Any], values: Any) -> None:
    free.append(values)


class DeviceRenderResult(RenderResult):
    """A RenderResult without normals whose arrays are downloaded when they are read."""

    _sums: DeviceSums

    @classmethod
    def of_sums(cls, sums: DeviceSums, background: Background) -> DeviceRenderResult:
        """Result of an image's sums over a background."""
        result = object.__new__(cls)
        object.__setattr__(result, "_sums", sums)
        object.__setattr__(result, "background", background_rgb(background))
        return result

    def __getattr__(self, name: str) -> Any:
        """Array of that name, downloaded."""
        sums = self.__dict__.get("_sums")
        if sums is None or name not in ("rgb", "opacity", "depth"):
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        size = sums.width * sums.height
        if name == "rgb":
            out = empty_array(3 * size)
            write_rgb(sums.args(), *self._behind(), out)
            self._keep("rgb", _host(out).reshape(sums.height, sums.width, 3))
        else:
            out = empty_array(2 * size)
            write_planes(sums.args(), out)
            opacity, depth = _host(out).reshape(2, sums.height, sums.width)
            depth[opacity <= MIN_OPACITY] = np.inf
            self._keep("opacity", opacity)
            self._keep("depth", depth)
        return self.__dict__[name]

    def _keep(self, name: str, values: Float32) -> None:
        values.flags.writeable = False
        object.__setattr__(self, name, values)

    def _behind(self) -> tuple[NDArray[np.float64], int]:
        return floats(self.background or (0.0, 0.0, 0.0)), int(self.background is not None)

    @property
    def width(self) -> int:
        """See `RenderResult`; downloads nothing."""
        return self._sums.width if "_sums" in self.__dict__ else super().width

    @property
    def height(self) -> int:
        """See `RenderResult`; downloads nothing."""
        return self._sums.height if "_sums" in self.__dict__ else super().height

    def over(self, background: Background) -> RenderResult:
        """See `RenderResult.over`."""
        if "_sums" not in self.__dict__:
            return super().over(background)
        return DeviceRenderResult.of_sums(self._sums, background)

    def rgb8(self) -> NDArray[np.uint8]:
        """See `RenderResult.rgb8`."""
        if "_sums" not in self.__dict__:
            return super().rgb8()
        out = empty_array(3 * self.width * self.height, np.uint8)
        write_rgb8(self._sums.args(), *self._behind(), out)
        return np.asarray(out.to_numpy()).reshape(self.height, self.width, 3)


def _host(array: Any) -> Float32:
    return np.asarray(array.to_numpy())
