"""Frame times of a trained scene: unedited, and under an edit in every way it can be evaluated."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.common.machine import Machine
from benchmarks.common.tables import Table, number
from benchmarks.common.timing import interleaved
from cagefield.cameras.camera import Camera
from cagefield.edits import Continuous, Discrete, Edit, EditStack
from cagefield.errors import CagefieldError
from cagefield.fields.splat_field import SplatField
from cagefield.geometry.cage import Cage
from cagefield.rendering.reference_renderer import intersect_box
from cagefield.scene.scene import Scene

COVERED = 0.25
"""Share of the picture that the default edit's outer cage covers."""

LATTICES = (None, 64, 128)


@dataclass(frozen=True)
class FrameTime:
    """Times of one variant over all rounds and cameras.

    median_ms, least_ms  milliseconds a frame, mean over cameras, of the median and the fastest round
    ratio, least_ratio   over the unedited frame: median of the rounds' own ratios, and fastest over fastest
    rays_per_second      of the median round
    """

    variant: str
    median_ms: float
    least_ms: float
    ratio: float
    least_ratio: float
    rays_per_second: float


@dataclass(frozen=True)
class SpeedReport:
    """Frame times at width x height; `covered` is the share of the picture that meets an edit's box."""

    width: int
    height: int
    cameras: int
    rounds: int
    covered: float
    rows: tuple[FrameTime, ...]

    def document(self, machine: Machine, command: str) -> dict[str, object]:
        """The report as JSON."""
        return {"machine": asdict(machine), "command": command, **asdict(self)}

    def table(self, machine: Machine, command: str) -> Table:
        """The report as a table."""
        rows = tuple(
            (
                row.variant,
                number(row.median_ms, 1),
                number(row.least_ms, 1),
                f"x{row.ratio:.3f}",
                f"x{row.least_ratio:.3f}",
                f"{row.rays_per_second / 1e6:.2f} M",
            )
            for row in self.rows
        )
        return Table(
            f"Frame times at {self.width}x{self.height}",
            ("variant", "median ms", "least ms", "ratio", "ratio of least", "rays/s"),
            rows,
            (
                f"{self.rounds} rounds over {self.cameras} cameras, all variants in turn in each round; the "
                f"edit's boxes cover {100 * self.covered:.0f}% of the picture.",
                f"Machine: {machine}",
                f"Command: `{command}`",
            ),
        )


def measure(
    scene: Scene,
    cameras: Sequence[Camera],
    edits: EditStack | None = None,
    *,
    rounds: int = 15,
    lattices: Sequence[int | None] = LATTICES,
    report: Callable[[str], None] = lambda _: None,
) -> SpeedReport:
    """Times of frames: unedited, edited with each lattice (None: exact), and with discrete edits.

    Left out, the edit is `default_edit`. `report` is told what is being done.

    Raises:
        CagefieldError: no cameras, or edits that change nothing.
        EditError: edits that cannot be evaluated.
    """
    if not cameras:
        raise CagefieldError("frame times need at least one camera; the scene has none")
    edits = EditStack([default_edit(scene, cameras)]) if edits is None else edits
    if not edits.active:
        raise CagefieldError("the edits change nothing: there is nothing to time; give another edit file")
    plain = scene.with_edits(EditStack([]))
    variants = {"unedited": plain}
    report("preparing the edited scenes")
    for name, stack in _variants(edits, lattices).items():
        variants[name] = plain.with_edits(stack)

    def render(which: Scene) -> Callable[[], None]:
        def frames() -> None:
            for camera in cameras:
                which.render(camera)

        return frames

    report(f"{rounds} rounds of {len(variants)} x {len(cameras)} frames")
    seconds = interleaved([render(which) for which in variants.values()], rounds) / len(cameras)
    rays = float(np.mean([camera.width * camera.height for camera in cameras]))
    rows = tuple(_row(name, seconds[:, i], seconds[:, 0], rays) for i, name in enumerate(variants))
    width, height = cameras[0].width, cameras[0].height
    return SpeedReport(width, height, len(cameras), rounds, covered(edits.boxes, cameras), rows)


def default_edit(scene: Scene, cameras: Sequence[Camera]) -> Edit:
    """A continuous edit in the middle of the scene whose outer cage covers COVERED of the pictures.

    The cube around the middle of the field's stored voxels turns by 15 degrees and grows by a tenth inside a
    cube of twice its size.
    """
    middle, reach = _middle(scene)
    low, high = 0.0, 4.0 * reach
    for _ in range(30):
        size = 0.5 * (low + high)
        box = np.stack([middle - size / 2, middle + size / 2])
        low, high = (size, high) if covered(box[None], cameras) < COVERED else (low, size)
    outer = Cage.box(middle, high)
    edit = Edit.continuous(Cage.box(middle, high / 2), outer, name="turn and grow")
    return edit.rotate((0.0, 0.0, np.radians(15.0))).scale(1.1)


def as_move(edit: Edit) -> Edit:
    """Discrete move with the motion of a continuous edit."""
    return Edit.move(edit.inner, operations=edit.operations, **edit.shared_options)


def covered(boxes: NDArray[np.float64], cameras: Sequence[Camera]) -> float:
    """Share of the pixels whose ray meets one of the boxes [B,2,3], mean over cameras."""
    shares = []
    for camera in cameras:
        small = camera.resized(max(1, camera.width // 4), max(1, camera.height // 4))
        origins, directions = small.rays()
        met = np.zeros(len(directions), bool)
        for box in boxes:
            enter, leave = intersect_box(origins, directions, box)
            met |= leave > np.maximum(enter, 0.0)
        shares.append(met.mean())
    return float(np.mean(shares))


def _variants(edits: EditStack, lattices: Sequence[int | None]) -> dict[str, EditStack]:
    """Name -> stack: the edits with each lattice, and as discrete edits where they are not already."""
    if all(isinstance(edit, Discrete) for edit in edits.active):
        return {"discrete": edits}
    stacks = {
        "continuous, exact" if nodes is None else f"continuous, lattice {nodes}": EditStack(
            edit.replace(lattice=nodes) if isinstance(edit, Continuous) else edit for edit in edits
        )
        for nodes in lattices
    }
    stacks["discrete"] = EditStack(as_move(edit) if isinstance(edit, Continuous) else edit for edit in edits)
    return stacks


def _row(name: str, seconds: NDArray[np.float64], unedited: NDArray[np.float64], rays: float) -> FrameTime:
    median = float(np.median(seconds))
    return FrameTime(
        variant=name,
        median_ms=1e3 * median,
        least_ms=1e3 * float(seconds.min()),
        ratio=float(np.median(seconds / unedited)),
        least_ratio=float(seconds.min() / unedited.min()),
        rays_per_second=rays / median,
    )


def _middle(scene: Scene) -> tuple[NDArray[np.float64], float]:
    """Middle of the content in world units, and the half size of the box that holds it.

    An unbounded scene's content is what its box of interest holds.
    """
    field = scene.field
    if isinstance(field, SplatField) or field.contracted or not len(field.vertices):
        return field.center, float(field.half_size.max())
    grid = np.stack(np.unravel_index(field.vertices, field.resolution), axis=1)
    lower, upper = field.bounds
    points = lower + grid / (np.array(field.resolution) - 1) * (upper - lower)
    box = np.stack([points.min(axis=0), points.max(axis=0)])
    return box.mean(axis=0), float((box[1] - box[0]).max() / 2)
