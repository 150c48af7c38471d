"""The compute device: one Quadrants runtime per process, started on first use.

Quadrants is imported here and in the kernel modules only, never by ``import cagefield``.
"""

from __future__ import annotations

import contextlib
import io
import os
import warnings
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cagefield.compute.kernel_cache import kernel_cache, tolerate_cache_failures
from cagefield.errors import DeviceError

DeviceName = Literal["auto", "cpu", "cuda", "metal", "vulkan"]

_started: str | None = None


def start(device: str = "auto", *, double: bool = False) -> str:
    """The name of the running device: "cpu", "cuda", "metal" or "vulkan".

    The first call starts the runtime; later calls with "auto" or the same name return it. "auto" takes the
    device named by the environment variable CAGEFIELD_DEVICE, else CUDA or Metal where there is one, else
    the CPU. With
    `double`, numbers that kernels give no type are float64: for references, not for the renderer; the first
    call decides.

    Raises:
        DeviceError: an unknown name, a device this machine lacks, or a second, different device.
    """
    global _started
    where = ""
    if device == "auto" and _started is None and os.environ.get("CAGEFIELD_DEVICE"):
        device, where = os.environ["CAGEFIELD_DEVICE"], " of CAGEFIELD_DEVICE"
    if device not in get_args(DeviceName):
        choices = ", ".join(get_args(DeviceName))
        raise DeviceError(f"device {device!r}{where} is unknown; choose one of {choices}")
    if _started is not None:
        if device not in ("auto", _started):
            raise DeviceError(
                f"device {device!r} cannot be started: this process already runs on {_started!r}; "
                "start a new process for another device"
            )
        return _started
    from cagefield.compute.quadrants import qd

    qd.set_logging_level("error")
    # Kernels name constants, which `kernel_cache` sees to.
    warnings.filterwarnings("ignore", message=r"\[PURE.VIOLATION\]")
    archs: dict[str, Any] = {"cpu": qd.cpu, "cuda": qd.cuda, "metal": qd.metal, "vulkan": qd.vulkan}
    if device == "auto":
        chosen = next((name for name in ("cuda", "metal") if _supported(archs[name])), "cpu")
    elif device == "cpu" or _supported(archs[device]):
        chosen = device
    else:
        cure = "unset it" if where else 'use device="cpu" or "auto"'
        raise DeviceError(f"device {device!r}{where} is not available on this machine; {cure}")
    cache = kernel_cache()
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            # Without that pass kernels compile three to nine times faster and run as fast.
            qd.init(
                arch=archs[chosen],
                default_fp=qd.f64 if double else qd.f32,
                offline_cache=cache is not None,
                src_ll_cache=cache is not None,
                cpu_max_num_threads=parts(),
                offline_cache_file_path=str(cache or ""),
                cfg_optimization=False,
                advanced_optimization=False,
                log_level="error",
                enable_fallback=False,
            )
    except Exception as error:
        raise DeviceError(f'device {chosen!r} did not start ({error}); use device="cpu"') from error
    if cache is not None:
        tolerate_cache_failures(cache)
    _started = chosen
    return chosen


def current() -> str | None:
    """The name of the running device, or None before `start`."""
    return _started


def is_gpu() -> bool:
    """True where kernels run on a GPU; starts the default device if none runs yet."""
    return start() != "cpu"


def threads() -> int:
    """Number of threads that the CPU runs at once."""
    try:
        return max(1, len(os.sched_getaffinity(0)))
    except AttributeError:
        return max(1, os.cpu_count() or 1)


def floats(values: ArrayLike) -> NDArray[np.float64]:
    """A vector or matrix as an argument of a kernel.

    Arrays, for Quadrants' own vectors keep a kernel from being loaded from the disk without its source being
    read again, which takes seconds.
    """
    return np.asarray(values, dtype=np.float64)


def ints(values: ArrayLike) -> NDArray[np.int32]:
    """A vector of integers as an argument of a kernel; see `floats`."""
    return np.asarray(values, dtype=np.int32)


def parts() -> int:
    """Number of parts that kernels' loops are cut into: more than threads can run at once, so that none of
    them waits long for one whose core other programs use."""
    return min(3 * threads(), threads() + 32)


def _supported(arch: Any) -> bool:
    from quadrants.lang.misc import is_arch_supported

    return bool(is_arch_supported(arch))
