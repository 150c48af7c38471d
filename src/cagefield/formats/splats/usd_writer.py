"""Writers of splats as USD: text by ourselves, binary and packages by usd-core."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from cagefield.errors import FieldError
from cagefield.formats.splats.splat_table import OnProgress, SplatTable
from cagefield.formats.splats.usd_crate import write_usdc, write_usdz
from cagefield.formats.splats.usd_library import import_usd
from cagefield.formats.splats.usd_stage import Frame, StageInfo
from cagefield.formats.splats.usd_text import write_usda

USD_SUFFIXES = (".usda", ".usdc", ".usdz")

_WRITE: dict[str, Callable[[Path, StageInfo, Iterable[Frame], OnProgress], None]] = {
    ".usda": write_usda,
    ".usdc": write_usdc,
    ".usdz": write_usdz,
}


def write_usd_stage(
    path: Path, info: StageInfo, frames: Iterable[Frame], on_progress: OnProgress = lambda _: None
) -> None:
    """Write the frames of a stage, tables in the axes "rub", in the format of the path's suffix.

    Raises:
        FieldError: another suffix, or no usd-core for .usdc and .usdz.
    """
    check_usd(path)
    _WRITE[path.suffix.lower()](path, info, frames, on_progress)


def check_usd(path: Path) -> None:
    """Pass where the suffix is one of USD and its writer is installed; else raise FieldError."""
    suffix = path.suffix.lower()
    if suffix not in _WRITE:
        raise FieldError(f"{path}: USD is written as {', '.join(USD_SUFFIXES)}; give such a name")
    if suffix != ".usda":
        import_usd(path, f"as {suffix} is written")


def write_splat_usd(path: Path, table: SplatTable, on_progress: OnProgress = lambda _: None) -> None:
    """Write splats in the axes "rub" as one prim, /World/splats; complete or not at all."""
    write_usd_stage(path, StageInfo.from_table("splats", table), [(table,)], on_progress)
