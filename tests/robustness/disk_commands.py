"""The commands that write, to be run on a disk that has no room for what they write."""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass
from pathlib import Path

from benchmarks.captures.street import write_street
from torch_files import write_checkpoints

from cagefield import Scene
from cagefield.cameras.keyframe_files import dump_path
from cagefield.cameras.keyframes import Keyframe
from cagefield.formats.splats.splat_files import write_splats
from cagefield.procedural import make_scene
from plenoctree_files import plenoctree_arrays, write_plenoctree
from posed_photos import photos_alone
from scenes import ball_scene
from splat_scenes import ball_of_splats

EDITS = """edits:
  - name: moved
    adjustment: discrete
    inner: {center: [0, 0, 0], size: 1}
    operations: [{translate: [1, 0, 0]}]
"""


def sources(folder: Path) -> None:
    """Inputs of commands, on a disk with room: scenes of voxels and of splats, splats, photos and edits.

    And photos without poses, and other programs' checkpoints.
    """
    ball_scene().save(folder / "voxels")
    Scene(ball_of_splats(4000), cameras=ball_scene().cameras).save(folder / "splats")
    write_splats(ball_of_splats(4000), folder / "x.ply")
    views = ball_scene().cameras["test"]
    keys = [Keyframe(tuple(camera.c2w.ravel()), 40.0, 1.0) for camera in (views[0], views[0])]
    (folder / "path.json").write_text(dump_path(keys, loop=False))
    make_scene("chair", folder / "photos", views=4, size=16, test_views=1)
    photos_alone(folder / "photos_alone")
    write_street(folder / "street", photos=12, size=96, length=5.0)
    if importlib.util.find_spec("torch") is not None:
        write_checkpoints(folder, splats=4000)
    write_plenoctree(folder / "a.npz", plenoctree_arrays())
    (folder / "e.yaml").write_text(EDITS)
    (folder / "grade.yaml").write_text(EDITS.replace("operations", "grade: {hue_deg: 40}\n    operations"))


@dataclass(frozen=True)
class DiskCommand:
    """A command: `{s}` in its words is the folder of `sources`, `{out}` the place on the disk it writes to.

    Its old result is there in half of the runs, which say --overwrite; `on_disk` is copied there before.
    """

    words: str
    out: str
    on_disk: str = ""
    """The folder of `sources` that is copied to `out` and changed there; else nothing, or an old result."""
    keeps: bool = False
    """Pictures that fit stay, without an old result: they can be looked at."""
    on_the_way: float = 1.0
    """Room that the command takes meanwhile, over that of its result."""
    work: str = ""
    """A folder on the disk, `{work}` in the words, that keeps what is whole for the next run."""
    first: str = ""
    """A text that is a result of its own, written and told of before the rest is known: it may be new."""

    def arguments(self, source: Path, disk: Path, again: bool) -> list[str]:
        """The command line; `again` where its result is there."""
        words = [
            word.replace("{s}", str(source))
            .replace("{out}", str(disk / self.out))
            .replace("{work}", str(disk / self.work))
            for word in self.words.split()
        ]
        return [*words, "--overwrite"] if again else words


_SPLAT_ENDINGS = (".ply", ".compressed.ply", ".spz", ".sog", ".splat", ".glb", ".usda", ".usdc", ".usdz")
_TRAIN = "train {s}/photos -o {out} --steps 3 --resolution 16"
_BAKING = "--resolution 16 --compare 0"
_EDITS = (
    "bench edits -o {out} --scenes chair --edits lean_back --views 3 --size 16 --test-views 1 "
    "--steps 3 --resolution 16 --exact-size 16 --exact-views 1"
)
_PUBLISH = (
    "bench publish {out} --edits lean_back --methods trilinear --views 3 --size 16 --test-views 1 "
    "--steps 3 --resolution 16 --exact-size 16 --exact-views 1"
)
_CAPTURES = "bench captures room-chair -o {out} --room-views 8 --room-size 48 --steps 2 --splats 100"
_TRAINING = "bench training {s}/photos -o {out} --steps 3 --resolution 16"

DISK_COMMANDS: dict[str, DiskCommand] = {
    "render, one picture": DiskCommand("render {s}/voxels -o {out} --views 0 --size 200", "r.png"),
    "render, a folder": DiskCommand(
        "render {s}/voxels -o {out} --turntable 3 --size 96 --depth", "r", keeps=True
    ),
    **(
        {
            "render, a cluster": DiskCommand(
                "render {s}/voxels -o {out} --turntable 3 --size 96 --depth --cluster 2", "r", keeps=True
            )
        }
        if importlib.util.find_spec("distributed") is not None
        else {}
    ),
    "render, a video": DiskCommand("render {s}/voxels -o {out} --turntable 6 --size 240", "r.mp4"),
    "edit -o": DiskCommand("edit {s}/voxels {s}/e.yaml -o {out}", "new"),
    "edit -o, splats": DiskCommand("edit {s}/splats {s}/e.yaml -o {out}", "new"),
    "edit --overwrite": DiskCommand("edit {out} {s}/e.yaml", "scene", on_disk="voxels"),
    "edit --append": DiskCommand("edit {out} {s}/e.yaml --append", "scene", on_disk="voxels"),
    "hotspot": DiskCommand("hotspot {out} --add top --at 0 0 0.5", "scene", on_disk="voxels"),
    "edit, a grade": DiskCommand("edit {out} {s}/grade.yaml", "scene", on_disk="voxels"),
    "train, voxels": DiskCommand(_TRAIN + " --field voxel", "new"),
    "train, splats": DiskCommand("train {s}/photos -o {out} --steps 3 --field splat", "new"),
    "train, blocks": DiskCommand(
        "train {s}/street -o {out} --blocks 2 --steps 8 --splats 100 --keep-poses",
        "new",
        on_the_way=3.0,
    ),
    "train, nerf": DiskCommand(_TRAIN + " --field nerf", "new"),
    "import": DiskCommand("import {s}/x.ply -o {out}", "new"),
    "import .tar": DiskCommand(f"import {{s}}/a.tar -o {{out}} {_BAKING}", "new"),
    "import .ckpt, nerf": DiskCommand(f"import {{s}}/a.ckpt -o {{out}} {_BAKING}", "new"),
    "import .npz": DiskCommand(f"import {{s}}/a.npz -o {{out}} {_BAKING}", "new"),
    "import .ckpt, splats": DiskCommand("import {s}/s.ckpt -o {out}", "new"),
    "bake": DiskCommand("bake {s}/splats -o {out} --resolution 24 --compare 0", "new"),
    **{f"export {end}": DiskCommand("export {s}/splats -o {out}", f"x{end}") for end in _SPLAT_ENDINGS},
    "export, a streamed SOG": DiskCommand("export {s}/splats -o {out}/lod-meta.json", "levels"),
    "convert to a streamed SOG": DiskCommand("convert {s}/x.ply {out}/lod-meta.json", "levels"),
    "export, a page": DiskCommand("export {s}/splats -o {out}", "x.html"),
    "export, a page of voxels": DiskCommand("export {s}/voxels -o {out}", "x.html"),
    "export --embed": DiskCommand("export {s}/voxels -o {out} --as page --embed", "x"),
    "export, a sequence": DiskCommand(
        "export {s}/splats -o {out}/f_%04d.ply --camera-path {s}/path.json --fps 2", "frames", keeps=True
    ),
    "export, time samples": DiskCommand(
        "export {s}/splats -o {out} --camera-path {s}/path.json --fps 2", "t.usda"
    ),
    "export, a mesh .ply": DiskCommand("export {s}/voxels -o {out} --as mesh", "m.ply"),
    "export, a mesh .glb": DiskCommand("export {s}/voxels -o {out} --as mesh", "m.glb"),
    "export, points": DiskCommand("export {s}/voxels -o {out} --as points --splats 500", "p.ply"),
    "export, fitted splats": DiskCommand("export {s}/voxels -o {out} --steps 2 --splats 200", "f.ply"),
    **{f"convert to {end}": DiskCommand("convert {s}/x.ply {out}", f"c{end}") for end in _SPLAT_ENDINGS},
    "make-scene, a thing": DiskCommand(
        "make-scene chair -o {out} --views 2 --test-views 1 --size 32", "made"
    ),
    "make-scene, a room": DiskCommand("make-scene room-chair -o {out} --views 8 --size 64", "made"),
    "demo": DiskCommand(
        "demo -o {out} --views 3 --size 32 --steps 3 --resolution 16 --frames 2", "made", keeps=True
    ),
    "poses": DiskCommand("poses {s}/photos_alone -o {out}", "data", on_the_way=3.0),
    "poses of a data set": DiskCommand("poses {s}/photos -o {out}", "data"),
    "bench speed": DiskCommand(
        "bench speed {s}/voxels -o {out} --size 24 --cameras 1 --rounds 1", "speed.json"
    ),
    "bench grids": DiskCommand("bench grids -o {out} --methods trilinear", "grids.png"),
    "bench edits": DiskCommand(
        f"{_EDITS} --methods trilinear --compared-size 16", "edits.md", first="edits.md"
    ),
    "bench edits, its work": DiskCommand(
        f"{_EDITS} --no-methods --workdir {{work}}", "edits.md", work="work"
    ),
    "bench publish": DiskCommand(_PUBLISH, "published"),
    "bench publish, its work": DiskCommand(f"{_PUBLISH} --workdir {{work}}", "published", work="work"),
    "bench captures": DiskCommand(_CAPTURES, "captures.md"),
    "bench captures, its work": DiskCommand(f"{_CAPTURES} --workdir {{work}}", "captures.md", work="work"),
    "bench training": DiskCommand(_TRAINING, "curve.csv"),
    "bench training, its scene": DiskCommand(f"{_TRAINING} --scene-out {{work}}", "curve.csv", work="new"),
}
"""Commands that write files, by their results."""
