from __future__ import annotations

import json
import textwrap
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cagefield.edits import (
    Copy,
    Delete,
    Edit,
    EditStack,
    Flow,
    Move,
    MoveCorners,
    Rotate,
    Trilinear,
    dump_edits,
    edit_files,
    load_edits,
    parse_edits,
    save_edits,
)
from cagefield.errors import EditFileError
from cagefield.geometry.cage import Cage
from random_cages import edits, examples, seeds

INNER, OUTER = Cage.box((0, 0, 0), 0.6), Cage.box((0, 0, 0), 1.6)

ONE = """\
edits:
  - name: arm
    inner: {center: [0, 0, 0], size: 1}
    outer: {margin: 1}
    operations:
      - translate: [0, 0, 0.1]
"""


def test_the_example_in_the_docstring_is_an_edit_file() -> None:
    text = textwrap.dedent((edit_files.__doc__ or "").split("\n\n")[1])
    with pytest.raises(EditFileError, match=r"edits\[5\]\.inner\.mesh: a mesh file is read"):
        parse_edits(text)
    *known, _ = text.split("  - name:")
    first, second, third, fourth, fifth = parse_edits("  - name:".join(known))
    assert fifth.name == "bent arm" and [o.noun for o in fifth.operations][:3] == ["bend", "twist", "taper"]
    assert fourth == Edit.points([[0, 0, 1]], radius=0.5, name="nose").move_point(0, (0, 0.3, 0)).move_points(
        [0], (0, 0.1, 0)
    )
    assert third == Edit.paste("../microphone", Cage.box((0, 0, 0), 2), name="microphone")
    assert first.name == "arm up" and first.lattice == 64 and len(first.operations) == 8
    assert isinstance(second, Delete) and second.inner == Cage.box((2, 0, 0), 0.5)


def test_every_key() -> None:
    (edit,) = parse_edits(
        """
        - name: cup
          adjustment: discrete
          inner: {center: [1, 2, 3], size: [1, 2, 3], rotation_deg: [0, 0, 30], pivot: [1, 2, 0]}
          keep_source: true
          enabled: false
          operations:
            - rotate_deg: {by: [0, 0, 90], axes: cage}
            - scale: 2
            - shear: {zx: 1e-1, axes: cage}
            - move_edge: {edge: [1, 0], by: [0, 0, -0.1]}
            - move_face: {face: "-z", by: [0, 0, -1]}
            - move_corners: {corners: [0, 7], by: [0, 0, 0.1]}
        """
    )
    inner = Cage(Cage.box((1, 2, 3), (1, 2, 3), (0, 0, np.radians(30))).corners, pivot=np.array((1.0, 2, 0)))
    expected = (
        Edit.copy(inner, name="cup", enabled=False)
        .rotate((0, 0, np.radians(90)), axes="cage")
        .scale(2)
        .shear(zx=0.1, axes="cage")
        .move_edge((1, 0), (0, 0, -0.1))
        .move_face("-z", (0, 0, -1))
        .then(MoveCorners((0, 7), (0.0, 0.0, 0.1)))
    )
    assert edit == expected
    assert parse_edits(dump_edits(EditStack([expected]))) == EditStack([expected])
    (cornered,) = parse_edits(f"edits: [{{inner: {{corners: {INNER.corners.tolist()}}}, delete: true}}]")
    assert cornered == Edit.delete(Cage(INNER.corners))


@examples(15)
@given(edits(), seeds, st.sampled_from(["yaml", "json"]), st.booleans())
def test_round_trips_are_exact(edit: Edit, seed: int, kind: str, discrete: bool) -> None:
    rng = np.random.default_rng(seed)
    if discrete:
        discrete = Copy if rng.integers(2) else Move
        edit = discrete(
            edit.inner,
            operations=edit.operations,
            unused_shell=edit.shell_settings,
            **(edit.shared_options | {"name": "Fuß #1: 'x'"}),
        )
    other = Edit.delete(Cage.box(rng.normal(size=3), rng.random(3) + 0.1, rng.normal(size=3)), name="1e3")
    shown = (
        Edit.continuous(INNER, OUTER, lattice=64, allow_folding=True, name="null")
        .rotate((0, 0, 1.0))
        .shear(xy=1e-7)
    )
    stack = EditStack([edit, other, shown])
    again = parse_edits(dump_edits(stack, format=kind), format=kind)
    for n in range(3):
        for field in fields(Edit):
            assert getattr(again[n], field.name) == getattr(stack[n], field.name), field.name


def test_files_are_what_a_person_would_write() -> None:
    tilted = Cage.box((0.1, 0.2, 0.3), (1, 2, 3), np.radians((10, 20, 30)))
    edit = (
        Edit.continuous(tilted, tilted.grown(0.7), name="arm")
        .translate((0.1, 0, 0))
        .rotate(np.radians((0, 0, 12.5)))
    )
    assert edit.operations[1] == Rotate((0.0, 0.0, 12.5))
    assert dump_edits(EditStack([edit])) == (
        "version: 1\n"
        "edits:\n"
        "- name: arm\n"
        "  inner: {center: [0.1, 0.2, 0.3], size: [1.0, 2.0, 3.0], rotation_deg: [10.0, 20.0, 30.0]}\n"
        "  outer: {margin: 0.7}\n"
        "  operations:\n"
        "  - translate: [0.1, 0.0, 0.0]\n"
        "  - rotate_deg: [0.0, 0.0, 12.5]\n"
        "  adjustment: continuous\n"
        "  shell: flow\n"
    )


def test_save_and_load(tmp_path: Path) -> None:
    stack = EditStack([Edit.continuous(INNER, OUTER, name="arm").translate((0.1, 0, 0))])
    for name in ("edits.yaml", "edits.yml", "edits.json"):
        path = tmp_path / name
        path.write_text("old")
        save_edits(stack, path)
        assert load_edits(path) == stack
    assert sorted(p.name for p in tmp_path.iterdir()) == ["edits.json", "edits.yaml", "edits.yml"]
    assert json.loads((tmp_path / "edits.json").read_text())["version"] == 1


def test_a_failed_write_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "edits.yaml"
    path.write_text("old")

    def fail(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", fail)
    with pytest.raises(EditFileError, match=r"edits.yaml: cannot be written \(No space left on device\)"):
        save_edits(EditStack(), path)
    assert path.read_text() == "old" and len(list(tmp_path.iterdir())) == 1


def test_edits_that_cannot_be_evaluated_are_errors_unless_asked_for(tmp_path: Path) -> None:
    stack = EditStack([Edit.continuous(INNER, OUTER, shell=Trilinear(), name="arm").rotate((0, 0, 1))])
    path = tmp_path / "edits.yaml"
    save_edits(stack, path)
    with pytest.raises(
        EditFileError, match=r'edits.yaml, line 3: edits\[0\]: edit "arm": the trilinear shell folds'
    ):
        load_edits(path)
    assert load_edits(path, check=False) == stack
    hidden = EditStack([stack[0].replace(enabled=False)])
    save_edits(hidden, path)
    assert load_edits(path) == hidden


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            ("operations", "operation"),
            'line 5: edits.0..operation: unknown key "operation"; did you mean "operations"',
        ),
        (
            ("translate", "rotate"),
            'line 6: edits.0..operations.0..rotate: unknown key "rotate"; did you mean "rotate_deg"',
        ),
        (
            ("name: arm", "color: red"),
            'line 2: edits.0..color: unknown key "color"; the keys here are inner, name',
        ),
        (("0.1]", ".nan]"), r"line 6: edits.0..operations.0..translate.2.: numbers must be finite, got nan"),
        (("0.1]", "-.inf]"), "numbers must be finite, got -inf"),
        (("0.1]", "up]"), 'translate.2.: expected a number, got "up"'),
        (("0.1]", "true]"), "expected a number, got true"),
        (("0, 0.1]", "0.1]"), "line 6: .*translate: expected 3 items, got 2"),
        (("[0, 0, 0.1]", "0.1"), "line 6: .*translate: expected a list, got 0.1"),
        (("size: 1", "size: -1"), "line 3: edits.0..inner.size: must be positive, got -1"),
        (("size: 1", "size: [1, 1]"), "inner.size: expected 3 items, got 2"),
        (("size: 1", "sise: 1"), 'unknown key "sise"; did you mean "size"'),
        ((", size: 1", ""), 'line 3: .*a cage needs center and size, or 8 corners; "size" is missing'),
        (("size: 1", "size: 1, corners: []"), "either corners or center and size; remove one"),
        (
            ("{center: [0, 0, 0], size: 1}", "{corners: [[0, 0, 0]]}"),
            "inner.corners: expected 8 items, got 1",
        ),
        (
            ("{center: [0, 0, 0], size: 1}", "{points: [[0, 0, 0]], radius: .nan}"),
            "line 3: edits.0..inner.radius: numbers must be finite, got nan",
        ),
        (
            ("size: 1}", "size: 1, lattice: {points: [2, 2, 2], control_points: []}}"),
            "line 3: edits.0..inner.lattice.control_points: expected 8 items, got 0",
        ),
        (("margin: 1", "margin: 0"), "line 4: edits.0..outer.margin: must be positive, got 0"),
        (("    outer: {margin: 1}\n", ""), "line 2: edits.0.: .*a continuous edit needs an outer cage"),
        (("    inner: {center: [0, 0, 0], size: 1}\n", ""), '"inner" is missing'),
        (("name: arm", "name: [a]"), "line 2: edits.0..name: expected text, got a list"),
        (("name: arm", "enabled: maybe"), 'enabled: expected true or false, got "maybe"'),
        (("name: arm", "lattice: 1"), "lattice: expected a whole number from 2 to 512, got 1"),
        (
            ("name: arm", "adjustment: discreet"),
            'adjustment: must be continuous or discrete, got "discreet"; did you',
        ),
        (("name: arm", "shell: cubic"), 'shell must be one of flow, trilinear, got "cubic"'),
        (("name: arm", "keep_source: yes"), 'keep_source needs adjustment="discrete"'),
        (("name: arm", "inner: 1\n    name: arm"), 'line 4: edits.0..inner: key "inner" is given twice'),
        (
            ("translate: [0, 0, 0.1]", "translate: [0, 0, 2]"),
            "line 2: .*0.49 of this translation|0.50 of this",
        ),
        (("translate: [0, 0, 0.1]", "scale: [1, 0, 1]"), "line 6: .*scale.*must be positive, got 0"),
        (("translate: [0, 0, 0.1]", "scale: {by: 2, axis: cage}"), 'unknown key "axis"; did you mean "axes"'),
        (("translate: [0, 0, 0.1]", "scale: {by: 2, axes: own}"), 'must be world or cage, got "own"'),
        (("translate: [0, 0, 0.1]", "shear: {xx: 1}"), 'unknown key "xx"'),
        (
            ("translate: [0, 0, 0.1]", "move_corner: {corner: 8, by: [0, 0, 0]}"),
            "a whole number from 0 to 7, got 8",
        ),
        (("translate: [0, 0, 0.1]", "move_corner: {corner: 7}"), 'line 6: .*"by" is missing'),
        (
            ("translate: [0, 0, 0.1]", "move_corner: {corner: 7, by: [-2, -2, -2]}"),
            "line 6: .*inside out at corner 7",
        ),
        (
            ("translate: [0, 0, 0.1]", "move_edge: {edge: [0, 3], by: [0, 0, 0]}"),
            r"edge \(0, 3\) is not an edge",
        ),
        (("translate: [0, 0, 0.1]", "move_face: {face: up, by: [0, 0, 0]}"), 'face "up" is not a face'),
        (
            ("translate: [0, 0, 0.1]", "move_corners: {corners: [], by: [0, 0, 0]}"),
            "name one or more corners",
        ),
        (
            ("translate: [0, 0, 0.1]", "move_corners: {corners: [2, 2], by: [0, 0, 0]}"),
            r"each once, got \[2, 2\]",
        ),
        (
            ("translate: [0, 0, 0.1]", "translate: [0, 0, 0]\n        scale: 2"),
            "got translate and scale: start each",
        ),
        (("- translate: [0, 0, 0.1]", "- 3"), "line 6: edits.0..operations.0.: expected keys .translate"),
        (("edits:", "version: 2\nedits:"), "version 2 is newer than this program's 1; update"),
        (("edits:", "edit:"), 'line 1: edit: unknown key "edit"; did you mean "edits"'),
        (("[0, 0, 0.1]", "[0, 0"), "not valid YAML"),
        (("arm", "!!python/object:os.system x"), "cannot be read"),
        (("arm", "!!float x"), "cannot be read"),
    ],
)
def test_errors_name_the_line_the_key_and_the_cure(change: tuple[str, str], message: str) -> None:
    assert change[0] in ONE
    with pytest.raises(EditFileError, match=message) as caught:
        parse_edits(ONE.replace(*change), source="arm.yaml")
    assert str(caught.value).startswith("arm.yaml, line ") and "\n" not in str(caught.value)
    assert str(caught.value).count("arm.yaml") == 1
    parse_edits(ONE)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "the file is empty"),
        ("# nothing", "the file is empty"),
        ("edits: &a [*a]", "nested too deeply"),
        ("[" * 1000, "nested too deeply|not valid YAML"),
        ("a: &a [1,1,1,1,1,1,1,1,1,1]\n" + "".join(
            f"{y}: &{y} [{','.join(['*' + x] * 10)}]\n" for x, y in zip("abcdefgh", "bcdefghi", strict=True)
        ), "more than 250000 values"),
        ("\x00", "not valid YAML"),
        ("3", "expected keys"),
    ],
)  # fmt: skip
def test_texts_that_are_no_edit_files(text: str, message: str) -> None:
    with pytest.raises(EditFileError, match=message):
        parse_edits(text)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('{"edits": [', "x.json, line 1: not valid JSON"),
        (
            '{"edits": [{"inner": {"center": [0, 0, NaN], "size": 1}}]}',
            r"x.json: edits\[0\].inner.center\[2\]: numb",
        ),
        ('{"edits": [{"inner": 1, "inner": 2}]}', 'key "inner" is given twice'),
        ('{"edits": [{"inner": {"center": [0, 0, 0], "size": 1}, "delet": true}]}', 'did you mean "delete"'),
        ('{"edits": [{"inner": {"center": [0, 0, 0], "size": 1e999}}]}', "numbers must be finite, got inf"),
        ('{"edits": ' + "[" * 100_000, "nested too deeply"),
    ],
)
def test_errors_in_json(text: str, message: str) -> None:
    with pytest.raises(EditFileError, match=message):
        parse_edits(text, format="json", source="x.json")


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(EditFileError, match=r"none.yaml: cannot be read .No such file"):
        load_edits(tmp_path / "none.yaml")
    with pytest.raises(
        EditFileError, match=r'an edit file ends in .yaml, .yml or .json, got ".txt"; rename it'
    ):
        load_edits(tmp_path / "edits.txt")
    (tmp_path / "latin.yaml").write_bytes(b"name: \xff")
    with pytest.raises(EditFileError, match="not a UTF-8 text file"):
        load_edits(tmp_path / "latin.yaml")
    with pytest.raises(EditFileError, match="cannot be written"):
        save_edits(EditStack(), tmp_path / "none" / "edits.yaml")


def test_falloff_and_width_are_written_and_read() -> None:
    text = "- inner: {center: [0, 0, 0], size: 1}\n  outer: {margin: 1}\n  falloff: linear\n  width: 0.25\n"
    stack = parse_edits(text)
    assert stack[0].shell == Flow("linear", 0.25)
    assert parse_edits(dump_edits(stack)) == stack
    with pytest.raises(EditFileError, match=r"edits, line 1: \[0\]: edit: width must be above 0"):
        parse_edits(text.replace("0.25", "1.5"))
