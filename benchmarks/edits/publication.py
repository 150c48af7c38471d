"""The edit benchmark as a folder of data that needs no cagefield: photos, edits, truths, results, a script.

`published/README.md` has the format. Pictures are 8-bit, and the table is that of the script and of these
pictures.
"""

from __future__ import annotations

import importlib.util
import json
import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from benchmarks.common.cases import Case
from benchmarks.common.figures import changed_pixels, floats
from benchmarks.common.workbench import Workbench
from benchmarks.edits.compare_shells import FINER, seen
from benchmarks.edits.methods import METHODS, Method, check_known
from benchmarks.edits.naive_splats import NAIVE, seen_naively
from cagefield.cameras.camera import Camera
from cagefield.fields.splat_field import SplatField
from cagefield.images.image_files import write_png
from cagefield.scene.scene import Scene
from cagefield.typing import AnyArray

SOURCES = Path(__file__).parent / "published"
SCRIPT, README = "evaluate.py", "README.md"
OURS, UNEDITED = "cagefield", "unedited"
CASES = "cases.json"
ENTRIES = ("scenes", "cases", "results", CASES, "table.json", "table.md", SCRIPT, README)
"""Names of the entries of a published folder."""


def publish(
    folder: Path, cases: Sequence[Case], bench: Workbench, methods: Sequence[str], command: str, machine: str
) -> Iterator[Case]:
    """Writes the folder, case by case, which are yielded once they are there.

    `methods` are other ways to fill the shell of continuous edits of voxels (`METHODS`); of splats all ways
    of naive editing get rows.

    Raises:
        CagefieldError: an unknown method.
    """
    check_known(methods)
    entries = []
    for name in dict.fromkeys(case.scene for case in cases):
        _copy(bench.photos(name).path, folder / "scenes" / name)
    for case in cases:
        entries.append(_write_case(folder, case, bench, methods))
        yield case
    _write_json(folder / CASES, {"version": 1, "cases": entries})
    shutil.copyfile(SOURCES / SCRIPT, folder / SCRIPT)
    text = (SOURCES / README).read_text(encoding="utf-8")
    for word, value in (("COMMAND", command), ("MACHINE", machine)):
        text = text.replace(f"@{word}@", value)
    (folder / README).write_text(text, encoding="utf-8")
    script = load_script(folder / SCRIPT)
    rows = script.table(root=folder)
    _write_json(folder / "table.json", rows)
    (folder / "table.md").write_text(script.markdown(rows), encoding="utf-8")


def results_of_others(folder: Path) -> list[str]:
    """Names of methods whose pictures lie in a published folder's results and are not of `publish`."""
    ours = {OURS, UNEDITED, *METHODS, *(f"naive, {way}" for way in NAIVE)}
    results = folder / "results"
    return sorted({entry.name for entry in results.iterdir()} - ours) if results.is_dir() else []


def load_script(path: Path) -> ModuleType:
    """The evaluation script as a module."""
    spec = importlib.util.spec_from_file_location("evaluate", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def _write_case(folder: Path, case: Case, bench: Workbench, methods: Sequence[str]) -> dict[str, Any]:
    """Writes a case and its results; its entry in cases.json."""
    name = f"{case.scene}-{case.name}"
    place, scene = folder / "cases" / name, bench.scene(case.scene)
    cameras, rays = _cameras(case, scene, bench), 1 if case.moved else FINER
    if case.moved is None:
        before = bench.mapped(case.scene, None, cameras)
        truth = bench.mapped(case.scene, case.edits, cameras)
    else:
        before, truth = bench.modeled(case.scene, cameras), bench.moved(case, cameras)
    _write_pictures(place / "before", before)
    _write_pictures(place / "truth", truth)
    _write_pictures(place / "changed", np.repeat(changed_pixels(before, truth)[..., None], 3, axis=-1) * 1.0)
    (place / "edit.yaml").write_text(case.text, encoding="utf-8")
    _write_json(place / "cameras.json", [camera.to_dict() for camera in cameras])
    edited = scene.with_edits(case.edits)
    results = folder / "results"
    _write_pictures(results / UNEDITED / name, seen(scene, cameras, rays))
    _write_pictures(results / OURS / name, seen(edited, cameras, rays))
    truths: dict[str, str] = {}
    if isinstance(scene.field, SplatField):
        for way, found in seen_naively(edited, cameras, rays):
            _write_pictures(results / f"naive, {way}" / name, found)
    elif case.kind == "continuous":
        for method in methods:
            other = METHODS[method].of_all(case.edits)
            _write_pictures(results / method / name, seen(scene.with_edits(other), cameras, rays))
            truths[method] = f"truth, {method}"
            exact = Method(METHODS[method].shell).of_all(case.edits)
            _write_pictures(place / truths[method], bench.mapped(case.scene, exact, cameras))
    return {
        "id": name,
        "scene": case.scene,
        "edit": case.name,
        "kind": case.kind,
        "truth": "exact map" if case.moved is None else "photos",
        "views": len(cameras),
        "width": cameras[0].width,
        "height": cameras[0].height,
        "truths": truths,
    }


def _copy(source: Path, target: Path) -> None:
    """Copies a folder; ends at the first file that fails, where `shutil.copytree` would try them all."""
    target.mkdir(parents=True)
    for entry in sorted(source.iterdir()):
        (_copy if entry.is_dir() else shutil.copyfile)(entry, target / entry.name)


def _cameras(case: Case, scene: Scene, bench: Workbench) -> tuple[Camera, ...]:
    """Cameras of a case's pictures."""
    settings, cameras = bench.settings, scene.cameras["test"]
    if case.moved is not None:
        return cameras[: settings.discrete_views]
    size = settings.exact_size
    return tuple(camera.resized(size, size) for camera in cameras[: settings.exact_views])


def _write_pictures(folder: Path, pictures: AnyArray) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for number, picture in enumerate(pictures):
        write_png(folder / f"{number:03d}.png", floats(np.asarray(picture)))


def _write_json(path: Path, document: object) -> None:
    path.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
