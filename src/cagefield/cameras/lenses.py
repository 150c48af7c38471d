"""Lens models: where a direction in front of a lens lands on the image plane, and back.

Notation: directions are in OpenCV camera axes (x right, y down, z forward); image points are normalized,
that is (pixel - c) / f. `coefficients` are the lens's distortion coefficients:
  pinhole         none: (x, y) = (X/Z, Y/Z)
  opencv          k1, k2, p1, p2 [, k3 [, k4]]: with s = x^2 + y^2, g = 1 + k1 s + k2 s^2 + k3 s^3 + k4 s^4,
                  x' = g x + 2 p1 x y + p2 (s + 2 x^2),  y' = g y + p1 (s + 2 y^2) + 2 p2 x y
  opencv_fisheye  k1, k2, k3, k4: with t the angle to the axis, the image is at the distance
                  t' = t (1 + k1 t^2 + k2 t^4 + k3 t^6 + k4 t^8) from the center
A radial polynomial may stop growing at some radius (or angle): it folds there; nothing beyond has an image.

Source: OpenCV `calib3d` (projectPoints, fisheye); k4 of the opencv model as in nerfstudio.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, Literal

import numpy as np

from cagefield.typing import Array, Mask

Lens = Literal["pinhole", "opencv", "opencv_fisheye"]

COEFFICIENTS: Final[dict[str, tuple[int, ...]]] = {
    "pinhole": (0,),
    "opencv": (4, 5, 6),
    "opencv_fisheye": (4,),
}
"""Allowed numbers of distortion coefficients of each lens model."""

_MAX_PLANE_RADIUS = 1e3  # largest |(X/Z, Y/Z)| of an opencv lens: 89.94 degrees off its axis


def project(directions: Array, model: Lens, coefficients: Sequence[float] = ()) -> Array:
    """Normalized image points [N,2] of camera-space `directions` [N,3] of any length.

    NaN where a direction has no image: on or behind the plane of a pinhole or opencv lens, straight backwards
    for a fisheye, and beyond the radius where the distortion polynomial folds.
    """
    x, y, z = directions.T
    if model == "opencv_fisheye":
        radial = radial_coefficients(model, coefficients)
        r = np.hypot(x, y)
        angle = np.arctan2(r, z)
        scale = _curve(angle, radial) / np.where(r > 0, r, 1.0)
        has_image = (angle <= polynomial_fold(radial, np.pi)) & ((r > 0) | (z > 0))
        return np.where(has_image[:, None], np.stack([x * scale, y * scale], axis=1), np.nan)
    in_front = z > 0
    plane = np.stack([x, y], axis=1) / np.where(in_front, z, 1.0)[:, None]
    if model == "opencv":
        in_front &= np.hypot(*plane.T) <= polynomial_fold(
            radial_coefficients(model, coefficients), _MAX_PLANE_RADIUS
        )
        plane = distort(plane, coefficients)
    return np.where(in_front[:, None], plane, np.nan)


def unproject(image: Array, model: Lens, coefficients: Sequence[float] = ()) -> tuple[Array, Mask]:
    """Unit camera-space directions [N,3] seen at normalized image points `image` [N,2], and a mask [N].

    The inverse of `project`, to rounding. An image point that no direction reaches (outside the fold) gets
    the nearest direction that the lens does see, and False in the mask.
    """
    radius = np.hypot(*image.T)
    safe = np.where(radius > 0, radius, 1.0)
    if model == "opencv_fisheye":
        angle, is_reached = _invert_curve(radius, radial_coefficients(model, coefficients), np.pi)
        sine = np.sin(angle) / safe
        return np.stack([image[:, 0] * sine, image[:, 1] * sine, np.cos(angle)], axis=1), is_reached
    plane, is_reached = image, np.ones(len(image), dtype=bool)
    if model == "opencv":
        undistorted, is_reached = _invert_curve(
            radius, radial_coefficients(model, coefficients), _MAX_PLANE_RADIUS
        )
        plane = image * (undistorted / safe)[:, None]
        if coefficients[2] or coefficients[3]:
            plane, is_reached = _undistort(image, plane, is_reached, coefficients)
    directions = np.concatenate([plane, np.ones((len(plane), 1))], axis=1)
    return directions / np.linalg.norm(directions, axis=1, keepdims=True), is_reached


def radial_coefficients(model: Lens, coefficients: Sequence[float]) -> Array:
    """Radial coefficients k1..k4 [4] of `model`."""
    if model == "opencv_fisheye":
        return np.array(coefficients, dtype=np.float64)
    k1, k2, _, _, k3, k4 = (*coefficients, 0.0, 0.0)[:6]
    return np.array([k1, k2, k3, k4], dtype=np.float64)


def _curve(r: Array, k: Array) -> Array:
    """Distorted radius r (1 + k1 r^2 + k2 r^4 + k3 r^6 + k4 r^8)."""
    s = r * r
    return np.asarray(r * (1.0 + s * (k[0] + s * (k[1] + s * (k[2] + s * k[3])))))


def _curve_slope(r: Array, k: Array) -> Array:
    """Derivative of `_curve` by r."""
    s = r * r
    return np.asarray(1.0 + s * (3 * k[0] + s * (5 * k[1] + s * (7 * k[2] + s * 9 * k[3]))))


def fold_radius(model: Lens, coefficients: Sequence[float] = ()) -> float:
    """Largest |(X/Z, Y/Z)| that has an image: where the distortion folds, or a lens's own limit."""
    if model == "pinhole":
        return float("inf")
    if model == "opencv_fisheye":
        fold = polynomial_fold(radial_coefficients(model, coefficients), np.pi)
        return float(np.tan(min(fold, np.arctan(_MAX_PLANE_RADIUS))))
    return polynomial_fold(radial_coefficients(model, coefficients), _MAX_PLANE_RADIUS)


def polynomial_fold(k: Array, limit: float) -> float:
    """Radius up to which `_curve` grows: its first stationary point, at most `limit`."""
    slope = np.array([1.0, 3 * k[0], 5 * k[1], 7 * k[2], 9 * k[3]])  # in powers of r^2
    slope[np.abs(slope) * float(limit) ** (2 * np.arange(5)) < 1e-9] = 0.0
    roots = np.roots(slope[::-1])
    real = roots.real[(np.abs(roots.imag) <= 1e-9 * np.abs(roots)) & (roots.real > 0)]
    return float(min(limit, np.sqrt(real.min()))) if len(real) else limit


def _invert_curve(target: Array, k: Array, limit: float) -> tuple[Array, Mask]:
    """(r in [0, fold] with `_curve`(r) = target, mask of the reached targets), by bracketed Newton's method.

    Where the target is not reached, r is the fold.
    """
    fold = polynomial_fold(k, limit)
    top = float(_curve(np.array([fold]), k)[0])
    is_reached = target <= top
    target = np.minimum(target, top)
    low, high = np.zeros_like(target), np.full_like(target, fold)
    r = np.minimum(target, high)
    before = np.full_like(target, np.inf)
    for _ in range(100):
        error = _curve(r, k) - target
        done = np.abs(error) <= 1e-14 * (1.0 + target)
        if np.all(done):
            break
        low, high = np.where(error <= 0, r, low), np.where(error >= 0, r, high)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            newton = r - error / _curve_slope(r, k)
        is_newton = (newton >= low) & (newton <= high) & (np.abs(error) <= 0.5 * before)
        r = np.where(done, r, np.where(is_newton, newton, 0.5 * (low + high)))
        before = np.where(is_newton, np.abs(error), np.inf)
    return r, is_reached


def distort(plane: Array, coefficients: Sequence[float]) -> Array:
    """Image points [N,2] by the opencv model of undistorted points `plane` [N,2]."""
    x, y = plane.T
    p1, p2 = coefficients[2], coefficients[3]
    s = x * x + y * y
    k = radial_coefficients("opencv", coefficients)
    g = 1.0 + s * (k[0] + s * (k[1] + s * (k[2] + s * k[3])))
    return np.stack(
        [g * x + 2 * p1 * x * y + p2 * (s + 2 * x * x), g * y + p1 * (s + 2 * y * y) + 2 * p2 * x * y], axis=1
    )


def distort_jacobian(plane: Array, coefficients: Sequence[float]) -> tuple[Array, Array, Array]:
    """Entries a, b, d [N] each of the symmetric Jacobian [[a, b], [b, d]] of `distort`."""
    x, y = plane.T
    p1, p2 = coefficients[2], coefficients[3]
    s = x * x + y * y
    k = radial_coefficients("opencv", coefficients)
    g = 1.0 + s * (k[0] + s * (k[1] + s * (k[2] + s * k[3])))
    g_slope = 2.0 * (k[0] + s * (2 * k[1] + s * (3 * k[2] + s * 4 * k[3])))  # dg/dx = g_slope x
    a = g + g_slope * x * x + 2 * p1 * y + 6 * p2 * x
    b = g_slope * x * y + 2 * p1 * x + 2 * p2 * y
    d = g + g_slope * y * y + 6 * p1 * y + 2 * p2 * x
    return a, b, d


def _undistort(
    image: Array, start: Array, start_reached: Mask, coefficients: Sequence[float]
) -> tuple[Array, Mask]:
    """(points [N,2] whose opencv image is `image` [N,2], mask [N] of found ones), by damped Newton from
    `start`.
    """
    fold = polynomial_fold(radial_coefficients("opencv", coefficients), _MAX_PLANE_RADIUS)
    plane = start
    residual = distort(plane, coefficients) - image
    size = np.hypot(*residual.T)
    damping = np.ones_like(size)
    tolerance = 1e-14 * (1.0 + np.hypot(*image.T))
    for _ in range(60):
        if np.all((size <= tolerance) | (damping < 1e-6)):
            break
        a, b, d = distort_jacobian(plane, coefficients)
        with np.errstate(
            all="ignore"
        ):  # a singular Jacobian gives a step that is not finite, hence not better
            u, v = residual.T
            step = np.stack([d * u - b * v, a * v - b * u], axis=1) / (a * d - b * b)[:, None]
            trial = plane - damping[:, None] * step
            trial_residual = distort(trial, coefficients) - image
            trial_size = np.hypot(*trial_residual.T)
        is_better = (trial_size < size) & (np.hypot(*trial.T) <= fold)
        plane = np.where(is_better[:, None], trial, plane)
        residual = np.where(is_better[:, None], trial_residual, residual)
        size = np.where(is_better, trial_size, size)
        damping = np.where(is_better, np.minimum(1.0, 2.0 * damping), 0.5 * damping)
    is_found = size <= 1e-9 * (1.0 + np.hypot(*image.T))
    return np.where((is_found | start_reached)[:, None], plane, start), is_found
