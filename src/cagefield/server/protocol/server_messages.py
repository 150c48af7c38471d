"""Messages from the editor's server to its pages; see `common`."""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

from pydantic import Field

from cagefield.server.editor.edit_kinds import Kind
from cagefield.server.protocol.common import (
    Affine,
    CameraMessage,
    Corners,
    CurveName,
    EditId,
    FalloffName,
    FillName,
    GradeValues,
    InterpolationName,
    JobKind,
    Key,
    Level,
    Message,
    Pose,
    RelightName,
    ShellName,
    Vec3,
    View,
)
from cagefield.server.protocol.hotspot_messages import HotspotCamera, HotspotId


class Hello(Message):
    """First message, with the edited scene. `page` identifies this page among the open ones."""

    type: Literal["hello"] = "hello"
    version: str
    page: int
    scene: str
    """Another one where another scene or file is opened in the place of this one."""
    field: str
    """Identifier of the scene's field: a page that has loaded this field need not load it again."""
    name: str
    splats: bool
    """True where the field is of splats, which can be downloaded."""
    bounds: tuple[Vec3, Vec3]
    voxel: float
    up: Vec3
    """Up direction of the cameras."""
    start: CameraMessage
    cameras: list[Pose]
    """Test cameras, or the training ones, to jump to."""
    read_only: bool = False
    """True where the page may look and not change anything: its link is one for that."""


class PointsState(Message):
    """Control points of an edit's inner cage, world units: of a lattice, or on their own with a radius."""

    canonical: list[Vec3]
    deformed: list[Vec3]
    shape: tuple[int, int, int] | None
    """Points of a lattice along x, y and z, numbered x fastest; None for others."""
    edges: list[tuple[int, int]] | None
    """Edges of a mesh, each by its two vertices; None for others."""
    interpolation: InterpolationName | None
    radius: float | None
    """Reach of points on their own, before scaling."""
    falloff: CurveName | None
    connected: bool
    """True of points on their own that reach through dense matter alone."""


class EditState(Message):
    """One edit as pages show it; corners in world units, deformed: the inner cage after its operations."""

    id: EditId
    name: str
    color: str
    enabled: bool
    locked: bool
    kind: Kind
    source: str | None
    """Of a paste, the scene folder or file that it comes from; its inner cage is where it stands."""
    shell: ShellName
    falloff: FalloffName
    width: float
    fill: FillName
    relight: RelightName
    lattice: int
    """Nodes along an axis from which pictures take the map, 0 where they evaluate it exactly."""
    lattice_error: tuple[float, float] | None
    """(max, mean) in voxels, once measured."""
    inner: Corners
    deformed: Corners
    outer: Corners | None
    cage: Literal["box", "lattice", "points", "mesh"]
    """Kind of the inner cage; corners of the last three are those of a box around them."""
    points: PointsState | None
    """Control points of a lattice, points on their own, or the vertices of a mesh."""
    outer_follows: bool
    """True where the outer cage is made anew with the operations, and confines none."""
    pivot: Vec3
    inner_pivot: Vec3
    outer_pivot: Vec3 | None
    operations: list[str]
    grade: GradeValues
    parent: EditId | None
    """The edit that carries this one."""
    carrier: Affine | None
    """Map of the cages above, which are at rest, to where the parents carry them; None where they stay."""
    problem: str | None
    """Why the edit cannot be shown, in a sentence with its cure; it is left out of the picture until then."""


class SelectionCount(Message):
    """Number of selected elements of the field, splats or cells of a grid, and of all."""

    count: int
    total: int


class HotspotState(Message):
    """A hotspot: its number, texts, position in deformed space, and the camera to look from, if any.

    `follows`: the edits carry it along; `hidden`: they have deleted or covered its place.
    """

    id: HotspotId
    title: str
    text: str
    position: Vec3
    camera: HotspotCamera | None
    follows: bool
    hidden: bool


class State(Message):
    """Everything that pages show of the edits; sent to all pages after each change."""

    type: Literal["state"] = "state"
    revision: int
    pictured: int
    """The first revision whose picture is that of this one."""
    edits: list[EditState]
    selected: EditId | None
    history: list[str]
    """Labels of the history, oldest first; entry 0 is the initial state."""
    entry: int
    """Where in the history we are; entries after it can be redone."""
    saved: bool
    path: str
    """The scene's folder; of a file that was opened, the one to suggest."""
    is_file: bool
    """True for a file that was opened: there is no folder to save into before one is chosen."""
    preserve_opacity: bool
    meters_per_unit: float | None
    up: Vec3 | None
    """Direction that is up; None for that of `Hello`."""
    keys: list[Key]
    loop: bool
    hotspots: list[HotspotState]
    selection: SelectionCount | None
    """Selected elements of the field; None for none."""
    removed: SelectionCount | None
    """Deleted elements of the field; None for none."""
    isolated: bool
    """True where pictures show isolated elements alone."""

    def redundancy_key(self) -> str:
        return self.type


class Carried(Message):
    """Map of an edit's cages to where its parents carry them during a drag; see `EditState.carrier`."""

    edit: EditId
    carrier: Affine | None


class Dragged(Message):
    """Result of a `drag`: `part` of the operation was followed; `why` where `part` is below 1."""

    type: Literal["dragged"] = "dragged"
    drag: int
    seq: int
    part: float
    why: str | None
    inner: Corners
    deformed: Corners
    outer: Corners | None
    points: list[Vec3]
    """Control points of the inner cage, where it has them."""
    deformed_points: list[Vec3]
    carried: list[Carried]
    """The edits that the dragged one carries."""

    def redundancy_key(self) -> str:
        return self.type


class DragOver(Message):
    """The page's drag was given up, by a step of the history or the removal of its edit; a notice says so."""

    type: Literal["drag_over"] = "drag_over"
    drag: int


class Still(Message):
    """A camera on the camera path."""

    c2w: Pose
    fov_y_deg: float


class HotspotTrack(Message):
    """Positions of a hotspot, deformed space, at even times of the camera path; null where it is hidden."""

    hotspot: HotspotId
    places: list[Vec3 | None]


class HistogramCounts(Message):
    """Counts of an attribute's values in even bins between two ends; of sizes, even in their logarithm."""

    low: float
    high: float
    counts: list[int]
    selected: list[int]


class Answer(Message):
    """The answer to an `ask`: a point and its normal, a text, a grid, the path, sources, or a histogram; or
    nothing.
    """

    type: Literal["answer"] = "answer"
    request: int
    point: Vec3 | None = None
    normal: Vec3 | None = None
    text: str | None = None
    grid: list[list[Vec3]] = Field(default_factory=list)
    """Polylines of a regular grid through the shell, as the edit bends them; the outer cage's frame."""
    stills: list[Still] = Field(default_factory=list)
    """The path's cameras, evenly spread over its time, from its beginning to its end."""
    tracks: list[HotspotTrack] = Field(default_factory=list)
    """Of the path, those of hotspots that its edits carry along."""
    sources: list[str] = Field(default_factory=list)
    """Scene folders and files of splats under the server's root that can be pasted."""
    histogram: HistogramCounts | None = None
    failed: bool = False
    """True where it could not be found out; a notice says why."""


class Notice(Message):
    """A line for the user."""

    type: Literal["notice"] = "notice"
    level: Level
    text: str


class Preview(Message):
    """A page's preview of the camera path has begun, or is over; `play` is that page's number for it."""

    type: Literal["preview"] = "preview"
    page: int
    play: int
    on: bool


class Preparing(Message):
    """Progress of the renderer's kernels: compiled by a machine's first run, loaded by later ones."""

    type: Literal["preparing"] = "preparing"
    done: int
    of: int


class Job(Message):
    """How far a background job is; of one whose file is to be downloaded, `page` asked for it."""

    type: Literal["job"] = "job"
    job: int
    page: int = 0
    what: JobKind | Literal["splats", "page"]
    state: Literal["running", "done", "cancelled", "failed"]
    done: int
    total: int
    out: str
    text: str = ""

    def redundancy_key(self) -> str:
        return f"job {self.job}"


ServerMessage: TypeAlias = Annotated[
    Hello | State | Dragged | DragOver | Answer | Notice | Preview | Preparing | Job,
    Field(discriminator="type"),
]


class PictureHeader(Message):
    """Heads a binary message: uint32 (little endian) length of this JSON, the JSON, the picture, the depth.

    The picture is a JPEG of `width` x `height` or, where it is small, its RGB bytes row by row: the part at
    (x, y) of a picture of full_width x full_height that covers the page's view; smaller ones are stretched.
    `depth_bytes` of uint16 (little endian, row by row, depth_width x depth_height, over the same part) follow
    it: distance along the ray = value * depth_scale, 65535 where there is nothing.
    """

    type: Literal["picture"] = "picture"
    picture: int
    camera: int
    """`seq` of the camera that it shows."""
    drag: int
    seq: int
    """The drag, and its newest `seq`, that it shows; 0, 0 where no drag is in progress."""
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
    whole: bool
    """True for the last part of a full-resolution picture."""
    refinement: int
    """Refinement that it has (`render_worker.refinement`), 3 the final one."""
    final: bool
    """True where it is whole and nothing refines it."""
    format: Literal["jpeg", "rgb"]
    picture_bytes: int
    depth_bytes: int
    depth_width: int
    depth_height: int
    depth_scale: float
    render_ms: float
    """Time in the renderer, map and occupancy included."""
    encode_ms: float


class EditsHeader(Message):
    """Heads a binary message to a page that draws itself as PictureHeader does; a file of the edits follows.

    The file is one of `cagefield.pages.page_edits`, without parts that were sent before, or of
    `cagefield.pages.page_splat_edits`; it is empty where the edits cannot be drawn by a page, and `why`
    says why. The page answers `presented` when it shows them.
    """

    type: Literal["edits"] = "edits"
    picture: int
    drag: int
    seq: int
    revision: int
    final: bool
    """True for the edits' own lattices, false for those of a drag."""
    why: str | None
    map_ms: float
    encode_ms: float


class HighlightHeader(Message):
    """Heads a binary message with positions at which selected elements are seen, after each change of them.

    `count` positions follow the header, each as uint16 (little endian) x, y, z: 0 at `low`, 65535 at `high`.
    """

    type: Literal["highlight"] = "highlight"
    count: int
    low: Vec3
    high: Vec3
    size: float
    """Edge of the square that shows an element, world units."""
