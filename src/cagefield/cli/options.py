"""Shared parts of subcommands: option types, sizes, colors, destinations, progress."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, TypeVar

import tyro

from cagefield.errors import CagefieldError
from cagefield.files.atomic import check_writable, recover_folder
from cagefield.files.safe_open import real_path

if TYPE_CHECKING:
    from cagefield.training.splats.splat_config import SplatConfig
    from cagefield.training.voxels.voxel_config import VoxelConfig

Device = Annotated[
    Literal["auto", "cpu", "cuda", "metal", "vulkan"], tyro.conf.arg(help="Where kernels run.")
]
SpzVersion = Literal[3, 4]
Up = Literal["y-down", "y-up", "z-up", "z-down", "x-up", "x-down"]
Axes = Literal["rdf", "rub", "luf", "ruf", "ldb", "rdb", "ldf", "lub"]
Output = Annotated[Path, tyro.conf.arg(aliases=["-o"])]
OptionalOutput = Annotated[Path | None, tyro.conf.arg(aliases=["-o"])]
Flag = tyro.conf.FlagCreatePairsOff[bool]
T = TypeVar("T")


SEEDS = (0, 2**32 - 1)
"""Valid range of seeds for NumPy and the kernels."""


def check_number(name: str, value: int | None, low: int, high: int) -> None:
    """Passes a whole number from low to high, and None. Raises CagefieldError, that names the option."""
    if value is not None and not low <= value <= high:
        shown = value if abs(value) < 10**20 else "a number of more than 20 digits"
        raise CagefieldError(f"{name} is {shown}; give a whole number from {low} to {high}")


@dataclass(frozen=True)
class TrainingOptions:
    """How a field is trained."""

    minutes: float = 5.0
    """How long to train."""
    steps: int | None = None
    """Train this many steps instead: on a CPU the same seed then gives the same field."""
    resolution: int | None = None
    """Voxels along the longest axis at the end; left out, as many as the photos' size and the time allow."""
    sh_degree: int | None = None
    """Degree of the color's spherical harmonics, 0 to 2, of splats to 3: how much it changes with the view;
    left out, 2, and 1 for voxels trained on an unbounded capture."""
    seed: int = 0
    """Of the order of the photos' pixels and of all other chance."""

    def config(self) -> VoxelConfig:
        """The configuration of the voxels' trainer."""
        from cagefield.training.voxels.voxel_config import VoxelConfig

        check_number("--seed", self.seed, *SEEDS)
        return VoxelConfig(
            steps=VoxelConfig.steps if self.steps is None else self.steps,
            minutes=self.minutes if self.steps is None else None,
            resolution=self.resolution,
            sh_degree=self.sh_degree,
            seed=self.seed,
        )

    def splat_config(
        self, splats: int | None = None, refine_poses: bool = False, robust: bool = False
    ) -> SplatConfig:
        """The configuration of the splats' trainer; at most so many `splats`, None for its own choice."""
        from cagefield.training.splats.splat_config import SplatConfig

        check_number("--seed", self.seed, *SEEDS)
        return SplatConfig(
            steps=SplatConfig.steps if self.steps is None else self.steps,
            minutes=self.minutes if self.steps is None else None,
            splats=splats,
            refine_poses=refine_poses,
            robust=robust,
            sh_degree=SplatConfig.sh_degree if self.sh_degree is None else self.sh_degree,
            seed=self.seed,
        )


@dataclass(frozen=True)
class BakingOptions:
    """How a field is baked into voxels."""

    resolution: int = 256
    """Voxels along the longest axis of the field's content."""
    sh_degree: int = 2
    """Degree of the color's spherical harmonics, 0 to 2: how much it changes with the view."""
    compare: int = 3
    """Views in which the voxels are compared with the original field; 0 leaves that out."""

    def __post_init__(self) -> None:
        if self.compare < 0:
            raise CagefieldError(f"--compare is {self.compare}; give the number of views, 0 or more")


Baking = tyro.conf.OmitArgPrefixes[BakingOptions]
Training = tyro.conf.OmitArgPrefixes[TrainingOptions]


def parse_size(text: str | None, width: int, height: int) -> tuple[int, int]:
    """(width, height) in pixels of "800x600", of "800" (the longer side, same aspect), or as given for None.

    Raises:
        CagefieldError: another text, or a side outside 1 to 16384.
    """
    if text is None:
        return width, height
    parts = text.lower().split("x")
    parts = [part.strip() for part in parts]
    if len(parts) > 2 or not all(part.isascii() and part.isdigit() and len(part) < 10 for part in parts):
        raise CagefieldError(
            f"--size {text[:40]!r} is no size; give WIDTHxHEIGHT or the longer side, such as 800x600 or 800"
        )
    sides = [int(part) for part in parts]
    if len(sides) == 1:
        scale = sides[0] / max(width, height)
        sides = [max(1, round(width * scale)), max(1, round(height * scale))] if sides[0] else [0, 0]
    if not all(1 <= side <= 16384 for side in sides):
        raise CagefieldError(f"--size {text!r} is out of range; each side must be from 1 to 16384 pixels")
    return sides[0], sides[1]


def parse_background(text: str | None) -> str | tuple[float, float, float]:
    """Background for `Scene.render`: a name, three numbers in [0,1] for "r,g,b", "scene" for None.

    Raises:
        CagefieldError: neither a name nor three numbers.
    """
    if text is None:
        return "scene"
    if text in ("white", "black", "none"):
        return text
    try:
        red, green, blue = (float(part) for part in text.split(","))
    except ValueError:
        raise CagefieldError(
            f"--background {text!r} is no color; give white, black, none, or r,g,b from 0 to 1 (0.2,0.4,1)"
        ) from None
    return red, green, blue


def check_folder(path: Path, overwrite: bool, mark: str | None = None) -> None:
    """Passes where `path` is new or an empty folder; with `overwrite` any (that holds the file `mark`).

    A folder displaced by a program that was killed during its replacement is restored first, with a warning.

    Raises:
        CagefieldError: something is there that may not be replaced.
    """
    recover_folder(real_path(path), lambda folder: mark is None or (folder / mark).is_file())
    if path.exists() and not path.is_dir():
        raise CagefieldError(f"{path} is a file; give a folder")
    if path.is_dir() and any(path.iterdir()) and not overwrite:
        raise CagefieldError(f"folder {path} exists already and is not empty; give a new one, or --overwrite")
    if mark is not None and path.is_dir() and any(path.iterdir()) and not (path / mark).is_file():
        raise CagefieldError(f"folder {path} holds no {mark} and is left as it is; give a new one")
    check_writable(path, inside=mark is None)


def check_file(path: Path, overwrite: bool) -> None:
    """Passes where `path` is new, or a file with `overwrite`, and can be written."""
    if path.is_dir():
        raise CagefieldError(f"{path} is a folder; give a file name")
    if path.exists() and not overwrite:
        raise CagefieldError(f"{path} exists already; give another name, or --overwrite")
    check_writable(path)


def levels_and_bytes(out: Path) -> tuple[str, int]:
    """(levels of detail in words, empty without any; bytes) of a file of splats that was written at `out`."""
    from cagefield.formats.splats.detection import LOD_META

    if out.name != LOD_META:
        return "", out.stat().st_size
    from cagefield.formats.splats.sog_lod_writer import sog_lod_summary

    counts, size = sog_lod_summary(out)
    return f", {len(counts)} level{'s' * (len(counts) > 1)} of detail: {', '.join(map(str, counts))}", size


@contextmanager
def progress_bar(what: str) -> Iterator[Callable[[float, float, str], None]]:
    """A function (done, total, note) that moves a bar on stderr; off a terminal, a line for each quarter."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    console = Console(stderr=True)
    columns = TextColumn(what), BarColumn(), TimeRemainingColumn(), TextColumn("{task.description}")
    quarters = 0
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("")

        def move(done: float, total: float, note: str = "") -> None:
            nonlocal quarters
            bar.update(task, completed=done, total=total, description=note)
            if not console.is_terminal and done >= (quarters + 1) * total / 4:
                quarters = int(4 * done / total)
                print(f"{what} {25 * quarters}%" + (f": {note}" if note else ""), file=sys.stderr)

        yield move


@contextmanager
def stages() -> Iterator[Callable[[str, float, str], None]]:
    """A function (stage, done, note) that moves a bar of each stage on stderr, one at a time."""
    with ExitStack() as shown:
        current = ""
        move: Callable[[float, float, str], None]

        def moved(stage: str, done: float, note: str) -> None:
            nonlocal current, move
            if stage != current:
                shown.close()
                current, move = stage, shown.enter_context(progress_bar(stage))
            move(done, 1.0, note)

        yield moved


def track(items: Iterable[T], total: int, what: str) -> Iterator[T]:
    """The items, with a bar while they are taken."""
    with progress_bar(what) as move:
        for index, item in enumerate(items, start=1):
            yield item
            move(index, total, f"{index}/{total}")
