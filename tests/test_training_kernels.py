"""The trainer's kernels against finite differences of their own forward march and against NumPy."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from cagefield.cameras.camera import Camera
from cagefield.compute import devices
from cagefield.compute.block_cyclic import block_cyclic_schedule
from cagefield.compute.devices import floats
from cagefield.datasets.views import View

devices.start()

from cagefield.compute.device_buffers import to_device  # noqa: E402
from cagefield.rendering.voxels.kernels.grid import ivec3  # noqa: E402
from cagefield.training.voxels.grid_state import GridState, cell_sizes  # noqa: E402
from cagefield.training.voxels.kernels.accumulators import HEADER_FLOATS  # noqa: E402
from cagefield.training.voxels.kernels.gauss_newton_voxels import (  # noqa: E402
    RecordArgs,
    StepArgs,
    gauss_newton,
    laplacian,
    reduce_workers,
)
from cagefield.training.voxels.kernels.ray_batches import PatchArgs  # noqa: E402
from cagefield.training.voxels.kernels.sample_lists import (  # noqa: E402
    NOTE_FLOATS,
    SampleListArgs,
    gather_samples,
)
from cagefield.training.voxels.kernels.training_march import (  # noqa: E402
    MAX_SAMPLES,
    SAMPLE_FLOATS,
    BatchArgs,
    LossArgs,
    WorkerArgs,
    march_batch,
)
from cagefield.training.voxels.ray_batches import DevicePhotos  # noqa: E402
from tiers import nightly_except  # noqa: E402

SIZE = 8
N = 9


class FakeView(View):
    """A view whose photo is random noise, partly transparent."""

    def load(self) -> np.ndarray:
        rng = np.random.default_rng(len(self.name))
        return rng.integers(0, 256, (SIZE, SIZE, 4), dtype=np.uint8)


def photos(tmp_path) -> DevicePhotos:
    eyes = [(3.0, 0.4, 0.7), (-0.5, 2.8, 1.1), (0.3, -1.2, 2.9)]
    views = []
    for i, eye in enumerate(eyes):
        camera = Camera.look_at(eye, (0, 0, 0), width=SIZE, height=SIZE, fov_x=0.7)
        views.append(FakeView("v" * (i + 1), camera, tmp_path / "none.png"))
    return DevicePhotos.load(views)


def state(degree: int, contracted: bool, workers: int = 2) -> GridState:
    rng = np.random.default_rng(3)
    bounds = np.array([[-0.8] * 3, [0.8] * 3])
    vertices = np.sort(rng.choice(N**3, int(0.8 * N**3), replace=False))
    cell = cell_sizes(bounds, (N,) * 3, vertices, contracted)
    # Optical depth about 0.3 a voxel: rays see several voxels, none is hidden altogether.
    density = (rng.uniform(0.05, 0.5, len(vertices)) / cell).astype(np.float32)
    sh = rng.normal(0, 0.08, (len(vertices), (degree + 1) ** 2, 3)).astype(np.float32)
    return GridState.build(bounds, (N,) * 3, vertices, density, sh, contracted=contracted, threads=workers)


def no_lists() -> SampleListArgs:
    """Lists of samples without room."""
    number, note = (to_device(np.zeros(1, kind)) for kind in (np.int32, np.float32))
    return SampleListArgs(number, number, note, number, 0)


def march(grid: GridState, data: DevicePhotos, gains: np.ndarray, distortion: float = 0.0) -> np.ndarray:
    """Runs one batch of all pixels; returns the losses of the rays."""
    return marched(grid, data, gains, distortion)[0]


def marched(
    grid: GridState,
    data: DevicePhotos,
    gains: np.ndarray,
    distortion: float = 0.0,
    lists: SampleListArgs | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Runs one batch of all pixels; returns the losses [R] and the squared colors [R,3] of the rays.

    With lists of samples as on a GPU.
    """
    patches = data.patches(4)
    rays = len(patches) * 16
    losses, sums = to_device(np.zeros(rays, np.float32)), to_device(np.zeros(6 * rays, np.float32))
    penalties = to_device(np.zeros(rays, np.float32))
    scratch = to_device(np.zeros(grid.workers * MAX_SAMPLES * SAMPLE_FLOATS, np.float32))
    grid.accumulator.fill(0.0)
    step = 0.7 if grid.contracted else 0.7 / float(np.max(grid.args.scale))
    march_batch(
        block_cyclic_schedule(grid.workers, 1),
        PatchArgs(to_device(patches), len(patches), 4),
        data.args(to_device(gains.astype(np.float32))),
        grid.args,
        grid.bricks,
        WorkerArgs(
            grid.accumulator, grid.met, grid.record, grid.groups, grid.group_bits, scratch, grid.workers
        ),
        LossArgs(losses, penalties, sums),
        BatchArgs(step, 0.05, distortion, 0.8, 7, 1, floats((1.0, 1.0, 1.0))),
        no_lists() if lists is None else lists,
        grid.terms,
        grid.contracted,
        lists is not None,
    )
    if lists is not None:
        gather_samples(
            lists,
            grid.accumulator,
            grid.met,
            grid.vertex_at,
            grid.slots,
            grid.group_bits,
            ivec3(*grid.resolution),
            grid.terms,
        )
    squares = sums.to_numpy().astype(np.float64).reshape(rays, 6)[:, 3:]
    return 0.5 * losses.to_numpy().astype(np.float64) + penalties.to_numpy(), squares


@pytest.mark.parametrize(
    ("contracted", "room"),
    nightly_except(product([False, True], [0, 100, 100_000]), (True, 100_000)),
)
def test_samples_by_cell_add_up_as_those_of_workers(tmp_path, contracted, room):
    """Without room for samples, with room for some, and for all."""
    data, grid = photos(tmp_path), state(2, contracted, workers=1)
    gains = np.ones((3, 3))
    march(grid, data, gains, 0.5)
    expected = grid.accumulator.to_numpy()
    heads, links, count = (to_device(np.zeros(n, np.int32)) for n in (N**3, max(room, 1), 1))
    notes = to_device(np.zeros(max(room, 1) * NOTE_FLOATS, np.float32))
    lists = SampleListArgs(heads, links, notes, count, room)
    for _ in range(2):  # the first batch leaves the lists empty
        marched(grid, data, gains, 0.5, lists)
        found = grid.accumulator.to_numpy()
        np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-5 * np.abs(expected).max())
        assert not heads.to_numpy().any() and not count.to_numpy().any()
    assert room in (0, 100) or np.count_nonzero(links.to_numpy()) > 100


@pytest.mark.parametrize(
    ("degree", "contracted"),
    nightly_except(product([0, 1, 2], [False, True]), (0, True), (1, False), (2, True)),
)
def test_gradients_match_finite_differences(tmp_path, degree, contracted):
    data, grid = photos(tmp_path), state(degree, contracted)
    gains = np.array([[1.0, 1.1, 0.9], [0.95, 1.0, 1.2], [1.0, 1.0, 1.0]])
    march(grid, data, gains, 0.5)
    stride = HEADER_FLOATS + 3 * grid.terms
    records = grid.accumulator.to_numpy().reshape(grid.workers, grid.slots, stride).sum(axis=0)
    rng = np.random.default_rng(0)
    seen = np.flatnonzero(records[:, 2] > 1e-3)
    checked = {"density": grid.density.to_numpy(), "sh": grid.sh.to_numpy()}
    for name, column in (("density", 0), ("sh", HEADER_FLOATS)):
        values = checked[name]
        array = getattr(grid, name)
        errors, sizes = [], []
        for slot in rng.choice(seen, 12, replace=False):
            at, gradient = slot, records[slot, column]
            if name == "sh":
                term = rng.integers(3 * grid.terms)
                at, gradient = slot * 3 * grid.terms + term, records[slot, HEADER_FLOATS + term]
            # Float32 sums of some hundred squared errors carry about 1e-6; the step keeps truncation and
            # rounding both near 1e-3 of a typical gradient.
            h = 0.02 / grid.cell.to_numpy()[slot] if name == "density" else 0.02
            up, down = values.copy(), values.copy()
            up[at] += h
            down[at] -= h
            array.from_numpy(up)
            plus = march(grid, data, gains, 0.5)
            array.from_numpy(down)
            minus = march(grid, data, gains, 0.5)
            array.from_numpy(values)
            difference = (plus - minus).sum() / (2 * h)
            errors.append(difference - gradient)
            sizes.append(difference)
        # Samples of weight under 1e-4 and rays past T = 1e-3 are left out of both; what moves across those
        # thresholds, and colors that start to clip, stay under 2 percent.
        assert np.linalg.norm(errors) < 0.02 * np.linalg.norm(sizes), name


@pytest.mark.parametrize("name", ["density", "sh"])
def test_curvatures_bound_how_all_voxels_together_change_the_pictures(tmp_path, name):
    """sum |C(x + e v) - C(x - e v)|^2 / (2 e)^2 is at most sum_k D_k v_k^2, however the voxels move.

    J_k J_k alone, summed, is below it where many voxels of a ray move the same way.
    """
    data, grid = photos(tmp_path), state(0, False)
    march(grid, data, np.ones((3, 3)))
    records = grid.accumulator.to_numpy().reshape(grid.workers, grid.slots, -1).sum(axis=0).astype(float)
    assert (records[:, 1:3] >= 0).all()
    assert records[0].max() == 0.0  # the empty slot gets nothing
    # A color of degree 0 is Y_0 c: its curvature is that of Y_0 c.
    bounds = records[:, 1] if name == "density" else records[:, 2] * 0.28209479**2
    array, cell = getattr(grid, name), float(grid.cell.to_numpy()[1])
    values = array.to_numpy()
    rng = np.random.default_rng(1)
    ratios = []
    for direction in (np.ones(grid.slots), rng.choice([-1.0, 1.0], grid.slots), rng.normal(size=grid.slots)):
        direction[0] = 0.0  # the empty slot stays empty
        e = 0.01 / cell if name == "density" else 0.01
        # One channel of the colors; the density moves all three.
        move = direction if name == "density" else np.outer(direction, [1.0, 0.0, 0.0]).ravel()
        pictures = []
        for sign in (1, -1):
            array.from_numpy((values + sign * e * move).astype(np.float32))
            pictures.append(np.sqrt(marched(grid, data, np.ones((3, 3)))[1]))
        array.from_numpy(values)
        change = (((pictures[0] - pictures[1]) / (2 * e)) ** 2).sum()
        ratios.append(change / (bounds * direction**2).sum())
    # 1 % for the differences' own error.
    assert max(ratios) < 1.01
    # Not far too large either: where all colors move alike, only vertices that are not stored are missing.
    if name == "sh":
        assert ratios[0] > 0.6


def test_workers_only_split_the_sum(tmp_path):
    data = photos(tmp_path)
    sums = []
    for workers in (1, 3):
        grid = state(1, False, workers)
        march(grid, data, np.ones((3, 3)))
        sums.append(grid.accumulator.to_numpy().reshape(workers, grid.slots, -1))
    # Column 3 is a maximum, the others are sums; only their order differs.
    for column, merge in ((slice(0, 3), np.sum), (slice(HEADER_FLOATS, None), np.sum), (3, np.max)):
        np.testing.assert_allclose(
            merge(sums[0][..., column], axis=0), merge(sums[1][..., column], axis=0), rtol=2e-4, atol=1e-5
        )


@pytest.mark.parametrize("listed", [False, True])
def test_flags_mark_the_slots_of_a_batch_and_few_others(tmp_path, listed):
    """A narrow picture: most of the grid is met by no ray."""
    camera = Camera.look_at((2.0, 0.3, 0.4), (0, 0.2, 0.1), width=SIZE, height=SIZE, fov_x=0.03)
    data = DevicePhotos.load([FakeView("v", camera, tmp_path / "none.png")])
    grid = state(0, False, workers=1 if listed else 2)
    lists = None
    if listed:
        heads, links, count = (to_device(np.zeros(n, np.int32)) for n in (N**3, 1000, 1))
        lists = SampleListArgs(heads, links, to_device(np.zeros(1000 * NOTE_FLOATS, np.float32)), count, 1000)
    marched(grid, data, np.ones((1, 3)), lists=lists)
    records = grid.accumulator.to_numpy().reshape(grid.workers, grid.slots, -1)
    flags = grid.met.to_numpy().reshape(grid.workers, -1)
    group = 1 << grid.group_bits
    marked = np.repeat(flags > 0, group, axis=1)[:, : grid.slots]
    with_record = records[..., 2] > 0
    assert with_record.any()
    assert marked[with_record].all()
    # Samples on faces of cells have corners of weight 0.
    assert marked.sum() <= group * (with_record.sum() + 4)
    assert marked.sum() < 0.5 * marked.size


def reduced(grid: GridState) -> None:
    """Adds the accumulators of all workers up in the first one's."""
    reduce_workers(
        grid.accumulator,
        grid.met,
        grid.record,
        grid.workers,
        grid.slots,
        grid.group_bits,
        grid.terms,
    )


def smoothed(grid: GridState) -> None:
    """Adds the Laplacian's gradient to the first worker's accumulator."""
    laplacian(
        grid.density,
        grid.sh,
        grid.index,
        grid.vertex_at,
        grid.cell,
        RecordArgs(grid.accumulator, grid.met, grid.slots, grid.group_bits),
        ivec3(N, N, N),
        0.3,
        0.2,
        grid.terms,
    )


def stepped(grid: GridState) -> None:
    """Takes a Gauss-Newton step."""
    gauss_newton(
        grid.density,
        grid.sh,
        grid.state,
        grid.weight,
        grid.cell,
        RecordArgs(grid.accumulator, grid.met, grid.slots, grid.group_bits),
        StepArgs(0.9, 0.5, 0.25, 0.3, 0.01, 0.05),
        grid.terms,
    )


def test_a_batch_changes_the_grid_alike_for_any_number_of_workers(tmp_path):
    data = photos(tmp_path)
    results = []
    for workers in (1, 2, 5):
        grid = state(1, False, workers)
        march(grid, data, np.ones((3, 3)))
        reduced(grid)
        smoothed(grid)
        stepped(grid)
        assert not grid.accumulator.to_numpy().any()
        assert not grid.met.to_numpy().any()
        results.append(grid.arrays())
    for other in results[1:]:
        for values, expected in zip(other, results[0], strict=True):
            np.testing.assert_allclose(values, expected, rtol=1e-3, atol=1e-4)


def test_gauss_newton_step_is_gradient_over_damped_curvature(tmp_path):
    data, grid = photos(tmp_path), state(1, False)
    march(grid, data, np.ones((3, 3)))
    records = grid.accumulator.to_numpy().reshape(grid.workers, grid.slots, -1).sum(axis=0).astype(np.float64)
    reduced(grid)
    before_density, before_sh, _, _ = grid.arrays()
    h = grid.cell.to_numpy()[1:].astype(np.float64)
    stepped(grid)
    density, sh, running, weight = grid.arrays()
    r = records[1:]
    touched = r[:, 2] > 0
    change = np.clip(0.5 * r[:, 0] / (r[:, 1] + 0.01 * h**2), -0.3 / h, 0.3 / h) * touched
    np.testing.assert_allclose(density, before_density - change, rtol=1e-4, atol=1e-5)
    slope = r[:, HEADER_FLOATS:].reshape(before_sh.shape)
    slope[:, 1:] += 0.05 * r[:, 2, None, None] * before_sh[:, 1:]
    expected = before_sh - 0.25 * slope / (r[:, 2, None, None] + 0.01) * touched[:, None, None]
    np.testing.assert_allclose(sh, expected, rtol=1e-4, atol=1e-5)
    np.testing.assert_allclose(running, r[:, 1:3], rtol=1e-5)
    assert weight.max() > 0
    assert not grid.accumulator.to_numpy().any()


def test_laplacian_is_the_gradient_of_neighbor_differences(tmp_path):
    data, grid = photos(tmp_path), state(1, False)
    march(grid, data, np.ones((3, 3)))
    reduced(grid)
    before = grid.accumulator.to_numpy().reshape(grid.workers, grid.slots, -1).copy()
    smoothed(grid)
    after = grid.accumulator.to_numpy().reshape(grid.workers, grid.slots, -1)
    added = (after - before)[0, 1:]
    density, sh, _, _ = grid.arrays()
    full = np.full(N**3, np.nan)
    full[grid.vertices] = density
    full = full.reshape(N, N, N)
    h = float(grid.cell.to_numpy()[1])
    for slot in range(0, len(density), 37):
        x, y, z = np.unravel_index(grid.vertices[slot], (N, N, N))
        near = []
        for a in range(3):
            for s in (-1, 1):
                q = [x, y, z]
                q[a] += s
                if 0 <= q[a] < N and np.isfinite(full[tuple(q)]):
                    near.append(full[tuple(q)])
        touched = before[0, slot + 1, 2] > 0
        expected = 0.3 * h * h * (len(near) * density[slot] - sum(near)) * touched
        assert added[slot, 0] == pytest.approx(expected, rel=1e-3, abs=1e-5)
        assert added[slot, 2] == pytest.approx(0.2 * len(near) * touched, rel=1e-3, abs=1e-4)
    assert sh.shape[1] == 4
