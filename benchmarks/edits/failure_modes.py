"""Failure modes of moved content: shadows stay behind, and regions that no photo shows are missing.

Source: Li & Pan, "Interactive Geometry Editing of Neural Radiance Fields", the section on limits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.common.cases import Case
from benchmarks.common.figures import changed_pixels, mean_psnr, pooled_psnr, stacked
from benchmarks.common.image_strips import strip
from benchmarks.common.tables import Table, number
from benchmarks.common.workbench import Workbench, beside
from benchmarks.edits.ablations import Ablation, title
from benchmarks.edits.compare_shells import seen
from benchmarks.edits.edit_quality import eye
from cagefield.cameras.camera import Camera
from cagefield.edits import Edit, EditStack
from cagefield.errors import CagefieldError
from cagefield.geometry.cage import Cage
from cagefield.procedural import ProceduralScene, procedural_scene
from cagefield.typing import AnyArray

REACH = 60.0
"""Degrees to either side of a scene's picture within which the photos of its single-sided capture lie."""


def limits(case: Case, bench: Workbench, size: int) -> Ablation:
    """Both limits, on the scene of a discrete case: the part that it moves, and the scene turned around.

    Raises:
        CagefieldError: a case without a really moved part.
    """
    if case.moved is None:
        raise CagefieldError(f"{case.scene} {case.name} moves no part; choose a discrete edit")
    front = eye(case.scene, size)
    tests = bench.scene(case.scene).cameras["test"]
    shown, every = _shots(case, bench, front, [front]), _shots(case, bench, front, tests)
    shadow = changed_pixels(every.old_shadows, every.new_shadows)
    before = [n for n, camera in enumerate(tests) if beside(camera, front, REACH)]

    def there(truth: AnyArray) -> str:
        return number(pooled_psnr(every.edited, truth, shadow))

    def from_there(pictures: AnyArray, truth: AnyArray) -> str:
        return number(mean_psnr(pictures[before], truth[before]) if before else float("nan"))

    rows = (
        (f"shadows: {title(case)}", "against the part moved with its old shadows", there(every.old_shadows)),
        (f"shadows: {title(case)}", "against shadows as they then fall", there(every.new_shadows)),
        (
            f"single-sided: {case.scene}",
            "as captured, from the captured side",
            from_there(every.one_side, every.model),
        ),
        (
            f"single-sided: {case.scene}",
            "turned around, from the captured side",
            from_there(every.one_side_turned, every.turned),
        ),
        (
            f"captured all round: {case.scene}",
            "turned around, from the same side",
            from_there(every.all_round_turned, every.turned),
        ),
    )
    pictures = [
        [
            ("edited field", shown.edited[0]),
            ("truth, with old shadows", shown.old_shadows[0]),
            ("truth, shadows as they fall", shown.new_shadows[0]),
        ],
        [
            ("captured from this side,\nturned around", shown.one_side_turned[0]),
            ("captured all round,\nturned around", shown.all_round_turned[0]),
            ("truth", shown.turned[0]),
        ],
    ]
    return Ablation(
        Table(
            "Limits",
            ("limit", "what", "PSNR"),
            rows,
            (
                "Shadows (ambient occlusion of the built-in scenes): PSNR on the pixels where they differ "
                "with and without the move, and a margin of a 100th of the width.",
                f"Single-sided: photos from within {REACH:g} degrees of the picture's direction alone; the "
                "scene is then turned by 180 degrees, which shows its other side. PSNR: the "
                f"{len(before)} test views on that side.",
            ),
            names=2,
        ),
        strip(pictures),
    )


@dataclass(frozen=True)
class _Shots:
    """Pictures [V,H,W,3] of the trained scene, edited or turned, and of the model, the same views each."""

    edited: AnyArray
    old_shadows: AnyArray
    new_shadows: AnyArray
    one_side: AnyArray
    one_side_turned: AnyArray
    all_round_turned: AnyArray
    model: AnyArray
    turned: AnyArray


def _shots(case: Case, bench: Workbench, front: Camera, cameras: Sequence[Camera]) -> _Shots:
    model, scene = procedural_scene(case.scene), bench.scene(case.scene)
    moved = model if case.moved is None else case.moved(model)
    center, extent = model.part_box(model.part_names, 0.05)
    turn = Edit.move(Cage.box(center, extent)).rotate((0.0, 0.0, np.pi))
    turned = model.move(model.part_names, rotate=(0.0, 0.0, np.pi), pivot=center).with_modeled_light()
    alone = EditStack(edit.replace(fill="none", relight="none") for edit in case.edits)
    turn = turn.replace(fill="none", relight="none")
    one_side = bench.one_sided(case.scene, front, REACH)
    return _Shots(
        edited=seen(scene.with_edits(alone), cameras),
        old_shadows=photos(moved, cameras),
        new_shadows=photos(moved.with_new_occlusion(), cameras),
        one_side=seen(one_side, cameras),
        one_side_turned=seen(one_side.with_edits(EditStack([turn])), cameras),
        all_round_turned=seen(scene.with_edits(EditStack([turn])), cameras),
        model=photos(model, cameras),
        turned=photos(turned, cameras),
    )


def photos(model: ProceduralScene, cameras: Sequence[Camera]) -> AnyArray:
    """Photos [V,H,W,3] of a scene over white."""
    return stacked([model.photograph(camera, background="white").rgb8() for camera in cameras])
