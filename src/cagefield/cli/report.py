"""Text report of a scene's contents and of the effects of its edits."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from cagefield.edits import Continuous, Copy, Delete, Discrete, Paste
from cagefield.edits.chains import application_order
from cagefield.edits.grade_nodes import dump_grade
from cagefield.edits.options import Clone
from cagefield.errors import EditError
from cagefield.fields.contraction import uncontract
from cagefield.fields.splat_field import SplatField
from cagefield.geometry import hexahedron_determinant
from cagefield.geometry.cage_checks import format_vector
from cagefield.geometry.control_points import ControlPoints
from cagefield.typing import Array
from cagefield.warps.continuous import ContinuousWarp

if TYPE_CHECKING:
    from cagefield.edits import Edit
    from cagefield.fields.voxel_field import VoxelField
    from cagefield.geometry.cage import Cage
    from cagefield.scene.scene import Scene


@dataclass(frozen=True)
class _Content:
    """Elements of a field (`noun`): positions [M,3], weights [M]; a length, in `lengths`."""

    noun: str
    positions: Array
    weights: NDArray[np.float32]
    length: float
    lengths: str

    @classmethod
    def from_field(cls, field: VoxelField | SplatField) -> _Content:
        if isinstance(field, SplatField):
            positions = field.means.astype(np.float64)
            return cls("splats", positions, field.opacities, field.sample_spacing, "splat widths")
        positions = _vertex_positions(field)
        return cls("voxels", positions, np.ones(len(positions), np.float32), field.sample_spacing, "voxels")

    def share(self, mask: NDArray[np.bool_]) -> float:
        """The share of the weight where the mask [M] is True."""
        total = float(self.weights.sum(dtype=np.float64))
        return float(self.weights[mask].sum(dtype=np.float64)) / total if total > 0.0 else 0.0


def describe_edits(scene: Scene) -> list[str]:
    """Per edit of a scene, in the order of the stack: a line with its kind, indented ones with its changes.

    The shares are of the field's stored voxels, or of its splats' opacities, inside the canonical inner cage
    and in the shell around it. An edit that cannot be evaluated says why.
    """
    content = _Content.from_field(scene.field)
    lines: list[str] = []
    for number, edit in enumerate(scene.edits):

        def resolved(number: int = number) -> Edit:
            return _with_detours(scene, number)

        details = _details(edit, content, resolved)
        lines += [f"{number + 1}. {_title(edit)}", *("   " + line for line in details)]
    return lines or ["no edits"]


def _with_detours(scene: Scene, number: int) -> Edit:
    """An edit of the scene, with the detours of connected control points. Raises `EditError` without any."""
    edits = scene.edits.edits
    points = edits[number].inner
    if not (isinstance(points, ControlPoints) and points.is_unprepared):
        return edits[number]
    order = application_order(edits)
    below = [edits[other].without_parent for other in order[: order.index(number)]]
    return scene.patcher.with_detours([*below, edits[number].without_parent])[-1]


def _title(edit: Edit) -> str:
    name = f'"{edit.name}": ' if edit.name else ""
    hidden = "" if edit.enabled else " (hidden)"
    if isinstance(edit, Delete):
        kind = "delete"
    elif isinstance(edit, Paste):
        kind = f"paste from {edit.source}"
    elif isinstance(edit, Continuous):
        nodes = edit.kernel_lattice
        how = "exact" if nodes is None else f"lattice of {nodes}^3 nodes"
        connected = isinstance(edit.inner, ControlPoints) and edit.inner.connected
        kind = f"continuous, {edit.shell.name} shell, {how}{', connected points' * connected}"
    else:
        kind = "discrete copy" if isinstance(edit, Copy) else "discrete move"
    carried = f', carried by "{edit.parent}"' if edit.parent else ""
    return f"{name}{kind}{_left_out(edit)}{carried}{hidden}"


def _left_out(edit: Edit) -> str:
    """Options by which a discrete edit leaves its surroundings unchanged, as text."""
    if not isinstance(edit, Discrete):
        return ""
    word = "clone" if isinstance(edit.fill, Clone) else edit.fill
    fill = f", fill: {word}" if word != "surroundings" and edit.uncovers else ""
    return fill + (", relight: none" if edit.relight == "none" else "")


def _details(edit: Edit, content: _Content, resolved: Callable[[], Edit]) -> Iterable[str]:
    inside = edit.inner.contains(content.positions)
    share = content.share(inside)
    if isinstance(edit, Delete):
        yield f"empties {share:.1%} of the field's {content.noun}"
        return
    for operation in edit.operations:
        yield f"{operation.noun} {operation}"
    if edit.is_graded:
        values = (f"{name} {value:g}" for name, value in dump_grade(edit.grading).items())
        yield f"grades {share:.1%} of the field's {content.noun}: {', '.join(values)}"
    if isinstance(edit, Paste):
        low, high = edit.deformed.aabb
        box = " x ".join(f"{edge:.4g}" for edge in high - low)
        yield f"shows what its cage holds there in {box} around {format_vector(0.5 * (low + high))}"
        return
    if not edit.changes_anything:
        yield "changes nothing: the inner cage is where it was"
        return
    if not edit.changes_geometry:
        return
    reach = np.linalg.norm(edit.deformed.handles - edit.inner.handles, axis=1).max()
    handles = "corners" if edit.inner.is_hexahedron else "points"
    growth = _volume(edit.deformed) / _volume(edit.inner)
    volume = f"; its volume becomes {growth:.3g} times what it was" if edit.inner.is_hexahedron else ""
    yield (
        f"{share:.1%} of the field's {content.noun} follow the cage, whose {handles} move by up to "
        f"{reach:.4g}{volume}"
    )
    try:
        edit = resolved()
        warp = edit.exact_warp
    except EditError as error:
        yield f"cannot be evaluated: {error}"
        return
    if isinstance(warp, ContinuousWarp):
        gives = content.share(warp.outer.contains(content.positions) & ~inside)
        ratio = warp.shell.least_ratio()
        state = "does not fold" if ratio > 0.0 else "folds, and is allowed to"
        yield f"{gives:.1%} of them give way; the shell {state} (least volume ratio {ratio:.3f})"
        if isinstance(edit, Continuous) and edit.kernel_lattice is not None:
            worst, mean = edit.lattice_error()
            mean, worst = mean / content.length, worst / content.length
            yield f"the lattice is off by {mean:.2g} {content.lengths} on average, {worst:.2g} at most"


def _volume(cage: Cage) -> float:
    """Volume of a hexahedron: the mean of the Bernstein coefficients of its Jacobian determinant."""
    return float(hexahedron_determinant.determinant_coefficients(cage.corners).mean())


def _vertex_positions(field: VoxelField) -> Array:
    """Canonical positions [M,3] of the field's stored vertices, world units."""
    grid = np.stack(np.unravel_index(field.vertices, field.resolution), axis=1)
    lower, upper = field.grid_bounds
    positions: Array = lower + grid / (np.array(field.resolution) - 1) * (upper - lower)
    return field.center + field.half_size * uncontract(positions) if field.contracted else positions
