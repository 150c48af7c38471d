"""Draws the tutorial's pictures: one session on the digger in the editor, in headless Chromium.

    python docs/tutorial/pictures.py SCENE

SCENE is the built-in digger, trained; it is copied first and left as it is.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))

import cagefield
from editor_page import EditorPage, editor_page
from editor_server import editor_server

HERE = Path(__file__).parent

FILE = Path(cagefield.__file__).parent / "examples" / "digger.yaml"

COPY = """\
  - name: second cone
    adjustment: discrete
    keep_source: true
    inner: {center: [0.65, 0.5, -0.2175], size: [0.255, 0.255, 0.365]}
    operations:
      - translate: [-1.4, -1, 0]
"""

DELETE = """\
  - name: no beacon
    delete: true
    inner: {center: [-0.12, 0.2, 0.56], size: [0.12, 0.12, 0.08]}
"""


def main() -> None:
    """Run the session."""
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "digger"
        shutil.copytree(sys.argv[1], scene)
        (scene / "edits.yaml").write_text("version: 1\nedits: []\n")
        with editor_server(scene) as server, editor_page(server.link, 1280, 800) as editor:
            editor.ready()
            session(editor, Path(folder))


def session(editor: EditorPage, folder: Path) -> None:
    """Cages set, the arm raised, the cone copied, the beacon deleted: a picture of each."""

    def shot(name: str) -> None:
        editor.settle()
        editor.page.mouse.move(640, 790)
        editor.page.wait_for_timeout(400)
        editor.page.screenshot(path=HERE / f"{name}.jpg", type="jpeg", quality=82)

    def load(text: str) -> None:
        file = folder / "edits.yaml"
        file.write_text(text)
        editor.changed(lambda: editor.page.set_input_files("input[type=file]", file))

    def turned(by: tuple[float, float]) -> None:
        with editor.held((150, 690), by, steps=8):
            pass
        editor.settle()

    edits = FILE.read_text(encoding="utf-8")
    turned((-230, -20))
    shot("open")
    load(edits[: edits.index("    operations:")])
    editor.tools(mode="set", tool="select", cage="both")
    shot("cages")
    editor.tools(mode="edit", tool="rotate")
    editor.drag(editor.grip("Y"), (0, -13))
    editor.tools(tool="translate")
    editor.drag(editor.grip("Z"), (0, -55))
    shot("raised")
    load(edits + COPY)
    shot("copied")
    load(edits + COPY + DELETE)
    shot("deleted")


if __name__ == "__main__":
    main()
