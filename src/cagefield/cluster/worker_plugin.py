"""dask's plugin of a `SceneArchive`."""

from __future__ import annotations

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
