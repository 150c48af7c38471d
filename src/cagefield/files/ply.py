"""PLY files: elements of named columns, ASCII or binary of either byte order.

Elements with list properties (a mesh's faces) are not read; they may only follow those that are.

Source: Turk, "The PLY Polygon File Format" (1994).
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from itertools import islice
from pathlib import Path
from typing import IO, Any, BinaryIO, cast

import numpy as np
from numpy.typing import NDArray

from cagefield.errors import FieldError
from cagefield.files.safe_open import open_regular, read_array

Columns = dict[str, NDArray[Any]]

_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2",
    "ushort": "u2", "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
_ORDERS = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}
_HEADER = 1 << 20  # bytes that a header may take
_LINES = 1 << 16  # rows of text that are held at a time
_LINE = 1 << 16  # bytes that a row of text may take


@dataclass(frozen=True)
class Ply:
    """The comments of a PLY file, and its elements: name -> column -> array [count]."""

    comments: tuple[str, ...]
    elements: Mapping[str, Columns]


@dataclass(frozen=True, eq=False)
class PlyTable:
    """An element of an open file: `rows(first, last)` reads some of its rows, column by column.

    `end` is the first byte of the file after it; `types` are the columns' by name, as NumPy names them.
    """

    count: int
    columns: tuple[str, ...]
    rows: Callable[[int, int], Columns]
    end: int = 0
    types: Mapping[str, str] = field(default_factory=dict)


@dataclass
class _Element:
    name: str
    count: int
    properties: list[tuple[str, str]]
    has_list: bool = False


def read_ply(path: str | Path) -> Ply:
    """The elements of a PLY file up to the first with a list property.

    Raises:
        FieldError: no such file, no PLY, a header that makes no sense, less data than it says.
    """
    comments, tables = open_ply(path)
    return Ply(comments, {name: table.rows(0, table.count) for name, table in tables.items()})


def open_ply(path: str | Path) -> tuple[tuple[str, ...], dict[str, PlyTable]]:
    """(comments, elements) of a PLY file, up to the first with a list property; no rows are read yet.

    Raises:
        FieldError: as `read_ply`.
    """
    path = Path(path)
    try:
        file = open_regular(path)
    except FileNotFoundError:
        raise FieldError(f"{path}: no such file; give a .ply of splats") from None
    except OSError as error:
        raise FieldError(f"{path}: it cannot be read ({error.strerror}); give a .ply of splats") from None
    with file:
        kind, comments, declared = _header(path, file)
        tables: dict[str, PlyTable] = {}
        for element in declared:
            if element.has_list:
                break
            row = np.dtype([(name, _ORDERS[kind] + code) for name, code in element.properties])
            names = tuple(name for name, _ in element.properties)
            reader = _text(path, file, element) if kind == "ascii" else _binary(path, file, element, row)
            types = dict(element.properties)
            tables[element.name] = PlyTable(element.count, names, reader, file.tell(), types)
    return tuple(comments), tables


def ply_elements(path: str | Path) -> dict[str, int]:
    """Numbers of rows of all elements that a file's header declares, those with lists among them.

    Raises:
        FieldError: as `read_ply`.
    """
    with open_regular(path) as file:
        return {element.name: element.count for element in _header(Path(path), file)[2]}


def _header(path: Path, file: BinaryIO) -> tuple[str, list[str], list[_Element]]:
    """(format, comments, elements) as the header says, with the file at the first byte after it."""
    kind, comments, elements = "", list[str](), list[_Element]()
    if file.readline(16).strip() != b"ply":
        raise FieldError(f"{path}: not a PLY file; give a .ply of splats")
    while file.tell() < _HEADER:
        line = file.readline(_HEADER)
        if not line.endswith(b"\n"):
            break
        words = line.decode("latin-1").split()
        if words == ["end_header"]:
            if kind not in _ORDERS:
                raise FieldError(f"{path}: its header names no format that PLY has; export the file again")
            return kind, comments, elements
        try:
            match words:
                case ["format", name, "1.0"]:
                    kind = name
                case ["comment" | "obj_info", *rest]:
                    comments.append(" ".join(rest))
                case ["element", name, count] if int(count) >= 0:
                    elements.append(_Element(name, int(count), []))
                case ["property", "list", _, _, _]:
                    elements[-1].has_list = True
                case ["property", code, name] if name not in dict(elements[-1].properties):
                    elements[-1].properties.append((name, _TYPES[code]))
                case []:
                    pass
                case _:
                    raise ValueError
        except (ValueError, KeyError, IndexError):
            text = " ".join(words)[:60]
            raise FieldError(f"{path}: its header has the line {text!r}; export the file again") from None
    raise FieldError(f"{path}: its header has no end; the file may be truncated, copy it again")


def _text(path: Path, file: BinaryIO, element: _Element) -> Callable[[int, int], Columns]:
    """The rows of an element in text, from where the file stands, in a temporary file as numbers."""
    names = [name for name, _ in element.properties]
    row = np.dtype((np.float64, (len(names),)))
    spool = cast(IO[bytes], tempfile.SpooledTemporaryFile(max_size=1 << 26))  # noqa: SIM115 - it ends with `rows`
    every = iter(partial(file.readline, _LINE), b"")  # what has no end of lines is not read to its own
    done = 0
    while done < element.count:
        lines = [line.split() for line in islice(every, min(_LINES, element.count - done))]
        try:
            if not lines:
                raise ValueError
            spool.write(np.array(lines, np.float64).reshape(len(lines), len(names)).tobytes())
        except ValueError:
            raise FieldError(
                f"{path}: its {element.count} rows of {element.name} are not {len(names)} numbers each; the "
                "file may be truncated, copy it again"
            ) from None
        done += len(lines)

    def rows(first: int, last: int) -> Columns:
        if not names:
            return {}
        spool.seek(first * row.itemsize)
        read = spool.read(max(0, min(last, element.count) - first) * row.itemsize)
        values = np.frombuffer(read, np.float64).reshape(-1, len(names))
        return {name: values[:, column] for column, name in enumerate(names)}

    return rows


def _binary(
    path: Path, file: BinaryIO, element: _Element, row: np.dtype[Any]
) -> Callable[[int, int], Columns]:
    """Reads rows of an element that begins where the file stands; the file then stands at its end."""
    begin, left = file.tell(), path.stat().st_size - file.tell()
    if element.count * row.itemsize > left:
        raise FieldError(
            f"{path}: it says {element.count} of {element.name}, and holds {left // max(1, row.itemsize)}; "
            "it is truncated, copy it again"
        )
    file.seek(element.count * row.itemsize, 1)

    def rows(first: int, last: int) -> Columns:
        count = max(0, min(last, element.count) - first)
        if not row.itemsize:
            return {}
        table = read_array(path, row, count, offset=begin + first * row.itemsize)
        return {name: table[name] for name in row.names or ()}

    return rows
