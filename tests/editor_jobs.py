"""Videos that the editor renders: the question that asks for one, and its pictures."""

from __future__ import annotations

import time
from pathlib import Path

import imageio_ffmpeg
import numpy as np
from numpy.typing import NDArray

from editor_page import PATIENCE, EditorPage


def render(editor: EditorPage, out: Path, width: int, height: int, fps: int) -> None:
    """Answers the question that "Render video" asks."""
    editor.page.click("text=Render video…")
    fields = editor.page.locator("dialog[open] input")
    for n, value in enumerate((out, width, height, fps)):
        fields.nth(n).fill(str(value))
    editor.page.click("dialog[open] .primary")


def read_video(path: Path) -> list[NDArray[np.float64]]:
    """The pictures [H,W,3] of a video, in [0,1]."""
    end = time.monotonic() + PATIENCE
    while not path.exists():
        assert time.monotonic() < end, path
        time.sleep(0.05)
    frames = imageio_ffmpeg.read_frames(str(path))
    width, height = next(frames)["size"]
    return [np.frombuffer(frame, np.uint8).reshape(height, width, 3) / 255.0 for frame in frames]
