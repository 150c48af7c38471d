"""Gaussian splats of USD files (.usda, .usdc, .usdz, .usd), read by usd-core in a process of its own.

The library ends its process on some damaged files; a program that opens one gets a line instead. The process
(`python -m cagefield.formats.splats.usd_process`) writes the arrays of `usd_prims` to a temporary folder.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import warnings
from collections.abc import Iterator
from pathlib import Path

from cagefield.errors import FieldError
from cagefield.files import json_text
from cagefield.formats.splats.splat_table import SplatBatch, SplatSource
from cagefield.formats.splats.usd_library import import_usd
from cagefield.formats.splats.usd_prims import UsdSplats, damaged_usd
from cagefield.formats.splats.usd_process import ANSWER, load_splats
from cagefield.formats.splats.usd_stage import USD_AXES


def open_splat_usd(path: Path, time_code: float | None = None) -> SplatSource:
    """Open USD file at a time code; warnings name its unit, up axis, time samples and ignored content.

    Raises:
        FieldError: no usd-core, no USD, no splats, a damaged file, or a reference outside of its folder.
    """
    if path.suffix.lower() not in (".usd", ".usda", ".usdc", ".usdz"):
        raise FieldError(f"{path}: its content is USD, which its name must say; rename it, such as to x.usd")
    import_usd(path, "is read")
    with tempfile.TemporaryDirectory(prefix="cagefield-usd-") as folder:
        module = "cagefield.formats.splats.usd_process"
        command = [sys.executable, "-m", module, str(path), folder]
        if time_code is not None:
            command.append(repr(float(time_code)))
        subprocess.run(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        answer = Path(folder) / ANSWER
        if not answer.exists():
            raise damaged_usd(path, "the USD library crashed on it")
        said = json_text.loads(answer.read_text(encoding="utf-8"))
        if said["error"] is not None:
            raise FieldError(said["error"])
        parts = [load_splats(Path(folder), number) for number in range(said["parts"])]
    for line in said["warnings"]:
        warnings.warn(line, stacklevel=3)
    return _source(path, parts)


def _source(path: Path, parts: list[UsdSplats]) -> SplatSource:
    degree = max(part.sh_degree for part in parts)

    def batches() -> Iterator[SplatBatch]:
        for part in parts:
            for batch in part.batches():
                yield batch.pad_harmonics(degree)

    count = sum(len(part.means) for part in parts)
    return SplatSource(path, count, degree, USD_AXES, batches, is_double=True)
