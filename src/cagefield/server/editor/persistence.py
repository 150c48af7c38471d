"""Saving and autosave (crash recovery). No file is overwritten without the user's request.

Saving writes the edits, the camera path and the opacity choice into the scene's folder, each file whole or
not at all. After every change an autosave goes beside the folder, into a hidden file; saving removes it, and
the next editor restores the document from it.
"""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import json
import warnings
from pathlib import Path

from cagefield.cameras.keyframe_files import dump_path, load_keys
from cagefield.cameras.keyframes import Keyframe
from cagefield.edits import Edit, EditStack
from cagefield.edits.edit_files import MAX_EDITS, save_edits
from cagefield.errors import SceneError
from cagefield.fields.splat_field import SplatField
from cagefield.files import json_text
from cagefield.files.atomic import replaced_file
from cagefield.files.safe_open import FileState, read_bytes, read_text, real_path
from cagefield.files.stale_files import remove_leftovers, remove_unfinished
from cagefield.files.temporary_folders import remove_abandoned
from cagefield.scene.alignment import Alignment
from cagefield.scene.removed_elements import Removal, dump_removed, read_removed
from cagefield.scene.scene import Scene
from cagefield.scene.scene_files import FIELD, MANIFEST, REMOVED, field_states
from cagefield.server.editor.autosave_content import autosave_content, parse_autosave
from cagefield.server.editor.document import Document
from cagefield.server.editor.edit_texts import ReadEdits, file_values
from cagefield.server.editor.identity_cache import IdentityCache
from cagefield.server.editor.manifest_merge import (
    ManifestValues,
    manifest_on_disk,
    manifest_values,
    values_of_document,
)
from cagefield.server.editor.pasted_sources import absolute, admitted, source_in, sources_under, written
from cagefield.server.editor.scene_lock import SceneLock
from cagefield.server.editor.session import Session

CAMERA_PATH = "camera_path.json"
_EDITS = "edits.yaml"

MAX_DAMAGED_AUTOSAVES = 5
"""Autosaves of a scene that could not be read and are kept."""


class SceneStore:
    """Where a session is kept: the scene's folder, and the autosave beside it.

    `origin` is the folder whose field is rendered, `path` the one that is saved to. A file that was opened is
    `source`: its scene lies in the user's cache, and there is nothing to save to before Save as.
    """

    def __init__(
        self,
        scene: Scene,
        path: Path,
        source: Path | None = None,
        root: Path | None = None,
        *,
        files: tuple[FileState, FileState, FileState] | None = None,
    ) -> None:
        """`root` is the folder that pages may write into; None for the one that the scene is in.

        `files` are the states of the scene's files before it was read; None for those of now.
        """
        self.scene = scene
        self.source = None if source is None else real_path(source)
        self.origin = real_path(path)
        self.path = real_path(path)
        self.root = real_path(self.shown_path.parent if root is None else root)
        """Folder that holds all saved and rendered files of pages."""
        self._lock: SceneLock | None = None
        self.trouble: str | None = None
        """Why the last autosave failed, or None."""
        self.damaged: str | None = None
        """Report of an unreadable autosave, or None."""
        self._written = self._fingerprint()
        self._manifest = self._opened_values()
        """The manifest's values as this editor read or wrote them last."""
        self.files = field_states(path) if files is None else files
        """The states that the files of the scene, as it is edited here, have in the folder that has it."""
        self._field = self.files[0]
        self._warned: object = None
        self._warned_manifest: object = None
        self._kept: Document | None = None
        self._values: IdentityCache[Edit, object] = IdentityCache(4 * MAX_EDITS)
        """Edit-file values of the edits written last."""

    # ---- opening ----

    def document(self) -> Document:
        """Document of the scene's folder. Raises CagefieldError for a camera path that cannot be read."""
        keys: tuple[Keyframe, ...] = ()
        loop = False
        if (self.path / CAMERA_PATH).exists():
            keys, loop = load_keys(self.path / CAMERA_PATH)
        return Document.from_edits(
            absolute(self.scene.edits, self.origin),
            preserve_opacity=self.scene.preserve_opacity,
            keys=keys,
            loop=loop,
            removed=read_removed(self.path if self.source is None else self.origin),
            meters_per_unit=self.scene.alignment.meters_per_unit,
            hotspots=self.scene.hotspots,
            up=self.scene.alignment.direction,
        )

    def recovered(self) -> Document | None:
        """Document of the autosave of an editor that ended without saving; None where it has nothing new.

        An unreadable autosave is renamed, with a warning.
        """
        try:
            content = json_text.loads(read_text(self.autosave_path))
            document = parse_autosave(content)
        except FileNotFoundError:
            return None
        except (OSError, ValueError, KeyError, TypeError, AttributeError, OverflowError) as error:
            aside = self._damaged_path()
            instead = " in place of an older one" if aside.exists() else ""
            with contextlib.suppress(OSError):
                self.autosave_path.replace(aside)
            reason = " ".join(str(error).split())[:120]
            self.damaged = (
                f"unsaved changes in {self.autosave_path} cannot be read ({reason}); "
                f"they are kept as {aside.name}{instead}"
            )
            warnings.warn(self.damaged, stacklevel=2)
            return None
        return None if document == self.document() else document

    def _damaged_path(self) -> Path:
        """Path for the next damaged autosave: a free name, or the last of MAX_DAMAGED_AUTOSAVES."""
        names = (".damaged", *(f".damaged-{n}" for n in range(2, MAX_DAMAGED_AUTOSAVES + 1)))
        paths = [self.autosave_path.with_suffix(name) for name in names]
        return next((path for path in paths if not path.exists()), paths[-1])

    def _opened_values(self) -> ManifestValues:
        scene = self.scene
        return manifest_values(scene.preserve_opacity, scene.alignment, scene.hotspots)

    @property
    def shown_path(self) -> Path:
        """The folder of the scene; for a file, one beside it that Save as may make."""
        return self.path if self.source is None else self.source.with_name(f"{stem_of(self.source)}-scene")

    def lock(self) -> None:
        """Lock the scene against other programs, and remove unfinished files of ended ones.

        Their videos beside it and their temporary folders, too. Raises SceneError where another one does
        edit it.
        """
        self._lock = SceneLock(self.path)
        remove_leftovers(self.path, inside=True)
        remove_unfinished(self.path.parent)
        remove_abandoned()

    def close(self) -> None:
        """Lets other programs edit the scene."""
        if self._lock is not None:
            self._lock.release()
            self._lock = None

    # ---- keeping ----

    def place(self, path: str) -> Path:
        """Destination of a page's `path`: in `root`, relative to the scene's place.

        Raises SceneError for any other place.
        """
        try:
            place = (self.shown_path.parent / Path(path).expanduser()).resolve()
        except (OSError, ValueError, RuntimeError) as error:
            raise SceneError(f"{path!r:.200} is no place for a file ({error}); give a name") from None
        if place == self.root or not place.is_relative_to(self.root):
            raise SceneError(
                f"{place} lies outside {self.root}, where pages may save; give a name without folders, "
                "or start the editor with --root"
            )
        return place

    # ---- other scenes ----

    def written(self, edits: EditStack) -> EditStack:
        """The edits as a file in the scene's folder has them."""
        return written(edits, self.path, self.root)

    def admitted(self, edit: Edit) -> Edit:
        """An edit that a page brings. Raises SceneError where it pastes from outside of `root`."""
        return admitted(edit, self.path, self.root)

    def source_of(self, name: str) -> Path:
        """Path of one of the `sources`, or of another in `root`. Raises SceneError for a path outside."""
        return source_in(name, self.root, self.root)

    def sources(self) -> list[str]:
        """Sources that pages may paste, as paths in `root`."""
        splats = isinstance(self.scene.field, SplatField)
        return sources_under(self.root, (self.origin, self.path), splats=splats)

    @property
    def autosave_path(self) -> Path:
        """The hidden file beside the scene."""
        return self.path.with_name(f".{self.path.name}.cagefield-autosave.json")

    def autosave(self, session: Session) -> None:
        """Write the autosave where the document has unsaved changes; `trouble` names a failure."""
        document = session.document
        if document is self._kept:
            return
        self._kept = document
        try:
            if session.saved:
                self.autosave_path.unlink(missing_ok=True)
            else:
                content = autosave_content(document, self._values_of(document))
                with replaced_file(self.autosave_path) as draft:
                    draft.write_text(json.dumps(content), encoding="utf-8")
            self.trouble = None
        except OSError as error:
            self.trouble = f"changes cannot be kept in {self.autosave_path} ({error.strerror}); save often"

    def remember(self, read: ReadEdits) -> None:
        """Store the edit-file values of edits that were read from a file."""
        for edit, values in zip(read.edits, read.values, strict=True):
            self._values.put(edit, values)

    def _values_of(self, document: Document) -> list[object]:
        edits = [entry.edit for entry in document.entries]
        new = [edit for edit in edits if edit not in self._values]
        known = dict(zip(map(id, new), file_values(new), strict=True))
        return [
            self._values.put(edit, known[id(edit)]) if id(edit) in known else self._values[edit]
            for edit in edits
        ]

    def save(self, session: Session) -> None:
        """Writes the session into its scene's folder.

        Raises SceneError, once, where another program has changed the edits meanwhile; saving again replaces
        them.
        """
        if self.source is not None:
            raise SceneError(f"{self.source.name} is a file and stays as it is; use Save as")
        if not self.path.is_dir():
            raise SceneError(f"{self.path} is not there any more; use Save as, with a new folder")
        now, field = self._fingerprint(), field_states(self.path)[0]
        if (now, field) not in ((self._written, self._field), self._warned):
            self._warned = now, field
            if field != self._field:
                raise SceneError(
                    f"{self.path / FIELD} was replaced by another program, these edits are of the old one; "
                    "save again to keep them there all the same, or Save as"
                )
            raise SceneError(
                f"{self.path / _EDITS} was changed by another program; save again to replace it, or Save as"
            )
        self._merge_manifest(session)
        document = session.document
        camera_path = dump_path(document.placed_keys, loop=document.loop)
        with contextlib.ExitStack() as drafts:  # there is room for all files, or none changes
            if document.keys or (self.path / CAMERA_PATH).exists():
                draft = drafts.enter_context(replaced_file(self.path / CAMERA_PATH))
                draft.write_text(camera_path, encoding="utf-8")
            if document.removed or (self.path / REMOVED).exists():
                draft = drafts.enter_context(replaced_file(self.path / REMOVED))
                draft.write_text(dump_removed(document.removed), encoding="utf-8")
            drafts.enter_context(self._scene(document, self.path).draft_manifest(self.path))
            save_edits(self.written(document.stack), self.path / _EDITS)
            self._written = self._fingerprint()  # ours, should the rest not be possible
        self._done(session)

    def _merge_manifest(self, session: Session) -> None:
        """Take what another program wrote into the manifest meanwhile.

        Raises SceneError, once, where the editor has changed the same values; saving again replaces them.
        """
        disk = manifest_on_disk(self.path)
        if disk is None:
            return
        conflicts = session.take_manifest(self._manifest, disk)
        if conflicts and self._warned_manifest != disk:
            self._warned_manifest = disk
            raise SceneError(
                f"{self.path / MANIFEST} was changed by another program, and so were "
                f"{' and '.join(conflicts)} here; save again to replace what is there, or Save as"
            )

    def save_as(self, session: Session, path: str, overwrite: bool) -> None:
        """Writes the scene with its edits as another folder, which is the open scene from then on.

        Raises SceneError where something is there that may not be replaced.
        """
        target = self.place(path)
        if target == self.path:
            self.save(session)
            return
        lock = None if self._lock is None else SceneLock(target)
        try:
            self._save_as(session, target, overwrite)
        except BaseException:
            if lock is not None:
                lock.release()
            raise
        if lock is not None:
            self.close()
            self._lock = lock

    def _save_as(self, session: Session, target: Path, overwrite: bool) -> None:
        document = session.document
        camera_path = dump_path(document.placed_keys, loop=document.loop)
        try:
            beside = {CAMERA_PATH: camera_path if document.keys else None}
            self._scene(document, target).save(target, overwrite, beside=beside)
        except SceneError as error:
            raise SceneError(
                str(error).replace("--overwrite (overwrite=True)", "choose to overwrite")
            ) from None
        with contextlib.suppress(OSError):
            self.autosave_path.unlink(missing_ok=True)
        self.path, self.source = real_path(target), None
        self.files = field_states(self.path)
        self._done(session)

    def _done(self, session: Session) -> None:
        session.mark_saved()
        self._manifest = values_of_document(session.document)
        self._written, self._field, self._warned = self._fingerprint(), field_states(self.path)[0], None
        self._kept = None
        self.autosave(session)

    def write_opened(self, folder: Path) -> None:
        """Writes the scene as it was opened, without edits, as a new folder: its own may hold another now."""
        self.scene.with_edits(EditStack([])).save(folder)

    def _scene(self, document: Document, folder: Path) -> Scene:
        edits = written(document.stack, folder, self.root)
        removal = None if document.removed is None else Removal(self.scene.field, document.removed)
        return dataclasses.replace(
            self.scene,
            edits=edits,
            preserve_opacity=document.preserve_opacity,
            folder=folder,
            removal=removal,
            alignment=Alignment.from_direction(document.meters_per_unit, document.up),
            hotspots=tuple(entry.hotspot for entry in document.hotspots),
        )

    def _fingerprint(self) -> str:
        try:
            return hashlib.sha256(read_bytes(self.path / _EDITS)).hexdigest()
        except OSError:
            return ""


def stem_of(file: Path) -> str:
    """The name of a splat file without its suffix, .compressed.ply included."""
    return file.name.removesuffix(file.suffix).removesuffix(".compressed") or file.name
