"""An editor that is flooded goes on: another page has its answers, and memory stays.

`benchmarks/robustness/floods.py` measures how long the other page waits; a test asserts no time.
"""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from floods import during, memory

from editor_server import EditorServer, editor_server
from scenes import ball_scene

pytestmark = pytest.mark.nightly


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[EditorServer]:
    """An editor of a small scene."""
    folder = tmp_path_factory.mktemp("flooded") / "scene"
    ball_scene().save(folder)
    with editor_server(folder) as running:
        yield running


@pytest.mark.parametrize(
    "name",
    [
        "binary messages",
        "pages that never read",
        "edit files of 300 edits",
        "requests half sent",
        "wrong tokens",
    ],
)
def test_another_page_has_its_answers(server: EditorServer, name: str) -> None:
    before = memory(server.process.pid)
    found = during(server, name, questions=4, every=0.1)
    assert len(found.seconds) == 4
    assert found.most - before < 200 << 20
