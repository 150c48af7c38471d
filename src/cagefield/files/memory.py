"""Available memory of the machine or container, in bytes."""

from __future__ import annotations

import contextlib
from pathlib import Path


def free_memory() -> int | None:
    """Bytes of memory available to this process, at most those of its container; None where unknown."""
    free: list[int] = []
    with contextlib.suppress(OSError, ValueError, IndexError):
        for line in Path("/proc/meminfo").read_text().splitlines():
            if line.startswith("MemAvailable:"):
                free.append(int(line.split()[1]) << 10)
    with contextlib.suppress(OSError, ValueError, KeyError):
        group = Path("/sys/fs/cgroup")
        most = int((group / "memory.max").read_text())  # "max", no number, where there is no limit
        parts = dict(line.split() for line in (group / "memory.stat").read_text().splitlines())
        free.append(max(0, most - int(parts["anon"]) - int(parts.get("kernel", 0))))
    return min(free, default=None)


def memory_shortage(needed: int) -> str | None:
    """Error message with its cure where `needed` bytes exceed the available memory; None otherwise."""
    free = free_memory()
    if free is None or needed <= free:
        return None
    return (
        f"it takes {needed / 1e9:.1f} GB of memory, {free / 1e9:.1f} are free; end other programs, or use a "
        "machine with more"
    )
