"""The continuous edits with every method in their shells: same cages, same motion, same field.

There is no truth that all methods could be held to: each map is right about itself. So a field seen through a
method's map is compared with the scene's model seen through the same map, exactly evaluated, which shows what
resampling and the lattice cost; and the maps are compared by how little they distort.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.common.cases import Case
from benchmarks.common.figures import Figures, compare, stacked, supersampled
from benchmarks.common.tables import Table, number
from benchmarks.common.workbench import Workbench
from benchmarks.edits.distortion import Distortion, distortion, shell_points
from benchmarks.edits.methods import MAPS, METHODS, PEER_LATTICE, Method, check_known
from cagefield.cameras.camera import Camera
from cagefield.edits import Continuous, EditStack
from cagefield.edits.device_stack import DeviceStack
from cagefield.errors import CagefieldError
from cagefield.images.render_result import RenderResult
from cagefield.scene.scene import Scene
from cagefield.typing import AnyArray

_TIMED_POINTS = 1 << 17

FINER = 2
"""Pixels of continuous edits are the mean of FINER x FINER rays, as those of their truth are: they are larger
than the pixels of the photos that a field learnt from, and with one ray each would show less of it."""

_COLUMNS = (
    "scene", "edit", "method", "folds", "min det J", "max stretch", "mean |J - R|", "set-up", "per million",
    "PSNR unedited", "PSNR edited", "PSNR lost", "SSIM edited",
)  # fmt: skip
_SHOWN = ("scene", "edit", "method", "min det J", "max stretch", "mean |J - R|", "PSNR lost")


@dataclass(frozen=True)
class MapTime:
    """Seconds to make what the kernel needs of a map, and milliseconds it then takes for a million points."""

    set_up: float
    per_million: float


@dataclass(frozen=True)
class Comparison:
    """The figures of one edit with one method in its shell; the distortion is the exact map's."""

    case: Case
    method: str
    distortion: Distortion
    time: MapTime
    figures: Figures


def continuous(case: Case) -> Continuous:
    """The continuous edit of a case. Raises CagefieldError where it has none or several."""
    found = [edit for edit in case.edits if isinstance(edit, Continuous)]
    if len(found) != 1:
        raise CagefieldError(f"{case.scene} {case.name} has {len(found)} continuous edits; it must have one")
    return found[0]


def measure(cases: Sequence[Case], methods: Sequence[str], bench: Workbench) -> Iterator[Comparison]:
    """The comparisons, case by case in order; cases that are not continuous are passed over.

    Raises:
        CagefieldError: an unknown method.
    """
    check_known(methods)
    maps: dict[tuple[str, str, str], Distortion] = {}
    for case in cases:
        if case.kind != "continuous":
            continue
        scene = bench.scene(case.scene)
        cameras = compared_cameras(scene, bench)
        unedited = seen(scene, cameras, FINER)
        before = bench.mapped(case.scene, None, cameras)
        for name in methods:
            method = METHODS[name]
            key = (case.scene, case.name, method.shell)
            if key not in maps:
                edit = Method(method.shell).of(continuous(case))
                maps[key] = distortion(edit.exact_warp, edit)
            edits = method.of_all(case.edits)
            after = bench.mapped(case.scene, Method(method.shell).of_all(case.edits), cameras)
            figures = compare(unedited, seen(scene.with_edits(edits), cameras, FINER), before, after)
            yield Comparison(case, name, maps[key], map_time(edits), figures)


def compared_cameras(scene: Scene, bench: Workbench) -> tuple[Camera, ...]:
    """The cameras of the comparison."""
    size = bench.settings.compared_size
    return tuple(
        camera.resized(size, size) for camera in scene.cameras["test"][: bench.settings.compared_views]
    )


def seen(scene: Scene, cameras: Sequence[Camera], rays: int = 1) -> AnyArray:
    """Pictures [V,H,W,3] of a scene, as `shown`, each pixel the mean of rays x rays."""
    return stacked([supersampled(lambda finer: shown(scene, finer).rgb, camera, rays) for camera in cameras])


def shown(scene: Scene, camera: Camera) -> RenderResult:
    """A scene's picture over white, of the original field, exactly, where it holds one."""
    return scene.render(camera, background="white", exact=scene.original is not None)


def map_time(edits: EditStack) -> MapTime:
    """The time of a stack's map in the renderer's kernel, at points of the deformed shell."""
    (edit,) = (edit for edit in edits if isinstance(edit, Continuous))
    points = shell_points(edit, _TIMED_POINTS).astype(np.float32)
    viewdirs = np.broadcast_to(np.array([0.0, 0.0, 1.0], np.float32), points.shape)
    # Under another name, as what is made of an edit is kept for all that equal it.
    fresh = EditStack(edit.replace(name=f"{edit.name}, timed at {time.perf_counter()}") for edit in edits)
    began = time.perf_counter()
    packed = DeviceStack.from_stack(fresh)
    set_up = time.perf_counter() - began
    packed.to_canonical(points[:1], viewdirs[:1])
    began = time.perf_counter()
    packed.to_canonical(points, viewdirs)
    return MapTime(set_up, (time.perf_counter() - began) / _TIMED_POINTS * 1e9)


def table(rows: Sequence[Comparison], bench: Workbench, notes: Sequence[str] = ()) -> Table:
    """The comparisons as a table, with what its columns mean and a summary for each method."""
    settings = bench.settings
    explained = [
        "Every method moves the inner region alike; they differ in the shell between the cages. Flow: this "
        "project's default. Trilinear: the shell of Li & Pan, exact and from lattices of 64, 128, 256 nodes "
        "an axis. Mean value: Ju et al.'s coordinates of the cages' surface, as NeRFshop and CageNeRF use "
        "them. Harmonic: the harmonic extension of the cage's motion, as in DRFC. The last two are mesh-free "
        f"stand-ins, rendered from a lattice of {PEER_LATTICE} nodes an axis.",
        "Folds: share of the shell that is turned inside out. Min det J: least volume ratio over the shell, "
        "of the map or its inverse. Max stretch: largest factor by which a length grows or shrinks. "
        "|J - R|: distance from the nearest rotation, 0 for rigid motion. All of the exact map.",
        "Set-up: seconds until the kernel has what it needs of the map; per million: milliseconds for a "
        "million points in the kernel.",
        f"PSNR, SSIM: {settings.compared_views} test views at {settings.compared_size}x"
        f"{settings.compared_size} pixels; unedited: the field against the scene's model; edited: the field "
        "through the method's map against the model through the same map, exactly evaluated; lost: the "
        "difference.",
        *summaries(rows),
    ]
    return Table(
        "Methods compared on the continuous edits",
        _COLUMNS,
        tuple(_row(row) for row in rows),
        (*explained, *notes),
        names=3,
        shown=_SHOWN,
    )


def summaries(rows: Sequence[Comparison]) -> list[str]:
    """A line for each method: its mean loss and how often it folds, and where it beats the flow."""
    lines = []
    flow = {(row.case.scene, row.case.name): row for row in rows if row.method == "flow"}
    for method in dict.fromkeys(row.method for row in rows):
        own = [row for row in rows if row.method == method]
        folding = sum(row.distortion.folds for row in own)
        line = (
            f"{method}: {number(float(np.mean([row.figures.lost for row in own])))} dB lost on average over "
            f"{len(own)} edits, {folding} of which fold"
        )
        better = _better(own, flow) if method != "flow" else []
        lines.append(line + "".join(f"; {what}: {', '.join(edits)}" for what, edits in better) + ".")
    return lines


def _better(
    own: Sequence[Comparison], flow: dict[tuple[str, str], Comparison]
) -> list[tuple[str, list[str]]]:
    """Figures in which a method beats the flow, with their edits."""
    found: dict[str, list[str]] = {}
    for row in own:
        other = flow.get((row.case.scene, row.case.name))
        if other is None:
            continue
        name = f"{row.case.scene} {row.case.name.replace('_', ' ')}"
        exact = row.method in MAPS  # the distortion is the exact map's
        for what, better in (
            ("loses less than flow on", row.figures.lost < other.figures.lost - 0.005),
            ("stretches less on", exact and row.distortion.stretch < other.distortion.stretch),
            ("is nearer to rigid on", exact and row.distortion.rigidity < other.distortion.rigidity),
        ):
            if better:
                found.setdefault(what, []).append(name)
    return list(found.items())


def _row(row: Comparison) -> tuple[str, ...]:
    measured, figures = row.distortion, row.figures
    return (
        row.case.scene,
        row.case.name.replace("_", " "),
        row.method,
        f"{100 * measured.folded:.1f}%" if measured.folds else "no",
        number(measured.least_det),
        number(measured.stretch),
        number(measured.rigidity, 3),
        f"{row.time.set_up:.2f} s",
        f"{row.time.per_million:.0f} ms",
        number(figures.unedited),
        number(figures.edited),
        number(figures.lost),
        number(figures.edited_ssim, 4),
    )
