"""What the README and the documentation show works: their edit files, their Python, their commands."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from cagefield import Scene
from cagefield.cli import parse
from cagefield.edits import Copy, Delete
from cagefield.edits.edit_files import parse_edits
from cagefield.geometry import ControlPoints, LatticeCage
from scenes import ball_scene

ROOT = Path(__file__).parents[1]
PAGES = ("README.md", *sorted(page.relative_to(ROOT).as_posix() for page in (ROOT / "docs").rglob("*.md")))


def blocks(page: str, language: str) -> list[str]:
    """The blocks of a language on a page, but for those that show a file of the repository."""
    text = (ROOT / page).read_text(encoding="utf-8")
    found: list[str] = re.findall(rf"^```{language}\n(.*?)^```", text, re.S | re.M)
    return [block for block in found if "--8<--" not in block]


@pytest.mark.parametrize("page", PAGES)
def test_edit_files(page: str) -> None:
    for text in blocks(page, "yaml"):
        if text.startswith("version:"):
            parse_edits(text).check()


def test_edit_files_show_every_kind_of_edit() -> None:
    (readme,) = blocks("README.md", "yaml")
    assert [edit.name for edit in parse_edits(readme)] == ["raise the arm"]
    text, points, lattice, chain, _, moved = blocks("docs/how-to/edit-files.md", "yaml")
    edits = parse_edits(text)
    assert [edit.name for edit in edits] == ["raise the arm", "a second cone", "no beacon"]
    assert isinstance(edits[1], Copy) and isinstance(edits[2], Delete)
    (cone,) = parse_edits(moved)
    assert (cone.fill, cone.relight) == ("surroundings", "none")
    (nose,), (arm,) = (parse_edits(f"version: 1\n{snippet}") for snippet in (points, lattice))
    assert isinstance(nose.inner, ControlPoints) and isinstance(arm.inner, LatticeCage)
    assert nose.is_possible and arm.is_possible
    assert [edit.parent for edit in parse_edits(f"version: 1\n{chain}")] == ["", "arm"]


@pytest.mark.parametrize("page", ["README.md", "docs/how-to/python.md"])
def test_python(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    ball_scene().save("scene")
    (code,) = blocks(page, "python")
    names: dict[str, object] = {}
    exec(code, names)
    assert Scene.open("edited").edits == names["edited"].edits  # type: ignore[attr-defined]


def commands(page: str) -> list[list[str]]:
    lines = [line.partition("#")[0].strip() for block in blocks(page, "sh") for line in block.splitlines()]
    return [shlex.split(line.rpartition("&& ")[2])[1:] for line in lines if "cagefield " in line]


@pytest.mark.parametrize("page", PAGES)
def test_commands_have_the_options_they_are_shown_with(page: str) -> None:
    for command in commands(page):
        assert not isinstance(parse(command), int), command


def test_commands_are_shown() -> None:
    assert {command[0] for command in commands("README.md")} >= {"demo", "train", "view", "edit", "render"}
    shown = {command[0] for page in PAGES for command in commands(page)}
    assert shown >= {
        "demo",
        "make-scene",
        "train",
        "poses",
        "info",
        "edit",
        "render",
        "import",
        "bake",
        "view",
    }
