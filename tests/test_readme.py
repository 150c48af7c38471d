"""What the README shows works: its edit file, its Python, its commands."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from cagefield import Scene
from cagefield.cli import parse
from cagefield.edits.files import parse_edits
from scenes import ball_scene

README = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", README, re.S | re.M)


def test_edit_file() -> None:
    (text,) = blocks("yaml")
    edits = parse_edits(text)
    edits.check()
    assert [edit.name for edit in edits] == ["raise the arm", "a second cone", "no beacon"]
    assert edits[1].keep_source and edits[2].deleted


def test_python(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    ball_scene().save("scene")
    (code,) = blocks("python")
    names: dict[str, object] = {}
    exec(code, names)
    assert Scene.open("edited").edits == names["edited"].edits  # type: ignore[attr-defined]


def test_commands_have_the_options_they_are_shown_with() -> None:
    lines = [line.partition("#")[0].strip() for block in blocks("sh") for line in block.splitlines()]
    commands = [shlex.split(line.rpartition("&& ")[2])[1:] for line in lines if "cagefield " in line]
    assert {command[0] for command in commands} >= {"demo", "make-scene", "train", "info", "edit", "render"}
    for command in commands:
        assert not isinstance(parse(command), int), command
