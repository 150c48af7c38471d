"""`cagefield poses`: a data set of photos alone, or of a video."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

import tyro

from cagefield.cli.options import Flag, Output, check_folder, check_number, progress_bar, stages
from cagefield.files.atomic import recover_folder
from cagefield.files.safe_open import real_path

if TYPE_CHECKING:
    from cagefield.datasets import Dataset
    from cagefield.datasets.sfm.pose_verification import Verification
    from cagefield.datasets.sfm.structure_from_motion import PosesReport

_LISTED = 20  # photos named at the end, at most


@dataclass(frozen=True)
class Poses:
    """Find the poses of photos or a video, or verify those of a data set and correct them.

    Ctrl-C keeps what is done so far; the same command continues.
    """

    photos: tyro.conf.Positional[Path]
    """Folder of photos (EXIF orientation is applied), a video, or a data set with poses."""
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
        """Write the data set, and print the number of registered photos."""
        from cagefield.datasets import load_dataset
        from cagefield.datasets.dataset_loader import has_photos_alone
        from cagefield.datasets.sfm.transforms_writer import RECORD_FILE, write_transforms

        check_number("--frames", self.frames, 3, 10_000)
        check_folder(self.out, self.overwrite, RECORD_FILE)
        if has_photos_alone(self.photos.expanduser()) or not self.photos.expanduser().exists():
            print(make(self.photos, self.out, self.frames, self.masks))
            verified(load_dataset(self.out, downscale=1), correct=False)
        else:
            found = verified(load_dataset(self.photos, downscale=1, holdout=0, masks=self.masks))
            with progress_bar("Writing photos") as move:
                write_transforms(found.dataset, self.out, lambda done, note: move(done, 1.0, note))
        print(f"data set written to {self.out}; next: cagefield train {self.out} -o SCENE")


def make(photos: Path, target: Path, frames: int = 80, masks: Path | None = None) -> str:
    """Writes the data set `target` of photos or a video, with a progress bar; returns lines about it."""
    from cagefield.datasets.sfm.sfm_workspace import work_folder
    from cagefield.datasets.sfm.structure_from_motion import make_poses

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
    from cagefield.datasets.dataset_loader import has_photos_alone
    from cagefield.datasets.sfm.structure_from_motion import is_built_from
    from cagefield.datasets.sfm.transforms_writer import RECORD_FILE

    photos = photos.expanduser()
    if not has_photos_alone(photos):
        return photos
    recover_folder(real_path(target), lambda folder: (folder / RECORD_FILE).is_file())
    if is_built_from(target, photos, masks=masks):
        print(f"{photos} has no poses; those in {target} were found before")
        return target
    check_folder(target, True, RECORD_FILE)
    print(f"{photos} has no poses; finding them first, into {target}", flush=True)
    print(make(photos, target, masks=masks), flush=True)
    return target


def verified(dataset: Dataset, correct: bool = True, stream: TextIO | None = None) -> Verification:
    """The data set with verified poses, with `correct` corrected where they are wrong.

    Lines about it go to `stream`, by default stdout.
    """
    from cagefield.datasets.sfm.pose_verification import describe, poses_cache_folder, verify_poses

    with stages() as move:
        found = verify_poses(dataset, correct=correct, cache=poses_cache_folder(), on_stage=move)
    for line in describe(found):
        print(line, file=stream, flush=True)
    return found


def summary(report: PosesReport, seconds: float) -> str:
    """Lines: how many photos found their place, points, error and time; then the other photos."""
    took = f"{seconds / 60:.1f} min" if seconds >= 60 else f"{seconds:.0f} s"
    lines = [
        f"{report.placed} of {report.total} photos found their place in {took}; {report.points} points, "
        f"mean reprojection error {report.error:.2f} pixels"
    ]
    if report.moving:
        lines.append(f"{report.moving} photos show things that move: features on these were left out")
    listed = sorted(report.left_out.items())
    lines += [f"  left out: {name}: {reason}" for name, reason in listed[:_LISTED]]
    if len(listed) > _LISTED:
        lines.append(f"  and {len(listed) - _LISTED} more, see {report.folder / 'poses.json'}")
    return "\n".join(lines)
