"""Transformations of all mesh instances of a glTF scene, composed over parent nodes.

Notation: a node's matrix [4,4] takes its coordinates to those of its parent; M = T R S, or given directly.

Source: KhronosGroup/glTF, specification 2.0, "Scenes", "Transformations"; EXT_mesh_gpu_instancing.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from cagefield.formats.splats.gltf_buffers import GltfAsset
from cagefield.typing import Array

INSTANCING = "EXT_mesh_gpu_instancing"


@dataclass(frozen=True, eq=False)
class MeshInstances:
    """Index of a mesh, and the matrices [I,4,4] from its coordinates to the scene's."""

    mesh: int
    matrices: Array


def scene_meshes(asset: GltfAsset) -> tuple[list[MeshInstances], int]:
    """(meshes of the default scene, number of nodes with meshes outside the scene).

    Without scenes, all nodes without a parent are roots.

    Raises:
        ValueError: a node with two parents or in a cycle, or an invalid transformation.
    """
    nodes, scenes = asset.items("nodes"), asset.items("scenes")
    if scenes:
        roots = asset.item("scenes", asset.json.get("scene", 0)).get("nodes", [])
    else:
        below = {child for node in nodes for child in node.get("children", [])}
        roots = [number for number in range(len(nodes)) if number not in below]
    instances, visited = list[MeshInstances](), set[int]()
    pending = [(number, np.eye(4)) for number in reversed(roots)]
    while pending:
        number, parent = pending.pop()
        node = asset.item("nodes", number)
        if number in visited:
            raise ValueError(f"node {number} has two parents, or is its own")
        visited.add(number)
        matrix = parent @ _matrix(node)
        if not np.isfinite(matrix).all():
            raise ValueError(f"node {number} has a transformation that is no number")
        if "mesh" in node:
            instances.append(MeshInstances(node["mesh"], matrix @ _instances(asset, node)))
        pending.extend((child, matrix) for child in reversed(node.get("children", [])))
    hidden = sum("mesh" in node for number, node in enumerate(nodes) if number not in visited)
    return instances, hidden


def _matrix(node: dict[str, Any]) -> Array:
    if "matrix" in node:
        return np.array(node["matrix"], np.float64).reshape(4, 4).T
    shift = np.array(node.get("translation", [0.0] * 3), np.float64).reshape(1, 3)
    turn = np.array(node.get("rotation", [0.0, 0.0, 0.0, 1.0]), np.float64).reshape(1, 4)
    scale = np.array(node.get("scale", [1.0] * 3), np.float64).reshape(1, 3)
    return _matrices(shift, turn, scale)[0]


def _instances(asset: GltfAsset, node: dict[str, Any]) -> Array:
    """Matrices [I,4,4] of a node's instances; the identity without instances."""
    said = node.get("extensions", {}).get(INSTANCING)
    if said is None:
        return np.eye(4)[None]
    attributes = said["attributes"]
    columns = {
        name: asset.accessor(attributes[name], width)
        for name, width in (("TRANSLATION", 3), ("ROTATION", 4), ("SCALE", 3))
        if name in attributes
    }
    counts = {column.count for column in columns.values()}
    if len(counts) != 1 or not all(column.is_stored for column in columns.values()):
        raise ValueError(f"a node's {INSTANCING} has attributes of {len(counts)} lengths")
    count = counts.pop()
    rest = {"TRANSLATION": [0.0] * 3, "ROTATION": [0.0, 0.0, 0.0, 1.0], "SCALE": [1.0] * 3}
    values = [
        columns[name].rows(0, count) if name in columns else np.tile(default, (count, 1))
        for name, default in rest.items()
    ]
    return _matrices(*values)


def _matrices(shift: Array, turn: Array, scale: Array) -> Array:
    """Matrices T R S [n,4,4] of translations [n,3], quaternions [n,4] (x y z w) and scales [n,3]."""
    if not (np.linalg.norm(turn, axis=1) > 0.0).all():
        raise ValueError("a node has a rotation of length 0")
    matrices = np.tile(np.eye(4), (len(shift), 1, 1))
    matrices[:, :3, :3] = Rotation.from_quat(turn).as_matrix() * scale[:, None]
    matrices[:, :3, 3] = shift
    return matrices
