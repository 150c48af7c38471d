"""Digest of COLMAP's database of features and matches, by which the next run trusts the database.

COLMAP reads a database without checks: wrong numbers end its process, or keep it busy for ever.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import sqlite3
import warnings
from collections.abc import Iterator
from pathlib import Path

from cagefield.errors import DatasetError
from cagefield.files.atomic import replaced_file
from cagefield.files.safe_open import check_regular

_BLOCK_BYTES = 1 << 20


@contextlib.contextmanager
def recorded_digest(database: Path) -> Iterator[None]:
    """Write the digest of the database beside it if an error ends the block; a killed process leaves none."""
    note = _digest_file(database)
    note.unlink(missing_ok=True)
    try:
        yield
    except BaseException:
        with contextlib.suppress(OSError), replaced_file(note) as draft:
            draft.write_text(_digest(database), encoding="ascii")
        raise


def check_database(database: Path) -> None:
    """Remove a database that is damaged, with a warning; without a digest SQLite's own check decides.

    Raises DatasetError for a database that may not be written. Nothing else has the database open meanwhile:
    SQLite's locks do not know of each other where two libraries of it are in one process.
    """
    if not database.exists():
        return
    try:
        check_regular(database)
    except OSError as error:
        raise DatasetError(f"{database} is in the way ({error.strerror}); move it away") from None
    folder = database.parent
    if not (os.access(database, os.R_OK | os.W_OK) and os.access(folder, os.W_OK)):
        raise DatasetError(f"{database} may not be written; make it and {folder} writable, or move it away")
    note = _digest_file(database)
    if note.is_file():
        damage = None if note.read_bytes() == _digest(database).encode() else "its digest is another"
    else:
        damage = _sqlite_damage(database)
    if damage is None:
        return
    warnings.warn(f"{database} is damaged ({damage}); features and matches are found anew", stacklevel=2)
    for file in folder.glob(f"{database.name}*"):
        file.unlink()


def _digest_file(database: Path) -> Path:
    return database.with_name(database.name + ".digest")


def _digest(database: Path) -> str:
    """Hexadecimal digest of the database and of the journal that is not yet part of it."""
    digest = hashlib.blake2b()
    for file in (database, database.with_name(database.name + "-wal")):
        if file.is_file():
            with file.open("rb") as content:
                while block := content.read(_BLOCK_BYTES):
                    digest.update(block)
    return digest.hexdigest()


def _sqlite_damage(database: Path) -> str | None:
    """Damage that SQLite finds, as one line; None for a database without damage, or one that is locked."""
    try:
        with contextlib.closing(sqlite3.connect(database)) as opened:
            found = str(opened.execute("PRAGMA quick_check(1)").fetchone()[0])
            if found == "ok" and opened.execute("SELECT 1 FROM images").fetchone():
                return None
            reason = "it holds no photos" if found == "ok" else found
    except sqlite3.OperationalError as error:
        if not str(error).startswith("no such"):  # locked, or the disk's fault: COLMAP names the reason
            return None
        reason = str(error)
    except sqlite3.DatabaseError as error:
        reason = str(error)
    return " ".join(reason.split())[:120]
