"""Compares pictures that a page draws with its own GPU with the fused renderer's, and counts what they cost.

python -m benchmarks.page_pictures FOLDER [-o benchmarks/results/page_pictures.md] [--pictures FOLDER]

FOLDER holds scenes of voxels called digger, chair, microphone, plant and, if there, room (one that is
unbounded), as `cagefield train` writes them. Chromium draws in software, so only counts say what a GPU has to
do; frames a second compare it with the server's renderer on the same cores.
"""

from __future__ import annotations

import dataclasses
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro
from PIL import Image

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

import cagefield
from benchmarks.common.machine import cpu_model
from cagefield.cameras.camera import Camera
from cagefield.edits import EditStack, load_edits
from cagefield.fields.voxel_field import VoxelField
from cagefield.images.metrics import psnr
from cagefield.images.render_result import RenderResult, to_uint8
from cagefield.pages.page_edits import MAGIC, VERSION, encode_page_edits, for_pages
from cagefield.pages.page_field import encode_page_field
from cagefield.pages.page_file import unpack
from cagefield.rendering.voxels.occupancy import of_field
from cagefield.rendering.voxels.voxel_renderer import VoxelRenderer
from cagefield.scene.scene import Scene
from field_page import FieldPage, field_page

EXAMPLES = Path(cagefield.__file__).parent / "examples"
EDITS = {
    "digger": ("digger", "digger_turn_cabin", "digger_move_cone"),
    "chair": ("chair_lean_back", "chair_lower_wider", "chair_copy_cushion"),
    "microphone": ("microphone_bigger_head", "microphone_push_head", "microphone_move_weight"),
    "plant": ("plant_taller", "plant_lopsided", "plant_delete_flower"),
    "room": ("room_digger_taller",),
}
HEAD = (
    "| scene | edit | rgb | opacity | depth | normals | samples | reads a sample | shader, ms | sent, MB "
    "| uploaded, MB | lattice, voxels | page, frames/s | kernel, frames/s |"
)


@dataclass
class PagePictures:
    """Measure the page's pictures."""

    scenes: tyro.conf.Positional[Path]
    """Folder of scene folders."""
    out: Annotated[Path | None, tyro.conf.arg(aliases=["-o"])] = None
    """File to write the tables to, as well."""
    pictures: Path | None = None
    """Folder for pictures: the kernel's, the page's, and 10 times their difference."""
    width: int = 800
    """Width of the pictures that are compared; their height is 3/4 of it."""

    def run(self) -> None:
        """Prints the tables."""
        fields, rows = (
            [
                "| scene | vertices | file, MB | textures, MB | with bricks of 4^3, MB | levels |",
                "| --- |" + " ---: |" * 5,
            ],
            [],
        )
        for name in EDITS:
            if not (self.scenes / name / "scene.json").exists():
                continue
            scene = Scene.open(self.scenes / name)
            assert isinstance(scene.field, VoxelField)
            data = encode_page_field(scene.field, background=scene.background)
            with field_page() as page:
                figures = page.load(data)
                shape = "x".join(str(n) for n in scene.field.resolution)
                fields.append(
                    f"| {name} {shape}, degree {scene.field.sh_degree} | {len(scene.field.vertices):,} "
                    f"| {len(data) / 1e6:.1f} | {figures['bytes'] / 1e6:.0f} "
                    f"| {brick_bytes(scene.field, 4) / 1e6:.0f} | {len(figures['levels'])} |"
                )
                print(fields[-1], flush=True)
                for row in self._rows(name, scene, page):
                    rows.append(row)
                    print(row, flush=True)
        table = "\n".join(
            [
                "# Pictures of the page's own GPU",
                "",
                *fields,
                "",
                HEAD,
                "| --- | --- |" + " ---: |" * 12,
                *rows,
                "",
                f"- rgb, opacity, depth, normals: PSNR in dB at {self.width}x{self.width * 3 // 4}, of depth "
                "and normals where opacity is above a half.",
                "- Samples: of a ray that meets something; reads of textures for each, leaps included.",
                "- Sent: the edits' file. Uploaded: what a new state of the edits puts on the GPU. Lattice: "
                "largest and mean error of halves, in voxels, against float32 nodes; of the lattice itself "
                "see `flow_shell_nodes.md`.",
                "- Page, kernel: a picture of 200x150, the page's in software (SwiftShader).",
                f"- {cpu_model()}, 2 cores. `python -m benchmarks.page_pictures FOLDER`",
                "",
            ]
        )
        if self.out:
            self.out.write_text(table)

    def _rows(self, name: str, scene: Scene, page: FieldPage) -> Iterator[str]:
        field = scene.field
        base = VoxelRenderer(field)
        camera = scene.cameras["test"][0].resized(self.width, self.width * 3 // 4)
        camera = Camera(camera.c2w, camera.width, camera.height, camera.fx, camera.fx, camera.cx, camera.cy)
        for edit in ("", *EDITS[name]):
            edits = EditStack([])
            if edit:
                stack = load_edits(EXAMPLES / f"{edit}.yaml")
                # Uncovered regions are inpainted, and light is changed, as in the editor.
                edits = for_pages(dataclasses.replace(scene, edits=stack).prepared_edits)
            renderer = base.with_edits(edits)
            data = encode_page_edits(renderer)
            page.edit(data)
            ours, drawn = renderer.render(camera, normals=True, background="white"), page.draw(camera)
            assert ours is not None and ours.normals is not None
            compiled = page.page.evaluate("r.compileTime")
            small = camera.resized(200, 150)
            times = []
            for _ in range(5):
                began = time.perf_counter()
                renderer.render(small)
                times.append(time.perf_counter() - began)
            page_ms = 1000 * page.draw(small, normals=False, repeat=4).seconds
            counts = page.draw(small, normals=False, count=True).depth.astype(np.int64)
            samples, reads = counts & 65535, 4 * (counts >> 16)
            met = samples > 0
            cells = [
                *(f"{value:.1f}" for value in alike(ours, drawn)),
                f"{samples[met].mean():.0f}",
                f"{reads.sum() / samples.sum():.1f}",
                f"{compiled:.0f}",
                f"{len(data) / 1e6:.2f}" if edit else "",
                f"{uploaded(data) / 1e6:.2f}" if edit else "",
                lattice_error(renderer, field.sample_spacing) if edit else "",
                f"{1000 / page_ms:.2g}",
                f"{1 / float(np.median(times)):.2g}",
            ]
            self._save(f"{name}_{edit or 'unedited'}", ours, drawn)
            yield f"| {name} | {edit.replace('_', ' ')} | " + " | ".join(cells) + " |"

    def _save(self, name: str, ours: RenderResult, drawn: Any) -> None:
        if self.pictures is None:
            return
        self.pictures.mkdir(parents=True, exist_ok=True)
        parts = [ours.rgb, drawn.rgb, np.clip(0.5 + 10 * (drawn.rgb - ours.rgb), 0, 1)]
        turned = [0.5 + 0.5 * (ours.normals if ours.normals is not None else 0), 0.5 + 0.5 * drawn.normals]
        far = np.percentile(ours.depth[np.isfinite(ours.depth)], 98)
        depth = np.repeat(np.clip(drawn.depth / far, 0, 1)[..., None], 3, axis=2)
        rows = [np.concatenate(row, axis=1) for row in (parts, [*turned, depth])]
        Image.fromarray(to_uint8(np.concatenate(rows))).save(self.pictures / f"{name}.png")


def alike(ours: RenderResult, drawn: Any) -> list[float]:
    """PSNR of color, opacity, depth and normals."""
    assert ours.normals is not None
    solid = (ours.opacity > 0.5) & np.isfinite(drawn.depth)
    far = float(ours.depth[solid].max())
    return [
        psnr(ours.rgb, drawn.rgb),
        psnr(ours.opacity, drawn.opacity),
        psnr(ours.depth[solid] / far, drawn.depth[solid] / far),
        psnr(0.5 + 0.5 * ours.normals[solid], 0.5 + 0.5 * drawn.normals[solid]),
    ]


def brick_bytes(field: VoxelField, side: int) -> int:
    """Bytes of a field's textures with bricks of side^3 cells, and of the index over them."""
    blocks = of_field(field).blocks
    share = side // 2
    count = tuple(-(-n // share) for n in blocks.shape)
    padded = np.zeros([n * share for n in count], bool)
    padded[: blocks.shape[0], : blocks.shape[1], : blocks.shape[2]] = blocks
    split = padded.reshape(count[0], share, count[1], share, count[2], share)
    held = split.any(axis=(1, 3, 5))
    texel = 2 + 4 * -(-3 * (field.sh_degree + 1) ** 2 // 4)
    return int(held.sum()) * (side + 1) ** 3 * texel + 4 * held.size


def uploaded(data: bytes) -> int:
    """Bytes of the arrays in a file of edits."""
    return sum(array.nbytes for array in unpack(data, MAGIC, VERSION, "edits for pages")[1].values())


def lattice_error(renderer: VoxelRenderer, voxel: float) -> str:
    """Largest and mean distance, in voxels, that halves move the nodes of a renderer's lattices."""
    nodes = renderer._stack.lattice
    if len(nodes) < 2:
        return ""
    off = np.linalg.norm(nodes - nodes.astype(np.float16).astype(np.float32), axis=1) / voxel
    return f"{off.max():.3f} / {off.mean():.4f}"


if __name__ == "__main__":
    tyro.cli(PagePictures).run()
