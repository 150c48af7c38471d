"""The paper's ablations, on trained built-in scenes: each gives a table and a picture.

Source: Li & Pan, "Interactive Geometry Editing of Neural Radiance Fields", the ablation study.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.common.cases import Case
from benchmarks.common.figures import Figures, compare
from benchmarks.common.image_strips import Panel, difference, strip
from benchmarks.common.tables import Table, number
from benchmarks.common.workbench import Workbench
from benchmarks.edits.compare_shells import FINER, compared_cameras, continuous, seen
from benchmarks.edits.distortion import distortion
from benchmarks.edits.edit_quality import eye, frame_ratio
from cagefield.cameras.camera import Camera
from cagefield.edits import Continuous, Edit, EditStack, shell_kind
from cagefield.geometry.cage import Cage
from cagefield.images.metrics import psnr
from cagefield.scene.scene import Scene
from cagefield.typing import AnyArray

RESOLUTIONS = (64, 128, 256)
GAPS = (0.1, 0.25, 0.5, 1.0)
"""Gaps between the cages, as shares of the inner cage's mean edge."""

_STRONGER = 20.0
_POINTS = 20_000


@dataclass(frozen=True)
class Ablation:
    """Result of one choice."""

    table: Table
    picture: NDArray[np.uint8]


@dataclass(frozen=True)
class Subject:
    """An edit of a trained scene, on a workbench; pictures are `size` pixels wide and high."""

    case: Case
    bench: Workbench
    size: int

    @property
    def scene(self) -> Scene:
        """The trained scene."""
        return self.bench.scene(self.case.scene)

    @property
    def cameras(self) -> tuple[Camera, ...]:
        """The cameras of the figures."""
        return compared_cameras(self.scene, self.bench)

    def picture(self, edits: EditStack) -> AnyArray:
        """The picture [H,W,3] of the scene under edits, from where the case's pictures are taken."""
        return seen(self.scene.with_edits(edits), [eye(self.case.scene, self.size)])[0]

    def figures(self, edits: EditStack) -> Figures:
        """The field through edits against the scene's model through their exact map."""
        name, cameras = self.case.scene, self.cameras
        before, after = (self.bench.mapped(name, stack, cameras) for stack in (None, edits))
        still, edited = (seen(scene, cameras, FINER) for scene in (self.scene, self.scene.with_edits(edits)))
        return compare(still, edited, before, after)

    def with_edit(self, change: Callable[[Continuous], Edit]) -> EditStack:
        """The case's edits, the continuous one changed."""
        return EditStack(change(e) if isinstance(e, Continuous) else e for e in self.case.edits)


def outer_size(subject: Subject, gaps: Sequence[float] = GAPS) -> Ablation:
    """One motion in outer cages of several sizes: extent of the deformed surroundings."""
    edit = continuous(subject.case)
    rows: list[tuple[str, ...]] = []
    panels: list[Panel] = [("before", subject.picture(EditStack([])))]
    for gap in gaps:
        outer = around(edit, gap)
        stack = subject.with_edit(lambda e, cage=outer: e.replace(outer=cage))  # type: ignore[misc]
        changed = continuous_of(stack)
        measured = distortion(changed.exact_warp, changed)
        figures = subject.figures(stack)
        panels.append((f"gap {gap:g}\nstretch {measured.stretch:.1f}", subject.picture(stack)))
        rows.append(
            (
                f"{gap:g}", number(measured.least_det), number(measured.stretch),
                number(measured.rigidity, 3), f"{100 * figures.changed:.1f}%", number(figures.edited),
                number(figures.lost),
            )
        )  # fmt: skip
    return Ablation(
        Table(
            f"Outer cage size: {title(subject.case)}",
            ("gap", "min det J", "max stretch", "mean |J - R|", "changed pixels", "PSNR edited", "PSNR lost"),
            tuple(rows),
            (
                "Gap: between the outer cage and a box around the inner cage before and after the edit, as a "
                "share of the inner cage's mean edge.",
                f"Shell: {edit.shell.name}. PSNR: of the field through the map against the scene's model "
                "through the same map.",
            ),
        ),
        strip([panels]),
    )


def resolution(subject: Subject, resolutions: Sequence[int] = RESOLUTIONS) -> Ablation:
    """Both shells from lattices of several resolutions and exact: error of the map, and of pictures."""
    rows: list[tuple[str, ...]] = []
    pictures: list[list[Panel]] = []
    voxel = subject.scene.field.sample_spacing
    for shell in ("flow", "trilinear"):
        exact = subject.with_edit(lambda e, s=shell: e.replace(shell=shell_kind(s), lattice=None))  # type: ignore[misc]
        frames, large = seen(subject.scene.with_edits(exact), subject.cameras), subject.picture(exact)
        line: list[Panel] = [(f"{shell}, exact", large)]
        for nodes in (*resolutions, None):
            stack = EditStack(e.replace(lattice=nodes) if isinstance(e, Continuous) else e for e in exact)
            edited = subject.scene.with_edits(stack)
            worst, mean = continuous_of(stack).lattice_error(samples=_POINTS)
            same = psnr(seen(edited, subject.cameras), frames)
            figures = subject.figures(stack)
            if nodes:
                apart = difference(subject.picture(stack), large, _STRONGER)
                line.append(
                    (f"{nodes}: off by {mean / voxel:.2g}\n(at most {worst / voxel:.2g}) voxels", apart)
                )
            rows.append(
                (
                    shell, str(nodes) if nodes else "exact", number(worst / voxel, 3),
                    number(mean / voxel, 4), number(same), number(figures.edited), number(figures.lost),
                    f"x{frame_ratio(subject.scene, edited):.2f}",
                )
            )  # fmt: skip
        pictures.append(line)
    return Ablation(
        Table(
            f"Discretisation resolution: {title(subject.case)}",
            (
                "shell", "nodes an axis", "max error", "mean error", "PSNR to exact", "PSNR edited",
                "PSNR lost", "frame time",
            ),
            tuple(rows),
            (
                f"Error: distance in voxels ({voxel:.4g} world units) between the canonical points from the "
                f"lattice and exact ones, at those of {_POINTS} random points that lie in the shell.",
                "PSNR to exact: frames from the lattice against frames with the exact map; edited: against "
                "the scene's model through the exact map. Frame time: over an unedited frame.",
                f"Picture: the exact frame, and the difference to it, {_STRONGER:g} times as strong.",
            ),
            names=2,
        ),
        strip(pictures),
    )  # fmt: skip


def discrete_continuous(subject: Subject) -> Ablation:
    """One motion as a discrete move, a copy and a continuous edit."""
    kinds: dict[str, Callable[[Continuous], Edit]] = {
        "continuous": lambda e: e,
        "discrete": lambda e: Edit.move(e.inner, operations=e.operations, **e.shared_options),
        "discrete copy": lambda e: Edit.copy(e.inner, operations=e.operations, **e.shared_options),
    }
    rows: list[tuple[str, ...]] = []
    panels: list[Panel] = [("before", subject.picture(EditStack([])))]
    for name, change in kinds.items():
        stack = subject.with_edit(change)
        figures = subject.figures(stack)
        panels.append((name, subject.picture(stack)))
        ratio = frame_ratio(subject.scene, subject.scene.with_edits(stack))
        rows.append(
            (
                name, f"{100 * figures.changed:.1f}%", number(figures.edited), number(figures.lost),
                number(figures.there_lost), f"x{ratio:.2f}",
            )
        )  # fmt: skip
    return Ablation(
        Table(
            f"Discrete against continuous: {title(subject.case)}",
            ("adjustment", "changed pixels", "PSNR edited", "PSNR lost", "there lost", "frame time"),
            tuple(rows),
            (
                "PSNR: of the edited field against the scene's model through the same edit; there: on the "
                "pixels that it changes. Frame time: over an unedited frame.",
            ),
        ),
        strip([panels]),
    )


def continuous_of(stack: EditStack) -> Continuous:
    """The one continuous edit of a stack."""
    (edit,) = (edit for edit in stack if isinstance(edit, Continuous))
    return edit


def around(edit: Edit, gap: float) -> Cage:
    """The box along the inner cage that holds it before and after, and a gap in shares of its mean edge."""
    A, b = edit.inner.affine
    corners = np.concatenate([edit.inner.corners, edit.deformed.corners])
    u = (corners - b) @ np.linalg.inv(A).T
    low, high = u.min(axis=0), u.max(axis=0)
    bits = Cage.box((0.5, 0.5, 0.5), 1.0).corners
    box = Cage(b + (low + bits * (high - low)) @ A.T)
    return box.grown(gap * float(np.linalg.norm(A, axis=0).mean()))


def title(case: Case) -> str:
    """A case in words."""
    return f"{case.scene}, {case.name.replace('_', ' ')}"


def with_notes(ablation: Ablation, notes: Sequence[str]) -> Ablation:
    """Table with more notes below it."""
    return replace(ablation, table=replace(ablation.table, notes=(*ablation.table.notes, *notes)))
