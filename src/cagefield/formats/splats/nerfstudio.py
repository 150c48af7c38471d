"""Splats of nerfstudio's splatfacto checkpoints, read as tensors without executing code.

"pipeline" has _model.gauss_params.means [N,3], scales [N,3] (logarithms), quats [N,4] (w x y z),
opacities [N,1] (logits), features_dc [N,3] and features_rest [N,K,3]; older versions omit
"gauss_params.". Axes and units are those of nerfstudio's training.

Source: nerfstudio-project/nerfstudio, nerfstudio/models/splatfacto.py.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from cagefield.errors import FieldError
from cagefield.formats.splats.axes import PLY_AXES
from cagefield.formats.splats.splat_table import BATCH_SPLATS, SplatBatch, SplatSource
from cagefield.formats.torch_files import read_torch_tensors
from cagefield.typing import AnyArray

_NAMES = ("means", "scales", "quats", "opacities", "features_dc", "features_rest")


def open_splatfacto(path: Path) -> SplatSource:
    """Open splatfacto checkpoint.

    Raises:
        FieldError: missing PyTorch, a damaged file, or a checkpoint of another method.
    """
    pipeline = read_torch_tensors(path).get("pipeline")
    if not isinstance(pipeline, Mapping):
        raise FieldError(f'{path}: no checkpoint of nerfstudio: it has no "pipeline"; give a step-*.ckpt')
    found = {name: tensor for name in _NAMES if (tensor := _tensor(pipeline, name)) is not None}
    missing = [name for name in _NAMES[:5] if name not in found]
    if missing:
        raise FieldError(
            f"{path}: no checkpoint of splatfacto, it lacks {', '.join(missing)}; of nerfacto's "
            "`cagefield import` makes a scene, other models of nerfstudio are not read"
        )
    means, scales, quats, opacities, dc = (found[name] for name in _NAMES[:5])
    count = len(means)
    rest = found.get("features_rest", np.zeros((count, 0, 3), np.float32))
    degree = int(np.sqrt(rest.shape[1] + 1)) - 1 if rest.ndim == 3 else -1
    shapes = [part.shape for part in (means, scales, quats, opacities, dc, rest)]
    above = (degree + 1) ** 2 - 1
    if shapes != [(count, 3), (count, 3), (count, 4), (count, 1), (count, 3), (count, above, 3)]:
        raise FieldError(f"{path}: tensors of splatfacto have shapes {shapes} that do not fit; save it again")

    def batches() -> Iterator[SplatBatch]:
        for first in range(0, count, BATCH_SPLATS):
            here = slice(first, first + BATCH_SPLATS)
            with np.errstate(over="ignore"):
                alpha = 1.0 / (1.0 + np.exp(-opacities[here, 0].astype(np.float64)))
            sh = np.concatenate([dc[here, None], rest[here]], axis=1)
            yield SplatBatch(means[here], scales[here], quats[here], alpha, sh)

    return SplatSource(path, count, degree, PLY_AXES, batches)


def is_splatfacto(path: Path) -> bool:
    """Whether the file is a nerfstudio checkpoint of no network. Raises FieldError as `open_splatfacto`."""
    if not path.is_file():
        return False
    pipeline = read_torch_tensors(path).get("pipeline")
    # Networks are those of a radiance field, such as nerfacto's; its reader is another one.
    return pipeline is not None and not (
        isinstance(pipeline, Mapping) and any(str(name).startswith("_model.field.") for name in pipeline)
    )


def _tensor(pipeline: Mapping[str, Any], name: str) -> AnyArray | None:
    for key in (f"_model.gauss_params.{name}", f"_model.{name}"):
        if hasattr(pipeline.get(key), "numpy"):
            return np.asarray(pipeline[key].detach().float().numpy())
    return None
