"""What a figure was measured on."""

from __future__ import annotations

import platform
from dataclasses import dataclass
from pathlib import Path

import cagefield
from cagefield import devices


@dataclass(frozen=True)
class Machine:
    """CPU model, cores that this process may use, and the device that kernels run on."""

    cpu: str
    cores: int
    device: str

    @classmethod
    def here(cls) -> Machine:
        """This machine; starts the default device where none runs yet."""
        return cls(cpu_model(), devices.threads(), devices.start())

    def __str__(self) -> str:
        return (
            f"{self.cpu}, {self.cores} cores, device {self.device}, "
            f"Python {platform.python_version()}, cagefield {cagefield.__version__}"
        )


def cpu_model() -> str:
    """The CPU's name as the system gives it."""
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            name, _, value = line.partition(":")
            if name.strip() in ("model name", "Model") and value.strip():
                return value.strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()
