"""Random edits of every kind keep their promises; the command that measures ten thousand of them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from benchmarks.edits.random_promises import (
    KINDS,
    Promises,
    append,
    measure,
    possible_edit,
    read_log,
    run,
    surface_points,
    table,
    tasks,
)

from cagefield.edits import Edit, Trilinear
from cagefield.edits.edit import Continuous
from cagefield.geometry.cage import Cage

GOOD = Promises("box", 0, 0, 1, 0.5, 0.0, 1e-9, 1e-8, 1e-4)


@pytest.mark.parametrize("kind", KINDS)
def test_the_first_edit_of_every_kind_keeps_its_promises(kind: str) -> None:
    row = run((kind, 0, 12))
    assert row.failures == (), row


@pytest.mark.nightly
@pytest.mark.parametrize("kind", KINDS)
def test_fifty_edits_of_every_kind_keep_their_promises(kind: str) -> None:
    rows = [run((kind, number, 24)) for number in range(10_000, 10_050)]
    assert [row for row in rows if row.failures] == []
    # They do move things: the least ratio of volumes is no identity's.
    assert np.median([row.least_det for row in rows]) < 0.9


def test_a_correction_that_is_steep_at_a_corner_alone_is_found() -> None:
    """A drag of a corner beside which the correction of a lattice folds."""
    row = run(("lattice, bspline", 200, 24))
    assert row.failures == (), row


def test_edits_are_of_their_kind_in_an_outer_cage_and_the_draws_repeat() -> None:
    for kind in KINDS:
        edit, seed, refused = possible_edit(kind, 3)
        assert isinstance(edit, Continuous) and edit.outer.contains(edit.deformed.handles).all()
        assert possible_edit(kind, 3) == (edit, seed, refused) and seed % 1_000_000 == 3


def test_a_fold_is_measured() -> None:
    inner = Cage.box((0, 0, 0), 0.6)
    folded = Edit.continuous(inner, inner.grown(0.4), shell=Trilinear(), allow_folding=True).rotate(
        (0, 0, 2.5)
    )
    assert isinstance(folded, Continuous)
    least, _, _, trip, _ = measure(folded, 400, 0)
    assert least <= 0.0 and trip > 1e-4
    broken = Promises("box", 0, 0, 0, least, 0.0, 0.0, trip, 0.0).failures
    assert broken == ("least det J", "round trip")


def test_a_jump_at_the_inner_surface_is_measured() -> None:
    inner = Cage.box((0, 0, 0), 0.6)
    shell = Edit.continuous(inner, inner.grown(0.4)).translate((0.2, 0.0, 0.0))
    assert isinstance(shell, Continuous)
    assert measure(shell, 50, 0)[4] < 1e-6
    surface = surface_points(shell.deformed, 50, np.random.default_rng(0))
    assert np.abs(np.abs(surface - (0.2, 0.0, 0.0)).max(axis=1) - 0.3).max() < 1e-12
    assert replace(GOOD, kind="mesh").failures == ("continuity",)


def test_broken_promises_are_named_nan_among_them_and_counted_by_kind() -> None:
    nan = float("nan")
    moved = Promises("mesh", 0, 0, 0, 0.2, 2e-6, 0.0, nan, 0.0)
    rim = Promises("mesh", 1, 1, 0, nan, 0.0, 2e-6, 0.0, 0.0)
    assert GOOD.failures == ()
    assert moved.failures == ("outside", "round trip") and rim.failures == ("least det J", "outer faces")
    text = table([GOOD, moved, rim], 12, "command").markdown()
    assert "| box | 1 | 50.0% | 5.0e-01 | 0.50 | 0.0e+00 | 1.0e-09 | 1.0e-08 | 1.0e-04 | 0 |" in text
    assert text.count("| mesh | 2 |") == 1 and "outer faces 1" in text and "`command`" in text


def test_a_run_goes_on_where_its_log_ends(tmp_path: Path) -> None:
    log = tmp_path / "log"
    assert read_log(log) == []
    log.write_text('{"kind": "box", "num')  # killed while it wrote
    assert read_log(log) == []
    rows = [GOOD, replace(GOOD, number=2)]
    for row in rows:
        append(log, row)
    assert read_log(log) == rows
    kinds = list(KINDS)
    todo = list(tasks(3 * len(kinds), 6, rows))
    assert len(todo) == 3 * len(kinds) - 2 and ("box", 1, 6) in todo and ("box", 2, 6) not in todo
    assert [kind for kind, _, _ in todo[: len(kinds) - 1]] == kinds[1:]
    assert list(tasks(3 * len(kinds), 6, rows, last_first=True)) == todo[::-1]
