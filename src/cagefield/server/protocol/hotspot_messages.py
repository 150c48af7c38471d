"""Messages of pages about hotspots: points with a title and plain text."""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

from pydantic import Field

from cagefield.scene.hotspots import MAX_HOTSPOTS, MAX_TEXT_CHARACTERS, MAX_TITLE_CHARACTERS
from cagefield.server.protocol.common import Message, Pose, Vec3

HotspotId: TypeAlias = Annotated[int, Field(ge=1)]


class HotspotCamera(Message):
    """Camera from which a hotspot is looked at."""

    c2w: Pose
    fov_y_deg: Annotated[float, Field(gt=0.1, lt=179.0)]


class PutHotspot(Message):
    """A hotspot with all its values: a new one without a number, else in place of that one."""

    type: Literal["put_hotspot"] = "put_hotspot"
    hotspot: HotspotId | None = None
    title: Annotated[str, Field(min_length=1, max_length=MAX_TITLE_CHARACTERS)]
    text: Annotated[str, Field(max_length=MAX_TEXT_CHARACTERS)] = ""
    position: Vec3
    camera: HotspotCamera | None = None
    follows: bool = True
    """Whether the edits carry it along, from the position in the edited scene on."""


class MoveHotspot(Message):
    """Puts a hotspot at another place in the list, 0 first; None removes it."""

    type: Literal["move_hotspot"] = "move_hotspot"
    hotspot: HotspotId
    to: Annotated[int, Field(ge=0, lt=MAX_HOTSPOTS)] | None = None


class TourPath(Message):
    """Makes the tour of the shown hotspots the camera path, which rests `stop` seconds at each."""

    type: Literal["tour_path"] = "tour_path"
    stop: Annotated[float, Field(ge=0.01, le=600)] = 3.0


HotspotMessage: TypeAlias = PutHotspot | MoveHotspot | TourPath
