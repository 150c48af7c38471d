"""SIFT features of photos and matches between them, by pycolmap, in a database file of COLMAP's.

COLMAP measures pixels as cagefield does: the first pixel has its centre at (.5, .5).
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
"""Called with (share done from 0 to 1, a few words)."""

INSTALL = "pip install -U pycolmap"
"""Cure of a missing or old pycolmap, at the end of an error message."""

_FATAL = 3  # glog's level that only ends the process

# Work is done in batches, so that progress is known without a look into the database: Python's SQLite and
# pycolmap's own in one process would break each other's locks (sqlite.org, "How To Corrupt An SQLite
# Database File", 2.2).
_PHOTOS_AT_ONCE = 8

_LITTLE = 8_000_000
"""Bytes free on a disk, under which they are told where a database fails: COLMAP does not always say why."""


@dataclass(frozen=True)
class Photo:
    """One photo of the database: its file's name, and the number of its camera."""

    name: str
    camera: int


def engine() -> Any:
    """The module pycolmap. Raises DatasetError where it is missing, or older than 4.2."""
    try:
        import pycolmap
    except ImportError:
        raise DatasetError(f"this needs pycolmap, which is not installed; {INSTALL}") from None
    if not hasattr(pycolmap, "CancellationToken"):
        raise DatasetError(f"this needs pycolmap 4.2 or newer, not {pycolmap.__version__}; {INSTALL}")
    return pycolmap


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """pycolmap writes no log while this lasts."""
    logging = engine().logging
    level = logging.minloglevel
    logging.minloglevel = _FATAL
    try:
        yield
    finally:
        logging.minloglevel = level


def call(function: Callable[..., Any], *args: Any, poll: Callable[[], None] | None = None, **kw: Any) -> Any:
    """`function(*args, **kw)` of pycolmap's in a thread; Ctrl-C ends it at its next pause.

    `poll` is called several times a second meanwhile.

    Raises StoppedError with the reason where COLMAP fails.
    """
    token = engine().CancellationToken()
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
    with quiet():
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
def opened(path: Path) -> Iterator[Any]:
    """The database in a file, silently. Raises StoppedError with the reason where COLMAP fails."""
    try:
        with quiet(), contextlib.closing(engine().Database.open(path)) as database:
            yield database
    except (OSError, CagefieldError):
        raise
    except (RuntimeError, ValueError) as error:
        free = shutil.disk_usage(path.parent).free
        left = f", and {free // 1000} kB are free on its disk" if free < _LITTLE else ""
        reason = " ".join(str(error).split())
        cure = left or "; where it stops there again, remove that file"
        raise StoppedError(f"COLMAP stopped at its database {path}: {reason}{cure}") from error


def create_database(path: Path, cameras: Sequence[Any], photos: Sequence[Photo]) -> None:
    """Writes a database with these pycolmap cameras and photos; photo i becomes image i + 1, frame i + 1.

    Camera and rig numbers count from 1 too. It is at `path` whole, or not at all.
    """
    pycolmap = engine()
    draft = path.with_suffix(".new")
    journals = [draft.with_name(draft.name + ending) for ending in ("-wal", "-shm")]
    for file in (draft, *journals):
        file.unlink(missing_ok=True)
    with opened(draft) as database:
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
    """Finds the features of the photos `names` in the folder `images`; those that have theirs are left.

    At most `features` a photo, in photos shrunk to `longer_side` pixels (positions are of the whole photo).
    `masks` holds an 8-bit image NAME.png for photos where only features on white count.

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
    colmap_process.run("finding features", [task], progress)


def extract_here(
    database: str,
    images: str,
    names: Sequence[str],
    features: int,
    longer_side: int,
    masks: str | None,
    on_done: Callable[[int], None],
) -> None:
    """The same in this process, which COLMAP ends where it cannot write; `on_done` has the photos done."""
    pycolmap = engine()
    options = pycolmap.FeatureExtractionOptions(use_gpu=False, max_image_size=longer_side)
    options.sift.max_num_features = features
    reader = pycolmap.ImageReaderOptions()
    if masks is not None:
        reader.mask_path = masks
    for start in range(0, len(names), _PHOTOS_AT_ONCE):
        batch = list(names[start : start + _PHOTOS_AT_ONCE])
        call(
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
    """Every pair of `count` photos."""
    return [(i, j) for i in range(count) for j in range(i + 1, count)]


def likely_pairs(
    database: Path, count: int, *, neighbours: int = 8, alike: int = 16
) -> list[tuple[int, int]]:
    """Pairs (i, j) of `count` photos that may show the same: near in order, or alike in their features.

    Each photo is paired with the next `neighbours`, those 16, 32, 64 further on, and the `alike` photos whose
    aggregated features (VLAD: residuals of the descriptors to 32 words, summed, roots, unit length) are most
    like its own.

    Source: Jégou et al., "Aggregating local descriptors into a compact image representation" (2010).
    """
    from scipy.cluster.vq import kmeans2

    steps = [*range(1, neighbours + 1), 16, 32, 64]
    pairs = {(i, i + step) for i in range(count) for step in steps if i + step < count}
    with opened(database) as source:
        descriptors = [_descriptors(source, index + 1) for index in range(count)]
    sample = np.concatenate([d[:: max(1, len(d) * count // 20000)] for d in descriptors])
    if len(sample) >= 64:
        words, _ = kmeans2(sample, 32, iter=12, minit="points", seed=0)
        summed = np.stack([_vlad(d, words) for d in descriptors])
        likeness = summed @ summed.T
        np.fill_diagonal(likeness, -np.inf)
        for i in range(count):
            nearest = np.argsort(-likeness[i], kind="stable")[:alike]
            pairs |= {(min(i, j), max(i, j)) for j in nearest.tolist()}
    return sorted(pairs)


def _descriptors(database: Any, image_id: int) -> npt.NDArray[np.float32]:
    if not database.exists_descriptors(image_id):
        return np.zeros((0, 128), dtype=np.float32)
    found = database.read_descriptors(image_id)
    rows = np.asarray(getattr(found, "data", found), dtype=np.float32)
    if rows.shape[1:] != (128,):
        raise ValueError(f"features of photo {image_id} are {list(rows.shape)} numbers, not 128 each")
    return rows[:2048]


def _vlad(descriptors: npt.NDArray[np.float32], words: npt.NDArray[np.float32]) -> FloatArray:
    """Unit vector [words x 128]; zeros without descriptors."""
    nearest = (descriptors @ words.T - 0.5 * (words**2).sum(axis=1)).argmax(axis=1)
    summed = np.zeros(words.shape)
    np.add.at(summed, nearest, descriptors - words[nearest])
    rooted = np.sign(summed.ravel()) * np.sqrt(np.abs(summed.ravel()))
    return np.asarray(rooted / max(np.linalg.norm(rooted), 1e-12), np.float64)


def share(on_progress: OnProgress | None, start: float, end: float) -> OnProgress:
    """Progress of a stage that goes from `start` to `end` of the whole."""

    def move(done: float, note: str) -> None:
        if on_progress is not None:
            on_progress(start + (end - start) * done, note)

    return move


def consecutive(groups: Iterable[Any]) -> tuple[list[Any], list[int]]:
    """The different values in order of appearance, and for each item the number of its own."""
    known: dict[Any, int] = {}
    numbers = [known.setdefault(group, len(known)) for group in groups]
    return list(known), numbers
