"""Files of splats in the page, in a real browser: opened, dropped, saved and downloaded."""

from __future__ import annotations

import base64
import zipfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from cagefield.compute.kernel_cache import kernel_cache
from cagefield.edits.edit_files import load_edits
from cagefield.formats.splats.splat_files import read_splats, write_splats
from cagefield.rendering.splats.bake_splats import baked_splats
from cagefield.scene.scene import Scene
from editor_cone import cone
from editor_page import EditorPage, editor_page
from editor_server import editor_server
from splat_scenes import ball_of_splats

pytestmark = [
    pytest.mark.nightly,
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]

EDIT = (
    "version: 1\nedits:\n  - name: ball\n    inner: {center: [0, 0, 0], size: 1.3}\n"
    "    operations: [translate: [0.25, 0, 0]]\n    adjustment: discrete\n"
)
DROP = """
([name, content]) => {
  const bytes = Uint8Array.from(atob(content), (c) => c.charCodeAt(0));
  const data = new DataTransfer();
  data.items.add(new File([bytes], name));
  const over = new DragEvent("dragover", { dataTransfer: data, bubbles: true, cancelable: true });
  const drop = new DragEvent("drop", { dataTransfer: data, bubbles: true, cancelable: true });
  for (const event of [over, drop]) document.querySelector("canvas").dispatchEvent(event);
  return over.defaultPrevented;
}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A folder with a file of splats, and a cache of its own beside the compiled kernels of all tests."""
    base, kernels = tmp_path_factory.mktemp("files"), kernel_cache()
    (base / "cache" / "cagefield").mkdir(parents=True)
    if kernels is not None:
        (base / "cache" / "cagefield" / "kernels").symlink_to(kernels.parent)
    (base / "capture").mkdir()
    write_splats(ball_of_splats(), base / "capture" / "ball.ply")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(base / "cache"))
        yield base / "capture"


@pytest.fixture(scope="module")
def editor(folder: Path) -> Iterator[EditorPage]:
    with editor_server(folder / "ball.ply") as server, editor_page(server.link) as page:
        page.ready()
        yield page


def test_a_file_is_there_at_once(editor: EditorPage) -> None:
    assert editor.page.inner_text(".scene-name") == "ball.ply"
    assert cone(editor.pixels()).area > 500


def test_the_edited_splats_download_with_the_edits_in_them(editor: EditorPage, folder: Path) -> None:
    (folder.parent / "ball.yaml").write_text(EDIT)
    editor.load(folder.parent / "ball.yaml")
    with editor.page.expect_download() as waiting:
        editor.page.click(".download")
        editor.page.click("dialog[open] .primary")
    download = waiting.value
    assert download.suggested_filename == "ball.ply"
    download.save_as(folder.parent / "down.ply")
    means = read_splats(folder.parent / "down.ply").means
    edits = load_edits(folder.parent / "ball.yaml")
    expected = baked_splats(read_splats(folder / "ball.ply"), edits).means
    assert expected[:, 0].mean() > 0.05
    np.testing.assert_allclose(np.sort(means, axis=0), np.sort(expected, axis=0), atol=1e-6)
    assert [entry.name for entry in folder.iterdir()] == ["ball.ply"]


@pytest.mark.nightly
def test_levels_of_detail_download_as_an_archive(editor: EditorPage, folder: Path) -> None:
    with editor.page.expect_download() as waiting:
        editor.page.click(".download")
        editor.page.select_option("dialog[open] select[name=form]", "lod")
        editor.page.click("dialog[open] .primary")
    download = waiting.value
    assert download.suggested_filename == "ball.lod.zip"
    download.save_as(folder.parent / "down.zip")
    zipfile.ZipFile(folder.parent / "down.zip").extractall(folder.parent / "levels")
    assert len(read_splats(folder.parent / "levels" / "ball")) == len(read_splats(folder / "ball.ply"))


def test_saving_a_file_asks_where_to(editor: EditorPage, folder: Path) -> None:
    editor.press("Control+s")
    field = editor.page.locator("dialog[open] input[type=text]")
    assert field.input_value() == str(folder / "ball-scene")
    editor.changed(lambda: editor.page.click("dialog[open] .primary"))
    assert [edit.name for edit in Scene.open(folder / "ball-scene").edits] == ["ball"]
    assert editor.state["saved"] and not editor.state["is_file"]


def test_what_is_no_file_of_splats_is_a_line(editor: EditorPage) -> None:
    content = base64.b64encode(b"no splats").decode()
    assert editor.page.evaluate(DROP, ["bad.ply", content])
    editor.until("document.querySelector('.toast.error')?.textContent.includes('bad.ply: not a PLY file')")
    assert editor.page.inner_text(".scene-name") == "ball.ply"


def test_a_dropped_file_opens(editor: EditorPage, folder: Path) -> None:
    small = folder.parent / "small.ply"
    write_splats(ball_of_splats(400, radius=0.2), small)
    before = cone(editor.pixels()).area
    content = base64.b64encode(small.read_bytes()).decode()
    assert editor.page.evaluate(DROP, [small.name, content])
    editor.until("cagefield.now.hello.name === 'small.ply' && cagefield.now.state !== null")
    editor.settle()
    assert editor.state["edits"] == [] and editor.state["is_file"]
    # Its cameras stand around it: as large in the picture as the ball before.
    assert cone(editor.pixels()).area == pytest.approx(before, rel=0.3)
    assert editor.page.inner_text(".scene-name") == "small.ply"
