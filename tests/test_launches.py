"""Arguments of kernels: each launch sees the values it was given."""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

import threading
from dataclasses import dataclass

from cagefield.compute import devices, quadrants
from cagefield.compute.quadrants import qd

F32 = qd.types.ndarray(dtype=qd.f32, ndim=1)


@dataclass(frozen=True, eq=False)
class AddArgs:
    """Array and what is added to it."""

    values: F32
    more: qd.f32


@qd.kernel
def add(args: AddArgs, out: F32):
    for i in range(4):
        out[i] = args.values[i] + args.more


def test_launches_take_no_arguments_of_earlier_ones() -> None:
    devices.start()
    first, second, out = (qd.ndarray(qd.f32, (4,)) for _ in range(3))
    first.fill(1.0)
    second.fill(2.0)
    addresses = set()
    for n in range(50):
        args = AddArgs(second if n % 3 else first, float(n))
        addresses.add(id(args))
        add(args, out)
        assert out[0] == n + (2.0 if n % 3 else 1.0)
        del args
    assert len(addresses) < 50, "no address was used twice: the test shows nothing"


def test_arrays_are_freed_by_the_thread_that_made_them() -> None:
    devices.start()
    held = [qd.ndarray(qd.f32, (4,))]
    collector = threading.Thread(target=held.clear)
    collector.start()
    collector.join()
    assert len(quadrants._collected) == 1
    qd.ndarray(qd.f32, (4,))
    assert not quadrants._collected
