"""Content of another program's checkpoint, and helpers of its readers."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera
from cagefield.datasets.nerf_normalization import Similarity
from cagefield.errors import FieldError
from cagefield.fields.external.external_field import ExternalField
from cagefield.fields.voxel_field import VoxelField

_MAX_NAMES = 6
"""Maximum number of names in a message."""


@dataclasses.dataclass(frozen=True)
class ExternalCheckpoint:
    """Field of another program's checkpoint.

    field: an ExternalField, or a VoxelField where our voxels are the same function.
    description: one line about the content. notes: one line for each thing that was left out or assumed.
    background: color behind the training photos; None where there is nothing.
    world: map from the data set's coordinates to the field's.
    distance: typical distance of the training cameras from the box's center; None where unknown.
    from_source: `world` begins at the coordinates of the reconstruction, before `Dataset.source_to_world`.
    cameras: training cameras that the checkpoint holds, in the field's world.
    """

    field: ExternalField | VoxelField
    description: str
    notes: tuple[str, ...] = ()
    background: tuple[float, float, float] | None = (1.0, 1.0, 1.0)
    world: Similarity = dataclasses.field(default_factory=lambda: Similarity(np.eye(4), 1.0))
    distance: float | None = None
    from_source: bool = False
    cameras: tuple[Camera, ...] = ()


class StateDict:
    """Tensors of a checkpoint by name, as NumPy arrays."""

    def __init__(self, tensors: Any, where: str) -> None:
        if not isinstance(tensors, Mapping) or not all(
            hasattr(value, "detach") or isinstance(value, np.ndarray) for value in tensors.values()
        ):
            raise FieldError(f"{where} must be a dict of tensors, got {type(tensors).__name__}")
        # DataParallel prefixes every name
        self._tensors = {str(name).removeprefix("module."): value for name, value in tensors.items()}
        self.where = where

    def __contains__(self, name: str) -> bool:
        return name in self._tensors

    @property
    def names(self) -> list[str]:
        """Names of all tensors, sorted."""
        return sorted(self._tensors)

    def take(self, name: str, ndim: int | None = None, *, raw: bool = False) -> NDArray[Any]:
        """Array of a name, float32 unless `raw`.

        Raises:
            FieldError: it is missing, or has another number of axes than `ndim`.
        """
        if name not in self._tensors:
            raise FieldError(f"{self.where}: tensor missing: {name}; it has {format_names(self._tensors)}")
        array = array_of(self._tensors[name], raw=raw)
        if ndim is not None and array.ndim != ndim:
            raise FieldError(f"{self.where}: {name} must have {ndim} axes, got shape {list(array.shape)}")
        return array


def array_of(value: Any, *, raw: bool = False) -> NDArray[Any]:
    """NumPy array of a tensor, an array or nested lists of numbers; float32 unless `raw`.

    Raises:
        FieldError: anything else.
    """
    if hasattr(value, "detach"):
        tensor = value.detach().cpu()
        value = tensor.numpy() if raw else tensor.float().numpy()
    try:
        array = np.asarray(value) if raw else np.asarray(value, np.float32)
    except (TypeError, ValueError, OverflowError):
        raise FieldError(f"expected an array of numbers, got {type(value).__name__}") from None
    if array.dtype.kind not in "biuf":
        raise FieldError(f"expected an array of numbers, got one of {array.dtype}")
    return array


def format_names(names: Any) -> str:
    """The first names, sorted, and how many more there are."""
    found = sorted(f"{name!s:.60}" for name in names)
    more = f" and {len(found) - _MAX_NAMES} more" if len(found) > _MAX_NAMES else ""
    return ", ".join(found[:_MAX_NAMES]) + more if found else "nothing"
