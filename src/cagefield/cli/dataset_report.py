"""Text report of a data set's contents."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

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
    lines.append(f"world       {describe_world(dataset.source_to_world) or 'that of the files'}")
    return lines


def describe_world(source_to_world: NDArray[np.float64]) -> str:
    """Description of a similarity [4,4] of the reconstruction's coordinates; empty for the identity."""
    linear, shift = source_to_world[:3, :3], source_to_world[:3, 3]
    scale = float(np.cbrt(abs(np.linalg.det(linear))))
    parts = ["mirrored"] * bool(np.linalg.det(linear) < 0.0)
    parts += ["turned"] * (not np.allclose(linear, scale * np.sign(np.linalg.det(linear)) * np.eye(3)))
    parts += [f"scaled by {scale:.4g}"] * (abs(scale - 1.0) > 1e-9)
    parts += [f"moved by ({', '.join(f'{value:.9g}' for value in shift + 0.0)})"] * bool(shift.any())
    return f"the reconstruction's, {', '.join(parts)}" if parts else ""
