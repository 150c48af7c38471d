"""The table of edits against ground truth: what a case's figures are, and what the columns mean."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.common.cases import Case
from benchmarks.common.figures import Figures
from benchmarks.common.perceptual import lpips
from benchmarks.common.tables import Table, number
from benchmarks.common.workbench import Settings
from benchmarks.edits.compare_shells import FINER, MapTime
from benchmarks.edits.distortion import Distortion
from benchmarks.edits.naive_splats import NAIVE
from cagefield.training.nerf.nerf_config import NerfConfig
from cagefield.training.splats.splat_config import SplatConfig
from cagefield.training.voxels.voxel_config import VoxelConfig

TIMED_EXACTLY = 40
"""Width and height at which exact frames are timed: a picture of a NeRF takes seconds."""

_COLUMNS = (
    "scene", "edit", "kind", "truth", "views", "PSNR unedited", "PSNR edited", "PSNR lost", "SSIM unedited",
    "SSIM edited", "changed pixels", "there unedited", "there edited", "there lost", "there if left",
    "lost, old shadows", "there lost, old shadows", "uncovered", "uncovered edited", "uncovered lost",
    "unseen", "unseen edited", "lost, seen",
)  # fmt: skip
_TAUGHT = ("uncovered taught", "unseen taught")
_INSIDE = ("inside", "inside unedited", "inside edited", "inside lost", "mean error", "max error")
_CLOSED_FORM = (
    "Inside: on the pixels that show the bent, twisted or pulled part inside the inner cage, against photos "
    "of the scene whose part has that shape in closed form, light carried along; unedited: on the part's "
    "pixels before the edit. Errors: of the points that these pixels show, the distance of the canonical "
    "points by the exact map from those in closed form, in thousandths of a world unit."
)
_COSTS = ("frame time", "min det J", "max stretch", "map time")
_LPIPS, _NAIVE = ("LPIPS unedited", "LPIPS edited"), tuple(f"lost, {way}" for way in NAIVE)
_NAIVELY = (
    "Lost, means only: each splat moved with its mean, no more; no turned SH: its covariance follows the map "
    "too, its colors do not turn; not split: all but the splitting of splats that an edit bends or cuts."
)
_SHOWN = (
    "scene", "edit", "PSNR unedited", "PSNR edited", "PSNR lost", "there lost", "there lost, old shadows",
    "uncovered lost", "frame time",
)  # fmt: skip

_NAN = float("nan")


@dataclass(frozen=True)
class Revealed:
    """Figures of the pixels that a discrete edit uncovers or shades, dB; NaN without such pixels.

    old_shadows   against the truth whose ambient occlusion stays as modelled
    uncovered     share of pixels that show a surface which the part hid; `_unedited` is the PSNR there of the
                  unedited field against the unedited scene, `_edited` of the edited one against the truth
    unseen        share of pixels that show what no training photo showed
    lost_seen     the PSNR lost on the others
    _taught       the PSNR there of a field trained on photos of the truth; None where none was trained
    """

    old_shadows: Figures
    uncovered: float
    uncovered_unedited: float
    uncovered_edited: float
    unseen: float
    unseen_edited: float
    lost_seen: float
    uncovered_taught: float | None = None
    unseen_taught: float | None = None

    @property
    def uncovered_lost(self) -> float:
        """PSNR lost where a surface was uncovered."""
        return self.uncovered_unedited - self.uncovered_edited


@dataclass(frozen=True)
class Inside:
    """Figures of a free-form edit inside its inner cage, against the scene deformed in closed form.

    unedited, edited      PSNR (dB) on the pixels that show the deformed part there, before and after
    pixels                share of all pixels after
    mean_error, max_error distance, world units, of canonical points by the edit from those in closed form, of
                          the points that these pixels show
    """

    unedited: float
    edited: float
    pixels: float
    mean_error: float
    max_error: float


@dataclass(frozen=True)
class Score:
    """The figures of one case.

    `frame_ratio` is the time of an edited frame over that of an unedited one. Only a continuous edit has a
    distortion and a time of its map, only a discrete one what it revealed; `lpips` is that of the unedited
    and the edited pictures, where measured. Of splats, `naive` is the PSNR lost by each way of `NAIVE`.
    """

    case: Case
    truth: str
    views: int
    size: int
    figures: Figures
    frame_ratio: float
    distortion: Distortion | None = None
    time: MapTime | None = None
    lpips: tuple[float, float] | None = None
    revealed: Revealed | None = None
    naive: tuple[float, ...] = ()
    inside: Inside | None = None


def table(scores: Sequence[Score], settings: Settings, notes: Sequence[str] = ()) -> Table:
    """The scores as a table, with what its columns mean."""
    config = settings.config
    taught = any(score.revealed and score.revealed.uncovered_taught is not None for score in scores)
    length = f"{config.steps} steps" if config.minutes is None else f"{config.minutes:g} minutes"
    explained = [
        f"Fields: {settings.views} photos of {settings.size}x{settings.size} pixels, trained for {length}"
        + _described(config),
        "PSNR (dB) and SSIM: mean over test views, never trained on; unedited: the trained field against "
        "photos of the scene; edited: the edited field against the truth of the edit; lost: the difference.",
        "Truth: photos of the scene whose part was really moved, all light as it then falls, ambient "
        "occlusion computed anew; for continuous edits photos of the scene seen through the edit's exact "
        f"map, which carries the light along, at {settings.exact_size}x{settings.exact_size} pixels, each "
        f"the mean of {FINER}x{FINER} rays, of the field's pictures too.",
        "There: on the pixels that the edit changes in truth, and a margin of a 100th of the width; if left: "
        "what the field without the edit would reach there.",
        "Old shadows: against the truth whose ambient occlusion stays as it was, on what a part left and on "
        "the part, as in an edited field; the difference is what shadows cost.",
        "Uncovered: pixels that show a surface which the moved or removed part hid; lost: against the "
        "unedited field there, which shows the part.",
        "Unseen: pixels that show a surface that no training photo showed, or only through a gap under a "
        "voxel, such as the ground under a part that is moved; lost, seen: the PSNR lost on all others.",
        "Frame time: edited over unedited, median of frames taken in turn"
        + (f", {TIMED_EXACTLY}x{TIMED_EXACTLY} pixels." if isinstance(config, NerfConfig) else "."),
        "Min det J: least volume ratio over the shell of a continuous edit, of its map or the inverse; max "
        "stretch: largest factor by which a length grows or shrinks; map time: for a million points, in the "
        "renderer's kernel.",
    ]
    if taught:
        explained.append(
            "Taught: the same pixels of a field trained as long on as many photos of the truth itself."
        )
    closed = any(score.inside is not None for score in scores)
    explained += [_CLOSED_FORM] if closed else []
    perceived = any(score.lpips is not None for score in scores)
    explained += [] if perceived else [lpips()[1]]
    explained += [_NAIVELY] if isinstance(config, SplatConfig) else []
    explained += _means(scores)
    return Table(
        "Edits against ground truth",
        _COLUMNS
        + (_TAUGHT if taught else ())
        + (_INSIDE if closed else ())
        + _COSTS
        + (_LPIPS if perceived else ())
        + (_NAIVE if isinstance(config, SplatConfig) else ()),
        tuple(_row(score, taught, perceived, closed) for score in scores),
        (*explained, *notes),
        names=4,
        shown=_SHOWN,
    )


def _described(config: VoxelConfig | NerfConfig | SplatConfig) -> str:
    """Description of the fields by the configuration of their training."""
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
    shown = config.render_samples
    return "" if shown is None else f" ({shown[0]} + {shown[1]} in pictures)"


def _means(scores: Sequence[Score]) -> Iterator[str]:
    """Means over continuous edits, over discrete ones, and over all, and the most that one of them loses."""
    for what in ("continuous", "discrete", "all"):
        chosen = [
            score
            for score in scores
            if what == "all" or (score.case.kind == "continuous") == (what == "continuous")
        ]
        if not chosen:
            continue
        text = f"PSNR lost, {what} edits: {_mean_and_most(chosen, [s.figures.lost for s in chosen])}"
        if all(score.naive for score in chosen):
            naive = np.mean([score.naive for score in chosen], axis=0)
            text += "; " + ", ".join(
                f"{way}: {number(float(v))}" for way, v in zip(NAIVE, naive, strict=True)
            )
        yield text + "."
        if what == "all":
            continue
        there = _mean_and_most(chosen, [score.figures.there_lost for score in chosen])
        yield f"There lost, {what} edits: {there}."
    moved = [(score, score.revealed) for score in scores if score.revealed is not None]
    cases = [score for score, _ in moved]
    for what, values in (
        ("PSNR lost, discrete edits, old shadows", [it.old_shadows.lost for _, it in moved]),
        ("There lost, discrete edits, old shadows", [it.old_shadows.there_lost for _, it in moved]),
        ("PSNR lost on what photos showed", [it.lost_seen for _, it in moved]),
        ("Uncovered lost", [it.uncovered_lost for _, it in moved]),
        ("Uncovered, below taught", [_below(it.uncovered_taught, it.uncovered_edited) for _, it in moved]),
        ("Unseen, below taught", [_below(it.unseen_taught, it.unseen_edited) for _, it in moved]),
    ):
        if np.isfinite(values).any():
            yield f"{what}: {_mean_and_most(cases, values)}."


def _mean_and_most(scores: Sequence[Score], values: Sequence[float]) -> str:
    """The mean and the largest of the values that are known, and whose that is."""
    known = [(value, score.case) for value, score in zip(values, scores, strict=True) if np.isfinite(value)]
    if not known:
        return "none is known"
    most, case = max(known, key=lambda pair: pair[0])
    mean = float(np.mean([value for value, _ in known]))
    edits = f"{len(known)} edit" + ("s" if len(known) > 1 else "")
    return (
        f"mean {number(mean)} dB over {edits}, at most {number(most)} "
        f"({case.scene} {case.name.replace('_', ' ')})"
    )


def _below(taught: float | None, edited: float) -> float:
    """How far an edited field is below a taught one."""
    return _NAN if taught is None else taught - edited


def _row(score: Score, taught: bool, perceived: bool, closed: bool) -> tuple[str, ...]:
    figures, measured, taken = score.figures, score.distortion, score.time
    pair = score.lpips or (_NAN, _NAN)
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
        *_revealed(score.revealed, taught),
        *(_inside(score.inside) if closed else ()),
        f"x{score.frame_ratio:.2f}",
        "-" if measured is None else number(measured.least_det),
        "-" if measured is None else number(measured.stretch),
        "-" if taken is None else f"{taken.per_million:.0f} ms",
        *((number(value, 4) for value in pair) if perceived else ()),
        *(number(value) for value in score.naive),
    )


def _inside(figures: Inside | None) -> tuple[str, ...]:
    """The cells of the comparison with the closed form."""
    if figures is None:
        return ("-",) * len(_INSIDE)
    return (
        f"{100 * figures.pixels:.2f}%",
        number(figures.unedited),
        number(figures.edited),
        number(figures.unedited - figures.edited),
        number(1000 * figures.mean_error),
        number(1000 * figures.max_error),
    )


def _revealed(figures: Revealed | None, taught: bool) -> tuple[str, ...]:
    """The cells of what a discrete edit brought to light."""
    if figures is None:
        return ("-",) * (8 + 2 * taught)
    best = tuple(_NAN if v is None else v for v in (figures.uncovered_taught, figures.unseen_taught))
    return (
        number(figures.old_shadows.lost),
        number(figures.old_shadows.there_lost),
        f"{100 * figures.uncovered:.2f}%",
        number(figures.uncovered_edited),
        number(figures.uncovered_lost),
        f"{100 * figures.unseen:.2f}%",
        number(figures.unseen_edited),
        number(figures.lost_seen),
        *((number(value) for value in best) if taught else ()),
    )
