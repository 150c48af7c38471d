"""The loop of a training: steps until the run is done or Ctrl-C is pressed, and its checkpoints."""

from __future__ import annotations

import contextlib
import signal
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Protocol

from cagefield.errors import CagefieldError, line_of

CHECKPOINT_SECONDS = 60.0
"""Seconds of training between two checkpoints, at most."""

FIRST_CHECKPOINT = 5.0
"""Seconds to the first one; as many to the next, then twice as many each time."""


class Run(Protocol):
    """The state of a training run."""

    step: int
    seconds: float

    @property
    def done(self) -> float:
        """Progress, 0 to 1."""

    def advance(self) -> None:
        """One step."""

    def progress(self) -> Any:
        """Where the run stands, to be told."""

    def store(self, path: Path) -> None:
        """Writes the state, whole or not at all."""

    def restore(self, path: Path) -> None:
        """Takes the state from a file."""


def run_to_end(
    run: Run,
    *,
    checkpoint: Path | str | None,
    resume: bool,
    on_progress: Callable[[Any], None] | None,
    after_step: Callable[[tuple[int, float]], None] = lambda before: None,
) -> bool:
    """True when the run was finished, False when Ctrl-C ended it early.

    Its state is written to `checkpoint` after 5, 10, 20 and 40 seconds, then every minute, and at its end,
    early or not; `resume` continues from there: a run that was finished is so at once. Where it cannot be
    written (a full disk) a warning says so,
    the last one is kept, and the run goes on.
    `after_step` is called after each step and its report, with the (step, seconds) before it.

    Raises:
        CagefieldError: no folder for the checkpoint, nothing to resume from, or nothing that `restore` can
            read.
    """
    checkpoint = None if checkpoint is None else Path(checkpoint)
    if resume:
        if checkpoint is None or not checkpoint.is_file():
            raise CagefieldError(f"no checkpoint at {checkpoint} to resume from; start anew")
        run.restore(checkpoint)
    if checkpoint is not None and not checkpoint.parent.is_dir():
        raise CagefieldError(f"there is no folder {checkpoint.parent} for the checkpoint; make it first")
    saved, stored = run.seconds, run.step if resume else None
    with _interruptible() as interrupted:
        while run.done < 1.0 and not interrupted():
            before = run.step, run.seconds
            run.advance()
            if on_progress is not None:
                on_progress(run.progress())
            after_step(before)
            if checkpoint is not None and run.seconds - saved > _until_next(saved):
                saved = run.seconds
                if _stored(run, checkpoint):
                    stored = run.step
        if checkpoint is not None and run.step != stored:
            _stored(run, checkpoint)
    return run.done >= 1.0


def _until_next(saved: float) -> float:
    """Seconds of training to the next checkpoint: a kill costs half of a short training, or a minute."""
    return min(CHECKPOINT_SECONDS, max(FIRST_CHECKPOINT, saved))


def _stored(run: Run, checkpoint: Path) -> bool:
    """Whether the run's state could be written; where not, a warning says what is there to go on from."""
    try:
        run.store(checkpoint)
    except OSError as error:
        try:
            age = f"the last one, of {time.time() - checkpoint.stat().st_mtime:.0f} s ago, is kept"
        except OSError:
            age = "there is none to resume from"
        warnings.warn(
            f"the checkpoint cannot be written ({line_of(error)}); {age}, and training goes on", stacklevel=3
        )
        return False
    return True


@contextlib.contextmanager
def _interruptible() -> Iterator[Callable[[], bool]]:
    """Turns Ctrl-C into a flag that is checked between steps (in the main thread)."""
    pressed = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield pressed.is_set
        return

    def press(_signal: int, _frame: object) -> None:
        if pressed.is_set():
            raise KeyboardInterrupt
        pressed.set()

    before = signal.signal(signal.SIGINT, press)
    try:
        yield pressed.is_set
    finally:
        signal.signal(signal.SIGINT, before)
