"""Mesh cages in files: .obj, .ply and .glb, edit files, and pictures of their edits."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh

from cagefield.edits import Edit, EditStack, dump_edits, load_edits, parse_edits
from cagefield.errors import CageError, EditFileError
from cagefield.geometry.cage import Cage
from cagefield.geometry.mesh_cage import MeshCage
from cagefield.geometry.mesh_files import read_mesh_cage

OUTER = Cage.box((0, 0, 0), 2.4)


def mesh_file(path: Path, mesh: trimesh.Trimesh | None = None) -> Path:
    (trimesh.creation.icosphere(1, 0.4) if mesh is None else mesh).export(path)
    return path


@pytest.mark.parametrize("name", ["a.obj", "a.ply", "a.glb", "A.OBJ"])
def test_meshes_are_read(tmp_path: Path, name: str) -> None:
    made = trimesh.creation.icosphere(1, 0.4)
    path = tmp_path / name
    content = made.export(file_type=path.suffix[1:].lower())
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    cage = read_mesh_cage(path)
    assert len(cage.vertices) == len(made.vertices) and len(cage.triangles) == len(made.faces)
    rounded = {tuple(v) for v in np.round(cage.vertices, 5) + 0.0}
    assert rounded == {tuple(v) for v in np.round(made.vertices, 5) + 0.0}


def test_vertices_in_one_place_are_merged_and_quads_split(tmp_path: Path) -> None:
    soup = trimesh.creation.box((0.5, 0.5, 0.5))
    soup.unmerge_vertices()
    assert len(read_mesh_cage(mesh_file(tmp_path / "soup.ply", soup)).vertices) == 8
    corners = Cage.box((0, 0, 0), 1.0).corners
    quads = [(1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4)]
    lines = ["v {} {} {}".format(*v) for v in corners]
    lines += ["f " + " ".join(map(str, q)) for q in quads]
    (tmp_path / "quads.obj").write_text("mtllib none.mtl\n" + "\n".join(lines) + "\n")
    with pytest.warns(UserWarning, match=r"quads.obj: the mesh is inside out; its triangles are turned over"):
        cage = read_mesh_cage(tmp_path / "quads.obj")
    assert cage.triangles.shape == (12, 3) and cage.contains([[0, 0, 0]])[0]


def test_damaged_files_end_in_one_line(tmp_path: Path) -> None:
    def refused(name: str, content: bytes | None, message: str) -> None:
        path = tmp_path / name
        if content is not None:
            path.write_bytes(content)
        with pytest.raises(CageError, match=message) as caught:
            read_mesh_cage(path)
        assert "\n" not in str(caught.value) and str(path) in str(caught.value)

    whole = {kind: mesh_file(tmp_path / f"whole.{kind}").read_bytes() for kind in ("obj", "ply", "glb")}
    refused("a.stl", b"", r'a mesh cage is a .obj, .ply, .glb file, got ".stl"')
    refused("none.obj", None, "cannot be read")
    refused("empty.obj", b"", "no mesh in it can be read|0 triangles")
    refused("points.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "no mesh in it can be read|0 triangles")
    refused("nan.obj", re.sub(rb"(?m)^v \S+", b"v nan", whole["obj"], count=1), "must be finite")
    refused(
        "open.obj",
        whole["obj"].rsplit(b"\nf ", 1)[0],
        r"mesh is open: edge .* has one triangle \(3 such edges\)",
    )
    for kind, content in whole.items():
        for share in (0.3, 0.6, 0.9):
            refused(f"cut{share}.{kind}", content[: int(share * len(content))], "cut")
    refused("noise.glb", np.random.default_rng(0).bytes(400), "no mesh in it can be read")
    refused("large.ply", bytes(5 << 20), "cannot be read")


def test_edit_files_name_a_mesh_beside_them(tmp_path: Path) -> None:
    (tmp_path / "cages").mkdir()
    mesh_file(tmp_path / "cages" / "ball.ply")
    text = """
version: 1
edits:
  - name: ball
    inner: {mesh: {file: cages/ball.ply}}
    outer: {center: [0, 0, 0], size: 2}
    operations:
      - move_point: {point: 3, by: [0.1, 0, 0]}
      - twist: {axis: z, degrees: 40}
"""
    (tmp_path / "edits.yaml").write_text(text)
    (edit,) = load_edits(tmp_path / "edits.yaml")
    assert edit.inner == read_mesh_cage(tmp_path / "cages" / "ball.ply")
    with pytest.raises(
        EditFileError, match=r"line 5: edits\[0\].inner.mesh: a mesh file is read from an edit file"
    ):
        parse_edits(text)
    (tmp_path / "edits.yaml").write_text(text.replace("ball.ply", "none.ply"))
    with pytest.raises(EditFileError, match=r"line 5: .*none.ply: cannot be read"):
        load_edits(tmp_path / "edits.yaml")
    with pytest.raises(EditFileError, match="either file, or vertices and triangles"):
        parse_edits("[{inner: {mesh: {file: a.obj, vertices: []}}, outer: {margin: 1}}]")
    with pytest.raises(EditFileError, match="0 triangles"):
        parse_edits("[{inner: {mesh: {vertices: [[0, 0, 0]], triangles: []}}, outer: {margin: 1}}]")


@pytest.mark.parametrize("format", ["yaml", "json"])
def test_edit_files_hold_the_very_mesh(format: str) -> None:
    mesh = trimesh.creation.icosphere(1, 0.4)
    plain = MeshCage(mesh.vertices, mesh.faces)
    turned = plain.rotate((0.1, 0.2, 0.3)).scale(0.9).translate((0.1, 0, 0))
    for cage in (plain, turned):
        edit = Edit.continuous(cage, OUTER).bend("z", 0.5).move_points([3, 4], (0, 0.1, 0), radius=0.3)
        stack = EditStack([edit])
        (again,) = parse_edits(dump_edits(stack, format=format), format=format)
        assert again == edit and again.deformed == edit.deformed


def test_without_trimesh_the_cure_is_named(tmp_path: Path) -> None:
    code = (
        "import sys; sys.modules['trimesh'] = None\n"
        "from cagefield.geometry.mesh_files import read_mesh_cage\n"
        f"read_mesh_cage({str(mesh_file(tmp_path / 'a.obj'))!r})"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert "needs trimesh, which is not installed; pip install 'cagefield[mesh]'" in run.stderr
