"""The oracle of 2DGS' discs against rays intersected with planes, and the rasteriser beside it."""

from __future__ import annotations

import numpy as np

from cagefield.cameras import Camera
from cagefield.fields.splat import SplatField
from cagefield.rendering.splat_disc_reference import FILTER, render_discs
from cagefield.rendering.splat_renderer import SplatRenderer


def disc(size: float, turn: float) -> SplatField:
    """One disc at the origin, `size` and half of it wide, turned about x; opacity .8, grey of .5."""
    return SplatField(
        np.zeros((1, 3)), np.log([[size, 0.5 * size, 1e-3 * size]]),
        [[np.cos(turn / 2), np.sin(turn / 2), 0, 0]], [0.8], np.zeros((1, 1, 3)),
        bounds=np.array([[-1.0] * 3, [1.0] * 3]),
    )  # fmt: skip


def view(distance: float = 3.0) -> Camera:
    return Camera.look_at((0.1, 0.2, distance), (0, 0, 0), width=24, height=20, fov_x=0.7, up=(0, 1, 0))


def test_rays_meet_the_disc_where_planes_do() -> None:
    size, turn = 0.4, 1.2
    camera = view(1.5)
    origins, directions = (values.astype(np.float64).reshape(-1, 3) for values in camera.rays())
    normal = np.array([0.0, -np.sin(turn), np.cos(turn)])
    b = np.array([0.0, np.cos(turn), np.sin(turn)])
    hit = origins - directions * (origins @ normal / (directions @ normal))[:, None]
    square = (hit[:, 0] / size) ** 2 + (hit @ b / (0.5 * size)) ** 2
    alpha = 0.8 * np.exp(-0.5 * square)
    got = render_discs(disc(size, turn), camera, near=0.1, background="black").opacity.ravel()
    # Where the filter is not what shows: it reaches 2 pixels.
    clear = alpha > 0.02
    assert clear.sum() > 40
    np.testing.assert_allclose(got[clear], alpha[clear], atol=2e-5)


def test_a_distant_disc_is_a_dot_of_the_filter() -> None:
    camera = view()
    got = render_discs(disc(1e-4, 0.3), camera, near=0.1, background="black").opacity
    y, x = np.mgrid[:20, :24] + 0.5
    dot = 0.8 * np.exp(-0.25 * ((x - 12) ** 2 + (y - 10) ** 2) / FILTER)
    np.testing.assert_allclose(got, np.where(dot < 1 / 255, 0.0, dot), atol=1e-5)


def test_the_rasteriser_draws_discs_that_face_the_camera() -> None:
    """From the front and many pixels wide, both are one Gaussian; a grazing one is not (docs/limits.md)."""
    camera = Camera.look_at((0.0, 0.0, 3.0), (0, 0, 0), width=48, height=40, fov_x=0.7, up=(0, 1, 0))
    errors = []
    for turn in (0.0, 1.45):
        want = render_discs(disc(0.5, turn), camera, near=0.1, background="black").rgb
        got = SplatRenderer(disc(0.5, turn)).render(camera, background="black")
        assert got is not None
        errors.append(-10.0 * np.log10(np.mean(np.square(got.rgb - want))))
    # The filter of .3 pixels^2 widens a splat of 33 x 16 pixels by 1e-3 of it.
    assert errors[0] > 50.0 and errors[1] < errors[0] - 10.0
