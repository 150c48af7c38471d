"""The way of a linear map: the rotation turns evenly, the stretch is log-linear.

With F_1 F_0^-1 = R S the polar decomposition, F(t) = e^(-k sin(pi t)) R^t S^t F_0: the rotation goes about a
fixed axis, by 180 degrees at most, and k >= 0 shrinks everything on its way.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from cagefield.typing import Array


@dataclass(frozen=True)
class LinearMotion:
    """F(t) from `start` [3,3] at t = 0 to `end` [3,3] at t = 1, both with positive determinants."""

    start: Array
    end: Array

    @cached_property
    def _turn(self) -> tuple[Array, Array, Array]:
        """(rotation vector [3], logarithms of the stretch [3], its directions as columns [3,3])."""
        U, s, Vt = np.linalg.svd(self.end @ np.linalg.inv(self.start))
        return Rotation.from_matrix(U @ Vt).as_rotvec(), np.log(s), Vt.T

    def at(self, t: Array, shrink: float = 0.0) -> tuple[Array, Array]:
        """(F [T,3,3], dF/dt [T,3,3]) at times t [T], with k = `shrink`."""
        turn, stretch, V = self._turn
        x, y, z = turn
        omega = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])  # omega v = turn x v
        angle = float(np.linalg.norm(turn))
        # e^(t omega), by Rodrigues' formula.
        along = t * np.sinc(t * (angle / np.pi))
        twice = 0.5 * (t * np.sinc(t * (0.5 * angle / np.pi))) ** 2
        R = np.eye(3) + along[:, None, None] * omega + twice[:, None, None] * (omega @ omega)
        grown = np.exp(t[:, None] * stretch - (shrink * np.sin(np.pi * t))[:, None])
        last = V.T @ self.start
        F = R @ (V * grown[:, None, :]) @ last
        rate = stretch - (shrink * np.pi * np.cos(np.pi * t))[:, None]
        return F, omega @ F + R @ (V * (grown * rate)[:, None, :]) @ last

    @cached_property
    def rates(self) -> tuple[float, float]:
        """(angle of the rotation, largest logarithm of a stretch): the norms of dF/dt F^-1, without k."""
        turn, stretch, _ = self._turn
        return float(np.linalg.norm(turn)), float(np.abs(stretch).max())
