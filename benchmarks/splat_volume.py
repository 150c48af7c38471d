"""Pictures of splats as a volume that an edit bends point by point: a truth that does not use splitting.

Notation: a splat is m + A z with the opacity a. Where it lets the share 1 - a exp(-u^2 / 2) of a ray through,
u the ray's distance in the space of z, it is a volume of the density

    rho(z) = sum over k of a^k / k sqrt(k / (2 pi)) exp(-k |z|^2 / 2)

per unit length in the space of z, whatever the ray's direction: the integral of its k-th term along a ray is
that of -log(1 - a exp(-u^2 / 2)). A piece dz at z goes to F(m + A z) with the Jacobian M = J A, J of F there,
and has the cross section rho(z) |det M| |M^-1 d| dz for rays along d: a stretch keeps what rays lose.

Splats are cut into cubes in z, each is mapped and filled with points, which are counted by pixel and depth.
What interpenetrates is mixed, where splats are drawn one behind the other: see the figures at rest.
"""

from __future__ import annotations

import numba
import numpy as np

from cagefield import Camera, Edit, SplatField
from cagefield.geometry.quaternions import rotation_matrices
from cagefield.warps.forward import to_deformed

C0 = 0.28209479177387814
REACH = 3.6
POINTS = 4
"""Points along an edge of a cube."""


def volume_picture(
    field: SplatField, edit: Edit | None, camera: Camera, *, cube: float = 0.015, layer: float = 0.02
) -> np.ndarray:
    """The picture [H,W,3] over white of a field of degree 0, of cubes and depth layers of these sizes."""
    forward = np.asarray(camera.forward, np.float64)
    shape = (camera.height, camera.width)
    center = (np.asarray(field.bounds).mean(axis=0) - camera.origin) @ forward
    first, layers = center - 1.6, round(3.2 / layer)
    counted = np.zeros((layers, *shape, 4), np.float32)
    turns = rotation_matrices(field.quaternions.astype(np.float64))
    scales = np.exp(field.log_scales.astype(np.float64))
    colors = np.clip(field.sh[:, 0].astype(np.float64) * C0 + 0.5, 0.0, 1.0)
    radii = np.linspace(0.0, REACH * 1.01, 4000)
    origin = np.asarray(camera.origin, np.float64)
    rotation = np.asarray(camera.c2w, np.float64)[:3, :3]
    pixels, _ = camera.project(
        np.stack([origin + forward, origin + forward + rotation[:, 0], origin + forward + rotation[:, 1]])
    )
    across, down = pixels[1] - pixels[0], pixels[2] - pixels[0]
    for n in range(len(field)):
        a = min(float(field.opacities[n]), 0.9999)
        k = np.arange(1, 1500)[:, None]
        rho = (a**k / k * np.sqrt(k / (2 * np.pi)) * np.exp(-0.5 * k * radii * radii)).sum(axis=0)
        A = turns[n] * scales[n]
        edges = np.clip(cube / scales[n], 0.06, 0.6)
        rows = [np.arange(-np.ceil(REACH / e), np.ceil(REACH / e) + 1) * e for e in edges]
        z = np.stack(np.meshgrid(*rows, indexing="ij"), axis=-1).reshape(-1, 3)
        z = z[np.linalg.norm(z, axis=1) < REACH]
        points = field.means[n] + z @ A.T
        jacobian = np.tile(np.eye(3), (len(z), 1, 1))
        if edit is not None:
            mapped = to_deformed(edit.exact_warp, points)
            points, jacobian = mapped.points, mapped.jacobian
        _count(
            z, points, jacobian @ A, edges, rho, radii[1], colors[n], origin, forward,
            np.ascontiguousarray(rotation[:, 0]), np.ascontiguousarray(rotation[:, 1]),
            pixels[0], across, down, first, layer, counted, n,
        )  # fmt: skip
    picture, through = np.zeros((*shape, 3)), np.ones(shape)
    for depth in counted.astype(np.float64):
        tau = depth[..., 3]
        lost = through * -np.expm1(-tau)
        picture += (lost / np.maximum(tau, 1e-30))[..., None] * depth[..., :3]
        through *= np.exp(-tau)
    return picture + through[..., None]


@numba.njit(cache=True)
def _count(
    z, points, M, edges, rho, step, color, origin, forward, right, up, middle, across, down, first, layer,
    counted, seed,
):  # fmt: skip
    np.random.seed(seed)
    volume = edges[0] * edges[1] * edges[2] / POINTS**3
    layers, height, width, _ = counted.shape
    pixel = abs(across[0] * down[1] - across[1] * down[0])
    for n in range(len(z)):
        determinant = np.linalg.det(M[n])
        inverse = np.linalg.inv(M[n])
        for i in range(POINTS**3):
            part = np.array([i % POINTS, i // POINTS % POINTS, i // POINTS**2])
            dz = ((part + np.random.random(3)) / POINTS - 0.5) * edges
            q = z[n] + dz
            radius = np.sqrt(q @ q) / step
            low = int(radius)
            if low + 1 >= len(rho):
                continue
            density = rho[low] + (radius - low) * (rho[low + 1] - rho[low])
            from_camera = points[n] + M[n] @ dz - origin
            depth = from_camera @ forward
            bin = int((depth - first) / layer)
            if bin < 0 or bin >= layers:
                continue
            x = from_camera @ right / depth
            y = from_camera @ up / depth
            px = int(np.floor(middle[0] + x * across[0] + y * down[0]))
            py = int(np.floor(middle[1] + x * across[1] + y * down[1]))
            if px < 0 or py < 0 or px >= width or py >= height:
                continue
            length = np.sqrt(from_camera @ from_camera)
            bulk = inverse @ (from_camera / length)
            area = abs(determinant) * np.sqrt(bulk @ bulk) * length / depth  # on a plane of one depth
            tau = density * volume * area * pixel / (depth * depth)
            counted[bin, py, px, 3] += tau
            for c in range(3):
                counted[bin, py, px, c] += tau * color[c]
