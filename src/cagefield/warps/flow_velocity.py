"""The velocity of the flow shell, v(x, t) = w(x, t) V(x, t), and its slope, in float64: the kernels' oracle.

V is that of the inner cage's motion, with which all of space would go along; w is 1 in the inner cage and 0
outside the outer. Notation and source: `flow_shell.FlowShell`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cagefield.typing import Array, Mask
from cagefield.warps.extended_coordinates import Extended
from cagefield.warps.falloff import Falloff
from cagefield.warps.trilinear_bend import bend, bend_slope

POWER = 4
"""Exponent p of the distances' norm."""


@dataclass
class Coordinates:
    """Coordinates [N,3] of the marching points in the outer and the inner cage: the next Newton's starts."""

    outer: Array | None
    inner: Array | None


@dataclass(frozen=True)
class FlowVelocity:
    """The velocity at one time: the inner cage then, dc/dt [3], dF/dt [3,3], dK/dt [4,3]; the outer cage, the
    falloff and its coefficients (a, b).
    """

    inner: Extended
    center_rate: Array
    frame_rate: Array
    bend_rate: Array
    outer: Extended
    falloff: Falloff
    coefficients: tuple[float, float]

    def at(self, x: Array, at: Coordinates) -> tuple[Array, Array]:
        """(v [N,3], dv/dx [N,3,3]) at points x; `at` holds their coordinates of the last call, then these."""
        confines, cage = self.outer, self.inner
        at.outer, at.inner = confines.coordinates(x, at.outer), cage.coordinates(x, at.inner)
        v, G = np.zeros_like(x), np.zeros((len(x), 3, 3))
        rows: Mask = np.abs(at.outer).max(axis=1, initial=0.0) < 1.0
        z, xi = at.outer[rows], at.inner[rows]
        dz, dxi = confines.gradient(z), cage.gradient(xi)
        D = 0.5 * confines.heights * (1.0 - z * z)
        e = cage.heights * (np.abs(xi) - 1.0).clip(0.0)
        p = float(POWER)
        near, far = (e**p).sum(axis=1), (D**-p).sum(axis=1)  # d_i^p and d_o^-p
        q = (near * far) ** (1.0 / p)
        w, slope = self.falloff.weight(q, self.coefficients)
        # d log q = (d near / near + d far / far) / p; at near = 0, q and its gradient's share vanish.
        d_near = ((e ** (p - 1.0) * cage.heights * np.sign(xi))[:, None] @ dxi)[:, 0]
        d_far = ((D ** (-p - 1.0) * confines.heights * z)[:, None] @ dz)[:, 0]
        dq = q[:, None] * (d_near / np.maximum(near, 1e-300)[:, None] + d_far / far[:, None])
        V, dV = self.of_cage(x[rows], xi, dxi)
        v[rows] = w[:, None] * V
        G[rows] = w[:, None, None] * dV + V[:, :, None] * (slope[:, None] * dq)[:, None]
        return v, G

    def of_cage(self, x: Array, xi: Array, dxi: Array) -> tuple[Array, Array]:
        """(V [N,3], dV/dx [N,3,3]) at points x [N,3] with coordinates xi [N,3] and dxi/dx [N,3,3].

        V = dc/dt + dF/dt F^-1 (x - c) + F dB/dt(clamp(xi)): the velocity of the cage on its faces,
        independent of
        the coordinates around it.
        """
        clamped = xi.clip(-1.0, 1.0)
        y = (x - self.inner.center) @ self.inner.inverse.T
        V = self.center_rate + y @ self.frame_rate.T
        dV = np.broadcast_to(self.frame_rate @ self.inner.inverse, (len(xi), 3, 3))
        if self.bend_rate.any():
            inside = np.abs(xi) <= 1.0
            V = V + bend(self.bend_rate, clamped) @ self.inner.frame.T
            dV = dV + self.inner.frame @ (bend_slope(self.bend_rate, clamped) * inside[:, None]) @ dxi
        return V, dV
