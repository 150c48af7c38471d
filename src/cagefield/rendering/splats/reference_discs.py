"""Pictures of 2DGS' discs as their authors draw them, in float64: the oracle of `kernels.discs`.

Notation: a disc has the mean p (camera axes, z forward) and the tangents a, b, each as long as its standard
deviation. A pixel's ray meets its plane at p + u a + v b, and
    alpha = o exp(-min(u^2 + v^2, r^2 / (2 F)) / 2),
r the pixel's distance from the projected mean and F = 1/4 pixels^2 that of the filter: a disc is never
thinner on the picture than a dot of the variance 2 F.

With the columns of T = [a b p], n = (x/z, y/z) of the ray, and h_x = n_x T_3 - T_1, h_y = n_y T_3 - T_2 of
its rows, (u, v, 1) is along h_x x h_y.

Source: Huang et al., "2D Gaussian Splatting" (2024), equations 7 to 11; hbb1/diff-surfel-rasterization,
cuda_rasterizer/forward.cu.
"""

from __future__ import annotations

import numpy as np

from cagefield.cameras import lenses
from cagefield.cameras.camera import Camera
from cagefield.fields import sh
from cagefield.fields.splat_field import SplatField
from cagefield.geometry.quaternions import rotation_matrices
from cagefield.images.render_result import Background, RenderResult
from cagefield.rendering.splats.reference_rasterizer import ALPHA_MAX, ALPHA_MIN

FILTER = 0.25
"""F: the authors' FilterInvSquare is 2 = 1 / (2 F)."""


def render_discs(
    field: SplatField, camera: Camera, *, near: float, background: Background = "white"
) -> RenderResult:
    """The frame that a camera sees of a field whose third scales do not count."""
    W = np.diag([1.0, -1.0, -1.0]) @ camera.c2w[:3, :3].T
    offsets = field.means.astype(np.float64) - camera.origin
    p = offsets @ W.T
    rows = np.flatnonzero(p[:, 2] >= near)
    rows = rows[np.argsort(p[rows, 2], kind="stable")]
    axes = rotation_matrices(field.quaternions[rows].astype(np.float64))
    axes = axes[:, :, :2] * np.exp(field.log_scales[rows, None, :2].astype(np.float64))
    T = np.concatenate([W @ axes, p[rows, :, None]], axis=2)
    focal, center = np.array([camera.fx, camera.fy]), np.array([camera.cx, camera.cy])
    means = lenses.project(p[rows], camera.model, camera.distortion) * focal + center
    along = offsets[rows] / np.linalg.norm(offsets[rows], axis=1, keepdims=True)
    colors = 0.5 + np.einsum(
        "nk,nkc->nc", sh.sh_basis(along, field.sh_degree), field.sh[rows].astype(np.float64)
    )
    x, y = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    pixels = (np.stack([x, y], axis=-1).reshape(-1, 2) - center) / focal
    rays = lenses.unproject(pixels, camera.model, camera.distortion)[0].reshape(*x.shape, 3)
    n_x, n_y = rays[..., 0] / rays[..., 2], rays[..., 1] / rays[..., 2]
    color, through = np.zeros((*x.shape, 3)), np.ones(x.shape)
    depth = np.zeros(x.shape)
    for n, row in enumerate(rows):
        hit = np.cross(n_x[..., None] * T[n, 2] - T[n, 0], n_y[..., None] * T[n, 2] - T[n, 1])
        with np.errstate(divide="ignore", invalid="ignore"):
            uv = hit[..., :2] / hit[..., 2:]
            inside = np.where(hit[..., 2] == 0.0, np.inf, (uv**2).sum(axis=-1))
        dot = ((x - means[n, 0]) ** 2 + (y - means[n, 1]) ** 2) / (2.0 * FILTER)
        z = np.where(inside <= dot, uv @ T[n, 2, :2] + T[n, 2, 2], T[n, 2, 2])
        alpha = field.opacities[row] * np.exp(-0.5 * np.minimum(inside, dot))
        alpha = np.where((alpha < ALPHA_MIN) | (z < near), 0.0, np.minimum(alpha, ALPHA_MAX))
        weight = alpha * through
        color += weight[..., None] * np.maximum(colors[n], 0.0)
        depth += np.where(alpha > 0.0, weight * z, 0.0)
        through *= 1.0 - alpha
    opacity = 1.0 - through
    depth /= rays[..., 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = np.where(opacity > 1e-6, depth / opacity, np.inf)
    return RenderResult.from_premultiplied(color, opacity, distance, background=background)
