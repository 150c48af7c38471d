"""The compute device: one Quadrants runtime per process, started on first use.

Quadrants is imported here and in the kernel modules only, never by ``import cagefield``.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import os
import shutil
import time
import warnings
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cagefield.errors import DeviceError

DeviceName = Literal["auto", "cpu", "cuda", "metal", "vulkan"]

KEPT_SECONDS = 30 * 86400.0
"""How long kernels of other versions of the package are kept after they were last used."""

LOCKED_SECONDS = 60.0
"""How long a process may hold the lock of a folder of kernels: it writes a few megabytes."""

_started: str | None = None


def start(device: str = "auto", *, double: bool = False) -> str:
    """The name of the running device: "cpu", "cuda", "metal" or "vulkan".

    The first call starts the runtime; later calls with "auto" or the same name return it. "auto" takes
    CUDA or Metal where there is one, else the CPU. With `double`, numbers that kernels give no type are
    float64: for references, not for the renderer; the first call decides.

    Raises:
        DeviceError: an unknown name, a device this machine lacks, or a second, different device.
    """
    global _started
    if device not in get_args(DeviceName):
        raise DeviceError(f"device {device!r} is unknown; choose one of {', '.join(get_args(DeviceName))}")
    if _started is not None:
        if device not in ("auto", _started):
            raise DeviceError(
                f"device {device!r} cannot be started: this process already runs on {_started!r}; "
                "start a new process for another device"
            )
        return _started
    os.environ.setdefault("ENABLE_QUADRANTS_HEADER_PRINT", "0")
    import quadrants as qd

    qd.set_logging_level("error")
    # Kernels name constants, which `kernel_cache` sees to.
    warnings.filterwarnings("ignore", message=r"\[PURE.VIOLATION\]")
    archs: dict[str, Any] = {"cpu": qd.cpu, "cuda": qd.cuda, "metal": qd.metal, "vulkan": qd.vulkan}
    if device == "auto":
        chosen = next((name for name in ("cuda", "metal") if _supported(archs[name])), "cpu")
    elif device == "cpu" or _supported(archs[device]):
        chosen = device
    else:
        raise DeviceError(f'device {device!r} is not available on this machine; use device="cpu" or "auto"')
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
                log_level="error",
                enable_fallback=False,
            )
    except Exception as error:
        raise DeviceError(f'device {chosen!r} did not start ({error}); use device="cpu"') from error
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


def kernel_cache() -> Path | None:
    """The folder of the compiled kernels of this state of the package's source; None where none can be made.

    Quadrants finds a kernel again by the source of its functions, without the constants that they name: two
    states of the packages that hold kernels must not share a folder. Folders that nobody used for long are
    removed.
    """
    try:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "cagefield" / "kernels"
        folder = base / _source_digest()
        folder.mkdir(parents=True, exist_ok=True)
        os.utime(folder)
    except (OSError, RuntimeError):
        return None
    _tidy(folder)
    return folder


def _tidy(folder: Path) -> None:
    """Removes what nobody needs beside a folder of kernels, and the lock of a process that died with it."""
    with contextlib.suppress(OSError):
        for other in list(folder.parent.iterdir()):
            with contextlib.suppress(OSError):
                if time.time() - other.stat().st_mtime > KEPT_SECONDS:
                    shutil.rmtree(other, ignore_errors=True)
    lock = folder / "kernel_compilation_manager" / "qdcache.lock"
    with contextlib.suppress(OSError):
        if time.time() - lock.stat().st_mtime > LOCKED_SECONDS:
            lock.unlink()


def _source_digest() -> str:
    """A digest of the source in all folders that hold kernels."""
    sources = {path: path.read_bytes() for path in sorted(Path(__file__).parent.rglob("*.py"))}
    folders = {path.parent for path, source in sources.items() if b"import quadrants" in source}
    digest = hashlib.sha256()
    for path, source in sources.items():
        if path.parent in folders:
            digest.update(source)
    return digest.hexdigest()[:16]


def parts() -> int:
    """Number of parts that kernels' loops are cut into: more than threads can run at once, so that none of
    them waits long for one whose core other programs use."""
    return min(3 * threads(), threads() + 32)


def _supported(arch: Any) -> bool:
    from quadrants.lang.misc import is_arch_supported

    return bool(is_arch_supported(arch))
