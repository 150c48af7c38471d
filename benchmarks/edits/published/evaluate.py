"""Evaluates edited pictures against the truth of this folder; needs numpy and Pillow alone.

    python evaluate.py                       # the table of all methods in results/
    python evaluate.py --method mine         # of results/mine alone
    python evaluate.py --json table.json

README.md has the format of the folder and the meaning of the columns.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

HERE = Path(__file__).resolve().parent
HALF_LEVEL = (0.5 / 255) ** 2 / 3
"""Squared error from which down a picture counts as right to half an 8-bit level."""


def pictures(folder: Path, count: int) -> np.ndarray:
    """Pictures [V,H,W,3], 0 to 1, of a folder's files 000.png, 001.png, ..."""
    return np.stack(
        [
            np.asarray(Image.open(folder / f"{n:03d}.png").convert("RGB"), np.float64) / 255.0
            for n in range(count)
        ]
    )


def masks(folder: Path, count: int) -> np.ndarray:
    """Masks [V,H,W] of a folder's files: True where the edit changes the picture in truth."""
    return np.stack(
        [np.asarray(Image.open(folder / f"{n:03d}.png").convert("L")) > 127 for n in range(count)]
    )


def mean_psnr(found: np.ndarray, truth: np.ndarray) -> float:
    """Mean over views of -10 log10 of the mean squared error."""
    errors = ((found - truth) ** 2).mean(axis=(1, 2, 3))
    if not errors.any():
        return float("inf")
    return float(np.mean(-10.0 * np.log10(np.maximum(errors, HALF_LEVEL))))


def masked_psnr(found: np.ndarray, truth: np.ndarray, where: np.ndarray) -> float:
    """PSNR over the masked pixels of all views together; NaN for an empty mask."""
    if not where.any():
        return float("nan")
    error = float(((found - truth)[where] ** 2).mean())
    return float("inf") if error == 0.0 else -10.0 * float(np.log10(error))


def evaluate(case: dict[str, Any], method: str, root: Path = HERE) -> dict[str, Any] | None:
    """Figures of a method's pictures of a case, dB; None where it has none."""
    own, count = root / "results" / method / case["id"], case["views"]
    if not (own / f"{count - 1:03d}.png").is_file():
        return None
    place = root / "cases" / case["id"]
    truth = pictures(place / case.get("truths", {}).get(method, "truth"), count)
    there = masks(place / "changed", count)
    edited = pictures(own, count)
    unedited = pictures(root / "results" / "unedited" / case["id"], count)
    before = mean_psnr(unedited, pictures(place / "before", count))
    return {
        "case": case["id"],
        "kind": case["kind"],
        "method": method,
        "psnr_unedited": before,
        "psnr": mean_psnr(edited, truth),
        "psnr_lost": before - mean_psnr(edited, truth),
        "psnr_changed": masked_psnr(edited, truth, there),
    }


def table(methods: list[str] | None = None, root: Path = HERE) -> list[dict[str, Any]]:
    """Rows of all cases and methods."""
    cases = json.loads((root / "cases.json").read_text(encoding="utf-8"))["cases"]
    names = methods or sorted(path.name for path in (root / "results").iterdir() if path.is_dir())
    rows = [evaluate(case, method, root) for case in cases for method in names]
    return [row for row in rows if row is not None]


def markdown(rows: list[dict[str, Any]]) -> str:
    """The rows as a Markdown table, with a line of means for each method and kind."""
    lines = [
        "| case | kind | method | PSNR unedited | PSNR | PSNR lost | PSNR changed |",
        "| --- | --- | --- | ---: | ---: | ---: | ---: |",
    ]
    keys = ("psnr_unedited", "psnr", "psnr_lost", "psnr_changed")
    lines += [
        f"| {row['case']} | {row['kind']} | {row['method']} | "
        + " | ".join(f"{row[key]:.2f}" for key in keys)
        + " |"
        for row in rows
    ]
    for method, kind in dict.fromkeys((row["method"], row["kind"] == "continuous") for row in rows):
        own = [row for row in rows if (row["method"], row["kind"] == "continuous") == (method, kind)]
        means = " | ".join(f"{np.nanmean([row[key] for row in own]):.2f}" for key in keys)
        lines.append(f"| mean of {len(own)} | {'continuous' if kind else 'discrete'} | {method} | {means} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--method", action="append", help="folder in results/; all of them if left out")
    parser.add_argument("--json", type=Path, help="write the rows into this file, too")
    options = parser.parse_args()
    rows = table(options.method)
    if not rows:
        sys.exit("no pictures: put them into results/METHOD/CASE/000.png, ...")
    print(markdown(rows), end="")
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
