"""Draws the pictures of the tutorial's second page: a bend, a twist and a pull in the editor.

    python docs/tutorial/free_form_pictures.py digger SCENE
    python docs/tutorial/free_form_pictures.py nose SCENE       # of the digger, too
    python docs/tutorial/free_form_pictures.py plant SCENE

SCENE is the built-in scene, trained; it is copied first and left as it is. Cages are pasted as
text; everything else is done with the mouse and in the panel.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path

from pictures import EditorPage, Point, dragged, editor_page, editor_server, pasted, shot, turned

ARM = """\
edits:
  - name: bend the arm
    inner: {center: [0.69, -0.11, 0.11], size: [0.44, 0.42, 0.94]}
    outer: {center: [0.965, -0.11, 0.434], size: [1.13, 0.9, 1.652]}
"""

STEM = """\
edits:
  - name: twist the stem
    inner: {center: [-0.2, 0.12, 0.49], size: [1.0, 1.0, 0.96]}
    outer: {center: [-0.2, 0.12, 0.52], size: [1.7, 1.7, 1.14]}
"""

CABIN: Point = (490, 392)
"""Pixel of the cabin's side window in the view of `nose`."""


def main() -> None:
    """Runs a session."""
    name, path = sys.argv[1:]
    session = {"digger": digger, "nose": nose, "plant": plant}[name]
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / name
        shutil.copytree(path, scene)
        (scene / "edits.yaml").write_text("version: 1\nedits: []\n")
        with editor_server(scene) as server, editor_page(server.link, 1280, 800) as editor:
            editor.ready()
            session(editor)


def digger(editor: EditorPage) -> None:
    """The arm's lattice; the arm raised and bent: a picture of each."""
    turned(editor, (-230, -20))
    pasted(editor, ARM)
    subdivided(editor, cells_along_z=7)
    editor.tools(mode="edit", tool="translate")
    shot(editor, "lattice")
    dragged(editor, "Z", (0, -1), axis=2, by=0.15)
    unfolded(editor, "Bend, twist, taper")
    chosen(editor, "Fixed end", "End")
    filled(editor, "Angle", 40)
    editor.changed(lambda: clicked(editor, "Bend"))
    shot(editor, "bent")


def nose(editor: EditorPage) -> None:
    """A nose pulled out of the digger's cabin by one control point."""
    turned(editor, (-230, -20))
    editor.page.keyboard.down("Control")
    editor.changed(lambda: editor.page.mouse.dblclick(*CABIN))
    editor.page.keyboard.up("Control")
    editor.tools(mode="edit", tool="translate")
    editor.fill("Radius", 0.3)
    dragged(editor, "Y", (-1, 0), axis=1, by=0.2)
    shot(editor, "nose")


def plant(editor: EditorPage) -> None:
    """The stem twisted by a quarter turn, with its lattice."""
    turned(editor, (-200, -20))
    pasted(editor, STEM)
    subdivided(editor, cells_along_z=7)
    editor.tools(mode="edit", tool="select")
    unfolded(editor, "Bend, twist, taper")
    filled(editor, "Angle", 90)
    editor.changed(lambda: clicked(editor, "Twist"))
    shot(editor, "twisted")


def subdivided(editor: EditorPage, *, cells_along_z: int) -> None:
    """Makes a lattice of the selected cage."""
    unfolded(editor, "Lattice")
    filled(editor, "Cells", cells_along_z, "z")
    editor.changed(lambda: clicked(editor, "Subdivide"))
    unfolded(editor, "Lattice")


def unfolded(editor: EditorPage, title: str) -> None:
    """Opens a folder of the panel, or closes it."""
    editor.page.locator(".pane .tp-fldv_b", has_text=title).first.click()
    editor.page.wait_for_timeout(400)


def filled(editor: EditorPage, label: str, value: float, axis: str = "x") -> None:
    """Types a number into a field of the panel."""
    row = editor.page.locator(".pane .tp-lblv", has_text=label)
    field = row.locator("input").nth("xyz".index(axis))
    field.fill(str(value))
    field.press("Enter")


def chosen(editor: EditorPage, label: str, option: str) -> None:
    """Takes an option of a list of the panel."""
    editor.page.locator(".pane .tp-lblv", has_text=label).locator("select").first.select_option(label=option)


def clicked(editor: EditorPage, title: str) -> None:
    """Clicks a button of the panel."""
    editor.page.locator(".pane .tp-btnv_b", has_text=title).first.click()


if __name__ == "__main__":
    main()
