"""Tables of figures, on screen and as Markdown."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from cagefield.errors import CagefieldError
from cagefield.files.atomic import replaced_file


@dataclass(frozen=True)
class Table:
    """Text cells by row, with a title and notes; the first `names` columns are set left, the others right.

    `shown` are the columns that fit a screen; all of them where left out.

    Raises:
        CagefieldError: a row with another number of cells than there are columns.
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()
    names: int = 1
    shown: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for number, row in enumerate(self.rows, start=1):
            if len(row) != len(self.columns):
                raise CagefieldError(
                    f"row {number} of the table {self.title!r} has {len(row)} cells; it must have "
                    f"{len(self.columns)}, one for each column"
                )

    def markdown(self) -> str:
        """The table as Markdown, notes below it."""
        sides = ["---" if index < self.names else "---:" for index in range(len(self.columns))]
        lines = [f"# {self.title}", "", _row(self.columns), _row(tuple(sides)), *map(_row, self.rows), ""]
        return "\n".join([*lines, *(f"- {note}" for note in self.notes)]).rstrip() + "\n"

    def show(self) -> None:
        """Prints the columns that fit a screen, and the notes."""
        from rich.console import Console
        from rich.table import Table as Grid

        grid = Grid(title=self.title)
        chosen = [i for i, column in enumerate(self.columns) if not self.shown or column in self.shown]
        for index in chosen:
            grid.add_column(self.columns[index], justify="left" if index < self.names else "right")
        for row in self.rows:
            grid.add_row(*(row[index] for index in chosen))
        console = Console()
        console.print(grid)
        for note in self.notes:
            console.print(note, style="dim", highlight=False, markup=False)


def number(value: float, digits: int = 2) -> str:
    """The value with so many decimals; "-" for NaN, "inf" for infinity."""
    if math.isnan(value):
        return "-"
    return "inf" if math.isinf(value) else f"{value + 0.0:.{digits}f}"


def write_text(path: Path, text: str) -> None:
    """Writes a text file, whole or not at all."""
    write_texts({path: text})


def write_texts(texts: Mapping[Path, str]) -> None:
    """Writes text files, all of them or none."""
    with drafted_texts(texts):
        pass


@contextmanager
def drafted_texts(texts: Mapping[Path, str]) -> Iterator[None]:
    """Writes text files that take their places at the end, all of them or none, after what is done within."""
    with ExitStack() as stack:
        for path, text in texts.items():
            temporary = stack.enter_context(replaced_file(path))
            temporary.write_text(text, encoding="utf-8")
        yield


def _row(cells: tuple[str, ...]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
