"""Ratchet of the language: counts over the syntax tree that may fall and not rise.

A failing test names the modules with the most cases. Lower a limit in LIMITS with every improvement.
"""

from __future__ import annotations

import ast
from collections import Counter
from pathlib import Path

import pytest
from benchmarks.code_counts import (
    SourceTree,
    british_identifiers,
    functions_called_of,
    longest_signatures,
    pronoun_starts,
    shared_constant_names,
    what_sentences,
)

ROOT = Path(__file__).parents[1]

LIMITS = {
    "share of sentences with what": 0.0016,
    "sentences that begin with what, that, those, the same": 0,
    "functions called of": 0,
    "constant names with several values": 14,
    "definitions in British spelling": 14,
    "parameters of the longest signature": 12,
}


@pytest.fixture(scope="module")
def tree() -> SourceTree:
    return SourceTree.parse(ROOT / "src" / "cagefield")


def check(name: str, value: float, worst: object) -> None:
    if isinstance(worst, Counter):
        worst = worst.most_common(8)
    assert value <= LIMITS[name], f"{name}: {value}, at most {LIMITS[name]}; worst: {worst}"


def test_sentences_with_what(tree: SourceTree) -> None:
    total, found = what_sentences(tree)
    check("share of sentences with what", found.total() / total, found)


def test_sentences_that_begin_with_a_pronoun(tree: SourceTree) -> None:
    found = pronoun_starts(tree)
    check("sentences that begin with what, that, those, the same", found.total(), found)


def test_docstrings_of_test_helpers_begin_with_nouns() -> None:
    """Modules of `tests` that are no test modules; names of tests, and their docstrings, are sentences."""
    files = [file for file in (ROOT / "tests").rglob("*.py") if not file.name.startswith("test_")]
    modules = {file.stem: ast.parse(file.read_text(encoding="utf-8")) for file in files}
    assert len(modules) > 80
    found = pronoun_starts(SourceTree(modules, "tests"))
    assert found.total() == 0, found


def test_functions_called_of(tree: SourceTree) -> None:
    found = functions_called_of(tree)
    check("functions called of", found.total(), found)


def test_constants_name_their_quantity(tree: SourceTree) -> None:
    """A name with several values in several modules does not say its quantity."""
    found = shared_constant_names(tree)
    check("constant names with several values", len(found), sorted(found, key=lambda name: -len(found[name])))


def test_spelling_of_identifiers(tree: SourceTree) -> None:
    found = british_identifiers(tree)
    check("definitions in British spelling", found.total(), found)


def test_length_of_signatures(tree: SourceTree) -> None:
    ((longest, name), *_) = longest_signatures(tree, 1)
    check("parameters of the longest signature", longest, name)


def test_counts_find_cases(tmp_path: Path) -> None:
    """The counts of a package with one case of each kind."""
    package = tmp_path / "toy"
    package.mkdir()
    (package / "__init__.py").write_text('"""What a toy is. A plain sentence; one with what it does."""\n')
    (package / "one.py").write_text(
        '"""Toy module."""\n\nfrom toy import two\n\nREACH = 1\n\n\n'
        "def of(colour, b, c):\n    return two.REACH\n"
    )
    (package / "two.py").write_text('"""Other module."""\n\nREACH = 2\n')
    toy = SourceTree.parse(package)
    total, found = what_sentences(toy)
    assert (total, found.total(), pronoun_starts(toy).total()) == (5, 2, 1)
    assert functions_called_of(toy) == {"toy.one": 1} and british_identifiers(toy) == {"toy.one": 1}
    assert shared_constant_names(toy) == {"REACH": {"1", "2"}}
    assert longest_signatures(toy) == [(3, "toy.one.of")] and toy.room_arrows() == {("one", "two")}
