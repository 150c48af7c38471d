"""Draws the tutorial's pictures: one session on the digger in the editor, in headless Chromium.

    python docs/tutorial/pictures.py SCENE

SCENE is the built-in digger, trained; it is copied first and left as it is.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))

from editor_page import EditorPage, editor_page
from editor_server import editor_server

HERE = Path(__file__).parent

ARM = """\
version: 1
edits:
  - name: arm
    inner: {center: [0.68, -0.11, 0.35], size: [0.5, 0.5, 1.1]}
    outer: {margin: 0.3}
    lattice: 64
"""

CONE = """\
  - name: cone
    adjustment: discrete
    keep_source: true
    inner: {center: [0.65, 0.5, -0.2175], size: [0.255, 0.255, 0.365]}
    operations:
      - translate: [0, -0.97, 0]
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

    def chosen(action: Callable[[], object]) -> None:
        editor.changed(action)  # type: ignore[arg-type]

    shot("open")
    load(ARM)
    editor.tools(mode="set", tool="select", cage="both")
    shot("cages")
    editor.tools(mode="edit", tool="translate")
    editor.drag(editor.grip("Z"), (0, -45))
    editor.tools(tool="rotate")
    editor.drag(editor.grip("Y"), (0, 30))
    shot("raised")
    load(
        ARM.rstrip()
        + "\n    operations:\n      - rotate_deg: [0, -10, 0]\n      - translate: [0, 0, 0.1]\n"
        + CONE
    )
    shot("copied")
    chosen(lambda: editor.page.locator(".pane select").first.select_option("Delete"))
    shot("deleted")


if __name__ == "__main__":
    main()
