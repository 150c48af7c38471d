"""SIFT features of photos and matches between them, by pycolmap, in a COLMAP database file.

COLMAP and cagefield measure pixels alike: the first pixel has its center at (.5, .5).
"""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from cagefield.datasets.sfm import colmap_process
from cagefield.datasets.sfm.colmap_process import StoppedError
from cagefield.errors import CagefieldError, DatasetError

FloatArray = npt.NDArray[np.float64]
Pairs = Sequence[tuple[int, int]]

OnProgress = Callable[[float, str], None]
"""Function of (share done from 0 to 1, a few words)."""

INSTALL_COMMAND = "pip install -U pycolmap"
"""Cure of a missing or old pycolmap, at the end of an error message."""

_FATAL_LOG_LEVEL = 3  # glog's level that only ends the process

# Work is done in batches, so that progress is known without a look into the database: Python's SQLite and
# pycolmap's own in one process would break each other's locks (sqlite.org, "How To Corrupt An SQLite
# Database File", 2.2).
_BATCH_PHOTOS = 8

_LOW_DISK_BYTES = 8_000_000
"""Free bytes on a disk below which a database error mentions them: COLMAP does not always say why it fails.
"""


@dataclass(frozen=True)
class Photo:
    """Photo of the database: its file's name, and the number of its camera."""

    name: str
    camera: int


def import_pycolmap() -> Any:
    """Module pycolmap. Raises DatasetError where it is missing, or older than 4.2."""
    try:
        import pycolmap
    except ImportError:
        raise DatasetError(f"this needs pycolmap, which is not installed; {INSTALL_COMMAND}") from None
    if not hasattr(pycolmap, "CancellationToken"):
        raise DatasetError(f"this needs pycolmap 4.2 or newer, not {pycolmap.__version__}; {INSTALL_COMMAND}")
    return pycolmap


@contextlib.contextmanager
def silence_log() -> Iterator[None]:
    """Suppress pycolmap's log within the context."""
    logging = import_pycolmap().logging
    level = logging.minloglevel
    logging.minloglevel = _FATAL_LOG_LEVEL
    try:
        yield
    finally:
        logging.minloglevel = level


def call_cancellable(
    function: Callable[..., Any], *args: Any, poll: Callable[[], None] | None = None, **kw: Any
) -> Any:
    """Result of pycolmap's `function(*args, **kw)`, run in a thread that Ctrl-C ends at its next pause.

    `poll` is called several times a second meanwhile.

    Raises StoppedError with the reason where COLMAP fails.
    """
    token = import_pycolmap().CancellationToken()
    result: list[Any] = []
    failure: list[BaseException] = []

    def work() -> None:
        try:
            result.append(function(*args, **kw, cancellation_token=token))
        except BaseException as error:
            failure.append(error)
        finally:
            ended.set()  # a join that Ctrl-C interrupts takes the thread for ended

    ended = threading.Event()
    thread = threading.Thread(target=work, name="colmap", daemon=True)
    with silence_log():
        thread.start()
        try:
            while not ended.wait(0.2):
                if poll is not None:
                    poll()
        except BaseException:
            token.cancel()
            ended.wait()
            raise
    if failure:
        reason = " ".join(str(failure[0]).split())
        raise StoppedError(f"COLMAP stopped at {function.__name__}: {reason}") from failure[0]
    return result[0]


@contextlib.contextmanager
def open_database(path: Path) -> Iterator[Any]:
    """Open database of a file, without log. Raises StoppedError with the reason where COLMAP fails."""
    try:
        with silence_log(), contextlib.closing(import_pycolmap().Database.open(path)) as database:
            yield database
    except (OSError, CagefieldError):
        raise
    except (RuntimeError, ValueError) as error:
        free = shutil.disk_usage(path.parent).free
        disk_note = f", and {free // 1000} kB are free on its disk" if free < _LOW_DISK_BYTES else ""
        reason = " ".join(str(error).split())
        cure = disk_note or "; where it stops there again, remove that file"
        raise StoppedError(f"COLMAP stopped at its database {path}: {reason}{cure}") from error


def create_database(path: Path, cameras: Sequence[Any], photos: Sequence[Photo]) -> None:
    """Write a database with these pycolmap cameras and photos; photo i becomes image i + 1, frame i + 1.

    Camera and rig numbers count from 1 too. The file appears whole, or not at all.
    """
    pycolmap = import_pycolmap()
    draft = path.with_suffix(".new")
    journals = [draft.with_name(draft.name + ending) for ending in ("-wal", "-shm")]
    for file in (draft, *journals):
        file.unlink(missing_ok=True)
    with open_database(draft) as database:
        for index, camera in enumerate(cameras, start=1):
            camera.camera_id = index
            database.write_camera(camera, use_camera_id=True)
            rig = pycolmap.Rig(rig_id=index)
            rig.add_ref_sensor(camera.sensor_id)
            database.write_rig(rig, use_rig_id=True)
        for index, photo in enumerate(photos, start=1):
            image = pycolmap.Image(name=photo.name, camera_id=photo.camera + 1, image_id=index)
            database.write_image(image, use_image_id=True)
            frame = pycolmap.Frame(frame_id=index, rig_id=photo.camera + 1)
            frame.add_data_id(image.data_id)
            database.write_frame(frame, use_frame_id=True)
    if any(journal.is_file() and journal.stat().st_size for journal in journals):
        # SQLite closes a database that did not take in its journal, and says nothing.
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))
    draft.replace(path)


def extract(
    database: Path,
    images: Path,
    names: Sequence[str],
    *,
    features: int,
    longer_side: int,
    masks: Path | None = None,
    on_progress: OnProgress | None = None,
) -> None:
    """Find the features of the photos `names` in the folder `images`; photos that have features are skipped.

    At most `features` a photo, in photos shrunk to `longer_side` pixels (positions are in the whole photo's
    pixels). `masks` holds an 8-bit image NAME.png for photos where only features on white count.

    Raises StoppedError where COLMAP fails.
    """
    count = max(1, len(names))

    def progress(done: int) -> None:
        if on_progress is not None:
            on_progress(done / count, f"features of {done} of {len(names)} photos")

    task = {
        "task": "extract",
        "database": str(database),
        "images": str(images),
        "names": list(names),
        "features": features,
        "longer_side": longer_side,
        "masks": None if masks is None else str(masks),
    }
    colmap_process.run_tasks("finding features", [task], progress)


def extract_in_process(
    database: str,
    images: str,
    names: Sequence[str],
    features: int,
    longer_side: int,
    masks: str | None,
    on_done: Callable[[int], None],
) -> None:
    """Find the features as `extract` does, in this process; `on_done` is called with the number of photos
    done.

    COLMAP aborts the process where it cannot write.
    """
    pycolmap = import_pycolmap()
    options = pycolmap.FeatureExtractionOptions(use_gpu=False, max_image_size=longer_side)
    options.sift.max_num_features = features
    reader = pycolmap.ImageReaderOptions()
    if masks is not None:
        reader.mask_path = masks
    for start in range(0, len(names), _BATCH_PHOTOS):
        batch = list(names[start : start + _BATCH_PHOTOS])
        call_cancellable(
            pycolmap.extract_features,
            Path(database),
            Path(images),
            image_names=batch,
            reader_options=reader,
            extraction_options=options,
            device=pycolmap.Device.cpu,
        )
        on_done(start + len(batch))


def all_pairs(count: int) -> list[tuple[int, int]]:
    """Every pair (i, j), i < j, of `count` photos."""
    return [(i, j) for i in range(count) for j in range(i + 1, count)]


def select_likely_pairs(
    database: Path, count: int, *, neighbors: int = 8, similar: int = 16
) -> list[tuple[int, int]]:
    """Pairs (i, j) of `count` photos that may overlap: near in order, or with similar features.

    Each photo is paired with the next `neighbors`, the 16th, 32nd and 64th photo after it, and the `similar`
    photos whose aggregated features (VLAD: residuals of the descriptors to 32 words, summed, roots, unit
    length) are most like its own.

    Source: Jégou et al., "Aggregating local descriptors into a compact image representation" (2010).
    """
    from scipy.cluster.vq import kmeans2

    steps = [*range(1, neighbors + 1), 16, 32, 64]
    pairs = {(i, i + step) for i in range(count) for step in steps if i + step < count}
    with open_database(database) as source:
        descriptors = [_descriptors(source, index + 1) for index in range(count)]
    sample = np.concatenate([d[:: max(1, len(d) * count // 20000)] for d in descriptors])
    if len(sample) >= 64:
        words, _ = kmeans2(sample, 32, iter=12, minit="points", seed=0)
        aggregated = np.stack([_vlad(d, words) for d in descriptors])
        similarity = aggregated @ aggregated.T
        np.fill_diagonal(similarity, -np.inf)
        for i in range(count):
            nearest = np.argsort(-similarity[i], kind="stable")[:similar]
            pairs |= {(min(i, j), max(i, j)) for j in nearest.tolist()}
    return sorted(pairs)


def _descriptors(database: Any, image_id: int) -> npt.NDArray[np.float32]:
    if not database.exists_descriptors(image_id):
        return np.zeros((0, 128), dtype=np.float32)
    stored = database.read_descriptors(image_id)
    rows = np.asarray(getattr(stored, "data", stored), dtype=np.float32)
    if rows.shape[1:] != (128,):
        raise ValueError(f"features of photo {image_id} are {list(rows.shape)} numbers, not 128 each")
    return rows[:2048]


def _vlad(descriptors: npt.NDArray[np.float32], words: npt.NDArray[np.float32]) -> FloatArray:
    """Unit VLAD vector [words x 128] of descriptors; zeros without descriptors."""
    nearest = (descriptors @ words.T - 0.5 * (words**2).sum(axis=1)).argmax(axis=1)
    aggregated = np.zeros(words.shape)
    np.add.at(aggregated, nearest, descriptors - words[nearest])
    rooted = np.sign(aggregated.ravel()) * np.sqrt(np.abs(aggregated.ravel()))
    return np.asarray(rooted / max(np.linalg.norm(rooted), 1e-12), np.float64)


def scale_progress(on_progress: OnProgress | None, start: float, end: float) -> OnProgress:
    """Progress function of a stage that covers `start` to `end` of the whole."""

    def move(done: float, note: str) -> None:
        if on_progress is not None:
            on_progress(start + (end - start) * done, note)

    return move


def number_groups(groups: Iterable[Any]) -> tuple[list[Any], list[int]]:
    """(distinct values in order of appearance, number of each item's value)."""
    known: dict[Any, int] = {}
    numbers = [known.setdefault(group, len(known)) for group in groups]
    return list(known), numbers
