"""Splat files in PLY: both layouts against independent encoders, real files, and damage in one line."""

from __future__ import annotations

import os
import tracemalloc
import warnings
from pathlib import Path

import numpy as np
import pytest

from cagefield.errors import FieldError
from cagefield.files.ply import read_ply
from cagefield.formats.splats.splat_files import read_splats, write_splats
from scenes import SH_C0
from splat_scenes import assert_same_splats, ball_of_splats, random_splats

SHARED = Path(__file__).resolve().parents[2] / "shared" / "data" / "splats"


def header(*lines: str, kind: str = "binary_little_endian") -> bytes:
    return "\n".join(["ply", f"format {kind} 1.0", *lines, "end_header", ""]).encode()


def columns_of(field) -> dict[str, np.ndarray]:
    """The columns of 3DGS' layout, one by one."""
    columns = {name: field.means[:, i] for i, name in enumerate("xyz")}
    columns |= {f"f_dc_{c}": field.sh[:, 0, c] for c in range(3)}
    above = field.sh.shape[1] - 1
    columns |= {f"f_rest_{c * above + k}": field.sh[:, 1 + k, c] for c in range(3) for k in range(above)}
    columns["opacity"] = np.log(field.opacities / (1.0 - field.opacities))
    columns |= {f"scale_{i}": field.log_scales[:, i] for i in range(3)}
    columns |= {f"rot_{i}": 3.0 * field.quaternions[:, i] for i in range(4)}
    return columns


def write_columns(path: Path, columns: dict[str, np.ndarray], order: str = "<", comments=()) -> None:
    count = len(columns["x"])
    kind = {"<": "binary_little_endian", ">": "binary_big_endian", "a": "ascii"}[order]
    lines = [f"comment {comment}" for comment in comments]
    lines += [f"element vertex {count}", *(f"property float {name}" for name in columns)]
    table = np.stack(list(columns.values()), axis=1)
    if order == "a":
        body = "\n".join(" ".join(map(repr, row)) for row in table.astype(float).tolist()).encode() + b"\n"
    else:
        body = table.astype(order + "f4").tobytes()
    path.write_bytes(header(*lines, kind=kind) + body)


@pytest.mark.parametrize("degree", [0, 1, 2, 3, 4])
def test_what_is_written_is_read(tmp_path: Path, degree: int) -> None:
    field = random_splats(degree=degree)
    write_splats(field, tmp_path / "a.ply")
    # opacity goes through a logit in float32: 1e-6; one of 1 comes back as 1 - 1e-7
    assert_same_splats(read_splats(tmp_path / "a.ply"), field, atol=2e-6)
    written = read_ply(tmp_path / "a.ply").elements["vertex"]
    for name, expected in columns_of(field).items():
        scale = 3.0 if name.startswith("rot") else 1.0
        if name != "opacity":
            np.testing.assert_allclose(written[name] * scale, expected, rtol=1e-6, err_msg=name)


@pytest.mark.parametrize("order", ["<", ">", "a"])
def test_any_order_of_columns_and_others_beside_them(tmp_path: Path, order: str) -> None:
    field = random_splats(20, degree=3)
    columns = columns_of(field) | {"transform": np.arange(20.0), "nx": np.zeros(20)}
    names = np.random.default_rng(3).permutation(list(columns)).tolist()
    write_columns(tmp_path / "a.ply", {name: columns[name] for name in names}, order)
    assert_same_splats(read_splats(tmp_path / "a.ply"), field, atol=2e-6)


def test_a_mesh_s_faces_may_follow(tmp_path: Path) -> None:
    field = random_splats(5, degree=0)
    columns = columns_of(field)
    lines = ["element vertex 5", *(f"property float {name}" for name in columns)]
    lines += ["element face 1", "property list uchar int vertex_index"]
    table = np.stack(list(columns.values()), axis=1).astype("<f4").tobytes()
    (tmp_path / "a.ply").write_bytes(header(*lines) + table + b"\x03" + bytes(12))
    assert_same_splats(read_splats(tmp_path / "a.ply"), field, atol=2e-6)


@pytest.mark.parametrize(
    ("comments", "antialiased"),
    [
        ((), False),
        (("SplatRenderMode: mip",), True),
        (("antialiased 1",), True),
        (("antialiased: 0", "SplatRenderMode: default"), False),
    ],
)
def test_comments_say_which_filter_the_splats_want(
    tmp_path: Path, comments: tuple[str, ...], antialiased: bool
) -> None:
    write_columns(tmp_path / "a.ply", columns_of(random_splats(4)), comments=comments)
    field = read_splats(tmp_path / "a.ply")
    assert field.antialiased is antialiased
    write_splats(field, tmp_path / "b.ply")
    assert read_splats(tmp_path / "b.ply").antialiased is antialiased


def test_flat_splats_and_byte_colors(tmp_path: Path) -> None:
    columns = columns_of(random_splats(4, degree=0))
    columns.pop("scale_2")
    for index, name in enumerate(("red", "green", "blue")):
        columns.pop(f"f_dc_{index}")
        columns[name] = np.array([0.0, 51.0, 102.0, 255.0])
    write_columns(tmp_path / "a.ply", columns)
    field = read_splats(tmp_path / "a.ply")
    np.testing.assert_allclose(0.5 + SH_C0 * field.sh[:, 0, 1], [0.0, 0.2, 0.4, 1.0], atol=1e-6)
    thin = np.exp(field.log_scales[:, 2] - field.log_scales[:, :2].min(axis=1))
    np.testing.assert_allclose(thin, 1e-3, rtol=1e-5)


def test_splats_without_numbers_are_left_out_with_a_warning(tmp_path: Path) -> None:
    field = random_splats(6)
    columns = columns_of(field)
    columns["y"] = np.where(np.arange(6) == 2, np.nan, columns["y"])
    columns["scale_1"] = np.where(np.arange(6) == 4, np.inf, columns["scale_1"])
    columns["scale_0"] = np.where(np.arange(6) == 5, -np.inf, columns["scale_0"])
    for i in range(4):
        columns[f"rot_{i}"] = np.where(np.arange(6) == 0, 0.0, columns[f"rot_{i}"])
    columns["opacity"] = np.where(np.arange(6) == 1, np.inf, columns["opacity"])
    write_columns(tmp_path / "a.ply", columns)
    with pytest.warns(UserWarning, match="2 of 6 splats hold no numbers and are left out"):
        read = read_splats(tmp_path / "a.ply")
    np.testing.assert_array_equal(read.means, field.means[[0, 1, 3, 5]])
    np.testing.assert_array_equal(read.quaternions[0], (1, 0, 0, 0))
    assert read.opacities[1] == 1.0 and read.log_scales[3, 0] == -30.0


def packed(field, with_colors: bool, rest: np.ndarray | None = None) -> tuple[bytes, int]:
    """A compressed file of the field, value by value and bit by bit, and the bytes before its vertices."""
    chunks = [slice(start, start + 256) for start in range(0, len(field), 256)]
    rgb = 0.5 + SH_C0 * field.sh[:, 0]
    chunk_rows, words = [], []
    for rows in chunks:
        limits = []
        for values in (field.means[rows], field.log_scales[rows], rgb[rows])[: 3 if with_colors else 2]:
            limits.append((values.min(axis=0), values.max(axis=0)))
        chunk_rows.append(np.concatenate([np.concatenate(pair) for pair in limits]))
        for n in range(rows.start, min(rows.stop, len(field))):

            def share(values, index, n=n, limits=limits):
                low, high = limits[index]
                return (values[n] - low) / np.maximum(high - low, 1e-9)

            def bits(fraction, width):
                return round(float(np.clip(fraction, 0, 1)) * (2**width - 1))

            p, s = share(field.means, 0), share(field.log_scales, 1)
            c = share(rgb, 2) if with_colors else rgb[n]
            q = field.quaternions[n] * np.sign(field.quaternions[n][np.abs(field.quaternions[n]).argmax()])
            largest = int(np.abs(q).argmax())
            rotation = largest
            for value in np.delete(q, largest):
                rotation = rotation << 10 | bits(value / np.sqrt(2.0) + 0.5, 10)
            words.append(
                (
                    bits(p[0], 11) << 21 | bits(p[1], 10) << 11 | bits(p[2], 11),
                    rotation,
                    bits(s[0], 11) << 21 | bits(s[1], 10) << 11 | bits(s[2], 11),
                    bits(c[0], 8) << 24
                    | bits(c[1], 8) << 16
                    | bits(c[2], 8) << 8
                    | bits(field.opacities[n], 8),
                )
            )
    names = [f"{end}_{axis}" for end in ("min", "max") for axis in "xyz"]
    names += [f"{end}_scale_{axis}" for end in ("min", "max") for axis in "xyz"]
    names += [f"{end}_{axis}" for end in ("min", "max") for axis in "rgb"] if with_colors else []
    lines = [f"element chunk {len(chunks)}", *(f"property float {name}" for name in names)]
    lines += [f"element vertex {len(field)}"]
    lines += [f"property uint packed_{name}" for name in ("position", "rotation", "scale", "color")]
    body = np.array(words, "<u4").tobytes()
    if rest is not None:
        lines += [f"element sh {len(field)}", *(f"property uchar f_rest_{k}" for k in range(rest.shape[1]))]
        body += rest.astype(np.uint8).tobytes()
    before = header(*lines) + np.array(chunk_rows, "<f4").tobytes()
    return before + body, len(before)


@pytest.mark.parametrize("with_colors", [False, True])
def test_compressed_files(tmp_path: Path, with_colors: bool) -> None:
    field = random_splats(300, degree=1, seed=4)
    rest = np.random.default_rng(5).integers(0, 256, (300, 9))
    data, _ = packed(field, with_colors, rest)
    (tmp_path / "a.ply").write_bytes(data)
    read = read_splats(tmp_path / "a.ply")
    # half a step of 10 bits over the box of 2, over the logarithms' range of 2.7
    np.testing.assert_allclose(read.means, field.means, atol=2.0 / 1023 / 2 + 1e-6)
    np.testing.assert_allclose(read.log_scales, field.log_scales, atol=2.8 / 1023 / 2 + 1e-6)
    np.testing.assert_allclose(read.opacities, field.opacities, atol=0.5 / 255 + 1e-6)
    same = np.abs((read.quaternions * field.quaternions).sum(axis=1))
    assert same.min() > 1.0 - 3 * (np.sqrt(2.0) / 1023) ** 2
    shown, expected = (0.5 + SH_C0 * one.sh[:, 0] for one in (read, field))
    if not with_colors:
        expected = np.clip(expected, 0.0, 1.0)
    np.testing.assert_allclose(shown, expected, atol=0.5 / 255 + 1e-6)
    # f_rest of green, first harmonic of degree 1: column 3
    inner = (rest[:, 3] > 0) & (rest[:, 3] < 255)
    np.testing.assert_allclose(read.sh[inner, 1, 1], (rest[inner, 3] + 0.5) / 32.0 - 4.0, atol=1e-6)
    np.testing.assert_array_equal(read.sh[rest[:, 3] == 255, 1, 1], 4.0)


def cut(data: bytes) -> bytes:
    return data[:-100]


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (cut, "it says 40 of vertex, and holds 39; it is truncated, copy it again"),
        (lambda data: data[:200], "its header has no end; the file may be truncated"),
        (lambda data: b"plx" + data, "not a PLY file; give a .ply of splats"),
        (lambda data: b"", "not a PLY file"),
        (
            lambda data: data.replace(b"property float opacity", b"property list uchar int opacity"),
            "lack x, y",
        ),
        (
            lambda data: data.replace(b"float opacity", b"float something"),
            "no file of splats, its vertices lack opacity; export it again with them",
        ),
        (lambda data: data.replace(b"float f_rest_23", b"float g_rest_23"), "it has 23 columns f_rest_"),
        (lambda data: data.replace(b"float opacity", b"real opacity"), "'property real opacity'"),
        (lambda data: data.replace(b"float opacity", b"float x"), "'property float x'"),
        (lambda data: data.replace(b"vertex 40", b"vertex -1"), "'element vertex -1'"),
        (lambda data: data.replace(b"vertex 40", b"vertex 0"), "holds no splat that can be shown"),
        (lambda data: data.replace(b"vertex 40", b"vertex 4000000000000"), "truncated"),
        (lambda data: data.replace(b"binary_little_endian", b"packed"), "names no format that PLY has"),
    ],
)
def test_damaged_files_are_one_line(tmp_path: Path, damage, message: str) -> None:
    write_splats(random_splats(), tmp_path / "a.ply")
    (tmp_path / "a.ply").write_bytes(damage((tmp_path / "a.ply").read_bytes()))
    with pytest.raises(FieldError, match=r"a\.ply: .*" + message) as caught:
        read_splats(tmp_path / "a.ply")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b"uint packed_scale", b"uint packed_other", "a compressed file that lacks packed_scale"),
        (b"float max_scale_x", b"float max_other__x", "a compressed file that lacks max_scale_x"),
        (b"element vertex 300", b"element vertex 200", "2 chunks for 200 splats, expected 1"),
        (b"element sh 300", b"element sh 299", "its harmonics are not those of 300 splats"),
        (b"f_rest_8", b"g_rest_8", "it has 8 columns f_rest_"),
    ],
)
def test_damaged_compressed_files_are_one_line(tmp_path: Path, old: bytes, new: bytes, message: str) -> None:
    data, _ = packed(random_splats(300, degree=0), True, np.full((300, 9), 128))
    assert data.count(old) == 1
    (tmp_path / "a.ply").write_bytes(data.replace(old, new))
    with pytest.raises(FieldError, match=message):
        read_splats(tmp_path / "a.ply")


def test_truncated_ascii_and_missing_files(tmp_path: Path) -> None:
    write_columns(tmp_path / "a.ply", columns_of(random_splats(4)), "a")
    text = (tmp_path / "a.ply").read_bytes()
    (tmp_path / "a.ply").write_bytes(text[: len(text) - 30])
    with pytest.raises(FieldError, match="4 rows of vertex are not 38 numbers each"):
        read_splats(tmp_path / "a.ply")
    with pytest.raises(FieldError, match="no such file; give a"):
        read_splats(tmp_path / "b.ply")


@pytest.mark.skipif(not SHARED.is_dir(), reason="../shared/data/splats is not there")
def test_files_that_others_wrote() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        biker = read_splats(SHARED / "biker.compressed.ply")
        tiny = read_splats(SHARED / "tiny_gauss.ply")
    with pytest.warns(UserWarning, match=r"left out: 1 column \(transform\)"):
        fruit = read_splats(SHARED / "fruit_drops_minimal.ply")
    assert (len(biker), biker.sh_degree) == (152_746, 0)
    assert (len(fruit), fruit.sh_degree) == (4_721, 3)
    assert (len(tiny), tiny.sh_degree) == (1_432, 3)
    # The rider stands on the ground, y points down.
    assert -3.3 < biker.means[:, 1].min() < -3.0 and -0.01 < biker.means[:, 1].max() < 0.01
    assert not tiny.sh[:, 1:].any() and fruit.sh[:, 9:].any()
    np.testing.assert_allclose(tiny.opacities, 0.95, atol=1e-6)


@pytest.mark.skipif(os.name != "posix", reason="files with holes are POSIX's")
def test_a_row_of_text_without_an_end_is_not_read_to_its_own(tmp_path: Path) -> None:
    """20 GB of zeros where rows of text should be: one line that says so, at once."""
    write_splats(ball_of_splats(3), tmp_path / "a.ply")
    header, _, _ = (tmp_path / "a.ply").read_bytes().partition(b"end_header\n")
    file = tmp_path / "text.ply"
    file.write_bytes(header.replace(b"binary_little_endian", b"ascii") + b"end_header\n")
    os.truncate(file, 20 << 30)
    tracemalloc.start()
    try:
        with pytest.raises(FieldError, match="its 3 rows of vertex are not 17 numbers each"):
            read_splats(file)
        assert tracemalloc.get_traced_memory()[1] < 8 << 20
    finally:
        tracemalloc.stop()
