"""Work folder of structure from motion, from which an interrupted run continues.

It holds write_upright photos, their copies under plain names for COLMAP, masks, the database of features and
matches, and the record of its source. Each file in it is whole, or missing.
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

from cagefield.datasets.raw_photos import (
    RawPhoto,
    extract_video_frames,
    find_raw_photos,
    is_video,
    write_upright,
)
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

_RECORD_VERSION = 1

_PLAIN_CHARACTERS = rb"[ !#-\[\]-~]*"
_PHOTO_ENTRY = re.compile(
    rb'\["'
    + _PLAIN_CHARACTERS
    + rb'(?:\\(?:["\\/bfnrt]|u[0-9a-f]{4})'
    + _PLAIN_CHARACTERS
    + rb')*", (?:0|[1-9]\d*), (?:0|-?[1-9]\d*)\], (?=\[")'
)
"""Pattern of a photo in a record, as `json.dumps` writes it, before another one."""

_FILES_KEY = b'"files": ['

_MAX_REST_BYTES = 1 << 16
"""Maximum bytes of a record without its photos but the last."""

_MAX_SIDE_PIXELS = 1 << 20
"""Maximum side of a photo. Its square exceeds all focal lengths."""


def work_folder(target: Path) -> Path:
    """Work folder of an interrupted run, beside `target`."""
    return target.with_name(target.name + ".work")


def prepare_work(work: Path, record: Mapping[str, Any]) -> None:
    """Create the work folder; a folder of other photos is emptied.

    Raises DatasetError where the folder's source is unknown.
    """
    remove_leftovers(work)
    note = work / "made_of.json"
    text = json.dumps(record)
    if work.exists():
        if note.is_file():
            content = read_bytes(note)
            if content == text.encode():
                return
            if not _is_record(content):
                raise DatasetError(f"folder {work} is in the way, its {note.name} is damaged; move it away")
        elif any(work.iterdir()):
            raise DatasetError(f"folder {work} is in the way and holds something else; move it away")
        remove_work(work)
    with replaced_folder(work, ()) as draft:
        (draft / note.name).write_text(text, encoding="utf-8")


def _is_record(content: bytes) -> bool:
    """Whether `content` is JSON in the form of a record, found without building the list of its photos."""
    begin = content.find(_FILES_KEY) + len(_FILES_KEY)
    end = begin
    if begin >= len(_FILES_KEY):
        while (photo := _PHOTO_ENTRY.match(content, end)) is not None:
            end = photo.end()
    if len(content) - end + begin > _MAX_REST_BYTES:
        return False
    try:
        return isinstance(json_text.loads(content[:begin] + content[end:]), dict)
    except ValueError:
        return False


def remove_work(work: Path) -> None:
    """Remove the work folder. It is renamed to a hidden name first, so that a partial removal leaves no work
    folder.
    """
    hidden = work.with_name(hidden_name(work, "new"))
    try:
        work.rename(hidden)
    except OSError:
        hidden = work
    shutil.rmtree(hidden, ignore_errors=True)


@contextlib.contextmanager
def mention_work_folder(work: Path) -> Iterator[None]:
    """Add to an error of the system or of COLMAP that the work folder stays, where it exists."""
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


def prepare_photos(
    source: Path, work: Path, frames: int, on_progress: OnProgress, masks: Path | None = None
) -> tuple[list[RawPhoto], dict[str, str]]:
    """(write_upright photos in the work folder, reason by name for the photos that cannot be read).

    Their masks are written there too, write_upright (see `raw_masks`). Where the list of photos is damaged
    the photos are read again; features and matches stay if the number of photos is unchanged.
    """
    note = work / "photos.json"
    if note.is_file():
        listed = _read_photo_list(note, work / "images")
        if listed is not None:
            return listed
    for name in ("images", VALID_FOLDER):
        shutil.rmtree(work / name, ignore_errors=True)
    if source.is_file():
        base = work / "frames"
        shutil.rmtree(base, ignore_errors=True)
        files = extract_video_frames(source, frames, base, on_progress)
    else:
        base = _photo_root(source)
        files = find_raw_photos(base)
    photos, unreadable = [], {}
    valid = RawMasks.find(base, [file.relative_to(base).as_posix() for file in files], masks)
    for index, file in enumerate(files, start=1):
        name = file.relative_to(base).as_posix()
        try:
            photo = write_upright(file, name, work / "images")
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


def _read_photo_list(note: Path, images: Path) -> tuple[list[RawPhoto], dict[str, str]] | None:
    """Content of the list of photos; None where it is damaged, or a photo is missing."""
    try:
        values = json_text.loads(read_bytes(note))
        photos = [RawPhoto(**{**one, "path": images / one["name"]}) for one in values["photos"]]
        unreadable = {str(name): str(reason) for name, reason in values["unreadable"].items()}
        is_complete = all(
            _is_within(photo.name)
            and photo.path.is_file()
            and all(
                isinstance(side, int) and 0 < side <= _MAX_SIDE_PIXELS for side in (photo.width, photo.height)
            )
            and (photo.focal is None or 0.0 < photo.focal <= _MAX_SIDE_PIXELS**2)
            and isinstance(photo.sharpness, (int, float))
            and isinstance(photo.alpha, bool)
            for photo in photos
        )
    except (OSError, ValueError, TypeError, KeyError, AttributeError):  # OSError: a name that is too long
        return None
    return (photos, unreadable) if is_complete else None


def _is_within(name: str) -> bool:
    """Whether a photo's name stays within the folder of photos."""
    parts = PurePosixPath(name).parts
    return bool(parts) and ".." not in parts and not Path(name).is_absolute()


def _remove_features(work: Path) -> None:
    """Remove the files derived from a list of photos: their copies for COLMAP, and its database."""
    for file in work.glob(f"{DATABASE}*"):
        file.unlink()
    for name in ("colmap", "masks"):
        shutil.rmtree(work / name, ignore_errors=True)


def link_plain_names(photos: Sequence[RawPhoto], work: Path) -> list[str]:
    """Plain file names of the photos for COLMAP, in the folder `colmap`; their masks, and those of cut-outs,
    in `masks`.

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
                with Image.open(valid) as valid_image:
                    mask = ImageChops.darker(mask, valid_image.convert("L"))
            (work / "masks").mkdir(exist_ok=True)
            mask.save(work / "masks" / f"{name}.png")
        gray = Image.new("RGBA", pixels.size, (127, 127, 127, 255))
        with replaced_file(folder / name) as draft:
            Image.alpha_composite(gray, pixels).convert("RGB").save(draft, compress_level=1)
    return names


def photo_record(source: Path, frames: int, masks: Path | None = None) -> dict[str, Any]:
    """Record of a set of photos: names, sizes in bytes, times of change; digest of masks."""
    if not source.exists():
        raise DatasetError(f"{source} does not exist; give a folder of photos or a video")
    if source.is_file() and not is_video(source):
        raise DatasetError(
            f"{source} is no video that is known by its name; give a folder of photos or an MP4"
        )
    base = source.parent if source.is_file() else _photo_root(source)
    files = [source] if source.is_file() else find_raw_photos(base)
    if not files:
        raise DatasetError(f"{base}: no photos in it; give a folder of photos or a video")
    listing = [[f.relative_to(base).as_posix(), f.stat().st_size, f.stat().st_mtime_ns] for f in files]
    record = {
        "version": _RECORD_VERSION,
        "files": listing,
        **({"frames": frames} if source.is_file() else {}),
    }
    digest = RawMasks.find(base, [str(name) for name, *_ in listing], masks, quiet=True).digest()
    return {**record, "masks": digest} if digest else record


def _photo_root(source: Path) -> Path:
    """Folder of the photos: `images` in `source` where it exists, since its neighbors may be masks, else
    `source`.
    """
    return source / "images" if (source / "images").is_dir() else source
