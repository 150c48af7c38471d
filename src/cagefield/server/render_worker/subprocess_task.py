"""One piece of work in a process of its own: reading and writing large files, beside the pictures."""

from __future__ import annotations

import asyncio
import multiprocessing
import signal
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any

from cagefield.compute.parent_watch import end_with_parent
from cagefield.errors import CagefieldError, line_of, warnings_in_one_line


@dataclass(frozen=True)
class _Progress:
    """Completed share of the work, in [0,1]."""

    done: float


async def run_in_process(
    work: Callable[..., Any], *args: Any, on_progress: Callable[[float], None] | None = None
) -> Any:
    """Result of `work(*args)`, run in a process of its own; work, arguments and result must be picklable.

    With `on_progress`, the work is called with a keyword argument of this name, and what it calls it with, a
    share in [0,1], is passed on. Cancellation ends the process. Raises CagefieldError: the error of the work,
    or the loss of the process.
    """
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe(duplex=False)
    process = context.Process(
        target=_serve, args=(there, work, args, on_progress is not None), daemon=True, name="cagefield-file"
    )
    waiting = ThreadPoolExecutor(1)  # minutes, often: not one of those that others wait for
    try:
        await asyncio.to_thread(process.start)
        there.close()
        try:
            loop = asyncio.get_running_loop()
            while isinstance(result := await loop.run_in_executor(waiting, here.recv), _Progress):
                if on_progress is not None:
                    on_progress(result.done)
        except EOFError:
            raise CagefieldError("the process that did this ended (out of memory?)") from None
        if isinstance(result, Exception):
            raise result
        return result
    finally:
        if process.pid is not None:
            process.terminate()
        waiting.shutdown(wait=False)


@warnings_in_one_line()
def _serve(
    connection: Connection, work: Callable[..., Any], args: tuple[Any, ...], reports: bool = False
) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with_parent()
    try:
        result = work(*args, **_reporting(connection)) if reports else work(*args)
    except CagefieldError as error:
        result = CagefieldError(str(error))
    except OSError as error:
        result = CagefieldError(line_of(error))
    except Exception as error:
        result = CagefieldError(f"that failed: {type(error).__name__}: {error}")
    connection.send(result)


def _reporting(connection: Connection) -> dict[str, Callable[[float], None]]:
    """Keyword argument of work that reports its progress."""
    return {"on_progress": lambda done: connection.send(_Progress(done))}
