"""Edits of fields trained on the built-in rooms, against the rooms whose parts were really moved.

The truth is the picture of the moved room with the light as it then falls, but for shadows, which stay where
they were. Pictures of the trained field, edited and not, go through the affine map of colors that brings the
unedited one closest to the unedited room: which exposure is the mean of a capture's is not known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.captures.train_captures import Learnt
from benchmarks.common.cases import ROOM_CASES, Case
from benchmarks.common.figures import Figures, compare
from benchmarks.common.tables import Table, number
from benchmarks.common.timing import interleaved
from cagefield.cameras.camera import Camera
from cagefield.datasets import Dataset
from cagefield.errors import CagefieldError
from cagefield.images.image_files import side_by_side, write_png
from cagefield.images.metrics import fit_colors
from cagefield.procedural import capture
from cagefield.procedural.hand_held import render_image
from cagefield.typing import Float32

_ROUNDS = 5
_EYES = {"room-digger": ((1.7, -2.9, 1.75), (-0.05, -0.1, 0.5))}
"""(eye, target) of a room's pictures."""


@dataclass(frozen=True)
class RoomScore:
    """The figures of one edit of a room; `frame_ratio`: the time of an edited frame over an unedited one."""

    case: Case
    kind: str
    views: int
    figures: Figures
    frame_ratio: float


def measure(dataset: Dataset, learnt: Learnt, cases: Sequence[Case]) -> list[RoomScore]:
    """The scores of the edits of one room, from the held-out views of its capture in its own world."""
    cameras = [view.camera for view in dataset.test]
    scores = []
    for case in cases:
        scene, edited = capture(case.scene).scene, learnt.edited(case.edits)
        truth = np.stack([_clipped(render_image(scene, camera)[0]) for camera in cameras])
        moved = np.stack([_clipped(render_image(_moved(case), camera)[0]) for camera in cameras])
        plain = [_clipped(learnt.show(camera).rgb) for camera in cameras]
        fits = [fit_colors(shown, true) for shown, true in zip(plain, truth, strict=True)]
        after = [fit(_clipped(edited(camera).rgb)) for camera, fit in zip(cameras, fits, strict=True)]
        before = [fit(shown) for shown, fit in zip(plain, fits, strict=True)]
        figures = compare(np.stack(before), np.stack(after), truth, moved)
        ratio = _frame_ratio(learnt, edited, cameras[:2])
        scores.append(RoomScore(case, learnt.kind, len(cameras), figures, ratio))
    return scores


def cases_of(name: str) -> tuple[Case, ...]:
    """The edits of a room."""
    return tuple(case for case in ROOM_CASES if case.scene == name)


def _moved(case: Case) -> Any:
    if case.moved is None:
        raise CagefieldError(f"{case.file} has no truth: no part of {case.scene} is moved by it")
    return case.moved(capture(case.scene).scene)


def _clipped(rgb: NDArray[Any]) -> Float32:
    return np.clip(rgb, 0, 1).astype(np.float32)


def _frame_ratio(learnt: Learnt, edited: Any, cameras: Sequence[Camera]) -> float:
    """Median over interleaved rounds of the time of edited frames over that of unedited ones."""

    def all_of(show: Any) -> None:
        for camera in cameras:
            show(camera)

    seconds = interleaved([lambda: all_of(learnt.show), lambda: all_of(edited)], _ROUNDS)
    return float(np.median(seconds[:, 1] / seconds[:, 0]))


def table(scores: Sequence[RoomScore], notes: Sequence[str] = ()) -> Table:
    """The scores as a table, with what its columns mean."""
    rows = tuple(
        (
            score.case.scene,
            score.case.name.replace("_", " "),
            score.kind,
            str(score.views),
            number(score.figures.unedited),
            number(score.figures.edited),
            number(score.figures.lost),
            f"{100 * score.figures.changed:.1f}%",
            number(score.figures.there_unedited),
            number(score.figures.there_edited),
            number(score.figures.there_if_left),
            f"x{score.frame_ratio:.2f}",
        )
        for score in scores
    )
    explained = (
        "PSNR (dB): mean over held-out views; unedited: the trained field against the room as it is; edited: "
        "the edited field against the room whose part was really moved, shadows staying where they fell, "
        "reflections moving; lost: the difference. There: on the pixels that the edit changes in truth; if "
        "left: what the field without the edit would reach there.",
        "Frame time: edited over unedited, median of frames taken in turn.",
    )
    columns = (
        "room", "edit", "field", "views", "PSNR unedited", "PSNR edited", "PSNR lost", "changed pixels",
        "there unedited", "there edited", "there if left", "frame time",
    )  # fmt: skip
    return Table("Edits of captured rooms", columns, rows, (*explained, *notes), names=3)


def write_picture(learnt: Learnt, case: Case, folder: Path, size: int = 480) -> Path:
    """Writes the field as trained, edited, and the truth, side by side."""
    moved = _moved(case)
    eye, target = _EYES[case.scene]
    camera = Camera.look_at(eye, target, width=round(0.75 * size), height=size, fov_x=float(np.radians(52.0)))
    before, after = (_clipped(show(camera).rgb) for show in (learnt.show, learnt.edited(case.edits)))
    fit = fit_colors(before, _clipped(render_image(capture(case.scene).scene, camera)[0]))
    truth = _clipped(render_image(moved, camera)[0])
    path = folder / case.file.replace(".yaml", ".png")
    write_png(path, side_by_side(fit(before), fit(after), truth))
    return path
