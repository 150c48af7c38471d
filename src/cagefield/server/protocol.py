"""What the editor's page and its server say to each other; the page's types are made from this file.

One WebSocket per page carries text messages, one JSON object each, with a `type`; and, from server to page,
pictures as binary messages (see `PictureHeader`). Lengths are world units, angles degrees; c2w is OpenGL
camera-to-world, row by row; pixels are counted from the left and the top. Cages are given by their 8
corners, corner k = x + 2y + 4z.

A drag goes: `drag_begin`, any number of `drag` (each states the whole operation since the beginning, so
the server may skip all but the newest), then `drag_end` or `drag_cancel`. The server answers with `dragged`:
how much of the operation could be followed, and where the cages then are.

A page plays the camera path so: `play_begin`, then `play` with each camera on the way, then `play_end`. All
pages are told with `preview` that it began, and that it is over, also where something else has ended it.
"""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, TypeAdapter

Vec3: TypeAlias = tuple[FiniteFloat, FiniteFloat, FiniteFloat]
Corners: TypeAlias = tuple[Vec3, Vec3, Vec3, Vec3, Vec3, Vec3, Vec3, Vec3]
Pose: TypeAlias = Annotated[list[FiniteFloat], Field(min_length=16, max_length=16)]
Axes: TypeAlias = Literal["world", "cage"]
View: TypeAlias = Literal["colour", "depth", "opacity", "normals"]
Kind: TypeAlias = Literal["continuous", "move", "copy", "delete"]
Target: TypeAlias = Literal["field", "inner", "outer", "both"]
"""What a drag moves: "field" the inner cage with the field (Edit mode); the others cages alone (Set mode).

"both" turns and scales both cages about the inner cage's pivot.
"""

Corner: TypeAlias = Annotated[int, Field(ge=0, le=7)]
Text: TypeAlias = Annotated[str, Field(max_length=200)]
EditId: TypeAlias = Annotated[int, Field(ge=1)]

MOST_BYTES = 1 << 20
"""Largest message that is taken from a page."""


class Message(BaseModel):
    """A message, or a part of one: no unknown keys, no changes."""

    model_config = ConfigDict(extra="forbid", frozen=True)


# ---- operations ------------------------------------------------------------------------------------------


class TranslateBy(Message):
    """Move the cage."""

    kind: Literal["translate"] = "translate"
    by: Vec3


class RotateBy(Message):
    """Turn the cage about its pivot by R_x R_y R_z, intrinsic XYZ, in degrees."""

    kind: Literal["rotate"] = "rotate"
    rotation_deg: Vec3
    axes: Axes = "world"


class ScaleBy(Message):
    """Scale the cage about its pivot; factors above 0."""

    kind: Literal["scale"] = "scale"
    by: tuple[
        Annotated[float, Field(gt=0, lt=1e6)],
        Annotated[float, Field(gt=0, lt=1e6)],
        Annotated[float, Field(gt=0, lt=1e6)],
    ]
    axes: Axes = "world"


class ShearBy(Message):
    """Shear the cage about its pivot: xy adds xy * y to x, and so on."""

    kind: Literal["shear"] = "shear"
    xy: FiniteFloat = 0.0
    xz: FiniteFloat = 0.0
    yx: FiniteFloat = 0.0
    yz: FiniteFloat = 0.0
    zx: FiniteFloat = 0.0
    zy: FiniteFloat = 0.0
    axes: Axes = "world"


class MoveCornersBy(Message):
    """Move one corner, the two of an edge, the four of a face, or any others together."""

    kind: Literal["move_corners"] = "move_corners"
    corners: Annotated[list[Corner], Field(min_length=1, max_length=8)]
    by: Vec3


OperationMessage: TypeAlias = Annotated[
    TranslateBy | RotateBy | ScaleBy | ShearBy | MoveCornersBy, Field(discriminator="kind")
]


# ---- page to server --------------------------------------------------------------------------------------


class CameraMessage(Message):
    """What the page looks from; `moving` while the mouse turns the view."""

    type: Literal["camera"] = "camera"
    seq: Annotated[int, Field(ge=0)]
    c2w: Pose
    width: Annotated[int, Field(ge=16, le=4096)]
    height: Annotated[int, Field(ge=16, le=4096)]
    fov_y_deg: Annotated[float, Field(gt=0.1, lt=179.0)]
    moving: bool = False


class LookMessage(Message):
    """What is shown: a view; `before` leaves the edits out, `split` left of a share of the width."""

    type: Literal["look"] = "look"
    view: View = "colour"
    before: bool = False
    split: Annotated[float, Field(ge=0, le=1)] | None = None


class PresentedMessage(Message):
    """The page has shown a picture; until then the server sends at most one more."""

    type: Literal["presented"] = "presented"
    picture: int


class DragBegin(Message):
    """A drag of an edit's cages begins."""

    type: Literal["drag_begin"] = "drag_begin"
    drag: Annotated[int, Field(ge=1)]
    edit: EditId
    target: Target


class DragMove(Message):
    """Where the drag is: the whole operation since its beginning."""

    type: Literal["drag"] = "drag"
    drag: int
    seq: Annotated[int, Field(ge=0)]
    operation: OperationMessage


class DragEnd(Message):
    """The drag ends with this operation, which becomes one entry of the history."""

    type: Literal["drag_end"] = "drag_end"
    drag: int
    seq: Annotated[int, Field(ge=0)]
    operation: OperationMessage


class DragCancel(Message):
    """The drag is given up: everything as before it."""

    type: Literal["drag_cancel"] = "drag_cancel"
    drag: int


class PlayBegin(Message):
    """The page plays the camera path: pictures show the edits as its video will, at its beginning first."""

    type: Literal["play_begin"] = "play_begin"
    play: Annotated[int, Field(ge=1)]


class Play(Message):
    """Where on the path the page is; passed over where that preview is over."""

    type: Literal["play"] = "play"
    play: int
    seconds: Annotated[float, Field(ge=0, le=1e7)]


class PlayEnd(Message):
    """The page plays no more: pictures show the edits as they are."""

    type: Literal["play_end"] = "play_end"
    play: int


class Apply(Message):
    """A whole operation at once, from numeric fields."""

    type: Literal["apply"] = "apply"
    edit: EditId
    target: Target
    operation: OperationMessage


class SetCage(Message):
    """A cage's corners by number, in Set mode: nothing of the field moves."""

    type: Literal["set_cage"] = "set_cage"
    edit: EditId
    cage: Literal["inner", "outer"]
    corners: Corners


class Place(Message):
    """A new edit: a cage pair around the surface seen at a pixel (x, y in [0,1] of the camera's picture).

    Without a pixel it goes around the middle of what the camera sees.
    """

    type: Literal["place"] = "place"
    x: Annotated[float, Field(ge=0, le=1)] | None = None
    y: Annotated[float, Field(ge=0, le=1)] | None = None


class FitInner(Message):
    """Shrinks the inner cage to the dense region inside it."""

    type: Literal["fit_inner"] = "fit_inner"
    edit: EditId


class OuterMargin(Message):
    """Makes the outer cage a margin around everything the inner cage is and was."""

    type: Literal["outer_margin"] = "outer_margin"
    edit: EditId
    margin: Annotated[float, Field(gt=0, lt=1e6)]


class Change(Message):
    """Changes an edit's options; what is left out stays."""

    type: Literal["change"] = "change"
    edit: EditId
    name: Text | None = None
    enabled: bool | None = None
    locked: bool | None = None
    kind: Kind | None = None
    shell: Literal["flow", "trilinear"] | None = None
    falloff: Literal["smooth", "linear"] | None = None
    width: Annotated[float, Field(gt=0, le=1)] | None = None
    lattice: Annotated[int, Field(ge=0, le=512)] | None = Field(default=None, description="0: exact")


class SceneChange(Message):
    """Changes what holds for all edits."""

    type: Literal["scene_change"] = "scene_change"
    preserve_opacity: bool


class Command(Message):
    """What has no more than an edit to say."""

    type: Literal["command"] = "command"
    name: Literal[
        "undo", "redo", "save", "duplicate", "remove", "select", "reset_operations", "remove_last_operation"
    ]
    edit: EditId | None = None


class Mirror(Message):
    """A mirrored copy of an edit's cages and operations, across the plane through the scene's middle."""

    type: Literal["mirror"] = "mirror"
    edit: EditId
    axis: Literal["x", "y", "z"]


class Reorder(Message):
    """Puts an edit at another place in the stack, 0 first."""

    type: Literal["reorder"] = "reorder"
    edit: EditId
    to: Annotated[int, Field(ge=0)]


class GoTo(Message):
    """Goes to an entry of the history, 0 the beginning."""

    type: Literal["go_to"] = "go_to"
    entry: Annotated[int, Field(ge=0)]


class SaveAs(Message):
    """Saves the scene, edits included, as a new folder on the server's machine."""

    type: Literal["save_as"] = "save_as"
    path: Annotated[str, Field(min_length=1, max_length=1000)]
    overwrite: bool = False


class LoadEdits(Message):
    """An edit file's text: replaces the stack, or (paste) is appended to it."""

    type: Literal["load_edits"] = "load_edits"
    text: Annotated[str, Field(max_length=MOST_BYTES)]
    append: bool = False


class Ask(Message):
    """A question: "surface" at a pixel (for focus), "edit_text" of an edit (for copying), its "grid"; "path".

    The "path" is the camera path between its keyframes, as its video goes.
    """

    type: Literal["ask"] = "ask"
    request: int
    what: Literal["surface", "edit_text", "grid", "path"]
    x: Annotated[float, Field(ge=0, le=1)] = 0.5
    y: Annotated[float, Field(ge=0, le=1)] = 0.5
    edit: EditId | None = None


class Key(Message):
    """A keyframe of a camera path: a camera, and how far each edit has gone (1 where it is not named)."""

    c2w: Pose
    fov_y_deg: Annotated[float, Field(gt=0.1, lt=179.0)]
    seconds: Annotated[float, Field(gt=0, le=3600)] = 2.0
    parts: dict[EditId, Annotated[float, Field(ge=0, le=1)]] = {}


class SetPath(Message):
    """The camera path's keyframes; saved with the scene."""

    type: Literal["set_path"] = "set_path"
    keys: Annotated[list[Key], Field(max_length=500)]
    loop: bool = False


class RenderJob(Message):
    """Renders the test views to PNGs in a folder, or the camera path to an MP4; in the background."""

    type: Literal["render"] = "render"
    what: Literal["test_views", "camera_path"]
    out: Annotated[str, Field(min_length=1, max_length=1000)]
    width: Annotated[int, Field(ge=16, le=4096)] = 800
    height: Annotated[int, Field(ge=16, le=4096)] = 800
    fps: Annotated[float, Field(gt=0, le=120)] = 24.0
    overwrite: bool = False


class CancelJob(Message):
    """Stops a job; what it wrote of its file is removed."""

    type: Literal["cancel_job"] = "cancel_job"
    job: int


PageMessage: TypeAlias = Annotated[
    CameraMessage | LookMessage | PresentedMessage | DragBegin | DragMove | DragEnd | DragCancel | PlayBegin
    | Play | PlayEnd | Apply | SetCage | Place | FitInner | OuterMargin | Change | SceneChange | Command
    | Mirror | Reorder | GoTo | SaveAs | LoadEdits | Ask | SetPath | RenderJob | CancelJob,
    Field(discriminator="type"),
]  # fmt: skip

page_messages: TypeAdapter[PageMessage] = TypeAdapter(PageMessage)


# ---- server to page --------------------------------------------------------------------------------------


class Hello(Message):
    """The first message: what is being edited. `page` names this page among those that are open."""

    type: Literal["hello"] = "hello"
    version: str
    page: int
    name: str
    bounds: tuple[Vec3, Vec3]
    voxel: float
    up: Vec3
    start: CameraMessage
    cameras: list[Pose]
    """Test cameras, or the training ones, to jump to."""


class EditState(Message):
    """One edit as pages show it; corners in world units, deformed: the inner cage after its operations."""

    id: EditId
    name: str
    colour: str
    enabled: bool
    locked: bool
    kind: Kind
    shell: Literal["flow", "trilinear"]
    falloff: Literal["smooth", "linear"]
    width: float
    lattice: int
    """Nodes along an axis, 0 where it is exact."""
    lattice_error: tuple[float, float] | None
    """(max, mean) in voxels, once measured."""
    inner: Corners
    deformed: Corners
    outer: Corners | None
    pivot: Vec3
    inner_pivot: Vec3
    outer_pivot: Vec3 | None
    operations: list[str]
    problem: str | None
    """Why the edit cannot be shown, in a sentence with its cure; it is left out of the picture until then."""


class State(Message):
    """Everything that pages show of the edits; sent to all pages after each change."""

    type: Literal["state"] = "state"
    revision: int
    pictured: int
    """The first revision whose picture is that of this one."""
    edits: list[EditState]
    selected: EditId | None
    history: list[str]
    """What was done, oldest first; entry 0 is the beginning."""
    entry: int
    """Where in the history we are; entries after it can be redone."""
    saved: bool
    path: str
    preserve_opacity: bool
    keys: list[Key]
    loop: bool


class Dragged(Message):
    """What became of a `drag`: `part` of the operation was followed; `why` where that is less than all."""

    type: Literal["dragged"] = "dragged"
    drag: int
    seq: int
    part: float
    why: str | None
    inner: Corners
    deformed: Corners
    outer: Corners | None


class Still(Message):
    """A camera on the camera path."""

    c2w: Pose
    fov_y_deg: float


class Answer(Message):
    """The answer to an `ask`: a point and its normal, a text, a grid, or the path; or nothing."""

    type: Literal["answer"] = "answer"
    request: int
    point: Vec3 | None = None
    normal: Vec3 | None = None
    text: str | None = None
    grid: list[list[Vec3]] = []
    """Polylines of a regular grid through the shell, as the edit bends them; the outer cage's frame."""
    stills: list[Still] = []
    """The path's cameras, evenly spread over its time, from its beginning to its end."""
    failed: bool = False
    """True where it could not be found out; a notice says why."""


class Notice(Message):
    """A line for the user."""

    type: Literal["notice"] = "notice"
    level: Literal["info", "warning", "error"]
    text: str


class Preview(Message):
    """A page's preview of the camera path has begun, or is over; `play` is that page's number for it."""

    type: Literal["preview"] = "preview"
    page: int
    play: int
    on: bool


class Preparing(Message):
    """How much of the renderer is ready: what a machine's first run compiles, later ones load."""

    type: Literal["preparing"] = "preparing"
    done: int
    of: int


class Job(Message):
    """How far a background job is."""

    type: Literal["job"] = "job"
    job: int
    what: Literal["test_views", "camera_path"]
    state: Literal["running", "done", "cancelled", "failed"]
    done: int
    total: int
    out: str
    text: str = ""


ServerMessage: TypeAlias = Annotated[
    Hello | State | Dragged | Answer | Notice | Preview | Preparing | Job, Field(discriminator="type")
]


class PictureHeader(Message):
    """Heads a binary message: uint32 (little endian) length of this JSON, the JSON, the picture, the depth.

    The picture is a JPEG of `width` x `height` or, where it is small, its RGB bytes row by row: the part at
    (x, y) of a picture of full_width x full_height that covers the page's view; smaller ones are stretched.
    `depth_bytes` of
    uint16 (little endian, row by row, depth_width x depth_height, over the same part) follow it:
    distance along the ray = value * depth_scale, 65535 where there is nothing.
    """

    type: Literal["picture"] = "picture"
    picture: int
    camera: int
    """`seq` of the camera that it shows."""
    drag: int
    seq: int
    """The drag, and its newest `seq`, that it shows; 0, 0 where none goes on."""
    revision: int
    view: View
    before: bool
    split: float | None
    x: int
    y: int
    width: int
    height: int
    full_width: int
    full_height: int
    final: bool
    """True for the last part of a full-resolution picture."""
    format: Literal["jpeg", "rgb"]
    picture_bytes: int
    depth_bytes: int
    depth_width: int
    depth_height: int
    depth_scale: float
    render_ms: float
    """Time in the renderer, map and occupancy included."""
    encode_ms: float
