"""Tasks of the rendering process and their results, as plain picklable values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from enum import Enum
from typing import Any, Literal, TypeAlias

from cagefield.cameras.camera import Camera
from cagefield.cameras.keyframes import Still
from cagefield.edits import Edit
from cagefield.geometry.cage import Cage
from cagefield.geometry.control_points import ControlPoints
from cagefield.selection.element_selection import Selection
from cagefield.selection.elements import Attribute
from cagefield.selection.selection_cages import CageShape
from cagefield.server.render_worker.picks import Pick
from cagefield.server.render_worker.refinement import Refinement
from cagefield.server.render_worker.view import Display, Region


class WarmStage(Enum):
    """Steps in which the kernels of edited pictures are made ready, soonest needed first."""

    COARSE_EDIT = "coarse edit"
    PICTURE = "picture"
    EXACT_EDIT = "exact edit"
    DELETION = "deletion"
    LIGHT = "light"
    BENT_CAGE = "bent cage"

    @property
    def is_for_moving(self) -> bool:
        """Whether a drag's pictures need it before they need light."""
        return self not in (WarmStage.LIGHT, WarmStage.BENT_CAGE)


@dataclass(frozen=True)
class EditValues:
    """Kind and fields of an edit, without the results that the edit caches."""

    kind: type[Edit]
    fields: Mapping[str, Any]

    @classmethod
    def from_edit(cls, edit: Edit) -> EditValues:
        """Values of an edit."""
        return cls(type(edit), {each.name: getattr(edit, each.name) for each in fields(edit)})

    def edit(self) -> Edit:
        """Edit of these values."""
        return self.kind(**self.fields)


def values_of(edits: tuple[Edit, ...]) -> tuple[EditValues, ...]:
    """Values of edits, which a task carries to the rendering process."""
    return tuple(EditValues.from_edit(edit) for edit in edits)


@dataclass(frozen=True)
class Shown:
    """Content of an image: edits (see `values_of`), the scene's opacity choice, elements that are shown.

    With `isolated` elements the field has no others, and edits show no patches and no pastes. The field has
    none of the `removed` elements.
    """

    edits: tuple[EditValues, ...]
    preserve_opacity: bool = True
    isolated: Selection | None = None
    removed: Selection | None = None


@dataclass(frozen=True)
class PictureTask:
    """A part of a picture; abandoned once the shared generation is past `generation`."""

    number: int
    shown: Shown
    camera: Camera
    """Of the size of the whole picture that `region` is a part of."""
    region: Region
    display: Display
    moving: bool
    refinement: Refinement
    generation: int


@dataclass(frozen=True)
class StillTask:
    """A whole picture as a PNG; abandoned as a picture is."""

    number: int
    shown: Shown
    camera: Camera
    display: Display
    generation: int


@dataclass(frozen=True)
class SurfaceTask:
    """The surface seen at a pixel (x, y in [0,1])."""

    number: int
    shown: Shown
    camera: Camera
    x: float
    y: float


@dataclass(frozen=True)
class FitTask:
    """The part of a cage that holds something dense, under the edits below it.

    Where a `source` is given the cage is in that scene.
    """

    number: int
    shown: Shown
    cage: Cage
    source: str | None = None


@dataclass(frozen=True)
class LookTask:
    """Query of the content to paste, a scene or a file: its box and its up direction."""

    number: int
    source: str


@dataclass(frozen=True)
class FloorTask:
    """Query of the dominant plane of the field's visible surfaces; `up` [3] is the direction up so far."""

    number: int
    up: tuple[float, float, float]
    removed: Selection | None = None


@dataclass(frozen=True)
class AlignTask:
    """Alignment of a paste with the field: points [N,3] of its source, and those where they belong."""

    number: int
    edit: EditValues
    source_points: Sequence[Sequence[float]]
    points: Sequence[Sequence[float]]
    refine: bool
    keep_scale: bool
    match_colors: bool
    removed: Selection | None = None


@dataclass(frozen=True)
class WarmTask:
    """One of the renderer's kernels is to be made ready, so that no drag has to wait for it."""

    number: int
    stage: WarmStage


@dataclass(frozen=True)
class LightTask:
    """Light to be known before an edit needs it: of the field, and around the last of the edits shown.

    Abandoned with its generation.
    """

    number: int
    generation: int
    shown: Shown = Shown(())


@dataclass(frozen=True)
class ErrorTask:
    """How far an edit's lattice is from its exact map; given up when its generation is over.

    Connected control points are those on the field under the edits `below`.
    """

    number: int
    edit: EditValues
    generation: int
    below: Shown = Shown(())


@dataclass(frozen=True)
class GridTask:
    """Lines of a regular grid through an edit's shell, as the edit bends them; `below` as in `ErrorTask`."""

    number: int
    edit: EditValues
    below: Shown = Shown(())


@dataclass(frozen=True)
class DetoursTask:
    """Detours of connected control points on the field under the edits `below` (`geometry.detour_grid`).

    Abandoned once the shared generation is past `generation`.
    """

    number: int
    points: ControlPoints
    below: Shown
    generation: int


@dataclass(frozen=True)
class FrameTask:
    """One picture of a job: the still, its place, and the edits as they are there."""

    number: int
    job: int
    index: int
    total: int
    what: Literal["test_views", "camera_path"]
    out: str
    fps: float
    shown: Shown
    still: Still
    generation: int


@dataclass(frozen=True)
class EndJobTask:
    """A job's end: its files are finished or, with `keep` False, removed."""

    number: int
    job: int
    keep: bool


@dataclass(frozen=True)
class PageFieldTask:
    """The field as a file that a page's GPU draws."""

    number: int


@dataclass(frozen=True)
class PageEditsTask:
    """Edits as a page's GPU draws them, of voxels without the layers that the page `has` (see
    `pages.page_edits`).

    Abandoned once the shared generation is past `generation`.
    """

    number: int
    shown: Shown
    refinement: Refinement
    has: tuple[str, ...]
    generation: int


@dataclass(frozen=True)
class PickTask:
    """Selection of the picked elements."""

    number: int
    shown: Shown
    pick: Pick


@dataclass(frozen=True)
class HistogramTask:
    """Histogram of an attribute, with the selected elements."""

    number: int
    attribute: Attribute
    selection: Selection | None


@dataclass(frozen=True)
class BoxTask:
    """Cage of a shape around the selected elements as edits show them; `margin` in cells."""

    number: int
    shown: Shown
    selection: Selection
    margin: float
    shape: CageShape = "box"


@dataclass(frozen=True)
class HighlightTask:
    """Positions at which the selected elements are seen; abandoned with its generation."""

    number: int
    shown: Shown
    selection: Selection
    generation: int


SelectionTask: TypeAlias = PickTask | HistogramTask | BoxTask | HighlightTask

Task: TypeAlias = (
    PictureTask
    | StillTask
    | SurfaceTask
    | FitTask
    | LookTask
    | FloorTask
    | AlignTask
    | WarmTask
    | LightTask
    | ErrorTask
    | GridTask
    | DetoursTask
    | FrameTask
    | EndJobTask
    | PageFieldTask
    | PageEditsTask
    | SelectionTask
)

BACKGROUND_TASKS = (LightTask, ErrorTask, DetoursTask, FrameTask)
"""Tasks that may wait while a drag is expected: no page shows their results at once."""


@dataclass(frozen=True)
class Ready:
    """The rendering process has loaded its scene."""

    number: int = 0


@dataclass(frozen=True)
class Replaced:
    """The scene's folder holds another scene than the one that is edited, of which pictures stay."""

    number: int = 0


@dataclass(frozen=True)
class PictureDone:
    """A rendered part: encoded picture and depths (see `server_messages.PictureHeader`)."""

    number: int
    picture: bytes
    format: Literal["jpeg", "rgb"]
    depth: bytes
    refinement: Refinement
    """The last one that the picture has: at least the one asked for."""
    depth_size: tuple[int, int]
    depth_scale: float
    map_seconds: float
    render_seconds: float
    """Map included."""
    encode_seconds: float


@dataclass(frozen=True)
class EditsDone:
    """Edits as a file, and the keys of all that a page has that has read it."""

    number: int
    content: bytes
    keys: tuple[str, ...]
    refinement: Refinement
    """The last one that they have."""
    map_seconds: float
    encode_seconds: float


@dataclass(frozen=True)
class Stopped:
    """The task was abandoned."""

    number: int


@dataclass(frozen=True)
class Failed:
    """Failure of a task; `text` has the reason and the cure."""

    number: int
    text: str


@dataclass(frozen=True)
class Answered:
    """Result of a query; None where nothing was found."""

    number: int
    value: Any = field(default=None)


Result: TypeAlias = Ready | Replaced | PictureDone | EditsDone | Stopped | Failed | Answered
