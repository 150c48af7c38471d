"""Matches between features of photos, by pycolmap: one thread in each of several processes.

pycolmap's matcher clusters descriptors with a BLAS that is not safe in threads: with several of them, one run
in a hundred lost most matches of some pairs. So each process has one thread and a copy of the database, and
its matches are written into the first one.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from cagefield.datasets import features
from cagefield.datasets.features import OnProgress, Pairs
from cagefield.errors import DatasetError

OnMatched = Callable[[int], None]
"""Called with the number of pairs that are matched."""

_TILE = 12  # pairs are matched in tiles of so many photos each way, whose descriptors are read once

_FEW = 100
"""Pairs for which another process, which takes half a second to start, is worth it."""

_MOST_PROCESSES = 8


def match(
    database: Path,
    names: Sequence[str],
    pairs: Pairs,
    *,
    verify: bool,
    seed: int = 0,
    on_progress: OnProgress | None = None,
    processes: int | None = None,
) -> None:
    """Matches the features of the photos `names[i]`, `names[j]` for all (i, j) in `pairs`.

    Those that are matched already are left. `verify` fits epipolar geometry to each pair. The result does not
    depend on the number of `processes`, which for None is one a core, and fewer for few pairs.

    Raises DatasetError where COLMAP fails.
    """
    ordered = sorted(pairs, key=lambda pair: (pair[0] // _TILE, pair[1] // _TILE, pair))
    lines = [f"{names[i]} {names[j]}\n" for i, j in ordered]
    if processes is None:
        processes = min(os.cpu_count() or 1, _MOST_PROCESSES, len(lines) // _FEW)
    with tempfile.TemporaryDirectory(prefix=".matches-", dir=database.parent) as name:

        def progress(done: int) -> None:
            if on_progress is not None:
                on_progress(done / max(1, len(lines)), f"matches of {done} of {len(lines)} pairs")

        if processes < 2:
            _match_lines(database, Path(name), lines, verify, seed, progress)
        else:
            _match_apart(database, Path(name), lines, verify, seed, progress, processes)


def _match_lines(
    database: Path, folder: Path, lines: Sequence[str], verify: bool, seed: int, progress: OnMatched
) -> None:
    """Matches the pairs of names in `lines` in this process, in one thread."""
    pycolmap = features.engine()
    options = pycolmap.FeatureMatchingOptions(
        use_gpu=False, skip_geometric_verification=not verify, num_threads=1
    )
    verification = pycolmap.TwoViewGeometryOptions()
    verification.ransac.random_seed = seed
    listing = folder / "pairs.txt"
    pairing = pycolmap.ImportedPairingOptions(match_list_path=str(listing))
    for start in range(0, len(lines), _TILE**2):
        batch = lines[start : start + _TILE**2]
        listing.write_text("".join(batch), encoding="utf-8")
        features.call(
            pycolmap.match_image_pairs,
            database,
            matching_options=options,
            pairing_options=pairing,
            verification_options=verification,
            device=pycolmap.Device.cpu,
        )
        progress(start + len(batch))


def _match_apart(
    database: Path,
    folder: Path,
    lines: Sequence[str],
    verify: bool,
    seed: int,
    progress: OnMatched,
    processes: int,
) -> None:
    """Matches in processes of their own, each a stretch of `lines`."""
    ends = [len(lines) * n // processes for n in range(processes + 1)]
    parts = [folder / str(n) for n in range(processes)]
    running: list[subprocess.Popen[bytes]] = []
    try:
        for part, start, end in zip(parts, ends[:-1], ends[1:], strict=True):
            part.mkdir()
            shutil.copyfile(database, part / "database.db")
            (part / "lines.txt").write_text("".join(lines[start:end]), encoding="utf-8")
            command = [sys.executable, "-m", __name__, str(part), str(int(verify)), str(seed)]
            with (part / "errors.txt").open("wb") as errors:
                running.append(
                    subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=errors, stderr=errors)
                )
        while any(process.poll() is None for process in running):
            time.sleep(0.1)
            progress(sum(_done(part) for part in parts))
    finally:
        for process in running:
            process.kill()
            process.wait()
    for process, part in zip(running, parts, strict=True):
        if process.returncode != 0:
            reason = (part / "errors.txt").read_text(encoding="utf-8", errors="replace").split("\n")
            last = next((line for line in reversed(reason) if line.strip()), "")
            raise DatasetError(f"matching stopped with status {process.returncode}: {last}")
        _merge(part / "database.db", database)
    progress(len(lines))


def _done(part: Path) -> int:
    """Pairs that the process of a folder has matched."""
    with contextlib.suppress(OSError, ValueError):
        return int((part / "done.txt").read_text())
    return 0


def _merge(source: Path, target: Path) -> None:
    """Writes what was matched in `source` into `target`; pairs that it has are left."""
    pycolmap = features.engine()
    with (
        features.quiet(),
        contextlib.closing(pycolmap.Database.open(source)) as one,
        contextlib.closing(pycolmap.Database.open(target)) as other,
    ):
        for pair, matches in zip(*one.read_all_matches(), strict=True):
            first, second = pycolmap.pair_id_to_image_pair(pair)
            if not other.exists_matches(first, second):
                other.write_matches(first, second, matches)
            has_geometry = one.exists_two_view_geometry(first, second)
            if has_geometry and not other.exists_two_view_geometry(first, second):
                other.write_two_view_geometry(first, second, one.read_two_view_geometry(first, second))


def _main(folder: str, verify: str, seed: str) -> None:
    part = Path(folder)
    lines = (part / "lines.txt").read_text(encoding="utf-8").splitlines(keepends=True)

    def progress(done: int) -> None:
        (part / "done.txt").write_text(str(done))

    _match_lines(part / "database.db", part, lines, verify == "1", int(seed), progress)


if __name__ == "__main__":
    _main(*sys.argv[1:])
