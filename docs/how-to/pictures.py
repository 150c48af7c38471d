"""Pictures of the how-to pages: hotspots, frames of a path, decimation, a measured distance.

    python docs/how-to/pictures.py hotspots SCENE      # in the editor, in a page, under an edit
    python docs/how-to/pictures.py frames SCENE        # the dialog, and four frames of the exported USD
    python docs/how-to/pictures.py measure SCENE       # two points measured in the editor
    python docs/how-to/pictures.py decimated SCENE     # all splats, a quarter and a sixteenth
    python docs/how-to/pictures.py aligned SCENE       # a paste before and after its alignment
    python docs/how-to/pictures.py pairs SCENE         # pairs of points picked in the editor
    python docs/how-to/pictures.py up SCENE            # up by three points in the editor, before and after
    python docs/how-to/pictures.py published FOLDER    # of `cagefield bench publish`, its pictures

SCENE is `biker.compressed.ply` of PlayCanvas' examples, imported; it is copied first and left as it is.
"""

from __future__ import annotations

import dataclasses
import io
import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))

import numpy as np
from PIL import Image
from scipy.spatial.transform import Rotation

from cagefield import Cage, Camera, Edit, EditStack, Hotspot, Scene, load_edits
from cagefield.cameras.keyframes import Keyframe
from cagefield.edits.grade import Grade, grade_sh
from cagefield.exporting import edited_splats
from cagefield.exporting.path_frames import CameraPath
from cagefield.exporting.similarity import transform_field
from cagefield.exporting.usd_scenes import StageScene, write_scenes_usd
from cagefield.fields.splat_decimation import decimate_splats
from cagefield.fields.splat_field import SplatField
from cagefield.formats.splats.splat_files import read_splats
from cagefield.geometry.point_alignment import Similarity
from cagefield.images.metrics import psnr
from cagefield.pages.scene_page import ScenePage
from cagefield.rendering.splats.splat_renderer import SplatRenderer
from cagefield.scene.alignment import Alignment
from cagefield.scene.hotspots import view_of_camera
from cagefield.scene.paste_alignment import align_paste, placed
from chromium import chromium_context
from editor_page import EditorPage, editor_page
from editor_server import editor_server
from splat_rooms import room

HERE = Path(__file__).parent
HELMET = load_edits(HERE.parent / "edits" / "biker_larger_helmet.yaml")
HELMET_PIXEL, KNEE_PIXEL = (150, 262), (190, 488)
"""Pixels of the camera of `hotspots`."""
PAIR_PIXELS = ((400, 146), (283, 205), (331, 216))
"""Belt, hand and letters, in the camera of `_hips`."""
FLOOR_POINTS = ((-0.7, -0.7, 0.0), (0.7, -0.7, 0.0), (-0.5, 0.6, 0.0))
PAGE_SPLATS = 50_000
"""Splats of the scene in the browser, which draws in software."""


def main() -> None:
    """Runs a session."""
    name, path = sys.argv[1:]
    if name == "published":
        return published(Path(path))
    sessions = (hotspots, tour, frames, measure, decimated, aligned, pairs, up)
    session = {one.__name__: one for one in sessions}[name]
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "biker"
        shutil.copytree(path, scene)
        session(Scene.open(scene), Path(folder))


def hotspots(scene: Scene, folder: Path) -> None:
    """The dialog of a hotspot; a page with an open card; both hotspots before and after an edit."""
    camera = near(scene, 500, 560)
    assert isinstance(scene.field, SplatField)
    scene = dataclasses.replace(scene, field=decimate_splats(scene.field, PAGE_SPLATS))
    text = "In his hand.\nHalf as large again after the edit."
    helmet = Hotspot("Helmet", surface(scene, camera, HELMET_PIXEL), text)
    knee = Hotspot(
        "Knee slider", surface(scene, camera, KNEE_PIXEL), "Stays where it is.", view_of_camera(camera)
    )
    marked = dataclasses.replace(
        scene,
        hotspots=tuple(dataclasses.replace(hotspot, follows=True) for hotspot in (helmet, knee)),
        cameras={"test": (camera,)},
    )
    parts = []
    for edits in (EditStack(), HELMET):
        parts.append(page_shot(marked.with_edits(edits), folder, "cagefieldViewer.hotspots.arrange()"))
    beside(parts).save(HERE / "hotspots-edit.jpg", quality=85)
    shown = page_shot(marked.with_edits(HELMET), folder, "cagefieldViewer.hotspots.open(0)")
    shown.save(HERE / "hotspots-page.jpg", quality=85)
    marked.save(folder / "marked")
    with editor_server(folder / "marked") as server, editor_page(server.link, 1100, 680) as editor:
        editor.ready()
        editor.press("Shift+H")
        box = editor.box
        editor.page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
        editor.page.fill("dialog[open] input[name=title]", "Jacket")
        editor.page.fill("dialog[open] textarea", "Leather, worn at the seams.")
        screen(editor, "hotspots-editor")


def tour(scene: Scene, folder: Path) -> None:
    """The tour of two hotspots as the camera path, played to its second stop."""
    camera = near(scene, 500, 560)
    assert isinstance(scene.field, SplatField)
    helmet, knee = (surface(scene, camera, at) for at in (HELMET_PIXEL, KNEE_PIXEL))
    marked = dataclasses.replace(
        scene,
        field=decimate_splats(scene.field, PAGE_SPLATS),
        hotspots=(Hotspot("Helmet", helmet, "In his hand."), Hotspot("Knee slider", knee)),
        cameras={"test": (camera,)},
    )
    marked.save(folder / "marked")
    with editor_server(folder / "marked") as server, editor_page(server.link, 1100, 680) as editor:
        editor.ready()
        editor.page.click("button.tour")
        editor.changed(lambda: editor.page.click("dialog[open] .primary"))
        editor.page.locator(".hotspot-list").scroll_into_view_if_needed()
        editor.page.click("button.play")
        editor.until(
            "(keys => Math.hypot(...[3, 7, 11].map(k => cagefield.camera.c2w[k] - keys[6].c2w[k])) < 0.01)"
            "(cagefield.now.state.keys)"
        )
        editor.page.wait_for_timeout(500)
        shot = editor.page.screenshot()
        Image.open(io.BytesIO(shot)).convert("RGB").save(HERE / "hotspots-tour.jpg", quality=80)


def frames(scene: Scene, folder: Path) -> None:
    """The dialog of frames, and four frames of a USD file with time samples."""
    camera = near(scene, 300, 380)
    keys = tuple(Keyframe(tuple(camera.c2w.ravel().tolist()), 40.0, 1.0, {1: part}) for part in (0.0, 1.0))
    edited = dataclasses.replace(scene.with_edits(HELMET), cameras={"test": (camera,)})
    file = folder / "biker.usdc"
    write_scenes_usd(file, [StageScene("biker", edited, edited.up)], CameraPath(keys, fps=3.0))
    pictures = [drawn(read_splats(file, time_code=n), camera) for n in range(4)]
    beside(pictures).save(HERE / "frames.jpg", quality=85)
    edited.save(folder / "edited")
    with editor_server(folder / "edited") as server, editor_page(server.link, 1100, 680) as editor:
        editor.ready()
        editor.changed(lambda: editor.press("k"))
        editor.changed(lambda: editor.press("k"))
        editor.page.click("text=Download frames…")
        editor.page.select_option("dialog[open] select[name=form]", "usdc")
        screen(editor, "frames-editor")


def measure(scene: Scene, folder: Path) -> None:
    """Two points of a surface, and the dialog that asks for the meters between them."""
    dataclasses.replace(scene, cameras={"test": (near(scene, 500, 560),)}).save(folder / "near")
    with editor_server(folder / "near") as server, editor_page(server.link, 1100, 680) as editor:
        editor.ready()
        editor.press("Shift+M")
        box = editor.box
        for count, (x, y) in enumerate(((0.5, 0.3), (0.5, 0.65)), start=1):
            editor.page.mouse.click(box["x"] + x * box["width"], box["y"] + y * box["height"])
            editor.until(f"cagefield.now.measured.length === {count}")
        editor.page.fill("dialog[open] input[name=meters]", "0.6")
        screen(editor, "measure")


def decimated(scene: Scene, folder: Path) -> None:
    """All splats, a quarter and a sixteenth, and the PSNR of the two."""
    field, camera = scene.field, near(scene, 400, 460)
    assert isinstance(field, SplatField)
    pictures, whole = [], None
    for share in (1, 4, 16):
        fewer = decimate_splats(field, len(field) // share)
        frame = SplatRenderer(fewer).render(camera, background="white")
        assert frame is not None
        whole = frame.rgb if whole is None else whole
        print(f"{len(fewer)} splats" + (f", {psnr(frame.rgb, whole):.1f} dB" if share > 1 else ""))
        pictures.append(Image.fromarray(frame.rgb8()))
    beside(pictures).save(HERE / "decimated.jpg", quality=85)


def aligned(scene: Scene, folder: Path) -> None:
    """The upper half of a darker capture in other units, pasted somewhere, and aligned by rough pairs."""
    field, first = scene.field, scene.first_camera
    assert isinstance(field, SplatField)
    away = (first.origin - first.origin.mean()) * (1, 0, 1)
    eye = np.array([0.3, -1.7, 0.0]) + 6.5 * away / np.linalg.norm(away)
    camera = Camera.look_at(eye, (0.3, -1.7, 0.0), scene.up, width=420, height=480, fov_x=0.62)
    other = Similarity(
        0.7, Rotation.from_euler("xyz", (9, 35, -6), degrees=True).as_matrix(), np.array([2, 1, 0])
    )
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = other.scale * other.rotation, other.translation
    darker = np.broadcast_to(Grade(exposure=-0.9, temperature=-0.4).matrix, (len(field), 3, 3))
    moved = transform_field(dataclasses.replace(field, sh=grade_sh(field.sh, darker), bounds=None), matrix)
    dataclasses.replace(scene, field=moved, cameras={}).save(folder / "other")
    # The file's y points down; both halves have the belt.
    is_lower = (field.means[:, 1] > -1.2) & (field.scales.max(axis=1) < 0.1)
    lower = dataclasses.replace(scene, field=field.take(np.flatnonzero(is_lower)), folder=folder / "biker")
    is_upper = field.means[:, 1] < -1.0
    inner = Cage.box(*_center_and_size(moved.means[is_upper]))
    belt = field.means[is_lower & is_upper].astype(float)
    goals = belt[[*belt[:, ::2].argmin(axis=0), *belt[:, ::2].argmax(axis=0)]]
    noise = np.random.default_rng(0).normal(0.0, 0.03, goals.shape)
    back = Similarity(1.1, np.eye(3), np.array([-1.6, -2.0, 0.3]))
    before = placed(Edit.paste("../other", inner, name="upper"), back)
    after = align_paste(
        lower, before, other.transform_points(goals), goals + noise, refine=True, match_colors=True
    )
    print(after.residual, after.refinement, after.edit.operations, after.edit.grading)
    pictures = [
        drawn(edited_splats(lower.with_edits(EditStack([edit]))), camera) for edit in (before, after.edit)
    ]
    beside(pictures).save(HERE / "aligned.jpg", quality=85)


def pairs(scene: Scene, folder: Path) -> None:
    """A paste in other units beside its place, three pairs and the dialog, and the paste on its place."""
    field = scene.field
    assert isinstance(field, SplatField)
    is_person = field.scales.max(axis=1) < 0.1
    lower = field.take(np.flatnonzero(is_person & (field.means[:, 1] > -2.1)))  # the file's y points down
    upper = field.take(np.flatnonzero(is_person & (field.means[:, 1] < -1.2)))
    darker = np.broadcast_to(Grade(exposure=-0.9, temperature=-0.4).matrix, (len(upper), 3, 3))
    upper = dataclasses.replace(upper, sh=grade_sh(upper.sh, darker), bounds=None)
    away, right = _directions(scene)
    side = Camera.look_at(*_hips(scene, away), width=760, height=560, fov_x=0.85)
    goals = [np.array(surface(scene, side, pixel)) for pixel in PAIR_PIXELS]
    target = np.array([0.0, -1.7, 0.1]) + 0.5 * right
    camera = Camera.look_at(target + 5.4 * away, target, scene.up, width=760, height=560, fov_x=0.85)
    dataclasses.replace(scene, field=upper, cameras={}).save(folder / "other")
    dataclasses.replace(scene, field=lower, cameras={"test": (camera,)}).save(folder / "lower")
    turn = Rotation.from_rotvec(0.25 * scene.up).as_matrix()
    middle, _ = _center_and_size(upper.means)
    moved = Similarity(0.8, turn, middle + 1.2 * right + 0.2 * scene.up - 0.8 * turn @ middle)
    opened = Scene.open(folder / "lower")
    paste = placed(opened.paste("../other", name="upper"), moved)
    opened.with_edits(EditStack([paste])).save(folder / "lower", overwrite=True)
    picked = [point for goal in goals for point in (moved.transform_points(goal[None])[0], goal)]
    with editor_server(folder / "lower") as server, editor_page(server.link, 1100, 680) as editor:
        editor.ready()
        editor.press("Shift+A")
        for count, point in enumerate(picked, start=1):
            click(editor, point)
            editor.until(f"cagefield.now.picked.points.length === {count}")
            if count == 5:
                screen(editor, "pairs")
        editor.changed(lambda: editor.page.click("dialog[open] button.primary"))
        screen(editor, "pairs-aligned")


def up(scene: Scene, folder: Path) -> None:
    """A tilted room, two of three points of its floor, and the view about the normal of the three."""
    tilted = np.array([0.3, 0.1, 1.0])
    tilted /= np.linalg.norm(tilted)
    camera = Camera.look_at((-1.1, -3.2, 1.6), (0.0, 0.0, 0.1), tilted, width=560, height=520, fov_x=0.75)
    whole_room = dataclasses.replace(scene, field=room(True), cameras={"test": (camera,)}, folder=None)
    dataclasses.replace(whole_room, alignment=Alignment(up=tuple(tilted.tolist()))).save(folder / "room")
    views = []
    with editor_server(folder / "room") as server, editor_page(server.link, 900, 600) as editor:
        editor.ready()
        editor.press("Shift+Y")
        for count, point in enumerate(FLOOR_POINTS[:2], start=1):
            click(editor, np.array(point))
            editor.until(f"cagefield.now.picked.points.length === {count}")
        views.append(window(editor))
        editor.changed(lambda: click(editor, np.array(FLOOR_POINTS[2])))
        views.append(window(editor))
    beside(views).save(HERE / "up.jpg", quality=80)


def published(folder: Path) -> None:
    """Before, truth and result of a continuous edit, truth and result of a move."""
    raised, moved = (folder / "cases" / name for name in ("digger-raise_arm", "digger-move_cone"))
    results = folder / "results" / "cagefield"
    places = (
        *(raised / "before", raised / "truth", results / raised.name),
        *(moved / "truth", results / moved.name),
    )
    pictures = [Image.open(place / "000.png").convert("RGB") for place in places]
    beside(pictures).save(HERE / "edit-benchmark.jpg", quality=85)


def _directions(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Level unit vectors [3] towards the scene's camera, and to the right of its picture."""
    away = scene.first_camera.origin * (1, 0, 1)
    away = away / np.linalg.norm(away)
    return away, np.cross(scene.up, away)


def _hips(scene: Scene, away: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Eye, target and up of a camera at the height of the hips."""
    target = np.array([0.1, -1.25, 0.1])
    return target + 3.4 * away + 0.4 * scene.up, target, scene.up


def click(editor: EditorPage, point: np.ndarray) -> None:
    """A click on a world point [3]."""
    at = editor.page.evaluate(f"cagefield.project({point.tolist()})")
    editor.page.mouse.click(at["x"], at["y"])


def _center_and_size(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Center [3] and size [3] of the box of points [N,3], without the outermost of them."""
    low, high = np.quantile(points, [0.002, 0.998], axis=0)
    return 0.5 * (low + high), high - low


def near(scene: Scene, width: int, height: int) -> Camera:
    """Camera before the upper body."""
    first = scene.first_camera
    target = np.array([-0.1, -1.2, 0.1])
    away = first.origin - target
    eye = target + 2.6 * away / np.linalg.norm(away)
    return Camera.look_at(eye, target, scene.up, width=width, height=height, fov_x=0.62)


def surface(scene: Scene, camera: Camera, at: tuple[int, int]) -> tuple[float, float, float]:
    """Point of the surface at a pixel of a camera."""
    depth = scene.render(camera).depth[at[1], at[0]]
    ray = np.array([(at[0] + 0.5 - camera.cx) / camera.fx, (camera.cy - at[1] - 0.5) / camera.fy, -1.0])
    x, y, z = (camera.origin + depth * (camera.c2w[:3, :3] @ ray) / np.linalg.norm(ray)).tolist()
    return x, y, z


def page_shot(scene: Scene, folder: Path, script: str) -> Image.Image:
    """An exported page after a script, its picture whole."""
    file = folder / "page.html"
    file.write_text(ScenePage.build(scene, "biker").one_file(), encoding="utf-8")
    with chromium_context(viewport={"width": 500, "height": 560}) as context:
        page = context.new_page()
        page.emulate_media(reduced_motion="reduce")
        page.goto(file.as_uri())
        whole(page)
        page.evaluate(script)
        page.wait_for_timeout(500)
        whole(page)
        return Image.open(io.BytesIO(page.screenshot())).convert("RGB")


def whole(page: Any) -> None:
    """Waits for the complete picture of the finest level."""
    for _ in range(600):
        if page.evaluate(
            "Boolean(window.cagefieldViewer?.viewer?.renderer?.level?.last && cagefieldViewer.viewer.whole)"
        ):
            return
        page.wait_for_timeout(300)
    raise SystemExit("the page has drawn no complete picture")


def drawn(field: SplatField, camera: Camera) -> Image.Image:
    """Picture of splats over white."""
    frame = SplatRenderer(field).render(camera, background="white")
    assert frame is not None
    return Image.fromarray(frame.rgb8())


def beside(pictures: list[Image.Image]) -> Image.Image:
    """Pictures of one height side by side."""
    row = Image.new("RGB", (sum(picture.width for picture in pictures), pictures[0].height))
    for number, picture in enumerate(pictures):
        row.paste(picture, (number * picture.width, 0))
    return row


def screen(editor: EditorPage, name: str) -> None:
    """A picture of the window."""
    window(editor).save(HERE / f"{name}.jpg", quality=80)


def window(editor: EditorPage) -> Image.Image:
    """The window once its picture is complete."""
    editor.settle()
    editor.page.wait_for_timeout(400)
    return Image.open(io.BytesIO(editor.page.screenshot())).convert("RGB")


if __name__ == "__main__":
    main()
