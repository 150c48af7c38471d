"""Process that reads a USD file: `python -m cagefield.formats.splats.usd_process FILE FOLDER [TIME_CODE]`.

It writes the arrays of each prim to FOLDER, as .npy files, and ANSWER: an error or null, the lines of
warnings, and the number of prims.
"""

from __future__ import annotations

import json
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from cagefield.errors import CagefieldError
from cagefield.formats.splats.usd_prims import UsdSplats, read_usd_splats

ANSWER = "answer.json"

_NAMES = ("means", "quaternions", "scales", "opacities", "sh", "matrix")


def load_splats(folder: Path, number: int) -> UsdSplats:
    """Splats of a prim from the arrays that the process wrote; missing arrays are None."""

    def values(name: str) -> Any:
        file = folder / f"{number}.{name}.npy"
        return np.load(file) if file.exists() else None

    return UsdSplats(*(values(name) for name in _NAMES))


def main(file: str, folder: str, time_code: str | None = None) -> None:
    """Read a file and write its splats."""
    answer: dict[str, Any] = {"error": None, "warnings": [], "parts": 0}
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        try:
            parts = read_usd_splats(Path(file), None if time_code is None else float(time_code))
            for number, part in enumerate(parts):
                for name in _NAMES:
                    values = getattr(part, name)
                    if values is not None:
                        np.save(Path(folder) / f"{number}.{name}.npy", values)
            answer["parts"] = len(parts)
        except CagefieldError as error:
            answer["error"] = str(error)
        except (MemoryError, OSError) as error:
            reason = getattr(error, "strerror", None) or "not enough memory"
            answer["error"] = f"{file}: its splats cannot be read: {reason}"
    answer["warnings"] = [str(each.message) for each in said]
    (Path(folder) / ANSWER).write_text(json.dumps(answer), encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
