"""Photos and videos without poses: found, turned upright, and measured for sharpness."""

from __future__ import annotations

import itertools
import shutil
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageOps
from scipy.ndimage import laplace

from cagefield.datasets.hidden_files import MASK_FOLDER_PATTERN, is_hidden
from cagefield.datasets.natural_order import natural_key
from cagefield.datasets.photos import EXTENSIONS
from cagefield.errors import DatasetError
from cagefield.images.color_conversion import describe_conversion, has_alpha, rgb_converter
from cagefield.images.image_files import load_pixels, open_image_file
from cagefield.images.image_formats import EFFICIENT_FORMATS

VIDEO_EXTENSIONS = (".mp4", ".mov", ".m4v", ".mkv", ".webm", ".avi", ".3gp", ".mts", ".m2ts", ".mpg", ".mpeg")

RAW_EXTENSIONS = (".dng", ".cr2", ".cr3", ".nef", ".arw", ".raf", ".orf", ".rw2")
"""Extensions of raw photos, which may not be readable: such files are named where they are left out."""

_CONVERTED_EXTENSIONS = (".heic", ".heif", ".hif", ".avif", ".exr")
"""Extensions of photos that are written anew: COLMAP and browsers do not read them."""

_SHARPNESS_SIDE_PIXELS = 640  # pixels of the longer side at which sharpness is measured
_FILM_DIAGONAL_MM = 43.267  # millimeters of a 36 x 24 film's frame, which EXIF's 35 mm focal lengths refer to
_FOCAL_35_TAG = 0xA405  # EXIF: FocalLengthIn35mmFilm
_EXIF_IFD_TAG = 0x8769
_ORIENTATION_TAG = 0x0112
_STRETCH_MIDDLE_SHARE = 0.6  # share of a frame's stretch of the video in whose middle the sharpest is taken


@dataclass(frozen=True)
class RawPhoto:
    """Upright photo on disk: `focal` in pixels from its EXIF tags, `sharpness` as of `sharpness`."""

    name: str
    path: Path
    width: int
    height: int
    focal: float | None
    sharpness: float
    alpha: bool


def is_video(path: Path) -> bool:
    """Whether `path` is a video file, by its extension."""
    return path.is_file() and path.suffix.lower() in VIDEO_EXTENSIONS


def find_raw_photos(folder: Path) -> list[Path]:
    """Photos in a folder and below, in natural order of names, without hidden files and masks."""
    known = {*EXTENSIONS, *RAW_EXTENSIONS}
    photos = [
        file
        for file in folder.rglob("*")
        if file.suffix.lower() in known
        and file.is_file()
        and not is_hidden(file.relative_to(folder).parts)
        and not any(MASK_FOLDER_PATTERN.fullmatch(part) for part in file.relative_to(folder).parts[:-1])
    ]
    return sorted(photos, key=lambda file: natural_key(file.relative_to(folder).as_posix()))


def write_upright(source: Path, name: str, folder: Path) -> RawPhoto:
    """Write the photo `source` to `folder` under `name`, turned by its EXIF orientation.

    The file is copied where nothing has to change; else it is written anew, as PNG with alpha and as JPEG
    without, and its name gets that extension.

    Raises DatasetError where the photo cannot be read.
    """
    try:
        with open_image_file(source) as image:
            conversion, convert, alpha = describe_conversion(image), rgb_converter(image), has_alpha(image)
            load_pixels(image)
            exif = image.getexif()
            focal_35 = exif.get_ifd(_EXIF_IFD_TAG).get(_FOCAL_35_TAG) or 0
            turned = ImageOps.exif_transpose(image)
            is_copy = exif.get(_ORIENTATION_TAG, 1) == 1 and source.suffix.lower() in EXTENSIONS
        is_copy &= (
            source.suffix.lower() not in _CONVERTED_EXTENSIONS and image.format not in EFFICIENT_FORMATS
        )
        is_copy &= turned.mode in ("L", "RGB", "RGBA", "LA", "P", "CMYK", "YCbCr") and conversion is None
        upright_photo = convert(turned)
    except DatasetError:
        raise
    except Exception as error:  # Pillow raises whatever its decoders do
        known = source.suffix.lower() not in (*RAW_EXTENSIONS, *_CONVERTED_EXTENSIONS)
        wanted = "replace the file" if known else "convert it to JPEG"
        raise DatasetError(f"{source}: cannot be read as a photo; {wanted}") from error
    target = folder / name
    if is_copy:
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(source, target)
    else:
        name += ".png" if alpha else ".jpg"
        target = folder / name
        target.parent.mkdir(parents=True, exist_ok=True)
        for key in ("exif", "icc_profile", "xmp"):
            upright_photo.info.pop(key, None)
        if alpha:
            upright_photo.save(target, compress_level=1)
        else:
            upright_photo.save(target, quality=95, subsampling=0)
    width, height = turned.size
    focal = float(focal_35) * float(np.hypot(width, height)) / _FILM_DIAGONAL_MM
    gray = upright_photo.convert("L")
    return RawPhoto(name, target, width, height, focal or None, sharpness(gray), alpha)


def sharpness(gray: Image.Image) -> float:
    """Variance of the Laplacian of the photo, shrunk to 640 pixels, over the variance of its gray values."""
    scale = min(1.0, _SHARPNESS_SIDE_PIXELS / max(gray.size))
    size = max(1, round(gray.width * scale)), max(1, round(gray.height * scale))
    return _sharpness(np.asarray(gray.resize(size, Image.Resampling.BOX), dtype=np.float32))


def extract_video_frames(
    video: Path, count: int, folder: Path, on_progress: Callable[[float, str], None] | None = None
) -> list[Path]:
    """Paths of about `count` frames of a video, written upright to `folder`: the sharpest of each even
    stretch.

    Raises DatasetError where the video cannot be read, or is shorter than `count` frames.
    """
    if count < 3:
        raise DatasetError(f"frames must be at least 3, got {count}")
    values = []
    for values_so_far, frame in enumerate(_small_frames(video), start=1):
        values.append(_sharpness(frame.astype(np.float32)))
        if on_progress is not None and values_so_far % 30 == 0:
            on_progress(0.0, f"{values_so_far} frames of the video read")
    if len(values) < 3:
        raise DatasetError(f"{video}: holds {len(values)} frames that can be read; give a longer video")
    chosen = sharpest_frames(np.array(values), count)
    folder.mkdir(parents=True, exist_ok=True)
    wanted = "+".join(f"eq(n\\,{index})" for index in chosen)
    _run_ffmpeg(
        video,
        ["-vf", f"select={wanted}", "-fps_mode", "passthrough", "-q:v", "1", "-qmin", "1"],
        folder / "frame_%04d.jpg",
    )
    frames = sorted(folder.glob("frame_*.jpg"))
    if len(frames) < 3:
        raise DatasetError(f"{video}: its frames cannot be read; convert it to MP4")
    return frames


def sharpest_frames(values: npt.NDArray[np.float64], count: int) -> list[int]:
    """Indices of the sharpest frame of each of `count` even stretches; `values` are the frames' sharpness.

    Only the middle of each stretch counts, so that neighbors stay apart.
    """
    count = min(count, len(values))
    edges = np.linspace(0, len(values), count + 1)
    chosen = []
    for start, end in itertools.pairwise(edges):
        margin = 0.5 * (1.0 - _STRETCH_MIDDLE_SHARE) * (end - start)
        first = min(int(np.ceil(start + margin)), int(np.ceil(end)) - 1)
        last = max(int(np.ceil(end - margin)), first + 1)
        chosen.append(first + int(np.argmax(values[first:last])))
    return chosen


def _small_frames(video: Path, width: int = 320, height: int = 240) -> Iterator[npt.NDArray[np.uint8]]:
    """All frames of a video in gray [height,width], stretched to that size."""
    command = [
        *_ffmpeg(video), "-vf", f"scale={width}:{height}", "-pix_fmt", "gray", "-fps_mode", "passthrough",
        "-f", "rawvideo", "-",
    ]  # fmt: skip
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as process:
        try:
            assert process.stdout is not None
            while len(data := process.stdout.read(width * height)) == width * height:
                yield np.frombuffer(data, dtype=np.uint8).reshape(height, width)
        finally:
            process.kill()


def _ffmpeg(video: Path) -> list[str]:
    import imageio_ffmpeg

    return [imageio_ffmpeg.get_ffmpeg_exe(), "-v", "error", "-nostdin", "-y", "-i", str(video)]


def _run_ffmpeg(video: Path, options: list[str], target: Path) -> None:
    done = subprocess.run([*_ffmpeg(video), *options, str(target)], capture_output=True, text=True)
    if done.returncode:
        lines = done.stderr.strip().splitlines() or ["ffmpeg failed"]
        raise DatasetError(f"{video}: its frames cannot be read ({lines[-1]}); convert it to MP4")


def _sharpness(gray: npt.NDArray[np.float32]) -> float:
    return float(laplace(gray).var() / (gray.var() + 1.0))
