"""What keeps an editor answering while a page sends much: threads, turns, and what is worked out once."""

from __future__ import annotations

import asyncio
import json
import threading
from pathlib import Path

import pytest

from cagefield.edits import Edit, parse_edits
from cagefield.errors import EditFileError
from cagefield.scene.scene import Scene
from cagefield.server.editor import edit_texts, session_state, validity
from cagefield.server.editor.edit_texts import read_edits
from cagefield.server.editor.persistence import SceneStore
from cagefield.server.editor.session import Session
from cagefield.server.protocol.conversion import state_of
from cagefield.server.web import websocket
from cagefield.server.web.security import Allowance
from cagefield.server.web.worker_threads import run_in_thread
from scenes import ball_scene

EDIT = {
    "inner": {"center": [0, 0, 0], "size": 1},
    "outer": {"margin": 0.5},
    "operations": [{"translate": [0.01, 0, 0]}],
}


def test_work_in_a_thread_returns_raises_and_is_waited_for() -> None:
    """Who is cancelled ends with the work, not before."""
    began, go_on = threading.Event(), threading.Event()
    done: list[str] = []

    def work() -> str:
        began.set()
        go_on.wait(60)
        done.append("work")
        return "done"

    async def check() -> None:
        assert await run_in_thread(lambda: 3) == 3
        with pytest.raises(EditFileError):
            await run_in_thread(lambda: parse_edits("edits: 1"))
        waiting = asyncio.ensure_future(run_in_thread(work))
        await asyncio.to_thread(began.wait, 60)
        waiting.cancel()
        await asyncio.sleep(0.05)
        assert not waiting.done()
        go_on.set()
        with pytest.raises(asyncio.CancelledError):
            await waiting
        assert done == ["work"]

    asyncio.run(check())


def test_each_page_has_its_turn(monkeypatch: pytest.MonkeyPatch) -> None:
    """A page that says one thing waits for one message of each of 30 that always have more to say."""
    monkeypatch.setattr(websocket, "Allowance", lambda *_: Allowance(1000.0, 1.0, 1.0))
    heard: list[int] = []

    async def check() -> None:
        turns = websocket._Turns()

        async def flood(number: int) -> None:
            while True:
                await turns.take()
                heard.append(number)

        floods = [asyncio.ensure_future(flood(number)) for number in range(30)]
        while len(heard) < 100:
            await asyncio.sleep(0.01)
        before = len(heard)
        await turns.take()
        assert len(heard) - before <= 30 + 1
        for task in floods:
            task.cancel()
        # 2: those before the first wait
        assert max(map(heard.count, range(30))) - min(map(heard.count, range(30))) <= 2

    asyncio.run(check())


def test_problems_of_many_edits_are_found_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Edit] = []

    def counting(edit: Edit) -> str | None:
        asked.append(edit)
        return validity.problem(edit)

    monkeypatch.setattr(edit_texts, "problem", counting)
    monkeypatch.setattr(session_state, "problem", counting)
    ball_scene().save(tmp_path / "scene")
    scene = Scene.open(tmp_path / "scene")
    store = SceneStore(scene, tmp_path / "scene")
    edited = Session(store.document(), scene.field.bounds, scene.field.sample_spacing)
    read = read_edits(json.dumps({"edits": [EDIT] * 200}), store.admitted)
    store.remember(read)
    assert edited.take_edits(read, append=False) == 200 and len(asked) == 200
    for n in range(3):
        edited.change(edited.document.entries[n].id, name=f"edit {n}")
        state_of(edited, "", 0, {})
        edited.drawn()
    assert len(asked) == 203
    store.autosave(edited)
    recovered = SceneStore(scene, tmp_path / "scene").recovered()
    assert recovered is not None and recovered.stack == edited.document.stack
