# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects as cages: their shape when they were assigned (at rest) and their shape now, as arrays.

Shapes are in the space of the splat object: inverse of its matrix_world, times the cage's matrix_world, times
the vertices. The shape at rest is stored on the cage as a custom property; it stays with the .blend file.
"""

import bmesh
import bpy
import numpy as np

REST = "cagefield_rest"
"""Custom property: the shape at rest, x y z of each point, in the space of the splat object."""

MAX_POINTS = 512
LATTICE_INTERPOLATIONS = {"KEY_BSPLINE": "bspline", "KEY_LINEAR": "linear"}


class CageObjectError(Exception):
    """An object that is no cage: one line, with the cure."""


def make_cages(splats, center, size, margin, collection):
    """(inner, outer): two cubes around a box, the outer one larger by a margin on each side.

    center [3] and size [3] are in the space of the splats, whose object is the cubes' parent.
    """
    cages = []
    for name, grown in (("inner cage", 0.0), ("outer cage", margin)):
        half = 0.5 * np.asarray(size, np.float64) + grown
        corners = [[(2 * (k >> a & 1) - 1) * half[a] for a in range(3)] for k in range(8)]
        faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
        mesh = bpy.data.meshes.new(name)
        mesh.from_pydata(corners, [], faces)
        cage = bpy.data.objects.new(name, mesh)
        cage.parent = splats
        cage.location = [float(value) for value in center]
        cage.display_type = "WIRE"
        cage.hide_render = True
        collection.objects.link(cage)
        cages.append(cage)
    return cages


def assign(cage, splats, depsgraph):
    """Stores a cage's present shape as its shape at rest. Raises CageObjectError for other objects."""
    if cage.type == "LATTICE":
        local = np.array([point.co for point in cage.data.points], np.float64)
    else:
        local = _vertices(cage, depsgraph)
    points = _in_splat_space(cage, splats, local)
    if not 4 <= len(points) <= MAX_POINTS:
        raise CageObjectError(
            f"{cage.name} has {len(points)} points, a cage has 4 to {MAX_POINTS}; decimate it"
        )
    cage[REST] = points.reshape(-1).tolist()


def cage_arrays(cage, splats, role, depsgraph):
    """(settings, arrays) of a cage with a role, "inner" or "outer", for a request. Raises CageObjectError."""
    if cage is None:
        raise CageObjectError(f"no {role} cage is assigned; select a cube and press Assign {role}")
    stored = cage.get(REST)
    if stored is None:
        raise CageObjectError(f"{cage.name} is not assigned as the {role} cage; press Assign {role}")
    rest = np.array(stored, np.float64).reshape(-1, 3)
    if cage.type == "LATTICE":
        settings, local = _lattice(cage, depsgraph)
        topology = {}
    else:
        settings, local = {"type": "mesh"}, _vertices(cage, depsgraph)
        topology = _topology(cage, role, depsgraph)
    target = _in_splat_space(cage, splats, local)
    if rest.shape != target.shape:
        raise CageObjectError(
            f"{cage.name} has {len(target)} points, {len(rest)} when it was assigned; assign it again"
        )
    return settings, {f"{role}_rest": rest, f"{role}_target": target, **topology}


def to_rest(cage, splats):
    """Moves a mesh cage's vertices to its shape at rest, or a lattice's points and object."""
    rest = np.array(cage[REST], np.float64).reshape(-1, 3)
    to_local = np.array(cage.matrix_world.inverted() @ splats.matrix_world, np.float64)
    points = rest @ to_local[:3, :3].T + to_local[:3, 3]
    if cage.type == "LATTICE":
        for point, place in zip(cage.data.points, points, strict=True):
            point.co_deform = place
    elif len(cage.data.vertices) == len(points):
        cage.data.vertices.foreach_set("co", points.astype(np.float32).reshape(-1))
        cage.data.update()
    cage.update_tag()


def _in_splat_space(cage, splats, local):
    matrix = np.array(splats.matrix_world.inverted_safe() @ cage.matrix_world, np.float64)
    return local @ matrix[:3, :3].T + matrix[:3, 3]


def _lattice(cage, depsgraph):
    lattice = cage.data
    kinds = {lattice.interpolation_type_u, lattice.interpolation_type_v, lattice.interpolation_type_w}
    kind = kinds.pop()
    if kinds or kind not in LATTICE_INTERPOLATIONS:
        raise CageObjectError(
            f"{cage.name}: set the interpolation of U, V and W to BSpline, or all to Linear"
        )
    shape = [lattice.points_u, lattice.points_v, lattice.points_w]
    if not all(2 <= count <= 8 for count in shape):
        raise CageObjectError(f"{cage.name} has {shape} points; a lattice cage has 2 to 8 along each axis")
    shown = cage.evaluated_get(depsgraph).data
    points = shown.points if len(shown.points) == len(lattice.points) else lattice.points
    local = np.array([point.co_deform for point in points], np.float64)
    return {"type": "lattice", "shape": shape, "interpolation": LATTICE_INTERPOLATIONS[kind]}, local


def _vertices(cage, depsgraph):
    """Vertices [V,3] of a mesh object as it is shown, in edit mode as they are edited."""
    if cage.type != "MESH":
        raise CageObjectError(f"{cage.name} is a {cage.type.lower()}; a cage is a mesh or a lattice")
    if cage.mode == "EDIT":
        return np.array([vertex.co for vertex in bmesh.from_edit_mesh(cage.data).verts], np.float64)
    mesh = cage.evaluated_get(depsgraph).data
    points = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", points)
    return points.reshape(-1, 3).astype(np.float64)


def _topology(cage, role, depsgraph):
    """Edges [E,2] and triangles [F,3] of a mesh object, int32."""
    if cage.mode == "EDIT":
        shape = bmesh.from_edit_mesh(cage.data)
        edges = [[vertex.index for vertex in edge.verts] for edge in shape.edges]
        triangles = [[loop.vert.index for loop in three] for three in shape.calc_loop_triangles()]
    else:
        mesh = cage.evaluated_get(depsgraph).data
        edges = [list(edge.vertices) for edge in mesh.edges]
        triangles = [list(three.vertices) for three in mesh.loop_triangles]
    return {
        f"{role}_edges": np.array(edges, np.int32).reshape(-1, 2),
        f"{role}_triangles": np.array(triangles, np.int32).reshape(-1, 3),
    }
