"""Video encoder: ffmpeg as a child process whose failure raises an error."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from fractions import Fraction
from pathlib import Path

_FILE_COMMENT = "made with cagefield"
"""Comment in the metadata of a video file, which identifies cagefield's own videos."""

_SYSTEM_ERRORS = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EACCES, errno.EROFS)
"""System errors whose texts are looked for in ffmpeg's messages."""


@contextmanager
def open_encoder(
    path: Path, size: tuple[int, int], fps: float, quality: int
) -> Iterator[Callable[[bytes], None]]:
    """Function that adds a frame of `size` (width, height), even numbers, rgb24, to an H.264 file.

    The file is whole once the context ends. Where it ends with an error, ffmpeg is killed.

    Raises OSError where ffmpeg could not write the file.
    """
    import imageio_ffmpeg

    rate = str(Fraction(fps).limit_denominator())
    command = [
        *(imageio_ffmpeg.get_ffmpeg_exe(), "-y", "-nostdin", "-xerror", "-v", "error"),
        *("-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{size[0]}x{size[1]}", "-r", rate, "-i", "pipe:0"),
        *("-an", "-c:v", "libx264", "-pix_fmt", "yuv420p", "-crf", str(quality)),
        *("-metadata", f"comment={_FILE_COMMENT}", "-movflags", "+faststart", str(path)),
    ]
    process = subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        start_new_session=True,  # Ctrl+C is for us, who then end it
    )
    assert process.stdin is not None

    def encode(frame: bytes) -> None:
        try:
            process.stdin.write(frame)  # type: ignore[union-attr]
        except BrokenPipeError:
            raise _failure(process, path) from None

    try:
        yield encode
        with suppress(BrokenPipeError):
            process.stdin.close()
        if process.wait() != 0:
            raise _failure(process, path)
    finally:
        if process.poll() is None:
            process.kill()
        with suppress(BrokenPipeError):
            process.stdin.close()
        if process.stderr is not None:
            process.stderr.close()
        process.wait()


def is_cagefield_video(path: Path) -> bool:
    """Whether `open_encoder` wrote the video file."""
    try:
        with path.open("rb") as file:
            # The comment stands behind the table of frames, 8 to 20 bytes each.
            return _FILE_COMMENT.encode() in file.read(1 << 24)
    except OSError:
        return False


def _failure(process: subprocess.Popen[bytes], path: Path) -> OSError:
    """Error of ffmpeg, with the system's error number where its messages name one."""
    assert process.stderr is not None
    messages = process.stderr.read().decode(errors="replace")
    process.wait()
    if process.returncode == -getattr(signal, "SIGXFSZ", 0):  # more than `ulimit -f`
        return OSError(errno.EFBIG, os.strerror(errno.EFBIG), str(path))
    for number in _SYSTEM_ERRORS:
        if os.strerror(number).lower() in messages.lower():
            return OSError(number, os.strerror(number), str(path))
    last = (messages.strip().splitlines() or [f"exit status {process.returncode}"])[-1]
    return OSError(errno.EIO, f"the video encoder failed ({last})", str(path))
