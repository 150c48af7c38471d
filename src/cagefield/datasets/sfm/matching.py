"""Feature matching by pycolmap, with one thread in each of one or several processes.

pycolmap's matcher clusters descriptors with a BLAS that is not thread-safe: with several threads, one run in
a hundred lost most matches of some pairs. So each process has one thread and, where there are several, a copy
of the database, whose matches are merged into the first one.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

from cagefield.datasets.sfm import colmap_process, features
from cagefield.datasets.sfm.features import OnProgress, Pairs
from cagefield.datasets.sfm.moving_features import MIN_STATIC_MATCHES

_TILE_PHOTOS = 12  # pairs are matched in tiles of so many photos each way, whose descriptors are read once

_MIN_PAIRS_PER_PROCESS = 100
"""Minimum number of pairs that is worth another process, which takes half a second to start."""

_MAX_PROCESSES = 8


def match(
    database: Path,
    names: Sequence[str],
    pairs: Pairs,
    *,
    verify: bool,
    several: bool = False,
    seed: int = 0,
    on_progress: OnProgress | None = None,
    processes: int | None = None,
) -> None:
    """Match the features of the photos `names[i]`, `names[j]` for all (i, j) in `pairs`.

    Pairs with matches are skipped. `verify` fits epipolar geometry to each pair; `several` fits more than
    one, of things that move on their own, from MIN_STATIC_MATCHES matches on. The result does not depend on
    the
    number of `processes`, which for None is one a core, and fewer for few pairs.

    Raises StoppedError where COLMAP fails.
    """
    ordered = sorted(pairs, key=lambda pair: (pair[0] // _TILE_PHOTOS, pair[1] // _TILE_PHOTOS, pair))
    lines = [f"{names[i]} {names[j]}\n" for i, j in ordered]
    if processes is None:
        processes = min(os.cpu_count() or 1, _MAX_PROCESSES, len(lines) // _MIN_PAIRS_PER_PROCESS)
    count = max(1, processes)

    def progress(done: int) -> None:
        if on_progress is not None:
            on_progress(done / max(1, len(lines)), f"matches of {done} of {len(lines)} pairs")

    with tempfile.TemporaryDirectory(prefix=".matches-", dir=database.parent) as name:
        ends = [len(lines) * n // count for n in range(count + 1)]
        parts = [Path(name) / str(n) for n in range(count)]
        tasks = []
        for part, start, end in zip(parts, ends[:-1], ends[1:], strict=True):
            part.mkdir()
            copy = database if count == 1 else Path(shutil.copyfile(database, part / "database.db"))
            task = {"task": "match", "database": str(copy), "folder": str(part), "lines": lines[start:end]}
            tasks.append(task | {"verify": verify, "several": several, "seed": seed})
        colmap_process.run_tasks("matching", tasks, progress)
        if count > 1:
            for part in parts:
                _merge(part / "database.db", database)
    progress(len(lines))


def match_in_process(
    database: str,
    folder: str,
    lines: Sequence[str],
    verify: bool,
    several: bool,
    seed: int,
    on_done: Callable[[int], None],
) -> None:
    """Match the pairs of names in `lines` in this process, which COLMAP aborts where it cannot write.

    `on_done` is called with the number of pairs done; the list of a batch of pairs is written to `folder`.
    """
    pycolmap = features.import_pycolmap()
    options = pycolmap.FeatureMatchingOptions(
        use_gpu=False, skip_geometric_verification=not verify, num_threads=1
    )
    verification = pycolmap.TwoViewGeometryOptions()
    verification.ransac.random_seed = seed
    if several:
        verification.multiple_models = True
        verification.min_num_inliers = MIN_STATIC_MATCHES
    listing = Path(folder) / "pairs.txt"
    pairing = pycolmap.ImportedPairingOptions(match_list_path=str(listing))
    for start in range(0, len(lines), _TILE_PHOTOS**2):
        batch = lines[start : start + _TILE_PHOTOS**2]
        listing.write_text("".join(batch), encoding="utf-8")
        features.call_cancellable(
            pycolmap.match_image_pairs,
            Path(database),
            matching_options=options,
            pairing_options=pairing,
            verification_options=verification,
            device=pycolmap.Device.cpu,
        )
        on_done(start + len(batch))


def _merge(source: Path, target: Path) -> None:
    """Copy the matches and two-view geometries of `source` to `target`, where `target` lacks them."""
    pycolmap = features.import_pycolmap()
    with features.open_database(source) as one, features.open_database(target) as other:
        for pair, matches in zip(*one.read_all_matches(), strict=True):
            first, second = pycolmap.pair_id_to_image_pair(pair)
            if not other.exists_matches(first, second):
                other.write_matches(first, second, matches)
            has_geometry = one.exists_two_view_geometry(first, second)
            if has_geometry and not other.exists_two_view_geometry(first, second):
                other.write_two_view_geometry(first, second, one.read_two_view_geometry(first, second))
