"""The command line: what each subcommand writes; bad input is one line, exit code 2 and no change."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import cagefield
from cagefield import Scene, load_edits
from cagefield.cli import main
from cagefield.edits import Edit, EditStack
from cagefield.geometry.cage import Cage
from commands import printed, refused
from scenes import ball_scene, files_of

GOOD_EDIT = """
edits:
  - name: lift
    inner: {center: [0, 0, 0], size: 1.2}
    outer: {margin: 0.5}
    operations:
      - translate: [0, 0, 0.2]
  - name: gone
    delete: true
    inner: {center: [0, 0, -0.6], size: 0.3}
"""


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    """A small scene folder."""
    ball_scene().save(tmp_path / "scene")
    return tmp_path / "scene"


@pytest.fixture
def edit_file(tmp_path: Path) -> Path:
    """An edit file with a continuous edit and a delete."""
    (tmp_path / "edits.yaml").write_text(GOOD_EDIT)
    return tmp_path / "edits.yaml"


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert printed(capsys, "--version") == f"cagefield {cagefield.__version__}\n"


def test_help_is_quick_and_loads_no_runtime() -> None:
    code = """
import sys, time
start = time.perf_counter()
from cagefield.cli import main
code = main(["--help"])
print("seconds", time.perf_counter() - start)
heavy = {"quadrants", "torch", "scipy", "starlette", "uvicorn", "pydantic"}
print("loaded", *sorted(heavy & set(sys.modules)))
sys.exit(code)
"""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True
    )
    lines = done.stdout.splitlines()
    assert lines[-1] == "loaded"
    # measured 0.4 s on a quiet machine; 2 s is room for a busy one
    assert float(lines[-2].split()[1]) < 2.0
    for command in ("demo", "make-scene", "train", "view", "edit", "render", "info", "bench"):
        assert command in done.stdout


def test_no_command_shows_the_help(capsys: pytest.CaptureFixture[str]) -> None:
    assert "make-scene" in printed(capsys)


@pytest.mark.parametrize(
    ("argv", "message"),
    [
        (["paint"], "paint"),
        (["render", "scene"], "--out"),
        (["render", "scene", "-o", "out", "--device", "tpu"], "invalid choice 'tpu'"),
        (["info", "scene", "--color", "red"], "--color"),
        (["make-scene", "digger", "-o", "out", "--views", "many"], "many"),
    ],
)
def test_wrong_options_are_one_line(
    capsys: pytest.CaptureFixture[str], argv: list[str], message: str
) -> None:
    assert message in refused(capsys, *argv)


@pytest.mark.parametrize(
    ("argv", "named"),
    [
        (("import", "a.ply", "scene"), "cagefield import takes its output as -o OUT; give -o scene"),
        (("export", "scene", "a b.ply"), "cagefield export takes its output as -o OUT; give -o a b.ply"),
        (("import", "a.ply", "scene", "more"), "Missing from cagefield import: -o PATH"),
        (("import", "a.ply", "--colour"), "Missing from cagefield import: -o PATH"),
        (("import", "a.ply", "scene", "-o", "out"), "Unrecognized options: scene"),
    ],
)
def test_an_output_without_its_option(
    capsys: pytest.CaptureFixture[str], argv: tuple[str, ...], named: str
) -> None:
    assert named in refused(capsys, *argv)


def test_console_script_reports_bad_input_without_traceback(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "cagefield", "info", str(tmp_path / "nowhere")],
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert done.returncode == 2 and done.stdout == ""
    assert done.stderr == (
        f"cagefield: scene {tmp_path / 'nowhere'} does not exist; "
        "give the folder that `cagefield train -o` or `cagefield import -o` wrote\n"
    )


def test_interrupt_exits_with_130(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, scene: Path
) -> None:
    def interrupted(_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("cagefield.scene.scene.Scene.open", interrupted)
    assert main(["info", str(scene)]) == 130
    assert capsys.readouterr().err == "cagefield: interrupted\n"


def test_unreadable_folder_is_one_line(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, scene: Path
) -> None:
    def denied(_: object) -> None:
        raise PermissionError(13, "Permission denied", "scene/field.safetensors")

    monkeypatch.setattr("cagefield.scene.scene.Scene.open", denied)
    assert refused(capsys, "info", scene) == "cagefield: scene/field.safetensors: Permission denied\n"


def test_info_says_what_is_there(capsys: pytest.CaptureFixture[str], scene: Path, edit_file: Path) -> None:
    Scene.open(scene).with_edits(load_edits(edit_file)).save(scene, overwrite=True)
    text = printed(capsys, "info", scene)
    stored = len(ball_scene().field.vertices)
    for fact in (
        "version 1",
        f"17 x 17 x 17 voxels, {stored} stored",
        "color SH degree 0",
        "train: 3 24x16",
        "test: 2 24x16",
        '1. "lift": continuous, flow shell, exact',
        "translation by (0, 0, 0.2)",
        "100.0% of the field's voxels follow the cage, whose corners move by up to 0.2",
        "does not fold",
        '2. "gone": delete',
    ):
        assert fact in text


def test_info_says_how_many_voxels_a_lattice_is_off(capsys: pytest.CaptureFixture[str], scene: Path) -> None:
    edit = Edit.continuous(Cage.box((0, 0, 0), 0.5), Cage.box((0, 0, 0), 1.5), lattice=12).rotate((0, 0, 0.6))
    edited = Scene.open(scene).with_edits(EditStack([edit]))
    edited.save(scene, overwrite=True)
    (error,) = edited.lattice_errors()
    worst, mean = edit.lattice_error()
    assert (error.worst, error.mean) == pytest.approx((worst / 0.125, mean / 0.125))  # 16 voxels across 2
    off = f"the lattice is off by {error.mean:.2g} voxels on average, {error.worst:.2g} at most\n"
    assert off in printed(capsys, "info", scene)


def test_info_shows_the_brightness_of_the_photos(capsys: pytest.CaptureFixture[str], scene: Path) -> None:
    assert "exposure    " not in printed(capsys, "info", scene)
    gains = ((0.9, 1.0, 1.1), (1.0, 1.0, 1.0), (1.1, 1.0, 0.75))
    replace(Scene.open(scene), gains=gains).save(scene, overwrite=True)
    assert "exposure    gains of 3 training photos, from 0.750 to 1.100\n" in printed(capsys, "info", scene)


def test_info_names_edits_that_cannot_be_evaluated(
    capsys: pytest.CaptureFixture[str], scene: Path, edit_file: Path
) -> None:
    (scene / "edits.yaml").write_text(edit_file.read_text().replace("0.2]", "0.9]"))
    assert 'cannot be evaluated: edit "lift": outer cage must contain' in printed(capsys, "info", scene)


def test_edit_writes_a_new_scene(capsys: pytest.CaptureFixture[str], scene: Path, edit_file: Path) -> None:
    before = files_of(scene)
    text = printed(capsys, "edit", scene, edit_file, "-o", scene.parent / "edited")
    assert "translation by (0, 0, 0.2)" in text and f"scene written to {scene.parent / 'edited'}" in text
    assert files_of(scene) == before
    assert Scene.open(scene.parent / "edited").edits == load_edits(edit_file)


def test_edit_in_place_needs_overwrite(
    capsys: pytest.CaptureFixture[str], scene: Path, edit_file: Path
) -> None:
    before = files_of(scene)
    assert "give -o NEW_SCENE, or --overwrite" in refused(capsys, "edit", scene, edit_file)
    assert files_of(scene) == before
    printed(capsys, "edit", scene, edit_file, "--overwrite")
    printed(capsys, "edit", scene, edit_file, "--overwrite", "--append")
    assert [edit.name for edit in Scene.open(scene).edits] == ["lift", "gone", "lift", "gone"]


def test_edit_check_writes_nothing(capsys: pytest.CaptureFixture[str], scene: Path, edit_file: Path) -> None:
    before = files_of(scene.parent)
    assert "checked, nothing written" in printed(capsys, "edit", scene, edit_file, "--check")
    assert files_of(scene.parent) == before


def test_edit_check_names_what_is_not_filled(
    capsys: pytest.CaptureFixture[str], scene: Path, edit_file: Path
) -> None:
    away = """\
  - name: moved
    adjustment: discrete
    inner: {center: [0, 0, 0.6], size: 0.3}
    operations: [{translate: [0, 0, 0.2]}]
"""
    bare = "    fill: none\n    relight: none\n"
    copy = away + "    keep_source: true\n" + bare
    edit_file.write_text(GOOD_EDIT + bare + away + "    relight: none\n" + copy)
    text = printed(capsys, "edit", scene, edit_file, "--check")
    assert '1. "lift": continuous, flow shell, exact\n' in text
    assert '2. "gone": delete, fill: none, relight: none\n' in text
    assert '3. "moved": discrete move, relight: none\n' in text
    assert '4. "moved": discrete copy, relight: none\n' in text  # which uncovers nothing
    edit_file.write_text(GOOD_EDIT + away)
    text = printed(capsys, "edit", scene, edit_file, "--check")
    assert '2. "gone": delete\n' in text and '3. "moved": discrete move\n' in text


INSIDE_OUT = "[[1,0,0],[0,0,0],[1,1,0],[0,1,0],[1,0,1],[0,0,1],[1,1,1],[0,1,1]]"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (GOOD_EDIT.replace("translate: [0, 0, 0.2]", "translate: [0, 0, .nan]"), "nan"),
        (
            GOOD_EDIT.replace("translate: [0, 0, 0.2]", "translate: [0, 0, 3]"),
            "outer cage must contain the inner cage",
        ),
        (GOOD_EDIT.replace("translate", "teleport"), "teleport"),
        (GOOD_EDIT.replace("size: 1.2", "size: -1.2"), "positive"),
        (
            GOOD_EDIT.replace("{center: [0, 0, 0], size: 1.2}", f"{{corners: {INSIDE_OUT}}}"),
            "right-handed frame",
        ),
        (
            GOOD_EDIT.replace("translate: [0, 0, 0.2]", "move_corner: {corner: 7, by: [-2, -2, -2]}"),
            "inside out",
        ),
        ("edits: [", "edits.yaml"),
    ],
    ids=["nan", "outside", "unknown", "negative", "mirrored", "inside-out", "not-yaml"],
)
def test_bad_edit_files_change_nothing(
    capsys: pytest.CaptureFixture[str], scene: Path, tmp_path: Path, text: str, message: str
) -> None:
    (tmp_path / "edits.yaml").write_text(text)
    before = files_of(tmp_path)
    error = refused(capsys, "edit", scene, tmp_path / "edits.yaml", "-o", tmp_path / "edited")
    assert message in error and "edits.yaml" in error
    assert "edits.yaml" in refused(capsys, "edit", scene, tmp_path / "edits.yaml", "--overwrite")
    assert files_of(tmp_path) == before and not (tmp_path / "edited").exists()


def test_edit_does_not_replace_a_scene(
    capsys: pytest.CaptureFixture[str], scene: Path, edit_file: Path
) -> None:
    ball_scene().save(scene.parent / "edited")
    before = files_of(scene.parent)
    assert "exists already" in refused(capsys, "edit", scene, edit_file, "-o", scene.parent / "edited")
    assert files_of(scene.parent) == before


def truncate(scene: Path) -> None:
    file = scene / "field.safetensors"
    file.write_bytes(file.read_bytes()[:300])


def nan_camera(scene: Path) -> None:
    document = json.loads((scene / "cameras.json").read_text())
    document["test"][0]["fx"] = float("nan")
    (scene / "cameras.json").write_text(json.dumps(document))


def nan_field(scene: Path) -> None:
    from safetensors.numpy import load_file, save_file

    file = scene / "field.safetensors"
    tensors = load_file(file)
    tensors["sh"][0] = np.nan
    save_file(tensors, file, metadata={"kind": "VoxelField", "version": "1", "contracted": "0"})


def newer(scene: Path) -> None:
    (scene / "scene.json").write_text('{"format": "cagefield-scene", "version": 99}')


def inside_out(scene: Path) -> None:
    (scene / "edits.yaml").write_text(f"edits: [{{delete: true, inner: {{corners: {INSIDE_OUT}}}}}]")


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (truncate, "truncated"),
        (nan_camera, "test[0] is no camera: fx must be a finite number"),
        (nan_field, "sh must be finite"),
        (newer, "version is 99, this cagefield reads up to 1; upgrade cagefield"),
        (inside_out, "right-handed frame"),
    ],
)
@pytest.mark.parametrize("command", ["info", "edit", "render"])
def test_damaged_scenes_are_refused(
    capsys: pytest.CaptureFixture[str],
    scene: Path,
    edit_file: Path,
    command: str,
    damage: object,
    message: str,
) -> None:
    damage(scene)  # type: ignore[operator]
    before = files_of(scene.parent)
    out = scene.parent / "out"
    argv = {"info": [], "edit": [edit_file, "-o", out], "render": ["-o", out]}[command]
    error = refused(capsys, command, scene, *argv)
    assert message in error and str(scene) in error
    assert files_of(scene.parent) == before and not out.exists()


def test_make_scene_writes_photos(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    out = tmp_path / "photos"
    argv = ["make-scene", "plant", "-o", out, "--views", 2, "--size", 16, "--test-views", 1]
    text = printed(capsys, *argv)
    assert "photos of plant (parts: " in text and str(out) in text
    data = cagefield.load_dataset(out)
    assert len(data.train) == 2 and len(data.test) == 1
    before = files_of(out)
    assert "exists already and is not empty; give a new one, or --overwrite" in refused(capsys, *argv)
    assert files_of(out) == before
    (out / "notes.txt").write_text("mine")
    assert (out / "test" / "r_0_depth.npy").is_file() and not (out / "train" / "r_0_depth.npy").exists()
    small = (*argv[:4], "--views", 1, "--size", 8, "--test-views", 1)
    printed(capsys, *small, "--depth", "all", "--overwrite")
    assert len(cagefield.load_dataset(out).train) == 1 and (out / "notes.txt").read_text() == "mine"
    assert (out / "train" / "r_0_depth.npy").is_file()


def test_make_scene_refuses_unknown_names_and_other_folders(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert "no built-in scene 'castle'; choose one of digger" in refused(
        capsys, "make-scene", "castle", "-o", tmp_path / "photos"
    )
    assert "--size is 0; give a whole number from 1" in refused(
        capsys, "make-scene", "plant", "-o", tmp_path / "photos", "--size", 0
    )
    (tmp_path / "holidays").mkdir()
    (tmp_path / "holidays" / "beach.jpg").write_bytes(b"sea")
    error = refused(capsys, "make-scene", "plant", "-o", tmp_path / "holidays", "--overwrite")
    assert "holds no transforms_train.json and is left as it is" in error
    assert files_of(tmp_path) == {"holidays/beach.jpg": b"sea"}


@pytest.mark.nightly
def test_make_scene_writes_captures_of_rooms(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    out = tmp_path / "photos"
    argv = ["make-scene", "room-chair", "-o", out, "--views", 9, "--size", 32]
    assert "photos of room-chair (parts: seat, " in printed(capsys, *argv, "--no-points")
    data = cagefield.load_dataset(out)
    assert (len(data.train), len(data.test)) == (7, 2) and data.unbounded and data.points is None
    assert sorted(path.name for path in (out / "depth").iterdir()) == ["frame_00001.npy", "frame_00009.npy"]
    (out / "note.txt").write_text("mine")
    printed(capsys, *argv, "--overwrite", "--depth", "none")
    assert (out / "sparse_pc.ply").is_file() and not (out / "depth").exists()
    assert (out / "note.txt").read_text() == "mine"
    error = refused(capsys, "make-scene", "room-chair", "-o", tmp_path / "new", "--test-views", 3)
    assert "holds out every 8th" in error
    assert "for rooms" in refused(capsys, "make-scene", "plant", "-o", tmp_path / "new", "--no-points")
    assert not (tmp_path / "new").exists()


def test_benchmarks_are_those_of_a_checkout(monkeypatch, capsys):
    """An installed package has none, and names the cure whatever follows `bench`."""
    from cagefield.cli import bench

    monkeypatch.setattr(bench, "bench_command", lambda: bench.Bench)
    assert main(["bench", "edits", "--steps", "3"]) == 2
    assert "part of the source checkout" in capsys.readouterr().err
