"""Operations on a cage as values, so that an edit can be saved, undone, and done in part.

Each is applied with `apply(cage)`; `part(t)` is the same operation gone through to t in [0,1]: lengths and
shears times t, the rotation about the same axis by t times the angle, scale factors to the power t.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, fields
from typing import ClassVar, TypeAlias, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from cagefield.geometry.cage import FACES, Axes, Cage
from cagefield.geometry.cage_checks import factors, vector

Triple: TypeAlias = tuple[float, float, float]


@dataclass(frozen=True)
class Translate:
    """Move the cage by a vector, world units."""

    by: Triple
    noun: ClassVar[str] = "translation"

    def apply(self, cage: Cage) -> Cage:
        """The moved cage."""
        return cage.translate(self.by)

    def part(self, t: float) -> Translate:
        """The share t of the operation."""
        return Translate(_times(self.by, t))

    def __str__(self) -> str:
        return f"by {_show(self.by)}"


@dataclass(frozen=True)
class Rotate:
    """Turn the cage about its pivot by R_x R_y R_z, intrinsic XYZ angles in degrees."""

    degrees: Triple
    axes: Axes = "world"
    noun: ClassVar[str] = "rotation"

    @classmethod
    def from_rotation(cls, rotation: Rotation | ArrayLike, axes: Axes = "world") -> Rotate:
        """Rotation from a SciPy `Rotation`, or from intrinsic XYZ angles [3] in radians.

        Angles within rounding of a short decimal number of degrees become that number.
        """
        if isinstance(rotation, Rotation):
            degrees = vector(euler_degrees(rotation), "rotate")
        else:
            degrees = np.degrees(vector(rotation, "rotate"))
        short = np.round(degrees, 9)
        near = np.abs(degrees - short) <= 4e-16 * np.abs(degrees)
        return cls(_triple(np.where(near, short, degrees)), axes)

    def apply(self, cage: Cage) -> Cage:
        """The turned cage."""
        return cage.rotate(np.radians(vector(self.degrees, "rotate")), axes=self.axes)

    def part(self, t: float) -> Rotate:
        """The turn about the same axis by t times the angle."""
        turn = Rotation.from_euler("XYZ", self.degrees, degrees=True).as_rotvec()
        return Rotate(_triple(euler_degrees(Rotation.from_rotvec(t * turn))), self.axes)

    def __str__(self) -> str:
        return f"by {_show(self.degrees)} degrees"


def euler_degrees(rotation: Rotation) -> NDArray[np.float64]:
    """Intrinsic XYZ angles [3] in degrees; in gimbal lock the last one is 0, without SciPy's warning."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        return np.asarray(rotation.as_euler("XYZ", degrees=True))


@dataclass(frozen=True)
class Scale:
    """Scale the cage about its pivot, by three factors > 0 along the world's or the cage's axes."""

    by: Triple
    axes: Axes = "world"
    noun: ClassVar[str] = "scaling"

    @classmethod
    def from_factors(cls, by: ArrayLike, axes: Axes = "world") -> Scale:
        """Scaling by one factor or three."""
        return cls(_triple(factors(by, "scale")), axes)

    def apply(self, cage: Cage) -> Cage:
        """The scaled cage."""
        return cage.scale(self.by, axes=self.axes)

    def part(self, t: float) -> Scale:
        """The scaling by factors to the power t."""
        return Scale(_triple(np.power(factors(self.by, "scale"), t)), self.axes)

    def __str__(self) -> str:
        return f"by {_show(self.by)}"


@dataclass(frozen=True)
class Shear:
    """Shear the cage about its pivot: `xy` adds xy * y to x, and so on."""

    xy: float = 0.0
    xz: float = 0.0
    yx: float = 0.0
    yz: float = 0.0
    zx: float = 0.0
    zy: float = 0.0
    axes: Axes = "world"
    noun: ClassVar[str] = "shear"

    def apply(self, cage: Cage) -> Cage:
        """The sheared cage."""
        return cage.shear(**self.factors, axes=self.axes)

    def part(self, t: float) -> Shear:
        """The shear by t times the factors."""
        return Shear(**{name: t * value for name, value in self.factors.items()}, axes=self.axes)

    @property
    def factors(self) -> dict[str, float]:
        """The six factors by name."""
        return {f.name: float(getattr(self, f.name)) for f in fields(self) if f.name != "axes"}

    def __str__(self) -> str:
        return "by " + ", ".join(f"{name} {value:g}" for name, value in self.factors.items() if value)


@dataclass(frozen=True)
class MoveCorner:
    """Move one corner, 0 to 7, by a vector; the pivot stays."""

    corner: int
    by: Triple
    noun: ClassVar[str] = "corner move"

    @property
    def corners(self) -> tuple[int, ...]:
        """The corners that move."""
        return (self.corner,)

    def apply(self, cage: Cage) -> Cage:
        """The deformed cage."""
        return cage.move_corner(self.corner, self.by)

    def part(self, t: float) -> MoveCorner:
        """The share t of the move."""
        return MoveCorner(self.corner, _times(self.by, t))

    def __str__(self) -> str:
        return f"of corner {self.corner} by {_show(self.by)}"


@dataclass(frozen=True)
class MoveEdge:
    """Move the two corners of an edge (i, j) by a vector; the pivot stays."""

    edge: tuple[int, int]
    by: Triple
    noun: ClassVar[str] = "edge move"

    @property
    def corners(self) -> tuple[int, ...]:
        """The corners that move."""
        return self.edge

    def apply(self, cage: Cage) -> Cage:
        """The deformed cage."""
        return cage.move_edge(self.edge, self.by)

    def part(self, t: float) -> MoveEdge:
        """The share t of the move."""
        return MoveEdge(self.edge, _times(self.by, t))

    def __str__(self) -> str:
        return f"of edge {self.edge} by {_show(self.by)}"


@dataclass(frozen=True)
class MoveFace:
    """Move the four corners of a face, such as "+x", by a vector; the pivot stays."""

    face: str
    by: Triple
    noun: ClassVar[str] = "face move"

    @property
    def corners(self) -> tuple[int, ...]:
        """The corners that move."""
        return FACES[self.face]

    def apply(self, cage: Cage) -> Cage:
        """The deformed cage."""
        return cage.move_face(self.face, self.by)

    def part(self, t: float) -> MoveFace:
        """The share t of the move."""
        return MoveFace(self.face, _times(self.by, t))

    def __str__(self) -> str:
        return f"of face {self.face} by {_show(self.by)}"


@dataclass(frozen=True)
class MoveCorners:
    """Move any corners together by a vector; the pivot stays."""

    corners: tuple[int, ...]
    by: Triple
    noun: ClassVar[str] = "move of corners"

    def apply(self, cage: Cage) -> Cage:
        """The deformed cage."""
        return cage.move_corners(self.corners, self.by)

    def part(self, t: float) -> MoveCorners:
        """The share t of the move."""
        return MoveCorners(self.corners, _times(self.by, t))

    def __str__(self) -> str:
        return f"{', '.join(map(str, self.corners))} by {_show(self.by)}"


Operation: TypeAlias = Translate | Rotate | Scale | Shear | MoveCorner | MoveEdge | MoveFace | MoveCorners


def displacement(by: ArrayLike, name: str) -> Triple:
    """A finite vector as a tuple of three floats."""
    return _triple(vector(by, name))


def _triple(v: ArrayLike) -> Triple:
    return cast(Triple, tuple(np.asarray(v, dtype=np.float64).tolist()))


def _times(v: Triple, t: float) -> Triple:
    return (t * v[0], t * v[1], t * v[2])


def _show(v: Triple) -> str:
    return "(" + ", ".join(f"{x + 0.0:.4g}" for x in v) + ")"  # no "-0"
