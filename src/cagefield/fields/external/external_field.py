"""Radiance fields of other programs: arrays and options of a checkpoint, evaluated with PyTorch.

An `ExternalField` is a `Field` (canonical space, world units, NumPy) that keeps the program's own parameters.
Its `torch` counterpart, a `TorchField`, evaluates them and places the samples of rays as the program does.
Adding a program takes one subclass of each, a line in `external_file.EXTERNAL_KINDS`, and a reader in
`formats.external`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cagefield.errors import FieldError
from cagefield.typing import Float32

if TYPE_CHECKING:
    from cagefield.fields.external.torch_field import TorchField


class ExternalField(ABC):
    """Radiance field of another program (canonical space, world units).

    A subclass is a frozen dataclass that checks its arrays when it is made, without PyTorch.
    """

    KIND: ClassVar[str]
    """Kind in the header of a field file."""
    near: float = 0.0
    """Distance from the cameras up to which nothing was trained, world units."""
    unbounded: bool = False
    """Whether the field extends beyond `bounds`, its box of interest."""

    @property
    @abstractmethod
    def bounds(self) -> NDArray[np.float64]:
        """Corners [2,3] of the box of the content, world units; the box of interest if unbounded."""

    @abstractmethod
    def arrays(self) -> dict[str, NDArray[Any]]:
        """Parameters by name, as a field file stores them."""

    @abstractmethod
    def options(self) -> dict[str, Any]:
        """Everything else of the field, JSON values."""

    @classmethod
    @abstractmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[Any]], options: Mapping[str, Any]) -> ExternalField:
        """Field of the values of `arrays` and `options`.

        Raises:
            FieldError: arrays or options that do not fit each other.
        """

    @abstractmethod
    def describe(self) -> str:
        """One line: the program, the model, its size."""

    @abstractmethod
    def _torch_field(self) -> TorchField:
        """PyTorch version on the compute device; imports PyTorch."""

    @cached_property
    def torch(self) -> TorchField:
        """PyTorch version of the field, on the compute device.

        Raises:
            FieldError: PyTorch is not installed.
        """
        try:
            import torch  # noqa: F401
        except ImportError as error:
            raise FieldError(
                "this field needs PyTorch, which is not installed; pip install 'cagefield[nerf]'"
            ) from error
        return self._torch_field()

    def __call__(self, positions: ArrayLike, viewdirs: ArrayLike) -> tuple[Float32, Float32]:
        """(sigma [N] per world unit, rgb [N,3]) at canonical positions [N,3] along unit viewdirs [N,3]."""
        return self.torch.numpy(positions, viewdirs)

    def signed_density(self, positions: ArrayLike, viewdirs: ArrayLike) -> Float32:
        """Density [N] per world unit without the color; below 0 only where the program's activation is a
        ReLU, which baking then applies after the interpolation."""
        return self.torch.numpy_density(positions)

    def evaluate_directions(self, positions: ArrayLike, viewdirs: ArrayLike) -> tuple[Float32, Float32]:
        """(sigma [N], rgb [N,K,3]) at positions [N,3] along K directions each, viewdirs [N,K,3]."""
        return self.torch.numpy_views(positions, viewdirs)


def frozen_array(name: str, values: Any, dtype: Any, shape: tuple[int | None, ...]) -> NDArray[Any]:
    """Read-only copy of an array with a shape (None: any length from 1).

    Raises:
        FieldError: another shape, values that are no numbers, NaN or infinity.
    """
    try:
        array = np.array(values, dtype=dtype, order="C")
    except (TypeError, ValueError, OverflowError):
        raise FieldError(f"{name} must be an array of numbers, got {type(values).__name__}") from None
    expected = "[" + ", ".join("N" if n is None else str(n) for n in shape) + "]"
    fits = array.ndim == len(shape) and all(
        (have >= 1 if want is None else have == want) for have, want in zip(array.shape, shape, strict=False)
    )
    if not fits:
        raise FieldError(f"{name} must be {expected}, got {list(array.shape)}")
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        raise FieldError(f"{name} holds NaN or infinity; the training diverged, or the file is damaged")
    array.setflags(write=False)
    return array


def frozen_box(name: str, values: Any) -> NDArray[np.float64]:
    """Read-only corners [2,3], lower < upper. Raises FieldError for anything else."""
    box = frozen_array(name, values, np.float64, (2, 3))
    if not (box[0] < box[1]).all():
        raise FieldError(f"{name} must have lower < upper on every axis, got {box.tolist()}")
    return box


def number(name: str, value: Any, low: float, high: float) -> float:
    """A finite number from low to high. Raises FieldError for anything else."""
    if isinstance(value, bool) or not isinstance(value, (int, float, np.integer, np.floating)):
        raise FieldError(f"{name} must be a number, got {type(value).__name__}")
    if not low <= value <= high:  # NaN too; whole numbers beyond all floats are compared as they are
        shown = f"{float(value):g}" if abs(value) < 1e300 or value != value else "beyond 1e300"
        raise FieldError(f"{name} is {shown}; it must be from {low:g} to {high:g}")
    return float(value)


def whole_number(name: str, value: Any, low: int, high: int) -> int:
    """A whole number from low to high. Raises FieldError for anything else."""
    found = number(name, value, low, high)
    if found != int(found):
        raise FieldError(f"{name} is {found:g}; it must be a whole number")
    return int(found)
