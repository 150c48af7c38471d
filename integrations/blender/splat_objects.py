# SPDX-License-Identifier: GPL-3.0-or-later
"""Splats as Blender objects: a mesh or a point cloud whose points have the attributes of 3DGS.

Attributes of the points, all FLOAT, as PLY files of 3DGS name them and Blender's PLY import brings them:
f_dc_0..2, f_rest_0..(3K-1) (all of red, then green, then blue; K = 0, 3, 8, 15 or 24; may be absent), opacity
(logit), scale_0..2 (natural logarithms), rot_0..3 (w x y z, of any length). Positions and these attributes
are in the object's own space. Objects that the add-on makes also have attributes for display: "splat_color"
(color without view dependence, opacity), "splat_size" (standard deviations), "splat_rotation" and
"splat_radius".
"""

import bpy
import numpy as np

from .splat_nodes import show_as_splats

SHAPE = ("opacity", *(f"scale_{n}" for n in range(3)), *(f"rot_{n}" for n in range(4)))
COLOR = tuple(f"f_dc_{n}" for n in range(3))
DEGREE_BY_REST = {0: 0, 9: 1, 24: 2, 45: 3, 72: 4}
SH_C0 = 0.28209479177387814
MAX_LOGIT = 30.0
PATH = "cagefield_path"
"""Custom property of an object that was opened from a scene folder or a splat file."""


def is_splat_object(thing):
    """True for an object with a point for each splat, and the attributes of 3DGS."""
    if thing is None or thing.type not in ("MESH", "POINTCLOUD"):
        return False
    return all(name in thing.data.attributes for name in (*SHAPE, *COLOR))


def missing_attributes(thing):
    """Names of the attributes that an object lacks to be a splat object."""
    if thing is None or thing.type not in ("MESH", "POINTCLOUD"):
        return [*SHAPE, *COLOR]
    return [name for name in (*SHAPE, *COLOR) if name not in thing.data.attributes]


def read_splats(thing):
    """Arrays of an object's splats, float32, as frames have them. Raises ValueError for wrong attributes."""
    data = thing.data
    count = len(data.vertices if thing.type == "MESH" else data.points)

    def column(name):
        attribute = data.attributes[name]
        if attribute.data_type != "FLOAT" or len(attribute.data) != count:
            raise ValueError(f'attribute "{name}" of {thing.name} must be a FLOAT of each point')
        values = np.empty(count, np.float32)
        attribute.data.foreach_get("value", values)
        return values

    missing = missing_attributes(thing)
    if missing:
        raise ValueError(f"{thing.name} is no splat object: it lacks {', '.join(missing[:6])}")
    means = np.empty(3 * count, np.float32)
    data.attributes["position"].data.foreach_get("vector", means)
    rest = [one.name for one in data.attributes if one.name.startswith("f_rest_")]
    if len(rest) not in DEGREE_BY_REST:
        raise ValueError(f"{thing.name} has {len(rest)} attributes f_rest_*, expected 0, 9, 24, 45 or 72")
    sh = np.stack([column(name) for name in COLOR], axis=1)[:, None]
    if rest:
        above = np.stack([column(f"f_rest_{n}") for n in range(len(rest))], axis=1)
        sh = np.concatenate([sh, above.reshape(count, 3, -1).transpose(0, 2, 1)], axis=1)
    logit = column("opacity").astype(np.float64)
    return {
        "means": means.reshape(count, 3),
        "log_scales": np.stack([column(f"scale_{n}") for n in range(3)], axis=1),
        "quaternions": np.stack([column(f"rot_{n}") for n in range(4)], axis=1),
        "opacities": (1.0 / (1.0 + np.exp(-np.clip(logit, -80.0, 80.0)))).astype(np.float32),
        "sh": np.ascontiguousarray(sh),
    }


def write_splats(mesh, arrays):
    """Replaces all points of a mesh and their attributes by splats, arrays as frames have them."""
    count = len(arrays["means"])
    mesh.clear_geometry()
    mesh.vertices.add(count)
    mesh.attributes["position"].data.foreach_set("vector", np.ascontiguousarray(arrays["means"]).reshape(-1))
    opacities = arrays["opacities"].astype(np.float64)
    with np.errstate(divide="ignore"):
        logit = np.clip(np.log(opacities) - np.log1p(-opacities), -MAX_LOGIT, MAX_LOGIT)
    columns = {"opacity": logit}
    columns |= {f"scale_{n}": arrays["log_scales"][:, n] for n in range(3)}
    columns |= {f"rot_{n}": arrays["quaternions"][:, n] for n in range(4)}
    columns |= {f"f_dc_{n}": arrays["sh"][:, 0, n] for n in range(3)}
    rest = arrays["sh"][:, 1:].transpose(0, 2, 1).reshape(count, -1)
    columns |= {f"f_rest_{n}": rest[:, n] for n in range(rest.shape[1])}
    for name, values in columns.items():
        _set(mesh, name, "FLOAT", "value", values)
    scales = np.exp(arrays["log_scales"])
    color = np.clip(0.5 + SH_C0 * arrays["sh"][:, 0], 0.0, 1.0)
    linear = np.where(color <= 0.04045, color / 12.92, ((color + 0.055) / 1.055) ** 2.4)
    _set(
        mesh,
        "splat_color",
        "FLOAT_COLOR",
        "color",
        np.concatenate([linear, arrays["opacities"][:, None]], axis=1),
    )
    _set(mesh, "splat_size", "FLOAT_VECTOR", "vector", scales)
    _set(mesh, "splat_rotation", "QUATERNION", "value", arrays["quaternions"])
    _set(mesh, "splat_radius", "FLOAT", "value", np.cbrt(scales.prod(axis=1)))
    mesh.update()


def _set(mesh, name, data_type, key, values):
    attribute = mesh.attributes.get(name) or mesh.attributes.new(name, data_type, "POINT")
    attribute.data.foreach_set(key, np.ascontiguousarray(values, np.float32).reshape(-1))


def new_splat_object(name, arrays, collection):
    """A new object of splats, with the nodes that show them, in a collection."""
    mesh = bpy.data.meshes.new(name)
    thing = bpy.data.objects.new(name, mesh)
    write_splats(mesh, arrays)
    collection.objects.link(thing)
    show_as_splats(thing)
    return thing
