"""Plugins of dask's workers: the files of a scene, and interrupts."""

from __future__ import annotations

import contextlib
import signal

from distributed import WorkerPlugin
from distributed.worker import Worker

from cagefield.cluster.scene_archive import SceneArchive


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


class InterruptPlugin(WorkerPlugin):  # type: ignore[misc]
    """Ctrl+C left to the command, which ends its local workers: a terminal sends it to all of them."""

    name = "cagefield-interrupts"

    def setup(self, worker: Worker) -> None:
        """Ignores SIGINT in the worker's process."""
        with contextlib.suppress(ValueError):  # not the main thread
            signal.signal(signal.SIGINT, signal.SIG_IGN)
