"""Upload of a splat file that replaces the edited scene."""

from __future__ import annotations

import asyncio
import os
import re
from collections.abc import AsyncIterator, Callable
from pathlib import Path

from cagefield.errors import CagefieldError
from cagefield.files.temporary_folders import TemporaryFolder
from cagefield.server.protocol import server_messages
from cagefield.server.render_queue.coordinator import Coordinator
from cagefield.server.render_worker.subprocess_task import run_in_process
from cagefield.server.web.splat_file_scene import scene_of_file

MAX_UPLOAD_BYTES = 4 << 30
"""Largest file in bytes that a page may send: 17 million splats with harmonics of degree 3 as a PLY."""

STALL_TIMEOUT_SECONDS = 30.0
"""Seconds without a byte of a file that a page sends, after which it is given up."""

MAX_NAME_BYTES = 200
"""Bytes of the name of a file that a page sends: systems take 255, some with encryption 143."""

_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff]")
"""Characters forbidden in file names: systems refuse some, and others break lines."""

Opened = tuple[Coordinator, server_messages.Hello]
Reopen = Callable[[Path, Path], Opened]


class TooLargeError(CagefieldError):
    """A file larger than MAX_UPLOAD_BYTES."""


class OpenEditor:
    """The editor that pages are let into; opening a file changes it for another."""

    def __init__(self, coordinator: Coordinator, hello: server_messages.Hello, reopen: Reopen | None) -> None:
        """`reopen` makes the editor of a cached scene's folder and the file that it came from, if any may."""
        self.coordinator, self.hello = coordinator, hello
        self._reopen = reopen
        self._is_opening = asyncio.Lock()

    def start(self) -> None:
        """Starts the rendering process."""
        self.coordinator.dispatcher.start()

    async def open(self, name: str, content: AsyncIterator[bytes], size: int | None) -> None:
        """Opens a file of splats that a page sends, of a `size` that it says; pages come again by themselves.

        Unsaved changes stay in the autosave of the scene edited before.

        Raises:
            TooLargeError: more than MAX_UPLOAD_BYTES bytes.
            CagefieldError: another file is being opened, a name that is none, a file without splats.
        """
        if self._reopen is None:
            raise CagefieldError("this editor opens no files; start `cagefield view FILE`")
        if self._is_opening.locked():
            raise CagefieldError("another file is being opened; wait until it is there")
        async with self._is_opening:
            file_name = _file_name(name)
            with TemporaryFolder("open", tidy=False) as folder:
                try:
                    await _receive(folder / file_name, content, size)
                    scene = await run_in_process(scene_of_file, folder / file_name)
                except CagefieldError as error:
                    raise type(error)(str(error).replace(f"{folder}{os.sep}", "")) from None
            await self._enter(
                await asyncio.to_thread(self._reopen, scene, self.coordinator.store.root / file_name)
            )

    async def _enter(self, opened: Opened) -> None:
        """Lets pages into another editor; those of the one before come again."""
        before, (self.coordinator, self.hello) = self.coordinator, opened
        for page in list(before.pages.values()):
            page.send_queue.end()
        before.background.exports.close()
        # It may take seconds to end its process, which the loop has not.
        await asyncio.to_thread(before.dispatcher.close)
        before.store.close()
        self.start()

    def close(self) -> None:
        """Ends the rendering process and all that goes on."""
        self.coordinator.close()


def _file_name(name: str) -> str:
    """The last part of a name that a page gives. Raises CagefieldError where it is no name of a file."""
    last = Path(name.replace("\\", "/")).name.strip()
    if not last or last.startswith(".") or _CONTROL.search(last):
        raise CagefieldError(f"{name!r:.80} is no name of a file; give the file its name, such as x.ply")
    size = len(last.encode())
    if size > MAX_NAME_BYTES:
        raise CagefieldError(
            f"the name {last[:40]}... has {size} bytes, at most {MAX_NAME_BYTES}; rename the file"
        )
    return last


async def _receive(file: Path, content: AsyncIterator[bytes], size: int | None) -> None:
    """Write the received bytes to a file. Raises TooLargeError, and CagefieldError for an incomplete
    upload."""
    if size is not None and size > MAX_UPLOAD_BYTES:
        raise TooLargeError(_too_large(size))
    received, blocks = 0, content.__aiter__()
    with file.open("wb") as stream:
        while True:
            try:
                block = await asyncio.wait_for(blocks.__anext__(), STALL_TIMEOUT_SECONDS)
            except StopAsyncIteration:
                break
            except (TimeoutError, asyncio.TimeoutError):
                raise CagefieldError(
                    f"{file.name}: nothing more came for {STALL_TIMEOUT_SECONDS:g} s; send it again"
                ) from None
            received += len(block)
            if received > MAX_UPLOAD_BYTES:
                raise TooLargeError(_too_large(received))
            await asyncio.to_thread(stream.write, block)
    if size is not None and received != size:
        raise CagefieldError(f"{file.name}: {received} of {size} bytes came; send it again")


def _too_large(size: int) -> str:
    return (
        f"the file has {size / 1e9:.1f} GB or more, a page may send {MAX_UPLOAD_BYTES / 1e9:.1f}; "
        "open it with `cagefield view FILE`"
    )
