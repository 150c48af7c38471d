"""Which device is started, and what is said where none can be."""

from __future__ import annotations

import pytest

from cagefield.compute import devices
from cagefield.errors import DeviceError


def test_auto_takes_what_the_environment_names(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(devices, "_started", None)
    monkeypatch.setenv("CAGEFIELD_DEVICE", "tpu")
    line = "device 'tpu' of CAGEFIELD_DEVICE is unknown; choose one of auto, cpu, cuda, metal, vulkan"
    with pytest.raises(DeviceError) as caught:
        devices.start()
    assert str(caught.value) == line


def test_a_device_that_is_named_there_and_missing_is_told_from_where(monkeypatch: pytest.MonkeyPatch) -> None:
    running = devices.start()
    monkeypatch.setattr(devices, "_started", None)
    monkeypatch.setattr(devices, "_supported", lambda arch: False)
    monkeypatch.setenv("CAGEFIELD_DEVICE", "cuda")
    with pytest.raises(DeviceError, match=r"'cuda' of CAGEFIELD_DEVICE is not available .*; unset it"):
        devices.start()
    with pytest.raises(DeviceError, match="'vulkan' is not available on this machine; use device="):
        devices.start("vulkan")
    monkeypatch.setattr(devices, "_started", running)
    assert devices.start() == running


def test_one_process_has_one_device() -> None:
    running = devices.start()
    other = "vulkan" if running != "vulkan" else "cpu"
    assert devices.start("auto") == devices.start(running) == running
    with pytest.raises(DeviceError, match=f"this process already runs on '{running}'"):
        devices.start(other)
