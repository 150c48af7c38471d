"""What the processes of an editor keep, and what they give back."""

from __future__ import annotations

import asyncio
import gc
import sys
import threading
import time
import weakref

import numpy as np
import pytest

from cagefield.cameras.camera import Camera
from cagefield.compute import devices
from cagefield.edits import Edit
from cagefield.geometry.cage import Cage
from cagefield.server.render_worker import page_files, renderer_cache, unused_memory
from cagefield.server.render_worker.refinement import Refinement
from cagefield.server.render_worker.renderer_cache import KEPT_EDITS, RendererCache
from cagefield.server.render_worker.tasks import PageEditsTask, Shown, values_of
from cagefield.server.render_worker.unused_memory import UnusedMemory
from cagefield.server.web.worker_threads import run_in_thread, start_all_threads
from scenes import ball_scene

INNER = Cage.box((0, 0, 0), 1.2)
MOVED = Edit.continuous(INNER, INNER.grown(0.4), lattice=40, relight="none").translate((0.2, 0, 0))
CAMERA = Camera.look_at((0, -3, 0.8), (0, 0, 0), width=8, height=8, fov_x=0.8)


@pytest.fixture
def renderers() -> RendererCache:
    devices.start()
    return RendererCache(ball_scene())


def _moved(number: int) -> Edit:
    return MOVED.translate((0.001 * number, 0, 0))


def _resident() -> int:
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * 4096


def test_edits_shown_before_are_the_same_objects_as_far_as_their_lattices_have_room(
    renderers: RendererCache, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(renderer_cache, "KEPT_BYTES", 3 * 12 * 40**3)
    first = [renderers.edits(values_of((_moved(number),)))[0] for number in range(5)]
    again = renderers.edits(values_of((_moved(3),)))
    assert again[0] is first[3]
    assert [edit is first[n] for edit, n in zip(renderers.known_edits, (3, 4, 2, 1), strict=True)] == [
        True
    ] * 4


def test_all_edits_that_are_shown_are_kept(renderers: RendererCache) -> None:
    many = values_of(tuple(_moved(number) for number in range(KEPT_EDITS + 6)))
    first, second = renderers.edits(many), renderers.edits(many)
    assert all(one is other for one, other in zip(first, second, strict=True))


@pytest.mark.parametrize("lattice", [40, None], ids=["lattice", "exact"])
def test_edits_that_are_not_kept_are_nowhere(
    renderers: RendererCache, monkeypatch: pytest.MonkeyPatch, lattice: int | None
) -> None:
    """Quick renderers and files for pages hold what was made of an edit no longer than it is kept."""
    monkeypatch.setattr(renderer_cache, "KEPT_EDITS", 1)
    pages = page_files.PageFiles(renderers)
    seen = []
    for number in range(4):
        shown = Shown(values_of((_moved(number).replace(lattice=lattice),)))
        renderers.renderer(shown, Refinement.DRAFT)
        pages.edits(PageEditsTask(1, shown, Refinement.DRAFT, (), 0), lambda: False)
        drawn = pages._prepared(renderers.known_edits[0])  # the edit itself, or one with a lattice
        seen.append((weakref.ref(renderers.known_edits[0]), weakref.ref(drawn)))
        del drawn
    gc.collect()
    # The renderers that are ready hold the last two.
    assert [ref() for refs in seen[:2] for ref in refs] == [None] * 4 and seen[3][0]() is not None


@pytest.mark.skipif(sys.platform != "linux", reason="other C libraries have no malloc_trim")
def test_memory_between_blocks_in_use_is_given_back(monkeypatch: pytest.MonkeyPatch) -> None:
    if UnusedMemory()._trim is None:
        pytest.skip("this C library has no malloc_trim")
    monkeypatch.setattr(unused_memory, "RETURN_INTERVAL_SECONDS", 0.0)
    blocks = [np.ones(2500) for _ in range(5000)]  # of 20 kB: none has a mapping of its own
    del blocks[:-1]
    before = _resident()
    assert UnusedMemory().give_back()
    assert before - _resident() > 60 << 20  # of 95 MiB that are free


def test_it_is_not_given_back_all_the_time() -> None:
    assert not UnusedMemory().give_back()


def test_it_is_given_back_again_and_again(monkeypatch: pytest.MonkeyPatch) -> None:
    times = []
    monkeypatch.setattr(unused_memory, "RETURN_INTERVAL_SECONDS", 0.01)
    monkeypatch.setattr(UnusedMemory, "give_back", lambda self: times.append(self))

    async def a_while() -> None:
        giving = asyncio.create_task(unused_memory.return_memory_periodically())
        while len(times) < 3:
            await asyncio.sleep(0.01)
        giving.cancel()

    asyncio.run(asyncio.wait_for(a_while(), 30.0))
    assert len({id(each) for each in times}) == 1  # which knows when it last did


def test_no_thread_begins_after_the_start() -> None:
    """Each keeps memory of its own, and one more would be there for ever."""

    async def much() -> int:
        asyncio.get_running_loop().set_default_executor(start_all_threads(3))
        before = threading.active_count()
        await asyncio.gather(*(run_in_thread(lambda: time.sleep(0.02)) for _ in range(20)))
        return threading.active_count() - before

    before = threading.active_count()
    assert asyncio.run(much()) == 0
    assert threading.active_count() == before  # they end with the loop


def test_where_the_system_has_no_more_threads_those_that_there_are_work(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    start, begun = threading.Thread.start, []

    def limited(thread: threading.Thread) -> None:
        if sum(each.is_alive() for each in begun) == 3:
            raise RuntimeError("can't start new thread")
        begun.append(thread)
        start(thread)

    monkeypatch.setattr(threading.Thread, "start", limited)
    with start_all_threads(5) as executor:
        assert sum(each.is_alive() for each in begun) == 2
        assert [executor.submit(pow, 2, each).result(30.0) for each in range(4)] == [1, 2, 4, 8]
