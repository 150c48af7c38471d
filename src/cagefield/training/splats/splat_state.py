"""Splats in training: arrays that steps update in place, with the optimizer's state."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.fields.splat_field import SplatField
from cagefield.training.splats.kernels.gauss_newton_splats import MOMENTUM_FLOATS, RUNNING_FLOATS, AverageArgs
from cagefield.training.splats.kernels.splat_backward import CURVATURE_FLOATS, GRADIENT_FLOATS, ParameterArgs
from cagefield.typing import Float32


@dataclass(eq=False)
class SplatState:
    """N splats in training; arrays by row.

    means [N,3], log_scales [N,3], quaternions [N,4], logits [N] of the opacities, sh [N,K,3]: as in
    SplatField.
    momentum, running, ticks: state of `gauss_newton`; ticks below 0 mark frozen splats, which take no step.
    error [N], hits [N]: error and visits since the last
    densification. gradients, curvatures: of the last step, valid for the splats visible in it.
    """

    means: Float32
    log_scales: Float32
    quaternions: Float32
    logits: Float32
    sh: Float32
    momentum: Float32
    running: Float32
    ticks: NDArray[np.int32]
    error: Float32
    hits: NDArray[np.int32]
    gradients: Float32
    curvatures: Float32

    @classmethod
    def new(
        cls, means: NDArray[Any], scales: NDArray[Any], rgb: Float32, opacity: float, sh_degree: int
    ) -> SplatState:
        """Isotropic splats of means [N,3], standard deviations [N] and rgb [N,3]."""
        n = len(means)
        quaternions = np.zeros((n, 4), np.float32)
        quaternions[:, 0] = 1.0
        sh = np.zeros((n, (sh_degree + 1) ** 2, 3), np.float32)
        sh[:, 0] = (rgb - 0.5) / 0.28209479177387814
        return cls(
            np.array(means, np.float32),
            np.repeat(np.log(scales)[:, None], 3, axis=1).astype(np.float32),
            quaternions,
            np.full(n, np.log(opacity / (1.0 - opacity)), np.float32),
            sh,
            *_empty_optimizer_rows(n),
        )

    @classmethod
    def frozen_from(cls, field: SplatField, terms: int) -> SplatState:
        """Frozen splats of a field, with `terms` harmonics."""
        state = cls.from_field(field, terms)
        state.ticks[:] = -1
        return state

    @classmethod
    def from_field(cls, field: SplatField, terms: int) -> SplatState:
        """Splats of a field, with `terms` harmonics."""
        n, known = len(field), min(terms, field.sh.shape[1])
        opacities = np.clip(np.asarray(field.opacities, np.float64), 1e-4, 1.0 - 1e-4)
        sh = np.zeros((n, terms, 3), np.float32)
        sh[:, :known] = field.sh[:, :known]
        return cls(
            np.array(field.means, np.float32),
            np.array(field.log_scales, np.float32),
            np.array(field.quaternions, np.float32),
            np.log(opacities / (1.0 - opacities)).astype(np.float32),
            sh,
            *_empty_optimizer_rows(n),
        )

    def __len__(self) -> int:
        return len(self.means)

    @property
    def frozen(self) -> NDArray[np.bool_]:
        """Mask [N] of frozen splats."""
        return self.ticks < 0

    def parameter_args(self) -> ParameterArgs:
        """Parameters as kernel arguments."""
        return ParameterArgs(self.means, self.log_scales, self.quaternions, self.logits, self.sh)

    def average_args(self) -> AverageArgs:
        """Running means of gradient and curvature as kernel arguments."""
        return AverageArgs(self.momentum, self.running, self.ticks)

    def take(self, rows: NDArray[np.int64]) -> None:
        """Keep the given rows, in this order; a row may occur several times."""
        for field in fields(self):
            setattr(self, field.name, np.ascontiguousarray(getattr(self, field.name)[rows]))

    def append(self, other: SplatState) -> None:
        """Append the rows of another state."""
        for field in fields(self):
            both = np.concatenate([getattr(self, field.name), getattr(other, field.name)])
            setattr(self, field.name, both)

    def to_field(self, antialiased: bool, bounds: NDArray[np.float64], unbounded: bool) -> SplatField:
        """SplatField of the splats."""
        opacities = 1.0 / (1.0 + np.exp(-self.logits.astype(np.float64)))
        return SplatField(
            self.means,
            self.log_scales,
            self.quaternions,
            opacities.astype(np.float32),
            self.sh,
            antialiased,
            bounds,
            unbounded,
        )


def _empty_optimizer_rows(n: int) -> tuple[Any, ...]:
    """Zeroed optimizer arrays of n splats, in the order of SplatState's fields."""
    return (
        np.zeros((n, MOMENTUM_FLOATS), np.float32),
        np.zeros((n, RUNNING_FLOATS), np.float32),
        np.zeros(n, np.int32),
        np.zeros(n, np.float32),
        np.zeros(n, np.int32),
        np.zeros((n, GRADIENT_FLOATS), np.float32),
        np.zeros((n, CURVATURE_FLOATS), np.float32),
    )
