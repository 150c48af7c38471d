"""Versions of cagefield on a cluster: a scheduler and its workers load the functions of tasks by name.

dask tells of a scheduler without the package with its own traceback, and loses workers without it.
"""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

import cagefield
from cagefield.errors import CagefieldError

if TYPE_CHECKING:
    from distributed import Client


def check_versions(client: Client) -> None:
    """Passes where the scheduler and all workers have this version of cagefield, with clusters.

    Workers that are lost meanwhile are passed over. Raises CagefieldError that names the machine.
    """
    try:
        found: Any = client.run_on_scheduler(version)
    except (OSError, TimeoutError, asyncio.TimeoutError):
        return  # of a scheduler that is gone: whoever asks it next says so
    except Exception as error:
        found = error
    _check(f"the scheduler {client.scheduler.address}", found)
    for worker, reply in client.run(version, on_error="return").items():
        if not isinstance(reply, OSError | TimeoutError | asyncio.TimeoutError):
            _check(f"worker {worker}", reply)


def version() -> str:
    """Version of cagefield in this process."""
    return cagefield.__version__


def _check(name: str, found: object) -> None:
    """Raises CagefieldError for an error, or for another version, of the machine `name`."""
    if not isinstance(found, str):
        raise CagefieldError(f"{name} has no cagefield with clusters; pip install 'cagefield[cluster]' there")
    if found != cagefield.__version__:
        raise CagefieldError(
            f"{name} has cagefield {found}, this is {cagefield.__version__}; "
            "install the same version everywhere"
        )
