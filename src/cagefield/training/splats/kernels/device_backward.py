"""Gradients and curvatures of each splat's parameters on Quadrants' devices; see `splat_backward`.

One thread has one splat. Everything is float32, so that expressions differ from those of `splat_backward`
where a difference of large numbers would cancel. With a_j = s_j k_j the splat's axes on the screen, a_x and
a_y the rows of the matrix [2,3] of these columns, F = M C M^T = sum a_j a_j^T and det F = |a_x x a_y|^2. With
B = BLUR and D = det(F + B I),

    K = F^-1 - (F + B I)^-1 = B / (det F  D) [F_yy^2 + F_xy^2 + B F_yy, -F_xy (F_xx + F_yy + B); .., likewise]

The oracle is finite differences of `cagefield.rendering.splats.reference_rasterizer`.
"""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

from cagefield.compute.quadrants import qd
from cagefield.rendering.splats.kernels.blending import SUMS
from cagefield.rendering.splats.kernels.device_rasterizer import distort
from cagefield.rendering.splats.kernels.device_splat_args import CameraArgs, mat3, vec2, vec4, vec6
from cagefield.rendering.splats.kernels.projection import BLUR, LEAST_COMPENSATION
from cagefield.rendering.voxels.kernels.grid import F32, I32, U8, vec3
from cagefield.training.splats.kernels.device_args import ParameterArgs
from cagefield.training.splats.kernels.splat_backward import CURVATURE_FLOATS, GRADIENT_FLOATS

LENS_STEP = 5e-3
"""Finite-difference step of the lens's second derivative, in normalized coordinates n; float32 needs a long
one."""

vec20 = qd.types.vector(SUMS, qd.f32)
GradientRow = qd.types.vector(GRADIENT_FLOATS, qd.f32)
CurvatureRow = qd.types.vector(CURVATURE_FLOATS, qd.f32)


@qd.func
def rotation(quaternions: qd.template(), i: qd.i32):
    """Rotation matrix [3,3] of unit quaternion i."""
    w = quaternions[4 * i]
    a = quaternions[4 * i + 1]
    b = quaternions[4 * i + 2]
    c = quaternions[4 * i + 3]
    return mat3(
        [
            [1.0 - 2.0 * (b * b + c * c), 2.0 * (a * b - w * c), 2.0 * (a * c + w * b)],
            [2.0 * (a * b + w * c), 1.0 - 2.0 * (a * a + c * c), 2.0 * (b * c - w * a)],
            [2.0 * (a * c - w * b), 2.0 * (b * c + w * a), 1.0 - 2.0 * (a * a + b * b)],
        ]
    )


@qd.func
def scales(log_scales: qd.template(), i: qd.i32):
    """Standard deviations [3] of splat i, world units."""
    return qd.exp(vec3(log_scales[3 * i], log_scales[3 * i + 1], log_scales[3 * i + 2]))


@qd.kernel(fastcache=True)
def build_covariances(
    parameters: ParameterArgs, kept: U8, masked: qd.i32, covariances: F32, opacities: F32, count: qd.i32
):
    """Write covariances [N,6] and opacities [N] of the parameters.

    Where `masked` is 1, opacities are 0 where `kept` [N] is 0.
    """
    qd.loop_config(block_dim=128)
    for i in range(count):
        R = rotation(parameters.quaternions, i)
        s = scales(parameters.log_scales, i)
        at = 6 * i
        for m in qd.static(range(3)):
            for n in qd.static(range(m, 3)):
                total = 0.0
                for j in qd.static(range(3)):
                    total += R[m, j] * R[n, j] * s[j] * s[j]
                covariances[at] = total
                at += 1
        opacities[i] = 1.0 / (1.0 + qd.exp(-parameters.logits[i]))
        if masked == 1:
            if kept[i] == 0:
                opacities[i] = 0.0


@qd.func
def bilinear(g: vec3, a: vec2, b: vec2):
    """Bilinear form a^T (g0 g1; g1 g2) b."""
    return g[0] * a[0] * b[0] + g[1] * (a[0] * b[1] + a[1] * b[0]) + g[2] * a[1] * b[1]


@qd.func
def quartic(s: vec20, a: vec2, b: vec2):
    """Sum of h (a.e)^2 (b.e)^2 from the moments s[14] to s[18]."""
    p = vec3(a[0] * b[0], a[0] * b[1] + a[1] * b[0], a[1] * b[1])
    return (
        p[0] * p[0] * s[14]
        + 2.0 * p[0] * p[1] * s[15]
        + (2.0 * p[0] * p[2] + p[1] * p[1]) * s[16]
        + 2.0 * p[1] * p[2] * s[17]
        + p[2] * p[2] * s[18]
    )


@qd.func
def screen_rows(n: vec2, lens: vec6, inverse_z: qd.f32, camera: CameraArgs):
    """Derivative M [2,3] of the pixel by the world position, for `lens`, the result of `distort` at n."""
    W0 = vec3(camera.W[0, 0], camera.W[0, 1], camera.W[0, 2])
    W1 = vec3(camera.W[1, 0], camera.W[1, 1], camera.W[1, 2])
    W2 = vec3(camera.W[2, 0], camera.W[2, 1], camera.W[2, 2])
    px = (W0 - n.x * W2) * inverse_z
    py = (W1 - n.y * W2) * inverse_z
    M0 = camera.focal.x * (lens[2] * px + lens[3] * py)
    M1 = camera.focal.y * (lens[4] * px + lens[5] * py)
    return qd.Matrix([[M0.x, M0.y, M0.z], [M1.x, M1.y, M1.z]])


@qd.func
def lens_bend(n: vec2, camera: CameraArgs, model: qd.template(), e: vec4):
    """Derivative [2] by n of sum e D, D the lens's derivative by rows, e [4] held."""
    result = vec2(0.0, 0.0)
    for axis in qd.static(range(2)):
        step = vec2(0.0, 0.0)
        step[axis] = LENS_STEP
        ahead = distort(n.x + step.x, n.y + step.y, camera.coefficients, model)
        behind = distort(n.x - step.x, n.y - step.y, camera.coefficients, model)
        for j in qd.static(range(4)):
            result[axis] += e[j] * (ahead[2 + j] - behind[2 + j]) / (2.0 * LENS_STEP)
    return result


@qd.kernel(fastcache=True)
def backpropagate(
    boxes: I32,
    sums: F32,
    parameters: ParameterArgs,
    opacities: F32,
    camera: CameraArgs,
    antialiased: qd.i32,
    gradients: F32,
    curvatures: F32,
    count: qd.i32,
    model: qd.template(),
):
    """Write gradients and curvatures of the splats with tiles in `boxes` [N,4] from their `sums` [N,SUMS].

    Results as those of `splat_backward.backpropagate`, without the viewing direction of the color.
    """
    qd.loop_config(block_dim=128)
    for i in range(count):
        if boxes[4 * i + 1] > boxes[4 * i]:
            s = vec20(0.0)
            for j in qd.static(range(SUMS)):
                s[j] = sums[SUMS * i + j]
            offset = (
                vec3(parameters.means[3 * i], parameters.means[3 * i + 1], parameters.means[3 * i + 2])
                - camera.origin
                - camera.origin_rest
            )
            p = camera.W @ offset
            iz = 1.0 / p.z
            true_n = vec2(p.x * iz, p.y * iz)
            n = vec2(
                qd.min(camera.limits[1], qd.max(camera.limits[0], true_n.x)),
                qd.min(camera.limits[3], qd.max(camera.limits[2], true_n.y)),
            )
            lens = distort(n.x, n.y, camera.coefficients, model)
            M = screen_rows(n, lens, iz, camera)
            R = rotation(parameters.quaternions, i)
            k = M @ R
            scale = scales(parameters.log_scales, i)
            # Axes on the screen: k_j of unit length in the world, a_j of one sigma.
            k0 = vec3(k[0, 0], k[0, 1], k[0, 2])
            k1 = vec3(k[1, 0], k[1, 1], k[1, 2])
            a0 = scale * k0
            a1 = scale * k1
            K = vec3(0.0)
            if antialiased == 1:
                f0 = a0.dot(a0)
                f1 = a0.dot(a1)
                f2 = a1.dot(a1)
                normal = a0.cross(a1)
                sharp = normal.dot(normal)
                det = sharp + BLUR * (f0 + f2 + BLUR)
                if sharp > LEAST_COMPENSATION * LEAST_COMPENSATION * det:
                    share = BLUR / sharp / det
                    K = vec3(
                        share * (f2 * f2 + f1 * f1 + BLUR * f2),
                        -share * f1 * (f0 + f2 + BLUR),
                        share * (f0 * f0 + f1 * f1 + BLUR * f0),
                    )
            g = vec3(
                0.5 * (s[3] + s[0] * K[0]),
                0.5 * (s[4] + s[0] * K[1]),
                0.5 * (s[5] + s[0] * K[2]),
            )
            G = GradientRow(0.0)
            H = CurvatureRow(0.0)
            h = vec3(s[11], s[12], s[13])
            o = opacities[i]
            for j in qd.static(range(3)):
                a = vec2(a0[j], a1[j])
                G[3 + j] = 2.0 * bilinear(g, a, a)
            for j in qd.static(range(3)):
                km = vec2(k0[(j + 1) % 3], k1[(j + 1) % 3])
                kn = vec2(k0[(j + 2) % 3], k1[(j + 2) % 3])
                sm = scale[(j + 1) % 3]
                sn = scale[(j + 2) % 3]
                u = (sm - sn) * (sm + sn) * km
                G[6 + j] = 2.0 * bilinear(g, u, kn)
                kappa = bilinear(K, u, kn)
                H[12 + j] = quartic(s, u, kn) + 2.0 * kappa * bilinear(h, u, kn) + kappa * kappa * s[10]
            G[9] = s[0] * (1.0 - o)
            G[10] = s[6]
            G[11] = s[7]
            G[12] = s[8]
            G[13] = qd.sqrt(s[1] * s[1] + s[2] * s[2])
            G[14] = s[9]
            G[15] = s[19]
            # The mean, through M: dL/dM = 2 G M C, in camera axes.
            v0 = R @ (scale * a0)
            v1 = R @ (scale * a1)
            j0 = camera.W @ (2.0 * camera.focal.x * (g[0] * v0 + g[1] * v1))
            j1 = camera.W @ (2.0 * camera.focal.y * (g[1] * v0 + g[2] * v1))
            # J / diag(f) = D [iz, 0, -nx iz; 0, iz, -ny iz]: through the matrix on the right of D.
            p00 = lens[2] * j0[0] + lens[4] * j1[0]
            p02 = lens[2] * j0[2] + lens[4] * j1[2]
            p11 = lens[3] * j0[1] + lens[5] * j1[1]
            p12 = lens[3] * j0[2] + lens[5] * j1[2]
            c = vec3(0.0, 0.0, -iz * iz * (p00 + p11 - n.x * p02 - n.y * p12))
            by_n = vec2(-iz * p02, -iz * p12)
            if qd.static(model != 0):
                # Through D.
                by_n += lens_bend(
                    n,
                    camera,
                    model,
                    iz
                    * vec4(
                        j0[0] - n.x * j0[2], j0[1] - n.y * j0[2], j1[0] - n.x * j1[2], j1[1] - n.y * j1[2]
                    ),
                )
            if camera.limits[0] < true_n.x and true_n.x < camera.limits[1]:
                c.x += by_n.x * iz
                c.z -= by_n.x * true_n.x * iz
            if camera.limits[2] < true_n.y and true_n.y < camera.limits[3]:
                c.y += by_n.y * iz
                c.z -= by_n.y * true_n.y * iz
            # The mean, through its projection, where n is not clamped.
            true_lens = distort(true_n.x, true_n.y, camera.coefficients, model)
            P = screen_rows(true_n, true_lens, iz, camera)
            for j in qd.static(range(3)):
                G[j] = (
                    c.x * camera.W[0, j]
                    + c.y * camera.W[1, j]
                    + c.z * camera.W[2, j]
                    + s[1] * P[0, j]
                    + s[2] * P[1, j]
                )
            for m in qd.static(range(3)):
                for j in qd.static(range(m, 3)):
                    at = qd.static(m * (5 - m) // 2 + j)
                    H[at] = bilinear(h, vec2(P[0, m], P[1, m]), vec2(P[0, j], P[1, j]))
                    am = vec2(a0[m], a1[m])
                    aj = vec2(a0[j], a1[j])
                    kappa_m = bilinear(K, am, am)
                    kappa_j = bilinear(K, aj, aj)
                    H[6 + at] = (
                        quartic(s, am, aj)
                        + kappa_m * bilinear(h, aj, aj)
                        + kappa_j * bilinear(h, am, am)
                        + kappa_m * kappa_j * s[10]
                    )
            H[15] = s[10] * (1.0 - o) * (1.0 - o)
            for j in qd.static(range(GRADIENT_FLOATS)):
                gradients[GRADIENT_FLOATS * i + j] = G[j]
            for j in qd.static(range(CURVATURE_FLOATS)):
                curvatures[CURVATURE_FLOATS * i + j] = H[j]
