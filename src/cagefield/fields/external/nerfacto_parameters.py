"""nerfstudio's nerfacto: a hash grid with two perceptrons, sampled by proposal networks.

Notation: p world positions; c(p) = p where max|p_i| < 1, else (2 - 1/m) p/m with m = max|p_i| (contraction),
x = (c(p) + 2) / 4; without contraction x = (p - lower) / (upper - lower) in the box. F, P_k are networks over
hash grids, G a perceptron, Y spherical harmonics of degree 3.

    (h_0, f) = F(x),  sigma = density_scale exp(h_0) for 0 < x < 1, else 0
    rgb = sigmoid(G(Y(e), f, a)),   a the appearance embedding
    densities of the proposal networks: density_scale exp(P_k(x))

With layout "torch" e = (d + 1) / 2, which is nerfstudio's own; with "tcnn" e = d. The appearance embedding is
constant in a picture and is added to the bias of G's first layer by the reader.

Rays: bins even in s, s = t/2 for t < 1, else 1 - 1/(2t) ("piecewise"), or s = t ("uniform"), from 0 to far;
each proposal network's weights place the next bins at their quantiles, the last bins are the field's samples,
evaluated at their centers. With `endless` the last sample absorbs all that is left (background
"last_sample").

Source: Tancik et al., "Nerfstudio" (2023), section 4; layout and sampling of
github.com/nerfstudio-project/nerfstudio, nerfstudio/models/nerfacto.py, fields/nerfacto_field.py and
model_components/ray_samplers.py.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from cagefield.errors import FieldError
from cagefield.fields.external.external_field import ExternalField, frozen_box, number, whole_number
from cagefield.fields.external.hash_network import (
    HashNetwork,
    Layers,
    checked_layers,
    describe_layers,
    layer_arrays,
    take_array,
    take_layers,
)

SPACINGS = ("piecewise", "uniform")
DIRECTION_TERMS = 16
"""Number of spherical harmonics of degree 3."""
MAX_NERFACTO_SAMPLES = 1 << 14
"""Maximum number of samples on a ray in one round."""

_OPTIONS = ("contracted", "density_scale", "far", "samples", "spacing", "endless")


@dataclass(frozen=True, eq=False)
class NerfactoParameters(ExternalField):
    """nerfacto model (canonical space, world units: nerfstudio's own, after its dataparser).

    Attributes:
        box: [2,3] nerfstudio's scene box.
        base: network F with 1 + geometry features outputs.
        head: layers of G: inputs are 16 harmonics, then the geometry features; three outputs.
        proposals: networks P_k with one output; the last one serves all further rounds.
        contracted: all of space is contracted; else the field ends at `box`.
        density_scale: factor of the density. far: distance at which rays end.
        samples: numbers of samples of each proposal round, then of the field.
        spacing: one of SPACINGS. endless: the last sample absorbs all that is left.

    Raises:
        FieldError: networks that do not fit each other, options out of range.
    """

    KIND: ClassVar[str] = "NerfactoField"

    box: NDArray[np.float64]
    base: HashNetwork
    head: Layers
    proposals: tuple[HashNetwork, ...]
    contracted: bool = True
    density_scale: float = 1.0
    far: float = 1000.0
    samples: tuple[int, ...] = (256, 96, 48)
    spacing: str = "piecewise"
    endless: bool = True

    def __post_init__(self) -> None:
        def fix(name: str, value: Any) -> None:
            object.__setattr__(self, name, value)

        fix("box", frozen_box("aabb", self.box))
        if self.base.outputs < 2:
            raise FieldError(f"the density network must have 2 outputs or more, got {self.base.outputs}")
        fix("head", checked_layers("head", self.head, DIRECTION_TERMS + self.base.outputs - 1, 3))
        fix("proposals", tuple(self.proposals))
        for network in self.proposals:
            if network.outputs != 1:
                raise FieldError(f"a proposal network must have one output, got {network.outputs}")
        layouts = {network.grid.layout for network in (self.base, *self.proposals)}
        if len(layouts) > 1:
            raise FieldError("the networks must have one layout, got torch and tcnn")
        if not isinstance(self.samples, (tuple, list)) or not 1 <= len(self.samples) <= 16:
            raise FieldError(f"samples must be numbers of samples of each round, got {self.samples!r:.60}")
        fix(
            "samples",
            tuple(whole_number("number of samples", n, 1, MAX_NERFACTO_SAMPLES) for n in self.samples),
        )
        if len(self.samples) > 1 and not self.proposals:
            raise FieldError(f"samples are {list(self.samples)}, but there is no proposal network")
        fix("density_scale", number("average_init_density", self.density_scale, 1e-12, 1e12))
        fix("far", number("far_plane", self.far, 1e-6, 1e12))
        if self.spacing not in SPACINGS:
            raise FieldError(
                f"proposal_initial_sampler is {self.spacing!r:.40}; expected piecewise or uniform"
            )
        for name in ("contracted", "endless"):
            fix(name, bool(getattr(self, name)))

    @property
    def layout(self) -> str:
        """ "torch" or "tcnn", as of the hash grids."""
        return self.base.grid.layout

    @property
    def unbounded(self) -> bool:  # type: ignore[override]
        """Whether all of space is contracted."""
        return self.contracted

    @property
    def bounds(self) -> NDArray[np.float64]:
        """Corners [2,3] of the box; with contraction of the cube that it leaves as it is."""
        return np.array([[-1.0] * 3, [1.0] * 3]) if self.contracted else self.box

    def describe(self) -> str:
        """Layout, grid, networks, samples."""
        kind = {"torch": "PyTorch", "tcnn": "tiny-cuda-nn"}[self.layout]
        space = "contracted" if self.contracted else "box"
        return (
            f"nerfacto ({kind} layout): {self.base.grid}, MLPs {describe_layers(self.base.layers)} and "
            f"{describe_layers(self.head)}, {' + '.join(map(str, self.samples))} samples a ray, {space}"
        )

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Box, tables and layers by name."""
        found: dict[str, NDArray[Any]] = {"box": self.box, **self.base.arrays("base")}
        found |= layer_arrays("head", self.head)
        for index, network in enumerate(self.proposals):
            found |= network.arrays(f"proposal.{index}")
        return found

    def options(self) -> dict[str, Any]:
        """Sampling, and the options of each grid."""
        grids = [network.grid.options() for network in (self.base, *self.proposals)]
        return {**{name: getattr(self, name) for name in _OPTIONS}, "grids": grids}

    @classmethod
    def from_arrays(
        cls, arrays: Mapping[str, NDArray[Any]], options: Mapping[str, Any]
    ) -> NerfactoParameters:
        """Field of the values of `arrays` and `options`. Raises FieldError where they do not fit."""
        base, *more = options["grids"]
        return cls(
            take_array(arrays, "box"),
            HashNetwork.from_arrays("base", arrays, base),
            take_layers(arrays, "head"),
            tuple(HashNetwork.from_arrays(f"proposal.{i}", arrays, grid) for i, grid in enumerate(more)),
            **{name: options[name] for name in _OPTIONS},
        )
