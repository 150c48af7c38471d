"""Edit files that were made to do harm: names that no file takes, and texts that take for ever."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cagefield.edits import Edit, EditStack, dump_edits, load_edits, parse_edits
from cagefield.edits.edit_names import MAX_NAME_CHARACTERS, problem_of_name, sanitize_name
from cagefield.edits.operation_sequence import MAX_OPERATIONS
from cagefield.errors import CagefieldError, EditError, EditFileError
from cagefield.geometry.cage import Cage
from cagefield.server.editor.document import Document
from cagefield.server.editor.session import Session
from cagefield.server.protocol import server_messages
from cagefield.server.protocol.message_queues import SendQueue
from commands import given_up, printed
from scenes import ball_scene

INNER = Cage.box((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
BAD = {
    "half a character": "\ud800",
    "a control character": "a\x07b",
    "at most 200": "n" * 201,
}


def text_of(name: str, operations: int = 0) -> str:
    """An edit file in JSON with one discrete edit."""
    moves = [{"translate": [1e-3 * (-1) ** n, 0, 0]} for n in range(operations)]
    inner = {"center": [0, 0, 0], "size": 1}
    edit = {"name": name, "inner": inner, "adjustment": "discrete", "operations": moves}
    return json.dumps({"version": 1, "edits": [edit]})


@pytest.mark.parametrize(("message", "name"), BAD.items())
def test_a_name_that_nothing_takes_is_refused_at_every_entry(
    message: str, name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(EditError, match=message):
        Edit.move(INNER, name=name)
    with pytest.raises(EditFileError, match=message):
        parse_edits(text_of(name), format="json")
    session = Session(Document.from_edits([Edit.move(INNER)]), INNER.corners[[0, 7]], 0.1)
    for attempt in (
        lambda: session.load_edits(text_of(name), append=True),
        lambda: session.change(1, name=name),
    ):
        with pytest.raises(CagefieldError, match=message):
            attempt()
    assert [entry.edit.name for entry in session.document.entries] == [""]
    ball_scene().save(tmp_path / "scene")
    (tmp_path / "e.json").write_text(text_of(name))
    line = given_up(capsys, "edit", tmp_path / "scene", tmp_path / "e.json", "--check")
    assert message in line and len(line) < 400


@pytest.mark.parametrize("name", BAD.values())
def test_a_scene_that_has_such_a_name_opens_with_another(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "scene"
    ball_scene().save(folder)
    (folder / "edits.yaml").write_text(text_of(name))  # JSON is YAML
    assert "it is replaced" in _warned(capsys, folder)
    with pytest.warns(UserWarning, match="it is replaced"):
        (edit,) = load_edits(folder / "edits.yaml", mend=True)
    assert problem_of_name(edit.name) is None and edit.name == sanitize_name(name)
    assert parse_edits(dump_edits(EditStack([edit])))[0] == edit


def _warned(capsys: pytest.CaptureFixture[str], folder: Path) -> str:
    from cagefield.cli import main

    capsys.readouterr()
    assert main(["info", str(folder)]) == 0
    return capsys.readouterr().err


@settings(max_examples=50, deadline=None)
@given(st.text(st.characters(), max_size=250))
def test_every_name_that_is_taken_comes_back_bit_for_bit(name: str) -> None:
    if problem_of_name(name) is not None:
        name = sanitize_name(name)
        assert problem_of_name(name) is None and len(name) <= MAX_NAME_CHARACTERS
    stack = EditStack([Edit.move(INNER, name=name)])
    for form in ("yaml", "json"):
        text = dump_edits(stack, format=form)
        assert parse_edits(text.encode().decode(), format=form)[0].name == name


def test_messages_that_quote_half_characters_reach_the_page() -> None:
    """A folder's name on the disk may be no UTF-8: Python has half characters for its bytes."""
    queue = SendQueue()
    queue.put(server_messages.Notice(level="error", text="no \udcff there"))
    content = asyncio.run(queue.get())
    assert isinstance(content, str)
    assert json.loads(content.encode())["text"] == "no \udcff there"


def test_reading_moves_the_cage_once_for_each_operation(monkeypatch: pytest.MonkeyPatch) -> None:
    moves = 0
    translate = Cage.translate

    def counted(cage: Cage, by: object) -> Cage:
        nonlocal moves
        moves += 1
        return translate(cage, by)  # type: ignore[arg-type]

    monkeypatch.setattr(Cage, "translate", counted)
    text = text_of("many", 300)
    for form in ("json", "yaml"):
        moves = 0
        (edit,) = parse_edits(text, format=form)
        assert len(edit.operations) == 300 and moves == 300


def test_an_edit_that_cannot_be_done_is_explained_with_few_moves(monkeypatch: pytest.MonkeyPatch) -> None:
    content = json.loads(text_of("far", 200))
    content["edits"][0] |= {"adjustment": "continuous", "outer": {"margin": 0.5}}
    content["edits"][0]["operations"].insert(50, {"translate": [2, 0, 0]})
    moves = 0
    translate = Cage.translate

    def counted(cage: Cage, by: object) -> Cage:
        nonlocal moves
        moves += 1
        return translate(cage, by)  # type: ignore[arg-type]

    monkeypatch.setattr(Cage, "translate", counted)
    with pytest.raises(EditFileError, match=r"of this translation \(operation 51"):
        parse_edits(json.dumps(content), format="json")
    assert moves < 1000


def test_too_many_operations_and_edits_are_one_line() -> None:
    with pytest.raises(EditFileError, match=f"{MAX_OPERATIONS + 1} operations are too many"):
        parse_edits(text_of("long", MAX_OPERATIONS + 1), format="json")
    many = json.dumps({"edits": json.loads(text_of(""))["edits"] * 501})
    with pytest.raises(EditFileError, match="501 edits are too many"):
        parse_edits(many, format="json")


@pytest.mark.parametrize("form", ["json", "yaml"])
@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[" * 100_000, "nested too deeply|not valid YAML"),
        ("[" * 900 + "]" * 900, "nested too deeply"),
        ('{"a":' * 5_000 + "1" + "}" * 5_000, "nested too deeply|not valid YAML"),
        ("[" + ",".join(["1"] * 600_000) + "]", "more than 250000 values|too many"),
        ("[" + "9" * 5_000 + "]", "cannot be read|expected keys"),
        ('{"version": ' + "9" * 400 + ', "edits": []}', "more than 40 digits|has 400 digits"),
        ('{"edits": [{"inner": {"center": [1e999, 0, 0], "size": 1}}]}', "numbers must be finite"),
        ('{"edits": [], "\\ud800": 1}', "unknown key|not valid YAML"),
        ("{" + ",".join(f'"{n}": 1' for n in range(50_000)) + "}", "unknown key"),
    ],
)  # fmt: skip
def test_texts_made_to_break_the_reader_are_one_short_line(form: str, text: str, message: str) -> None:
    with pytest.raises(EditFileError, match=message) as caught:
        parse_edits(text, format=form)
    assert len(str(caught.value)) < 400


@pytest.mark.parametrize(
    "tag", ["!!int ''", "!!float x", "!!bool 7", "!!timestamp x", "!!binary é", "!!null {}"]
)
def test_tags_on_values_that_are_not_theirs(tag: str) -> None:
    with pytest.raises(EditFileError):
        parse_edits(f"edits:\n  - name: {tag}\n    inner: {tag}\n")


def test_check_of_many_operations_ends(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ball_scene().save(tmp_path / "scene")
    (tmp_path / "e.json").write_text(text_of("many", MAX_OPERATIONS))
    assert "checked, nothing written" in printed(
        capsys, "edit", tmp_path / "scene", tmp_path / "e.json", "--check"
    )
