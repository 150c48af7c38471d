"""Splat files by what they hold: contents under other names, colors of all types, coordinates far away."""

from __future__ import annotations

import gzip
import json
import os
import shutil
import warnings
import zipfile
from pathlib import Path

import numpy as np
import pytest

from cagefield import Scene
from cagefield.errors import FieldError
from cagefield.fields.meshing import Mesh
from cagefield.fields.sh import C0
from cagefield.fields.splat_field import SplatField
from cagefield.files.ply import read_ply
from cagefield.formats.mesh_files import write_mesh, write_points
from cagefield.formats.splats.gltf_buffers import GltfAsset
from cagefield.formats.splats.splat_files import convert_splats, read_splats, write_splats
from commands import printed, refused
from gltf_assets import scene_of
from splat_damage import ksplat_of, sample_file
from splat_scenes import assert_same_splats, random_splats

PLY_TYPES = {"f4": "float", "f8": "double", "u1": "uchar", "u2": "ushort", "i4": "int"}


def columns_of(count: int = 6) -> dict[str, np.ndarray]:
    """Columns of splats of scale .05 and opacity .8 without colors."""
    chance = np.random.default_rng(0)
    columns = dict(zip("xyz", chance.uniform(-1, 1, (3, count)), strict=True))
    columns |= {"opacity": np.full(count, np.log(4.0)), "rot_0": np.ones(count)}
    columns |= {f"rot_{n}": np.zeros(count) for n in (1, 2, 3)}
    return columns | {f"scale_{n}": np.full(count, np.log(0.05)) for n in range(3)}


def write_ply(
    path: Path,
    columns: dict[str, np.ndarray],
    types: dict[str, str] | None = None,
    more: str = "",
    tail: bytes = b"",
    is_text: bool = False,
) -> Path:
    """A PLY of columns, float but for `types`; `more` elements with the bytes `tail` behind it."""
    types = {name: (types or {}).get(name, "f4") for name in columns}
    count = len(columns["x"])
    head = ["ply", f"format {'ascii' if is_text else 'binary_little_endian'} 1.0", f"element vertex {count}"]
    head += [f"property {PLY_TYPES[code]} {name}" for name, code in types.items()]
    rows = np.zeros(count, [(name, "<" + code) for name, code in types.items()])
    for name, values in columns.items():
        rows[name] = values
    body = rows.tobytes()
    if is_text:
        body = "".join(" ".join(f"{value:.17g}" for value in row) + "\n" for row in rows.tolist()).encode()
    path.write_bytes(
        "\n".join([*head, *more.split("\n"), "end_header\n"]).replace("\n\n", "\n").encode() + body + tail
    )
    return path


# ---- contents under other names ----


def test_a_ply_named_splat_is_read_as_ply(tmp_path: Path) -> None:
    """Also where its size is a multiple of 32, the size of a row of .splat."""
    field = random_splats(64, degree=0)
    write_splats(field, tmp_path / "a.ply")
    content = (tmp_path / "a.ply").read_bytes()
    padding = b"comment " + b"x" * ((-len(content) - 9) % 32) + b"\n"
    content = content.replace(b"element vertex", padding + b"element vertex", 1)
    assert len(content) % 32 == 0
    (tmp_path / "renamed.splat").write_bytes(content)
    with pytest.warns(UserWarning, match=r"renamed\.splat: its content is a PLY, not what its name says"):
        assert_same_splats(read_splats(tmp_path / "renamed.splat"), field, atol=1e-6)


SAMPLES = (".ply", ".compressed.ply", "-text.ply", ".spz", "-4.spz", ".sog", ".ksplat", ".glb")


@pytest.mark.parametrize("wrong", [".ply", ".splat", ".spz", ".sog", ".glb", ".ksplat", ".gltf", ".zip", ""])
@pytest.mark.parametrize("right", SAMPLES)
def test_any_format_is_read_under_any_name(tmp_path: Path, right: str, wrong: str) -> None:
    field = random_splats(40, degree=1)
    content = sample_file(field, tmp_path, right)
    (tmp_path / f"right{right}").write_bytes(content)
    (tmp_path / f"wrong{wrong}").write_bytes(content)
    expected = read_splats(tmp_path / f"right{right}")
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always", UserWarning)
        assert_same_splats(read_splats(tmp_path / f"wrong{wrong}"), expected)
    lines = [str(w.message) for w in said if issubclass(w.category, UserWarning)]
    assert len(lines) == (not right.endswith(wrong) or not wrong), lines
    assert all("its content is a" in line and "it is read as that" in line for line in lines)


def test_an_spz_named_ply_is_imported(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "a.ply").write_bytes(sample_file(random_splats(40), tmp_path, ".spz"))
    printed(capsys, "import", tmp_path / "a.ply", "-o", tmp_path / "scene")
    assert len(Scene.open(tmp_path / "scene").field) == 40  # type: ignore[arg-type]


def other_files() -> dict[str, bytes]:
    chance = np.random.default_rng(5)
    return {
        "random": chance.integers(0, 256, 32 * 500, np.uint8).tobytes(),
        "zeros": bytes(32 * 100),
        "text": b"0.125 0.25 0.375 0.5 0.625 0.75\n" * 64,
        "floats": chance.normal(size=8 * 400).astype("<f4").tobytes(),
        "png": b"\x89PNG\r\n\x1a\n" + chance.integers(0, 256, 1000, np.uint8).tobytes()[:984],
        "json": b'{"frames": [], "camera_angle_x": 0.5}'.ljust(64),
        "gzip of zeros": gzip.compress(bytes(1000)),
    }


@pytest.mark.parametrize("name", other_files())
@pytest.mark.parametrize("ending", [".splat", ".ply", ".spz", ".glb", ".sog", ".ksplat"])
def test_other_contents_are_refused_in_a_line(tmp_path: Path, ending: str, name: str) -> None:
    path = tmp_path / f"a{ending}"
    path.write_bytes(other_files()[name])
    with pytest.raises(FieldError, match=r"a\.") as caught:
        read_splats(path)
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 400


def test_real_rows_pass_and_few_bad_ones_do_not_refuse_them(tmp_path: Path) -> None:
    content = bytearray(sample_file(random_splats(40, degree=0), tmp_path, ".splat"))
    content[12:16] = np.float32(-1.0).tobytes()
    (tmp_path / "a.splat").write_bytes(content)
    with pytest.warns(UserWarning, match="1 of 40 splats hold no numbers and are left out"):
        assert len(read_splats(tmp_path / "a.splat")) == 39


def test_point_clouds_and_meshes_say_what_can_be_done(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    points = {axis: np.arange(3.0) for axis in "xyz"} | {c: np.arange(3) for c in ("red", "green", "blue")}
    types = dict.fromkeys(("red", "green", "blue"), "u1")
    write_ply(tmp_path / "points.ply", points, types)
    line = "a point cloud of 3 points, no splats .*it serves `cagefield train` .* ply_file_path"
    with pytest.raises(FieldError, match=line):
        read_splats(tmp_path / "points.ply")
    faces = "element face 1\nproperty list uchar int vertex_indices"
    write_ply(tmp_path / "mesh.ply", points, types, faces, b"\3" + np.arange(3, dtype="<i4").tobytes())
    (tmp_path / "mesh.obj").write_text("# made\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    for name in ("mesh.ply", "mesh.obj"):
        message = refused(capsys, "import", tmp_path / name, "-o", tmp_path / "scene")
        assert "a mesh of triangles, no field; render photos of it and train on them" in message
    assert not (tmp_path / "scene").exists()


# ---- colors ----

RGB = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0.5, 0.5, 0.5], [1, 1, 1], [0.04, 0.08, 0.12]])


@pytest.mark.parametrize("is_text", [False, True])
@pytest.mark.parametrize(
    ("code", "full", "step"),
    [("u1", 255, 255), ("u2", 65535, 65535), ("f4", 1, 1e9), ("f4", 255, 1e9), ("f8", 1, 1e9)],
)
def test_colors_of_every_type(tmp_path: Path, code: str, full: int, step: float, is_text: bool) -> None:
    values = RGB * full if code[0] == "f" else np.round(RGB * full)
    columns = columns_of() | {name: values[:, n] for n, name in enumerate(("red", "green", "blue"))}
    path = write_ply(
        tmp_path / "a.ply", columns, dict.fromkeys(("red", "green", "blue"), code), is_text=is_text
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        found = read_splats(path)
    np.testing.assert_allclose(0.5 + C0 * found.sh[:, 0], RGB, atol=0.5 / step + 1e-6)


# ---- what is left out ----


def test_columns_and_elements_that_are_left_out_are_named(tmp_path: Path) -> None:
    columns = columns_of() | {f"f_dc_{n}": np.zeros(6) for n in range(3)}
    columns |= {"semantic": np.zeros(6), "confidence": np.zeros(6), "nx": np.zeros(6)}
    more = "element intrinsic 9\nproperty float intrinsic\nelement version 3\nproperty uchar version"
    path = write_ply(tmp_path / "a.ply", columns, None, more, bytes(39))
    line = (
        r"a\.ply: left out: 2 columns \(semantic, confidence\) and "
        r"2 elements \(rows: intrinsic 9, version 3\)"
    )
    with pytest.warns(UserWarning, match=line):
        assert len(read_splats(path)) == 6


def test_splats_that_are_left_out_are_counted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    columns = columns_of() | {f"f_dc_{n}": np.zeros(6) for n in range(3)}
    columns["x"][1], columns["scale_1"][2], columns["f_dc_0"][3] = np.nan, np.inf, -np.inf
    columns["opacity"][4], columns["scale_2"][5] = np.inf, -np.inf  # opaque, and flat
    path = write_ply(tmp_path / "a.ply", columns)
    with pytest.warns(UserWarning, match="3 of 6 splats hold no numbers and are left out"):
        found = read_splats(path)
    np.testing.assert_allclose(found.opacities, [0.8, 1.0, 0.8], atol=1e-6)
    printed(capsys, "convert", path, tmp_path / "b.spz")


# ---- coordinates far from the origin ----

FAR = np.array([500123.25, 5412345.5, 312.0])


def far_ply(path: Path, count: int = 500, is_text: bool = False) -> np.ndarray:
    """Splats of .02 in a file of doubles in UTM coordinates, which are returned."""
    columns = columns_of(count) | {f"f_dc_{n}": np.zeros(count) for n in range(3)}
    columns |= {f"scale_{n}": np.full(count, np.log(0.02)) for n in range(3)}
    for axis, far in zip("xyz", FAR, strict=True):
        columns[axis] = columns[axis] + far
    write_ply(path, columns, dict.fromkeys("xyz", "f8"), is_text=is_text)
    if is_text:  # some programs write more digits than the type that they name
        path.write_bytes(path.read_bytes().replace(b"property double", b"property float"))
    return np.stack([columns[axis] for axis in "xyz"], axis=1)


@pytest.mark.parametrize("is_text", [False, True])
def test_far_coordinates_come_back_on_export(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], is_text: bool
) -> None:
    places = far_ply(tmp_path / "utm.ply", is_text=is_text)
    with pytest.warns(UserWarning, match="its coordinates are far from the origin"):
        field = read_splats(tmp_path / "utm.ply")
    assert np.abs(field.means).max() < 3.0
    np.testing.assert_allclose(field.means.astype(float) + field.offset, places, atol=1e-6)
    printed(capsys, "import", tmp_path / "utm.ply", "-o", tmp_path / "scene", "--up", "z-up")
    scene = Scene.open(tmp_path / "scene")
    assert isinstance(scene.field, SplatField) and scene.field.offset == field.offset
    printed(capsys, "export", tmp_path / "scene", "-o", tmp_path / "b.ply", "--up", "y-down")
    vertex = read_ply(tmp_path / "b.ply").elements["vertex"]
    assert vertex["x"].dtype == np.float64 and vertex["scale_0"].dtype == np.float32
    np.testing.assert_allclose(np.stack([vertex[axis] for axis in "xyz"], axis=1), places, atol=1e-6)
    # Turned upright, (x, y, z) becomes (x, -z, y): of the file's coordinates too.
    printed(capsys, "export", tmp_path / "scene", "-o", tmp_path / "c.ply")
    vertex = read_ply(tmp_path / "c.ply").elements["vertex"]
    x, y, z = (vertex[axis] for axis in "xyz")
    np.testing.assert_allclose(np.stack([x, z, -y], axis=1), places, atol=1e-6)


def test_meshes_and_points_have_the_offset(tmp_path: Path) -> None:
    places, faces = np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.int32)
    mesh = Mesh(places, np.eye(3, dtype=np.float32), np.full((3, 3), 0.5, np.float32), faces)
    offset = (500123.0, 5412345.0, 312.0)
    write_mesh(tmp_path / "a.ply", mesh, offset=offset)
    write_points(tmp_path / "b.ply", places, mesh.rgb, offset=offset)
    for name in ("a.ply", "b.ply"):
        vertex = read_ply(tmp_path / name).elements["vertex"]
        np.testing.assert_array_equal(np.stack([vertex[axis] for axis in "xyz"], axis=1), places + offset)
    write_mesh(tmp_path / "c.glb", mesh, offset=offset)  # z up becomes y: (x, y, z) -> (x, z, -y)
    node = GltfAsset(tmp_path / "c.glb").items("nodes")[0]
    np.testing.assert_allclose(node["translation"], [500123, 312, -5412345], atol=1e-6)


@pytest.mark.parametrize("ending", [".ply", ".glb"])
def test_convert_keeps_far_coordinates(tmp_path: Path, ending: str) -> None:
    places = far_ply(tmp_path / "utm.ply")
    with pytest.warns(UserWarning, match="far from the origin"):
        convert_splats(tmp_path / "utm.ply", tmp_path / f"b{ending}")
        found = read_splats(tmp_path / f"b{ending}")
    np.testing.assert_allclose(found.means.astype(float) + found.offset, places, atol=1e-6)


@pytest.mark.parametrize("ending", [".compressed.ply", ".spz", ".sog", ".splat"])
def test_formats_of_float32_say_that_the_offset_is_left_out(tmp_path: Path, ending: str) -> None:
    far_ply(tmp_path / "utm.ply")
    with pytest.warns(UserWarning, match=r"without the offset \(500123, 541234\d, 31\d\), in PLY's axes"):
        convert_splats(tmp_path / "utm.ply", tmp_path / f"b{ending}")
    found = read_splats(tmp_path / f"b{ending}")
    assert np.abs(found.means).max() < 3.0 and not any(found.offset)


def test_near_doubles_and_floats_keep_their_coordinates(tmp_path: Path) -> None:
    columns = columns_of() | {f"f_dc_{n}": np.zeros(6) for n in range(3)}
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        near = read_splats(write_ply(tmp_path / "a.ply", columns, dict.fromkeys("xyz", "f8")))
        columns["x"] = columns["x"] + 1e6  # float32 holds no more: nothing is lost
        float32 = read_splats(write_ply(tmp_path / "b.ply", columns))
    assert not any(near.offset) and not any(float32.offset)


def test_a_field_keeps_its_offset(tmp_path: Path) -> None:
    field = random_splats(5)
    assert field.offset == (0.0, 0.0, 0.0)
    far = SplatField(
        field.means, field.log_scales, field.quaternions, field.opacities, field.sh, offset=(1.0, 2.5, -3e6)
    )
    far.take(np.arange(3)).save(tmp_path / "a.safetensors")
    assert SplatField.load(tmp_path / "a.safetensors").offset == (1.0, 2.5, -3e6)
    with pytest.raises(FieldError, match="offset must be 3 finite numbers"):
        SplatField(
            *(getattr(field, name) for name in ("means", "log_scales", "quaternions", "opacities", "sh")),
            offset=(np.nan, 0.0, 0.0),
        )


# ---- streamed SOG ----


def streamed(folder: Path) -> tuple[SplatField, SplatField]:
    """A streamed SOG of two leaves; (its finest level, its surroundings)."""
    fine, coarse, around = random_splats(300), random_splats(60, seed=1), random_splats(20, degree=0, seed=2)
    parts = {
        "0_0": fine.take(np.arange(200)),
        "0_1": fine.take(np.arange(200, 300)),
        "1_0": coarse,
        "env": around,
    }
    found = {}
    for name, part in parts.items():
        (folder / name).mkdir(parents=True)
        write_splats(part, folder / f"{name}.sog")
        with zipfile.ZipFile(folder / f"{name}.sog") as archive:
            archive.extractall(folder / name)
        (folder / f"{name}.sog").unlink()
        found[name] = read_splats(folder / name)
    box = {"min": [-1, -1, -1], "max": [1, 1, 1]}

    def leaf(*rows: tuple[int, int, int]) -> dict[str, object]:
        lods = {
            level: dict(zip(("file", "offset", "count"), row, strict=True)) for level, row in enumerate(rows)
        }
        return {"bound": box, "lods": lods}

    # The first leaf has rows 50.. of file 0 and ..30 of file 2; the second all of file 1, and 30.. of file 2.
    tree = {"bound": box, "children": [leaf((0, 50, 150), (2, 0, 30)), leaf((1, 0, 100), (2, 30, 30))]}
    names = ["0_0/meta.json", "0_1/meta.json", "1_0/meta.json"]
    meta = {"lodLevels": 2, "environment": "env/meta.json", "filenames": names, "tree": tree}
    (folder / "lod-meta.json").write_text(json.dumps(meta))
    return found["0_0"].take(np.arange(50, 200)), found["0_1"]


@pytest.mark.parametrize("name", ["", "lod-meta.json"])
def test_the_finest_level_of_a_streamed_sog_is_read(tmp_path: Path, name: str) -> None:
    first, second = streamed(tmp_path / "scene")
    with pytest.warns(
        UserWarning, match="the finest level is read, 270 splats; left out: 60 of coarser levels"
    ):
        found = read_splats(tmp_path / "scene" / name)
    assert (len(found), found.sh_degree) == (270, 2)
    assert_same_splats(found.take(np.arange(150)), first, atol=1e-7)
    assert_same_splats(found.take(np.arange(150, 250)), second, atol=1e-7)
    assert not found.sh[250:, 1:].any() and found.sh[250:, 0].any()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda meta: meta["filenames"].__setitem__(0, "../outside/meta.json"), "lies in another folder"),
        (lambda meta: meta["filenames"].__setitem__(0, "9_9/meta.json"), "it lacks 9_9/meta.json"),
        (
            lambda meta: meta["tree"]["children"][0]["lods"]["0"].update(count=151),
            "0_0 has 200 splats, 201 are",
        ),
        (lambda meta: meta["tree"]["children"][1]["lods"]["0"].update(file=0), "two leaves share row 50"),
        (
            lambda meta: meta["tree"]["children"][1]["lods"]["0"].update(offset=-1),
            "a leaf names 100 rows from -1",
        ),
        (lambda meta: meta["filenames"].__setitem__(1, "0_0/meta.json"), "two of its files have one name"),
        (lambda meta: meta.pop("filenames"), "known|no filenames"),
        (
            lambda meta: meta["tree"].update(children=[]) or meta.update(environment=None),
            "its finest level has 0",
        ),
    ],
)
def test_damaged_streamed_sogs_are_a_line(tmp_path: Path, change, message: str) -> None:
    streamed(tmp_path / "scene")
    shutil.copytree(tmp_path / "scene" / "0_0", tmp_path / "outside")
    file = tmp_path / "scene" / "lod-meta.json"
    meta = json.loads(file.read_text())
    change(meta)
    file.write_text(json.dumps(meta))
    with pytest.raises(FieldError, match=message) as caught:
        read_splats(tmp_path / "scene")
    assert "\n" not in str(caught.value)


def test_a_zip_of_a_streamed_sog_is_to_be_unpacked(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        archive.writestr("lod-meta.json", "{}")
    with pytest.raises(FieldError, match="a zip of a streamed SOG; unpack it and give its folder"):
        read_splats(tmp_path / "a.zip")


# ---- opened in the editor ----


def test_the_editor_opens_them_and_tells_what_is_left_out(tmp_path: Path) -> None:
    from cagefield.server.web.launch import open_scene

    streamed(tmp_path / "scene")
    with pytest.warns(UserWarning, match="finest level"):
        coordinator, _ = open_scene(tmp_path / "scene" / "lod-meta.json")
    try:
        assert coordinator.greeting is not None and "left out: 60 of coarser levels" in coordinator.greeting
        assert str(tmp_path) not in coordinator.greeting and len(coordinator.store.scene.field) == 270
    finally:
        coordinator.close()
    asset = scene_of(random_splats(30)).write(tmp_path / "a.gltf", "a.bin")
    from cagefield.server.web.splat_file_scene import scene_of_file

    before = scene_of_file(asset)
    content = bytearray((tmp_path / "a.bin").read_bytes())
    content[3] ^= 1
    (tmp_path / "a.bin").write_bytes(content)
    assert scene_of_file(asset) != before  # its buffer is part of its content
    assert os.path.isdir(before)


def test_ksplat_header_is_told_from_other_zeros(tmp_path: Path) -> None:
    content = ksplat_of(random_splats(12, degree=1))
    (tmp_path / "a.bin").write_bytes(content)
    with pytest.warns(UserWarning, match=r"its content is a \.ksplat, which its name does not say"):
        assert len(read_splats(tmp_path / "a.bin")) == 12
