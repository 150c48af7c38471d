"""Handlers of messages about hotspots."""

from __future__ import annotations

from cagefield.scene.hotspots import Hotspot, HotspotView
from cagefield.server.editor.session import Session
from cagefield.server.protocol.hotspot_messages import HotspotMessage, PutHotspot


def change_hotspots(session: Session, message: HotspotMessage) -> None:
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
