"""Machine of a measurement: processor, cores, GPU."""

from __future__ import annotations

import os
import platform
import subprocess
from dataclasses import dataclass
from pathlib import Path

import cagefield
from cagefield.compute import devices


@dataclass(frozen=True)
class Machine:
    """CPU model, cores that this process may use, and the device that kernels run on, with a GPU's name."""

    cpu: str
    cores: int
    device: str

    @classmethod
    def here(cls) -> Machine:
        """This machine; starts the default device where none runs yet."""
        return cls(cpu_model(), devices.threads(), device_name(devices.start()))

    def __str__(self) -> str:
        return (
            f"{self.cpu}, {self.cores} cores, device {self.device}, "
            f"Python {platform.python_version()}, cagefield {cagefield.__version__}"
        )


def device_name(device: str) -> str:
    """The device, and the GPU's name as its driver gives it, where it does."""
    if device != "cuda":
        return device
    try:
        command = ["nvidia-smi", "--query-gpu=name", "--format=csv,noheader"]
        if visible := os.environ.get("CUDA_VISIBLE_DEVICES"):
            command += ["-i", visible.split(",")[0]]
        told = subprocess.run(command, capture_output=True, text=True, timeout=10.0, check=True).stdout
    except (OSError, ValueError, subprocess.SubprocessError):
        return device
    return f"{device} ({told.splitlines()[0].strip()})" if told.strip() else device


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
