"""LPIPS, where all that it needs is on this machine; nothing is downloaded."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.common.figures import floats
from cagefield.typing import AnyArray

WEIGHTS = "alexnet-owt-7be5be79.pth"
"""File of torchvision's AlexNet, on whose activations LPIPS is defined; in no package."""

Distance = Callable[[AnyArray, AnyArray], float]


def lpips() -> tuple[Distance | None, str]:
    """(mean LPIPS over views of two lists of pictures, "") or (None, why there is none).

    Source: Zhang et al., "The Unreasonable Effectiveness of Deep Features as a Perceptual Metric" (2018), by
    its authors' package, version 0.1 with AlexNet.
    """
    missing = [name for name in ("torch", "torchvision", "lpips") if find_spec(name) is None]
    if missing:
        return None, f"LPIPS is left out; not installed: {', '.join(missing)}"
    try:
        torch = import_module("torch")
        path = Path(torch.hub.get_dir()) / "checkpoints" / WEIGHTS
        if not path.is_file():
            return None, f"LPIPS is left out; AlexNet's weights ({WEIGHTS}) are not in torch's cache"
        network = import_module("lpips").LPIPS(net="alex", verbose=False).eval()
    except (ImportError, OSError, RuntimeError) as error:
        # A torchvision that was built for another torch says so: "operator torchvision::nms does not exist".
        return None, f"LPIPS is left out; it cannot be imported: {error}"

    def distance(pictures: AnyArray, truth: AnyArray) -> float:
        pairs: Sequence[tuple[Any, Any]] = list(zip(pictures, truth, strict=True))
        with torch.no_grad():
            return float(np.mean([network(_tensor(torch, a), _tensor(torch, b)).item() for a, b in pairs]))

    return distance, ""


def _tensor(torch: Any, picture: AnyArray) -> Any:
    """[1,3,H,W] in [-1,1]."""
    return torch.from_numpy(2.0 * floats(picture).transpose(2, 0, 1)[None] - 1.0)
