"""Scene: a trained field, the edits on it and the cameras it was seen by; a folder on disk.

    SCENE/
      field.safetensors   the VoxelField or SplatField, in canonical space; the file says which
      original.safetensors  the NerfField or ExternalField that it was baked from, if any, in the same space
      edits.yaml          the edit stack, as a person would write it
      cameras.json        {"train": [...], "test": [...]}: cameras in world units, OpenGL camera-to-world
      scene.json          {"format": "cagefield-scene", "version": 1, "background": [r, g, b] or null,
                          "gains": [[r, g, b], ...] if photos were brighter or darker than the field,
                          "preserve_opacity": false if edits leave density as it is,
                          "source_to_world": [4,4] from the reconstruction's coordinates, if not the same,
                          "alignment", "hotspots", if any}

Edits may paste from other scenes (`edits.Paste`), whose folders stay where they are: relative paths of
sources are relative to SCENE.

A folder is written beside its destination and renamed, so a reader sees the old scene or the new one, never
a half of each.
"""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from functools import cache, cached_property, partial
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cagefield.cameras.camera import Camera, front_camera
from cagefield.completion.pasting.paste_content import content_box
from cagefield.compute.cancellation import check_cancelled
from cagefield.edits import EditStack, LatticeError, Paste, PreparedStack
from cagefield.edits.paste_paths import rebased
from cagefield.edits.paste_placement import placed_paste
from cagefield.errors import SceneError
from cagefield.fields.external.external_field import ExternalField
from cagefield.fields.nerf_field import NerfField
from cagefield.fields.splat_field import NO_OFFSET, Offset, SplatField
from cagefield.fields.voxel_field import VoxelField
from cagefield.files.atomic import replaced_folder
from cagefield.files.safe_open import real_path
from cagefield.images.render_result import Background, RenderResult, background_rgb
from cagefield.scene.alignment import Alignment
from cagefield.scene.baked_voxels import bake_original
from cagefield.scene.hotspots import Hotspot, check_count
from cagefield.scene.manifest import Manifest, checked_affine, checked_gains, manifest_draft
from cagefield.scene.paste_sources import SceneSources, position_beside, up_of_cameras
from cagefield.scene.removed_elements import Removal
from cagefield.scene.scene_files import FILES, MANIFEST, VERSION, check_destination
from cagefield.scene.scene_values import read_scene, write_scene
from cagefield.typing import Array

if TYPE_CHECKING:
    from cagefield.completion.patcher import Patcher
    from cagefield.datasets import Dataset
    from cagefield.rendering.renderers import InteractiveRenderer, Renderer
    from cagefield.rendering.splats.splat_provenance import SplatSet

    class Trained(Protocol):
        """Trained field, with the exposure gains [V,3] of the training photos, None without."""

        @property
        def field(self) -> VoxelField | SplatField: ...

        @property
        def gains(self) -> NDArray[np.float32] | None: ...


@dataclasses.dataclass(frozen=True, eq=False)
class Scene:
    """A field with its edit stack, cameras by split ("train", "test", "val") and background color.

    Background None means nothing behind the scene. The field stays as it was trained; the edits are applied
    when it is rendered. `gains` are the exposures of the training photos as they were fitted: photo = gain x
    the field's picture, per channel, one for each "train" camera; empty where none were fitted. `original` is
    the field that `field` was baked from, None where it was trained itself; exact pictures show the original.
    `preserve_opacity` multiplies density by |J d| where an edit moved it. `folder` is the one that it was
    opened from: sources of pastes are relative to that, or to the working directory where it is None.
    `source_to_world` [4,4] maps the coordinates of the reconstruction that the cameras came from to the
    scene's (`Dataset.source_to_world`); the identity where they are the same or nothing is known.
    `removal` has the whole field, which is saved, where `field` is without deleted elements. `alignment` has
    the meters per unit and the up direction that exports honor. `hotspots` are points with text, positions in
    deformed space, which the editor and exported pages show.

    Raises:
        CagefieldError: a background outside [0, 1].
        SceneError: a version this cagefield does not write, gains that do not fit the cameras, a
            source_to_world that cannot be inverted.
    """

    field: VoxelField | SplatField
    edits: EditStack = dataclasses.field(default_factory=lambda: EditStack([]))
    cameras: Mapping[str, tuple[Camera, ...]] = dataclasses.field(default_factory=dict)
    background: tuple[float, float, float] | None = (1.0, 1.0, 1.0)
    version: int = VERSION
    gains: tuple[tuple[float, float, float], ...] = ()
    original: NerfField | ExternalField | None = None
    preserve_opacity: bool = True
    folder: Path | None = None
    source_to_world: Array = dataclasses.field(default_factory=partial(np.eye, 4))
    removal: Removal | None = None
    alignment: Alignment = dataclasses.field(default_factory=Alignment)
    hotspots: tuple[Hotspot, ...] = ()

    def __post_init__(self) -> None:
        cameras = {str(split): tuple(members) for split, members in self.cameras.items()}
        object.__setattr__(self, "cameras", MappingProxyType(cameras))
        object.__setattr__(self, "background", background_rgb(self.background))
        if self.version != VERSION:
            raise SceneError(f"scene version is {self.version!r}; this cagefield writes version {VERSION}")
        object.__setattr__(self, "gains", checked_gains(self.gains, len(cameras.get("train", ()))))
        object.__setattr__(self, "source_to_world", checked_affine(self.source_to_world))
        object.__setattr__(self, "hotspots", tuple(self.hotspots))
        check_count(len(self.hotspots))

    @classmethod
    def trained(cls, result: Trained, dataset: Dataset) -> Scene:
        """The scene of a field trained on a data set, with its cameras and no edits.

        Its background is the result's if present, else that of the photos: white behind cut-outs, else
        black. Splats get the data set's offset.
        """
        white = (1.0, 1.0, 1.0) if dataset.white_background else (0.0, 0.0, 0.0)
        splits = {"train": dataset.train, "test": dataset.test, "val": dataset.val}
        cameras = {split: tuple(view.camera for view in views) for split, views in splits.items() if views}
        # Poses may have been refined.
        cameras["train"] = getattr(result, "cameras", cameras["train"])
        field = result.field
        if isinstance(field, SplatField) and any(dataset.offset):
            field = dataclasses.replace(field, offset=dataset.offset)
        return cls(
            field,
            cameras=cameras,
            background=background_rgb(getattr(result, "background", white)),
            gains=() if result.gains is None or (result.gains == 1.0).all() else result.gains.tolist(),
            source_to_world=dataset.source_to_world,
        )

    @classmethod
    def baked(
        cls,
        original: NerfField | ExternalField | SplatField,
        cameras: Mapping[str, tuple[Camera, ...]],
        background: tuple[float, float, float] | None = (1.0, 1.0, 1.0),
        *,
        resolution: int = 256,
        sh_degree: int = 2,
        unbounded: bool = False,
        on_progress: Callable[[float], None] | None = None,
    ) -> Scene:
        """The scene of a field's voxels, unedited; of an `unbounded` one the region that the cameras see is
        baked.

        A NerfField or an ExternalField is kept beside its voxels, splats are not.

        Raises:
            FieldError: options outside their range, a field that is empty.
            SceneError: a field of another class.
        """
        voxels = bake_original(original, cameras, resolution, sh_degree, unbounded, on_progress)
        kept = None if isinstance(original, SplatField) else original
        return cls(voxels, cameras=cameras, background=background, original=kept)

    @classmethod
    def open(cls, path: Path | str, *, whole: bool = False) -> Scene:
        """The scene in the folder `path`; edits that cannot be evaluated are an error when it is rendered.

        Its field is without the elements that were deleted in the editor, `whole` with them.

        Raises:
            SceneError: the folder or one of its files is missing, damaged or of a newer version; the message
                names the file and the cure.
        """
        folder = Path(path)
        values = read_scene(folder, whole)
        try:
            return cls(**values, folder=folder.absolute())
        except SceneError as error:
            raise SceneError(f"{folder / MANIFEST}: {error}") from None

    def save(
        self,
        path: Path | str,
        overwrite: bool = False,
        *,
        beside: Mapping[str, str | None] = MappingProxyType({}),
    ) -> None:
        """Writes the scene folder `path`, complete or not at all.

        With `overwrite` a scene that is there is replaced once the new one is complete; other files in its
        folder are kept. `beside` has the text of files that are written with it, by name; None removes one.
        Relative sources of pastes are written as that folder sees them.

        Raises:
            SceneError: something else is there, or a scene and no `overwrite`.
        """
        target = check_destination(path, overwrite)
        with replaced_folder(target, (*FILES, *beside)) as draft:
            for name, text in beside.items():
                if text is not None:
                    (draft / name).write_text(text, encoding="utf-8")
            edits = EditStack(rebased(self.edits, self.folder, target))
            write_scene(draft, self.field, self.removal, self.original, edits, self.cameras)
            self.save_manifest(draft)

    def save_manifest(self, folder: Path) -> None:
        """Writes the scene's manifest into a folder that holds its other files, complete or not at all."""
        with self.draft_manifest(folder):
            pass

    def draft_manifest(self, folder: Path) -> AbstractContextManager[None]:
        """The manifest is written when the context begins and takes its place in the folder when it ends."""
        values = self.background, self.gains, self.preserve_opacity
        return manifest_draft(folder, Manifest(*values, self.source_to_world, self.alignment, self.hotspots))

    def with_edits(self, edits: EditStack) -> Scene:
        """Scene with another edit stack.

        Raises:
            SceneError: something else than a stack.
        """
        if not isinstance(edits, EditStack):
            raise SceneError(f"edits must be an EditStack, got {type(edits).__name__}; give EditStack([...])")
        scene = dataclasses.replace(self, edits=edits)
        scene.__dict__["_origin"] = self.__dict__.get("renderer", self.__dict__.get("_origin"))
        scene.__dict__["rendered_field"] = self.rendered_field
        for shared in ("patcher", "_pasting"):
            if shared in self.__dict__:
                scene.__dict__[shared] = self.__dict__[shared]
        return scene

    def paste(
        self,
        source: Path | str,
        *,
        at: ArrayLike | None = None,
        size: float | None = None,
        name: str | None = None,
    ) -> Paste:
        """The edit that pastes all of another scene, a scene folder or a file of splats, upright.

        Put it into a stack: `scene.with_edits(scene.edits.append(scene.paste("../chair")))`, and move, turn
        and scale it as any other edit. `at` [3] is the position of the middle of its base, by default beside
        this scene's content; `size` is its longest edge, in this scene's units, as large as it is there where
        it is left out. A relative path is relative to the scene's folder.

        Raises:
            CagefieldError: there is no such scene, or its field is of another kind than this one's.
        """
        look = self.sources.look(os.fspath(source), self.field)
        up = self.up
        if at is None:
            grown = 1.0 if size is None else size / float((look.box[1] - look.box[0]).max())
            at = position_beside(content_box(self.field), up, grown * (look.box[1] - look.box[0]))
        found = real_path(source).stem if name is None else name
        return placed_paste(source, look.box, at, up=up, source_up=look.up, size=size, name=found)

    @property
    def offset(self) -> Offset:
        """Coordinates of the file that the scene's splats are from, less the scene's; 0 of voxels."""
        return self.field.offset if isinstance(self.field, SplatField) else NO_OFFSET

    def lattice_errors(self) -> tuple[LatticeError, ...]:
        """Errors of the edits' lattices against their exact maps, in units of `field.sample_spacing`.

        It is a voxel's smallest edge, in the middle of the box of interest where the field is unbounded, or
        the width of most splats.
        """
        edits = EditStack(self.patcher.with_detours(self.edits.edits))
        return edits.lattice_errors(self.field.sample_spacing)

    def render(
        self,
        camera: Camera,
        *,
        background: Background = "scene",
        normals: bool = False,
        exact: bool = False,
    ) -> RenderResult:
        """Image [H,W] of the edited scene, over the scene's own background unless another is given.

        `background` is "scene" or any other that `RenderResult` accepts; None and "none" put nothing behind
        the field, whatever the scene's own is. The renderer is kept between calls. `exact` evaluates every
        edit in float64, without a lattice: of voxels at every sample of the plain sampled renderer, slow, and
        the reference; of splats at every splat; where the scene has an original field, of that one, by its
        own hierarchical sampling.

        Raises:
            CagefieldError: no camera, or a background outside [0, 1].
        """
        if not isinstance(camera, Camera):
            raise SceneError(
                f"camera must be a Camera, got {camera!r:.60}; give one such as scene.cameras['test'][0]"
            )
        own = isinstance(background, str) and background == "scene"
        color = self.background if own else background_rgb(background)
        if not exact:
            return self.renderer.render(camera, background=color, normals=normals)
        return self._exact_renderer(camera).render(camera, background=color, normals=normals)

    def _exact_renderer(self, camera: Camera) -> Renderer:
        """The renderer that evaluates every edit in float64, without a lattice; see `render`."""
        from cagefield.scene.exact_renderers import original_renderer, sampled_renderer

        if self.original is not None:
            self.original.torch  # noqa: B018  a missing PyTorch is an error with its cure here
            # Patches are voxels: too rough for what a continuous edit bends, and for parts with soft seams.
            edits = [edit.replace(feather=0.0) if edit.feather else edit for edit in self.edits.resolved]
            exact = self.patcher.prepare(edits, relight_continuous=False).without_lattices()
            return original_renderer(self.original, exact, self.preserve_opacity)
        if isinstance(self.field, SplatField):
            return self._exact_splats
        exact = self.prepared_edits.without_lattices()
        return sampled_renderer(self.field, exact, self.preserve_opacity, camera)

    @cached_property
    def rendered_field(self) -> VoxelField | SplatSet:
        """Voxels, or the set of the splats, which caches results of edits; shared by `with_edits`."""
        if isinstance(self.field, VoxelField):
            return self.field
        from cagefield.rendering.splats.splat_provenance import SplatSet

        return SplatSet.from_field(self.field)

    @cached_property
    def renderer(self) -> InteractiveRenderer:
        """The renderer of the field's kind; a scene made by `with_edits` shares the field's arrays."""
        from cagefield.rendering.renderers import renderer_of

        origin: InteractiveRenderer | None = self.__dict__.get("_origin")
        edits = self.prepared_edits
        if origin is not None:
            return origin.with_edits(edits, preserve_opacity=self.preserve_opacity)
        return renderer_of(self.rendered_field, edits, preserve_opacity=self.preserve_opacity)

    @cached_property
    def patcher(self) -> Patcher:
        """Patcher that inpaints uncovered places and relights edits; shared by `with_edits`."""
        from cagefield.completion.pasting.paste_loader import PasteLoader
        from cagefield.completion.patcher import Patcher
        from cagefield.rendering.renderers import renderer_of

        plain = cache(lambda: renderer_of(self.rendered_field))

        def render(camera: Camera) -> RenderResult:
            return plain().render(camera, background="black", normals=False, proceed=check_cancelled)

        cameras = self.cameras.get("train", ())
        return Patcher(self.rendered_field, cameras, render, PasteLoader(self.sources))

    @property
    def prepared_edits(self) -> PreparedStack:
        """The edits in the order of application, with the patches that they ask for.

        Raises EditError for a paste or a parent that is not possible.
        """
        return self.patcher.prepare(self.edits.resolved, preserve_opacity=self.preserve_opacity)

    @cached_property
    def up(self) -> Array:
        """The unit direction [3] that is up: the alignment's, else the cameras'; z without either."""
        if self.alignment.up is not None:
            return self.alignment.up
        return up_of_cameras(self.cameras)

    @property
    def first_camera(self) -> Camera:
        """The view in which the scene opens: its first test camera, or any, else one in front of it."""
        for split in ("test", "val", "train"):
            if self.cameras.get(split):
                return self.cameras[split][0]
        return front_camera(self.field.bounds, self.up)

    @cached_property
    def sources(self) -> SceneSources:
        """The scenes that edits paste from."""
        return SceneSources(self.folder, _open_pasted, self.__dict__.get("_pasting", ()))

    @cached_property
    def _exact_splats(self) -> InteractiveRenderer:
        edits = self.prepared_edits.without_lattices()
        return self.renderer.with_edits(edits, preserve_opacity=self.preserve_opacity)


def _open_pasted(folder: Path, pasting: tuple[Path, ...]) -> Scene:
    """The scene of a folder, which is being pasted into the scenes of other ones."""
    scene = Scene.open(folder)
    scene.__dict__["_pasting"] = pasting
    return scene
