"""Messages from the editor's page to its server; see `common`."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, TypeAlias

from pydantic import Field, TypeAdapter

from cagefield.cameras.camera_paths import MIN_FPS
from cagefield.edits.options import LATTICE_NODES_RANGE
from cagefield.server.editor.drag_solver import Target
from cagefield.server.editor.edit_kinds import Kind
from cagefield.server.protocol.alignment_messages import AlignmentMessage
from cagefield.server.protocol.common import (
    MAX_MESSAGE_BYTES,
    CameraMessage,
    Corners,
    DrawnHere,
    EditId,
    FalloffName,
    FillName,
    GradeValues,
    JobKind,
    Key,
    Message,
    RelightName,
    ShellName,
    SplatForm,
    Text,
    View,
)
from cagefield.server.protocol.hotspot_messages import HotspotMessage
from cagefield.server.protocol.operation_messages import OperationMessage
from cagefield.server.protocol.point_messages import PointMessage
from cagefield.server.protocol.selection_messages import AttributeName, SelectionMessage


class DisplayMessage(Message):
    """Display of a view; `before` leaves the edits out, `split` left of a share of the width."""

    type: Literal["display"] = "display"
    view: View = "color"
    before: bool = False
    split: Annotated[float, Field(ge=0, le=1)] | None = None


class PresentedMessage(Message):
    """The page has shown an image, or its edits; until then the server sends at most one more."""

    type: Literal["presented"] = "presented"
    picture: int


class Drawing(Message):
    """Images that the page draws itself: none, those during motion, or all. It receives the edits instead."""

    type: Literal["drawing"] = "drawing"
    here: DrawnHere


class DragExpected(Message):
    """The mouse has come to a handle of a cage: background work waits for a moment."""

    type: Literal["drag_expected"] = "drag_expected"

    def redundancy_key(self) -> str:
        return "drag_expected"


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

    def redundancy_key(self) -> str:
        return f"drag {self.drag}"


class DragEnd(Message):
    """The drag ends with this operation, which becomes one entry of the history."""

    type: Literal["drag_end"] = "drag_end"
    drag: int
    seq: Annotated[int, Field(ge=0)]
    operation: OperationMessage

    def supersedes(self) -> str:
        return f"drag {self.drag}"


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
    ordered: ClassVar[bool] = False

    def redundancy_key(self) -> str:
        return f"play {self.play}"


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

    Without a pixel it goes around the middle of the visible surface.
    """

    type: Literal["place"] = "place"
    x: Annotated[float, Field(ge=0, le=1)] | None = None
    y: Annotated[float, Field(ge=0, le=1)] | None = None


class PasteScene(Message):
    """A new edit: all of another scene, or of a file of splats, upright on the surface amid the picture.

    The path is one of the answer to `ask` for "sources", or any other under the server's root.
    """

    type: Literal["paste_scene"] = "paste_scene"
    source: Annotated[str, Field(min_length=1, max_length=1000)]


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
    """Change an edit's options; omitted options stay."""

    type: Literal["change"] = "change"
    edit: EditId
    name: Text | None = None
    enabled: bool | None = None
    locked: bool | None = None
    kind: Kind | None = None
    shell: ShellName | None = None
    falloff: FalloffName | None = None
    width: Annotated[float, Field(gt=0, le=1)] | None = None
    fill: FillName | None = None
    relight: RelightName | None = None
    lattice: Annotated[int, Field(ge=0, le=LATTICE_NODES_RANGE[1])] | None = Field(
        default=None, description="0: exact"
    )
    parent: Annotated[int, Field(ge=0)] | None = Field(
        default=None, description="the edit that carries this one; 0: none"
    )
    grade: GradeValues | None = None


class SceneChange(Message):
    """Change options that hold for all edits."""

    type: Literal["scene_change"] = "scene_change"
    preserve_opacity: bool


class Command(Message):
    """Command with an edit's number as its only argument."""

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
    text: Annotated[str, Field(max_length=MAX_MESSAGE_BYTES)]
    append: bool = False


class Ask(Message):
    """A question: "surface" at a pixel (for focus), "edit_text" of an edit (for copying), its "grid"; "path".

    The "path" is the camera path between its keyframes, as its video goes; "sources" are the scenes and files
    that can be pasted; a "histogram" is of an `attribute` of the field's elements.
    """

    type: Literal["ask"] = "ask"
    request: int
    what: Literal["surface", "edit_text", "grid", "path", "sources", "histogram"]
    x: Annotated[float, Field(ge=0, le=1)] = 0.5
    y: Annotated[float, Field(ge=0, le=1)] = 0.5
    edit: EditId | None = None
    attribute: AttributeName = "opacity"


class SetPath(Message):
    """The camera path's keyframes; saved with the scene."""

    type: Literal["set_path"] = "set_path"
    keys: Annotated[list[Key], Field(max_length=500)]
    loop: bool = False


class RenderJob(Message):
    """Renders the test views to PNGs in a folder, or the camera path to an MP4; in the background."""

    type: Literal["render"] = "render"
    what: JobKind
    out: Annotated[str, Field(min_length=1, max_length=1000)]
    width: Annotated[int, Field(ge=16, le=4096)] = 800
    height: Annotated[int, Field(ge=16, le=4096)] = 800
    fps: Annotated[float, Field(ge=MIN_FPS, le=120)] = 24.0
    overwrite: bool = False


class ExportSplats(Message):
    """Writes the edited splats, the edits baked in, to a file to be downloaded; in the background.

    With `along_path`, those of each frame of the camera path: time samples of a USD file, else a zip archive
    of a file for each frame. Splats beyond the number `splats` are merged, those of a moment alone. Levels of
    detail (`lod`) are of a moment, too.
    """

    type: Literal["export"] = "export"
    form: SplatForm
    splats: Annotated[int, Field(ge=1, le=10**9)] | None = None
    along_path: bool = False
    fps: Annotated[float, Field(ge=MIN_FPS, le=120)] = 24.0


class ExportPage(Message):
    """Writes a page that shows the edited scene, to be downloaded; in the background.

    One HTML file; with `levels` of detail, of splats, a zip archive of a folder for a web site. Such a page
    holds at most `budget` splats at a time, if given.
    """

    type: Literal["export_page"] = "export_page"
    levels: bool = False
    budget: Annotated[int, Field(ge=1, le=10**9)] | None = None


class CancelJob(Message):
    """Stop a job and remove its unfinished file."""

    type: Literal["cancel_job"] = "cancel_job"
    job: int


PageMessage: TypeAlias = Annotated[
    CameraMessage | DisplayMessage | PresentedMessage | Drawing | DragExpected | DragBegin | DragMove
    | DragEnd | DragCancel | PlayBegin | Play | PlayEnd | Apply | SetCage | Place | PasteScene | FitInner
    | OuterMargin | Change
    | SceneChange | Command | Mirror | Reorder | GoTo | SaveAs | LoadEdits | Ask | SetPath
    | RenderJob | ExportSplats | ExportPage | CancelJob | SelectionMessage | PointMessage
    | HotspotMessage | AlignmentMessage,
    Field(discriminator="type"),
]  # fmt: skip

page_messages: TypeAdapter[PageMessage] = TypeAdapter(PageMessage)
