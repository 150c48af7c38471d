"""TensoRF: density and appearance features as sums of products of planes and lines.

Notation: u in [-1,1]^3 are normalized coordinates of the box; plane i spans the axes (0,1), (0,2), (1,2),
line i the axis 2, 1, 0; P_i,c(u) and L_i,c(u) interpolate (bi)linearly, corners aligned.

    VM:  f_c(u) = P_i,c(u) L_i,c(u)  for each i,     CP:  f_c(u) = L_0,c(u) L_1,c(u) L_2,c(u)
    sigma = distance_scale * activation(sum_c f_c(u)),   softplus(x + density_shift) or relu(x)
    rgb = shading(B a(u), d),   a the products of the appearance components, B their basis [app_dim, C]

Shading is an MLP over (features, d, encodings), spherical harmonics of degree 2, relu(Y(d) . k + 1/2), or the
features themselves ("RGB"). Where the alpha mask interpolates to 0, sigma is 0.

Source: Chen et al., "TensoRF: Tensorial Radiance Fields" (2022), sections 3 and 4; layout and sampling of
github.com/apchenstu/TensoRF, models/tensorBase.py and tensoRF.py.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.errors import FieldError
from cagefield.fields.external.external_field import (
    frozen_array,
    frozen_box,
    number,
    whole_number,
)
from cagefield.typing import Float32

SHADINGS = ("MLP_Fea", "MLP_PE", "MLP", "SH", "RGB")
ACTIVATIONS = ("softplus", "relu")
MAX_RAY_SAMPLES = 1 << 16
"""Maximum number of samples on a ray; the authors' largest grids take about 2,000."""

_Group = tuple[Float32, ...]


@dataclass(frozen=True, eq=False)
class TensorfParameters:
    """Arrays and options of a TensoRF model (canonical space, world units).

    Attributes:
        box: [2,3] corners that the planes and lines span.
        density_planes, appearance_planes: three arrays [C,H,W] each (W along the plane's first axis); empty
            for CP.
        density_lines, appearance_lines: three arrays [C,L] each.
        basis: [app_dim, C] matrix from appearance components to features.
        mlp: three (weight [out,in], bias [out]) pairs; empty for SH and RGB.
        mask: [Z,Y,X] bool alpha mask over `mask_box`; None without.
        shading: one of SHADINGS. activation: one of ACTIVATIONS.
        density_shift: added before softplus. distance_scale: factor of the density.
        step: distance of samples, world units. near_far: distances between which rays enter the box.
        color_weight: samples of a weight up to this one stay black.
        position_octaves, view_octaves, feature_octaves: frequencies of the MLP's encodings.

    Raises:
        FieldError: arrays that do not fit each other, unknown options, NaN or infinity.
    """

    box: NDArray[np.float64]
    density_planes: _Group
    density_lines: _Group
    appearance_planes: _Group
    appearance_lines: _Group
    basis: Float32
    mlp: tuple[tuple[Float32, Float32], ...]
    mask: NDArray[np.bool_] | None = None
    mask_box: NDArray[np.float64] | None = None
    shading: str = "MLP_Fea"
    activation: str = "softplus"
    density_shift: float = -10.0
    distance_scale: float = 25.0
    step: float = 0.01
    near_far: tuple[float, float] = (2.0, 6.0)
    color_weight: float = 1e-4
    position_octaves: int = 6
    view_octaves: int = 6
    feature_octaves: int = 6

    def __post_init__(self) -> None:
        def fix(name: str, value: Any) -> None:
            object.__setattr__(self, name, value)

        fix("box", frozen_box("aabb", self.box))
        for name in ("density_planes", "appearance_planes"):
            fix(name, _group(name, getattr(self, name), (None, None, None)))
        for name in ("density_lines", "appearance_lines"):
            fix(name, _group(name, getattr(self, name), (None, None)))
        self._check_options(fix)
        components = self._check_components()
        fix("basis", frozen_array("basis_mat", self.basis, np.float32, (None, components)))
        self._check_shading(fix)
        if self.mask is not None:
            fix("mask", frozen_array("alphaMask", self.mask, np.bool_, (None, None, None)))
            fix(
                "mask_box", frozen_box("alphaMask.aabb", self.box if self.mask_box is None else self.mask_box)
            )

    def _check_options(self, fix: Any) -> None:
        if self.shading not in SHADINGS:
            raise FieldError(
                f"shadingMode is {self.shading!r:.40}; expected one of {', '.join(SHADINGS)}: train with one "
                "of them, or the photos here: cagefield train PHOTOS -o SCENE"
            )
        if self.activation not in ACTIVATIONS:
            raise FieldError(f"fea2denseAct is {self.activation!r:.40}; expected softplus or relu")
        fix("density_shift", number("density_shift", self.density_shift, -1e4, 1e4))
        fix("distance_scale", number("distance_scale", self.distance_scale, 1e-6, 1e6))
        fix("color_weight", number("rayMarch_weight_thres", self.color_weight, 0.0, 1.0))
        diagonal = float(np.linalg.norm(self.box[1] - self.box[0]))
        fix("step", number("step of samples", self.step, diagonal / MAX_RAY_SAMPLES, diagonal))
        if not isinstance(self.near_far, (tuple, list)) or len(self.near_far) != 2:
            raise FieldError(f"near_far must be two distances, got {self.near_far!r:.60}")
        near, far = (number("near_far", value, 0.0, 1e9) for value in self.near_far)
        if not near < far:
            raise FieldError(f"near_far must satisfy near < far, got {near:g} and {far:g}")
        fix("near_far", (near, far))
        for name in ("position_octaves", "view_octaves", "feature_octaves"):
            fix(name, whole_number(name, getattr(self, name), 0, 32))

    def _check_components(self) -> int:
        """Number of appearance components, after a check of all groups."""
        for kind in ("density", "appearance"):
            planes, lines = getattr(self, f"{kind}_planes"), getattr(self, f"{kind}_lines")
            if len(lines) != 3 or len(planes) not in (0, 3):
                raise FieldError(
                    f"{kind} must have 3 lines and 3 or no planes, got {len(lines)}, {len(planes)}"
                )
            counts = [len(line) for line in lines]
            if planes and counts != [len(plane) for plane in planes]:
                raise FieldError(f"{kind} planes have {[len(p) for p in planes]} components, lines {counts}")
            if not planes and len(set(counts)) > 1:
                raise FieldError(f"{kind} lines of CP must have equal numbers of components, got {counts}")
        if bool(self.density_planes) != bool(self.appearance_planes):
            raise FieldError("density and appearance must both have planes (VM) or both none (CP)")
        counts = [len(line) for line in self.appearance_lines]
        return sum(counts) if self.appearance_planes else counts[0]

    def _check_shading(self, fix: Any) -> None:
        features = len(self.basis)
        if self.shading in ("SH", "RGB"):
            expected = {"SH": 27, "RGB": 3}[self.shading]
            if features != expected or self.mlp:
                raise FieldError(
                    f"{self.shading} shading needs {expected} features and no MLP, got {features}"
                )
            return
        inputs = features + 3 + 6 * self.view_octaves
        if self.shading == "MLP_Fea":
            inputs += 2 * self.feature_octaves * features
        if self.shading == "MLP_PE":
            inputs += 6 * self.position_octaves
        if len(self.mlp) != 3:
            raise FieldError(f"the MLP must have 3 layers, got {len(self.mlp)}")
        layers = []
        for index, (weight, bias) in enumerate(self.mlp):
            outputs = 3 if index == 2 else None
            weight = frozen_array(f"MLP layer {index}", weight, np.float32, (outputs, inputs))
            bias = frozen_array(f"MLP bias {index}", bias, np.float32, (len(weight),))
            layers.append((weight, bias))
            inputs = len(weight)
        fix("mlp", tuple(layers))


def _group(name: str, arrays: Any, shape: tuple[int | None, ...]) -> _Group:
    return tuple(
        frozen_array(f"{name}.{index}", array, np.float32, shape) for index, array in enumerate(arrays)
    )
