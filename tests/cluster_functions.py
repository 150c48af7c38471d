"""Functions that workers of a cluster import."""

from __future__ import annotations

import ctypes
import os
import signal
import time
from collections.abc import Collection
from pathlib import Path
from typing import NoReturn
from unittest.mock import patch

from cagefield.cameras.camera import Camera
from cagefield.cluster.frame_tasks import FrameJob, FrameResult, render_frame
from cagefield.errors import CagefieldError
from cagefield.files.atomic import replaced_file
from cagefield.images.pictures import DepthScale, Pictures, write_pictures
from cagefield.training.splats.block_jobs import BlockJob
from cagefield.training.splats.train_blocks import train_block

KILL_STEP = 12
"""Step of a training at which its worker is killed."""


def cubed(number: int) -> int:
    return number**3


def slept(seconds: float) -> None:
    time.sleep(seconds)


def killed_twice(folder: Path) -> bytes:
    """Ends its worker by SIGKILL in the first and the second try; the third reads what they left."""
    tries = len(list(folder.iterdir()))
    if tries < 2:
        (folder / str(tries)).write_bytes(bytes([tries]))
        die()
    return b"".join(path.read_bytes() for path in sorted(folder.iterdir()))


def frame_amid_kills(
    marks: Path, names: Collection[str], job: FrameJob, camera: Camera, name: str, scale: DepthScale | None
) -> FrameResult:
    """`render_frame`; the first try of each frame of `names` ends its worker by SIGKILL.

    One file of the frame is then whole, and half of another is in its draft. `marks` is a folder for a file
    named as each such frame.
    """
    from cagefield.cluster import frame_tasks

    def write_and_die(stem: Path, pictures: Pictures) -> NoReturn:
        (first, picture), (second, _) = list(pictures.items())[:2]
        write_pictures(stem, {first: picture})
        with replaced_file(stem.with_name(stem.name + second)) as draft:
            draft.write_bytes(b"half")
            die()
        raise AssertionError("SIGKILL cannot be handled")

    if name in names and _is_first_try(marks / name):
        patch.object(frame_tasks, "write_pictures", write_and_die).start()
    return render_frame(job, camera, name, scale)


def training_amid_kills(marks: Path, names: Collection[str], job: BlockJob) -> bool:
    """`train_block`; the first try of each training of `names` ends its worker by SIGKILL at KILL_STEP.

    The checkpoint is of that step. `marks` gets a file named as each such training, with the step at
    which its second try begins.
    """
    from cagefield.training import loop
    from cagefield.training.splats.splat_run import SplatRun

    advance = SplatRun.advance
    mark = marks / job.name

    def advance_and_die(run: SplatRun) -> None:
        if run.step == KILL_STEP:
            die()
        advance(run)

    def note_and_advance(run: SplatRun) -> None:
        if not mark.read_text():
            mark.write_text(str(run.step))
        advance(run)

    if job.name not in names:
        return train_block(job)
    if _is_first_try(mark):
        patch.object(loop, "_checkpoint_interval_seconds", lambda saved: 0.0).start()
        patch.object(SplatRun, "advance", advance_and_die).start()
        return train_block(job)
    with patch.object(SplatRun, "advance", note_and_advance):
        return train_block(job)


def _is_first_try(mark: Path) -> bool:
    """Whether the file was not there; it is then made."""
    try:
        mark.touch(exist_ok=False)
    except FileExistsError:
        return False
    return True


def die() -> NoReturn:
    """Ends this process by SIGKILL."""
    os.kill(os.getpid(), signal.SIGKILL)
    raise AssertionError("SIGKILL cannot be handled")


def refusing() -> None:
    raise CagefieldError("no photo is left; take some")


def held_interpreter(mark: Path) -> None:
    """Writes its process's number, then holds the interpreter for ten minutes, as a long kernel does."""
    draft = mark.with_suffix(".draft")
    draft.write_text(str(os.getpid()), encoding="ascii")
    draft.replace(mark)
    ctypes.PyDLL(None).sleep(600)
