"""Operations on cages as pages say them."""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

from pydantic import Field, FiniteFloat

from cagefield.server.protocol.common import Axes, Corner, CurveName, Message, Point, Vec3

AxisName: TypeAlias = Literal["x", "y", "z"]
FixedEnd: TypeAlias = Literal["start", "middle", "end"]
Angle: TypeAlias = Annotated[float, Field(ge=-3600, le=3600)]


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


class MovePointBy(Message):
    """Move one control point."""

    kind: Literal["move_point"] = "move_point"
    point: Point
    by: Vec3


class MovePointsBy(Message):
    """Move control points together; those within a radius > 0 around them go along in part."""

    kind: Literal["move_points"] = "move_points"
    points: Annotated[list[Point], Field(min_length=1, max_length=512)]
    by: Vec3
    radius: Annotated[float, Field(ge=0, lt=1e6)] = 0.0
    falloff: CurveName = "smooth"


class BendBy(Message):
    """Bend a lattice along an axis of its own, `towards` another ("": the next); see `operations.Bend`."""

    kind: Literal["bend"] = "bend"
    axis: AxisName
    degrees: Angle
    towards: AxisName | Literal[""] = ""
    fixed: FixedEnd = "start"


class TwistBy(Message):
    """Twist a lattice about an axis of its own."""

    kind: Literal["twist"] = "twist"
    axis: AxisName
    degrees: Angle
    fixed: FixedEnd = "start"


class TaperBy(Message):
    """Scale a lattice across an axis of its own, evenly to a factor at its end."""

    kind: Literal["taper"] = "taper"
    axis: AxisName
    factor: Annotated[float, Field(gt=0, lt=1e6)]
    fixed: FixedEnd = "start"


class MirrorBy(Message):
    """Reflect the content of a move, a copy or a paste along an axis of its cage."""

    kind: Literal["mirror"] = "mirror"
    axis: AxisName


OperationMessage: TypeAlias = Annotated[
    TranslateBy
    | RotateBy
    | ScaleBy
    | ShearBy
    | MoveCornersBy
    | MovePointBy
    | MovePointsBy
    | BendBy
    | TwistBy
    | TaperBy
    | MirrorBy,
    Field(discriminator="kind"),
]
