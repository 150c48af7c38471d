"""Compares pictures of splats that a page draws with its own GPU with the rasterizer's, and counts bytes.

python -m benchmarks.page_splats FILE... [-o benchmarks/results/page_splats.md] [--pictures FOLDER]

Each splat file is seen as it is, with its middle twisted, and with a part of it moved away. Chromium draws in
software.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro
from PIL import Image

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from benchmarks.common.machine import cpu_model
from cagefield.cameras.camera import turntable
from cagefield.edits import Edit, EditStack
from cagefield.fields.splat_field import SplatField
from cagefield.formats.splats.splat_files import read_splats
from cagefield.geometry.cage import Cage
from cagefield.images.render_result import to_uint8
from cagefield.pages.page_splat_edits import encode_page_splat_edits
from cagefield.pages.page_splats import encode_page_splats
from cagefield.rendering.splats.raster_splats import changed_splats
from cagefield.rendering.splats.splat_renderer import SplatRenderer
from cagefield.rendering.splats.splitting import split_of
from field_page import FieldPage, field_page
from page_pictures import alike

HEAD = (
    "| file | splats, degree | file, MB | edit | changed | upload, MB | rgb | opacity | depth | normals |",
    "| --- | ---: | ---: | --- |" + " ---: |" * 6,
)


@dataclass
class PageSplats:
    """Measure the page's pictures of splats."""

    files: tyro.conf.Positional[tuple[Path, ...]]
    """Splat files."""
    out: Annotated[Path | None, tyro.conf.arg(aliases=["-o"])] = None
    """File to write the table to, as well."""
    pictures: Path | None = None
    """Folder for pictures: the rasterizer's, the page's, and 10 times their difference."""
    width: int = 800
    """Width of the pictures that are compared; their height is 3/4 of it."""

    def run(self) -> None:
        """Prints the table."""
        lines = list(HEAD)
        for path in self.files:
            with field_page(splats=True) as page:
                for line in self._rows(path, read_splats(path), page):
                    lines.append(line)
                    print(line, flush=True)
        notes = (
            f"- rgb, opacity, depth, normals: PSNR in dB at {self.width}x{self.width * 3 // 4}, of depth and "
            "normals where opacity is above a half. Half floats for color, floats for depth.",
            "- Changed: splats that come with the edit, children of split ones too. Upload: the edits' file.",
            f"- {cpu_model()}. `python -m benchmarks.page_splats FILE...`",
        )
        if self.out:
            self.out.write_text(
                "\n".join(["# Splats drawn by the page's own GPU", "", *lines, "", *notes, ""])
            )

    def _rows(self, path: Path, field: SplatField, page: FieldPage) -> Iterator[str]:
        radius = float(np.linalg.norm(field.half_size))
        camera = turntable(
            field.center,
            2.2 * radius,
            2,
            elevation=-0.3,
            up=(0.0, -1.0, 0.0),
            width=self.width,
            height=self.width * 3 // 4,
            fov_x=0.9,
        )[0]
        name = path.parent.name if path.name == "meta.json" else path.name
        data = encode_page_splats(field)
        page.load(data)
        for edit, stack in edits_of(field).items():
            changed = changed_splats(field, stack, split=split_of(field, stack))
            upload = encode_page_splat_edits(field, changed)
            page.edit(upload if stack else None)
            ours = SplatRenderer(field, stack).render(camera, normals=True)
            assert ours is not None
            drawn = page.draw(camera)
            cells = [
                name,
                f"{len(field):,}, {field.sh_degree}",
                f"{len(data) / 1e6:.2f}",
                edit,
                f"{len(changed.splats):,}" if stack else "",
                f"{len(upload) / 1e6:.2f}" if stack else "",
                *(f"{value:.1f}" for value in alike(ours, drawn)),
            ]
            if self.pictures is not None:
                self.pictures.mkdir(parents=True, exist_ok=True)
                parts = [ours.rgb, drawn.rgb, np.clip(0.5 + 10 * (drawn.rgb - ours.rgb), 0, 1)]
                picture = self.pictures / f"{name}_{edit or 'unedited'}.png"
                Image.fromarray(to_uint8(np.concatenate(parts, axis=1))).save(picture)
            yield "| " + " | ".join(cells) + " |"


def edits_of(field: SplatField) -> dict[str, EditStack]:
    """No edit; the middle half turned by 40 degrees; the upper half of the middle moved to the side."""
    size = field.bounds[1] - field.bounds[0]
    inner = Cage.box(field.center, 0.5 * size)
    # Room to turn in, across the axis of the turn too.
    around = np.maximum(1.1 * size, 0.9 * np.linalg.norm(size[[0, 2]]) * np.array([1.0, 0.0, 1.0]))
    twisted = Edit.continuous(inner, Cage.box(field.center, around)).rotate((0.0, 0.7, 0.0))
    part = Cage.box(field.center - (0.0, 0.25 * size[1], 0.0), 0.5 * size)
    moved = Edit.move(part).translate((0.4 * size[0], 0.0, 0.0))
    return {"": EditStack(), "twisted": EditStack([twisted]), "moved": EditStack([moved])}


if __name__ == "__main__":
    tyro.cli(PageSplats).run()
