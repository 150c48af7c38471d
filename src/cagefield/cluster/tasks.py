"""Named tasks on a cluster's workers: functions of picklable arguments, whose results come back.

A task of a lost worker is given to another one; so a task writes its files whole, and may run twice.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from cagefield.cluster.connection import TlsFiles, connect
from cagefield.cluster.patience import POLL_SECONDS, LostClusterError, Patience, lost_connection
from cagefield.errors import CagefieldError

if TYPE_CHECKING:
    from distributed import Client, Future

RETRIES = 2
"""Further tries of a task that fails, for a full disk or a network folder that is away for a moment."""


@dataclass(frozen=True)
class Task:
    """A function of a module that workers can import, and its arguments."""

    function: Callable[..., Any]
    arguments: tuple[Any, ...] = ()


def run_tasks(
    cluster: int | str,
    tasks: Mapping[str, Task],
    *,
    device: str = "auto",
    tls: TlsFiles | None = None,
    failures: dict[str, str] | None = None,
) -> Iterator[tuple[str, Any]]:
    """Name and result of each task, in the order in which they are complete.

    `cluster` is a number of local workers, an address or a scheduler file; `device` is the workers'. Lost
    workers are counted in a warning at the end. A task that fails ends the others; with `failures` they go
    on, and it gets the message by the task's name.

    Raises CagefieldError of a task with its name, without a reply, and where several workers were lost with
    one task.
    """
    with connect(cluster, tls) as client, warned_losses(client, "took their tasks"):
        futures = {
            client.submit(_outcome, device, task, retries=RETRIES, pure=False): name
            for name, task in tasks.items()
        }
        for name, (result, error) in results_of(client, futures, failures=failures):
            if not error:
                yield name, result
            elif failures is None:
                raise CagefieldError(f"{name}: {error}")
            else:
                failures[name] = error


def results_of(
    client: Client, futures: dict[Future, str], kind: str = "", *, failures: dict[str, str] | None = None
) -> Iterator[tuple[str, Any]]:
    """Name and result of each future, in the order in which they are complete; `futures` is emptied.

    Unfinished tasks are cancelled when the iteration ends early. Messages begin with `kind` and the
    name. Raises CagefieldError for lost workers, unless `failures` takes the message, LostClusterError for a
    lost connection and for a cluster that has had no workers for a time (`patience`).
    """
    from distributed import CancelledError, KilledWorker, as_completed

    patience = Patience(client)
    names = {future.key: name for future, name in futures.items()}
    waiting = set(futures)
    futures.clear()  # a result is released once it is here
    try:
        completed = as_completed(list(waiting), loop=client.loop)
        while not completed.is_empty():
            if not completed.has_ready():
                patience.check()
                time.sleep(POLL_SECONDS)
                continue
            future = next(completed)
            name = names[future.key]
            try:
                result = _result_of(future, patience)
            except KilledWorker as error:
                message = (
                    f"{int(getattr(error, 'allowed_failures', 3)) + 1} workers ended while they worked on "
                    "it, for want of memory perhaps; use fewer workers, and --keep or --resume"
                )
                if failures is None:
                    raise CagefieldError(f"{kind}{name}: {message}") from None
                failures[name] = message
                waiting.discard(future)
                continue
            except CancelledError:
                raise lost_connection() from None
            waiting.discard(future)
            yield name, result
    finally:
        if waiting and client.status == "running":
            client.cancel(list(waiting), force=True)


def _result_of(future: Future, patience: Patience) -> Any:
    """Result of a completed future, which dask computes again where its worker is gone with it.

    Raises the task's own errors, CancelledError, and LostClusterError for a lost connection.
    """
    pool = ThreadPoolExecutor(1)
    try:
        result = pool.submit(future.result)
        while wait([result], POLL_SECONDS).not_done:
            patience.check()
        return result.result()
    except OSError:
        if future.status == "error":
            raise
        raise lost_connection() from None
    finally:
        pool.shutdown(wait=False)


@contextmanager
def warned_losses(client: Client, others: str) -> Iterator[None]:
    """Context after which a warning counts the workers lost in it, and names the work of the `others`."""
    lost: list[str] = []

    def noted(event: Any) -> None:
        message = event[1] if isinstance(event, tuple) else event
        if isinstance(message, dict) and message.get("action") == "remove-worker":
            lost.append(str(message.get("worker", "")))

    client.subscribe_topic("all", noted)
    try:
        yield
    except LostClusterError:
        others = ""
        raise
    finally:
        if client.status == "running":
            client.unsubscribe_topic("all")
        if lost:
            text = "1 worker was lost" if len(lost) == 1 else f"{len(lost)} workers were lost"
            warnings.warn(f"{text}; others {others}" if others else text, stacklevel=2)


def _outcome(device: str, task: Task) -> tuple[Any, str]:
    """(result, "") of a task in the worker's process, or (None, message of a CagefieldError)."""
    from cagefield.compute import devices

    devices.start(device)
    try:
        return task.function(*task.arguments), ""
    except CagefieldError as error:
        return None, str(error)
