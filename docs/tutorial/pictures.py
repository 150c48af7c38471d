"""Draws the tutorial's pictures: sessions in the editor, in headless Chromium, with the mouse.

    python docs/tutorial/pictures.py digger SCENE
    python docs/tutorial/pictures.py chair SCENE
    python docs/tutorial/pictures.py drag SCENE      # of the digger: the animation at the README's top

SCENE is the built-in digger, or the chair of NeRF's synthetic scenes, trained; it is copied first and left as
it is. Cages are pasted as text; everything else is done with the mouse.
"""

from __future__ import annotations

import io
import shutil
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))

from PIL import Image

import cagefield
from editor_page import EditorPage, Point, editor_page
from editor_server import editor_server

HERE = Path(__file__).parent
ARM = (Path(cagefield.__file__).parent / "examples" / "digger.yaml").read_text(encoding="utf-8")

CONE = """\
edits:
  - name: second cone
    adjustment: discrete
    keep_source: true
    inner: {center: [0.65, 0.5, -0.2175], size: [0.255, 0.255, 0.365]}
"""

BEACON = """\
edits:
  - name: no beacon
    delete: true
    inner: {center: [-0.12, 0.2, 0.56], size: [0.12, 0.12, 0.08]}
"""

BACK = """\
edits:
  - name: raise the back
    lattice: 64
    inner: {center: [0, 0.57, 0.78], size: [1.1, 0.34, 0.68]}
    outer: {center: [0, 0.68, 0.85], size: [1.5, 1.16, 1.7]}
"""

CHAIR = """\
edits:
  - name: small chair
    adjustment: discrete
    keep_source: true
    inner: {center: [0, 0.1, 0.16], size: [1.5, 1.7, 2.4]}
"""

ARM_REST = """\
edits:
  - name: no arm rest
    delete: true
    inner: {center: [0.5, 0.11, 0.2], size: [0.28, 0.62, 0.42]}
"""


def main() -> None:
    """Runs a session."""
    name, path = sys.argv[1:]
    session = {"digger": digger, "chair": chair, "drag": drag}[name]
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / name
        shutil.copytree(path, scene)
        (scene / "edits.yaml").write_text("version: 1\nedits: []\n")
        with editor_server(scene) as server, editor_page(server.link, 1280, 800) as editor:
            editor.ready()
            session(editor)


def digger(editor: EditorPage) -> None:
    """Cages set, the arm raised, the cone copied, the beacon deleted: a picture of each."""
    turned(editor, (-230, -20))
    shot(editor, "open")
    pasted(editor, ARM[: ARM.index("    operations:")])
    editor.tools(mode="set", tool="select", cage="both")
    shot(editor, "cages")
    editor.tools(mode="edit", tool="translate")
    dragged(editor, "Z", (0, -1), axis=2, by=0.25)
    editor.tools(tool="rotate")
    dragged(editor, "Y", (0, -1), axis=1, by=-15)
    shot(editor, "raised")
    pasted(editor, CONE)
    editor.tools(mode="edit", tool="translate")
    dragged(editor, "X", (1, 0), axis=0, by=-1.4)
    dragged(editor, "Y", (1, 0), axis=1, by=-1)
    shot(editor, "copied")
    pasted(editor, BEACON)
    shot(editor, "deleted")


def chair(editor: EditorPage) -> None:
    """Cages set, the back raised and leant back, the chair copied, an arm rest deleted: a picture of each."""
    turned(editor, (300, -50))
    pasted(editor, BACK)
    editor.tools(mode="set", tool="select", cage="both")
    shot(editor, "chair-cages")
    editor.tools(mode="edit", tool="translate")
    dragged(editor, "Z", (0, -1), axis=2, by=0.2)
    editor.tools(tool="rotate")
    dragged(editor, "X", (0, -1), axis=0, by=-15)
    shot(editor, "chair-raised")
    pasted(editor, CHAIR)
    editor.tools(mode="edit", tool="scale")
    dragged(editor, "XYZ", (-1, 0), axis=0, by=0.5)
    editor.tools(tool="translate")
    dragged(editor, "Z", (0, 1), axis=2, by=-0.6)
    dragged(editor, "X", (1, 0), axis=0, by=-1.1)
    shot(editor, "chair-copied")
    pasted(editor, ARM_REST)
    shot(editor, "chair-deleted")


def drag(editor: EditorPage) -> None:
    """The arm raised and turned: a picture at every step, as an animation."""
    turned(editor, (-230, -20))
    pasted(editor, ARM[: ARM.index("    operations:")])
    editor.tools(mode="edit", tool="translate")
    editor.settle()
    frames: list[Image.Image] = []
    filmed(editor, "Z", [(0.0, -3.0 * step) for step in range(19)], frames)
    editor.tools(tool="rotate")
    filmed(editor, "Y", [(0.0, -4.0 * step) for step in range(9)], frames)
    times = [90] * len(frames)
    times[0] = times[-1] = 900
    frames[0].save(
        HERE.parent / "drag.webp",
        save_all=True,
        append_images=frames[1:],
        duration=times,
        quality=70,
        method=6,
    )


def filmed(editor: EditorPage, grip: str, path: list[Point], frames: list[Image.Image]) -> None:
    """Drags a handle of the gizmo along a path of pixels; a picture of the view at each of its points."""
    page, at = editor.page, editor.grip(grip)
    page.mouse.move(*at)
    page.mouse.down()
    for x, y in path:
        page.mouse.move(at[0] + x, at[1] + y)
        page.wait_for_timeout(900)
        frames.append(small_shot(editor))
    page.mouse.up()
    editor.until("cagefield.drag === null")
    editor.settle()
    frames.append(small_shot(editor))


def small_shot(editor: EditorPage) -> Image.Image:
    """The window at 5/8 of its size."""
    picture = Image.open(io.BytesIO(editor.page.screenshot(type="png"))).convert("RGB")
    return picture.resize((picture.width * 5 // 8, picture.height * 5 // 8), Image.Resampling.LANCZOS)


def shot(editor: EditorPage, name: str) -> None:
    """A picture of the window."""
    editor.settle()
    editor.page.mouse.move(640, 790)
    editor.page.wait_for_timeout(400)
    editor.page.screenshot(path=HERE / f"{name}.jpg", type="jpeg", quality=82)


def pasted(editor: EditorPage, text: str) -> None:
    """Pastes edits after those there are."""
    editor.page.evaluate("text => navigator.clipboard.writeText(text)", text)
    editor.changed(lambda: editor.press("Control+v"))


def turned(editor: EditorPage, by: Point) -> None:
    """Turns the view."""
    with editor.held((150, 690), by, steps=8):
        pass
    editor.settle()


def dragged(editor: EditorPage, grip: str, towards: Point, *, axis: int, by: float) -> None:
    """Drags a handle of the gizmo, snapping, until the operation's number is reached.

    Where that number moves away from it, the mouse goes the other way.
    """
    page, at = editor.page, editor.grip(grip)
    page.mouse.move(*at)
    page.keyboard.down("Control")
    page.mouse.down()
    way, pixels = 1.0, 0
    while abs((now := number(editor, axis)) - by) > 1e-6:
        if now * by < 0 and way > 0:
            way, pixels = -1.0, 0
        pixels += 5
        assert pixels < 1200, f"the drag came to {now}, not to {by}"
        page.mouse.move(at[0] + way * towards[0] * pixels, at[1] + way * towards[1] * pixels)
        page.wait_for_timeout(5)
    page.mouse.up()
    page.keyboard.up("Control")
    editor.until("cagefield.drag === null")
    editor.settle()


def number(editor: EditorPage, axis: int) -> float:
    """A number of the drag's operation, 0 before there is one."""
    operation = editor.page.evaluate("cagefield.drag?.followed") or {}
    return float(operation.get("rotation_deg", operation.get("by", [0, 0, 0]))[axis])


if __name__ == "__main__":
    main()
