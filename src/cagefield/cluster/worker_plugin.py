"""Plugins of dask's workers: the files of a scene, and interrupts."""

from __future__ import annotations

import contextlib
import signal

from distributed import WorkerPlugin
from distributed.worker import Worker

from cagefield.cluster.scene_archive import SceneArchive
from cagefield.compute.parent_watch import end_with_parent


class ArchivePlugin(WorkerPlugin):  # type: ignore[misc]
    """The archive's files, unpacked when a worker starts and removed when it ends."""

    def __init__(self, archive: SceneArchive) -> None:
        self.archive, self.name = archive, archive.name

    def setup(self, worker: Worker) -> None:
        """Unpacks the scene in the worker's process."""
        self.archive.setup()

    def teardown(self, worker: Worker) -> None:
        """Removes the unpacked scene."""
        self.archive.teardown()


class LocalWorkerPlugin(WorkerPlugin):  # type: ignore[misc]
    """Local workers that end with their command, by it or, where it is killed, by the system.

    dask's own watch over the parent is a thread, which waits while a kernel holds the interpreter. Ctrl+C is
    left to the command, which ends its workers: a terminal sends it to all of them.
    """

    name = "cagefield-local-workers"

    def setup(self, worker: Worker) -> None:
        """Binds the worker's process to its parent, and ignores SIGINT in it."""
        end_with_parent()
        with contextlib.suppress(ValueError):  # not the main thread
            signal.signal(signal.SIGINT, signal.SIG_IGN)
