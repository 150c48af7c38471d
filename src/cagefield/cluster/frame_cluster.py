"""Frames of a scene on a cluster: tasks submitted, tried again on other workers, gathered or cancelled.

A frame is a task. dask runs it again where its worker is lost (up to `distributed.scheduler.allowed-failures`
workers, 3) and where it fails for a passing reason (RETRIES times); errors that the user can cure end the
command. Workers hold no state that a frame depends on, so pictures are those of one process.
"""

from __future__ import annotations

import asyncio
import uuid
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from cagefield.cluster.connection import CLOSE_SECONDS, TlsFiles, connect
from cagefield.cluster.frame_tasks import FrameJob, FrameResult, fit_depth_scale, render_frame, write_contents
from cagefield.cluster.scene_archive import SceneArchive, SceneSource
from cagefield.cluster.tasks import RETRIES, results_of, warned_losses
from cagefield.errors import CagefieldError
from cagefield.files.stale_files import hidden_name, remove_unfinished
from cagefield.images.pictures import DepthScale
from cagefield.scene.frames import FrameOptions
from cagefield.scene.scene import Scene

if TYPE_CHECKING:
    from distributed import Client, Future

    from cagefield.cameras.camera import Camera


class FrameCluster:
    """Workers that have the scene, and a folder for its frames; made by `open_frame_cluster`."""

    def __init__(self, client: Client, job: FrameJob) -> None:
        self.client, self.job = client, job

    def depth_scale(self, camera: Camera) -> DepthScale:
        """The depth scale of a camera's frame, which is not written."""
        future = self.client.submit(fit_depth_scale, self.job, camera, retries=RETRIES, pure=False)
        ((_, result),) = self._results({future: "the depth scale"})
        assert result.scale is not None
        return result.scale

    def render(
        self, cameras: Mapping[str, Camera], scale: DepthScale | None = None
    ) -> Iterator[tuple[str, DepthScale | None]]:
        """Name and depth scale of each frame, in the order in which their files are complete.

        `cameras` has the camera of each name, the beginning of the file names. The frames that are not done
        are cancelled when the iteration ends early. Raises CagefieldError for a frame that cannot be
        rendered.
        """
        futures = {
            self.client.submit(render_frame, self.job, camera, name, scale, retries=RETRIES, pure=False): name
            for name, camera in cameras.items()
        }
        for name, result in self._results(futures):
            write_contents(self.job.folder / name, result)
            yield name, result.scale

    def _results(self, futures: dict[Future, str]) -> Iterator[tuple[str, FrameResult]]:
        for name, result in results_of(self.client, futures, "frame "):
            if result.error:
                raise CagefieldError(f"frame {name}: {result.error}")
            yield name, result


@contextmanager
def open_frame_cluster(
    cluster: int | str,
    scene: Scene,
    options: FrameOptions,
    folder: Path,
    *,
    device: str = "auto",
    tls: TlsFiles | None = None,
) -> Iterator[FrameCluster]:
    """Workers for the frames of a scene that was opened from a folder, written into `folder`, which is made.

    `cluster` is a number of local workers, an address or a scheduler file; `device` is the workers'. Lost
    workers are counted in a warning at the end.

    Raises:
        CagefieldError: no package, no reply, another version of cagefield on the cluster.
        SceneError: workers do not see the folder of a scene that pastes from others.
    """
    if scene.folder is None:
        raise CagefieldError("a scene for a cluster must be saved; give one from Scene.open")
    folder.mkdir(parents=True, exist_ok=True)
    source = SceneSource.read(scene.folder)
    mark = folder / hidden_name(folder / f"mark{uuid.uuid4().hex[:8]}", "part")
    job = FrameJob(source, options, device, folder.absolute(), mark.name)
    with ExitStack() as opened:
        opened.callback(remove_unfinished, folder)  # of lost workers on this machine
        client = opened.enter_context(connect(cluster, tls))
        mark.touch()
        opened.callback(mark.unlink, missing_ok=True)
        if not _all_see(client, source):
            from cagefield.cluster.worker_plugin import ArchivePlugin

            archive = SceneArchive.packed(source, scene)
            client.register_plugin(ArchivePlugin(archive), name=archive.name)
            opened.callback(_forget, client, archive.name)
        opened.enter_context(warned_losses(client, "rendered their frames"))
        yield FrameCluster(client, job)


def _forget(client: Client, name: str) -> None:
    """Takes an archive from the workers that can still be reached."""
    if client.status == "running":
        with suppress(TimeoutError, asyncio.TimeoutError, OSError):
            client.sync(client.scheduler.unregister_worker_plugin, name=name, callback_timeout=CLOSE_SECONDS)


def _all_see(client: Client, source: SceneSource) -> bool:
    """Whether all workers have the scene folder; not where one was lost meanwhile."""
    return all(reply is True for reply in client.run(source.is_here, on_error="return").values())
