"""Connections to a cluster of dask.distributed: local worker processes, or a scheduler's address.

A scheduler runs the pickled code of whoever connects. So local workers listen on the loopback interface
alone, and schedulers elsewhere belong behind TLS with certificates of their own (`TlsFiles`).
"""

from __future__ import annotations

import asyncio
import ipaddress
import logging
import warnings
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from cagefield.cluster.patience import Patience
from cagefield.cluster.scheduler_address import (
    announced_wait,
    call_within,
    read_scheduler_file,
    wait_for_listener,
)
from cagefield.cluster.versions import check_versions
from cagefield.errors import CagefieldError
from cagefield.files.temporary_folders import TemporaryFolder

if TYPE_CHECKING:
    from distributed import Client, LocalCluster
    from distributed.security import Security

LOCAL_WORKERS_HOST = "127.0.0.1"
MAX_LOCAL_WORKERS = 256
CONNECT_SECONDS = 30.0
"""Time that a scheduler elsewhere is waited for."""
LOCAL_CONNECT_SECONDS = 600.0
"""Time for the scheduler of local workers, on a machine that may be busy."""
CLOSE_SECONDS = 10.0


@dataclass(frozen=True)
class TlsFiles:
    """Certificate authority, certificate and key, PEM files, for both ends of each connection."""

    ca: Path
    cert: Path
    key: Path

    def security(self) -> Security:
        """Security of dask that refuses unencrypted connections. Raises CagefieldError for a missing file."""
        from distributed.security import Security

        for path in (self.ca, self.cert, self.key):
            if not path.is_file():
                raise CagefieldError(f"--cluster-tls: there is no file {path}; give CA, CERT and KEY")
        ends = ("client", "scheduler", "worker")
        pairs: dict[str, str] = {}
        for end in ends:
            pairs |= {f"tls_{end}_cert": str(self.cert), f"tls_{end}_key": str(self.key)}
        return Security(tls_ca_file=str(self.ca), require_encryption=True, **pairs)


def parse_cluster(text: str) -> int | str:
    """Number of local workers, or the address or scheduler file of a cluster.

    Raises CagefieldError for another text.
    """
    if text.isascii() and text.isdigit() and len(text) < 10:
        count = int(text)
        if 1 <= count <= MAX_LOCAL_WORKERS:
            return count
    elif text.endswith(".json"):
        return text
    else:
        parts = urlsplit(text)
        try:
            if parts.scheme in ("tcp", "tls") and parts.hostname and parts.port:
                return text
        except ValueError:  # a port out of range
            pass
    raise CagefieldError(
        f"--cluster {text[:80]!r} is no cluster; give a number of local workers, 1 to {MAX_LOCAL_WORKERS}, "
        "tcp://HOST:PORT, tls://HOST:PORT or a scheduler file .json"
    )


def check_installed() -> None:
    """Passes where dask.distributed is installed. Raises CagefieldError with the cure."""
    try:
        import distributed  # noqa: F401
    except ImportError:
        raise CagefieldError(
            "--cluster needs dask.distributed, which is not installed; pip install 'cagefield[cluster]'"
        ) from None


@contextmanager
def connect(cluster: int | str, tls: TlsFiles | None = None) -> Iterator[Client]:
    """Client of a cluster with at least one worker; local workers end with the context.

    Raises CagefieldError without the package, without a reply, for `tls://` without certificates, and for a
    scheduler or workers without the package or with another version of it (`check_versions`),
    LostClusterError for a cluster without workers (`patience`).
    """
    check_installed()
    if isinstance(cluster, str) and cluster.endswith(".json"):
        cluster = read_scheduler_file(Path(cluster))
    if isinstance(cluster, str) and cluster.startswith("tls://") and tls is None:
        raise CagefieldError(f"--cluster {cluster} needs certificates; give --cluster-tls CA CERT KEY")
    if isinstance(cluster, str) and cluster.startswith("tcp://"):
        if tls is not None:
            raise CagefieldError(f"--cluster {cluster} is not encrypted; give tls://, or no --cluster-tls")
        if not _is_loopback(urlsplit(cluster).hostname or ""):
            warnings.warn(
                f"the connection to {cluster} is not encrypted, and its scheduler runs the code of whoever "
                "reaches it; use tls:// with --cluster-tls",
                stacklevel=2,
            )
    security = tls.security() if tls is not None else None
    with ExitStack() as opened:
        opened.enter_context(_quiet_dask())
        if isinstance(cluster, int):
            target: Any = opened.enter_context(_local_workers(cluster, security))
        else:
            target = None
        client = opened.enter_context(_client(cluster, target, security))
        if target is not None:
            from cagefield.cluster.worker_plugin import LocalWorkerPlugin

            client.register_plugin(LocalWorkerPlugin())
        else:
            check_versions(client)
        yield client


@contextmanager
def _quiet_dask() -> Iterator[None]:
    """Context without dask's own log on stderr: errors have a line of this package."""
    from distributed.utils import silence_logging_cmgr

    with silence_logging_cmgr(logging.CRITICAL):
        yield


@contextmanager
def _local_workers(count: int, security: Security | None) -> Iterator[LocalCluster]:
    import dask
    from distributed import LocalCluster

    # A kernel's launch holds the interpreter to its end: a busy worker may not answer for minutes. One that
    # was killed is started again, which takes a busy machine longer than the 15 s after which dask would
    # give it up for good.
    settings: dict[str, Any] = {
        "distributed.scheduler.worker-ttl": None,
        "distributed.comm.timeouts.connect": "120s",
        "distributed.deploy.lost-worker-timeout": "365d",
        "distributed.scheduler.http.routes": [],
        "distributed.worker.http.routes": [],
    }
    with TemporaryFolder("cluster") as scratch, dask.config.set(settings):
        cluster = LocalCluster(
            n_workers=count,
            threads_per_worker=1,
            processes=True,
            host=LOCAL_WORKERS_HOST,
            dashboard_address=f"{LOCAL_WORKERS_HOST}:0",  # None is the port 8787, which another one may have
            scheduler_kwargs={"dashboard": False},
            memory_limit=0,
            local_directory=str(scratch),
            security=security,
            silence_logs=logging.CRITICAL,
        )
        try:
            yield cluster
        finally:
            # On a busy machine dask waits too briefly for its killed workers to end.
            with suppress(TimeoutError, asyncio.TimeoutError):
                cluster.close()


@contextmanager
def _client(cluster: int | str, local: Any, security: Security | None) -> Iterator[Client]:
    from distributed import Client

    options: dict[str, Any] = {"security": security, "set_as_default": False}
    try:
        if isinstance(cluster, str):
            with announced_wait(cluster, CONNECT_SECONDS):
                client = call_within(CONNECT_SECONDS, partial(_client_of_scheduler, cluster, options))
        else:
            client = Client(local, timeout=LOCAL_CONNECT_SECONDS, **options)
    except (OSError, TypeError) as error:
        reason = " ".join(str(error).split())[:200]
        raise CagefieldError(f"no scheduler replies at {cluster} ({reason}); check address and TLS") from None
    try:
        Patience(client).wait_for_worker()
        yield client
    finally:
        with suppress(TimeoutError, asyncio.TimeoutError, OSError):  # of a scheduler that is gone
            client.close(CLOSE_SECONDS)


def _client_of_scheduler(address: str, options: dict[str, Any]) -> Client:
    from distributed import Client

    wait_for_listener(address, CONNECT_SECONDS)
    return Client(address, timeout=CONNECT_SECONDS, **options)


def _is_loopback(host: str) -> bool:
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
