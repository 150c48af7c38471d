"""Photo files found by the names that a camera file gives them, written on any system.

A name is looked for as it is, then with another separator, URL-decoded, with another case, Unicode form or
image extension, and at last by its end: the file below the folder that shares most of the name's last parts.
A file that one name gives exactly is no other name's photo.
"""

from __future__ import annotations

import contextlib
import os
import unicodedata
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path, PurePosixPath
from urllib.parse import unquote

from cagefield.datasets.hidden_files import is_hidden
from cagefield.datasets.notices import warn
from cagefield.datasets.photos import EXTENSIONS, find_photo
from cagefield.datasets.raw_photos import RAW_EXTENSIONS
from cagefield.datasets.views import join_names

MAX_FOLDER_DEPTH = 6
"""Maximum depth of folders below a data set in which photos are looked for."""

MAX_INDEXED_FILES = 200_000

_MAX_NAME_CHARACTERS = 4096  # characters of a name
_IMAGE_EXTENSIONS = frozenset({*EXTENSIONS, *RAW_EXTENSIONS})
_SECONDARY_FOLDER_PREFIXES = (
    "mask",
    "depth",
    "normal",
    "thumb",
    "images_",
    "dynamic_mask",
)  # beginnings of folders' names


def view_name(name: str) -> str:
    """`name` with forward slashes and no leading ./"""
    return str(PurePosixPath(name.removeprefix("file://").replace("\\", "/")))


def photo_files(folder: Path) -> list[Path]:
    """Photos directly in a folder, sorted by name, without hidden files."""
    return sorted(
        file for file in folder.iterdir() if file.suffix.lower() in EXTENSIONS and not is_hidden([file.name])
    )


@dataclass
class FoundPhotos:
    """Photo files by the names of a camera file.

    Attributes:
        photos: the files of the names that were found.
        moved: the files found by the end of their name alone.
        ambiguous: names whose end several files share, or several names one file.
    """

    photos: dict[str, Path] = field(default_factory=dict)
    moved: dict[str, Path] = field(default_factory=dict)
    ambiguous: list[str] = field(default_factory=list)

    def relative_view_name(self, name: str, base: Path) -> str:
        """Name of the photo's view: the name itself, or of a moved photo its path below `base`."""
        path = self.moved.get(name)
        return view_name(name) if path is None else Path(os.path.relpath(path, base)).as_posix()

    def report(self, where: Path, base: Path) -> None:
        """Warn of photos that are not where the names say, and of names that could be several photos'."""
        if self.moved:
            name, path = next(iter(self.moved.items()))
            warn(
                f"{where}: {len(self.moved)} of {len(self.photos)} photos are not where it says, found below "
                f" {base} by the ends of their names ({name} is {path})"
            )
        if self.ambiguous:
            warn(
                f"{where}: the ends of {len(self.ambiguous)} names fit several photos below {base}, or one "
                f"photo several of them: {join_names(self.ambiguous)}; put the photos where the file says"
            )


def find_photos(base: Path, names: Iterable[str]) -> FoundPhotos:
    """Photo files of `names`, which are relative to the folder `base`."""
    matches, unmatched = FoundPhotos(), []
    for name in dict.fromkeys(names):
        photo = _find_exact(base, name)
        if photo is None:
            unmatched.append(name)
        else:
            matches.photos[name] = photo
    if not unmatched:
        return matches
    taken = {os.path.realpath(photo) for photo in matches.photos.values()}
    tree = _PhotoTree(base)
    claims_by_path: dict[Path, list[tuple[str, bool]]] = defaultdict(list)
    for name in unmatched:
        candidates, moved = tree.find_similar(name)
        free = [path for path in candidates if os.path.realpath(path) not in taken]
        if len(free) == 1:
            claims_by_path[free[0]].append((name, moved))
        elif free:
            matches.ambiguous.append(name)
    for path, claims in claims_by_path.items():
        if len({view_name(name) for name, _ in claims}) > 1:
            matches.ambiguous += [name for name, _ in claims]
            continue
        for name, moved in claims:
            matches.photos[name] = path
            if moved:
                matches.moved[name] = path
    return matches


def _find_exact(base: Path, name: str) -> Path | None:
    if len(name) > _MAX_NAME_CHARACTERS:
        return None
    for text in dict.fromkeys((name, view_name(name), unquote(view_name(name)))):
        with contextlib.suppress(OSError, ValueError):  # a part that is too long, a zero in it
            photo = find_photo(base / text)
            if photo is not None and not is_hidden([photo.name]):
                return photo
    return None


def name_key(part: str) -> str:
    """Comparison key of one part of a path: composed Unicode, case-folded."""
    return unicodedata.normalize("NFC", part).casefold()


def stem_key(name: str) -> str:
    """Comparison key of a file's name without its image extension."""
    stem, extension = os.path.splitext(name)
    return name_key(stem if extension.lower() in _IMAGE_EXTENSIONS else name)


class _PhotoTree:
    """Index of the photos below a folder."""

    def __init__(self, base: Path) -> None:
        self._base = base

    @cached_property
    def _by_stem(self) -> dict[str, list[tuple[str, ...]]]:
        """Parts of the paths below the folder, by the key of the stem."""
        index: dict[str, list[tuple[str, ...]]] = defaultdict(list)
        for count, parts in enumerate(iterate_image_paths(self._base)):
            if count >= MAX_INDEXED_FILES:
                break
            index[stem_key(parts[-1])].append(parts)
        return index

    @cached_property
    def _folders(self) -> set[tuple[str, ...]]:
        return {
            tuple(map(name_key, parts[:length]))
            for paths in self._by_stem.values()
            for parts in paths
            for length in range(1, len(parts))
        }

    def find_similar(self, name: str) -> tuple[list[Path], bool]:
        """(files that may be the photo `name`, whether they lie in another folder than the name says).

        In a folder that the name gives and that exists, the files of its stem; else the files that share the
        longest end.
        """
        text = unquote(view_name(name)) if "%" in name else view_name(name)
        parts = tuple(part for part in PurePosixPath(text).parts if part not in ("/", ".."))
        if not parts:
            return [], False
        folder = tuple(map(name_key, parts[:-1]))
        same_stem = self._by_stem.get(stem_key(parts[-1]), [])
        in_folder = [one for one in same_stem if tuple(map(name_key, one[:-1])) == folder]
        if in_folder or (folder and folder in self._folders):
            return self._paths(_prefer(in_folder, parts[-1])), False
        lengths = [_common_end(one[:-1], parts[:-1]) for one in same_stem]
        longest = [one for one, length in zip(same_stem, lengths, strict=True) if length == max(lengths)]
        return self._paths(_prefer(longest, parts[-1])), True

    def _paths(self, paths: Sequence[tuple[str, ...]]) -> list[Path]:
        return [self._base.joinpath(*parts) for parts in paths]


def _prefer(candidates: list[tuple[str, ...]], name: str) -> list[tuple[str, ...]]:
    """Files with the name's extension if any, and of these the files in no folder of masks or copies."""
    extension = os.path.splitext(name)[1].lower()
    for is_preferred in (
        lambda parts: os.path.splitext(parts[-1])[1].lower() == extension,
        lambda parts: not any(part.lower().startswith(_SECONDARY_FOLDER_PREFIXES) for part in parts[:-1]),
        lambda parts: parts[-1] == name,
    ):
        preferred = [parts for parts in candidates if is_preferred(parts)]
        candidates = preferred if preferred and len(candidates) > 1 else candidates
    return candidates


def _common_end(one: Sequence[str], other: Sequence[str]) -> int:
    """Number of last parts that two paths share."""
    count = 0
    for first, second in zip(reversed(one), reversed(other), strict=False):
        if name_key(first) != name_key(second):
            break
        count += 1
    return count


def iterate_image_paths(base: Path) -> Iterator[tuple[str, ...]]:
    """Parts of the paths of images below a folder, in order, without hidden ones."""
    for folder, folders, files in os.walk(base, followlinks=True):
        parts = Path(os.path.relpath(folder, base)).parts
        folders[:] = (
            sorted(name for name in folders if not is_hidden([name])) if len(parts) < MAX_FOLDER_DEPTH else []
        )
        for name in sorted(files):
            if os.path.splitext(name)[1].lower() in EXTENSIONS and not is_hidden([name]):
                yield (*parts, name)
