"""Operations on a cage as values, so that an edit can be saved, undone, and done in part.

Each is applied with `apply(cage)`; `part(t)` is the same operation gone through to t in [0,1]: lengths and
shears times t, angles of rotations, bends and twists times t, factors of scalings and tapers to the power t.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import ClassVar, TypeAlias, cast

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from cagefield.edits.angles import degrees as degrees
from cagefield.edits.angles import euler_degrees as euler_degrees
from cagefield.edits.mirror import Mirror as Mirror
from cagefield.errors import CageError
from cagefield.geometry.cage import FACES, Axes, Cage, LatticeCage
from cagefield.geometry.cage_checks import factors, vector
from cagefield.geometry.mesh_cage import MeshCage

Triple: TypeAlias = tuple[float, float, float]

ANGLE_DECIMALS = 6
"""Decimals of an angle in a text, degrees: fits leave rounding in angles that are 0."""


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
        x, y, z = (round(angle, ANGLE_DECIMALS) for angle in self.degrees)
        return f"by {_show((x, y, z))} degrees"


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


@dataclass(frozen=True)
class MovePoint:
    """Move one control point, numbered x fastest, by a vector; the pivot stays."""

    point: int
    by: Triple
    noun: ClassVar[str] = "point move"

    def apply(self, cage: Cage) -> Cage:
        """The deformed cage."""
        return cage.move_point(self.point, self.by)

    def part(self, t: float) -> MovePoint:
        """The share t of the move."""
        return MovePoint(self.point, _times(self.by, t))

    def __str__(self) -> str:
        return f"of point {self.point} by {_show(self.by)}"


@dataclass(frozen=True)
class MovePoints:
    """Move control points together by a vector; the pivot stays.

    With a radius > 0, in world units, points around them go along in part (proportional editing), by the
    weight of `falloff`: "smooth", "sphere", "root", "sharp" or "linear".
    """

    points: tuple[int, ...]
    by: Triple
    radius: float = 0.0
    falloff: str = "smooth"
    noun: ClassVar[str] = "move of points"

    def apply(self, cage: Cage) -> Cage:
        """The deformed cage."""
        return cage.move_points(self.points, self.by, radius=self.radius, falloff=self.falloff)

    def part(self, t: float) -> MovePoints:
        """The share t of the move."""
        return replace(self, by=_times(self.by, t))

    def __str__(self) -> str:
        named = ", ".join(map(str, self.points[:8])) + (", ..." if len(self.points) > 8 else "")
        return f"{named} by {_show(self.by)}"


@dataclass(frozen=True)
class Bend:
    """Bend a lattice: its middle line along an axis of its own becomes an arc of that many degrees.

    `towards` is another of its axes, "" the next in the order x, y, z, x; `fixed` ("start", "middle" or
    "end") is where along the axis nothing moves.
    """

    axis: str
    degrees: float
    towards: str = ""
    fixed: str = "start"
    noun: ClassVar[str] = "bend"

    def apply(self, cage: Cage) -> Cage:
        """The bent cage."""
        lattice = _lattice(cage, "bend")
        return lattice.bend(self.axis, np.radians(self.degrees), towards=self.towards, fixed=self.fixed)

    def part(self, t: float) -> Bend:
        """The bend by t times the angle."""
        return replace(self, degrees=t * self.degrees)

    def __str__(self) -> str:
        return f"along {self.axis} by {self.degrees:.4g} degrees"


@dataclass(frozen=True)
class Twist:
    """Twist a lattice about an axis of its own by that many degrees from end to end; see `Bend`."""

    axis: str
    degrees: float
    fixed: str = "start"
    noun: ClassVar[str] = "twist"

    def apply(self, cage: Cage) -> Cage:
        """The twisted cage."""
        return _lattice(cage, "twist").twist(self.axis, np.radians(self.degrees), fixed=self.fixed)

    def part(self, t: float) -> Twist:
        """The twist by t times the angle."""
        return replace(self, degrees=t * self.degrees)

    def __str__(self) -> str:
        return f"about {self.axis} by {self.degrees:.4g} degrees"


@dataclass(frozen=True)
class Taper:
    """Scale a lattice across an axis of its own, evenly to a factor > 0 at its end; see `Bend`."""

    axis: str
    factor: float
    fixed: str = "start"
    noun: ClassVar[str] = "taper"

    def apply(self, cage: Cage) -> Cage:
        """The tapered cage."""
        return _lattice(cage, "taper").taper(self.axis, self.factor, fixed=self.fixed)

    def part(self, t: float) -> Taper:
        """The taper by the factor to the power t."""
        return replace(self, factor=float(np.power(self.factor, t))) if self.factor > 0.0 else self

    def __str__(self) -> str:
        return f"along {self.axis} by {self.factor:.4g}"


def _lattice(cage: Cage, name: str) -> LatticeCage | MeshCage:
    """The cage as a lattice or a mesh; a `CageError` with the cure for others."""
    if isinstance(cage, LatticeCage | MeshCage):
        return cage
    raise CageError(
        f"a {name} needs a lattice of control points, and this cage has none; give it cells along the axis:"
        " cage.subdivided((1, 1, 4)) in Python, lattice: {points: [2, 2, 5]} in a file"
    )


Operation: TypeAlias = (
    Translate
    | Rotate
    | Scale
    | Shear
    | MoveCorner
    | MoveEdge
    | MoveFace
    | MoveCorners
    | MovePoint
    | MovePoints
    | Bend
    | Twist
    | Taper
    | Mirror
)


def displacement(by: ArrayLike, name: str) -> Triple:
    """A finite vector as a tuple of three floats."""
    return _triple(vector(by, name))


def _triple(v: ArrayLike) -> Triple:
    return cast(Triple, tuple(np.asarray(v, dtype=np.float64).tolist()))


def _times(v: Triple, t: float) -> Triple:
    return (t * v[0], t * v[1], t * v[2])


def _show(v: Triple) -> str:
    return "(" + ", ".join(f"{x + 0.0:.4g}" for x in v) + ")"  # no "-0"
