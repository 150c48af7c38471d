# SPDX-License-Identifier: GPL-3.0-or-later
"""The process of cagefield: started with the interpreter of the preferences, asked in frames.

`Worker.submit` returns at once; `poll` gives the answers that have come. Of requests of one channel that
wait while another is answered, only the newest is sent: earlier ones have no answer.
"""

import os
import queue
import subprocess
import threading
import time

from . import frames

MODULE = "cagefield.integrations.splat_worker"
PROTOCOL_VERSION = 1
INSTALL = 'install it with "{python}" -m pip install cagefield, or choose another interpreter'
START_TIMEOUT_S = 120.0
LAST_LINES = 20


class WorkerError(Exception):
    """A process that does not start or has ended, or a request that it refused: one line, with the cure."""


class Worker:
    """A process of cagefield and its requests. Started on the main thread, whose end it would not outlive."""

    def __init__(self, python):
        self.python = python
        self.loaded = None
        """Key of the splats that the process has, None for none."""
        environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONHOME", "PYTHONNOUSERSITE")}
        command = [python, "-m", MODULE, "--parent", str(os.getpid())]
        try:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                env=environment,
                creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
            )
        except OSError as error:
            raise WorkerError(
                f"{python} does not start ({error.strerror}); choose a Python with cagefield"
            ) from None
        self._number = 0
        self._waiting = []
        self._unanswered = None
        self._outgoing, self._incoming = queue.Queue(), queue.Queue()
        self._errors = []
        for work in (self._write, self._read, self._read_errors):
            threading.Thread(target=work, daemon=True, name="cagefield").start()

    @property
    def is_running(self):
        """False once the process has ended."""
        return self._process.poll() is None

    @property
    def is_busy(self):
        """True while an answer is awaited."""
        return self._unanswered is not None or bool(self._waiting)

    def submit(self, header, arrays, done, channel=None):
        """Sends a request when those before it are answered; `done(header, arrays)` is called by `poll`.

        A request that waits in the same channel, not None, is replaced.
        """
        if channel is not None:
            self._waiting = [item for item in self._waiting if item[3] != channel]
        self._waiting.append((header, arrays, done, channel))
        self._send()

    def poll(self):
        """Calls `done` of the answers that have come; an answer's header may have an "error".

        Raises WorkerError where the process has ended.
        """
        while True:
            try:
                answer = self._incoming.get_nowait()
            except queue.Empty:
                break
            if answer is None:
                raise WorkerError(self._last_words())
            header, arrays = answer
            done, self._unanswered = self._unanswered, None
            self._send()
            if done is None:
                raise WorkerError(header.get("error", "cagefield answered a request that nobody made"))
            done(header, arrays)

    def ask(self, header, arrays=None, timeout_s=None):
        """(header, arrays) of a request's answer, once it has come.

        Raises WorkerError for a request that is refused, a process that has ended, or a timeout.
        """
        answers = []
        self.submit(header, arrays or {}, lambda *answer: answers.append(answer))
        end = None if timeout_s is None else time.monotonic() + timeout_s
        while not answers:
            self.poll()
            if not answers:
                time.sleep(0.002)
            if end is not None and time.monotonic() > end:
                self.close()
                raise WorkerError(
                    f"{self.python} did not answer within {timeout_s:.0f} s; choose another Python"
                )
        reply, values = answers[0]
        if "error" in reply:
            raise WorkerError(reply["error"])
        return reply, values

    def close(self):
        """Ends the process."""
        self._outgoing.put(None)
        self._process.kill()
        self._process.wait()

    def _send(self):
        if self._unanswered is None and self._waiting:
            header, arrays, done, _ = self._waiting.pop(0)
            self._number += 1
            self._unanswered = done
            self._outgoing.put(({**header, "id": self._number}, arrays))

    def _write(self):
        while (item := self._outgoing.get()) is not None:
            try:
                frames.write_frame(self._process.stdin, *item)
            except (OSError, ValueError):
                return  # the process has ended: `_read` says so

    def _read(self):
        try:
            while (answer := frames.read_frame(self._process.stdout)) is not None:
                self._incoming.put(answer)
        except (OSError, ValueError, frames.FrameError) as error:
            self._errors.append(str(error))
        self._incoming.put(None)

    def _read_errors(self):
        for line in self._process.stderr:
            self._errors = [*self._errors, line.decode(errors="replace").strip()][-LAST_LINES:]

    def _last_words(self):
        """One line for a process that has ended."""
        try:
            self._process.wait(timeout=2.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
        text = " ".join(self._errors)
        if "No module named" in text and "cagefield" in text:
            return f"{self.python} has no cagefield; {INSTALL.format(python=self.python)}"
        said = self._errors[-1] if self._errors else f"exit code {self._process.poll()}"
        return f"the process of cagefield has ended ({said:.200})"


def started(python):
    """A worker that has answered, with cagefield's version: (worker, version).

    Raises WorkerError for an interpreter without cagefield, or with one of another protocol.
    """
    if not python:
        raise WorkerError("no Python with cagefield is chosen; set it in the add-on's preferences")
    worker = Worker(python)
    try:
        reply, _ = worker.ask({"request": "hello"}, timeout_s=START_TIMEOUT_S)
    except WorkerError:
        worker.close()
        raise
    if reply.get("protocol") != PROTOCOL_VERSION:
        worker.close()
        raise WorkerError(
            f"cagefield {reply.get('version')} speaks protocol {reply.get('protocol')}, the add-on"
            f" {PROTOCOL_VERSION}; update the older one"
        )
    return worker, str(reply.get("version"))
