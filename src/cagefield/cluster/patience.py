"""Patience with a cluster: a notice while no worker is there or no scheduler replies, and an end.

dask itself waits without a word and without an end for workers that have gone.
"""

from __future__ import annotations

import asyncio
import time
import warnings
from concurrent.futures import Future as Reply
from typing import TYPE_CHECKING, Any

from cagefield.errors import CagefieldError

if TYPE_CHECKING:
    from distributed import Client

NOTICE_SECONDS = 10.0
"""Time without a worker before a warning: a killed local worker is back sooner."""
WORKER_SECONDS = 300.0
"""Time without a worker after which a command ends."""
LOCAL_WORKER_SECONDS = 600.0
"""Time for local workers, which start again by themselves, on a machine that may be busy."""
POLL_SECONDS = 0.02
"""Time between two looks at the workers."""
_ASK_SECONDS = 0.5
_AGAIN = "go on with --keep or --resume"


class LostClusterError(CagefieldError):
    """A scheduler that is gone or silent, or a cluster without workers: nothing more can be asked of it."""


class Patience:
    """A client's watch over its workers: `check` every POLL_SECONDS while a result is waited for."""

    def __init__(self, client: Client) -> None:
        self.client = client
        self.local = client.cluster is not None
        self.name = "the local cluster" if self.local else f"cluster {client.scheduler.address}"
        self.seconds = LOCAL_WORKER_SECONDS if self.local else WORKER_SECONDS
        self.workers: int | None = None
        """Number of workers in the scheduler's last reply, None without one."""
        self._reply: Reply[Any] | None = None
        self._checked = time.monotonic()
        self._since_asked = _ASK_SECONDS
        self._without = 0.0
        self._noticed = False

    def wait_for_worker(self) -> None:
        """Returns once a worker is there. Raises LostClusterError as `check`."""
        while not self.workers:
            self.check()
            time.sleep(POLL_SECONDS)

    def check(self) -> None:
        """A look at the workers; warns once per time without them.

        Raises LostClusterError for a lost connection, and where the patience is at its end.
        """
        if self.client.status != "running":
            raise lost_connection()
        now = time.monotonic()
        waited = min(now - self._checked, _ASK_SECONDS)  # the caller may do something else between two looks
        self._checked = now
        self._since_asked += waited
        self._without += waited
        if self._reply is not None and self._reply.done():
            failed = self._reply.cancelled() or self._reply.exception() is not None
            self.workers = None if failed else len(self._reply.result())
            self._reply = None
            if self.workers:
                self._without, self._noticed = 0.0, False
        elif self._reply is None and self._since_asked >= _ASK_SECONDS:
            self._since_asked = 0.0
            self._reply = asyncio.run_coroutine_threadsafe(
                self.client.scheduler.ncores(), self.client.loop.asyncio_loop
            )
        if self._without >= self.seconds:
            raise LostClusterError(self._ending())
        if self._without >= NOTICE_SECONDS and not self._noticed:
            self._noticed = True
            warnings.warn(self._notice(), stacklevel=3)

    def _notice(self) -> str:
        if self._is_silent():
            return (
                f"the scheduler of {self.name} does not reply; {self.seconds:.0f} s are waited at most; "
                "check its machine and the network"
            )
        cure = "they are started again" if self.local else "start some with `dask worker`"
        return f"{self.name} has no workers; {self.seconds:.0f} s are waited at most for one; {cure}"

    def _ending(self) -> str:
        if self._is_silent():
            return (
                f"the scheduler of {self.name} has not replied for {self.seconds:.0f} s; check its machine "
                f"and the network, and {_AGAIN}"
            )
        cure = "use fewer" if self.local else "start some with `dask worker`"
        return f"{self.name} has had no workers for {self.seconds:.0f} s; {cure}, and {_AGAIN}"

    def _is_silent(self) -> bool:
        return self.workers is None or self._since_asked >= NOTICE_SECONDS / 2


def lost_connection() -> LostClusterError:
    """The error of a scheduler that has closed the connection."""
    return LostClusterError(f"the connection to the cluster is lost; {_AGAIN}")
