"""Original NeRF: a coarse and a fine MLP over positional encodings.

Notation: gamma_L(x) = (x, sin x, cos x, sin 2x, cos 2x, ..., sin 2^(L-1) x, cos 2^(L-1) x); some networks
omit x. A network is

    h = relu(W_k h + b_k) along the trunk, from h = gamma(p); a layer with a skip sees (gamma(p), h)
    sigma = relu(density(h)),  rgb = sigmoid(rgb(relu(view(feature(h), gamma(d)))))

with sigma per unit of the network's training space. With `ndc`, this space is the normalized device
coordinates of a forward-facing capture: cameras look along -z, the near plane is z = -1, and

    ndc(p) = (-x / (a z), -y / (b z), 1 + 2/z),   a, b = width/2f, height/2f

so that sigma per world unit along d is the network's times |J_ndc d|, and 0 in front of the near plane.

Arrays are NumPy's; the first evaluation imports PyTorch.

Source: Mildenhall et al., "NeRF" (2020), section 5 and appendix C (NDC).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cagefield.errors import FieldError
from cagefield.fields.mlp import Mlp
from cagefield.typing import Float32

if TYPE_CHECKING:
    from cagefield.fields.nerf_torch import TorchNerf


@dataclass(frozen=True, eq=False)
class NerfField:
    """Original NeRF (canonical space, world units), with the sampling of its rays.

    Attributes:
        coarse: network that places the samples; also the field where `fine` is None.
        fine: network of the field.
        bounds: [2,3] box to bake and to sample.
        near, far: depth along the camera's axis of the first and last sample; 0 and 1 with `ndc`.
        samples: (coarse, additional fine) samples of each ray.
        lindisp: coarse samples even in 1/depth instead of depth.
        ndc: (width/2f, height/2f) for a network trained in normalized device coordinates.
        bounded: the field is empty outside `bounds`, where its networks are not evaluated.

    Raises:
        FieldError: invalid bounds, depths or numbers of samples.
    """

    coarse: Mlp
    fine: Mlp | None
    bounds: NDArray[np.float64]
    near: float = 2.0
    far: float = 6.0
    samples: tuple[int, int] = (64, 128)
    lindisp: bool = False
    ndc: tuple[float, float] | None = None
    bounded: bool = False

    def __post_init__(self) -> None:
        bounds = np.array(self.bounds, np.float64)
        if bounds.shape != (2, 3) or not np.isfinite(bounds).all() or not (bounds[0] < bounds[1]).all():
            raise FieldError(f"bounds must be 2 finite corners [2,3], lower < upper, got {bounds.tolist()}")
        bounds.setflags(write=False)
        object.__setattr__(self, "bounds", bounds)
        samples = tuple(int(n) for n in self.samples)
        object.__setattr__(self, "samples", samples)
        if len(samples) != 2 or samples[0] < 3 or samples[1] < 0:
            raise FieldError(
                f"samples must be (coarse from 3, fine from 0) numbers on a ray, got {self.samples}"
            )
        if self.ndc is None and not 0.0 <= self.near < self.far < np.inf:
            raise FieldError(f"near and far must satisfy 0 <= near < far, got {self.near} and {self.far}")
        if self.ndc is None and self.lindisp and self.near == 0.0:
            raise FieldError("near must be above 0 where samples are even in 1/depth, got 0")
        if self.ndc is not None and not min(self.ndc) > 0:
            raise FieldError(f"ndc must be two ratios width/2f, height/2f above 0, got {self.ndc}")
        if self.ndc is not None and self.bounded:
            raise FieldError("a field in NDC reaches to infinity; leave out bounded")

    @cached_property
    def torch(self) -> TorchNerf:
        """PyTorch version of the field, on the compute device.

        Raises:
            FieldError: PyTorch is not installed.
        """
        try:
            from cagefield.fields.nerf_torch import TorchNerf
        except ImportError as error:
            raise FieldError(
                "this NeRF needs PyTorch, which is not installed; pip install 'cagefield[nerf]'"
            ) from error
        return TorchNerf(self)

    def __call__(self, positions: ArrayLike, viewdirs: ArrayLike) -> tuple[Float32, Float32]:
        """(sigma [N] per world unit, rgb [N,3]) at canonical positions [N,3] along unit viewdirs [N,3]."""
        return self.torch.numpy(positions, viewdirs)

    def signed_density(self, positions: ArrayLike, viewdirs: ArrayLike) -> Float32:
        """Density [N] per world unit before its ReLU: negative where space is empty, 0 at surfaces."""
        return self.torch.numpy_signed(positions, viewdirs)

    def evaluate_directions(self, positions: ArrayLike, viewdirs: ArrayLike) -> tuple[Float32, Float32]:
        """(sigma [N], rgb [N,K,3]) at positions [N,3] along K directions each, viewdirs [N,K,3].

        The trunk is evaluated once per position; sigma, which depends on the direction with `ndc`, is the
        mean.
        """
        return self.torch.numpy_views(positions, viewdirs)
