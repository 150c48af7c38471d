"""Baking of any field into a VoxelField, for editing at interactive speed.

Densities are the field's at the vertices; signed ones, negative in empty space, where the field has
`signed_density`: a voxel field clamps after the interpolation and so preserves surfaces between vertices. A
vertex is stored where the field absorbs at least `opacity` over a voxel's edge at the vertex or at a
neighbor; a first pass on every other vertex finds candidates. Colors are fitted to the field's colors along
several directions: with C the colors and Y_k the basis along direction k,

    sh = argmin_x sum_k w_k |0.5 + Y_k x - C_k|^2 + ridge |x without its constant|^2

w_k is 1 for directions that meet the front of the density's surface (against its gradient) and
BACK_FACE_WEIGHT for directions that meet its back, which no camera sees.

Splats are finer than voxels: each is first convolved with a Gaussian of FILTER_SIGMA_EDGES voxel edges, and
becomes less opaque in proportion to the area that it then covers. A splat around a camera is left out: an
image of splats draws it at its mean, an image of voxels as a veil over everything. Densities of splats are
means over directions (`SplatField.grid_sigma`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cagefield.errors import FieldError
from cagefield.fields import sh as spherical_harmonics
from cagefield.fields.contraction import contract, uncontract
from cagefield.fields.protocol import Field
from cagefield.fields.splat_field import SplatField
from cagefield.fields.voxel_field import VoxelField
from cagefield.geometry.quaternions import rotation_matrices
from cagefield.typing import AnyArray, Float32

BACK_FACE_WEIGHT = 0.02
"""Weight of a direction that meets a vertex from behind its own surface."""

RIDGE_WEIGHT = 2e-3
"""Weight of the coefficients' size against a residual's, per direction."""

FILTER_SIGMA_EDGES = 0.35
"""Standard deviation of the splats' filter, in voxel edges; samples across a layer sum up within 18 %.

.25 renders a capture of many layers .2 dB better, but leaves gaps in single layers; .4 loses another .2 dB.
"""

BLOCK_VERTICES = 1 << 16
"""Number of vertices evaluated at a time."""

_COARSE_STRIDE = 2
"""Stride of the first pass's vertices along each axis."""


def bake(
    field: Field,
    resolution: int = 256,
    *,
    bounds: ArrayLike | None = None,
    sh_degree: int = 2,
    eyes: ArrayLike | None = None,
    views: int = 16,
    opacity: float = 2e-3,
    contracted: bool = False,
    visible: Callable[[Float32], NDArray[np.bool_]] | None = None,
    seed: int = 0,
    on_progress: Callable[[float], None] | None = None,
) -> VoxelField:
    """VoxelField with `resolution` vertices along the longest axis of the field's content.

    - bounds: [2,3] box to search for content; None takes the field's own.
    - eyes: [E,3] camera positions, world units: colors are fitted along directions from them; None takes
      directions all around the sphere.
    - views: number of directions per vertex.
    - opacity: vertices whose voxel absorbs less are empty.
    - contracted: bake all of space, with `bounds` as the box of interest.
    - visible: function of positions [N,3] that returns the mask [N] of positions to bake; None bakes all.

    Raises:
        FieldError: options out of range, infinite bounds, or a field that is empty within them.
    """
    if not 16 <= resolution <= 1024:
        raise FieldError(f"resolution is {resolution}; it must be from 16 to 1024")
    if not 0 <= sh_degree <= 2:
        raise FieldError(f"sh_degree is {sh_degree}; it must be from 0 to 2")
    if not 1 <= views <= 256 or not 0.0 < opacity < 1.0:
        raise FieldError(f"views must be 1 to 256 and opacity in (0, 1), got {views} and {opacity}")
    box = np.array(getattr(field, "bounds", None) if bounds is None else bounds, np.float64)
    if box.shape != (2, 3) or not np.isfinite(box).all() or not (box[0] < box[1]).all():
        raise FieldError(f"bounds must be a finite box [2,3] to bake in, got {box.tolist()}; give bounds=")
    report = on_progress or (lambda done: None)

    eye_positions = None if eyes is None else np.asarray(eyes, np.float64).reshape(-1, 3)
    if isinstance(field, SplatField) and eye_positions is not None:
        field = field.take(~enclosing_mask(field, eye_positions))
    density = _Density(field, None if eye_positions is None else eye_positions.mean(axis=0))
    if contracted:
        grid = _Grid.contracting(box, resolution)
    else:
        box = _content_box(density, box, opacity, lambda done: report(0.1 * done))
        grid = _Grid.within(box, resolution)
    density = density.for_grid(grid)
    min_density = -np.log1p(-opacity) / grid.edge
    candidates = _candidates(density, grid, min_density, visible, lambda done: report(0.1 + 0.2 * done))
    sigma = np.zeros(grid.shape, np.float32)
    for rows in _blocks(grid.shape[0], 8):
        part = np.argwhere(candidates[rows])
        part[:, 0] += rows.start
        sigma[rows][candidates[rows]] = density(grid.positions(part))
    del candidates
    report(0.4)
    stored = dilate_mask(sigma > min_density)
    if not stored.any():
        raise _empty(box)
    vertices = np.argwhere(stored)
    coefficients = np.zeros((len(vertices), (sh_degree + 1) ** 2, 3), np.float32)
    rng = np.random.default_rng(seed)
    for rows in _blocks(len(vertices), max(1, 4 * BLOCK_VERTICES // views)):
        points = grid.positions(vertices[rows])
        directions = _directions(points, eye_positions, views, rng)
        front = _gradient(sigma, vertices[rows])
        coefficients[rows] = _fit_harmonics(
            _evaluate_colors(density.field, points, directions), directions, front, sh_degree
        )
        report(0.4 + 0.6 * rows.stop / len(vertices))
    nx, ny, nz = grid.shape
    return VoxelField(
        bounds=box if contracted else grid.bounds,
        resolution=(nx, ny, nz),
        vertices=np.asarray(np.ravel_multi_index(tuple(vertices.T), grid.shape), np.int64),
        density=sigma[stored],
        sh=coefficients,
        contracted=contracted,
    )


class _Grid:
    """Grid of cubic voxels over a box, which may be enlarged at its upper side.

    `edge` is in world units, inside the box of interest for contracted grids.
    """

    def __init__(
        self, lower: AnyArray, edge: float, shape: tuple[int, ...], interest: AnyArray | None = None
    ) -> None:
        self.lower, self.edge, self.shape, self.interest = lower, edge, shape, interest

    @classmethod
    def within(cls, box: AnyArray, resolution: int) -> _Grid:
        size = box[1] - box[0]
        edge = float(size.max()) / (resolution - 1)
        return cls(box[0], edge, tuple(max(2, int(np.ceil(s / edge - 1e-6)) + 1) for s in size))

    @classmethod
    def contracting(cls, interest: AnyArray, resolution: int) -> _Grid:
        """Grid of all of space, contracted around the box of interest."""
        edge = 2.0 * float((interest[1] - interest[0]).max()) / (resolution - 1)
        return cls(np.full(3, -2.0), edge, (resolution,) * 3, interest)

    @property
    def bounds(self) -> AnyArray:
        return np.stack([self.lower, self.lower + (np.array(self.shape) - 1) * self.edge])

    def steps_at(self, positions: AnyArray) -> AnyArray:
        """World displacements [N,3,3] (columns) of one grid step along each axis, at positions [N,3].

        With c contracted, M = max|c| > 1 on axis k, uncontract(c) = c / (M (2 - M)) has the derivative
        I / (M (2 - M)) + c e_k^T sign(c_k) (2 M - 2) / (M (2 - M))^2.
        """
        if self.interest is None:
            return np.broadcast_to(self.edge * np.eye(3), (len(positions), 3, 3))
        middle, half = self.interest.mean(axis=0), 0.5 * (self.interest[1] - self.interest[0])
        c = contract((positions - middle) / half)
        axis = np.abs(c).argmax(axis=1)
        largest = np.take_along_axis(c, axis[:, None], axis=1)[:, 0]
        M = np.clip(np.abs(largest), 1.0, 2.0 - 1e-6)
        room = M * (2.0 - M)
        J = np.eye(3) / room[:, None, None]
        slope = np.sign(largest) * (2.0 * M - 2.0) / room**2
        J[np.arange(len(c)), :, axis] += c * slope[:, None]
        return half[:, None] * J * (4.0 / (np.array(self.shape) - 1))

    def positions(self, vertices: AnyArray) -> Float32:
        if self.interest is None:
            return (self.lower + vertices * self.edge).astype(np.float32)
        cube = -2.0 + 4.0 * vertices / (np.array(self.shape) - 1)
        middle, half = self.interest.mean(axis=0), 0.5 * (self.interest[1] - self.interest[0])
        return (middle + half * uncontract(cube)).astype(np.float32)


def dilate_mask(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Mask dilated by the 26 neighbors of each vertex."""
    for axis in range(3):
        ahead, behind = np.zeros_like(mask), np.zeros_like(mask)
        front = [slice(None)] * 3
        back = [slice(None)] * 3
        front[axis], back[axis] = slice(1, None), slice(None, -1)
        ahead[tuple(front)] = mask[tuple(back)]
        behind[tuple(back)] = mask[tuple(front)]
        mask = mask | ahead | behind
    return mask


def _empty(box: AnyArray) -> FieldError:
    return FieldError(
        f"the field is empty in {box.tolist()}: nothing to bake; train it further or give other bounds"
    )


def _content_box(
    density: _Density, box: AnyArray, opacity: float, report: Callable[[float], None]
) -> AnyArray:
    """Box [2,3] of the density within `box`, from 96 vertices along its longest axis, enlarged by one."""
    grid = _Grid.within(box, 96)
    density = density.for_grid(grid)
    sigma = np.concatenate(
        [density(grid.positions(_plane(grid.shape, index))) for index in _report_each(grid.shape[0], report)]
    ).reshape(grid.shape)
    found = np.argwhere(sigma > -np.log1p(-opacity) / grid.edge)
    if len(found) == 0:
        raise _empty(box)
    lower = grid.lower + (found.min(axis=0) - 1) * grid.edge
    upper = grid.lower + (found.max(axis=0) + 1) * grid.edge
    return np.stack([np.maximum(lower, box[0]), np.minimum(upper, box[1])])


def _candidates(
    density: _Density,
    grid: _Grid,
    min_density: float,
    visible: Callable[[Float32], NDArray[np.bool_]] | None,
    report: Callable[[float], None],
) -> NDArray[np.bool_]:
    """Mask of grid vertices around every `_COARSE_STRIDE`-th vertex with density that is visible."""
    shape = tuple(-(-n // _COARSE_STRIDE) for n in grid.shape)
    occupied = np.zeros(shape, bool)
    for index in _report_each(shape[0], report):
        positions = grid.positions(_COARSE_STRIDE * _plane(shape, index))
        is_visible = np.ones(len(positions), bool) if visible is None else visible(positions)
        holds = np.zeros(len(positions), bool)
        holds[is_visible] = density(positions[is_visible]) > 0.5 * min_density
        occupied[index] = holds.reshape(shape[1:])
    fine = dilate_mask(occupied)
    for axis in range(3):
        fine = np.repeat(fine, _COARSE_STRIDE, axis=axis)
    found: NDArray[np.bool_] = fine[tuple(slice(n) for n in grid.shape)]
    return found


class _Density:
    """Density [N] at positions [N,3], viewed from the mean camera position, else along -z."""

    def __init__(self, field: Field, eye: AnyArray | None) -> None:
        self.field, self.eye = field, eye
        self.signed = getattr(field, "signed_density", None)

    def for_grid(self, grid: _Grid) -> _Density:
        """Density for a grid: splats filtered by the grid's voxel size."""
        if not isinstance(self.field, SplatField):
            return self
        return _Density(
            widen_splats(self.field, FILTER_SIGMA_EDGES * grid.steps_at(self.field.means)), self.eye
        )

    def __call__(self, positions: Float32) -> Float32:
        if isinstance(self.field, SplatField):
            return self.field.grid_sigma(positions)
        sigma = np.empty(len(positions), np.float32)
        for rows in _blocks(len(positions), BLOCK_VERTICES):
            part = positions[rows]
            toward = np.broadcast_to(np.array([0.0, 0.0, -1.0], np.float32), part.shape)
            if self.eye is not None:
                away = (part - self.eye).astype(np.float32)
                toward = away / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-12)
            sigma[rows] = self.field(part, toward)[0] if self.signed is None else self.signed(part, toward)
        return sigma


def enclosing_mask(field: SplatField, eyes: AnyArray) -> NDArray[np.bool_]:
    """Mask [N] of splats with one of the eyes [E,3] within 2 standard deviations."""
    axes = (
        rotation_matrices(field.quaternions.astype(np.float64))
        / np.exp(field.log_scales.astype(np.float64))[:, None]
    )
    found = np.zeros(len(field), bool)
    for eye in eyes:
        found |= (np.einsum("nij,ni->nj", axes, eye - field.means) ** 2).sum(axis=1) < 4.0
    return found


def widen_splats(field: SplatField, widths: AnyArray) -> SplatField:
    """Splats convolved with Gaussians of covariances W W^T, `widths` W [N,3,3] in world units.

    Opacities decrease as the area across each splat's thinnest axis grows.
    """
    from scipy.spatial.transform import Rotation

    scales = np.exp(field.log_scales.astype(np.float64))
    axes = rotation_matrices(field.quaternions.astype(np.float64))
    covariances = np.einsum("nij,nj,nkj->nik", axes, scales**2, axes) + widths @ widths.transpose(0, 2, 1)
    variances, turned = np.linalg.eigh(covariances)
    turned[:, :, 0] *= np.sign(np.linalg.det(turned))[:, None]
    thinnest = axes[np.arange(len(scales)), :, scales.argmin(axis=1)]
    # The projected area of a Gaussian along a unit u is proportional to sqrt(det C u^T C^-1 u).
    squared_cosines = np.einsum("ni,nij->nj", thinnest, turned) ** 2
    covered = np.sqrt(variances.prod(axis=1) * (squared_cosines / variances).sum(axis=1))
    area = np.sort(scales, axis=1)[:, 1:].prod(axis=1)
    return replace(
        field,
        log_scales=0.5 * np.log(variances),
        quaternions=np.roll(Rotation.from_matrix(turned).as_quat(), 1, axis=1),
        opacities=field.opacities * np.minimum(area / covered, 1.0),
    )


def _gradient(sigma: Float32, vertices: AnyArray) -> Float32:
    """Central differences [M,3] of a grid at vertices [M,3]; one-sided at the boundary."""
    last = np.array(sigma.shape) - 1
    slopes = np.empty((len(vertices), 3), np.float32)
    for axis in range(3):
        step = np.eye(3, dtype=np.int64)[axis]
        ahead, behind = np.minimum(vertices + step, last), np.maximum(vertices - step, 0)
        difference = sigma[tuple(ahead.T)] - sigma[tuple(behind.T)]
        slopes[:, axis] = difference / np.maximum(ahead[:, axis] - behind[:, axis], 1)
    return slopes


def _evaluate_colors(field: Field, positions: Float32, directions: Float32) -> Float32:
    """rgb [N,K,3] at positions [N,3] along directions [N,K,3]."""
    evaluate_directions = getattr(field, "evaluate_directions", None)
    if evaluate_directions is not None:
        return np.asarray(evaluate_directions(positions, directions)[1], np.float32)
    n, views, _ = directions.shape
    return field(np.repeat(positions, views, axis=0), directions.reshape(-1, 3))[1].reshape(n, views, 3)


def _directions(points: Float32, eyes: AnyArray | None, views: int, rng: np.random.Generator) -> Float32:
    """Unit directions [N,K,3] into the scene, from the eyes or all around."""
    away = np.asarray(rng.normal(size=(len(points), views, 3)))
    if eyes is not None:
        away = np.asarray(points[:, None] - eyes[rng.integers(0, len(eyes), (len(points), views))])
    return (away / np.linalg.norm(away, axis=-1, keepdims=True)).astype(np.float32)


def _fit_harmonics(colors: Float32, directions: Float32, gradient: Float32, degree: int) -> Float32:
    """Coefficients [N,(degree+1)^2,3] of colors [N,K,3] along directions [N,K,3]."""
    n, views, _ = directions.shape
    basis = spherical_harmonics.sh_basis(directions.reshape(-1, 3), degree).reshape(n, views, -1)
    weight = np.where(np.einsum("nkc,nc->nk", directions, gradient) >= 0.0, 1.0, BACK_FACE_WEIGHT).astype(
        np.float32
    )
    weighted = basis * weight[..., None]
    ridge = np.full(basis.shape[2], RIDGE_WEIGHT * views, np.float32)
    ridge[0] = 1e-6
    normal = np.einsum("nki,nkj->nij", weighted, basis) + np.diag(ridge)
    right = np.einsum("nki,nkc->nic", weighted, colors - 0.5)
    return np.linalg.solve(normal, right).astype(np.float32)


def _blocks(count: int, size: int) -> Iterator[slice]:
    for start in range(0, count, size):
        yield slice(start, min(start + size, count))


def _plane(shape: tuple[int, ...], index: int) -> AnyArray:
    """Vertices [M,3] of plane `index` along the first axis."""
    j, k = np.meshgrid(np.arange(shape[1]), np.arange(shape[2]), indexing="ij")
    return np.stack([np.full(j.size, index), j.ravel(), k.ravel()], axis=1)


def _report_each(count: int, report: Callable[[float], None]) -> Iterator[int]:
    for index in range(count):
        yield index
        report((index + 1) / count)
