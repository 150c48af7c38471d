"""Scene: a trained field, the edits on it and the cameras it was seen by; a folder on disk.

    SCENE/
      field.safetensors   the VoxelField, in canonical space
      original.safetensors  the NerfField that it was baked from, if any, in the same space
      edits.yaml          the edit stack, as a person would write it
      cameras.json        {"train": [...], "test": [...]}: cameras in world units, OpenGL camera-to-world
      scene.json          {"format": "cagefield-scene", "version": 1, "background": [r, g, b] or null,
                          "gains": [[r, g, b], ...] if photos were brighter or darker than the field,
                          "preserve_opacity": false if edits leave density as it is}

A folder is written beside its destination and renamed, so a reader sees the old scene or the new one, never
a half of each.
"""

from __future__ import annotations

import dataclasses
import json
import math
import secrets
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, cast

from cagefield.cameras import Camera
from cagefield.edits import EditStack, LatticeError
from cagefield.edits.files import load_edits, save_edits
from cagefield.errors import CagefieldError, SceneError
from cagefield.fields.nerf import NerfField
from cagefield.fields.nerf_file import load_nerf, save_nerf
from cagefield.fields.voxel import VoxelField
from cagefield.folders import replaced_folder
from cagefield.rendering.frame import Background, Frame, background_rgb

if TYPE_CHECKING:
    from cagefield.datasets import Dataset
    from cagefield.rendering.renderer import Renderer
    from cagefield.training.voxel import TrainResult

FORMAT = "cagefield-scene"
VERSION = 1

_FIELD, _EDITS, _CAMERAS, _MANIFEST = "field.safetensors", "edits.yaml", "cameras.json", "scene.json"
_ORIGINAL = "original.safetensors"
_FILES = (_FIELD, _ORIGINAL, _EDITS, _CAMERAS, _MANIFEST)


@dataclasses.dataclass(frozen=True, eq=False)
class Scene:
    """A field with its edit stack, cameras by split ("train", "test", "val") and background colour.

    Background None means nothing behind the scene. The field stays as it was trained; the edits are applied
    when it is rendered. `gains` are the exposures of the training photos as they were fitted: photo = gain x
    the field's picture, per channel, one for each "train" camera; empty where none were fitted. `original` is
    the field that `field` was baked from, None where it was trained itself; exact pictures show the original.
    `preserve_opacity` multiplies density by |J d| where an edit moved it.

    Raises:
        CagefieldError: a background outside [0, 1].
        SceneError: a version this cagefield does not write, gains that do not fit the cameras.
    """

    field: VoxelField
    edits: EditStack = dataclasses.field(default_factory=lambda: EditStack([]))
    cameras: Mapping[str, tuple[Camera, ...]] = dataclasses.field(default_factory=dict)
    background: tuple[float, float, float] | None = (1.0, 1.0, 1.0)
    version: int = VERSION
    gains: tuple[tuple[float, float, float], ...] = ()
    original: NerfField | None = None
    preserve_opacity: bool = True

    def __post_init__(self) -> None:
        cameras = {str(split): tuple(members) for split, members in self.cameras.items()}
        object.__setattr__(self, "cameras", MappingProxyType(cameras))
        object.__setattr__(self, "background", background_rgb(self.background))
        if self.version != VERSION:
            raise SceneError(f"scene version is {self.version!r}; this cagefield writes version {VERSION}")
        object.__setattr__(self, "gains", _gains(self.gains, len(cameras.get("train", ()))))

    @classmethod
    def trained(cls, result: TrainResult, dataset: Dataset) -> Scene:
        """The scene of a field trained on a data set, with its cameras and no edits.

        Its background is what the photos have: white behind cut-outs, else black.
        """
        splits = {"train": dataset.train, "test": dataset.test, "val": dataset.val}
        return cls(
            result.field,
            cameras={split: tuple(view.camera for view in views) for split, views in splits.items() if views},
            background=(1.0, 1.0, 1.0) if dataset.white_background else (0.0, 0.0, 0.0),
            gains=() if (result.gains == 1.0).all() else result.gains.tolist(),
        )

    @classmethod
    def open(cls, path: Path | str) -> Scene:
        """The scene in the folder `path`; edits that cannot be evaluated are an error when it is rendered.

        Raises:
            SceneError: the folder or one of its files is missing, damaged or of a newer version; the message
                names the file and the cure.
        """
        folder = Path(path)
        if not folder.is_dir():
            what = "is a file, not a folder" if folder.exists() else "does not exist"
            raise SceneError(f"scene {folder} {what}; give the folder that `cagefield train -o` wrote")
        background, gains, preserve_opacity = _read_manifest(folder)
        for name in (_FIELD, _CAMERAS, _EDITS):
            if not (folder / name).is_file():
                raise SceneError(f"{folder / name} is missing; copy it back or train the scene again")
        cameras = _read_cameras(folder / _CAMERAS)
        edits = load_edits(folder / _EDITS, check=False)
        field = VoxelField.load(folder / _FIELD)
        original = load_nerf(folder / _ORIGINAL) if (folder / _ORIGINAL).is_file() else None
        try:
            return cls(
                field,
                edits,
                cameras,
                background,
                gains=gains,
                original=original,
                preserve_opacity=preserve_opacity,
            )
        except SceneError as error:
            raise SceneError(f"{folder / _MANIFEST}: {error}") from None

    def save(self, path: Path | str, overwrite: bool = False) -> None:
        """Writes the scene folder `path`, complete or not at all.

        With `overwrite` a scene that is there is replaced once the new one is complete; other files in its
        folder are kept.

        Raises:
            SceneError: something else is there, or a scene and no `overwrite`.
        """
        target = check_destination(path, overwrite)
        with replaced_folder(target, _FILES) as draft:
            self.field.save(draft / _FIELD)
            if self.original is not None:
                save_nerf(self.original, draft / _ORIGINAL)
            save_edits(self.edits, draft / _EDITS)
            _write_json(
                {split: [camera.to_dict() for camera in members] for split, members in self.cameras.items()},
                draft / _CAMERAS,
            )
            self.save_manifest(draft)

    def save_manifest(self, folder: Path) -> None:
        """Writes the scene's manifest into a folder that holds its other files, complete or not at all."""
        manifest: dict[str, object] = {
            "format": FORMAT,
            "version": self.version,
            "background": self.background,
        }
        if self.gains:
            manifest["gains"] = self.gains
        if not self.preserve_opacity:
            manifest["preserve_opacity"] = False
        draft = folder / f".{_MANIFEST}.{secrets.token_hex(4)}"
        _write_json(manifest, draft)
        draft.replace(folder / _MANIFEST)

    def with_edits(self, edits: EditStack) -> Scene:
        """The same scene under another edit stack."""
        scene = dataclasses.replace(self, edits=edits)
        scene.__dict__["_origin"] = self.__dict__.get("renderer", self.__dict__.get("_origin"))
        return scene

    def lattice_errors(self) -> tuple[LatticeError, ...]:
        """How far the edits' lattices are off their exact maps, in voxels of the field (its smallest edge).

        An unbounded field's voxels are those in the middle of its box of interest.
        """
        return self.edits.lattice_errors(float(min(self.field.voxel_size)))

    def render(
        self,
        camera: Camera,
        *,
        background: Background = None,
        normals: bool = False,
        exact: bool = False,
    ) -> Frame:
        """The edited scene seen by `camera`, over the scene's own background unless another is given.

        "none" puts nothing behind it. The fused renderer is kept between calls. `exact` takes the plain
        sampled renderer, with every edit evaluated in float64 at every sample: slow, and the reference; where
        the scene has an original field, that one, by its own hierarchical sampling.
        """
        colour = self.background if background is None else background_rgb(background)
        if not exact:
            return cast(Frame, self.renderer.render(camera, background=colour, normals=normals))
        return self._render_exact(camera, colour, normals)

    def _render_exact(self, camera: Camera, background: Background, normals: bool) -> Frame:
        from cagefield.fields.protocol import Field
        from cagefield.rendering.sampled import render_sampled

        if self.original is not None:
            return self._render_original(self.original, camera, background, normals)
        field = self.field
        near, far = _sampling_range(field, camera)
        samples = math.ceil(2.0 * (far - near) / float(min(field.voxel_size)))
        return render_sampled(
            # An unbounded field is sampled beyond its bounds: without them, up to `far`.
            cast(Field, field.__call__) if field.contracted else field,
            camera,
            near=near,
            far=far,
            samples=min(4096, max(64, samples)),
            background=background,
            edits=EditStack(edit.replace(lattice=None) for edit in self.edits),
            normals=normals,
            preserve_opacity=self.preserve_opacity,
        )

    def _render_original(
        self, original: NerfField, camera: Camera, background: Background, normals: bool
    ) -> Frame:
        original.torch  # noqa: B018  a missing PyTorch is an error with its cure here
        from cagefield.rendering.nerf import render_nerf

        edits = EditStack(edit.replace(lattice=None) for edit in self.edits)
        return render_nerf(
            original,
            camera,
            edits=edits,
            background=background,
            preserve_opacity=self.preserve_opacity,
            normals=normals,
        )

    @cached_property
    def renderer(self) -> Renderer:
        """The fused renderer; a scene made by `with_edits` shares the field's arrays on the device."""
        from cagefield.rendering.renderer import Renderer

        origin: Renderer | None = self.__dict__.get("_origin")
        if origin is None:
            return Renderer(self.field, self.edits, preserve_opacity=self.preserve_opacity)
        return origin.with_edits(self.edits, preserve_opacity=self.preserve_opacity)


def check_destination(path: Path | str, overwrite: bool) -> Path:
    """The resolved folder that a scene may be written to: new, empty, or a scene to be replaced.

    Called before a long training, so that its result has a place to go.

    Raises:
        SceneError: something is there that may not be replaced.
    """
    target = Path(path).resolve()
    if not target.exists():
        return target
    if not target.is_dir():
        raise SceneError(f"{path} is a file; give a new folder for the scene")
    if not any(target.iterdir()):
        return target
    if not is_scene(target):
        raise SceneError(f"{path} is a folder that holds no scene and is left as it is; give a new folder")
    if not overwrite:
        raise SceneError(f"scene {path} exists already; give a new folder, or --overwrite (overwrite=True)")
    return target


def is_scene(path: Path | str) -> bool:
    """True where `path` is a folder with the manifest of a scene, of any version."""
    try:
        document = json.loads((Path(path) / _MANIFEST).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    return isinstance(document, dict) and document.get("format") == FORMAT


def _gains(values: Any, count: int) -> tuple[tuple[float, float, float], ...]:
    """The gains as tuples, none or `count` of them."""
    try:
        gains = tuple((float(r), float(g), float(b)) for r, g, b in values)
    except (TypeError, ValueError):
        raise SceneError(f"gains must be a list of [r, g, b], got {values!r}") from None
    if gains and len(gains) != count:
        raise SceneError(f"{len(gains)} gains for {count} train cameras; give each one, or none")
    for index, gain in enumerate(gains):
        if not all(0.0 < channel < math.inf for channel in gain):
            raise SceneError(f"gains[{index}] is {list(gain)}; each must be a number above 0")
    return gains


def _read_manifest(folder: Path) -> tuple[tuple[float, float, float] | None, Any, bool]:
    """Background, gains, unchecked, and the opacity choice."""
    path = folder / _MANIFEST
    if not path.is_file():
        raise SceneError(
            f"folder {folder} holds no {_MANIFEST}: it is not a scene; give the folder of a scene"
        )
    document = _read_json(path)
    if document.get("format") != FORMAT:
        raise SceneError(
            f'{path}: format is {document.get("format")!r}, expected "{FORMAT}"; give a scene folder'
        )
    version = document.get("version")
    if not isinstance(version, int) or isinstance(version, bool) or version < 1:
        raise SceneError(f"{path}: version is {version!r}, expected a whole number from 1 to {VERSION}")
    if version > VERSION:
        raise SceneError(
            f"{path}: version is {version}, this cagefield reads up to {VERSION}; upgrade cagefield"
        )
    opacity = document.get("preserve_opacity", True)
    if not isinstance(opacity, bool):
        raise SceneError(f"{path}: preserve_opacity is {opacity!r}; it must be true or false")
    try:
        return background_rgb(document.get("background")), document.get("gains", ()), opacity
    except (CagefieldError, TypeError, ValueError) as error:
        raise SceneError(f"{path}: {error}") from None


def _read_cameras(path: Path) -> dict[str, tuple[Camera, ...]]:
    cameras: dict[str, tuple[Camera, ...]] = {}
    for split, members in _read_json(path).items():
        if not isinstance(members, list):
            raise SceneError(f'{path}: "{split}" must be a list of cameras; write the scene again')
        read = []
        for index, member in enumerate(members):
            try:
                read.append(Camera.from_dict(member))
            except (CagefieldError, KeyError, TypeError, AttributeError) as error:
                raise SceneError(f"{path}: {split}[{index}] is no camera: {error}") from error
        cameras[split] = tuple(read)
    return cameras


def _sampling_range(voxels: VoxelField, camera: Camera) -> tuple[float, float]:
    """Near and far distance from the camera that hold the field's box; 8 times that if unbounded."""
    lower, upper = voxels.bounds
    radius = 0.5 * float(((upper - lower) ** 2).sum()) ** 0.5
    distance = float(((0.5 * (lower + upper) - camera.origin) ** 2).sum()) ** 0.5
    reach = 8.0 if voxels.contracted else 1.0
    return max(0.0, distance - reach * radius), distance + reach * radius


def _read_json(path: Path) -> dict[str, Any]:
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, OSError) as error:
        raise SceneError(f"{path} is not readable JSON ({error}); copy it back or train again") from error
    if not isinstance(document, dict):
        raise SceneError(f"{path} must hold a JSON object; copy it back or train again")
    return document


def _write_json(document: Mapping[str, object], path: Path) -> None:
    path.write_text(json.dumps(document, indent=1, allow_nan=False) + "\n", encoding="utf-8")
