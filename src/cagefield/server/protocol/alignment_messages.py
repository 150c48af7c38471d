"""Messages of pages about the scene's scale, its up direction, and pastes aligned with it."""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

from pydantic import Field

from cagefield.server.protocol.common import EditId, Message, Vec3

MAX_POINT_PAIRS = 20
"""Maximum number of pairs of points of a paste's alignment."""


class ScaleChange(Message):
    """Change the scene's scale; None forgets it."""

    type: Literal["scale_change"] = "scale_change"
    meters_per_unit: Annotated[float, Field(gt=0, lt=1e12)] | None


class UpChange(Message):
    """Change the scene's up direction.

    "points": the normal of a level plane through three points; "floor": that of the dominant plane of the
    scene's surfaces; "cameras": forgets it, so that it is that of the cameras.
    """

    type: Literal["up_change"] = "up_change"
    by: Literal["points", "floor", "cameras"]
    points: Annotated[list[Vec3], Field(max_length=3, default_factory=list)]


class PointPair(Message):
    """A point of pasted content where it stands, and the scene's point where it belongs: deformed space."""

    pasted: Vec3
    scene: Vec3


class AlignPaste(Message):
    """Replace the operations of a paste by the similarity that pairs of points give.

    `refine` brings its surfaces nearer to the scene's, `keep_scale` leaves the scale of the pairs in that;
    `match_colors` replaces its grade.
    """

    type: Literal["align_paste"] = "align_paste"
    edit: EditId
    pairs: Annotated[list[PointPair], Field(min_length=3, max_length=MAX_POINT_PAIRS)]
    refine: bool = False
    keep_scale: bool = False
    match_colors: bool = False


AlignmentMessage: TypeAlias = ScaleChange | UpChange | AlignPaste
