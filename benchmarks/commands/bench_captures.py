"""`cagefield bench captures`: fields trained on real captures and on the built-in rooms."""

from __future__ import annotations

import dataclasses
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import tyro

from cagefield.cli.options import SEEDS, Device, Flag, Output, check_file, check_number, progress_bar
from cagefield.errors import CagefieldError

if TYPE_CHECKING:
    from benchmarks.captures.captures import CaptureScore
    from benchmarks.captures.train_captures import Budget, Learnt
    from benchmarks.edits.room_edits import RoomScore
    from cagefield.datasets import Dataset


@dataclass(frozen=True)
class BenchCaptures:
    """Held-out PSNR, depth errors and fog of fields trained on captures; writes a Markdown table."""

    data: tyro.conf.Positional[tuple[str, ...]]
    """Data sets: folders, their camera files, or names of built-in rooms: room-digger, room-chair,
    room-microphone, room-plant, with variations after plus signs (room-chair+person): person, backdrop,
    flash, exposure, balance."""
    out: Output = Path("benchmarks/results/captures.md")
    """Markdown file for the table."""
    fields: tuple[Literal["splat", "voxel"], ...] = ("splat",)
    """Kind of field trained on each capture."""
    minutes: float = 5.0
    """How long to train each."""
    steps: int | None = None
    """Train this many steps instead."""
    splats: int | None = None
    """Most splats; left out, as many as photos and time allow."""
    resolution: int = 256
    """Voxels along the longest axis."""
    sh_degree: int | None = None
    """Degree of the color's spherical harmonics; left out, the trainer's own."""
    seed: int = 0
    """Of the training."""
    downscale: int | None = None
    """Shrink the photos by this factor; left out, what their size, their number and the minutes ask for."""
    holdout: int = 8
    """Keep every so-many-th photo for testing where the data set has no test views."""
    masks: Path | None = None
    """Folder of masks, NAME.png for the photo NAME; left out, the masks that the data sets have."""
    keep_poses: Flag = False
    """Train on poses as they are, even where they are folded; else those are found anew."""
    perturb_poses: Flag = False
    """Disturb every camera first, test views' too: turned by 1 degree, moved by 1 % of its distance, its
    focal length changed by up to 5 %; --seed decides how."""
    robust: Flag = False
    """Give less weight to regions of photos that contradict the others."""
    room_size: int | None = None
    """Longer side of the photos of built-in rooms, 640 if left out."""
    room_views: int | None = None
    """Number of their photos; left out, as the room asks."""
    workdir: Path | None = None
    """Folder that keeps the photos of built-in rooms for the next call."""
    pictures: Path | None = None
    """Folder for pictures of held-out views: photo, picture, difference, depth, true depth where known."""
    picture_views: int = 4
    """Number of pictures for each capture and field."""
    edits: Flag = False
    """Measure the edits of built-in rooms too (examples/room_*.yaml); their table goes beside, its name
    ending _edits.md."""
    edit_pictures: Path | None = None
    """Folder for pictures of those edits: the field as trained, edited, the truth."""
    device: Device = "auto"
    overwrite: Flag = False
    """Replace the table that is there."""

    def run(self) -> None:
        """Makes the photos that are missing, trains, measures, shows the table, says where the files are."""
        from benchmarks.captures.captures import table
        from benchmarks.captures.train_captures import Budget
        from benchmarks.commands.command_lines import command_line, work_folder
        from benchmarks.common.machine import Machine
        from benchmarks.common.tables import write_texts
        from benchmarks.edits import room_edits
        from cagefield.compute import devices

        if not self.data:
            raise CagefieldError("no capture to measure; give folders, or names of built-in rooms")
        if not self.fields:
            raise CagefieldError("no field to train; give --fields splat, voxel or both")
        if self.picture_views < 1:
            raise CagefieldError(f"--picture-views is {self.picture_views}; it must be at least 1")
        if self.holdout == 0:
            raise CagefieldError("--holdout 0 keeps no photo to measure on; give 2 or more")
        for path in (self.out, self._beside()) if self.edits else (self.out,):
            check_file(path, self.overwrite)
        check_number("--seed", self.seed, *SEEDS)
        budget = Budget(
            self.minutes, self.steps, self.splats, self.resolution, self.sh_degree, self.seed, self.robust
        )
        devices.start(self.device)
        scores: list[CaptureScore] = []
        edited: list[RoomScore] = []
        with work_folder(self.workdir) as folder:
            for name in self.data:
                dataset, pose_error = self._open(name, folder)
                for field in self.fields:
                    score, learnt = self._measure(dataset, field, budget)
                    score = dataclasses.replace(score, pose_error=pose_error)
                    scores.append(score)
                    edited += self._edit(name, dataset, learnt)
        notes = (f"Machine: {Machine.here()}", f"Command: `{command_line('bench captures', self)}`")
        result = table(scores, notes)
        result.show()
        texts = {self.out: result.markdown()}
        if edited:
            beside = room_edits.table(edited, notes)
            beside.show()
            texts[self._beside()] = beside.markdown()
        write_texts(texts)
        for path in texts:
            print(f"table written to {path}")

    def _beside(self) -> Path:
        return self.out.with_name(f"{self.out.stem}_edits{self.out.suffix}")

    def _edit(self, name: str, dataset: Dataset, learnt: Learnt) -> list[RoomScore]:
        """The scores of a room's edits, and their pictures, where they are asked for."""
        from benchmarks.edits import room_edits

        cases = room_edits.cases_of(name)
        if self.edit_pictures is not None:
            for case in cases:
                print(f"picture written to {room_edits.write_picture(learnt, case, self.edit_pictures)}")
        return room_edits.measure(dataset, learnt, cases) if self.edits else []

    def _open(self, name: str, folder: Path) -> tuple[Dataset, tuple[float, float] | None]:
        """The data set of that name, and its epipolar error before and after verification.

        A built-in room is photographed where the work folder lacks it.
        """
        from benchmarks.captures.perturbation import perturbed
        from benchmarks.common.workbench import digest
        from cagefield.cli.poses import verified
        from cagefield.datasets import load_dataset
        from cagefield.datasets.training_resolution import shrink_to_training_resolution
        from cagefield.procedural import is_capture, make_capture

        path = Path(name)
        if is_capture(name) and not path.exists():
            key = digest([name, self.room_views, self.room_size], ("procedural", "cameras"))
            path = folder / f"photos-{key}" / name
            if not path.is_dir():
                with progress_bar(f"{name}: photos") as move:
                    make_capture(
                        name,
                        path,
                        views=self.room_views,
                        size=self.room_size,
                        progress=lambda i, n: move(i, n, f"{i}/{n}"),
                    )
        dataset = load_dataset(path, downscale=self.downscale, holdout=self.holdout, masks=self.masks)
        if self.perturb_poses:
            dataset = perturbed(dataset, self.seed)
        if self.downscale is None:
            dataset = shrink_to_training_resolution(dataset, self.minutes)
        found = verified(dataset, correct=not self.keep_poses, stream=sys.stderr)
        dataset = found.dataset
        if not dataset.test:
            raise CagefieldError(f"data set {dataset.name} has no held-out photos; choose another --holdout")
        errors = None
        if found.before is not None and found.after is not None:
            errors = found.before.median, found.after.median
        return dataset, errors

    def _measure(self, dataset: Dataset, field: str, budget: Budget) -> tuple[CaptureScore, Learnt]:
        """The score of a field trained on the data set, and the field; writes pictures if asked."""
        from benchmarks.captures import captures
        from benchmarks.captures.train_captures import learn

        points = captures.sighted_points(dataset)
        captures.forget_memory()
        with progress_bar(f"{dataset.name}: training {field}") as move:
            learnt = learn(
                captures.for_training(dataset, points),
                field,
                budget,
                lambda progress: move(progress.done, 1.0, str(progress)),
            )
        score = captures.measure(dataset, learnt, points)
        score = dataclasses.replace(score, memory=captures.peak_memory())
        print(
            f"{score.name}, {field}: PSNR {score.test} on held-out photos, "
            f"{score.train.psnr:.2f} dB on training photos; fog {100 * score.points.fog:.1f}%, "
            f"depth error {100 * score.points.median:.1f}%",
            flush=True,
        )
        if self.pictures is not None:
            for path in captures.write_pictures(dataset, learnt, self.pictures, self.picture_views):
                print(f"picture written to {path}", flush=True)
        return score, learnt
