"""Messages about selected elements of the field, from pages; see `cagefield.selection`.

Points are shares of the page's picture, (0, 0) its upper left corner. A message picks elements,
and its `mode` says how they join those selected before. The new selection is an
entry of the history, shared by all pages.
"""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

from pydantic import Field, FiniteFloat

from cagefield.selection.brush_and_lasso import MAX_REGION_POINTS, MAX_SHARE
from cagefield.server.protocol.common import Message

CageShape: TypeAlias = Literal["box", "lattice", "mesh"]
ModeName: TypeAlias = Literal["replace", "add", "subtract", "intersect"]
AttributeName: TypeAlias = Literal["size", "opacity", "red", "green", "blue", "hue", "saturation", "value"]
Share: TypeAlias = Annotated[float, Field(ge=0, le=1)]
Coordinate: TypeAlias = Annotated[float, Field(ge=-MAX_SHARE, le=MAX_SHARE)]


class SelectRegion(Message):
    """Picks elements in a region of the picture.

    The points are two opposite corners of a rectangle, the vertices of a lasso, or those of a brush stroke.
    """

    type: Literal["select_region"] = "select_region"
    shape: Literal["rectangle", "lasso", "brush"]
    points: Annotated[list[tuple[Coordinate, Coordinate]], Field(min_length=1, max_length=MAX_REGION_POINTS)]
    radius: Annotated[float, Field(gt=0, le=1)] = 0.03
    """Of a brush, a share of the picture's height."""
    mode: ModeName = "replace"
    through: bool = False
    """Picks all that is behind the region, not the visible surface alone."""
    tolerance: Annotated[float, Field(ge=0, le=1000)] = 1.5
    """Depth behind the visible surface up to which elements are picked, cells of the occupancy grid."""


class SelectRange(Message):
    """Picks elements by the range of an attribute."""

    type: Literal["select_range"] = "select_range"
    attribute: AttributeName
    low: FiniteFloat
    high: FiniteFloat
    mode: ModeName = "replace"


class SelectFlood(Message):
    """Picks the elements connected to the surface at a pixel by cells of some opacity."""

    type: Literal["select_flood"] = "select_flood"
    x: Share
    y: Share
    threshold: Annotated[float, Field(gt=0, le=1)] = 0.3
    reach: Annotated[float, Field(gt=0, le=1)] = 1.0
    """Bound of the distance from the surface, a share of the diagonal of the field's box; 1 for none."""
    mode: ModeName = "replace"


class SelectFloaters(Message):
    """Picks probable floaters, few at strength 0 and many at 1."""

    type: Literal["select_floaters"] = "select_floaters"
    strength: Share = 0.5
    mode: ModeName = "replace"


class ChangeSelection(Message):
    """Selects all or none, inverts the selection, or grows or shrinks it by a cell."""

    type: Literal["change_selection"] = "change_selection"
    change: Literal["all", "none", "invert", "grow", "shrink"]


class SelectionCage(Message):
    """A new edit with an inner cage around the selected elements as they are seen.

    A "box" is oriented, a "lattice" that box divided into cells near to cubes, a "mesh" closed and decimated.
    """

    type: Literal["selection_cage"] = "selection_cage"
    cage: CageShape = "box"
    margin: Annotated[float, Field(ge=0, le=100)] = 1.0
    """Distance from the elements to the cage, cells of the occupancy grid."""


class Isolate(Message):
    """Shows the selected elements alone, on all pages, or all again."""

    type: Literal["isolate"] = "isolate"
    on: bool


class RemoveElements(Message):
    """Deletes the selected elements from the field, or restores all that were deleted."""

    type: Literal["remove_elements"] = "remove_elements"
    restore: bool = False


SelectionMessage: TypeAlias = (
    SelectRegion
    | SelectRange
    | SelectFlood
    | SelectFloaters
    | ChangeSelection
    | SelectionCage
    | Isolate
    | RemoveElements
)
