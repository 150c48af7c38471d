"""Gradients of pictures of splats, by the kernels."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera
from cagefield.fields import sh as harmonics
from cagefield.rendering.splats import reference_rasterizer as reference
from cagefield.rendering.splats.rasterizer import (
    COLOR,
    camera_args,
    intrinsics,
    project,
    tiled,
)
from cagefield.training.splats.kernels.splat_backward import (
    CURVATURE_FLOATS,
    GRADIENT_FLOATS,
    PairArgs,
    ParameterArgs,
    backpropagate,
)
from splat_views import NEAR, parameters, single, splats_of, unit

Values = dict[str, NDArray]


def rounded(values: Values) -> Values:
    """Parameters that float32 holds exactly, so that kernels and oracle see the same ones."""
    return {name: part.astype(np.float32).astype(np.float64) for name, part in values.items()}


def analytic(
    values: Values, view: Camera, target: NDArray, background: NDArray, antialiased: bool
) -> tuple[NDArray, NDArray, NDArray]:
    """Gradients [N,GRADIENT_FLOATS], curvatures [N,CURVATURE_FLOATS], and the splats drawn."""
    splats = single(splats_of(values, antialiased))
    seen = project(splats, view, near=NEAR)
    tiles, stops = seen.blend(COLOR)
    color = np.ascontiguousarray(tiles[:, 1:4] + tiles[:, :1] * background[:, None].astype(np.float32))
    slopes = color - tiled(target.astype(np.float32))
    gradients = np.zeros((len(splats), GRADIENT_FLOATS), np.float32)
    curvatures = np.zeros((len(splats), CURVATURE_FLOATS), np.float32)
    sums = seen.gradients(color, slopes, stops)
    backpropagate(
        PairArgs(seen.order, seen.firsts, seen.slots, sums),
        seen.packed,
        ParameterArgs(
            splats.means,
            values["log_scales"].astype(np.float32),
            values["quaternions"].astype(np.float32),
            values["logits"].astype(np.float32),
            splats.sh,
        ),
        splats.opacities,
        camera_args(view, NEAR),
        antialiased,
        True,
        gradients,
        curvatures,
    )
    return gradients, curvatures, seen.order


def pictures(view: Camera, background: NDArray, antialiased: bool) -> Callable[[Values], NDArray]:
    """The oracle's picture [H,W,3] of parameters."""
    limits = intrinsics(view).limits

    def picture(values: Values) -> NDArray:
        seen = reference.project(splats_of(values, antialiased), view, NEAR, limits)
        color, through, _ = reference.blend(seen, view.width, view.height)
        return color + through[..., None] * background

    return picture


def settled(values: Values, view: Camera, antialiased: bool) -> Values:
    """Parameters at which no pixel lies where alpha's limits make the loss jump or bend.

    Gradients are those between the jumps; each splat's opacity is changed a little until none is near one.
    """
    limits = intrinsics(view).limits
    x, y = np.meshgrid(np.arange(view.width) + 0.5, np.arange(view.height) + 0.5)
    chance = np.random.default_rng(9)
    for _ in range(200):
        seen = reference.project(splats_of(values, antialiased), view, NEAR, limits)
        d = np.stack([x, y], axis=-1) - seen.means[:, None, None]
        alpha = np.exp(-0.5 * np.einsum("nhwi,nij,nhwj->nhw", d, seen.conics, d))
        alpha *= seen.opacities[:, None, None]
        near = np.minimum(
            np.abs(alpha / reference.ALPHA_MIN - 1.0), np.abs(alpha / reference.ALPHA_MAX - 1.0)
        ).min(axis=(1, 2))
        # Kernels know alpha to some 1e-5 of it; a difference moves it by 1e-4 at most.
        bad = seen.rows[near < 1.5e-4]
        if len(bad) == 0:
            return values
        values["logits"][bad] += chance.uniform(-0.05, 0.05, len(bad))
        values = rounded(values)
    raise AssertionError("no such parameters found")


PARTS = {"means": (0, 3), "log_scales": (3, 3), "quaternions": (6, 3), "logits": (9, 1), "color": (10, 3)}
"""Where each parameter's gradient lies, and how many numbers it has."""


def moved(values: Values, name: str, splat: int, axis: int, step: float) -> Values:
    """The parameters with one of them changed; "quaternions" by a turn, "color" by its constant harmonic."""
    values = {key: part.copy() for key, part in values.items()}
    if name == "quaternions":
        w, v = values[name][splat, 0], values[name][splat, 1:]
        half = 0.5 * step * np.eye(3)[axis]
        # q (1, half): a turn about the splat's own axis.
        turned = np.concatenate([[w - v @ half], v + w * half + np.cross(v, half)])
        values[name][splat] = unit(turned)
    elif name == "color":
        values["sh"][splat, 0, axis] += step / harmonics.C0
    elif name == "logits":
        values[name][splat] += step
    else:
        values[name][splat, axis] += step
    return values


def differences(
    picture: Callable[[Values], NDArray], values: Values, name: str, splat: int, axis: int, step: float = 1e-6
) -> NDArray:
    """d(picture)/d(parameter) [H,W,3] by central differences; rounding is some 1e-8 of it."""
    ahead = picture(moved(values, name, splat, axis, step))
    behind = picture(moved(values, name, splat, axis, -step))
    return (ahead - behind) / (2.0 * step)


def scene(view: Camera, antialiased: bool, degree: int, seed: int) -> tuple[Values, NDArray, NDArray]:
    """Random parameters, a target [H,W,3] and a background [3]."""
    chance = np.random.default_rng(seed)
    values = parameters(9, degree, seed)
    # One opaque enough for ALPHA_MAX to hold, one beyond the edge whose shape no longer follows, one color
    # that is clamped at 0, one far smaller than a pixel.
    values["logits"][0] = 6.0
    right = view.c2w[:3, 0]
    values["means"][1] = 3.2 * right
    values["log_scales"][1] = np.log((1.2, 0.7, 0.6))
    values["logits"][1] = 1.0
    values["sh"][2, 0] = (-3.0, 0.2, 0.1)
    values["log_scales"][3] = np.log(0.004)
    values["logits"][3] = 2.0
    target = chance.uniform(size=(view.height, view.width, 3))
    return settled(rounded(values), view, antialiased), target, chance.uniform(size=3)
