"""Sorting and prefix sums on whichever device runs here, against NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from cagefield.compute import device_buffers, devices
from cagefield.compute.device_buffers import DeviceBuffers
from cagefield.rendering.splats.device_sorting import exclusive_scan, sort_by_key


@pytest.fixture(scope="module")
def buffers() -> DeviceBuffers:
    devices.start()
    return DeviceBuffers()


@pytest.mark.parametrize("count", [0, 1, 127, 128, 129, 16385, 40_000])
def test_prefix_sums(buffers: DeviceBuffers, count: int) -> None:
    values = np.random.default_rng(count).integers(0, 50, count).astype(np.int32)
    array = buffers.upload(f"values{count}", values)
    exclusive_scan(array, count, buffers)
    np.testing.assert_array_equal(array.to_numpy()[:count], np.cumsum(values) - values)


@pytest.mark.parametrize(("count", "max_key"), [(0, 9), (1, 0), (5000, 255), (5000, 256), (1000, 2**31 - 1)])
def test_equal_keys_keep_their_order(buffers: DeviceBuffers, count: int, max_key: int) -> None:
    keys = np.random.default_rng(max_key % 997).integers(0, max_key, count, endpoint=True).astype(np.int32)
    keys[: count // 2] = keys[count - count // 2 :]
    got_keys, got = sort_by_key(
        buffers.upload(f"keys{count}{max_key}", keys),
        buffers.upload(f"rows{count}{max_key}", np.arange(count, dtype=np.int32)),
        count,
        max_key,
        "test",
        buffers,
    )
    order = np.argsort(keys, kind="stable")
    np.testing.assert_array_equal(got.to_numpy()[:count], order)
    np.testing.assert_array_equal(got_keys.to_numpy()[:count], keys[order])


def test_memory_is_reused_while_it_is_large_enough(buffers: DeviceBuffers) -> None:
    first = buffers.take("memory", 100)
    assert buffers.take("memory", 80) is first
    assert buffers.take("memory", 120) is not first
    assert buffers.take("memory", 145) is buffers.take("memory", 150)
    assert buffers.take("memory", 10, np.int32) is not first


def test_constant_arrays_are_uploaded_once(buffers: DeviceBuffers, monkeypatch: pytest.MonkeyPatch) -> None:
    both = np.arange(24, dtype=np.float32).reshape(2, 12)
    first, second = buffers.upload_once("constant", both[0]), buffers.upload_once("constant", both[1])
    assert buffers.upload_once("constant", both[0]) is first
    np.testing.assert_array_equal(first.to_numpy(), both[0])
    np.testing.assert_array_equal(second.to_numpy(), both[1])
    np.testing.assert_array_equal(buffers.upload_once("constant", both).to_numpy(), both.reshape(-1))
    monkeypatch.setattr(device_buffers, "MAX_KEPT_BYTES", 0)
    more = [buffers.upload_once("constant", both[:, n : n + 6].copy()) for n in range(2)]
    assert more[0] is more[1]
    np.testing.assert_array_equal(more[1].to_numpy(), both[:, 1:7].reshape(-1))
