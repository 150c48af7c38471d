"""Messages of pages about control points and lattices."""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

from pydantic import Field

from cagefield.server.protocol.common import (
    MAX_MESSAGE_BYTES,
    CurveName,
    EditId,
    InterpolationName,
    Message,
    Reach,
)

Cells: TypeAlias = Annotated[int, Field(ge=1, le=7)]


class PlacePoint(Message):
    """A new edit of one control point, on the surface seen at a pixel (x, y in [0,1] of the picture).

    Without a pixel it goes to the middle of the visible surface.
    """

    type: Literal["place_point"] = "place_point"
    x: Annotated[float, Field(ge=0, le=1)] | None = None
    y: Annotated[float, Field(ge=0, le=1)] | None = None


class Subdivide(Message):
    """The inner cage becomes a lattice with that many cells along its x, y and z."""

    type: Literal["subdivide"] = "subdivide"
    edit: EditId
    cells: tuple[Cells, Cells, Cells]
    interpolation: InterpolationName = "bspline"


class PointReach(Message):
    """Reach of an edit's control points, world units, the curve by which it fades, and whether distances go
    through dense matter alone; omitted ones stay.
    """

    type: Literal["point_reach"] = "point_reach"
    edit: EditId
    radius: Reach | None = None
    falloff: CurveName | None = None
    connected: bool | None = None


class PlaceMesh(Message):
    """A new edit with a mesh cage, from a file's name and its content in base64, world units."""

    type: Literal["place_mesh"] = "place_mesh"
    name: Annotated[str, Field(min_length=1, max_length=200)]
    content: Annotated[str, Field(max_length=MAX_MESSAGE_BYTES)]


PointMessage: TypeAlias = PlacePoint | Subdivide | PointReach | PlaceMesh
