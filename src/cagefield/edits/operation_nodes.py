"""Operations of edit files: their keys, read and written."""

from __future__ import annotations

from typing import Any

from cagefield.edits import operations
from cagefield.edits.file_nodes import Node
from cagefield.edits.operations import Operation
from cagefield.geometry.point_deformers import FALLOFF_CURVES, FIXED, LATTICE_AXES

MAX_HANDLES = 512
"""Points of any inner cage: lattices have up to 8 along each axis."""

_SHEARS = ("xy", "xz", "yx", "yz", "zx", "zy")


def parse_operation(node: Node) -> Operation:
    """The operation of a mapping with one key. Raises `EditFileError` for unknown keys and bad values."""
    names = (
        "translate",
        "rotate_deg",
        "scale",
        "shear",
        "move_corner",
        "move_edge",
        "move_face",
        "move_corners",
        "move_point",
        "move_points",
        "bend",
        "twist",
        "taper",
        "mirror",
    )
    keys = node.mapping(optional=names)
    if len(keys) != 1:
        raise node.error(
            f"an operation is one of {', '.join(names)}; got {' and '.join(keys) if keys else 'nothing'}:"
            " start each operation with its own dash"
        )
    name, value = next(iter(keys.items()))
    if name == "mirror":
        return operations.Mirror(value.choice(LATTICE_AXES))
    if name == "translate":
        return operations.Translate(value.vector())
    if name in ("rotate_deg", "scale"):
        inner = value.mapping(required=("by",), optional=("axes",)) if value.is_mapping else {"by": value}
        axes: Any = inner["axes"].choice(("world", "cage")) if "axes" in inner else "world"
        if name == "rotate_deg":
            return operations.Rotate(inner["by"].vector(), axes)
        return operations.Scale(inner["by"].factors(), axes)
    if name == "shear":
        parts = value.mapping(optional=(*_SHEARS, "axes"))
        axes = parts.pop("axes").choice(("world", "cage")) if "axes" in parts else "world"
        return operations.Shear(**{pair: part.number() for pair, part in parts.items()}, axes=axes)
    if name == "move_corner":
        parts = value.mapping(required=("corner", "by"))
        return operations.MoveCorner(parts["corner"].integer(0, 7), parts["by"].vector())
    if name == "move_edge":
        parts = value.mapping(required=("edge", "by"))
        i, j = (end.integer(0, 7) for end in parts["edge"].items(2))
        return operations.MoveEdge((i, j), parts["by"].vector())
    if name == "move_corners":
        parts = value.mapping(required=("corners", "by"))
        corners = tuple(corner.integer(0, 7) for corner in parts["corners"].items())
        return operations.MoveCorners(corners, parts["by"].vector())
    if name == "move_point":
        parts = value.mapping(required=("point", "by"))
        return operations.MovePoint(parts["point"].integer(0, MAX_HANDLES - 1), parts["by"].vector())
    if name == "move_points":
        parts = value.mapping(required=("points", "by"), optional=("radius", "falloff"))
        points = tuple(point.integer(0, MAX_HANDLES - 1) for point in parts["points"].items())
        radius = parts["radius"].number() if "radius" in parts else 0.0
        falloff = parts["falloff"].choice(FALLOFF_CURVES) if "falloff" in parts else "smooth"
        return operations.MovePoints(points, parts["by"].vector(), radius, falloff)
    if name == "bend":
        parts = value.mapping(required=("axis", "degrees"), optional=("towards", "fixed"))
        towards = parts["towards"].choice(LATTICE_AXES) if "towards" in parts else ""
        return operations.Bend(
            parts["axis"].choice(LATTICE_AXES), parts["degrees"].number(), towards, _fixed(parts)
        )
    if name == "twist":
        parts = value.mapping(required=("axis", "degrees"), optional=("fixed",))
        return operations.Twist(parts["axis"].choice(LATTICE_AXES), parts["degrees"].number(), _fixed(parts))
    if name == "taper":
        parts = value.mapping(required=("axis", "factor"), optional=("fixed",))
        return operations.Taper(parts["axis"].choice(LATTICE_AXES), parts["factor"].number(), _fixed(parts))
    parts = value.mapping(required=("face", "by"))
    return operations.MoveFace(parts["face"].text(), parts["by"].vector())


def _fixed(parts: dict[str, Node]) -> str:
    return parts["fixed"].choice(FIXED) if "fixed" in parts else "start"


def dump_operation(operation: Operation) -> dict[str, Any]:
    """The mapping that `parse_operation` reads."""
    if isinstance(operation, operations.Mirror):
        return {"mirror": operation.axis}
    if isinstance(operation, operations.Translate):
        return {"translate": list(operation.by)}
    if isinstance(operation, operations.Rotate):
        return {"rotate_deg": _with_axes(operation.degrees, operation.axes)}
    if isinstance(operation, operations.Scale):
        return {"scale": _with_axes(operation.by, operation.axes)}
    if isinstance(operation, operations.Shear):
        content: dict[str, Any] = {name: value for name, value in operation.factors.items() if value != 0.0}
        return {"shear": content | ({"axes": operation.axes} if operation.axes != "world" else {})}
    if isinstance(operation, operations.MoveCorner):
        return {"move_corner": {"corner": int(operation.corner), "by": list(operation.by)}}
    if isinstance(operation, operations.MoveEdge):
        return {"move_edge": {"edge": [int(k) for k in operation.edge], "by": list(operation.by)}}
    if isinstance(operation, operations.MoveCorners):
        corners = [int(k) for k in operation.corners]
        return {"move_corners": {"corners": corners, "by": list(operation.by)}}
    if isinstance(operation, operations.MovePoint):
        return {"move_point": {"point": int(operation.point), "by": list(operation.by)}}
    if isinstance(operation, operations.MovePoints):
        content = {"points": [int(k) for k in operation.points], "by": list(operation.by)}
        if operation.radius > 0.0:
            content |= {"radius": operation.radius, "falloff": operation.falloff}
        return {"move_points": content}
    if isinstance(operation, operations.Bend):
        content = {"axis": operation.axis, "degrees": operation.degrees}
        if operation.towards:
            content["towards"] = operation.towards
        return {"bend": content | _with_fixed(operation.fixed)}
    if isinstance(operation, operations.Twist):
        content = {"axis": operation.axis, "degrees": operation.degrees}
        return {"twist": content | _with_fixed(operation.fixed)}
    if isinstance(operation, operations.Taper):
        content = {"axis": operation.axis, "factor": operation.factor}
        return {"taper": content | _with_fixed(operation.fixed)}
    return {"move_face": {"face": operation.face, "by": list(operation.by)}}


def _with_fixed(fixed: str) -> dict[str, Any]:
    return {} if fixed == "start" else {"fixed": fixed}


def _with_axes(by: tuple[float, float, float], axes: str) -> Any:
    return list(by) if axes == "world" else {"by": list(by), "axes": axes}
