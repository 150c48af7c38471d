"""Commands that make scenes leave kernels of edits and the light of the field for the editor."""

from __future__ import annotations

from pathlib import Path

import pytest

from cagefield import Scene
from cagefield.cli import edit_preparation
from cagefield.completion import patch_cache, patcher
from cagefield.formats.splats.splat_files import write_splats
from cagefield.server.render_worker.renderer_cache import RendererCache
from cagefield.server.render_worker.tasks import WarmStage
from commands import printed
from splat_rooms import room


@pytest.fixture(autouse=True)
def patches(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(patch_cache, "cache_root", lambda: tmp_path / "cache")
    monkeypatch.setattr(patch_cache, "MIN_CACHED_SECONDS", -1.0)
    return tmp_path / "cache" / "patches"


@pytest.fixture
def splats(tmp_path: Path) -> Path:
    write_splats(room(box=True), tmp_path / "room.ply")
    return tmp_path / "room.ply"


def test_an_opened_scene_finds_the_light_that_its_import_computed(splats, tmp_path, capsys, monkeypatch):
    stages: list[WarmStage] = []
    monkeypatch.setattr(RendererCache, "warm", lambda self, stage: stages.append(stage))
    monkeypatch.setattr(edit_preparation, "MAX_SECONDS", 600.0)
    assert "kernels and light ready" in printed(capsys, "import", splats, "-o", tmp_path / "scene")
    assert stages == list(WarmStage)

    def computed(*_arguments: object) -> None:
        raise AssertionError("the light was computed again")

    monkeypatch.setattr(patcher, "render_visibility", computed)
    monkeypatch.setattr(patcher, "fit_light_model", computed)
    assert Scene.open(tmp_path / "scene").patcher.light_model is not None


def test_a_light_that_takes_too_long_is_left_to_the_editor(splats, patches, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(edit_preparation, "MAX_SECONDS", 1e-9)
    assert "left to the editor" in printed(capsys, "import", splats, "-o", tmp_path / "scene")
    assert not list(patches.glob("*.npz"))
    assert len(Scene.open(tmp_path / "scene").field) == len(room(box=True))


@pytest.mark.parametrize("warmed", [RendererCache, patcher.Patcher])
@pytest.mark.parametrize("error", [MemoryError, KeyboardInterrupt])
def test_an_imported_scene_stays_where_its_preparation_fails(
    warmed, error, splats, tmp_path, capsys, monkeypatch
):
    def fails(*_arguments: object, **_options: object) -> None:
        raise error

    monkeypatch.setattr(edit_preparation, "MAX_SECONDS", 600.0)
    monkeypatch.setattr(warmed, "warm", fails)
    assert "left to the editor" in printed(capsys, "import", splats, "-o", tmp_path / "scene")
    assert (tmp_path / "scene" / "scene.json").is_file()
