"""SVRaster checkpoints, `iterNNNNNN_model.pt`, as NVlabs/svraster saves them.

    {"active_sh_degree": int, "scene_center" [3], "scene_extent" [1], "inside_extent" [1],
     "octpath" int64 [N,1], "octlevel" int8 [N,1], "_geo_grid_pts" [G,1], "_sh0" [N,3], "_shs" [N,K,3],
     "quantized": bool}

Quantized arrays are {"index": uint8, "codebook" [256]}, of _sh0 and _shs one for each slice of the second
axis. No genuine file was at hand: the layout is that of the program's source.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.errors import FieldError
from cagefield.fields.external.external_field import whole_number
from cagefield.fields.external.svraster import SvrasterField
from cagefield.formats.external.checkpoint import ExternalCheckpoint, StateDict, array_of

_NAMES = ("octpath", "octlevel", "_geo_grid_pts", "_sh0", "_shs")


def is_svraster(content: Mapping[str, Any]) -> bool:
    """Whether a checkpoint's dictionary is an SVRaster's."""
    return "octpath" in content and "octlevel" in content


def read_svraster(content: Mapping[str, Any]) -> ExternalCheckpoint:
    """Field of an SVRaster checkpoint's dictionary.

    Raises:
        FieldError: missing or misshapen tensors, voxels within others, codebooks that do not fit.
    """
    quantized = content.get("quantized", False) is True
    tensors = {
        name: value for name, value in content.items() if name not in ("quantized", "active_sh_degree")
    }
    if quantized:
        for name in ("_geo_grid_pts", "_sh0", "_shs"):
            tensors[name] = _dequantized(name, content.get(name))
    state = StateDict(tensors, "the checkpoint")
    paths, levels = (_column(state, name) for name in _NAMES[:2])
    for name, values in zip(_NAMES, (paths, levels), strict=False):
        if values.dtype.kind not in "iu" or len(values) != len(paths):
            raise FieldError(f"{name} must be {len(paths)} whole numbers, got {values.dtype} {len(values)}")
    order = np.argsort(paths, kind="stable")
    degree = whole_number("active_sh_degree", content.get("active_sh_degree", 0), 0, 3)
    field = SvrasterField(
        paths[order],
        levels[order],
        _column(state, "_geo_grid_pts"),
        _harmonics(state, len(paths), degree)[order],
        state.take("scene_center", 1).astype(np.float64),
        extent=_scalar(state, "scene_extent"),
        inside=_scalar(state, "inside_extent"),
    )
    return ExternalCheckpoint(
        field,
        field.describe(),
        notes=("background: white is assumed, the checkpoint does not hold it",),
    )


def _harmonics(state: StateDict, count: int, degree: int) -> NDArray[np.float32]:
    """Coefficients [N,(degree + 1)^2,3]: the active ones."""
    first, more = state.take("_sh0", 2), state.take("_shs", 3)
    if first.shape != (count, 3) or more.shape[::2] != (count, 3):
        raise FieldError(
            f"_sh0 and _shs must be [{count},3] and [{count},K,3], got {list(first.shape)} and "
            f"{list(more.shape)}"
        )
    wanted = (degree + 1) ** 2 - 1
    if more.shape[1] < wanted:
        raise FieldError(f"_shs has {more.shape[1]} harmonics, active_sh_degree {degree} takes {wanted}")
    return np.concatenate([first[:, None], more[:, :wanted]], axis=1)


def _column(state: StateDict, name: str) -> NDArray[Any]:
    """Values [N] of a tensor [N,1] or [N]."""
    values = state.take(name, raw=True)
    if values.ndim not in (1, 2) or (values.ndim == 2 and values.shape[1] != 1) or not len(values):
        raise FieldError(f"{name} must be [N,1], got {list(values.shape)}")
    return values.reshape(-1)


def _scalar(state: StateDict, name: str) -> float:
    values = state.take(name)
    if values.size != 1:
        raise FieldError(f"{name} must be one number, got shape {list(values.shape)}")
    return float(values.reshape(-1)[0])


def _dequantized(name: str, value: Any) -> NDArray[np.float32]:
    """Values of a quantized tensor; of a list, joined along the second axis."""
    if isinstance(value, (list, tuple)):
        parts = [_dequantized(f"{name}[{index}]", part) for index, part in enumerate(value)]
        if not parts or any(part.ndim < 2 or part.shape[::2] != parts[0].shape[::2] for part in parts):
            raise FieldError(f"{name} must be a list of quantized tensors of one length")
        return np.concatenate(parts, axis=1)
    if not isinstance(value, Mapping) or not {"index", "codebook"} <= value.keys():
        raise FieldError(f"{name} must have index and codebook, the checkpoint is quantized")
    index, codebook = array_of(value["index"], raw=True), array_of(value["codebook"])
    if index.dtype != np.uint8 or codebook.ndim != 1 or (index.size and int(index.max()) >= len(codebook)):
        raise FieldError(f"{name}: index must be uint8 within the codebook's {codebook.size} entries")
    return codebook[index]
