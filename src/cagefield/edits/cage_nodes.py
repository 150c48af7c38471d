"""Cages of edit files: their keys, read and written."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from cagefield.edits.file_nodes import Node
from cagefield.edits.operations import euler_degrees
from cagefield.errors import CageError, CagefieldError, EditFileError
from cagefield.geometry.bspline_lattice import INTERPOLATIONS
from cagefield.geometry.cage import Cage, LatticeCage
from cagefield.geometry.cage_checks import MOST_POINTS
from cagefield.geometry.control_points import ControlPoints
from cagefield.geometry.mesh_cage import MeshCage
from cagefield.geometry.mesh_files import read_mesh_cage
from cagefield.geometry.point_deformers import FALLOFF_CURVES
from cagefield.geometry.triangle_mesh import MAX_MESH_VERTICES
from cagefield.typing import Array


def parse_inner(node: Node, folder: Path | None = None) -> Cage:
    """The inner cage of an edit: a mesh, control points, a lattice, or a cage with 8 corners.

    Files of meshes are relative to `folder`; None reads none.
    """
    if "mesh" in node.names():
        return _mesh(node, folder)
    if "lattice" in node.names():
        return _lattice(node)
    return _control_points(node) if "points" in node.names() else parse_cage(node)


def _lattice(node: Node) -> LatticeCage:
    box = parse_cage(replace(node, value={k: v for k, v in node.value.items() if k != "lattice"}))
    lattice = node.value["lattice"]
    keys = lattice.mapping(required=("points",), optional=("interpolation", "control_points"))
    shape = [count.integer(2, MOST_POINTS) for count in keys["points"].items(3)]
    interpolation = keys["interpolation"].choice(INTERPOLATIONS) if "interpolation" in keys else "bspline"
    try:
        if "control_points" not in keys:
            return box.subdivided([count - 1 for count in shape], interpolation)
        points = [point.vector() for point in keys["control_points"].items(int(np.prod(shape)))]
        return LatticeCage(np.array(points), shape, interpolation, pivot=box.pivot)
    except EditFileError:
        raise
    except CagefieldError as error:
        raise lattice.error(str(error)) from None


def _mesh(node: Node, folder: Path | None) -> MeshCage:
    keys = node.mapping(required=("mesh",), optional=("pivot", "linear"))
    mesh = keys["mesh"].mapping(optional=("file", "vertices", "triangles"))
    if ("file" in mesh) == ("vertices" in mesh) or ("vertices" in mesh) != ("triangles" in mesh):
        raise keys["mesh"].error("a mesh has either file, or vertices and triangles")
    pivot = keys["pivot"].vector() if "pivot" in keys else None
    linear = [row.vector() for row in keys["linear"].items(3)] if "linear" in keys else None
    try:
        if "file" in mesh:
            name = mesh["file"].text()
            if folder is None:
                raise CageError("a mesh file is read from an edit file only; give its vertices and triangles")
            read = read_mesh_cage(folder / name)
            vertices: Any = read.vertices
            triangles: Any = read.triangles
        else:
            vertices = [vertex.vector() for vertex in mesh["vertices"].items()]
            triangles = [
                [number.integer(0, MAX_MESH_VERTICES - 1) for number in triangle.items(3)]
                for triangle in mesh["triangles"].items()
            ]
        return MeshCage(vertices, triangles, pivot=pivot, linear=linear)
    except EditFileError:
        raise
    except CagefieldError as error:
        raise keys["mesh"].error(str(error)) from None


def _control_points(node: Node) -> ControlPoints:
    keys = node.mapping(required=("points", "radius"), optional=("falloff", "connected", "pivot", "linear"))
    points = [point.vector() for point in keys["points"].items()]
    pivot = keys["pivot"].vector() if "pivot" in keys else None
    linear = [row.vector() for row in keys["linear"].items(3)] if "linear" in keys else None
    falloff = keys["falloff"].choice(FALLOFF_CURVES) if "falloff" in keys else "smooth"
    connected = "connected" in keys and keys["connected"].boolean()
    radius = keys["radius"].number()
    try:
        return ControlPoints(points, radius, falloff, pivot=pivot, linear=linear, connected=connected)
    except CagefieldError as error:
        raise node.error(str(error)) from None


def parse_cage(node: Node) -> Cage:
    """The cage with 8 corners of a mapping with its center and size, or its corners."""
    keys = node.mapping(optional=("center", "size", "rotation_deg", "corners", "pivot"))
    if "corners" in keys:
        for other in ("center", "size", "rotation_deg"):
            if other in keys:
                raise keys[other].error("a cage has either corners or center and size; remove one")
        corners = [corner.vector() for corner in keys["corners"].items(8)]
        values: Any = np.array(corners)
    elif "center" in keys and "size" in keys:
        rotation = keys["rotation_deg"].vector() if "rotation_deg" in keys else (0.0, 0.0, 0.0)
        values = Cage.box(keys["center"].vector(), keys["size"].factors(), np.radians(rotation)).corners
    else:
        missing = "size" if "center" in keys else "center"
        raise node.error(f'a cage needs center and size, or 8 corners; "{missing}" is missing')
    # The pivot of a box is the center as written; the mean of its corners can differ in the last bit.
    place = keys.get("pivot", keys.get("center"))
    pivot = None if place is None else place.vector()
    try:
        return Cage(values, pivot=pivot)  # type: ignore[arg-type]
    except CagefieldError as error:
        raise node.error(str(error)) from None


def parse_outer(node: Node, inner: Cage, folder: Path | None = None) -> Cage:
    """An outer cage, or the one with a margin around an inner cage; a mesh's file as in `parse_inner`."""
    if "mesh" in node.names():
        return _mesh(node, folder)
    if "margin" not in node.names():
        return parse_cage(node)
    return inner.grown(node.mapping(required=("margin",))["margin"].factors())


def dump_inner(cage: Cage) -> dict[str, Any]:
    """The mapping that `parse_inner` reads."""
    if isinstance(cage, LatticeCage):
        return _from_lattice(cage)
    if isinstance(cage, MeshCage):
        return _from_mesh(cage)
    return _from_control_points(cage) if isinstance(cage, ControlPoints) else dump_cage(cage)


def _from_lattice(cage: LatticeCage) -> dict[str, Any]:
    box = Cage(cage.corners, pivot=cage.pivot)
    lattice: dict[str, Any] = {"points": list(cage.shape), "interpolation": cage.interpolation}
    if box.subdivided([count - 1 for count in cage.shape], cage.interpolation) != cage:
        lattice["control_points"] = cage.control_points.tolist()
    return dump_cage(box) | {"lattice": lattice}


def _from_mesh(cage: MeshCage) -> dict[str, Any]:
    content: dict[str, Any] = {
        "mesh": {"vertices": cage.vertices.tolist(), "triangles": cage.triangles.tolist()}
    }
    if not np.array_equal(cage.vertices.mean(axis=0), cage.pivot):
        content["pivot"] = cage.pivot.tolist()
    if not np.array_equal(cage.linear, np.eye(3)):
        content["linear"] = cage.linear.tolist()
    return content


def _from_control_points(cage: ControlPoints) -> dict[str, Any]:
    content: dict[str, Any] = {"points": cage.points.tolist(), "radius": cage.radius, "falloff": cage.falloff}
    if cage.connected:
        content["connected"] = True
    if not np.array_equal(ControlPoints(cage.points, cage.radius).pivot, cage.pivot):
        content["pivot"] = cage.pivot.tolist()
    if not np.array_equal(cage.linear, np.eye(3)):
        content["linear"] = cage.linear.tolist()
    return content


def dump_cage(cage: Cage) -> dict[str, Any]:
    """A cage as center, size and rotation where that gives back its very corners, else as corners."""
    R, _ = np.linalg.qr(cage.affine[0])
    R = R * np.sign(np.diag(R.T @ cage.affine[0]))
    rotation = euler_degrees(Rotation.from_matrix(R))
    size = np.linalg.norm(cage.affine[0], axis=0)
    for digits in (12, 9, 6):
        # Numbers written by a person have few digits; computed ones are tried last, as they are.
        center, lengths, turn = (_short(v, digits) for v in (cage.pivot, size, rotation))
        if (lengths > 0.0).all() and Cage.box(center, lengths, np.radians(turn)) == cage:
            content: dict[str, Any] = {"center": center.tolist(), "size": lengths.tolist()}
            return content | ({"rotation_deg": turn.tolist()} if turn.any() else {})
    content = {"corners": cage.corners.tolist()}
    return content if Cage(cage.corners) == cage else content | {"pivot": cage.pivot.tolist()}


def dump_margin(inner: Cage, outer: Cage) -> dict[str, Any] | None:
    """The outer cage as a margin where that gives back its very corners."""
    edges = inner.frame[1]
    margin = (np.linalg.norm(outer.affine[0], axis=0) - np.linalg.norm(edges, axis=0)) / 2.0
    for digits in (12, 9, 6):
        m = _short(margin, digits)
        if (m > 0.0).all() and inner.grown(m) == outer:
            return {"margin": float(m[0]) if (m == m[0]).all() else m.tolist()}
    return None


def dump_outer(inner: Cage, outer: Cage) -> dict[str, Any]:
    """The mapping that `parse_outer` reads."""
    if isinstance(outer, MeshCage):
        return _from_mesh(outer)
    return dump_margin(inner, outer) or dump_cage(outer)


def _short(v: Array, digits: int) -> Array:
    return np.round(v, digits) + 0.0  # + 0.0 turns -0.0 into 0.0
