"""TensoRF checkpoints, `.th`, as apchenstu/TensoRF saves them.

    {"kwargs": options, "state_dict": tensors,
     "alphaMask.shape": (1, 1, Z, Y, X), "alphaMask.mask": packed bits, "alphaMask.aabb": [2,3]}

The model's class is not in the file; the tensors' names tell it: density_plane.N and density_line.N
(TensorVMSplit), lines alone (TensorCP), plane_coef and line_coef (TensorVM). The two VM models are the same
function; TensorVM keeps its appearance components in front of the density's in one tensor.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.errors import FieldError
from cagefield.fields.external.external_field import number, whole_number
from cagefield.fields.external.tensorf import TensorfField
from cagefield.formats.external.checkpoint import ExternalCheckpoint, StateDict, array_of

_Arrays = tuple[NDArray[Any], ...]


def is_tensorf(content: Mapping[str, Any]) -> bool:
    """Whether a checkpoint's dictionary is a TensoRF's."""
    kwargs, tensors = content.get("kwargs"), content.get("state_dict")
    if not isinstance(kwargs, dict) or not isinstance(tensors, Mapping):
        return False
    return "shadingMode" in kwargs or "density_n_comp" in kwargs


def read_tensorf(content: Mapping[str, Any]) -> ExternalCheckpoint:
    """Field of a TensoRF checkpoint's dictionary.

    Raises:
        FieldError: missing or misshapen tensors, options of the wrong type, a model trained in NDC.
    """
    kwargs, state = content["kwargs"], StateDict(content["state_dict"], "state_dict")
    near, far = _pair("near_far", kwargs.get("near_far"))
    if near == 0.0 and far == 1.0:
        raise FieldError(
            "near_far is [0, 1]: trained on a forward-facing capture in normalized device coordinates, which "
            "is not read; train the capture here: cagefield train DATA -o SCENE"
        )
    box = array_of(kwargs.get("aabb"))
    planes, lines = _components(state, kwargs)
    mask, mask_box = _mask(content)
    field = TensorfField(
        box.astype(np.float64),
        planes[0],
        lines[0],
        planes[1],
        lines[1],
        state.take("basis_mat.weight", 2),
        _mlp(state),
        mask,
        mask_box,
        shading=str(kwargs.get("shadingMode")),
        activation=str(kwargs.get("fea2denseAct")),
        density_shift=_option(kwargs, "density_shift"),
        distance_scale=_option(kwargs, "distance_scale"),
        step=_step(box, kwargs),
        near_far=(near, far),
        color_weight=_option(kwargs, "rayMarch_weight_thres"),
        position_octaves=whole_number("pos_pe", kwargs.get("pos_pe", 6), 0, 32),
        view_octaves=whole_number("view_pe", kwargs.get("view_pe", 6), 0, 32),
        feature_octaves=whole_number("fea_pe", kwargs.get("fea_pe", 6), 0, 32),
    )
    return ExternalCheckpoint(
        field,
        field.describe(),
        notes=("background: white is assumed, the checkpoint does not hold it",),
        distance=0.5 * (near + far),
    )


def _components(state: StateDict, kwargs: Mapping[str, Any]) -> tuple[tuple[_Arrays, _Arrays], ...]:
    """((density planes, appearance planes), (density lines, appearance lines)), three arrays each."""
    if "plane_coef" in state:
        density = whole_number("density_n_comp", kwargs.get("density_n_comp"), 1, 1 << 16)
        planes, lines = state.take("plane_coef", 4), state.take("line_coef", 4)[..., 0]
        if len(planes) != 3 or len(lines) != 3 or not density < planes.shape[1] == lines.shape[1]:
            raise FieldError(
                f"plane_coef and line_coef must be [3, C, ...] with C above density_n_comp = {density}, got "
                f"{list(planes.shape)} and {list(lines.shape)}"
            )
        split = [(tuple(group[:, -density:]), tuple(group[:, :-density])) for group in (planes, lines)]
        return split[0], split[1]

    def group(name: str, flat: bool) -> _Arrays:
        arrays = [state.take(f"{name}.{index}", 4) for index in range(3)]
        for index, array in enumerate(arrays):
            if array.shape[0] != 1 or (flat and array.shape[3] != 1):
                raise FieldError(
                    f"{name}.{index} must be [1, C, {'L, 1' if flat else 'H, W'}], got {list(array.shape)}"
                )
        return tuple(array[0, :, :, 0] if flat else array[0] for array in arrays)

    lines_of = group("density_line", True), group("app_line", True)
    if "density_plane.0" not in state:
        return ((), ()), lines_of
    return (group("density_plane", False), group("app_plane", False)), lines_of


def _mlp(state: StateDict) -> tuple[tuple[NDArray[Any], NDArray[Any]], ...]:
    names = [f"renderModule.mlp.{index}" for index in (0, 2, 4)]
    if f"{names[0]}.weight" not in state:
        return ()
    return tuple((state.take(f"{name}.weight", 2), state.take(f"{name}.bias", 1)) for name in names)


def _mask(content: Mapping[str, Any]) -> tuple[NDArray[np.bool_] | None, NDArray[np.float64] | None]:
    """(alpha mask [Z,Y,X], its box [2,3]); None where there is none."""
    if "alphaMask.aabb" not in content:
        return None, None
    shape = content.get("alphaMask.shape")
    if not isinstance(shape, (tuple, list)) or not 3 <= len(shape) <= 5:
        raise FieldError(f"alphaMask.shape must be (1, 1, Z, Y, X), got {shape!r:.60}")
    sides = [whole_number("alphaMask.shape", side, 1, 1 << 14) for side in shape]
    bits = array_of(content.get("alphaMask.mask"), raw=True)
    count = math.prod(sides)
    if any(side != 1 for side in sides[:-3]) or bits.dtype != np.uint8 or bits.shape != (-(-count // 8),):
        raise FieldError(f"alphaMask.mask must be {-(-count // 8)} bytes for the shape {sides}")
    mask = np.unpackbits(bits)[:count].reshape(sides[-3:]).astype(bool)
    return mask, array_of(content["alphaMask.aabb"]).astype(np.float64)


def _step(box: NDArray[Any], kwargs: Mapping[str, Any]) -> float:
    """Distance of samples: step_ratio times the mean edge of a voxel, rounded to float32 as theirs."""
    sides = kwargs.get("gridSize")
    if not isinstance(sides, (list, tuple)) or len(sides) != 3 or box.shape != (2, 3):
        raise FieldError(
            f"gridSize must be 3 numbers and aabb [2,3], got {sides!r:.60} and {list(box.shape)}"
        )
    grid = np.array([whole_number("gridSize", side, 2, 1 << 16) for side in sides], np.float32)
    edges = ((box[1] - box[0]) / (grid - np.float32(1.0))).astype(np.float32)
    return float(np.float32(edges.mean(dtype=np.float32)) * np.float32(_option(kwargs, "step_ratio")))


def _option(kwargs: Mapping[str, Any], name: str) -> float:
    return number(name, kwargs.get(name), -1e6, 1e6)


def _pair(name: str, values: Any) -> tuple[float, float]:
    if not isinstance(values, (list, tuple)) or len(values) != 2:
        raise FieldError(f"{name} must be two numbers, got {values!r:.60}")
    return number(name, values[0], 0.0, 1e9), number(name, values[1], 0.0, 1e9)
