"""Mesh cages read from .obj, .ply and .glb files, by trimesh."""

from __future__ import annotations

import io
import os
import warnings
from pathlib import Path, PurePath
from typing import Any

import numpy as np

from cagefield.errors import CageError, CagefieldError
from cagefield.files.safe_open import read_bytes
from cagefield.geometry.mesh_cage import MeshCage
from cagefield.geometry.triangle_mesh import Triangles, check_edges, signed_volume
from cagefield.typing import Array

CAGE_FILE_SUFFIXES: tuple[str, ...] = (".obj", ".ply", ".glb")

MAX_MESH_BYTES = 4 << 20
"""Bytes of a file: a hundred times those of the largest mesh cage, for what else it may hold."""


def read_mesh_cage(path: str | os.PathLike[str]) -> MeshCage:
    """The mesh cage of a file: all its meshes in one, world units, vertices in one place merged.

    A surface inside out is turned over, with a warning. Raises `CagefieldError`, naming the file, for other
    formats, files that cannot be read, meshes that are no `MeshCage`, and where trimesh is not installed.
    """
    file = Path(path)
    _check_suffix(file)
    try:
        content = read_bytes(file, MAX_MESH_BYTES)
    except OSError as error:
        raise CageError(f"{file}: cannot be read ({error.strerror or error})") from None
    cage, warning = mesh_cage_of(content, file)
    if warning is not None:
        warnings.warn(warning, stacklevel=2)
    return cage


def mesh_cage_of(content: bytes, file: PurePath) -> tuple[MeshCage, str | None]:
    """(mesh cage, warning or None) of a file's content; its name tells the format.

    Raises as `read_mesh_cage`.
    """
    _check_suffix(file)
    if len(content) > MAX_MESH_BYTES:
        raise CageError(f"{file}: a mesh cage's file has at most {MAX_MESH_BYTES} bytes; decimate the mesh")
    vertices, triangles = _loaded(content, file)
    warning = None
    try:
        if len(triangles):
            check_edges(triangles)
            if signed_volume(vertices, triangles) < 0.0:
                triangles = triangles[:, ::-1]
                warning = f"{file}: the mesh is inside out; its triangles are turned over"
        return MeshCage(vertices, triangles), warning
    except CagefieldError as error:
        raise CageError(f"{file}: {error}") from None


def _check_suffix(file: PurePath) -> None:
    if file.suffix.lower() not in CAGE_FILE_SUFFIXES:
        raise CageError(
            f'{file}: a mesh cage is a {", ".join(CAGE_FILE_SUFFIXES)} file, got "{file.suffix}"; convert it'
        )


def _loaded(content: bytes, file: PurePath) -> tuple[Array, Triangles]:
    """(vertices [V,3], triangles [F,3]) of a file's content."""
    try:
        import trimesh
    except ImportError:
        raise CageError(
            "a mesh cage from a file needs trimesh, which is not installed; pip install 'cagefield[mesh]'"
        ) from None
    kind = file.suffix.lower()[1:]
    try:
        # Without a resolver, files that the file names are not read.
        loaded: Any = trimesh.load(
            io.BytesIO(content), file_type=kind, force="mesh", process=False, resolver=None
        )
        vertices = np.asarray(loaded.vertices, dtype=np.float64).reshape(-1, 3)
        triangles = np.asarray(loaded.faces, dtype=np.int64).reshape(-1, 3)
    except Exception as error:  # a damaged file raises anything
        raise CageError(
            f"{file}: no mesh in it can be read ({type(error).__name__}: {error!s:.80}); export it again"
        ) from None
    if len(triangles) and not (triangles.min() >= 0 and triangles.max() < len(vertices)):
        raise CageError(f"{file}: its triangles name vertices that it has not; export it again")
    if not len(triangles):
        raise CageError(f"{file}: mesh has 0 triangles; give it a closed surface")
    if not np.isfinite(vertices[triangles]).all():  # else numbers that are none would be vertices apart
        raise CageError(f"{file}: coordinates of vertices must be finite; export it again")
    used, numbers = np.unique(vertices[triangles].reshape(-1, 3), axis=0, return_inverse=True)
    return _in_order(used, numbers.reshape(-1, 3))


def _in_order(vertices: Array, triangles: Triangles) -> tuple[Array, Triangles]:
    """The vertices [V,3] numbered in the order in which triangles [F,3] name them."""
    _, first = np.unique(triangles, return_index=True)
    order = np.argsort(first)
    return vertices[order], np.argsort(order)[triangles]
