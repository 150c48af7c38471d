"""Pictures on the screen of the editor's pages."""

from __future__ import annotations

import io

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from editor_page import EditorPage

HALF = """\
version: 1
edits:
  - name: half
    delete: true
    inner: {center: [1.0, 0.0, 0.0], size: [2.0, 4.0, 4.0]}
    fill: none
    relight: none
"""
"""Deletes the half x > 0 of a field; without patches, which `test_page_layers.py` compares."""


def shot(page: EditorPage) -> NDArray[np.float64]:
    """The picture on the screen as it is, the mouse where it is."""
    page.page.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
    image = Image.open(io.BytesIO(page.page.screenshot(clip=page.box)))
    return np.asarray(image.convert("RGB"), dtype=np.float64) / 255.0


def filled(picture: NDArray[np.float64]) -> float:
    """The share of a picture that is not the white background."""
    return float((picture.min(axis=2) < 0.9).mean())


def db(one: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    return float(-10.0 * np.log10(np.mean(np.square(one - other))))


def alike(pair: tuple[EditorPage, EditorPage]) -> float:
    """dB between what both pages show at rest, the first by itself."""
    pictures = []
    for page in pair:
        page.page.bring_to_front()
        page.settle()
        pictures.append(page.pixels())
    assert filled(pictures[0]) > 0.02
    return db(*pictures)
