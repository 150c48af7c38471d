"""Message protocol of the editor: conventions, and the parts that both directions share.

`client_messages` has the messages of pages, `server_messages` those of the server; the page's types are
generated from these.

One WebSocket per page carries text messages, one JSON object each, with a `type`; and, from server to page,
pictures as binary messages (see `server_messages.PictureHeader`). Lengths are world units, angles degrees;
c2w is OpenGL camera-to-world, row by row; pixels are counted from the left and the top. Cages are given by
their 8 corners, corner k = x + 2y + 4z; lattices and edits of control points by these points as well.

A drag goes: `drag_begin`, any number of `drag` (each states the whole operation since the beginning, so
the server may skip all but the newest), then `drag_end` or `drag_cancel`. The server answers with `dragged`:
how much of the operation could be followed, and where the cages then are. A page whose mouse comes to a
handle may say so before with `drag_expected`.

A page that draws with its own GPU says so with `drawing`. It is then sent the edits, as binary messages of
their own (see `server_messages.EditsHeader`), in the place of the pictures that it draws.

A page plays the camera path so: `play_begin`, then `play` with each camera on the way, then `play_end`. All
pages are told with `preview` that it began, and that it is over, also where something else has ended it.
"""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

from cagefield.edits.grade import RANGES

Vec3: TypeAlias = tuple[FiniteFloat, FiniteFloat, FiniteFloat]
Corners: TypeAlias = tuple[Vec3, Vec3, Vec3, Vec3, Vec3, Vec3, Vec3, Vec3]
Affine: TypeAlias = Annotated[list[FiniteFloat], Field(min_length=12, max_length=12)]
"""An affine map: a matrix [3,4], row by row."""
Pose: TypeAlias = Annotated[list[FiniteFloat], Field(min_length=16, max_length=16)]
Axes: TypeAlias = Literal["world", "cage"]
View: TypeAlias = Literal["color", "depth", "opacity", "normals"]
DrawnHere: TypeAlias = Literal["nothing", "moving", "all"]
ShellName: TypeAlias = Literal["flow", "trilinear"]
FalloffName: TypeAlias = Literal["smooth", "linear"]
CurveName: TypeAlias = Literal["smooth", "sphere", "root", "sharp", "linear"]
InterpolationName: TypeAlias = Literal["linear", "bspline"]
FillName: TypeAlias = Literal["surroundings", "none"]
RelightName: TypeAlias = Literal["occlusion", "shadow", "none"]
JobKind: TypeAlias = Literal["test_views", "camera_path"]
SplatForm: TypeAlias = Literal[
    "ply", "compressed.ply", "spz", "sog", "lod", "splat", "glb", "usda", "usdc", "usdz"
]
"""Format of splats; `lod` is a zip archive of a streamed SOG's folder."""
Level: TypeAlias = Literal["info", "warning", "error"]

Corner: TypeAlias = Annotated[int, Field(ge=0, le=7)]
Point: TypeAlias = Annotated[int, Field(ge=0, lt=512)]
"""Number of a control point; of a lattice, x fastest."""
Reach: TypeAlias = Annotated[float, Field(gt=0, lt=1e6)]
Text: TypeAlias = Annotated[str, Field(max_length=200)]
EditId: TypeAlias = Annotated[int, Field(ge=1)]

MAX_MESSAGE_BYTES = 1 << 20
"""Largest message that is taken from a page."""


class Message(BaseModel):
    """A message, or a part of one: no unknown keys, no changes."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    ordered: ClassVar[bool] = True
    """False for messages that newer ones may overtake: they only set the camera or display of images."""

    def redundancy_key(self) -> str | None:
        """Of the waiting messages with one key only the newest counts; None where every one does."""
        return None

    def supersedes(self) -> str | None:
        """The key of the waiting messages that are not needed any more once this one is there."""
        return self.redundancy_key()


class CameraMessage(Message):
    """Camera of the page; `moving` while the mouse turns the view."""

    type: Literal["camera"] = "camera"
    seq: Annotated[int, Field(ge=0)]
    c2w: Pose
    width: Annotated[int, Field(ge=16, le=4096)]
    height: Annotated[int, Field(ge=16, le=4096)]
    fov_y_deg: Annotated[float, Field(gt=0.1, lt=179.0)]
    moving: bool = False
    ordered: ClassVar[bool] = False

    def redundancy_key(self) -> str:
        return self.type


def _in_range(name: str) -> Any:
    low, high = RANGES[name]
    return Field(ge=low, le=high)


class GradeValues(Message):
    """All values of an edit's `Grade`."""

    exposure: Annotated[float, _in_range("exposure")]
    temperature: Annotated[float, _in_range("temperature")]
    tint: Annotated[float, _in_range("tint")]
    saturation: Annotated[float, _in_range("saturation")]
    hue_deg: Annotated[float, _in_range("hue_deg")]
    opacity: Annotated[float, _in_range("opacity")]


class Key(Message):
    """A keyframe of a camera path: a camera, and how far each edit has gone (1 where it is not named)."""

    c2w: Pose
    fov_y_deg: FiniteFloat
    seconds: FiniteFloat = 2.0
    parts: dict[int, FiniteFloat] = {}
