"""Pictures of splats in float64, one splat after the other over the whole picture: the oracle of the kernels.

Notation as in `kernels.projection` and `kernels.blending`: n = (x/z, y/z), D the lens's
derivative, M = J W, the projected covariance M C M^T + BLUR I, alpha = o exp(-d^T Q d / 2).

Source: Zwicker et al., "EWA splatting" (2002), equations 24 to 34; Kerbl et al. (2023), equations 2 to 5.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cagefield.cameras import lenses
from cagefield.cameras.camera import Camera
from cagefield.fields import sh
from cagefield.images.render_result import Background, RenderResult
from cagefield.rendering.splats.raster_splats import DeformedSplats
from cagefield.typing import AnyArray

BLUR, SLOPE_BLUR, ALPHA_MIN, ALPHA_MAX = 0.3, 0.02, 1.0 / 255.0, 0.99
LEAST_COMPENSATION = 0.005


@dataclass(frozen=True, eq=False)
class ProjectedSplats:
    """The splats in front of a camera, near to far.

    rows [N] which they are; means [N,2] in pixels; conics [N,2,2]; opacities [N]; colors [N,3]; distances
    [N] along the ray at the mean, and their slopes [N,2] per pixel.
    """

    rows: NDArray[np.int64]
    means: AnyArray
    conics: AnyArray
    opacities: AnyArray
    colors: AnyArray
    distances: AnyArray
    slopes: AnyArray


def project(
    splats: DeformedSplats, camera: Camera, near: float, limits: AnyArray | None = None
) -> ProjectedSplats:
    """The splats as the camera sees them; `limits` [4] bound n where shapes are taken (None: no bounds)."""
    W = np.diag([1.0, -1.0, -1.0]) @ camera.c2w[:3, :3].T
    offset = splats.means.astype(np.float64) - camera.origin
    p = offset @ W.T
    rows = np.flatnonzero(
        (p[:, 2] >= near) & ~np.isnan(lenses.project(p, camera.model, camera.distortion)[:, 0])
    )
    rows = rows[np.argsort(p[rows, 2], kind="stable")]
    p, offset = p[rows], offset[rows]
    focal = np.array([camera.fx, camera.fy])
    means = lenses.project(p, camera.model, camera.distortion) * focal + (camera.cx, camera.cy)
    C = _full(splats.covariances[rows].astype(np.float64))
    M = _jacobians(p, camera, limits) @ W
    flat = M @ C @ M.transpose(0, 2, 1)
    blurred = flat + BLUR * np.eye(2)
    opacities = splats.opacities[rows].astype(np.float64)
    if splats.antialiased:
        share = np.sqrt(np.maximum(np.linalg.det(flat), 0.0) / np.linalg.det(blurred))
        opacities = opacities * np.maximum(share, LEAST_COMPENSATION)
    distance = np.linalg.norm(offset, axis=1)
    along = offset / distance[:, None]
    conics = np.linalg.inv(blurred)
    slopes = np.einsum("ni,nij,nkj,nkl->nl", along, C, M, np.linalg.inv(flat + SLOPE_BLUR * np.eye(2)))
    turned = along if splats.rotations is None else np.einsum("nji,nj->ni", splats.rotations[rows], along)
    degree = int(np.sqrt(splats.sh.shape[1])) - 1
    colors = 0.5 + np.einsum("nk,nkc->nc", sh.sh_basis(turned, degree), splats.sh[rows].astype(np.float64))
    return ProjectedSplats(rows, means, conics, opacities, np.maximum(colors, 0.0), distance, slopes)


def blend(projected: ProjectedSplats, width: int, height: int) -> tuple[AnyArray, AnyArray, AnyArray]:
    """(color [H,W,3] without background, T [H,W], depth times weight [H,W])."""
    x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    color, through, depth = np.zeros((height, width, 3)), np.ones((height, width)), np.zeros((height, width))
    for n in range(len(projected.rows)):
        d = np.stack([x - projected.means[n, 0], y - projected.means[n, 1]], axis=-1)
        alpha = projected.opacities[n] * np.exp(-0.5 * np.einsum("hwi,ij,hwj->hw", d, projected.conics[n], d))
        alpha = np.where(alpha < ALPHA_MIN, 0.0, np.minimum(alpha, ALPHA_MAX))
        weight = alpha * through
        color += weight[..., None] * projected.colors[n]
        depth += weight * (projected.distances[n] + d @ projected.slopes[n])
        through *= 1.0 - alpha
    return color, through, depth


def render(
    splats: DeformedSplats,
    camera: Camera,
    *,
    near: float,
    background: Background = "white",
    limits: AnyArray | None = None,
) -> RenderResult:
    """The frame that the camera sees."""
    color, through, depth = blend(project(splats, camera, near, limits), camera.width, camera.height)
    opacity = 1.0 - through
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = np.where(opacity > 1e-6, depth / opacity, np.inf)
    return RenderResult.from_premultiplied(color, opacity, distance, background=background)


def _jacobians(p: AnyArray, camera: Camera, limits: AnyArray | None) -> AnyArray:
    """d(pixel)/d(p) [N,2,3] at camera points [N,3], n within the limits; central differences of the lens."""
    n = p[:, :2] / p[:, 2:]
    if limits is not None:
        n = np.clip(n, limits[[0, 2]], limits[[1, 3]])
    one = np.ones((len(n), 1))
    h = 1e-5
    D = np.empty((len(n), 2, 2))
    for axis in range(2):
        step = h * np.eye(2)[axis]
        ahead = lenses.project(np.hstack([n + step, one]), camera.model, camera.distortion)
        behind = lenses.project(np.hstack([n - step, one]), camera.model, camera.distortion)
        D[:, :, axis] = (ahead - behind) / (2 * h)
    flat = np.zeros((len(n), 2, 3))
    flat[:, 0, 0] = flat[:, 1, 1] = 1.0
    flat[:, :, 2] = -n
    return np.array([camera.fx, camera.fy])[:, None] * (D @ flat) / p[:, 2, None, None]


def _full(six: AnyArray) -> AnyArray:
    """Symmetric matrices [N,3,3] of their values xx, xy, xz, yy, yz, zz [N,6]."""
    return six[:, [0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(-1, 3, 3)
