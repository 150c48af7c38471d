"""Streamed SOG as it is written: leaves, levels, bounds, the file's folder, and a second reader."""

from __future__ import annotations

import dataclasses
import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree

from cagefield import Scene
from cagefield.errors import CagefieldError, FieldError
from cagefield.exporting import upright
from cagefield.fields.splat_decimation import decimate_splats
from cagefield.fields.splat_field import SplatField
from cagefield.formats.splats import sog_lod_writer
from cagefield.formats.splats.sog_lod_writer import leaf_rows, level_count
from cagefield.formats.splats.splat_files import read_splats, write_splats
from cagefield.server.render_worker.edited_splats import EditedSplats, write_edited
from commands import printed, refused
from splat_scenes import random_splats
from test_formats_splats import assert_within, convert_with, splat_transform
from tiers import nightly_after_first

__all__ = ["splat_transform"]  # the fixture

pytestmark = pytest.mark.filterwarnings("ignore:.*the finest level is read")


@pytest.fixture(autouse=True)
def small_levels(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leaves of 100 splats, several files of a level, and three levels of 500 splats."""
    for name, value in (("LEAF_SPLATS", 100), ("FILE_SPLATS", 150), ("COARSE_SPLATS", 60)):
        monkeypatch.setattr(sog_lod_writer, name, value)


def leaves(node: dict[str, Any]) -> list[dict[str, Any]]:
    return [node] if "lods" in node else [leaf for child in node["children"] for leaf in leaves(child)]


def written(folder: Path, field: SplatField) -> dict[str, Any]:
    write_splats(field, folder / "lod-meta.json")
    meta: dict[str, Any] = json.loads((folder / "lod-meta.json").read_text())
    return meta


@pytest.mark.parametrize("degree", nightly_after_first([3, 0]))
def test_the_finest_level_is_the_field_and_the_others_its_decimations(tmp_path: Path, degree: int) -> None:
    field = random_splats(500, degree=degree)
    meta = written(tmp_path / "x", field)
    assert_within(read_splats(tmp_path / "x"), field, ".sog")
    assert meta["counts"] == [500, 8 * 15, 8 * 3] and meta["lodLevels"] == 3 and meta["count"] == 644
    parts = leaves(meta["tree"])
    assert len(parts) == 8 and all(len(part["lods"]) == 3 for part in parts)
    rows = leaf_rows(field.means, 100)
    files = [read_splats(tmp_path / "x" / name).means for name in meta["filenames"]]
    for level in range(1, 3):
        for part, own in zip(parts, rows, strict=True):
            lod = part["lods"][str(level)]
            got = files[lod["file"]][lod["offset"] : lod["offset"] + lod["count"]]
            fewer = decimate_splats(field.take(own), 15)
            expected = fewer if level == 1 else decimate_splats(fewer, 3)
            distance, at = cKDTree(expected.means).query(got)
            assert distance.max() < 1e-4 and sorted(at.tolist()) == list(range(len(expected)))


def test_rows_of_leaves_fill_their_files_and_boxes_hold_them(tmp_path: Path) -> None:
    meta = written(tmp_path / "x", random_splats(500, degree=0))
    files = [read_splats(tmp_path / "x" / name).means for name in meta["filenames"]]
    filled: dict[int, list[tuple[int, int]]] = {}
    for leaf in leaves(meta["tree"]):
        low, high = (np.array(leaf["bound"][side]) for side in ("min", "max"))
        for lod in leaf["lods"].values():
            filled.setdefault(lod["file"], []).append((lod["offset"], lod["count"]))
            means = files[lod["file"]][lod["offset"] : lod["offset"] + lod["count"]]
            assert (means > low).all() and (means < high).all()
    assert len(filled) == len(meta["filenames"]) > 3
    for number, name in enumerate(meta["filenames"]):
        count = json.loads((tmp_path / "x" / name).read_text())["count"]
        ends = [offset + length for offset, length in filled[number]]
        assert [offset for offset, _ in filled[number]] == [0, *ends[:-1]] and ends[-1] == count

    def inside(node: dict[str, Any]) -> None:
        for child in node.get("children", []):
            assert (np.array(child["bound"]["min"]) >= node["bound"]["min"]).all()
            assert (np.array(child["bound"]["max"]) <= node["bound"]["max"]).all()
            inside(child)

    inside(meta["tree"])


def test_levels_go_down_to_the_coarsest() -> None:
    assert [level_count(count) for count in (1, 60, 61, 240, 244, 5_000_000)] == [1, 1, 2, 2, 3, 10]
    points = np.zeros((10, 3), np.float32)  # all in one place: halves all the same
    assert sorted(np.concatenate(leaf_rows(points, 3)).tolist()) == list(range(10))


@pytest.mark.nightly
def test_splat_transform_reads_each_file_of_the_levels(tmp_path: Path, splat_transform: str) -> None:
    field = random_splats(200, degree=3)
    meta = written(tmp_path / "x", field)
    finest = []
    for number, name in enumerate(meta["filenames"]):
        convert_with(splat_transform, tmp_path / "x" / name, tmp_path / f"{number}.ply")
        theirs, ours = read_splats(tmp_path / f"{number}.ply"), read_splats(tmp_path / "x" / name)
        np.testing.assert_allclose(theirs.means, ours.means, atol=1e-5)
        np.testing.assert_allclose(theirs.sh, ours.sh, atol=1e-5)
        if name.startswith("0_"):
            finest.append(theirs)
    columns: dict[str, Any] = {
        name: np.concatenate([getattr(part, name) for part in finest])
        for name in ("means", "log_scales", "quaternions", "opacities", "sh")
    }
    assert_within(dataclasses.replace(field, **columns), field, ".sog")


def test_the_commands_write_levels_and_say_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    field = random_splats(300, degree=0)
    write_splats(field, tmp_path / "a.ply")
    out = str(tmp_path / "x" / "lod-meta.json")
    text = printed(capsys, "convert", str(tmp_path / "a.ply"), out)
    assert "300 splats, SH degree 0, 3 levels of detail: 300, 72, 16" in text
    assert "exists" in refused(capsys, "convert", str(tmp_path / "a.ply"), out)
    (tmp_path / "x" / "note.txt").write_text("mine")
    Scene(random_splats(30, degree=0)).save(tmp_path / "scene")
    text = printed(capsys, "export", str(tmp_path / "scene"), "-o", out, "--overwrite")
    assert "30 splats, SH degree 0; without edits, 1 level of detail: 30" in text
    assert {entry.name for entry in (tmp_path / "x").iterdir()} == {"lod-meta.json", "0_0", "note.txt"}
    assert len(read_splats(out)) == 30


def test_more_splats_than_memory_holds_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sog_lod_writer, "memory_shortage", lambda size: f"{size} bytes are needed")
    with pytest.raises(FieldError, match=r"levels of 30 splats are too many: 8280 bytes are needed"):
        write_splats(random_splats(30, degree=1), tmp_path / "x" / "lod-meta.json")
    assert not (tmp_path / "x").exists()


def test_folders_of_other_files_are_left_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    field = random_splats(30, degree=0)
    (tmp_path / "photos").mkdir()
    (tmp_path / "photos" / "a.jpg").write_text("")
    with pytest.raises(FieldError, match=r"photos has others; give NEW_FOLDER/lod-meta\.json"):
        write_splats(field, tmp_path / "photos" / "lod-meta.json")
    with pytest.raises(FieldError, match=r"is named lod-meta\.json; give FOLDER/lod-meta\.json"):
        write_splats(field, tmp_path / "new" / "garden-lod-meta.json")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(FieldError, match=r"takes its place as a whole; give NEW_FOLDER/lod-meta\.json"):
        write_splats(field, "lod-meta.json")
    assert [path.name for path in tmp_path.rglob("*")] == ["photos", "a.jpg"]


def test_the_editors_download_is_an_archive_of_the_levels(tmp_path: Path) -> None:
    scene = Scene(random_splats(300, degree=1))
    scene.save(tmp_path / "scene")
    content = EditedSplats(scene=str(tmp_path / "scene"), name="garden", form="lod")
    assert content.file_name == "garden.lod.zip"
    write_edited(content, str(tmp_path / content.file_name))
    zipfile.ZipFile(tmp_path / content.file_name).extractall(tmp_path / "out")
    assert isinstance(scene.field, SplatField)
    assert_within(read_splats(tmp_path / "out" / "garden"), upright(scene.field, scene.up), ".sog")
    with pytest.raises(CagefieldError, match="unpack it and give its folder"):
        read_splats(tmp_path / content.file_name)
