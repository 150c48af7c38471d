"""Material of the edit benchmark: photos, trained fields and truths, kept in a folder between runs.

    WORKDIR/SCENE/photos-KEY/      photos in NeRF-synthetic layout
    WORKDIR/SCENE/field-KEY/       the scene trained on them
    WORKDIR/SCENE/truth-KEY.npz    pictures of the truth

KEY is a digest of everything that the content depends on, the sources of the built-in scenes included. The
trainer's sources are not: `retrain` makes the fields anew.
"""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

import cagefield
from benchmarks.captures.visibility import uncovered_pixels, unseen_pixels
from benchmarks.common.cases import Case
from benchmarks.edits.exact_maps import exact
from benchmarks.edits.mapped_photographs import MappedScene
from cagefield.cameras.camera import Camera
from cagefield.datasets import Dataset, load_dataset
from cagefield.edits import EditStack
from cagefield.edits.edit_files import dump_edits
from cagefield.errors import CagefieldError
from cagefield.files.atomic import replaced_file
from cagefield.files.npz import DEFLATED, read_arrays
from cagefield.files.stale_files import remove_unfinished
from cagefield.procedural import ProceduralScene, make_scene, procedural_scene
from cagefield.scene.scene import Scene
from cagefield.training.nerf.nerf_config import NerfConfig
from cagefield.training.splats.splat_config import SplatConfig
from cagefield.training.voxels.train_voxels import train_voxel
from cagefield.training.voxels.voxel_config import VoxelConfig
from cagefield.typing import Mask, UInt8

Move = Callable[[float, float, str], None]
Bar = Callable[[str], AbstractContextManager[Move]]

_MODELLED = ("procedural", "cameras")
_MAPPED = (
    "edits", "warps", "geometry", "benchmarks/edits/mapped_photographs.py",
    "benchmarks/edits/exact_maps.py", "benchmarks/edits/baselines", "benchmarks/edits/methods.py",
)  # fmt: skip

_TRULY_MOVED = (*_MODELLED, "benchmarks/common/cases.py")
_HIDDEN = (*_TRULY_MOVED, "benchmarks/captures/visibility.py")

BAKED = 64
"""Voxels along the longest axis that are baked of a NeRF; its pictures are its own."""


@dataclass(frozen=True)
class Settings:
    """Settings of the photos, of the training of fields, and of the rendering of exact maps.

    Photos are size x size pixels. The truth of continuous edits is photographed at exact_size x exact_size
    for the first `exact_views` test cameras; that of the methods that are compared at compared_size x
    compared_size for the first `compared_views`. Discrete edits are measured on the first `discrete_views`
    test photos, None for all.

    Raises:
        CagefieldError: sizes and numbers that are too small.
    """

    views: int = 100
    size: int = 400
    test_views: int = 20
    config: VoxelConfig | NerfConfig | SplatConfig = field(default_factory=lambda: VoxelConfig(minutes=5.0))
    exact_size: int = 200
    exact_views: int = 6
    compared_size: int = 64
    compared_views: int = 3
    discrete_views: int | None = None

    def __post_init__(self) -> None:
        for name, least in (
            ("views", 1),
            ("size", 16),
            ("test_views", 1),
            ("exact_size", 16),
            ("exact_views", 1),
            ("compared_size", 16),
            ("compared_views", 1),
            ("discrete_views", 1),
        ):
            value = getattr(self, name)
            if value is not None and value < least:
                raise CagefieldError(f"{name} is {value}; it must be at least {least}")


@contextmanager
def no_bar(_: str) -> Iterator[Move]:
    """A progress bar that shows nothing."""
    yield lambda done, total, note: None


@dataclass(frozen=True)
class Workbench:
    """Photos, fields and truths under `folder`; what is there already is used, fields unless `retrain`."""

    settings: Settings
    folder: Path
    bar: Bar = no_bar
    retrain: bool = False
    _open: dict[str, Scene] = field(default_factory=dict, init=False, repr=False)

    def photos(self, name: str) -> Dataset:
        """The data set of a built-in scene."""
        return self._photographed(
            name, procedural_scene(name), f"{name}: photos", digest(self._shape, _MODELLED)
        )

    def taught(self, case: Case) -> Scene:
        """A scene trained on photos of the truth of a discrete case: what its edit could know at best."""
        what, key = f"{case.scene}, {case.name}", digest([*self._shape, case.name], _TRULY_MOVED)
        truth = _models(case)[1].with_new_occlusion()
        dataset = self._photographed(case.scene, truth, f"{what}: photos to teach by", key)
        return self._trained(what, dataset)

    @property
    def _shape(self) -> list[int]:
        return [self.settings.views, self.settings.size, self.settings.test_views]

    def _photographed(self, name: str, scene: ProceduralScene, what: str, key: str) -> Dataset:
        """The data set of photos of a scene, in the folder of a built-in one."""
        views, size, test_views = self._shape
        path = self.folder / name / f"photos-{key}"
        if not path.is_dir():
            with self.bar(what) as move:
                make_scene(
                    name,
                    path,
                    views=views,
                    size=size,
                    test_views=test_views,
                    scene=scene,
                    progress=lambda i, n: move(i, n, f"{i}/{n}"),
                )
        return load_dataset(path, downscale=1)

    def scene(self, name: str) -> Scene:
        """The scene trained on the photos of a built-in scene."""
        if name not in self._open:
            self._open[name] = self._trained(name, self.photos(name))
        return self._open[name]

    def one_sided(self, name: str, front: Camera, degrees: float) -> Scene:
        """The scene trained on those photos alone that were taken from within `degrees` of a camera.

        Seen from above the origin: at any height. Raises CagefieldError where there are none.
        """
        dataset = self.photos(name)
        train = tuple(view for view in dataset.train if beside(view.camera, front, degrees))
        if not train:
            raise CagefieldError(f"no photo of {name} is from within {degrees:g} degrees; take more views")
        one_side = dataclasses.replace(dataset, train=train)
        return self._trained(name, one_side, [view.name for view in train])

    def _trained(self, name: str, dataset: Dataset, part: Sequence[object] = ()) -> Scene:
        """The scene trained on the photos of a data set, of which `part` says what was chosen."""
        config = self.settings.config
        key = digest([dataset.path.name, dataclasses.asdict(config), *part])
        path = dataset.path.with_name(f"field-{key}")
        if path.is_dir() and not self.retrain:
            return Scene.open(path)
        with self.bar(f"{name}: training") as move:
            scene = trained(dataset, config, lambda progress: move(progress.done, 1.0, str(progress)))
        scene.save(path, overwrite=True)
        return scene

    def moved(self, case: Case, cameras: Sequence[Camera], *, old_shadows: bool = False) -> UInt8:
        """Photos [V,H,W,3] of the scene whose part was really moved, over white.

        With `old_shadows` ambient occlusion stays as modelled: on what the part left, and on the part.
        """
        _, scene = _models(case)
        scene = scene if old_shadows else scene.with_new_occlusion()
        key = digest([case.scene, case.name, old_shadows, _poses(cameras)], _TRULY_MOVED)
        what = f"{case.scene}, {case.name}: photos of the truth"
        return self._kept(case.scene, key, what, lambda: self._photographs(scene, cameras), len(cameras))

    def deformed(self, case: Case, cameras: Sequence[Camera]) -> UInt8:
        """Photos [V,H,W,3] of the scene that a case deforms in closed form, its light carried along."""
        if case.deformed is None:
            raise CagefieldError(f"{case.scene} {case.name} has no truth in closed form")
        scene = case.deformed(procedural_scene(case.scene)).with_modeled_light()
        key = digest([case.scene, case.name, "deformed", _poses(cameras)], _TRULY_MOVED)
        what = f"{case.scene}, {case.name}: photos in closed form"
        return self._kept(case.scene, key, what, lambda: self._photographs(scene, cameras), len(cameras))

    def unseen_pixels(self, case: Case, cameras: Sequence[Camera], where: Mask) -> Mask:
        """Pixels [V,H,W] in `where`, of `moved`, that show what none of the photos of the scene showed."""
        scene, moved = _models(case)
        photos = self.scene(case.scene).cameras["train"]
        shown = hashlib.sha256(np.packbits(where).tobytes()).hexdigest()
        key = digest(["unseen", case.scene, case.name, shown, _poses(cameras), _poses(photos)], _HIDDEN)
        masks = (
            unseen_pixels(moved, camera, scene, photos, mask).astype(np.uint8)
            for camera, mask in zip(cameras, where, strict=True)
        )
        what = f"{case.scene}, {case.name}: what no photo showed"
        return self._kept(case.scene, key, what, lambda: masks, len(cameras)).astype(bool)

    def uncovered_pixels(self, case: Case, cameras: Sequence[Camera]) -> Mask:
        """Pixels [V,H,W] of `moved` that show a surface which the part hid before."""
        scene, moved = _models(case)
        key = digest(["uncovered", case.scene, case.name, _poses(cameras)], _HIDDEN)
        masks = (uncovered_pixels(moved, camera, scene).astype(np.uint8) for camera in cameras)
        what = f"{case.scene}, {case.name}: what was uncovered"
        return self._kept(case.scene, key, what, lambda: masks, len(cameras)).astype(bool)

    def modeled(self, name: str, cameras: Sequence[Camera]) -> UInt8:
        """Photos [V,H,W,3] of a built-in scene as it is, over white."""
        scene = procedural_scene(name)
        key = digest([name, _poses(cameras)], _MODELLED)
        return self._kept(
            name, key, f"{name}: photos", lambda: self._photographs(scene, cameras), len(cameras)
        )

    def mapped(self, name: str, edits: EditStack | None, cameras: Sequence[Camera]) -> UInt8:
        """Photos [V,H,W,3] of a built-in scene seen through the exact map of edits, over white."""
        if edits is None:
            return self.modeled(name, cameras)
        stack = EditStack(edit.without_lattice() for edit in edits)
        key = digest([name, dump_edits(stack), _poses(cameras)], (*_MODELLED, *_MAPPED))
        scene = MappedScene(procedural_scene(name), exact(stack))
        what = f"{name}: exact maps"
        return self._kept(name, key, what, lambda: self._photographs(scene, cameras), len(cameras))

    @staticmethod
    def _photographs(scene: ProceduralScene | MappedScene, cameras: Sequence[Camera]) -> Iterator[UInt8]:
        return (scene.photograph(camera, background="white").rgb8() for camera in cameras)

    def _kept(self, name: str, key: str, what: str, make: Callable[[], Iterator[UInt8]], count: int) -> UInt8:
        """The pictures in the folder's file of that key, made where there is none."""
        path = self.folder / name / f"truth-{key}.npz"
        with contextlib.suppress(OSError, ValueError, KeyError):  # not there, or damaged
            return read_arrays(path, DEFLATED)["pictures"]
        remove_unfinished(path.parent)
        made = []
        with self.bar(what) as move:
            for picture in make():
                made.append(picture)
                move(len(made), count, f"{len(made)}/{count}")
        with replaced_file(path) as temporary:
            np.savez_compressed(temporary, pictures=np.stack(made))
        return np.stack(made)


def trained(
    dataset: Dataset, config: VoxelConfig | NerfConfig | SplatConfig, on_progress: Callable[[Any], None]
) -> Scene:
    """The scene trained on a bounded data set; a NeRF's holds its voxels too."""
    if isinstance(config, SplatConfig):
        from cagefield.training.splats.train_splats import train_splat

        splats = train_splat(dataset, config, on_progress=on_progress, evaluate=False)
        if not splats.finished:
            raise KeyboardInterrupt
        return Scene.trained(splats, dataset)
    if isinstance(config, VoxelConfig):
        result = train_voxel(dataset, config, on_progress=on_progress, evaluate=False)
        if not result.finished:
            raise KeyboardInterrupt
        return Scene.trained(result, dataset)
    from cagefield.training.nerf.train_nerf import train_nerf

    learnt = train_nerf(dataset, config, on_progress=on_progress)
    if not learnt.finished:
        raise KeyboardInterrupt
    cameras = {name: tuple(view.camera for view in getattr(dataset, name)) for name in ("train", "test")}
    return Scene.baked(learnt.field, cameras, resolution=BAKED)


def _models(case: Case) -> tuple[ProceduralScene, ProceduralScene]:
    """The built-in scene of a case, and that scene with its part really moved, light as modelled."""
    if case.moved is None:
        raise CagefieldError(f"no part of {case.scene} is moved by {case.name}; its truth is the exact map")
    scene = procedural_scene(case.scene)
    return scene, case.moved(scene)


def beside(camera: Camera, other: Camera, degrees: float) -> bool:
    """True where a camera stands within so many degrees of another, seen from above the origin."""
    a, b = (np.arctan2(which.origin[1], which.origin[0]) for which in (camera, other))
    return bool(abs((a - b + np.pi) % (2 * np.pi) - np.pi) <= np.radians(degrees))


def digest(content: object, sources: Sequence[str] = ()) -> str:
    """Ten hexadecimal digits that change with the content (JSON) and with source files.

    A source is relative to the package, or to the checkout where it begins with "benchmarks".
    """
    total = hashlib.sha256(json.dumps(content, sort_keys=True).encode())
    for name in sources:
        root = (
            Path(__file__).parents[2] if name.startswith("benchmarks/") else Path(cagefield.__file__).parent
        )
        entry = root / name
        for file in sorted(entry.rglob("*.py")) if entry.is_dir() else [entry]:
            total.update(file.read_bytes())
    return total.hexdigest()[:10]


def _poses(cameras: Sequence[Camera]) -> list[object]:
    return [camera.to_dict() for camera in cameras]
