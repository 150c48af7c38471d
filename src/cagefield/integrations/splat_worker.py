"""`python -m cagefield.integrations.splat_worker`: a process that deforms splats for another program.

Requests come as frames on standard input, and each has one reply on standard output, in order; it repeats the
request's "id". A reply has "error", one line, where the request was not possible; the process goes on. A
frame that breaks the protocol ends it with exit code 2 and one line on standard error, which is also the last
reply. It ends with exit code 0 when standard input ends, and with `--parent PID`, on Linux, at once when that
process ends. All other output, of kernels too, goes to standard error.
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import traceback
from collections.abc import Sequence
from typing import Any, BinaryIO

from cagefield.errors import CagefieldError, line_of, warnings_in_one_line
from cagefield.integrations.frames import Frame, FrameError, read_frame, write_frame

PR_SET_PDEATHSIG = 1
"""Of Linux's <sys/prctl.h>."""

MAX_ERROR_CHARACTERS = 600


def main(arguments: Sequence[str]) -> int:
    """Exit code of the worker with arguments [] or ["--parent", PID]."""
    if arguments:
        if len(arguments) != 2 or arguments[0] != "--parent" or not arguments[1].isdecimal():
            print("usage: python -m cagefield.integrations.splat_worker [--parent PID]", file=sys.stderr)
            return 2
        _end_with(int(arguments[1]))
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # of the other program's terminal
    replies = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    try:
        with warnings_in_one_line():
            return serve(sys.stdin.buffer, replies)
    except BrokenPipeError:
        return 0  # the other program has ended


def serve(requests: BinaryIO, replies: BinaryIO) -> int:
    """Exit code once the requests have ended, or one breaks the protocol."""
    from cagefield.integrations.splat_deformer import SplatDeformer

    deformer = SplatDeformer()
    while True:
        try:
            request = read_frame(requests)
        except FrameError as error:
            print(f"cagefield: {_line(error)}", file=sys.stderr)
            write_frame(replies, Frame({"id": None, "error": _line(error)}))
            return 2
        if request is None:
            return 0
        number = request.header.get("id")
        number = number if type(number) is int else None
        write_frame(replies, _reply(deformer.reply, request, number))


def _reply(answer: Any, request: Frame, number: int | None) -> Frame:
    """The reply to a request, or its error."""
    try:
        reply = answer(request)
    except MemoryError as error:
        return _failed(number, f"there is not enough memory ({error or 'the system gave no more'})")
    except (CagefieldError, OSError) as error:
        return _failed(number, _line(error))
    except Exception as error:  # a fault of the program, whose caller must not wait for ever
        traceback.print_exc()
        return _failed(number, f"fault in cagefield, please report it: {type(error).__name__}: {error}")
    return Frame({"id": number, **reply.header}, reply.arrays)


def _failed(number: int | None, message: str) -> Frame:
    return Frame({"id": number, "error": " ".join(message.split())[:MAX_ERROR_CHARACTERS]})


def _line(error: Exception) -> str:
    return " ".join((line_of(error) if isinstance(error, OSError) else str(error)).split())


def _end_with(parent: int) -> None:
    """Ends this process when a parent ends, even within a kernel; elsewhere than on Linux nothing."""
    if sys.platform.startswith("linux"):
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
        if os.getppid() != parent:  # it has ended already
            os._exit(1)


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
