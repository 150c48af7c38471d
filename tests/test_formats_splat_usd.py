"""USD files of splats: written and read here, and compared by usd-core's schema and by tinyusdz."""

from __future__ import annotations

import re
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cagefield.errors import FieldError
from cagefield.fields.sh import MAX_DEGREE
from cagefield.fields.splat_field import SplatField
from cagefield.formats.splats.axes import convert_axes
from cagefield.formats.splats.splat_files import convert_splats, read_splats, write_splats
from cagefield.formats.splats.splat_table import SplatBatch
from cagefield.formats.splats.usd import open_splat_usd
from cagefield.formats.splats.usd_stage import PRIM_TYPE, USD_AXES
from cagefield.formats.splats.usd_writer import USD_SUFFIXES
from cagefield.geometry.quaternions import rotation_matrices
from full_disks import files_up_to
from scenes import files_of
from splat_scenes import random_splats
from tiers import nightly_except

Usd: Any = pytest.importorskip("pxr.Usd", reason="USD is read by usd-core (extra usd)")
CLIPS = '( clips = { dictionary default = { string primPath = "/a" } } )'
SH = "radiance:sphericalHarmonicsCoefficients"


def in_usd_axes(field: SplatField) -> SplatBatch:
    """The splats with y up, by the conversion that SPZ and glTF are tested with."""
    batch = SplatBatch(field.means, field.log_scales, field.quaternions, field.opacities, field.sh)
    return convert_axes(batch, "rdf", "rub")


def prim_of(stage: Any) -> Any:
    (prim,) = (prim for prim in stage.Traverse() if prim.GetTypeName() == PRIM_TYPE)
    return prim


def text_of(prims: str, head: str = "") -> str:
    return f"#usda 1.0\n(\n{head}\n)\n{prims}\n"


def splat_prim(name: str = "a", body: str = "", head: str = "") -> str:
    """A red splat of scales .1, .2, .4 at (1, 2, 3), turned by a third of a turn: x to y, y to z."""
    return f"""def {PRIM_TYPE} "{name}" {head} {{
        point3f[] positions = [(1, 2, 3)]
        quatf[] orientations = [(0.5, 0.5, 0.5, 0.5)]
        float3[] scales = [(0.1, 0.2, 0.4)]
        float[] opacities = [0.5]
        float3[] {SH} = [(1, 0, 0)]
        uniform int radiance:sphericalHarmonicsDegree = 0
        {body}
    }}"""


@pytest.mark.parametrize("suffix", USD_SUFFIXES)
@pytest.mark.parametrize("degree", nightly_except(range(MAX_DEGREE + 1), 0, 3))
def test_a_round_trip_keeps_the_splats(tmp_path: Path, suffix: str, degree: int) -> None:
    field = random_splats(300, degree)
    write_splats(field, tmp_path / f"my scene{suffix}")
    got = read_splats(tmp_path / f"my scene{suffix}")
    assert len(got) == 300 and got.sh_degree == degree
    np.testing.assert_allclose(got.means, field.means, rtol=1e-6)
    np.testing.assert_allclose(got.sh, field.sh, rtol=0, atol=1e-5)
    np.testing.assert_allclose(got.log_scales, field.log_scales, atol=1e-6)
    np.testing.assert_allclose(got.opacities, field.opacities, rtol=1e-6)
    turns = [rotation_matrices(each.quaternions.astype(np.float64)) for each in (got, field)]
    np.testing.assert_allclose(*turns, atol=1e-6)


@pytest.mark.parametrize("suffix", USD_SUFFIXES)
def test_files_are_valid_by_the_schema_registry(tmp_path: Path, suffix: str) -> None:
    """Each attribute has the type and variability of the registered schema, and no other is there."""
    field = replace(random_splats(20, 1), offset=(5e5, 5e6, 300.0))
    write_splats(field, tmp_path / f"x{suffix}")
    stage = Usd.Stage.Open(str(tmp_path / f"x{suffix}"))
    schema = Usd.SchemaRegistry().FindConcretePrimDefinition(PRIM_TYPE)
    prim = prim_of(stage)
    assert str(prim.GetPath()) == "/World/splats" and stage.GetDefaultPrim().GetName() == "World"
    for spec in (attribute for attribute in prim.GetAuthoredAttributes()):
        if spec.GetName() == "xformOp:translate":
            continue
        known = schema.GetAttributeDefinition(spec.GetName())
        assert known.GetTypeName() == spec.GetTypeName(), spec.GetName()
        assert known.GetVariability() == spec.GetVariability(), spec.GetName()
    assert len(prim.GetAuthoredAttributes()) == 9  # five of splats, degree, extent, transform and its order
    low, high = np.array(prim.GetAttribute("extent").Get())
    means = in_usd_axes(field).means
    assert (low < means.min(axis=0)).all() and (high > means.max(axis=0)).all()


@pytest.mark.parametrize("suffix", USD_SUFFIXES)
def test_two_readers_see_the_values(tmp_path: Path, suffix: str) -> None:
    """usd-core and tinyusdz: positions, quaternions with the real part first, linear scales, opacities,
    harmonics by splat."""
    field = random_splats(7, 2)
    write_splats(field, tmp_path / f"x{suffix}")
    batch = in_usd_axes(field)
    quaternions = batch.quaternions / np.linalg.norm(batch.quaternions, axis=1, keepdims=True)
    expected = {
        "positions": batch.means,
        "orientations": quaternions,
        "scales": np.exp(batch.log_scales),
        "opacities": batch.opacities,
        SH: batch.sh.reshape(-1, 3),
    }
    stage = Usd.Stage.Open(str(tmp_path / f"x{suffix}"))
    prim = prim_of(stage)
    assert prim.GetAttribute("radiance:sphericalHarmonicsDegree").Get() == 2
    for name, values in expected.items():
        got = prim.GetAttribute(name).Get()
        if name == "orientations":
            got = [(q.GetReal(), *q.GetImaginary()) for q in got]
        np.testing.assert_allclose(np.array(got), values, rtol=2e-6, atol=1e-7, err_msg=name)

    if sys.version_info < (3, 11):
        pytest.skip("tinyusdz has wheels for Python 3.11 and later")
    tinyusdz = pytest.importorskip("tinyusdz", reason="the second reader, of the extra test")
    second = tinyusdz.load(str(tmp_path / f"x{suffix}"))
    other = second.get_prim_at_path("/World/splats")
    assert other.type_name == PRIM_TYPE
    for name, values in expected.items():
        text = other.get_attribute(name).value.to_string()
        numbers = [float(number) for number in re.findall(r"[-+]?[\d.]+(?:e[-+]?\d+)?", text)]
        # Its text has six significant digits.
        np.testing.assert_allclose(numbers, np.ravel(values), rtol=1e-5, atol=1e-6, err_msg=name)


@pytest.mark.parametrize("suffix", USD_SUFFIXES)
def test_map_coordinates_are_a_translation(tmp_path: Path, suffix: str) -> None:
    field = replace(random_splats(30, 0), offset=(500000.0, 5000000.0, 300.0))
    write_splats(field, tmp_path / f"x{suffix}")
    with pytest.warns(match="far from the origin"):
        got = read_splats(tmp_path / f"x{suffix}")
    np.testing.assert_allclose(
        got.means + np.array(got.offset), field.means + np.array(field.offset), atol=1e-6
    )


def test_a_package_has_its_content_at_64_bytes(tmp_path: Path) -> None:
    import zipfile

    write_splats(random_splats(5), tmp_path / "name.usdz")
    with zipfile.ZipFile(tmp_path / "name.usdz") as archive:
        (entry,) = archive.infolist()
        head = (tmp_path / "name.usdz").read_bytes()[entry.header_offset :][:30]
        begin = (
            entry.header_offset
            + 30
            + int.from_bytes(head[26:28], "little")
            + int.from_bytes(head[28:30], "little")
        )
        assert entry.filename == "splats.usdc" and entry.compress_type == zipfile.ZIP_STORED
        assert begin % 64 == 0
        assert (tmp_path / "name.usdz").read_bytes()[begin:].startswith(b"PXR-USDC")


def test_up_axis_and_unit_are_converted(tmp_path: Path) -> None:
    """Centimeters with z up: (1, 2, 3) is .01, .03, -.02 m with y up, and so .01, -.03, .02 in PLY's axes."""
    file = tmp_path / "a.usda"
    file.write_text(text_of(splat_prim(), 'upAxis = "Z"\nmetersPerUnit = 0.01'))
    with pytest.warns() as warned:
        got = read_splats(file)
    said = "\n".join(str(each.message) for each in warned)
    assert "z is up" in said and "unit is 0.01 m" in said
    np.testing.assert_allclose(got.means, [[0.01, -0.03, 0.02]], rtol=1e-6)
    # The axis of length .4 is x, that of .1 is y (to z of USD), that of .2 is z: x, -z, y in PLY's.
    axes = rotation_matrices(got.quaternions.astype(np.float64))[0] * np.exp(got.log_scales[0])
    np.testing.assert_allclose(np.diag(axes @ axes.T) ** 0.5, [0.004, 0.002, 0.001], rtol=1e-5)


def test_prims_are_read_under_their_transforms(tmp_path: Path) -> None:
    """Two scenes and an instance in one stage; a file that is referred to; an invisible prim, and a mesh."""
    (tmp_path / "other.usda").write_text(
        text_of(f'def Xform "o" {{\n{splat_prim("b")}\n}}', 'defaultPrim = "o"\nupAxis = "Y"')
    )
    shift = 'double3 xformOp:translate = (10, 0, 0)\nuniform token[] xformOpOrder = ["xformOp:translate"]'
    prims = f"""def Xform "World" {{
        {splat_prim("a", shift)}
        {splat_prim("hidden", 'token visibility = "invisible"')}
        def Mesh "m" {{}}
        def "there" (
            instanceable = true
            references = @other.usda@
        ) {{}}
    }}"""
    (tmp_path / "a.usda").write_text(text_of(prims, 'upAxis = "Y"'))
    with pytest.warns(
        match="left out: 1 invisible prims of splats, 1 prims Mesh|left out: 1 prims Mesh, 1 inv"
    ):
        got = read_splats(tmp_path / "a.usda")
    np.testing.assert_allclose(got.means, [[11, -2, -3], [1, -2, -3]])


def test_half_precision_and_missing_attributes(tmp_path: Path) -> None:
    prim = f"""def {PRIM_TYPE} "a" {{
        point3h[] positionsh = [(1, 2, 3), (4, 5, 6)]
        color3f[] primvars:displayColor = [(1, 0.5, 0)]
    }}"""
    (tmp_path / "a.usda").write_text(text_of(prim))
    got = read_splats(tmp_path / "a.usda")
    np.testing.assert_allclose(got.means, [[1, -2, -3], [4, -5, -6]])
    np.testing.assert_allclose(got.log_scales, 0.0, atol=1e-12)
    np.testing.assert_allclose(got.opacities, 1.0)
    np.testing.assert_allclose(got.sh[:, 0] * 0.28209479 + 0.5, [[1, 0.5, 0]] * 2, atol=1e-6)


def test_time_samples_are_read_at_a_time_code(tmp_path: Path) -> None:
    prim = splat_prim().replace(
        "positions = [(1, 2, 3)]", "positions.timeSamples = {5: [(1, 2, 3)], 9: [(2, 2, 3)]}"
    )
    (tmp_path / "a.usda").write_text(text_of(prim, "startTimeCode = 5\nendTimeCode = 9"))
    with pytest.warns(match="2 time samples"):
        assert read_splats(tmp_path / "a.usda").means[0, 0] == 1.0
    (batch,) = open_splat_usd(tmp_path / "a.usda", 9.0).batches()
    assert batch.means[0, 0] == 2.0
    with pytest.raises(FieldError, match="no time code 12; give one from 5 to 9"):
        open_splat_usd(tmp_path / "a.usda", 12.0)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("#usda 1.0\ndef {", "no USD of splats that can be read"),
        (text_of('def Mesh "m" {}'), "a USD without splats to be read .1 prims Mesh."),
        (text_of(splat_prim().replace("[0.5]", "[0.5, 1]")), "1 positions and 2 opacities"),
        (text_of(splat_prim().replace("Degree = 0", "Degree = 3")), "1 harmonics of degree 3"),
        (text_of(splat_prim(), "subLayers = [@/etc/hosts.usda@]"), "outside of its folder"),
        (text_of(splat_prim(), "subLayers = [@../x.usda@]"), "outside of its folder"),
        (text_of(splat_prim(), "subLayers = [@missing.usda@]"), "missing.usda, which cannot be read"),
        (text_of(splat_prim(), "metersPerUnit = -1"), "metersPerUnit is -1"),
        (text_of(splat_prim(head=CLIPS)), "value clips"),
        ("PXR-USDC" + "\0" * 200, "no USD of splats that can be read"),
    ],
)  # fmt: skip
def test_damaged_files_end_in_one_line(
    tmp_path: Path, content: str, message: str, capfd: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / ("a.usdc" if content.startswith("PXR") else "a.usda")
    file.write_text(content)
    with pytest.raises(FieldError, match=message) as caught:
        read_splats(file)
    assert "\n" not in str(caught.value) and str(file) in str(caught.value)
    assert capfd.readouterr() == ("", "")  # the library is silent


def test_a_file_that_is_written_again_is_read_again(tmp_path: Path) -> None:
    for seed in (1, 2):
        for suffix in USD_SUFFIXES:
            write_splats(random_splats(9, seed=seed), tmp_path / f"a{suffix}")
            got = read_splats(tmp_path / f"a{suffix}")
            np.testing.assert_allclose(got.means, random_splats(9, seed=seed).means, rtol=1e-6)


def test_without_the_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Text is written; the rest names the extra."""
    monkeypatch.setitem(sys.modules, "pxr", None)
    write_splats(random_splats(5), tmp_path / "a.usda")
    for suffix in (".usdc", ".usdz"):
        with pytest.raises(
            FieldError, match=r"usd-core, which is not installed; pip install 'cagefield\[usd\]'"
        ):
            write_splats(random_splats(5), tmp_path / f"a{suffix}")
    with pytest.raises(FieldError, match=r"is read by usd-core, which is not installed"):
        read_splats(tmp_path / "a.usda")


@pytest.mark.parametrize("suffix", USD_SUFFIXES)
@pytest.mark.parametrize("limit", [0, 300, 3000])
def test_a_full_disk_keeps_the_old_file(tmp_path: Path, suffix: str, limit: int) -> None:
    (tmp_path / f"a{suffix}").write_bytes(b"old")
    with files_up_to(limit), pytest.raises(OSError, match="File too large"):
        write_splats(random_splats(200), tmp_path / f"a{suffix}")
    assert files_of(tmp_path) == {f"a{suffix}": b"old"}


def test_other_axes_are_refused(tmp_path: Path) -> None:
    with pytest.raises(FieldError, match="USD has y up"):
        write_splats(random_splats(5), tmp_path / "a.usda", "rdf")
    write_splats(random_splats(5), tmp_path / "a.usda", USD_AXES)


def test_conversion_from_and_to_other_formats(tmp_path: Path) -> None:
    field = random_splats(50, 3)
    write_splats(field, tmp_path / "a.ply")
    convert_splats(tmp_path / "a.ply", tmp_path / "a.usdc")
    convert_splats(tmp_path / "a.usdc", tmp_path / "b.ply")
    np.testing.assert_allclose(read_splats(tmp_path / "b.ply").sh, field.sh, atol=1e-5)
