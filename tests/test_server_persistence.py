"""Saving, autosaving, and what is not overwritten."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from cagefield.cameras.keyframe_files import load_keys
from cagefield.cameras.keyframes import Keyframe
from cagefield.edits import Edit, EditStack, Translate, dump_edits, load_edits, save_edits
from cagefield.errors import SceneError
from cagefield.geometry.cage import Cage
from cagefield.scene.scene import Scene
from cagefield.server.editor import persistence
from cagefield.server.editor.persistence import CAMERA_PATH, SceneStore
from cagefield.server.editor.session import Session
from full_disks import files_up_to
from scenes import ball_scene, files_of

INNER = Cage.box((0, 0, 0), 1.1)
BALL = Edit.continuous(INNER, INNER.grown(0.4), lattice=16, name="ball")
KEY = Keyframe(tuple(np.eye(4).reshape(-1)), 45.0, 2.0, {1: 0.5})


@pytest.fixture
def path(tmp_path: Path) -> Path:
    ball_scene().with_edits(EditStack([BALL])).save(tmp_path / "ball")
    return tmp_path / "ball"


def opened(path: Path) -> tuple[SceneStore, Session]:
    scene = Scene.open(path)
    store = SceneStore(scene, path)
    return store, Session(store.document(), scene.field.bounds, 0.1)


def changed(path: Path) -> tuple[SceneStore, Session]:
    store, session = opened(path)
    session.apply(1, "field", Translate((0.1, 0, 0)))
    session.change(1, fill="none", relight="none")
    session.change(1, locked=True)
    session.set_path((KEY,), True)
    session.preserve_opacity(False)
    session.set_scale(0.25)
    store.autosave(session)
    return store, session


def test_saving_writes_everything_and_opening_finds_it(path: Path) -> None:
    store, session = changed(path)
    before = files_of(path)
    store.save(session)
    assert session.saved and session.document.entry(1).locked
    scene = Scene.open(path)
    assert scene.edits[0] == BALL.translate((0.1, 0, 0)).replace(fill="none", relight="none")
    assert not scene.preserve_opacity and scene.alignment.meters_per_unit == 0.25
    assert load_keys(path / "camera_path.json") == ((KEY,), True)
    assert before["field.safetensors"] == files_of(path)["field.safetensors"]
    assert opened(path)[1].document.keys == (KEY,)
    assert [file.name for file in path.parent.iterdir()] == ["ball"]


def test_an_autosave_is_restored_as_one_entry_and_saving_removes_it(path: Path) -> None:
    _, session = changed(path)
    store, fresh = opened(path)
    found = store.recovered()
    assert found is not None
    fresh.restore(found)
    assert fresh.document.stack == session.document.stack
    assert fresh.document.keys == (KEY,) and fresh.document.loop and not fresh.document.preserve_opacity
    assert fresh.document.meters_per_unit == 0.25
    assert fresh.document.entry(1).locked and not fresh.saved
    fresh.undo()
    assert fresh.saved and fresh.document.stack == EditStack([BALL])
    fresh.redo()
    store.save(fresh)
    assert not store.autosave_path.exists() and opened(path)[0].recovered() is None


def test_undoing_everything_removes_the_autosave(path: Path) -> None:
    store, session = changed(path)
    assert store.autosave_path.exists()
    session.go_to(0)
    store.autosave(session)
    assert not store.autosave_path.exists()


@pytest.mark.parametrize("text", ["", "{}", '{"version": 2}', "[1]", '{"version": 1, "edits": {"edits": 3}}'])
def test_a_damaged_autosave_is_passed_over(path: Path, text: str) -> None:
    store, _ = opened(path)
    store.autosave_path.write_text(text)
    with pytest.warns(UserWarning, match="they are kept as"):
        assert store.recovered() is None
    assert (
        store.autosave_path.with_suffix(".damaged").read_text() == text and not store.autosave_path.exists()
    )


def test_damaged_autosaves_are_kept_beside_one_another(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Up to a few, of which the first stay."""
    monkeypatch.setattr(persistence, "MAX_DAMAGED_AUTOSAVES", 3)
    store, _ = opened(path)
    ends = (".damaged$", ".damaged-2$", ".damaged-3$", ".damaged-3 in place of an older one$")
    for number, end in enumerate(ends):
        store.autosave_path.write_text(f"{number} is no autosave")
        with pytest.warns(UserWarning, match=end):
            assert store.recovered() is None
    kept = {file.suffix: file.read_text()[0] for file in path.parent.glob(".*.damaged*")}
    assert kept == {".damaged": "0", ".damaged-2": "1", ".damaged-3": "3"}


def test_keyframes_name_edits_by_their_place_in_files(path: Path) -> None:
    store, session = opened(path)
    number = session.duplicate(1)
    session.remove(1)
    session.set_path((Keyframe(KEY.c2w, 45.0, 2.0, {number: 0.25, 1: 0.5}),), False)
    store.save(session)
    assert load_keys(path / "camera_path.json")[0][0].parts == {1: 0.25}


def test_edits_that_another_program_changed_are_replaced_only_when_asked_twice(path: Path) -> None:
    store, session = changed(path)
    save_edits(EditStack([]), path / "edits.yaml")
    with pytest.raises(SceneError, match="changed by another program; save again to replace it"):
        store.save(session)
    assert len(load_edits(path / "edits.yaml")) == 0
    store.save(session)
    assert len(load_edits(path / "edits.yaml")) == 1
    save_edits(EditStack([]), path / "edits.yaml")
    with pytest.raises(SceneError, match="save again"):
        store.save(session)


def test_saving_as_leaves_the_first_scene_alone_and_goes_on_with_the_new_one(path: Path) -> None:
    store, session = changed(path)
    before = files_of(path)
    store.save_as(session, "copy", overwrite=False)
    assert files_of(path) == before
    assert store.path == path.parent / "copy" and session.saved
    assert Scene.open(store.path).edits[0].operations
    assert sorted(file.name for file in path.parent.iterdir()) == ["ball", "copy"]
    session.undo()
    store.save(session)
    assert files_of(path) == before


def test_saving_as_replaces_nothing_that_it_was_not_asked_to(path: Path, tmp_path: Path) -> None:
    store, session = changed(path)
    ball_scene().save(tmp_path / "other")
    before = files_of(tmp_path / "other")
    with pytest.raises(SceneError, match=r"exists already; give a new folder, or choose to overwrite"):
        store.save_as(session, str(tmp_path / "other"), overwrite=False)
    assert files_of(tmp_path / "other") == before and not session.saved
    store.save_as(session, str(tmp_path / "other"), overwrite=True)
    assert len(Scene.open(tmp_path / "other").edits) == 1
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "letter.txt").write_text("dear")
    with pytest.raises(SceneError, match="holds no scene and is left as it is"):
        store.save_as(session, str(tmp_path / "mine"), overwrite=True)


def test_saving_as_takes_the_camera_path_with_it(path: Path) -> None:
    """The path of a scene that is replaced goes with it, where the new one has none."""
    store, session = changed(path)
    store.save_as(session, "copy", overwrite=False)
    assert opened(store.path)[1].document.keys == (KEY,)
    session.set_path((), False)
    store.save_as(session, "other", overwrite=False)
    store.save_as(session, "copy", overwrite=True)
    assert opened(store.path)[1].document.keys == () and not (store.path / CAMERA_PATH).exists()


def test_a_save_without_room_for_all_files_changes_none(path: Path) -> None:
    store, session = changed(path)
    store.save(session)
    before = files_of(path.parent)
    session.change(1, locked=False)
    session.apply(1, "field", Translate((0.1, 0, 0)))
    session.set_path((KEY,) * 3, False)
    assert len(dump_edits(session.document.stack)) < 2_000
    for action in (lambda: store.save(session), lambda: store.save_as(session, "new", False)):
        with files_up_to(2_000), pytest.raises(OSError, match="File too large") as caught:
            action()
        assert "/." not in str(caught.value) and files_of(path.parent) == before and not session.saved
    store.save(session)
    assert opened(path)[1].document.keys == (KEY,) * 3


def test_a_scene_that_is_gone_says_what_helps(path: Path) -> None:
    store, session = changed(path)
    path.rename(path.with_name("elsewhere"))
    with pytest.raises(SceneError, match="not there any more; use Save as"):
        store.save(session)


def test_an_autosave_that_cannot_be_written_is_told(path: Path) -> None:
    store, session = opened(path)
    store.autosave_path.mkdir()
    session.apply(1, "field", Translate((0.1, 0, 0)))
    store.autosave(session)
    assert store.trouble is not None and "save often" in store.trouble
    store.autosave_path.rmdir()
    session.undo()
    session.redo()
    session.apply(1, "field", Translate((0.1, 0, 0)))
    store.autosave(session)
    assert store.trouble is None and json.loads(store.autosave_path.read_text())["version"] == 1
