"""Operations on cages as pages say them."""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

from pydantic import Field, FiniteFloat

from cagefield.server.protocol.common import Axes, Corner, Message, Vec3


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
