"""Edits against ground truth: an edited field beside the scene whose part was really moved."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import cast

import numpy as np

from benchmarks.common.cases import Case
from benchmarks.common.figures import changed_pixels, compare, floats, mean_psnr, pooled_psnr
from benchmarks.common.perceptual import lpips
from benchmarks.common.timing import interleaved
from benchmarks.common.workbench import Workbench
from benchmarks.edits.closed_forms import inside_figures
from benchmarks.edits.compare_shells import FINER, continuous, map_time, seen, shown
from benchmarks.edits.distortion import distortion
from benchmarks.edits.edits_table import TIMED_EXACTLY, Revealed, Score
from benchmarks.edits.naive_splats import seen_naively
from cagefield.cameras.camera import Camera
from cagefield.fields.splat_field import SplatField
from cagefield.images.image_files import side_by_side, write_png
from cagefield.procedural.writer import FOV_X_RAD
from cagefield.scene.scene import Scene
from cagefield.typing import AnyArray

_TIMED_VIEWS, _ROUNDS = 2, 3

_EYES = {
    "digger": (1.6, -3.5, 1.3),
    "chair": (3.0, 2.2, 1.6),
    "microphone": (0.7, -3.8, 0.7),
    "plant": (2.0, -3.1, 1.6),
}
"""Where pictures are taken from, so that what the cases move is seen."""


def measure(cases: Sequence[Case], bench: Workbench, *, taught: bool = False) -> Iterator[Score]:
    """The scores of the cases, in order; cases of one scene that follow each other share its pictures.

    With `taught`, a field is trained on photos of the truth of every discrete case, to compare with.
    """
    scene, name = None, ""
    perceived, _ = lpips()
    unedited: dict[str, AnyArray] = {}
    for case in cases:
        if scene is None or case.scene != name:
            scene, name, unedited = bench.scene(case.scene), case.scene, {}
        with case.blended():
            edited = scene.with_edits(case.edits)
            ratio = frame_ratio(scene, edited)
            cameras = scene.cameras["test"]
            measured, taken, revealed = None, None, None
            if case.kind == "continuous":
                edit = continuous(case)
                measured, taken = distortion(edit.exact_warp, edit), map_time(case.edits)
            if case.moved is None:
                size = bench.settings.exact_size
                exact_views = cameras[: bench.settings.exact_views]
                cameras = tuple(camera.resized(size, size) for camera in exact_views)
                truth, before = "exact map", bench.mapped(name, None, cameras)
                after, rays = bench.mapped(name, case.edits, cameras), FINER
            else:
                cameras = cameras[: bench.settings.discrete_views]
                truth, before = "photos", bench.modeled(name, cameras)
                after, rays = bench.moved(case, cameras), 1
            if truth not in unedited:
                unedited[truth] = seen(scene, cameras, rays)
            pictures = seen(edited, cameras, rays)
            inside = None
            if case.deformed is not None:
                inside = inside_figures(case, bench, cameras, unedited[truth], pictures, before)
            if case.moved is not None:
                revealed = _revealed(case, bench, cameras, unedited[truth], pictures, taught)
            figures = compare(unedited[truth], pictures, before, after)
            naive: tuple[float, ...] = ()
            if isinstance(scene.field, SplatField):
                naive = tuple(
                    figures.unedited - mean_psnr(naively, after)
                    for _, naively in seen_naively(edited, cameras, rays)
                )
            both = (perceived(unedited[truth], before), perceived(pictures, after)) if perceived else None
            yield Score(
                case,
                truth,
                len(cameras),
                cameras[0].width,
                figures,
                ratio,
                measured,
                taken,
                both,
                revealed,
                naive,
                inside,
            )


def _revealed(
    case: Case,
    bench: Workbench,
    cameras: Sequence[Camera],
    unedited: AnyArray,
    edited: AnyArray,
    taught: bool,
) -> Revealed:
    """The figures of a discrete case on what its edit brings to light, from pictures of the field."""
    before, after = bench.modeled(case.scene, cameras), bench.moved(case, cameras)
    left = bench.moved(case, cameras, old_shadows=True)
    uncovered = bench.uncovered_pixels(case, cameras)
    unseen = bench.unseen_pixels(case, cameras, changed_pixels(before, after))
    best = seen(bench.taught(case), cameras) if taught else None
    return Revealed(
        old_shadows=compare(unedited, edited, before, left),
        uncovered=float(uncovered.mean()),
        uncovered_unedited=pooled_psnr(unedited, before, uncovered),
        uncovered_edited=pooled_psnr(edited, after, uncovered),
        unseen=float(unseen.mean()),
        unseen_edited=pooled_psnr(edited, after, unseen),
        lost_seen=mean_psnr(unedited, before, ~unseen) - mean_psnr(edited, after, ~unseen),
        uncovered_taught=None if best is None else pooled_psnr(best, after, uncovered),
        unseen_taught=None if best is None else pooled_psnr(best, after, unseen),
    )


def frame_ratio(scene: Scene, edited: Scene) -> float:
    """Median over interleaved rounds of the time of edited frames over that of unedited ones."""
    cameras = scene.cameras["test"][:_TIMED_VIEWS]

    if scene.original is not None:
        cameras = tuple(camera.resized(TIMED_EXACTLY, TIMED_EXACTLY) for camera in cameras)

    def render(which: Scene) -> None:
        for camera in cameras:
            shown(which, camera)

    seconds = interleaved([lambda: render(scene), lambda: render(edited)], _ROUNDS)
    return float(np.median(seconds[:, 1] / seconds[:, 0]))


def eye(scene: str, size: int) -> Camera:
    """The camera of a scene's pictures, size x size pixels."""
    return Camera.look_at(_EYES[scene], (0, 0, 0), width=size, height=size, fov_x=FOV_X_RAD)


def picture_path(folder: Path, case: Case) -> Path:
    """Where the picture of a case goes."""
    return folder / f"{case.scene}_{case.name}.png"


def write_picture(case: Case, bench: Workbench, folder: Path, size: int, *, error: bool = False) -> Path:
    """Writes before, edited and truth (and their difference, dark, three times as strong) side by side."""
    camera = eye(case.scene, size)
    scene = bench.scene(case.scene)
    before = cast(AnyArray, shown(scene, camera).rgb8())
    with case.blended():
        after = shown(scene.with_edits(case.given), camera).rgb8()
        truth = (
            bench.mapped(case.scene, case.edits, [camera])
            if case.moved is None
            else bench.moved(case, [camera])
        )
    panels = [before, after, truth[0]]
    if error:
        difference = np.abs(floats(after) - floats(truth[0])).max(axis=-1, keepdims=True)
        panels.append(np.repeat(1.0 - np.minimum(3.0 * difference, 1.0), 3, axis=-1))
    path = picture_path(folder, case)
    write_png(path, side_by_side(*panels))
    return path
