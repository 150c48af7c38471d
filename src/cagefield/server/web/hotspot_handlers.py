"""Handlers of messages about hotspots, and of the question for the camera path that their marks follow."""

from __future__ import annotations

from numpy.typing import ArrayLike

from cagefield.cameras.camera import Camera
from cagefield.scene.hotspot_tour import tour_keys
from cagefield.scene.hotspots import Hotspot, HotspotView
from cagefield.server.editor.hotspot_tracks import hotspot_tracks
from cagefield.server.editor.session import Session
from cagefield.server.protocol.conversion import stills_of
from cagefield.server.protocol.hotspot_messages import MoveHotspot, PutHotspot, TourPath
from cagefield.server.protocol.server_messages import Answer, HotspotTrack
from cagefield.server.web.worker_threads import run_in_thread


async def path_of(session: Session, request: int) -> Answer:
    """Answer with the camera path and the tracks of hotspots on it. Raises CameraError without a motion."""
    document = session.document
    problems = {id(entry.edit): session.problem(entry.edit) for entry in document.entries}
    stills = stills_of(document.keys, document.loop)
    tracks = await run_in_thread(lambda: hotspot_tracks(document, lambda edit: problems[id(edit)]))
    return Answer(
        request=request,
        stills=stills,
        tracks=[HotspotTrack(hotspot=number, places=places) for number, places in tracks.items()],
    )


def set_tour(session: Session, message: TourPath, first: Camera, up: ArrayLike) -> None:
    """Make the tour of the shown hotspots the camera path.

    `first` is the view in which the scene opens, `up` [3] the direction that is up. Raises SceneError without
    a hotspot.
    """
    shown = [hotspot for hotspot in session.shown_hotspots() if hotspot is not None]
    session.set_path(tour_keys(shown, first, up, stop_seconds=message.stop), loop=False)


def change_hotspots(session: Session, message: PutHotspot | MoveHotspot) -> None:
    """Carry out a message. Raises `CagefieldError` where that is not possible."""
    if isinstance(message, PutHotspot):
        camera = message.camera
        view = None if camera is None else HotspotView(tuple(camera.c2w), camera.fov_y_deg)
        hotspot = Hotspot(message.title, message.position, message.text, view)
        session.put_hotspot(message.hotspot, hotspot, follows=message.follows)
    elif message.to is None:
        session.remove_hotspot(message.hotspot)
    else:
        session.move_hotspot(message.hotspot, message.to)
