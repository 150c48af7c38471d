"""`cagefield poses`: a data set of photos alone, or of a video."""

from __future__ import annotations

import time
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import tyro

from cagefield.atomic_files import recover_folder
from cagefield.cli.options import Flag, Output, check_folder, check_number, progress_bar
from cagefield.errors import DatasetError
from cagefield.regular_files import real_path

if TYPE_CHECKING:
    from cagefield.datasets import Dataset, View
    from cagefield.datasets.folds import Fold
    from cagefield.datasets.structure_from_motion import PosesReport

_LISTED = 20  # photos named at the end, at most
_KEPT = 0.9  # share of the photos that must find their place anew


@dataclass(frozen=True)
class Poses:
    """Find out where photos were taken: a data set of a folder of photos or a video, ready for training.

    Ctrl-C keeps what is done so far; the same command continues.
    """

    photos: tyro.conf.Positional[Path]
    """Folder of photos (EXIF orientation is applied), or a video."""
    out: Output
    """Folder of the data set."""
    frames: int = 80
    """How many frames of a video to take: the sharpest, evenly along it."""
    masks: Path | None = None
    """Folder of masks, NAME.png for the photo NAME: no features where they are black, no training later; left
    out, a folder masks beside the photos."""
    overwrite: Flag = False
    """Replace the data set that is there."""

    def run(self) -> None:
        """Makes the data set; prints what became of the photos."""
        from cagefield.datasets.structure_from_motion import RECORD

        check_number("--frames", self.frames, 3, 10_000)
        check_folder(self.out, self.overwrite, RECORD)
        print(make(self.photos, self.out, self.frames, self.masks))
        self._warn_of_fold()
        print(f"data set written to {self.out}; next: cagefield train {self.out} -o SCENE")

    def _warn_of_fold(self) -> None:
        from cagefield.datasets import load_dataset

        fold = check(load_dataset(self.out))
        if fold is not None:
            warnings.warn(
                f"{self.out}: {describe(fold)}; photos in the order in which they were taken can be told "
                "apart: name them in that order, or take more of what is around the thing",
                stacklevel=2,
            )


def make(photos: Path, target: Path, frames: int = 80, masks: Path | None = None) -> str:
    """Writes the data set `target` of photos or a video, with a progress bar; returns lines about it."""
    from cagefield.datasets.poses_work import work_folder
    from cagefield.datasets.structure_from_motion import make_poses

    start = time.monotonic()
    try:
        with progress_bar("Finding poses") as move:
            report = make_poses(
                photos.expanduser(),
                target,
                frames=frames,
                masks=masks,
                on_progress=lambda done, note: move(done, 1.0, note),
            )
    except KeyboardInterrupt:
        if work_folder(target).is_dir():
            print(f"stopped; what is done is kept in {work_folder(target)}, the same command continues")
        raise
    return summary(report, time.monotonic() - start)


def posed(photos: Path, target: Path, masks: Path | None = None) -> Path:
    """The data set to be trained on: `photos` itself where it has poses, else made of it in `target`.

    A data set that was made of the same photos before is used again.
    """
    from cagefield.datasets.dataset import has_photos_alone
    from cagefield.datasets.structure_from_motion import RECORD, is_made_of

    photos = photos.expanduser()
    if not has_photos_alone(photos):
        return photos
    recover_folder(real_path(target), lambda folder: (folder / RECORD).is_file())
    if is_made_of(target, photos, masks=masks):
        print(f"{photos} has no poses; those in {target} were found before")
        return target
    check_folder(target, True, RECORD)
    print(f"{photos} has no poses; finding them first, into {target}", flush=True)
    print(make(photos, target, masks=masks), flush=True)
    return target


def unfolded(dataset: Dataset, target: Path, downscale: int | None) -> Dataset:
    """The data set; where its poses are folded, one of its photos with poses found anew in `target`.

    Lines say so. What is found anew is taken where it is not folded and nearly all photos found their place.
    The same photos stay held out; the world is another one.
    """
    from cagefield.datasets import load_dataset
    from cagefield.datasets.structure_from_motion import RECORD, is_made_of

    fold = check(dataset)
    if fold is None:
        return dataset
    folders = {view.image_path.parent for view in _photos(dataset)}
    print(f"{dataset.path}: {describe(fold)}", flush=True)
    if len(folders) != 1:
        print("no field can show both; find the poses anew with: cagefield poses PHOTOS -o DATA", flush=True)
        return dataset
    photos = folders.pop()
    recover_folder(real_path(target), lambda folder: (folder / RECORD).is_file())
    if is_made_of(target, photos):
        print(f"those in {target} were found before")
    else:
        check_folder(target, True, RECORD)
        print(f"finding them anew, into {target} (--keep-poses leaves them as they are)", flush=True)
        try:
            print(make(photos, target), flush=True)
        except DatasetError as error:
            print(f"{error}; training on the poses that there are", flush=True)
            return dataset
    found = split_like(dataset, load_dataset(target, downscale=downscale))
    if len(_photos(found)) < _KEPT * len(_photos(dataset)) or check(found) is not None:
        print("those are no better; training on the poses that there are", flush=True)
        return dataset
    return found


def split_like(known: Dataset, found: Dataset) -> Dataset:
    """The data set `found` with the photos held out that are in `known`, by the names of their files."""

    def of(views: Sequence[View]) -> tuple[View, ...]:
        names = {view.image_path.name for view in views}
        return tuple(view for view in _photos(found) if view.image_path.name in names)

    test, val = of(known.test), of(known.val)
    train = tuple(view for view in _photos(found) if view not in test and view not in val)
    return replace(found, name=known.name, train=train, test=test, val=val)


def check(dataset: Dataset) -> Fold | None:
    """What tells that the poses of a capture are folded, with a progress bar; None where nothing does."""
    from cagefield.datasets.folds import find_fold

    if not dataset.unbounded:
        return None
    with progress_bar("Checking poses") as move:
        return find_fold(dataset, lambda done, note: move(done, 1.0, note))


def describe(fold: Fold) -> str:
    """What is wrong, in words."""
    return (
        f"the poses are folded: {fold.photos} of {fold.compared} photos stand beside others that show "
        f"something else ({fold.pair[0]} and {fold.pair[1]}), as where two sides of a thing look alike"
    )


def _photos(dataset: Dataset) -> list[View]:
    """All photos of a data set, sorted by name."""
    everything = {view.name: view for view in (*dataset.val, *dataset.test, *dataset.train)}
    return [everything[name] for name in sorted(everything)]


def summary(report: PosesReport, seconds: float) -> str:
    """Lines: how many photos found their place, points, error and time; then the other photos."""
    took = f"{seconds / 60:.1f} min" if seconds >= 60 else f"{seconds:.0f} s"
    lines = [
        f"{report.placed} of {report.total} photos found their place in {took}; {report.points} points, "
        f"mean reprojection error {report.error:.2f} pixels"
    ]
    listed = sorted(report.left_out.items())
    lines += [f"  left out: {name}: {reason}" for name, reason in listed[:_LISTED]]
    if len(listed) > _LISTED:
        lines.append(f"  and {len(listed) - _LISTED} more, see {report.folder / 'poses.json'}")
    return "\n".join(lines)
