"""The process that deforms splats for other programs: its frames, its replies, its end."""

from __future__ import annotations

import importlib
import io
import json
import signal
import struct
import subprocess
import sys
import time
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from benchmarks.edits.random_edits.meshes import random_mesh
from scipy.spatial.transform import Rotation

import cagefield
from cagefield import Cage, Edit, EditStack, Scene, load_edits, read_splats
from cagefield.edits.fitted_operations import operations_to
from cagefield.errors import CageError, CagefieldError, FieldError
from cagefield.exporting import edited_splats
from cagefield.integrations.cage_arrays import hexahedron_order
from cagefield.integrations.frames import (
    FRAME_MAGIC,
    MAX_HEADER_BYTES,
    Frame,
    FrameError,
    read_frame,
    write_frame,
)
from cagefield.integrations.splat_deformer import (
    SPLAT_ARRAYS,
    SplatDeformer,
    edit_from_request,
    scene_of_splats,
    splat_arrays,
)
from splat_scenes import random_splats
from splat_worker_requests import (
    COMMAND,
    CUBE_EDGES,
    deform_request,
    mesh_arrays,
    running_worker,
)
from tiers import nightly_after_first

ROOT = Path(__file__).parents[1]
TIMEOUT_S = 600.0
INNER = Cage.box((0.1, 0, 0), (0.8, 0.7, 0.9))
OUTER = INNER.grown(0.4)
MOVED = INNER.rotate((0.1, 0.3, -0.2)).translate((0.05, 0.1, 0))
FACTORS = np.array([[1.2, 0.1, 0.0], [0.0, 0.9, -0.2], [0.0, 0.0, 1.1]])


def addon_module(name: str) -> ModuleType:
    """A module of the add-on that needs no bpy, unlike its package."""
    package = ModuleType("addon")
    package.__path__ = [str(ROOT / "integrations/blender")]
    sys.modules["addon"] = package
    return importlib.import_module(f"addon.{name}")


def loaded() -> tuple[SplatDeformer, Scene]:
    """A deformer with random splats, and their scene."""
    splats = random_splats(200, degree=1)
    deformer = SplatDeformer()
    deformer.reply(Frame({"request": "load"}, splat_arrays(splats)))
    return deformer, scene_of_splats(splats)


# ---- frames ----

ARRAYS = {
    "a": np.arange(12, dtype=np.float32).reshape(3, 4),
    "none": np.zeros((0, 3), np.float32),
    "double": np.array([np.pi, np.inf]),
    "whole": np.array([[-1], [2]], np.int32),
}


@pytest.mark.parametrize("direction", ["package", "to the add-on", "from the add-on"])
def test_a_frame_comes_back_bit_for_bit(direction: str) -> None:
    addon, stream, header = addon_module("frames"), io.BytesIO(), {"request": "load", "id": 3, "name": "Ä"}
    if direction == "from the add-on":
        addon.write_frame(stream, header, ARRAYS)
    else:
        write_frame(stream, Frame(header, ARRAYS))
    stream.seek(0)
    if direction == "to the add-on":
        found, arrays = addon.read_frame(stream)
    else:
        frame = read_frame(stream)
        assert frame is not None
        found, arrays = frame.header, frame.arrays
    assert found == header and list(arrays) == list(ARRAYS)
    for name, values in ARRAYS.items():
        assert arrays[name].dtype == values.dtype and arrays[name].shape == values.shape
        assert arrays[name].tobytes() == values.tobytes()
    assert (addon.read_frame(stream) if direction == "to the add-on" else read_frame(stream)) is None


def raw(header: bytes, content: bytes = b"", magic: bytes = FRAME_MAGIC, length: int | None = None) -> bytes:
    return struct.pack("<4sI", magic, len(header) if length is None else length) + header + content


def listing(*arrays: Any) -> bytes:
    return json.dumps({"request": "load", "arrays": list(arrays)}).encode()


MALFORMED = [
    (b"CGF", "stream ended within a frame's prefix, after 3 of 8 bytes"),
    (raw(b"{}", magic=b"HTTP"), "a frame begins with b'CGF1', got b'HTTP'"),
    (raw(b"{}", length=MAX_HEADER_BYTES + 1), "a header has at most"),
    (raw(b"{}", length=10), "ended within a frame's header, after 2 of 10"),
    (raw(b"{"), "the header is no JSON"),
    (raw(b"\xff\xfe"), "the header is no JSON"),
    (raw(b"[" * 5000 + b"]" * 5000), "the header is no JSON"),
    (raw(b"[]"), "the header is a JSON object, got list"),
    (raw(b'{"arrays": 3}'), '"arrays" is a list'),
    (raw(listing(*[[f"a{n}", "float32", [0]] for n in range(33)])), "at most 32 arrays"),
    (raw(listing(["a", "float32"])), r"listed as \[name, dtype, shape\]"),
    (raw(listing(["a", "float32", [1]], ["a", "float32", [1]])), '"a" is listed twice'),
    (raw(listing(["a", "object", [1]])), "is of 'object'; send float32, float64, int32"),
    (raw(listing(["a", ["float32"], [1]])), "send float32"),
    (raw(listing(["a", "float32", [-1]])), "shape of 1 to 3 whole numbers"),
    (raw(listing(["a", "float32", [True]])), "shape of 1 to 3 whole numbers"),
    (raw(listing(["a", "float32", [1, 1, 1, 1]])), "shape of 1 to 3 whole numbers"),
    (raw(listing(["a", "float32", [1 << 30, 1 << 30]])), "at most 17179869184 bytes"),
    (raw(listing(["a", "float32", [4]]), b"123"), 'array "a", after 3 of 16 bytes'),
]


@pytest.mark.parametrize(("content", "message"), MALFORMED)
def test_malformed_frames_are_refused(content: bytes, message: str) -> None:
    with pytest.raises(FrameError, match=message):
        read_frame(io.BytesIO(content))


def test_frames_that_no_reader_accepts_are_not_written() -> None:
    stream = io.BytesIO()
    for frame, message in (
        (Frame({}, {"a": np.zeros(3, np.int64)}), "send float32"),
        (Frame({}, {"a": np.zeros((1, 1, 1, 1))}), "send float32"),
        (Frame({}, {f"a{n}": np.zeros(1) for n in range(33)}), "32 arrays"),
        (Frame({"a": "x" * MAX_HEADER_BYTES}), "a header of at most"),
    ):
        with pytest.raises(FrameError, match=message):
            write_frame(stream, frame)
    assert stream.getvalue() == b""


# ---- cages ----


def reached(cage: Cage, target: np.ndarray) -> tuple[int, float]:
    """(number of operations, largest distance from the target [n,3]) of the operations that are found."""
    operations = operations_to(cage, target)
    deformed = Edit.continuous(cage, cage.grown(50.0), operations=operations).deformed
    return len(operations), float(np.abs(deformed.handles - target).max())


@pytest.mark.parametrize(
    ("moved", "count"),
    [
        (INNER, 0),
        (INNER.translate((0.1, 0, 0.2)), 1),
        (INNER.rotate((0.3, 0, 2.9)), 1),
        (INNER.move_corner(3, (0.1, 0.2, 0)), 1),
        (INNER.move_face("+x", (0.1, 0.2, 0)), 1),
        (INNER.move_edge((0, 1), (0.0, -0.1, 0)).translate((1, 2, 3)), 2),
        (INNER.scale((1.5, 0.7, 1.0)).rotate((0, 0, 1)), 2),
        (INNER.scale((1.5, 0.7, 1.0)).move_corner(6, (0.1, 0, 0.1)).rotate((0, 0, 2)), None),
    ],
)
def test_operations_lead_to_the_target(moved: Cage, count: int | None) -> None:
    found, distance = reached(INNER, moved.handles)
    # Two roundings of float32 at coordinates of 1.
    assert distance < 2.5e-7 * max(1.0, np.abs(moved.handles).max())
    assert count is None or found == count


@pytest.mark.nightly
def test_operations_lead_lattices_and_meshes_to_their_targets() -> None:
    lattice = INNER.subdivided((1, 1, 3))
    random = np.random.default_rng(0)
    mesh = random_mesh(random, "icosphere")
    for cage, target in (
        (lattice, lattice.bend("z", 0.9).handles),
        (lattice, (lattice.handles @ FACTORS.T) + 1.0),
        (mesh, mesh.handles + random.normal(0.0, 0.01, mesh.handles.shape)),
        (mesh, mesh.handles @ Rotation.from_euler("XYZ", (0.2, 0.1, 2.0)).as_matrix().T),
    ):
        found, distance = reached(cage, target)
        assert distance < 5e-7 and found <= len(cage.handles) + 4


def test_a_target_that_no_cage_can_have_is_refused() -> None:
    with pytest.raises(CageError, match=r"inside out|mirrored"):
        operations_to(INNER, INNER.handles * (-1.0, 1.0, 1.0))
    with pytest.raises(CageError, match=r"\(8, 3\)|\[8, 3\]|8"):
        operations_to(INNER, INNER.handles[:7])


@pytest.mark.parametrize("seed", range(4))
def test_corners_are_found_whatever_the_order_of_vertices(seed: int) -> None:
    random = np.random.default_rng(seed)
    order = random.permutation(8)  # vertex v is corner order[v]
    number = np.argsort(order)
    corners = INNER.rotate((0.2, 0.1, 0.3)).move_corner(7, (0.1, 0.1, 0.1)).corners
    found = hexahedron_order(corners[order], number[CUBE_EDGES])
    assert found is not None
    np.testing.assert_array_equal(corners[order][found], corners)
    # A mirrored object: the numbering that is right-handed again, nearest to the axes.
    mirrored = corners * (-1.0, 1.0, 1.0)
    again = hexahedron_order(mirrored[order], number[CUBE_EDGES])
    assert again is not None
    np.testing.assert_array_equal(mirrored[order][again], mirrored[[k ^ 1 for k in range(8)]])


def test_other_meshes_of_eight_vertices_are_no_hexahedra() -> None:
    edges = CUBE_EDGES.copy()
    edges[0], edges[1] = (0, 3), (1, 2)  # two parallel edges of a face become its diagonals
    assert hexahedron_order(INNER.corners, edges) is None
    assert hexahedron_order(INNER.corners, np.zeros((12, 2), np.int32)) is None
    assert hexahedron_order(INNER.corners[:7], CUBE_EDGES) is None


# ---- replies ----


def test_a_reply_has_the_splats_of_the_edit_bit_for_bit() -> None:
    deformer, scene = loaded()
    for request in (
        deform_request(INNER, MOVED.corners),
        deform_request(INNER, MOVED.corners, kind="copy"),
        deform_request(INNER, INNER.corners, kind="delete"),
        deform_request(INNER, MOVED.corners, OUTER),
    ):
        reply = deformer.reply(request)
        expected = edited_splats(scene.with_edits(EditStack([edit_from_request(request)])))
        assert reply.header["count"] == len(expected) and list(reply.arrays) == list(SPLAT_ARRAYS)
        for name in SPLAT_ARRAYS:
            assert reply.arrays[name].tobytes() == getattr(expected, name).tobytes()


def test_an_edit_is_the_one_that_its_operations_are_written_as() -> None:
    """The oracle: the rotation and the translation that the target was made with."""
    _, scene = loaded()
    written = Edit.move(INNER, fill="none", relight="none").rotate((0.1, 0.3, -0.2)).translate((0.05, 0.1, 0))
    expected = edited_splats(scene.with_edits(EditStack([written])))
    found = edited_splats(
        scene.with_edits(EditStack([edit_from_request(deform_request(INNER, MOVED.corners))]))
    )
    assert len(found) == len(expected)
    # The operations that are found reach the corners within float32's rounding.
    np.testing.assert_allclose(found.means, expected.means, atol=1e-6)
    np.testing.assert_allclose(found.sh, expected.sh, atol=1e-5)


def test_infill_is_the_default_of_edits() -> None:
    plain = edit_from_request(deform_request(INNER, MOVED.corners))
    full = edit_from_request(deform_request(INNER, MOVED.corners, infill=True, name="arm"))
    assert (plain.fill, plain.relight, plain.name) == ("none", "none", "")
    assert (full.fill, full.relight, full.name) == ("surroundings", "occlusion", "arm")


def lattice_request(size: list[int], interpolation: str, *, mirrored: bool = False) -> Frame:
    """A request with a lattice that is bent, x fastest; `mirrored` as a mirrored object has it."""
    lattice = INNER.subdivided([count - 1 for count in size])
    rest, target = lattice.handles, lattice.translate((0.1, 0, 0)).handles
    if mirrored:
        rest, target = (
            points.reshape(*size[::-1], 3)[:, :, ::-1].reshape(-1, 3) for points in (rest, target)
        )
    arrays = {"inner_rest": rest, "inner_target": target} | mesh_arrays("outer", OUTER.corners, OUTER.corners)
    settings = {"type": "lattice", "shape": size, "interpolation": interpolation}
    header = {"request": "deform", "kind": "continuous", "inner": settings, "outer": {"type": "mesh"}}
    return Frame(header, arrays)


def test_lattices_are_read_x_fastest_and_mirrored_ones_turned() -> None:
    edit = edit_from_request(lattice_request([2, 3, 4], "bspline"))
    assert getattr(edit.inner, "shape", None) == (2, 3, 4)
    np.testing.assert_array_equal(edit.inner.handles, INNER.subdivided((1, 2, 3)).handles)
    again = edit_from_request(lattice_request([2, 3, 4], "bspline", mirrored=True))
    np.testing.assert_array_equal(again.inner.handles, edit.inner.handles)
    np.testing.assert_array_equal(again.deformed.handles, edit.deformed.handles)


def test_edits_are_saved_and_splats_exported(tmp_path: Path) -> None:
    deformer, scene = loaded()
    edits, splats = tmp_path / "edits.yaml", tmp_path / "out.ply"
    request = deform_request(INNER, MOVED.corners, request="save", path=str(edits))
    assert deformer.reply(request).header == {"path": str(edits), "edits": 1}
    assert tuple(load_edits(edits)) == (edit_from_request(request),)
    with pytest.raises(CagefieldError, match=r"edits.yaml exists; choose another name"):
        deformer.reply(request)
    request = deform_request(INNER, MOVED.corners, request="export", path=str(splats))
    reply = deformer.reply(request)
    expected = edited_splats(scene.with_edits(EditStack([edit_from_request(request)])))
    written = read_splats(splats)
    assert reply.header == {"path": str(splats), "count": len(expected)}
    np.testing.assert_array_equal(written.means, expected.means)
    np.testing.assert_array_equal(written.sh, expected.sh)


def test_a_scene_is_opened_with_its_own_edits(tmp_path: Path) -> None:
    _, scene = loaded()
    first = Edit.move(INNER, fill="none", relight="none").translate((0, 0, 2.0))
    scene.with_edits(EditStack([first])).save(tmp_path / "scene")
    deformer = SplatDeformer()
    reply = deformer.reply(Frame({"request": "open", "path": str(tmp_path / "scene")}))
    shown = edited_splats(scene.with_edits(EditStack([first])))
    assert (reply.header["count"], reply.header["edits"]) == (200, 1)
    np.testing.assert_array_equal(reply.arrays["means"], shown.means)
    there = INNER.translate((0, 0, 2.0))
    request = deform_request(there, there.translate((1, 0, 0)).corners)
    moved = deformer.reply(request)
    both = EditStack([first, edit_from_request(request)])
    np.testing.assert_array_equal(moved.arrays["means"], edited_splats(scene.with_edits(both)).means)
    high = moved.arrays["means"][moved.arrays["means"][:, 2] > 1.5]
    assert len(high) > 10 and high[:, 0].min() > 0.5


def changed(request: Frame, header: dict[str, Any] | None = None, **arrays: Any) -> Frame:
    left = {name: values for name, values in (request.arrays | arrays).items() if values is not None}  # type: ignore[operator]
    return Frame({**request.header, **(header or {})}, left)


def with_nan(values: np.ndarray, row: int) -> np.ndarray:
    values = values.copy()
    values[row, 1] = np.nan
    return values


MOVE = deform_request(INNER, MOVED.corners)
CONTINUOUS = deform_request(INNER, MOVED.corners, OUTER)
LATTICE = lattice_request([2, 3, 4], "bspline")
NO_TRIANGLES = np.zeros((0, 3), np.int32)
INSIDE_OUT = INNER.corners[[1, 0, 3, 2, 5, 4, 7, 6]]


@pytest.mark.parametrize(
    ("request_", "message"),
    [
        (Frame({}), "a request is one of hello, open, load, deform, save, export, got None"),
        (Frame({"request": ["load"]}), "a request is one of"),
        (Frame({"request": "open"}), '"path" of a request is of type str, got None'),
        (Frame({"request": "open", "path": "/nowhere/x.ply"}), "/nowhere/x.ply does not exist"),
        (Frame({"request": "load"}), "arrays of the splats are missing: means, log_scales"),
        (changed(MOVE, {"kind": "bend"}), "kind is continuous, move, copy, delete, got 'bend'"),
        (changed(MOVE, {"infill": 1}), '"infill" of a request is of type bool'),
        (changed(MOVE, {"name": "a\nb"}), "name"),
        (changed(CONTINUOUS, {"lattice": "64"}), "lattice is a number of nodes or null"),
        (changed(CONTINUOUS, {"lattice": 1}), "lattice"),
        (changed(MOVE, {"inner": None}), "no inner cage is given; assign an object as the inner cage"),
        (changed(CONTINUOUS, {"outer": None}), "no outer cage is given"),
        (changed(MOVE, {"inner": {"type": "ball"}}), "type of an inner cage is mesh or lattice, got 'ball'"),
        (changed(CONTINUOUS, {"outer": {"type": "lattice"}}), "type of an outer cage is mesh"),
        (changed(MOVE, inner_rest=None), "array inner_rest is missing"),
        (changed(MOVE, inner_rest=INNER.corners[:, :2]), r"inner_rest must be float64\[n,3\], got .*8, 2"),
        (changed(MOVE, inner_rest=INNER.corners.astype(np.float32)), r"inner_rest must be float64\[n,3\]"),
        (changed(MOVE, inner_target=INNER.corners[:7]), "inner cage has 7 vertices, 8 when it was assigned"),
        (changed(MOVE, inner_target=with_nan(INNER.corners, 3)), "vertex 3 of the inner cage now must be"),
        (changed(MOVE, inner_rest=with_nan(INNER.corners, 3)), "vertex 3 of the inner cage at rest must be"),
        (changed(MOVE, inner_target=INSIDE_OUT), "inner cage as it is now: cage is mirrored.*; move"),
        (changed(MOVE, inner_target=INNER.corners * (1, 1, 0)), "cage as it is now: .* zero size.*; move"),
        (changed(MOVE, inner_edges=CUBE_EDGES[:11]), "needs a cage with 8 corners"),
        (changed(CONTINUOUS, inner_edges=CUBE_EDGES[:11], inner_triangles=NO_TRIANGLES), "0 triangles"),
        (changed(CONTINUOUS, outer_edges=CUBE_EDGES[:11]), "outer cage must be a cube of 8 vertices"),
        (changed(CONTINUOUS, inner_target=MOVED.corners + 5.0), "outer cage must contain the inner cage"),
        (changed(LATTICE, {"inner": {"type": "lattice", "shape": [2, 3, 9]}}), "2 to 8 control points"),
        (lattice_request([2, 3, 4], "cardinal"), "interpolation is one of bspline, linear, got 'cardinal'"),
        (
            changed(LATTICE, {"inner": {"type": "lattice", "shape": [2, 2, 2]}}),
            "lattice of 2 x 2 x 2 points, got 24",
        ),
        (
            changed(LATTICE, {"inner": {"type": "lattice", "shape": [2.0]}}),
            "shape of a lattice is 3 whole numbers",
        ),
    ],
)  # fmt: skip
def test_impossible_requests_name_the_cure(request_: Frame, message: str) -> None:
    deformer, _ = loaded()
    with pytest.raises(CagefieldError, match=message) as raised:
        deformer.reply(request_)
    assert "\n" not in str(raised.value)
    # The splats are as they were.
    assert deformer.reply(deform_request(INNER, INNER.corners)).header["count"] == 200


def test_splats_of_wrong_shapes_are_refused() -> None:
    arrays = splat_arrays(random_splats(5, degree=1))
    deformer = SplatDeformer()
    with pytest.raises(CagefieldError, match="no splats are open"):
        deformer.reply(MOVE)
    for name, values, message in (
        ("means", arrays["means"][:4], r"log_scales must be \[4, 3\]"),
        ("means", with_nan(arrays["means"], 2), "means must be finite, splat 2 of 5 is not"),
        ("sh", arrays["sh"][:, :3], r"sh must be \[5, 1\|4\|9\|16\|25, 3\]"),
        ("opacities", arrays["opacities"] + 1.0, r"opacities must lie in \[0, 1\]"),
        ("quaternions", arrays["quaternions"] * 0, "quaternion 0 of 5 is 0"),
        ("sh", arrays["sh"].astype(np.float64), "sh must be float32, got float64"),
    ):
        with pytest.raises(FieldError, match=message):
            deformer.reply(Frame({"request": "load"}, arrays | {name: values}))


# ---- the add-on's connection ----


@pytest.mark.nightly
def test_of_requests_that_wait_only_the_newest_is_sent() -> None:
    client = addon_module("worker")
    client.START_TIMEOUT_S = TIMEOUT_S
    worker, version = client.started(sys.executable)
    try:
        assert version == cagefield.__version__
        reply, _ = worker.ask({"request": "load"}, splat_arrays(random_splats(50, degree=0)))
        assert reply["count"] == 50
        answers: list[tuple[int, Any]] = []
        for step in range(4):  # the first is on its way before the others come
            request = deform_request(INNER, INNER.translate((0.1 * step, 0, 0)).corners)

            def done(header: Any, arrays: Any, step: int = step) -> None:
                answers.append((step, arrays["means"]))

            worker.submit(dict(request.header), dict(request.arrays), done, channel="live")
        while worker.is_busy:
            worker.poll()
            time.sleep(0.01)
        assert [step for step, _ in answers] == [0, 3]
        newest = worker.ask(dict(request.header), dict(request.arrays))[1]["means"]
        np.testing.assert_array_equal(answers[1][1], newest)
        with pytest.raises(client.WorkerError, match="no inner cage is given"):
            worker.ask({"request": "deform", "kind": "move"})
        worker.submit({"request": "hello"}, {}, lambda *_: None)
        worker._process.kill()
        with pytest.raises(client.WorkerError, match="the process of cagefield has ended"):
            while True:
                worker.poll()
                time.sleep(0.01)
        assert not worker.is_running
    finally:
        worker.close()


def test_an_interpreter_without_cagefield_is_named_with_the_cure(tmp_path: Path) -> None:
    client = addon_module("worker")
    client.START_TIMEOUT_S = TIMEOUT_S
    with pytest.raises(
        client.WorkerError, match="no Python with cagefield is chosen; set it in the add-on's"
    ):
        client.started("")
    with pytest.raises(client.WorkerError, match="no-python does not start"):
        client.started(str(tmp_path / "no-python"))
    bare = tmp_path / "python"
    bare.write_text(f'#!/bin/sh\nexec "{sys.executable}" -I -S "$@"\n')
    bare.chmod(0o755)
    with pytest.raises(
        client.WorkerError, match=r"has no cagefield; install it with .*-m pip install cagefield"
    ):
        client.started(str(bare))


# ---- the process ----


def test_the_process_answers_refuses_and_goes_on(tmp_path: Path) -> None:
    splats = random_splats(120, degree=2)
    request = deform_request(INNER, MOVED.corners, id=7)
    with running_worker() as worker:
        hello = worker.ask(Frame({"request": "hello", "id": 1}))
        assert hello.header["id"] == 1 and hello.header["protocol"] == 1
        assert worker.ask(request).header == {
            "id": 7,
            "error": "no splats are open; open a scene or a splat file first",
        }
        assert worker.ask(Frame({"request": "load", "id": 2}, splat_arrays(splats))).header["count"] == 120
        reply = worker.ask(request)
        inside_out = worker.ask(changed(request, inner_target=INSIDE_OUT))
        assert "inner cage as it is now" in inside_out.header["error"] and not inside_out.arrays
        again = worker.ask(request)
        assert worker.process.stdin is not None
        worker.process.stdin.close()
        assert worker.process.wait(timeout=TIMEOUT_S) == 0
    edits = EditStack([edit_from_request(request)])
    expected = edited_splats(scene_of_splats(splats).with_edits(edits))
    for name in SPLAT_ARRAYS:
        assert reply.arrays[name].tobytes() == getattr(expected, name).tobytes()
        assert again.arrays[name].tobytes() == reply.arrays[name].tobytes()


@pytest.mark.parametrize(
    "content",
    nightly_after_first([MALFORMED[1][0], MALFORMED[0][0], raw(listing(["a", "object", [1]]))]),
)
def test_a_malformed_frame_ends_the_process_with_one_line(content: bytes) -> None:
    done = subprocess.run(COMMAND, input=content, capture_output=True, timeout=TIMEOUT_S)
    assert done.returncode == 2
    lines = done.stderr.decode().splitlines()
    assert len(lines) == 1 and lines[0].startswith("cagefield: ")
    reply = read_frame(io.BytesIO(done.stdout))
    assert reply is not None
    assert reply.header == {"id": None, "error": lines[0].removeprefix("cagefield: ")}


def test_wrong_arguments_are_refused() -> None:
    done = subprocess.run([*COMMAND, "--parent", "me"], capture_output=True, text=True, timeout=TIMEOUT_S)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "usage: python -m cagefield.integrations.splat_worker [--parent PID]\n"


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the signal of an ended parent is Linux's")
def test_the_process_ends_when_its_parent_is_killed() -> None:
    """The worker's standard input stays open in this process: only the signal can end it."""
    parent_code = f"""
import os, subprocess, sys
worker = subprocess.Popen({list(COMMAND)!r} + ["--parent", str(os.getpid())], stdin=0, stdout=subprocess.PIPE)
worker.stdout.read(1)
print(worker.pid, flush=True)
worker.wait()
"""
    parent = subprocess.Popen(
        [sys.executable, "-c", parent_code], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    with parent:
        assert parent.stdin is not None and parent.stdout is not None
        write_frame(parent.stdin, Frame({"request": "hello"}))
        number = int(parent.stdout.readline())
        assert is_running(number)
        parent.send_signal(signal.SIGKILL)
        parent.wait()
        for _ in range(600):
            if not is_running(number):
                break
            time.sleep(0.1)
        assert not is_running(number)


def is_running(process: int) -> bool:
    """True for a process that exists and is no zombie."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
