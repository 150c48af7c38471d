"""From a scene folder to a running editor."""

from __future__ import annotations

import contextlib
import hashlib
import math
import os
import socket
import ssl
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import uvicorn

import cagefield
from cagefield.cameras.camera import Camera
from cagefield.cameras.camera_paths import shared_up
from cagefield.errors import CagefieldError
from cagefield.fields.splat_field import SplatField
from cagefield.files.safe_open import MAX_TEXT_BYTES, FileState, check_regular, read_text, real_path
from cagefield.formats.splats.detection import LOD_META, META, is_splat_folder
from cagefield.pages.page_field import VERSION as FIELD_VERSION
from cagefield.scene.removed_elements import read_removed, without_removed
from cagefield.scene.scene import Scene
from cagefield.scene.scene_files import field_states, is_scene, recover
from cagefield.server.editor.pasted_sources import source_problem
from cagefield.server.editor.persistence import SceneStore
from cagefield.server.editor.scene_lock import SceneLock
from cagefield.server.editor.session import Session
from cagefield.server.protocol import common, server_messages
from cagefield.server.protocol.conversion import vec3
from cagefield.server.render_queue.coordinator import Coordinator
from cagefield.server.web.app import application
from cagefield.server.web.security import Guard
from cagefield.server.web.splat_file_scene import LEFT_OUT, scene_of_file

LISTEN_BACKLOG = 128
"""Number of new connections that the system holds until the server accepts them."""

MAX_CONNECTIONS = 512
"""Number of open connections at which requests get status 503; 64 pages of six connections each are fewer."""

MAX_REQUEST_HEAD_BYTES = 64 << 10
"""Size of the line and the headers of a request."""


def open_scene(
    path: Path, device: str = "auto", root: Path | None = None
) -> tuple[Coordinator, server_messages.Hello]:
    """Coordinator of a scene folder or a file of splats, and the first message to its pages.

    An autosave is restored. `root` is the folder that pages may write into, None for the one that the
    scene is in. Raises CagefieldError for a folder that is no scene, a file without splats, and a scene that
    another program edits.
    """
    path = path.parent if path.name in (META, LOD_META) else path
    if path.is_file() or (is_splat_folder(path) and not is_scene(path)):
        return open_cached(scene_of_file(path), path, device, root)
    return open_cached(path, None, device, root)


def open_cached(
    path: Path, source: Path | None, device: str = "auto", root: Path | None = None
) -> tuple[Coordinator, server_messages.Hello]:
    """Coordinator and first message of a scene folder; of the cached folder of a file `source` where
    given."""
    lock = SceneLock(real_path(path))  # what is read is what the last editor saved
    try:
        recover(path)
        files = field_states(path)
        scene = Scene.open(path, whole=True)
        without_removed(scene.field, read_removed(path))  # an error here, not in the first picture
        store = SceneStore(scene, path, source, root, files=files)
        store.lock()
    finally:
        lock.release()
    try:
        return _greeted(scene, store, device, real_path(path) if source is None else source, files[0])
    except BaseException:
        store.close()
        raise


def _greeted(
    scene: Scene, store: SceneStore, device: str, shown: Path, field: FileState
) -> tuple[Coordinator, server_messages.Hello]:
    """Coordinator of a scene that pages name `shown`, with a restored autosave."""
    session = Session(store.document(), scene.field.bounds, scene.field.sample_spacing, source_problem)
    coordinator = Coordinator(session, store, device)
    recovered = store.recovered()
    if recovered is not None:
        session.restore(recovered)
        coordinator.greeting = "changes that had not been saved were restored; undo takes them back"
    elif store.damaged is not None:
        coordinator.greeting = store.damaged
    elif (store.origin / LEFT_OUT).is_file():
        coordinator.greeting = read_text(store.origin / LEFT_OUT)
    return coordinator, hello_of(scene, shown.name, str(real_path(store.path)), field)


def hello_of(scene: Scene, name: str, path: str = "", field: FileState = None) -> server_messages.Hello:
    """First message to a page; `path` identifies the scene, `field` the file of its field."""
    cameras = scene.cameras.get("test") or next((c for c in scene.cameras.values() if c), ())
    first = cameras[0] if cameras else _from_outside(scene)
    lower, upper = scene.field.bounds
    fov = math.degrees(2.0 * math.atan(0.5 * first.height / first.fy))
    poses = [camera.c2w for camera in cameras]
    every = [camera.c2w for group in scene.cameras.values() for camera in group]
    return server_messages.Hello(
        version=cagefield.__version__,
        page=0,
        scene=path,
        field=_field_name(path, field),
        name=name,
        splats=isinstance(scene.field, SplatField),
        bounds=(vec3(lower), vec3(upper)),
        voxel=scene.field.sample_spacing,
        up=vec3(shared_up(np.stack(every))) if every else (0.0, 0.0, 1.0),
        start=common.CameraMessage(
            seq=0,
            c2w=first.c2w.reshape(-1).tolist(),
            width=min(max(first.width, 16), 4096),
            height=min(max(first.height, 16), 4096),
            fov_y_deg=min(max(fov, 0.11), 178.9),
        ),
        cameras=[pose.reshape(-1).tolist() for pose in poses],
    )


def _field_name(path: str, state: FileState) -> str:
    """A name for the content of a scene's field, another one once that is written anew."""
    what = (path, *(state or ()), FIELD_VERSION)
    return hashlib.blake2b(repr(what).encode(), digest_size=8).hexdigest()


def _from_outside(scene: Scene) -> Camera:
    """A camera that sees the whole field."""
    lower, upper = scene.field.bounds
    size = float(((upper - lower) ** 2).sum()) ** 0.5
    middle = 0.5 * (lower + upper)
    return Camera.look_at(
        middle + size * np.array([0.9, -0.9, 0.6]), middle, width=800, height=800, fov_x=0.9
    )


def bound_socket(host: str, port: int) -> socket.socket:
    """A listening socket; port 0 takes any that is free.

    Raises:
        CagefieldError: the port is taken, or the host is not an address of this machine.
    """
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
    except (OSError, UnicodeError) as error:
        reason = getattr(error, "strerror", None) or "no name that can be looked up"
        raise CagefieldError(
            f"--host {host:.80} is no address ({reason}); give one of this machine's"
        ) from None
    reason = None
    for family, _, _, _, address in found:
        listening = socket.socket(family)
        try:
            if os.name == "posix":
                listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listening.bind(address)
            listening.listen(LISTEN_BACKLOG)
            return listening
        except OSError as error:
            listening.close()
            reason = error.strerror
    raise CagefieldError(
        f"cannot listen on {host}:{port} ({reason}); give another --port, or 0 for a free one"
    )


@dataclass(frozen=True)
class Certificate:
    """Files in PEM that let pages speak to the editor encrypted: the certificate with its chain, and its key.

    Raises CagefieldError where they cannot be read or do not belong together.
    """

    file: Path
    key: Path | None = None

    def __post_init__(self) -> None:
        def no_password() -> str:
            raise CagefieldError(f"the key of {self.file} has a password; give one without")

        try:
            for file in (self.file, self.key or self.file):
                check_regular(file, MAX_TEXT_BYTES)
            ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(self.file, self.key, no_password)
        except ssl.SSLError as error:
            raise CagefieldError(
                f"{self.file}: no certificate with its key ({error.reason or error}); give PEM files that "
                "belong together (--certificate, --certificate-key)"
            ) from None
        except OSError as error:
            where = self.file if self.key is None else f"{self.file} and {self.key}"
            raise CagefieldError(f"{where}: cannot be read ({error.strerror})") from None


def serve(
    coordinator: Coordinator,
    hello: server_messages.Hello,
    guard: Guard,
    listening: socket.socket,
    certificate: Certificate | None = None,
) -> None:
    """Runs the web server to its end (Ctrl+C, or a signal to terminate), over TLS with a certificate."""
    _allow_many_connections()
    device = coordinator.device

    def reopen(scene: Path, source: Path) -> tuple[Coordinator, server_messages.Hello]:
        return open_cached(scene, source, device, coordinator.store.root)

    config = uvicorn.Config(
        application(coordinator, hello, guard, reopen),
        log_level="warning",
        http="h11",
        h11_max_incomplete_event_size=MAX_REQUEST_HEAD_BYTES,
        limit_concurrency=MAX_CONNECTIONS,
        ws="websockets-sansio",  # reads a page's next message once the last one was taken
        ws_max_size=common.MAX_MESSAGE_BYTES,
        ws_per_message_deflate=False,
        ssl_certfile=None if certificate is None else certificate.file,
        ssl_keyfile=None if certificate is None else certificate.key,
        timeout_graceful_shutdown=2,
        backlog=LISTEN_BACKLOG,
        server_header=False,
        proxy_headers=False,  # an address that a visitor writes himself would get round the limit of tokens
    )
    with contextlib.suppress(KeyboardInterrupt):
        uvicorn.Server(config).run(sockets=[listening])


def _allow_many_connections() -> None:
    """As many open files as this user may have, up to some thousands: connections of others take them."""
    try:
        import resource
    except ImportError:  # another system
        return
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = 8192 if hard == resource.RLIM_INFINITY else min(8192, hard)
    if soft < wanted:
        with contextlib.suppress(OSError, ValueError):
            resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))
