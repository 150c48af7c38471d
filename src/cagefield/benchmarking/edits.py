"""Edits against ground truth: an edited field beside the scene whose part was really moved."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import cast

import numpy as np

from cagefield.benchmarking.cases import Case, relit
from cagefield.benchmarking.compare import MapTime, continuous, map_time, seen, shown
from cagefield.benchmarking.distortion import Distortion, distortion
from cagefield.benchmarking.figures import Figures, compare, floats, mean_psnr, pooled_psnr
from cagefield.benchmarking.figures import changed_pixels as changed
from cagefield.benchmarking.naive_splats import NAIVE, seen_naively
from cagefield.benchmarking.perceptual import lpips
from cagefield.benchmarking.tables import Table, number
from cagefield.benchmarking.timing import interleaved
from cagefield.benchmarking.workbench import Settings, Workbench
from cagefield.cameras import Camera
from cagefield.datasets.procedural import procedural_scene
from cagefield.datasets.procedural.writer import FOV_X
from cagefield.fields.splat import SplatField
from cagefield.rendering.images import side_by_side, write_png
from cagefield.scene import Scene
from cagefield.training.nerf_config import NerfConfig
from cagefield.training.splat_config import SplatConfig
from cagefield.training.voxel_config import VoxelConfig
from cagefield.typing import AnyArray

_TIMED_VIEWS, _ROUNDS = 2, 3

_TIMED_EXACTLY = 40
"""Width and height at which exact frames are timed: a picture of a NeRF takes seconds."""

_EYES = {
    "digger": (1.6, -3.5, 1.3),
    "chair": (3.0, 2.2, 1.6),
    "microphone": (0.7, -3.8, 0.7),
    "plant": (2.0, -3.1, 1.6),
}
"""Where pictures are taken from, so that what the cases move is seen."""

_COLUMNS = (
    "scene", "edit", "kind", "truth", "views", "PSNR unedited", "PSNR edited", "PSNR lost", "SSIM unedited",
    "SSIM edited", "changed pixels", "there unedited", "there edited", "there lost", "there if left",
    "there carried", "unseen", "lost, seen", "frame time", "min det J", "max stretch", "map time",
)  # fmt: skip
_LPIPS, _NAIVE = ("LPIPS unedited", "LPIPS edited"), tuple(f"lost, {way}" for way in NAIVE)
_NAIVELY = (
    "Lost, means only: each splat moved with its mean, no more; no turned SH: its covariance follows the map "
    "too, its colours do not turn; not split: all but the splitting of splats that an edit bends or cuts."
)
_SHOWN = (
    "scene", "edit", "PSNR unedited", "PSNR edited", "PSNR lost", "there unedited", "there edited",
    "there lost", "frame time",
)  # fmt: skip


@dataclass(frozen=True)
class Score:
    """The figures of one case; `there_carried` is the PSNR on the changed pixels where light is carried.

    `frame_ratio` is the time of an edited frame over that of an unedited one. Only a continuous edit has a
    distortion and a time of its map; `lpips` is that of the unedited and the edited pictures, where measured.
    Of a discrete edit, `visibility` is the share of pixels that show what no training photo showed, and
    `lost_seen` the PSNR lost on the others. Of splats, `naive` is the PSNR lost by each way of `NAIVE`.
    """

    case: Case
    truth: str
    views: int
    size: int
    figures: Figures
    there_carried: float
    frame_ratio: float
    distortion: Distortion | None = None
    time: MapTime | None = None
    lpips: tuple[float, float] | None = None
    unseen: float = float("nan")
    lost_seen: float = float("nan")
    naive: tuple[float, ...] = ()


def measure(cases: Sequence[Case], bench: Workbench) -> Iterator[Score]:
    """The scores of the cases, in order; cases of one scene that follow each other share its pictures."""
    scene, name = None, ""
    perceived, _ = lpips()
    unedited: dict[str, AnyArray] = {}
    for case in cases:
        if scene is None or case.scene != name:
            scene, name, unedited = bench.scene(case.scene), case.scene, {}
        edited = scene.with_edits(case.edits)
        ratio = frame_ratio(scene, edited)
        cameras = scene.cameras["test"]
        carried = hidden = lost_seen = float("nan")
        measured, taken = None, None
        if case.kind == "continuous":
            edit = continuous(case)
            measured, taken = distortion(edit.exact_warp, edit), map_time(case.edits)
        if case.moved is None:
            size = bench.settings.exact_size
            cameras = tuple(camera.resized(size, size) for camera in cameras[: bench.settings.exact_views])
            truth, before = "exact map", bench.mapped(name, None, cameras)
            after = bench.mapped(name, case.edits, cameras)
        else:
            cameras = cameras[: bench.settings.discrete_views]
            truth, before = "photos", bench.modelled(name, cameras)
            after = bench.moved(case, cameras)
        if truth not in unedited:
            unedited[truth] = seen(scene, cameras)
        pictures = seen(edited, cameras)
        if case.moved is not None:
            there = changed(before, after)
            if relit(case.moved(procedural_scene(name))):
                carried = pooled_psnr(pictures, bench.moved(case, cameras, carried=True), there)
            known = ~bench.unseen_pixels(case, cameras, there)
            hidden = 1.0 - float(known.mean())
            lost_seen = mean_psnr(unedited[truth], before, known) - mean_psnr(pictures, after, known)
        figures = compare(unedited[truth], pictures, before, after)
        naive: tuple[float, ...] = ()
        if isinstance(scene.field, SplatField):
            naive = tuple(
                figures.unedited - mean_psnr(naively, after) for _, naively in seen_naively(edited, cameras)
            )
        both = (perceived(unedited[truth], before), perceived(pictures, after)) if perceived else None
        yield Score(
            case,
            truth,
            len(cameras),
            cameras[0].width,
            figures,
            carried,
            ratio,
            measured,
            taken,
            both,
            hidden,
            lost_seen,
            naive,
        )


def frame_ratio(scene: Scene, edited: Scene) -> float:
    """Median over interleaved rounds of the time of edited frames over that of unedited ones."""
    cameras = scene.cameras["test"][:_TIMED_VIEWS]

    if scene.original is not None:
        cameras = tuple(camera.resized(_TIMED_EXACTLY, _TIMED_EXACTLY) for camera in cameras)

    def render(which: Scene) -> None:
        for camera in cameras:
            shown(which, camera)

    seconds = interleaved([lambda: render(scene), lambda: render(edited)], _ROUNDS)
    return float(np.median(seconds[:, 1] / seconds[:, 0]))


def table(scores: Sequence[Score], settings: Settings, notes: Sequence[str] = ()) -> Table:
    """The scores as a table, with what its columns mean."""
    config = settings.config
    length = f"{config.steps} steps" if config.minutes is None else f"{config.minutes:g} minutes"
    explained = [
        f"Fields: {settings.views} photos of {settings.size}x{settings.size} pixels, trained for {length}"
        + _described(config),
        "PSNR (dB) and SSIM: mean over test views, never trained on; unedited: the trained field against "
        "photos of the scene; edited: the edited field against the truth of the edit; lost: the difference.",
        "Truth: photos of the scene whose part was really moved, with the light as it then falls "
        "(ambient occlusion stays as modelled); for "
        "continuous edits the scene's model seen through the edit's exact map, at "
        f"{settings.exact_size}x{settings.exact_size} pixels, the unedited field against the unedited model.",
        "There: on the pixels that the edit changes in truth, and a margin of a 100th of the width; if left: "
        "what the field without the edit would reach there; carried: against parts that keep the light they "
        "had, as an edited field does (where a part was turned).",
        "Unseen: pixels that show a surface that no training photo showed, or only through a gap under a "
        "voxel, such as the ground under a part that is moved; lost, seen: the PSNR lost on all others.",
        "Frame time: edited over unedited, median of frames taken in turn"
        + (f", {_TIMED_EXACTLY}x{_TIMED_EXACTLY} pixels." if isinstance(config, NerfConfig) else "."),
        "Min det J: least volume ratio over the shell of a continuous edit, of its map or the inverse; max "
        "stretch: largest factor by which a length grows or shrinks; map time: for a million points, in the "
        "renderer's kernel.",
    ]
    perceived = any(score.lpips is not None for score in scores)
    explained += [] if perceived else [lpips()[1]]
    explained += [_NAIVELY] if isinstance(config, SplatConfig) else []
    explained += _means(scores)
    return Table(
        "Edits against ground truth",
        _COLUMNS + (_LPIPS if perceived else ()) + (_NAIVE if isinstance(config, SplatConfig) else ()),
        tuple(_row(score, perceived) for score in scores),
        (*explained, *notes),
        names=4,
        shown=_SHOWN,
    )


def _described(config: VoxelConfig | NerfConfig | SplatConfig) -> str:
    """What the fields are, after how long they were trained."""
    if isinstance(config, SplatConfig):
        most = "" if config.splats is None else f", {config.splats} at most"
        return f": splats of degree {config.sh_degree}{most}."
    if isinstance(config, VoxelConfig) and config.resolution is None:
        return " at the resolution that photos and time allow."
    if isinstance(config, VoxelConfig):
        return f" at {config.resolution} voxels along the longest axis."
    return (
        f": the original NeRF, networks of {config.depth} x {config.width}, {config.samples[0]} + "
        f"{config.samples[1]} samples a ray{_shown(config)}, rendered exactly."
    )


def _shown(config: NerfConfig) -> str:
    """How many samples the pictures have, if others than the training."""
    shown = config.shown_samples
    return "" if shown is None else f" ({shown[0]} + {shown[1]} in pictures)"


def _means(scores: Sequence[Score]) -> Iterator[str]:
    """The mean of the PSNR lost by continuous edits, by discrete ones, and by all."""
    for what in ("continuous", "discrete", "all"):
        chosen = [
            score
            for score in scores
            if what == "all" or (score.case.kind == "continuous") == (what == "continuous")
        ]
        if not chosen:
            continue
        lost = float(np.mean([score.figures.lost for score in chosen]))
        text = f"Mean of the PSNR lost, {what} edits: {number(lost)} dB over {len(chosen)} edits"
        if what == "discrete":
            text += (
                f", {number(float(np.mean([score.lost_seen for score in chosen])))} dB on what photos showed"
            )
        if all(score.naive for score in chosen):
            naive = np.mean([score.naive for score in chosen], axis=0)
            text += "; " + ", ".join(
                f"{way}: {number(float(v))}" for way, v in zip(NAIVE, naive, strict=True)
            )
        yield text + "."


def _row(score: Score, perceived: bool) -> tuple[str, ...]:
    figures, measured, taken = score.figures, score.distortion, score.time
    pair = score.lpips or (float("nan"), float("nan"))
    return (
        score.case.scene,
        score.case.name.replace("_", " "),
        score.case.kind,
        score.truth,
        str(score.views),
        number(figures.unedited),
        number(figures.edited),
        number(figures.lost),
        number(figures.unedited_ssim, 4),
        number(figures.edited_ssim, 4),
        f"{100 * figures.changed:.1f}%",
        number(figures.there_unedited),
        number(figures.there_edited),
        number(figures.there_lost),
        number(figures.there_if_left),
        number(score.there_carried),
        "-" if np.isnan(score.unseen) else f"{100 * score.unseen:.2f}%",
        number(score.lost_seen),
        f"x{score.frame_ratio:.2f}",
        "-" if measured is None else number(measured.least_det),
        "-" if measured is None else number(measured.stretch),
        "-" if taken is None else f"{taken.per_million:.0f} ms",
        *((number(value, 4) for value in pair) if perceived else ()),
        *(number(value) for value in score.naive),
    )


def eye(scene: str, size: int) -> Camera:
    """The camera of a scene's pictures, size x size pixels."""
    return Camera.look_at(_EYES[scene], (0, 0, 0), width=size, height=size, fov_x=FOV_X)


def picture_path(folder: Path, case: Case) -> Path:
    """Where the picture of a case goes."""
    return folder / f"{case.scene}_{case.name}.png"


def write_picture(case: Case, bench: Workbench, folder: Path, size: int, *, error: bool = False) -> Path:
    """Writes before, edited and truth (and their difference, dark, three times as strong) side by side."""
    camera = eye(case.scene, size)
    scene = bench.scene(case.scene)
    before = cast(AnyArray, shown(scene, camera).rgb8())
    after = shown(scene.with_edits(case.edits), camera).rgb8()
    truth = (
        bench.mapped(case.scene, case.edits, [camera]) if case.moved is None else bench.moved(case, [camera])
    )
    panels = [before, after, truth[0]]
    if error:
        difference = np.abs(floats(after) - floats(truth[0])).max(axis=-1, keepdims=True)
        panels.append(np.repeat(1.0 - np.minimum(3.0 * difference, 1.0), 3, axis=-1))
    path = picture_path(folder, case)
    write_png(path, side_by_side(*panels))
    return path
