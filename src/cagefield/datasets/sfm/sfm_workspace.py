"""The folder of what structure from motion has done so far, from which an interrupted run continues.

It holds upright photos, their copies under plain names for COLMAP, masks, the database of features and
matches, and what it was made of. Each file in it is whole, or not there.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path, PurePosixPath
from typing import Any

from PIL import Image, ImageChops

from cagefield.datasets.raw_photos import RawPhoto, find_raw_photos, is_video, upright, video_frames
from cagefield.datasets.sfm.colmap_process import StoppedError
from cagefield.datasets.sfm.features import OnProgress
from cagefield.datasets.sfm.raw_masks import VALID_FOLDER, RawMasks
from cagefield.errors import DatasetError, line_of
from cagefield.files import json_text
from cagefield.files.atomic import replaced_file, replaced_folder
from cagefield.files.safe_open import read_bytes
from cagefield.files.stale_files import hidden_name, remove_leftovers

DATABASE = "database.db"
"""Name of COLMAP's database of features and matches in the work folder."""

_VERSION = 1

_PLAIN = rb"[ !#-\[\]-~]*"
_PHOTO = re.compile(
    rb'\["'
    + _PLAIN
    + rb'(?:\\(?:["\\/bfnrt]|u[0-9a-f]{4})'
    + _PLAIN
    + rb')*", (?:0|[1-9]\d*), (?:0|-?[1-9]\d*)\], (?=\[")'
)
"""A photo of a record, as `json.dumps` writes it, before another one."""

_PHOTOS = b'"files": ['

_LONGEST_REST = 1 << 16
"""Bytes of a record beside its photos but the last, at most."""

_LONGEST = 1 << 20
"""Pixels of a photo's side: none is longer. Its square is above all focal lengths."""


def work_folder(target: Path) -> Path:
    """The folder beside `target` that an interrupted run leaves."""
    return target.with_name(target.name + ".work")


def prepare_work(work: Path, record: Mapping[str, Any]) -> None:
    """The work folder, emptied where it is of other photos.

    Raises DatasetError where nobody can say what it is of.
    """
    remove_leftovers(work)
    note = work / "made_of.json"
    text = json.dumps(record)
    if work.exists():
        if note.is_file():
            known = read_bytes(note)
            if known == text.encode():
                return
            if not _is_record(known):
                raise DatasetError(f"folder {work} is in the way, its {note.name} is damaged; move it away")
        elif any(work.iterdir()):
            raise DatasetError(f"folder {work} is in the way and holds something else; move it away")
        remove_work(work)
    with replaced_folder(work, ()) as draft:
        (draft / note.name).write_text(text, encoding="utf-8")


def _is_record(content: bytes) -> bool:
    """Whether it is JSON as a record is: its photos are passed by one after another, and never built."""
    begin = content.find(_PHOTOS) + len(_PHOTOS)
    end = begin
    if begin >= len(_PHOTOS):
        while (photo := _PHOTO.match(content, end)) is not None:
            end = photo.end()
    if len(content) - end + begin > _LONGEST_REST:
        return False
    try:
        return isinstance(json_text.loads(content[:begin] + content[end:]), dict)
    except ValueError:
        return False


def remove_work(work: Path) -> None:
    """Removes the work folder: hidden first, so that what an end leaves of it is nobody's work."""
    hidden = work.with_name(hidden_name(work, "new"))
    try:
        work.rename(hidden)
    except OSError:
        hidden = work
    shutil.rmtree(hidden, ignore_errors=True)


@contextlib.contextmanager
def kept_work(work: Path) -> Iterator[None]:
    """An error of the system's or of COLMAP's says that the work folder stays, where there is one."""
    try:
        yield
    except (OSError, StoppedError) as error:
        if not work.is_dir():
            raise
        reason = line_of(error) if isinstance(error, OSError) else str(error)
        raise StoppedError(
            f"{reason}; what is done so far is kept in {work}, the same command continues; "
            "if it stops there again, remove that folder"
        ) from error


def work_photos(
    source: Path, work: Path, frames: int, on_progress: OnProgress, masks: Path | None = None
) -> tuple[list[RawPhoto], dict[str, str]]:
    """The upright photos in the work folder, and those that cannot be read with the reason.

    Masks of them are written there too, upright (see `raw_masks`). Where the list of photos is damaged they
    are read again; features and matches stay if there are as many.
    """
    note = work / "photos.json"
    if note.is_file():
        known = _known_photos(note, work / "images")
        if known is not None:
            return known
    for name in ("images", VALID_FOLDER):
        shutil.rmtree(work / name, ignore_errors=True)
    if source.is_file():
        base = work / "frames"
        shutil.rmtree(base, ignore_errors=True)
        files = video_frames(source, frames, base, on_progress)
    else:
        base = _base(source)
        files = find_raw_photos(base)
    photos, unreadable = [], {}
    valid = RawMasks.of(base, [file.relative_to(base).as_posix() for file in files], masks)
    for index, file in enumerate(files, start=1):
        name = file.relative_to(base).as_posix()
        try:
            photo = upright(file, name, work / "images")
            valid.write(name, file, photo, work / VALID_FOLDER)
            photos.append(photo)
        except DatasetError as error:
            unreadable[name] = str(error).removeprefix(f"{file}: ")
        on_progress(index / len(files), f"{index} of {len(files)} photos read")
    if (work / "colmap").is_dir() and len(list((work / "colmap").iterdir())) != len(photos):
        _remove_features(work)
    listing = [{**asdict(photo), "path": ""} for photo in photos]
    with replaced_file(note) as draft:
        draft.write_text(json.dumps({"photos": listing, "unreadable": unreadable}), encoding="utf-8")
    return photos, unreadable


def _known_photos(note: Path, images: Path) -> tuple[list[RawPhoto], dict[str, str]] | None:
    """What the list of photos says; None where it is damaged, or a photo is not there."""
    try:
        kept = json_text.loads(read_bytes(note))
        photos = [RawPhoto(**{**one, "path": images / one["name"]}) for one in kept["photos"]]
        unreadable = {str(name): str(reason) for name, reason in kept["unreadable"].items()}
        whole = all(
            _is_within(photo.name)
            and photo.path.is_file()
            and all(isinstance(side, int) and 0 < side <= _LONGEST for side in (photo.width, photo.height))
            and (photo.focal is None or 0.0 < photo.focal <= _LONGEST**2)
            and isinstance(photo.sharpness, (int, float))
            and isinstance(photo.alpha, bool)
            for photo in photos
        )
    except (OSError, ValueError, TypeError, KeyError, AttributeError):  # OSError: a name that is too long
        return None
    return (photos, unreadable) if whole else None


def _is_within(name: str) -> bool:
    """Whether a photo's name leads nowhere out of the folder of photos."""
    parts = PurePosixPath(name).parts
    return bool(parts) and ".." not in parts and not Path(name).is_absolute()


def _remove_features(work: Path) -> None:
    """Removes what was made of a list of photos: their copies for COLMAP, and its database."""
    for file in work.glob(f"{DATABASE}*"):
        file.unlink()
    for name in ("colmap", "masks"):
        shutil.rmtree(work / name, ignore_errors=True)


def plainly_named(photos: Sequence[RawPhoto], work: Path) -> list[str]:
    """Plain names of the photos for COLMAP, in the folder `colmap`; masks in `masks`, of cut-outs too.

    COLMAP's lists of pairs hold no names with spaces, and it does not read every format.
    """
    folder = work / "colmap"
    folder.mkdir(exist_ok=True)
    names = []
    for index, photo in enumerate(photos):
        simple = photo.path.suffix.lower() in (".jpg", ".jpeg", ".png") and not photo.alpha
        name = f"{index:06}{photo.path.suffix.lower() if simple else '.png'}"
        names.append(name)
        if (folder / name).exists():
            continue
        valid = work / VALID_FOLDER / f"{photo.name}.png"
        if valid.is_file() and not photo.alpha:
            (work / "masks").mkdir(exist_ok=True)
            shutil.copyfile(valid, work / "masks" / f"{name}.png")
        if simple:
            try:
                os.link(photo.path, folder / name)
            except OSError:
                with replaced_file(folder / name) as draft:
                    shutil.copyfile(photo.path, draft)
            continue
        with Image.open(photo.path) as image:
            pixels = image.convert("RGBA")
        if photo.alpha:
            mask = pixels.getchannel("A").point(lambda value: 255 if value > 127 else 0)
            if valid.is_file():
                with Image.open(valid) as used:
                    mask = ImageChops.darker(mask, used.convert("L"))
            (work / "masks").mkdir(exist_ok=True)
            mask.save(work / "masks" / f"{name}.png")
        grey = Image.new("RGBA", pixels.size, (127, 127, 127, 255))
        with replaced_file(folder / name) as draft:
            Image.alpha_composite(grey, pixels).convert("RGB").save(draft, compress_level=1)
    return names


def record_of(source: Path, frames: int, masks: Path | None = None) -> dict[str, Any]:
    """Record of a set of photos: names, sizes in bytes, times of change; digest of masks."""
    if not source.exists():
        raise DatasetError(f"{source} does not exist; give a folder of photos or a video")
    if source.is_file() and not is_video(source):
        raise DatasetError(
            f"{source} is no video that is known by its name; give a folder of photos or an MP4"
        )
    base = source.parent if source.is_file() else _base(source)
    files = [source] if source.is_file() else find_raw_photos(base)
    if not files:
        raise DatasetError(f"{base}: no photos in it; give a folder of photos or a video")
    listing = [[f.relative_to(base).as_posix(), f.stat().st_size, f.stat().st_mtime_ns] for f in files]
    record = {"version": _VERSION, "files": listing, **({"frames": frames} if source.is_file() else {})}
    digest = RawMasks.of(base, [str(name) for name, *_ in listing], masks, quiet=True).digest()
    return {**record, "masks": digest} if digest else record


def _base(source: Path) -> Path:
    """The folder of the photos: `images` in `source` where there is one, whose neighbours may be masks."""
    return source / "images" if (source / "images").is_dir() else source
