"""Arrays on the compute device: copies of numpy arrays, and memory that an owner reuses."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.compute import devices
from cagefield.compute.quadrants import qd

_TYPES = {np.dtype(np.float32): qd.f32, np.dtype(np.int32): qd.i32, np.dtype(np.uint8): qd.u8}

MAX_KEPT_BYTES = 4 << 30
"""Bytes of constant arrays that one owner keeps on the device."""


class DeviceBuffers:
    """Flat device arrays by name; contents are valid until the same name is taken again."""

    def __init__(self) -> None:
        self._arrays: dict[str, tuple[Any, int, Any]] = {}
        self._kept: dict[tuple[int, tuple[int, ...]], tuple[NDArray[Any], Any]] = {}
        self._kept_bytes = 0

    def take(self, name: str, size: int, dtype: Any = np.float32) -> Any:
        """Uninitialized array of at least `size` values, float32, int32 or uint8.

        The memory stays the same as long as it is large enough; otherwise it grows by a quarter more than
        needed.
        """
        found = self._arrays.get(name)
        if found is None or found[1] < size or found[2] != dtype:
            room = max(1, size if found is None else size + size // 4)
            self._arrays.pop(name, None)
            found = self._arrays[name] = (empty_array(room, dtype), room, dtype)
        return found[0]

    def upload_once(self, name: str, values: NDArray[Any]) -> Any:
        """Array of values that never change: uploaded once, up to MAX_KEPT_BYTES, else by `upload`."""
        key = (values.__array_interface__["data"][0], values.shape)
        if key not in self._kept:
            if self._kept_bytes + values.nbytes > MAX_KEPT_BYTES or not values.size:
                return self.upload(name, values)
            flat = np.ascontiguousarray(values).reshape(-1)
            array = empty_array(flat.size, flat.dtype)
            array.from_numpy(flat)
            # The host's array is kept too, so that no other takes its address.
            self._kept[key] = (values, array)
            self._kept_bytes += values.nbytes
        return self._kept[key][1]

    def upload(self, name: str, values: NDArray[Any]) -> Any:
        """Array of exactly the values, flattened; new memory where their number changes."""
        flat = np.ascontiguousarray(values).reshape(-1)
        if flat.size == 0:
            flat = np.zeros(1, flat.dtype)
        array = self.exact(name, flat.size, flat.dtype)
        array.from_numpy(flat)
        return array

    def exact(self, name: str, size: int, dtype: Any = np.float32) -> Any:
        """Uninitialized array of exactly `size` values, for whole uploads and downloads."""
        found = self._arrays.get(name)
        if found is None or found[1] != size or found[2] != dtype:
            self._arrays.pop(name, None)
            found = self._arrays[name] = (empty_array(size, dtype), size, dtype)
        return found[0]


def empty_array(size: int, dtype: Any = np.float32) -> Any:
    """Uninitialized flat array on the device, of at least one value."""
    return qd.ndarray(dtype=_TYPES[np.dtype(dtype)], shape=(max(1, size),))


def to_device(values: NDArray[Any]) -> Any:
    """Flat array on the device with the values of a numpy array (float32, int32 or uint8)."""
    flat = np.ascontiguousarray(values).reshape(-1)
    if flat.size == 0:
        flat = np.zeros(1, flat.dtype)
    array = empty_array(flat.size, flat.dtype)
    array.from_numpy(flat)
    return array


def for_kernels(values: NDArray[Any]) -> Any:
    """A flat array to hand to kernels: the numpy array itself on the CPU, else one on the device."""
    if devices.current() != "cpu" or values.size == 0:
        return to_device(values)
    return np.ascontiguousarray(values).reshape(-1)


def rows_for_kernels(values: NDArray[np.float32]) -> Any:
    """A matrix [N,K] to hand to kernels: the numpy array itself on the CPU, else one on the device."""
    if devices.current() == "cpu":
        return values
    array = qd.ndarray(dtype=qd.f32, shape=values.shape)
    array.from_numpy(np.ascontiguousarray(values))
    return array


def vectors_for_kernels(values: NDArray[np.float32]) -> Any:
    """Vectors [N,3] to hand to kernels: the numpy array itself on the CPU, else one on the device."""
    if devices.current() == "cpu":
        return values
    array = qd.Vector.ndarray(3, qd.f32, (len(values),))
    array.from_numpy(np.ascontiguousarray(values))
    return array
