"""What editing a captured field cannot do: old shadows stay behind, and what no photo saw is not there.

Source: Li & Pan, "Interactive Geometry Editing of Neural Radiance Fields", the section on limits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cagefield.benchmarking.ablations import Ablation, title
from cagefield.benchmarking.cases import Case
from cagefield.benchmarking.compare import seen
from cagefield.benchmarking.edits import eye
from cagefield.benchmarking.figures import Pictures, changed_pixels, floats, mean_psnr, pooled_psnr
from cagefield.benchmarking.strips import strip
from cagefield.benchmarking.tables import Table, number
from cagefield.benchmarking.workbench import Workbench, beside
from cagefield.cages import Cage
from cagefield.cameras import Camera
from cagefield.datasets.procedural import ProceduralScene, procedural_scene
from cagefield.edits import Edit, EditStack
from cagefield.errors import CagefieldError

REACH = 60.0
"""Degrees to either side of a scene's picture within which the photos of its single-sided capture lie."""


def limits(case: Case, bench: Workbench, size: int) -> Ablation:
    """Both limits, on the scene of a discrete case: the part that it moves, and the scene turned around.

    Raises:
        CagefieldError: a case without a really moved part.
    """
    if case.moved is None:
        raise CagefieldError(f"{case.scene} {case.name} moves no part; choose a discrete edit")
    model = procedural_scene(case.scene)
    scene = bench.scene(case.scene)
    cameras = [eye(case.scene, size), *scene.cameras["test"]]
    moved = case.moved(model)
    edited = seen_all(bench, case.scene, case.edits, cameras)
    with_light, as_it_falls = photos(moved, cameras), photos(resettled(moved), cameras)
    shadow = changed_pixels(np.stack(with_light), np.stack(as_it_falls))

    center, extent = model.part_box(model.part_names, 0.05)
    turn = Edit(Cage.box(center, extent), adjustment="discrete").rotate((0.0, 0.0, np.pi))
    turned = model.move(model.part_names, rotate=(0.0, 0.0, np.pi), pivot=center).carrying_light()
    truth = photos(turned, cameras)
    around, one_side = bench.scene(case.scene), bench.one_sided(case.scene, eye(case.scene, size), REACH)
    full, half = (seen(which.with_edits(EditStack([turn])), cameras) for which in (around, one_side))
    still = seen(one_side, cameras)
    model_still = photos(model, cameras)
    front = [n for n, camera in enumerate(cameras) if beside(camera, cameras[0], REACH)]

    def of(pictures: Pictures, target: Sequence[np.ndarray]) -> str:
        return number(mean_psnr(pictures[front], np.stack([target[n] for n in front])))

    def there(target: Sequence[np.ndarray]) -> str:
        return number(pooled_psnr(np.stack(edited), np.stack(target), shadow))

    rows = (
        (f"shadows: {title(case)}", "against the part moved with its old shadows", there(with_light)),
        (f"shadows: {title(case)}", "against shadows as they then fall", there(as_it_falls)),
        (f"single-sided: {case.scene}", "as captured, from the captured side", of(still, model_still)),
        (f"single-sided: {case.scene}", "turned around, from the captured side", of(half, truth)),
        (f"captured all round: {case.scene}", "turned around, from the same side", of(full, truth)),
    )
    pictures = [
        [
            ("edited field", edited[0]),
            ("truth, with old shadows", with_light[0]),
            ("truth, shadows as they fall", as_it_falls[0]),
        ],
        [
            ("captured from this side, turned around", half[0]),
            ("captured all round, turned around", full[0]),
            ("truth", truth[0]),
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
                "scene is then turned by 180 degrees, which shows its other side. PSNR: test views on that "
                "side.",
            ),
            names=2,
        ),
        strip(pictures),
    )


def seen_all(bench: Workbench, name: str, edits: EditStack, cameras: Sequence[Camera]) -> list[np.ndarray]:
    """Pictures [H,W,3] of the trained scene under edits."""
    return list(seen(bench.scene(name).with_edits(edits), cameras))


def photos(model: ProceduralScene, cameras: Sequence[Camera]) -> list[np.ndarray]:
    """Photos [H,W,3] of a scene over white, as floats."""
    return [floats(model.photograph(camera, background="white").rgb8()) for camera in cameras]


def resettled(moved: ProceduralScene) -> ProceduralScene:
    """The scene as if modelled with its parts where they are now: ambient occlusion is theirs there."""
    parts = tuple(
        replace(
            part,
            primitives=tuple(
                replace(primitive, poses=part.motion @ primitive.poses) for primitive in part.primitives
            ),
            motion=np.eye(4),
        )
        for part in moved.parts
    )
    return replace(moved, parts=parts, modelled=parts)
