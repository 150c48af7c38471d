"""Lines of text that say what a data set holds."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from cagefield.datasets import Dataset


def describe_dataset(dataset: Dataset) -> list[str]:
    """Lines on photos, lenses, masks, points and the transform of coordinates, one fact each."""
    kind = "unbounded, box of interest" if dataset.unbounded else "box"
    edges = " x ".join(f"{edge:.4g}" for edge in dataset.bounds[1] - dataset.bounds[0])
    lines = [f"data set    {dataset.path}: {kind} {edges}"]
    for split, views in (("train", dataset.train), ("test", dataset.test), ("val", dataset.val)):
        if views:
            sizes = sorted({f"{view.camera.width}x{view.camera.height}" for view in views})
            shrunk = sorted({view.downscale for view in views})
            by = "" if shrunk == [1] else f", shrunk by {', '.join(map(str, shrunk))}"
            lines.append(f"photos      {split}: {len(views)}, {', '.join(sizes)}{by}")
    everything = list({view.name: view for view in (*dataset.train, *dataset.test, *dataset.val)}.values())
    lenses = Counter(
        view.camera.model
        if view.source is None
        else f"{view.camera.model}, resampled from {view.source.model}"
        for view in everything
    )
    lines += [f"lenses      {count} x {lens}" for lens, count in lenses.items()]
    lines.append(
        f"masks       {sum(view.mask is not None for view in everything)} of {len(everything)} photos"
    )
    points = 0 if dataset.points is None else len(dataset.points)
    lines.append(f"points      {points or 'none, they are found at training'}")
    matrix = dataset.source_to_world
    if np.array_equal(matrix, np.eye(4)):
        lines.append("world       that of the files")
    else:
        scale = float(np.cbrt(abs(np.linalg.det(matrix[:3, :3]))))
        shift = ", ".join(f"{value:.6g}" for value in matrix[:3, 3])
        lines.append(f"world       the reconstruction's, turned, scaled by {scale:.4g}, moved by ({shift})")
    return lines
