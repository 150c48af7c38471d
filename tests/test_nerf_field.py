"""NerfField: shapes and errors, NDC, hierarchical sampling, exact pictures through edits."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from cagefield.cameras.camera import Camera, turntable
from cagefield.edits import Edit, EditStack, Trilinear
from cagefield.errors import FieldError
from cagefield.fields.mlp import Linear, Mlp
from cagefield.fields.nerf_field import NerfField
from cagefield.fields.protocol import Field
from cagefield.geometry import MeshCage
from cagefield.geometry.cage import Cage
from nerf_networks import affine, gamma, hidden_of, relu, small_field, small_mlp


def test_a_nerf_is_a_field_and_needs_no_torch_until_it_is_evaluated() -> None:
    code = """
import sys, numpy as np
sys.modules["torch"] = None
from nerf_networks import small_field
field = small_field()
try:
    field(np.zeros((1, 3)), np.ones((1, 3)))
except ValueError as error:
    print(error)
"""
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        cwd=__file__.rpartition("/")[0],
        check=True,
    )
    assert done.stdout == ("this NeRF needs PyTorch, which is not installed; pip install 'cagefield[nerf]'\n")
    assert isinstance(small_field(), Field)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"near": 3.0, "far": 2.0}, "near and far must satisfy 0 <= near < far, got 3.0 and 2.0"),
        ({"near": 0.0, "lindisp": True}, "near must be above 0 where samples are even in 1/depth"),
        ({"samples": (2, 8)}, r"samples must be \(coarse from 3, fine from 0\)"),
        ({"ndc": (0.0, 1.0)}, "ndc must be two ratios"),
        ({"ndc": (0.6, 0.5), "bounded": True}, "reaches to infinity; leave out bounded"),
    ],
)
def test_impossible_sampling_is_refused(options, message) -> None:
    with pytest.raises(FieldError, match=message):
        small_field(**options)


def test_impossible_bounds_are_refused() -> None:
    with pytest.raises(FieldError, match=r"bounds must be 2 finite corners"):
        NerfField(small_mlp(), None, [[0, 0, 0], [1, 1, 0]])


def test_networks_that_do_not_fit_together_are_refused() -> None:
    good = small_mlp()
    with pytest.raises(FieldError, match="a network must have a layer in its trunk"):
        Mlp((), good.density, good.rgb)
    with pytest.raises(FieldError, match="needs both a feature layer and view layers"):
        Mlp(good.trunk, good.density, good.rgb, good.feature)
    wide = Linear(np.zeros((8, 16 + 10)), np.zeros(8), "view.0")
    with pytest.raises(FieldError, match=r"view.0.weight is \[8, 26\]: 10 of its inputs"):
        Mlp(good.trunk, good.density, good.rgb, good.feature, (wide,))


torch = pytest.importorskip("torch", reason="PyTorch is not installed (extra nerf)")

from cagefield.fields.nerf_torch import TorchNerf, to_ndc  # noqa: E402
from cagefield.rendering.nerf.nerf_renderer import NerfRenderer, Rays, march, sample_pdf, trace  # noqa: E402
from cagefield.rendering.nerf.torch_edit_map import TensorMap  # noqa: E402


def directions(count: int, seed: int = 0) -> np.ndarray:
    d = np.random.default_rng(seed).normal(size=(count, 3))
    return (d / np.linalg.norm(d, axis=1, keepdims=True)).astype(np.float32)


def plain(network: Mlp, p: np.ndarray, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The network of `small_mlp` in float64, written out."""
    h = hidden_of(network.trunk, gamma(p.astype(np.float64), 2))
    seen = np.concatenate([affine(network.feature, h), gamma(d.astype(np.float64), 1)], axis=1)
    rgb = affine(network.rgb, relu(affine(network.view[0], seen)))
    return relu(affine(network.density, h))[:, 0], 1.0 / (1.0 + np.exp(-rgb))


def test_values_are_those_of_the_network_written_out_in_numpy() -> None:
    field = small_field()
    # more than one block of positions
    p = np.random.default_rng(1).uniform(-1.5, 1.5, (5000, 3)).astype(np.float32)
    d = directions(5000)
    sigma, rgb = field(p, d)
    expected = plain(field.fine, p, d)
    assert 0.3 < (expected[0] > 0).mean() < 0.7
    np.testing.assert_allclose(sigma, expected[0], rtol=1e-4, atol=2e-5)
    np.testing.assert_allclose(rgb, expected[1], rtol=1e-4, atol=2e-5)


def test_many_directions_share_one_trunk() -> None:
    field = small_field()
    p = np.random.default_rng(1).uniform(-1.5, 1.5, (9, 3)).astype(np.float32)
    d = directions(9 * 5).reshape(9, 5, 3)
    sigma, rgb = field.evaluate_directions(p, d)
    for k in range(5):
        expected = field(p, d[:, k])
        np.testing.assert_allclose(sigma, expected[0], rtol=1e-5, atol=1e-6)
        np.testing.assert_allclose(rgb[:, k], expected[1], rtol=1e-4, atol=1e-5)


def test_a_bounded_field_is_empty_outside_its_bounds_and_the_same_within() -> None:
    whole, bounded = small_field(), small_field(bounded=True)
    p = np.random.default_rng(2).uniform(-3.0, 3.0, (6000, 3)).astype(np.float32)
    d = directions(6000)
    inside = (np.abs(p) <= 1.5).all(axis=1)
    sigma, rgb = whole(p, d)
    assert sigma[~inside].max() > 1.0
    found, color = bounded(p, d)
    # the same positions, in other blocks
    np.testing.assert_allclose(found, np.where(inside, sigma, 0.0), atol=1e-4)
    np.testing.assert_allclose(color[inside], rgb[inside], atol=1e-5)
    np.testing.assert_allclose(
        bounded.evaluate_directions(p, np.stack([d, -d], axis=1))[0], np.where(inside, sigma, 0.0), atol=1e-4
    )
    raw = bounded.signed_density(p, d)
    assert raw[~inside].max() <= 0.0 and np.any(raw[inside] > 1.0)
    assert bounded(p[~inside], d[~inside])[0].max() == 0.0


def test_ndc_stretch_is_the_length_of_the_finite_difference() -> None:
    ndc = (0.62, 0.46)
    rng = np.random.default_rng(2)
    p = torch.tensor(np.stack([*rng.uniform(-1, 1, (2, 50)), rng.uniform(-6, -1.5, 50)], 1))
    d = torch.tensor(directions(50).astype(np.float64))
    own, stretch = to_ndc(p, d, ndc)
    step = 1e-6
    difference = (to_ndc(p + step * d, d, ndc)[0] - to_ndc(p - step * d, d, ndc)[0]) / (2 * step)
    # central differences in float64: error step^2 and rounding 1e-16 / step
    np.testing.assert_allclose(stretch, difference.norm(dim=1), rtol=1e-7)
    x, _, z = p.T
    np.testing.assert_allclose(own[:, 0], -x / (0.62 * z))
    np.testing.assert_allclose(own[:, 2], 1 + 2 / z)


def test_in_front_of_the_near_plane_ndc_is_empty() -> None:
    field = small_field(ndc=(0.6, 0.6))
    p = np.random.default_rng(0).uniform(-4, 4, (400, 3))
    sigma = field(p, np.tile([0.0, 0.0, -1.0], (400, 1)))[0]
    assert (sigma[p[:, 2] > -0.99] == 0.0).all() and (sigma[p[:, 2] < -1.0] > 0.0).any()


def test_fine_samples_are_the_quantiles_of_the_weights() -> None:
    bins = torch.tensor([[0.0, 1.0, 2.0, 3.0]])
    found = sample_pdf(bins, torch.tensor([[0.0, 3.0, 1.0]]), 5)
    # quantiles 0, 1/4, ..., 1 of a density that has 3/4 in [1,2] and 1/4 in [2,3]; weights carry 1e-5 each
    np.testing.assert_allclose(found[0, 1:], [4 / 3, 5 / 3, 2.0, 3.0], atol=1e-4)


def test_random_fine_samples_follow_the_weights() -> None:
    torch.manual_seed(0)
    bins = torch.tensor([[0.0, 1.0, 2.0]])
    found = sample_pdf(bins, torch.tensor([[1.0, 3.0]]), 20_000, random=True)
    # a share of 3/4 of 20,000 draws has a standard deviation of 0.003
    assert abs(float((found > 1.0).float().mean()) - 0.75) < 0.015


def reference_rays(field: NerfField, origins, directions, cosines) -> tuple[np.ndarray, np.ndarray]:
    """(rgb, opacity) of nerf-pytorch's render_rays, in float64 numpy: planar depth, last segment endless."""
    d = directions.astype(np.float64) / cosines[:, None]
    view = directions.astype(np.float64)
    z = np.tile(np.linspace(field.near, field.far, field.samples[0]), (len(d), 1))

    def shade(network: Mlp, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        p = origins[:, None] + z[..., None] * d[:, None]
        v = np.broadcast_to(view[:, None], p.shape)
        sigma, rgb = plain(network, p.reshape(-1, 3), v.reshape(-1, 3))
        length = np.concatenate([np.diff(z), np.full((len(z), 1), 1e10)], 1)
        length = length * np.linalg.norm(d, axis=1)[:, None]
        alpha = 1 - np.exp(-sigma.reshape(z.shape) * length)
        weights = alpha * np.cumprod(np.concatenate([np.ones((len(z), 1)), 1 - alpha + 1e-10], 1), 1)[:, :-1]
        return weights, (weights[..., None] * rgb.reshape(*z.shape, 3)).sum(1)

    weights, _ = shade(field.coarse, z)
    middles = 0.5 * (z[:, 1:] + z[:, :-1])
    more = []
    for row, edges in zip(weights[:, 1:-1] + 1e-5, middles, strict=True):
        total = np.concatenate([[0], np.cumsum(row / row.sum())])
        more.append(np.interp(np.linspace(0, 1, field.samples[1]), total, edges))
    z = np.sort(np.concatenate([z, np.array(more)], 1), 1)
    weights, rgb = shade(field.fine, z)
    return rgb, weights.sum(1)


def camera(size: int = 8) -> Camera:
    return turntable((0, 0, 0), 4.0, 3, elevation=0.4, width=size, height=size, fov_x=0.7)[1]


def test_pictures_are_those_of_hierarchical_sampling_in_float64() -> None:
    field = small_field()
    origins, toward = camera().rays()
    rgb, opacity = reference_rays(field, origins.astype(np.float64), toward, toward @ camera().forward)
    frame = NerfRenderer(field, chunk_rays=30).render(camera(), background="black")
    # Fine samples where the coarse weights are almost even amplify rounding of float32: 1e-3 of a pixel
    np.testing.assert_allclose(frame.rgb.reshape(-1, 3), rgb, atol=1e-3)
    np.testing.assert_allclose(frame.opacity.ravel(), np.clip(opacity, 0, 1), atol=1e-3)
    white = NerfRenderer(field).render(camera(), background="white")
    np.testing.assert_allclose(white.rgb, frame.rgb + 1 - frame.opacity[..., None], atol=1e-6)


def test_an_ndc_picture_is_the_one_from_ndc_rays() -> None:
    """The same network, rendered along rays that were taken to NDC first, as nerf-pytorch does."""
    field = small_field(ndc=(0.5, 0.5), near=0.0, far=1.0)
    camera = Camera.from_fov(np.eye(4), 6, 6, 2 * np.arctan(0.5))
    origins, toward = (a.astype(np.float64) for a in camera.rays())
    start = origins - (1 + origins[:, 2:]) / toward[:, 2:] * toward
    a, b = field.ndc
    own = np.stack(
        [-start[:, 0] / (a * start[:, 2]), -start[:, 1] / (b * start[:, 2]), 1 + 2 / start[:, 2]], 1
    )
    own_d = np.stack(
        [
            -(toward[:, 0] / toward[:, 2] - start[:, 0] / start[:, 2]) / a,
            -(toward[:, 1] / toward[:, 2] - start[:, 1] / start[:, 2]) / b,
            -2 / start[:, 2],
        ],
        1,
    )
    z = np.tile(np.linspace(0, 1, 12), (36, 1))
    p = own[:, None] + z[..., None] * own_d[:, None]
    sigma, rgb = plain(field.coarse, p.reshape(-1, 3), np.repeat(toward, 12, axis=0))
    length = np.concatenate([np.diff(z), np.full((36, 1), 1e10)], 1) * np.linalg.norm(own_d, axis=1)[:, None]
    alpha = 1 - np.exp(-sigma.reshape(z.shape) * length)
    weights = alpha * np.cumprod(np.concatenate([np.ones((36, 1)), 1 - alpha + 1e-10], 1), 1)[:, :-1]
    expected = (weights[..., None] * rgb.reshape(36, 12, 3)).sum(1)
    coarse, _ = march(field.torch, Rays.from_camera(camera, field.torch.device))
    # float32 positions up to 1e6 away; the last sample stops 1e-6 before infinity
    np.testing.assert_allclose(coarse.premultiplied.cpu().numpy(), expected, atol=1e-4)


def test_rays_away_from_a_forward_facing_capture_see_nothing() -> None:
    field = small_field(ndc=(0.5, 0.5), near=0.0, far=1.0)
    back = Camera.from_fov(np.diag([-1.0, 1.0, -1.0, 1.0]), 4, 4, 0.5)
    frame = NerfRenderer(field).render(back, background="white")
    np.testing.assert_array_equal(frame.rgb, 1.0)
    assert np.isinf(frame.depth).all()


def box_edit(**options) -> Edit:
    return Edit.continuous(Cage.box((0, 0, 0), 0.5), Cage.box((0, 0, 0), 1.2), **options)


def box_move() -> Edit:
    return Edit.move(Cage.box((0, 0, 0), 0.5))


STACKS = {
    "move": EditStack([box_move().translate((0.4, 0.1, 0.0)).rotate((0, 0, 0.4))]),
    "delete": EditStack([Edit.delete(Cage.box((0.2, 0, 0), 0.4))]),
    "flow": EditStack([box_edit().rotate((0.2, 0.1, 0.6)).scale(0.8)]),
    "trilinear, then move": EditStack(
        [
            box_edit(shell=Trilinear()).scale((1.2, 0.9, 1.1)),
            box_move().translate((0, 0.5, 0)),
        ]
    ),
}


@pytest.mark.parametrize("name", STACKS)
def test_tensors_go_through_edits_as_the_reference_takes_them(name) -> None:
    stack = STACKS[name]
    p = np.random.default_rng(3).uniform(-1.3, 1.3, (600, 3)).astype(np.float32)
    d = directions(600)
    expected = stack.to_canonical(p, d)
    q, v, gain = TensorMap(stack, torch.device("cpu"))(torch.from_numpy(p), torch.from_numpy(d))
    np.testing.assert_array_equal(gain.numpy() == 0.0, expected.emptied)
    kept = ~expected.emptied
    assert expected.stretch is not None
    np.testing.assert_allclose(gain.numpy()[kept], expected.stretch[kept], rtol=5e-3)
    plain = TensorMap(stack, torch.device("cpu"), preserve_opacity=False)
    ones = plain(torch.from_numpy(p), torch.from_numpy(d))[2]
    np.testing.assert_array_equal(ones.numpy(), kept.astype(np.float32))
    # float32 against float64; a flow's integration steps differ by up to 1e-4 of the scene
    np.testing.assert_allclose(q.numpy()[kept], expected.points[kept], atol=3e-4)
    np.testing.assert_allclose(v.numpy()[kept], expected.viewdirs[kept], atol=2e-3)
    np.testing.assert_allclose(np.linalg.norm(v.numpy(), axis=1), 1.0, atol=1e-5)


FREE_FORM = {
    "lattice": Edit.continuous(Cage.box((0, 0, 0), 0.8).subdivided((2, 2, 2)), Cage.box((0, 0, 0), 1.8))
    .twist("z", 0.4)
    .move_point(13, (0.05, 0.0, 0.02)),
    "points": Edit.points([(0.2, 0, 0), (-0.2, 0.1, 0)], radius=0.5).move_point(0, (0.1, 0.05, 0)),
    "mesh": Edit.continuous(MeshCage.of_box(Cage.box((0, 0, 0), 0.8)), Cage.box((0, 0, 0), 1.8)).move_point(
        7, (0.15, 0.1, 0.2)
    ),
}


@pytest.mark.parametrize("name", FREE_FORM)
def test_free_form_edits_of_tensors_are_exact(name) -> None:
    """The samples of a lattice, control points and a mesh: by the map itself, not by nodes."""
    edit = FREE_FORM[name]
    canonical = np.random.default_rng(3).uniform(-0.6, 0.6, (500, 3))
    forward = EditStack([edit]).to_deformed(canonical)
    p = forward.points.astype(np.float32)
    d = directions(500)
    mapped = TensorMap(EditStack([edit]), torch.device("cpu"))
    q, v, gain = mapped(torch.from_numpy(p), torch.from_numpy(d))
    np.testing.assert_allclose(q.numpy(), canonical, atol=2e-6)  # float32 of p, stretched
    along = np.linalg.solve(forward.jacobian, d[:, :, None])[..., 0]
    length = np.linalg.norm(along, axis=1)
    off = np.abs(v.numpy() - along / length[:, None]).max(axis=1)  # kinks between cells of the velocity
    assert np.quantile(off, 0.98) < 1e-4 and np.isclose(np.median(gain.numpy() / length), 1.0, rtol=1e-4)
    nodes = TensorMap(EditStack([edit.replace(lattice=64)]), torch.device("cpu"))
    assert not nodes.is_reference
    by_nodes = nodes(torch.from_numpy(p), torch.from_numpy(d))[0].numpy()
    assert np.abs(by_nodes - canonical).max() > 1e-4


def test_a_mesh_cage_around_everything_moves_it_with_the_camera() -> None:
    field = small_field(samples=(24, 32), bounded=True)
    shift = np.array([0.4, -0.3, 0.2])
    cage = MeshCage.of_box(Cage.box((0, 0, 0), 3.2))
    edit = Edit.continuous(cage, Cage.box((0, 0, 0), 8.0)).translate(shift)
    pose = np.eye(4)
    pose[:3, 3] = shift
    before = camera(6)
    after = before.with_c2w(pose @ before.c2w)
    one = NerfRenderer(field).render(before)
    other = NerfRenderer(field, edits=EditStack([edit])).render(after)
    np.testing.assert_allclose(other.rgb, one.rgb, atol=2e-3)
    assert np.abs(NerfRenderer(field).render(after).rgb - one.rgb).max() > 0.05


def test_kernels_take_tensors_themselves() -> None:
    """What happens on a GPU, where samples stay tensors: here with tensors on the CPU."""
    stack = STACKS["flow"]
    p, d = torch.rand(50, 3) - 0.5, torch.from_numpy(directions(50))
    by_array = TensorMap(stack, torch.device("cpu"))(p, d)
    by_tensor = TensorMap(stack, torch.device("cpu"), as_tensors=True)(p, d)
    for one, other in zip(by_array, by_tensor, strict=True):
        np.testing.assert_array_equal(one.numpy(), other.numpy())


# The cage holds all that the camera's rays meet between near and far; of a bounded field its bounds do.
@pytest.mark.parametrize(("bounded", "size"), [(False, 40.0), (True, 3.2)])
def test_moving_everything_with_the_camera_gives_the_same_picture(bounded, size) -> None:
    """All of the field moved rigidly inside one cage, and the camera with it."""
    field = small_field(samples=(24, 32), bounded=bounded)
    shift = np.array([0.7, -0.3, 0.2])
    turn = 0.5
    edit = Edit.move(Cage.box((0, 0, 0), size)).rotate((0, 0, turn)).translate(shift)
    R = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = R, shift
    before = camera(6)
    after = before.with_c2w(pose @ before.c2w)
    one = NerfRenderer(field).render(before)
    other = NerfRenderer(field, edits=EditStack([edit])).render(after)
    # the same samples up to rounding, which fine sampling amplifies as above
    np.testing.assert_allclose(other.rgb, one.rgb, atol=2e-3)
    near = one.opacity > 0.01
    np.testing.assert_allclose(other.depth[near], one.depth[near], atol=1e-2)
    assert np.abs(NerfRenderer(field).render(after).rgb - one.rgb).max() > 0.05


def test_emptied_samples_have_no_density() -> None:
    field = small_field()
    everything = EditStack([Edit.delete(Cage.box((0, 0, 0), 40.0))])
    frame = NerfRenderer(field, edits=everything).render(camera(), background="none")
    np.testing.assert_array_equal(frame.opacity, 0.0)


def test_pixels_may_be_chosen() -> None:
    field = small_field()
    pixels = np.array([[3, 1], [0, 7]])
    rgb, opacity, depth = trace(field.torch, Rays.from_camera(camera(), field.torch.device, pixels))
    whole = NerfRenderer(field).render(camera(), background="black")
    np.testing.assert_allclose(rgb.cpu().numpy(), [whole.rgb[1, 3], whole.rgb[7, 0]], atol=1e-6)
    np.testing.assert_allclose(depth.cpu().numpy(), [whole.depth[1, 3], whole.depth[7, 0]], rtol=1e-5)
    assert opacity.shape == (2,)


def test_lindisp_samples_are_even_in_disparity() -> None:
    from cagefield.rendering.nerf.nerf_renderer import stratified_samples

    field = small_field(lindisp=True, near=1.0, far=4.0, samples=(4, 0))
    s = stratified_samples(field, Rays.from_camera(camera(1), field.torch.device), 4, None)
    np.testing.assert_allclose(1 / s[0].cpu(), [1.0, 0.75, 0.5, 0.25], rtol=1e-6)


def in_float64(field: NerfField) -> TorchNerf:
    double = TorchNerf(field, field.torch.device)
    for network in (double.coarse, double.fine):
        assert network is not None
        network.layers = {name: (w.double(), b.double()) for name, (w, b) in network.layers.items()}
    return double


def numeric_normals(field: NerfField, camera: Camera, edits: EditStack | None) -> np.ndarray:
    """Normals [N,3] by central differences of the edited sigma, at the renderer's samples and weights."""
    device = field.torch.device
    rays = Rays.from_camera(camera, device)
    mapped = None if edits is None else TensorMap(edits, device, preserve_opacity=False)
    double = in_float64(field)

    def sigma(points: torch.Tensor, viewdirs: torch.Tensor) -> torch.Tensor:
        if mapped is not None:
            points = mapped(points.float(), viewdirs.float())[0].double()
        return double(points, viewdirs)[0]

    with torch.no_grad():
        sums = march(field.torch, rays, mapped)[1]
        points = (rays.origins[:, None] + sums.t[..., None] * rays.directions[:, None]).reshape(-1, 3)
        along = rays.directions[:, None].expand(*sums.t.shape, 3).reshape(-1, 3)
        points, along = points.double(), along.double()
        # the edits' map is float32; NDC rays end a million units away
        size = (1e-6 if mapped is None else 1e-3) * points.norm(dim=1, keepdim=True).clamp_min(1.0)
        offsets = [size * axis for axis in torch.eye(3, device=device)]
        slopes = torch.stack([sigma(points + o, along) - sigma(points - o, along) for o in offsets], dim=1)
        own = torch.nn.functional.normalize(slopes, dim=1, eps=1e-30).reshape(*sums.t.shape, 3)
        total = -(own * sums.weights[..., None] * (sums.weights[..., None] > 1e-4)).sum(1)
    return torch.nn.functional.normalize(total, dim=1).cpu().numpy()


@pytest.mark.parametrize("name", ["none", "ndc", "move", "flow", "trilinear, then move"])
def test_normals_are_the_slopes_of_the_edited_density(name) -> None:
    field = small_field(ndc=(0.5, 0.5), near=0.0, far=1.0) if name == "ndc" else small_field()
    edits = STACKS.get(name)
    seen_by = Camera.from_fov(np.eye(4), 8, 8, 0.9) if name == "ndc" else camera(8)
    frame = NerfRenderer(field, edits=edits, preserve_opacity=False).render(seen_by, normals=True)
    assert frame.normals is not None
    expected = numeric_normals(field, seen_by, edits)
    cosines = (frame.normals.reshape(-1, 3) * expected).sum(axis=1)[frame.opacity.ravel() > 0.3]
    assert len(cosines) > 10
    # differences of a float32 map over 2e-3, and across ReLUs and cage faces: a few pixels are degrees off
    assert np.median(cosines) > 0.9999 and np.quantile(cosines, 0.1) > 0.99


def test_the_jacobian_of_tensors_is_that_of_the_map() -> None:
    stack = STACKS["trilinear, then move"]
    p = torch.from_numpy(np.random.default_rng(8).uniform(-0.8, 0.8, (300, 3)).astype(np.float32))
    d = torch.tensor([[0.0, 0.0, 1.0]]).expand(p.shape)
    mapped = TensorMap(stack, torch.device("cpu"))
    step, slopes = 1e-3, []
    for axis in torch.eye(3):
        ahead, behind = mapped(p + step * axis, d), mapped(p - step * axis, d)
        slopes.append((ahead[0] - behind[0]) / (2 * step))
        assert ahead[2].shape == (300,)
    found, expected = mapped.jacobian(p).numpy(), torch.stack(slopes, 2).numpy()
    kept = mapped(p, d)[2].numpy() > 0
    # differences in float32 are good to 1e-3; steps across a cage's face, a few, are not compared
    error = np.abs(found - expected)[kept].max(axis=(1, 2))
    assert np.quantile(error, 0.9) < 4e-3 and np.isfinite(found).all()
