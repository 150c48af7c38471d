"""Training loop: steps until the run is done or Ctrl-C is pressed, with checkpoints."""

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

MAX_CHECKPOINT_INTERVAL_SECONDS = 60.0
"""Maximum training time between two checkpoints."""

FIRST_CHECKPOINT_SECONDS = 5.0
"""Training time to the first checkpoint; each later one doubles the total."""


class Run(Protocol):
    """State of a training run."""

    step: int
    seconds: float

    @property
    def done(self) -> float:
        """Progress, 0 to 1."""

    def advance(self) -> None:
        """Take one step."""

    def progress(self) -> Any:
        """Progress report of the run."""

    def store(self, path: Path) -> None:
        """Write the state, whole or not at all."""

    def restore(self, path: Path) -> None:
        """Restore the state from a file."""


def run_to_end(
    run: Run,
    *,
    checkpoint: Path | str | None,
    resume: bool,
    on_progress: Callable[[Any], None] | None,
    after_step: Callable[[tuple[int, float]], None] = lambda before: None,
) -> bool:
    """True for a finished run, False for one that Ctrl-C ended early.

    The state is written to `checkpoint` after 5, 10, 20 and 40 seconds, then every minute, and at the end,
    early or not. `resume` continues from the checkpoint; a finished run takes no further step. Where the
    checkpoint cannot be written (a full disk), a warning says so, the previous one stays, and the run
    continues.
    `after_step` is called after each step and its report, with the (step, seconds) before it.

    Raises:
        CagefieldError: the checkpoint's folder is missing, or `restore` finds no readable checkpoint.
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
            if checkpoint is not None and run.seconds - saved > _checkpoint_interval_seconds(saved):
                saved = run.seconds
                if _store_or_warn(run, checkpoint):
                    stored = run.step
        if checkpoint is not None and run.step != stored:
            _store_or_warn(run, checkpoint)
    return run.done >= 1.0


def _checkpoint_interval_seconds(saved: float) -> float:
    """Training time to the next checkpoint: a kill costs at most half of a short run, or a minute."""
    return min(MAX_CHECKPOINT_INTERVAL_SECONDS, max(FIRST_CHECKPOINT_SECONDS, saved))


def _store_or_warn(run: Run, checkpoint: Path) -> bool:
    """Write the run's state; False, with a warning about the previous checkpoint, where that fails."""
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
    """Replace Ctrl-C by a flag that is checked between steps (in the main thread)."""
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
