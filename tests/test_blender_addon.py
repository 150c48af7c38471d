"""The Blender add-on without a window, by the `bpy` module: its results against cagefield's own.

An interpreter with bpy is named by the environment variable CAGEFIELD_BPY_PYTHON, or is this one.
"""

from __future__ import annotations

import importlib.util
import json
import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import cagefield
from cagefield import Edit, EditStack, Scene, SplatField, load_edits, read_splats, write_splats
from cagefield.exporting import edited_splats
from cagefield.geometry.cage import LatticeCage
from cagefield.integrations.frames import Frame
from cagefield.integrations.splat_deformer import edit_from_request, scene_of_splats
from cagefield.typing import AnyArray
from splat_scenes import random_splats

ROOT = Path(__file__).parents[1]
ADDON = ROOT / "integrations/blender"

BLENDER_EULER = Rotation.from_euler("xyz", (0.0, 0.2, 0.1))
"""Blender's rotation mode XYZ: about x first, then y, then z, axes that stay."""


def bpy_python() -> str | None:
    """The interpreter that has bpy, or None."""
    named = os.environ.get("CAGEFIELD_BPY_PYTHON")
    return named or (sys.executable if importlib.util.find_spec("bpy") is not None else None)


# ---- without bpy ----


def test_the_folder_has_its_own_license_and_imports_no_package() -> None:
    assert (ADDON / "LICENSE").read_text().lstrip().startswith("GNU GENERAL PUBLIC LICENSE")
    allowed = {"bpy", "bpy_extras", "bmesh", "mathutils", "numpy"} | set(sys.stdlib_module_names)
    modules = sorted(ADDON.glob("*.py"))
    assert len(modules) > 8
    for module in modules:
        text = module.read_text()
        assert text.startswith("# SPDX-License-Identifier: GPL-3.0-or-later\n"), module.name
        imported = re.findall(r"^\s*(?:import|from) (\w+)", text, re.MULTILINE)
        assert set(imported) <= allowed, module.name


def test_the_manifest_names_the_license_and_the_version_of_the_package() -> None:
    text = (ADDON / "blender_manifest.toml").read_text()
    assert 'license = ["SPDX:GPL-3.0-or-later"]' in text
    assert f'\nversion = "{cagefield.__version__}"\n' in text
    tomllib = pytest.importorskip("tomllib", reason="tomllib is of Python 3.11")
    manifest = tomllib.loads(text)
    # The limits of Blender's extension platform.
    assert manifest["schema_version"] == "1.0.0" and manifest["type"] == "add-on"
    assert len(manifest["tagline"]) <= 64 and not manifest["tagline"].endswith(".")
    assert all(len(reason) <= 64 and not reason.endswith(".") for reason in manifest["permissions"].values())


# ---- with bpy ----


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """The folder that `blender_session.py` has worked in, and its report."""
    python = bpy_python()
    if python is None:
        pytest.skip("no bpy: set CAGEFIELD_BPY_PYTHON to an interpreter that has it (pip install bpy)")
    folder = tmp_path_factory.mktemp("blender")
    splats = random_splats(400, degree=1)
    write_splats(splats, folder / "splats.ply")
    scene_of_splats(splats).save(folder / "scene")
    done = subprocess.run(
        [python, str(ROOT / "tests/blender_session.py"), str(folder)],
        capture_output=True,
        text=True,
        timeout=1800,
        env={**os.environ, "CAGEFIELD_PYTHON": sys.executable},
    )
    assert done.returncode == 0, f"{done.stdout}\n{done.stderr}"
    return folder, json.loads((folder / "report.json").read_text())


def splats_of(folder: Path, name: str) -> SplatField:
    with np.load(folder / f"{name}.npz") as arrays:
        return SplatField(**arrays)


def edit_of(folder: Path, name: str, kind: str = "continuous") -> Edit:
    """The edit of arrays that the add-on sent."""
    with np.load(folder / f"{name}.npz") as arrays:
        content: dict[str, AnyArray] = dict(arrays)
    header = {"kind": kind, "inner": {"type": "mesh"}, "outer": {"type": "mesh"}}
    return edit_from_request(Frame(header, content))


def assert_same(found: SplatField, expected: SplatField) -> None:
    """Equal but for the logits of opacities, which Blender's attributes hold in float32."""
    assert len(found) == len(expected)
    np.testing.assert_array_equal(found.means, expected.means)
    np.testing.assert_array_equal(found.log_scales, expected.log_scales)
    np.testing.assert_array_equal(found.sh, expected.sh)
    # Of a quaternion that is normalized once more, and of a logit of up to 5.
    np.testing.assert_allclose(found.quaternions, expected.quaternions, atol=2e-7)
    np.testing.assert_allclose(found.opacities, expected.opacities, atol=2e-6)


def edited(splats: SplatField, edit: Edit) -> SplatField:
    return edited_splats(scene_of_splats(splats).with_edits(EditStack([edit])))


def test_blenders_import_has_the_splats_of_the_file(session: tuple[Path, dict[str, Any]]) -> None:
    folder, report = session
    assert report["version"].startswith("5.")
    assert_same(splats_of(folder, "imported"), read_splats(folder / "splats.ply"))


def test_cages_at_rest_change_nothing(session: tuple[Path, dict[str, Any]]) -> None:
    folder, _ = session
    assert_same(splats_of(folder, "at_rest"), splats_of(folder, "imported"))


def test_an_update_has_the_splats_of_the_edit(session: tuple[Path, dict[str, Any]]) -> None:
    folder, report = session
    edit = edit_of(folder, "request")
    # The cage's own rotation and way, in the space of the splats: those that the objects were given.
    inner, deformed = edit.inner, edit.deformed
    np.testing.assert_allclose(deformed.center - inner.center, (0.05, 0.0, 0.02), atol=1e-6)
    np.testing.assert_allclose(
        deformed.corners - deformed.center,
        (inner.corners - inner.center) @ BLENDER_EULER.as_matrix().T,
        atol=1e-6,
    )
    found = splats_of(folder, "updated")
    assert_same(found, edited(splats_of(folder, "imported"), edit))
    assert report["status"] == f"{len(found)} splats"
    assert report["hidden at rest"] and report["same place"]
    moved = np.abs(found.means[:, None] - splats_of(folder, "imported").means).max(axis=2).min(axis=1)
    assert (moved > 0.01).sum() > 20


def test_files_have_the_edit_and_its_splats(session: tuple[Path, dict[str, Any]]) -> None:
    folder, _ = session
    (edit,) = load_edits(folder / "edits.yaml")
    assert edit.name == "edit in Blender"
    assert edit.deformed == edit_of(folder, "request").deformed
    source = splats_of(folder, "imported")
    expected = edited(source, edit)
    exported = read_splats(folder / "exported.ply")
    np.testing.assert_array_equal(exported.means, expected.means)
    np.testing.assert_array_equal(exported.sh, expected.sh)


def test_a_dragged_corner_is_one_operation(session: tuple[Path, dict[str, Any]]) -> None:
    folder, report = session
    (edit,) = load_edits(folder / "corner.yaml")
    assert [operation.noun for operation in edit.operations] == ["corner move"]
    assert_same(splats_of(folder, "corner"), edited(splats_of(folder, "imported"), edit))
    assert report["corner in edit mode"] == pytest.approx(report["corner in edit mode expected"], rel=1e-5)


def test_what_is_not_possible_is_one_line_with_the_cure(session: tuple[Path, dict[str, Any]]) -> None:
    _, report = session
    for step, message in {
        "without cagefield": r"has no cagefield; install it with .* -m pip install cagefield",
        "no interpreter": r"no-python does not start \(No such file or directory\); choose a Python",
        "nothing chosen": "no splats are chosen; open a scene or a splat file",
        "a cube is no splats": "its points lack opacity, scale_0, .*import a PLY of 3DGS",
        "no cage": "no inner cage is assigned; select a cube and press Assign inner",
        "inside out": "inner cage as it is now: cage is mirrored.*; move its points back",
        "killed": "the process of cagefield has ended",
        "subdivided": r"inner cage has \d+ points, 8 when it was assigned; assign it again",
    }.items():
        assert re.search(message, report[step]), report[step]
        assert "\n" not in report[step]
    assert report["check"] == f"cagefield {cagefield.__version__} answers"


def test_reset_shows_the_splats_at_rest(session: tuple[Path, dict[str, Any]]) -> None:
    _, report = session
    assert report["reset"] and report["reset cage"] < 1e-6


def test_live_splats_are_those_of_the_newest_shape(session: tuple[Path, dict[str, Any]]) -> None:
    folder, report = session
    edit = edit_of(folder, "live_request")
    np.testing.assert_allclose(edit.deformed.center - edit.inner.center, (0.08, 0, 0), atol=1e-6)
    expected = edited(splats_of(folder, "imported"), edit)
    assert_same(splats_of(folder, "live"), expected)
    assert report["a change is noticed"] and report["equal shapes sent"] == 0
    assert_same(splats_of(folder, "after_restart"), expected)
    animated = edit_of(folder, "animated_request")
    np.testing.assert_allclose(animated.deformed.center - animated.inner.center, (0.08, 0, 0.05), atol=1e-6)
    assert_same(splats_of(folder, "animated"), edited(splats_of(folder, "imported"), animated))


def test_a_lattice_object_is_a_lattice_cage(session: tuple[Path, dict[str, Any]]) -> None:
    folder, report = session
    assert report["lattice"] == {"type": "lattice", "shape": [2, 3, 2], "interpolation": "bspline"}
    (edit,) = load_edits(folder / "lattice.yaml")
    assert isinstance(edit.inner, LatticeCage) and edit.inner.shape == (2, 3, 2)
    moved = np.abs(edit.deformed.handles - edit.inner.handles).max(axis=1) > 1e-6
    assert np.flatnonzero(moved).tolist() == [2, 3, 8, 9]
    assert_same(splats_of(folder, "lattice"), edited(splats_of(folder, "imported"), edit))


def test_a_point_cloud_is_a_splat_object(session: tuple[Path, dict[str, Any]]) -> None:
    folder, report = session
    assert report["cloud"] == "POINTCLOUD"
    edit = edit_of(folder, "cloud_request", kind="move")
    np.testing.assert_allclose(edit.deformed.center - edit.inner.center, (0.5, 0, 0), atol=1e-6)
    assert_same(splats_of(folder, "cloud"), edited(splats_of(folder, "imported"), edit))


def test_a_scene_is_opened_upright(session: tuple[Path, dict[str, Any]]) -> None:
    folder, report = session
    scene = Scene.open(folder / "scene")
    assert_same(splats_of(folder, "opened"), edited_splats(scene))
    np.testing.assert_allclose(report["up"], (0, 0, 1), atol=1e-6)
    assert report["old result is gone"] and report["ellipsoids"] == 400
    assert report["the result has ellipsoids"]


def test_the_panel_shows_operators_and_properties_that_exist(session: tuple[Path, dict[str, Any]]) -> None:
    _, report = session
    assert len(report["panel"]) == len(set(report["panel"])) + 2  # two buttons each of two operators
    assert {"CAGEFIELD_OT_open", "CAGEFIELD_OT_update", "live", "inner", "outer", "kind"} <= set(
        report["panel"]
    )
    assert len(report["panel lines"]) == 2


def test_live_splats_follow_a_cage_that_moves_and_a_file_that_is_opened(
    session: tuple[Path, dict[str, Any]],
) -> None:
    folder, report = session
    sent = report["moves sent"]
    assert sent == list(range(sent[0], sent[0] + 4)) and report["every answer is shown"]
    assert report["live after opening"]
    edit = edit_of(folder, "reopened_request")
    np.testing.assert_allclose(edit.deformed.center - edit.inner.center, (0.08, 0.03, 0), atol=1e-6)
    assert_same(splats_of(folder, "reopened"), edited(splats_of(folder, "opened"), edit))


def test_the_zip_file_is_an_extension_that_blender_installs(tmp_path: Path) -> None:
    """Built as the documentation says, installed into a folder of its own."""
    python = bpy_python()
    if python is None:
        pytest.skip("no bpy: set CAGEFIELD_BPY_PYTHON to an interpreter that has it (pip install bpy)")
    file = tmp_path / "cagefield-blender.zip"
    with zipfile.ZipFile(file, "w") as archive:
        for path in sorted(ADDON.iterdir()):
            if path.is_file():
                archive.write(path, path.name)
    code = f"""
import bpy
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.extensions.package_install_files(filepath={str(file)!r}, repo="user_default", enable_on_install=True)
bpy.context.preferences.addons["bl_ext.user_default.cagefield"].preferences.python = {sys.executable!r}
from bl_ext.user_default.cagefield import worker
worker.START_TIMEOUT_S = 600.0
bpy.ops.cagefield.check_python()
print("status:", bpy.context.scene.cagefield.status)
"""
    done = subprocess.run(
        [python, "-c", code],
        capture_output=True,
        text=True,
        timeout=600,
        env={**os.environ, "BLENDER_USER_RESOURCES": str(tmp_path / "user")},
    )
    assert f"status: cagefield {cagefield.__version__} answers" in done.stdout, done.stdout + done.stderr


def test_the_process_ends_with_the_addon(session: tuple[Path, dict[str, Any]]) -> None:
    _, report = session
    assert report["ended"] and report["unregistered"]
