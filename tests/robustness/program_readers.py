"""Capture programs' folders, and photos of formats that other libraries decode: honest seeds."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from pathlib import Path

import numpy as np
from PIL import Image
from reader_seeds import Reader

import program_folders as write
from cagefield.datasets import load_dataset
from cagefield.datasets.photos import read_photo
from cagefield.datasets.raw_photos import write_upright
from cagefield.images.image_files import read_image
from heic_photos import TURNED_HEIC
from icc_profiles import DISPLAY_P3, matrix_profile


def _read_capture(folder: Path) -> None:
    load_dataset(folder / "capture")


def _capture(make: Callable[[Path], None]) -> Callable[[Path], None]:
    def made(folder: Path) -> None:
        (folder / "capture").mkdir()
        make(folder / "capture")

    return made


def program_readers(count: int = 3) -> dict[str, Reader]:
    """Of captures of `count` photos."""
    shots = write.shots(count)
    plain = write.shots(count, distorted=False)
    seen = [(np.full(3, 0.1 * n), (0, count - 1)) for n in range(12)]

    def reader(make: Callable[[Path], None], name: str, kind: str) -> Reader:
        return Reader(_capture(make), _read_capture, {f"capture/{name}": kind})

    return {
        "Polycam": reader(
            lambda folder: write.polycam(folder, plain), "keyframes/corrected_cameras/10000.json", "json"
        ),
        "Record3D": reader(lambda folder: write.record3d(folder, plain, each=True), "metadata.json", "json"),
        "Metashape": reader(
            lambda folder: write.metashape(folder, shots, component=write.similarity()), "cameras.xml", "text"
        ),
        "RealityCapture": reader(lambda folder: write.reality_capture(folder, shots), "cameras.csv", "text"),
        "RealityCapture, XMP": reader(
            lambda folder: write.xmp(folder, plain, "division", "0.05 0 0 0 0 0"), "IMG_0000.xmp", "text"
        ),
        "Meshroom": reader(
            lambda folder: write.meshroom(folder, shots, points=seen, name="sfm.json"), "sfm.json", "json"
        ),
    }


def _read_photo(name: str) -> Callable[[Path], None]:
    def read(folder: Path) -> None:
        read_photo(folder / name, 2)
        read_image(folder / name)
        write_upright(folder / name, name, folder / "out")

    return read


def _make_heic(folder: Path) -> None:
    (folder / "a.heic").write_bytes(TURNED_HEIC)


def _make_avif(folder: Path) -> None:
    pixels = np.random.default_rng(0).integers(0, 256, (12, 16, 3)).astype(np.uint8)
    exif = Image.Exif()
    exif[0x0112] = 6
    profile = matrix_profile("Display P3", DISPLAY_P3)
    Image.fromarray(pixels).save(folder / "a.avif", exif=exif, icc_profile=profile)


def _make_profiled(folder: Path) -> None:
    pixels = np.random.default_rng(0).integers(0, 256, (12, 16, 3)).astype(np.uint8)
    profile = matrix_profile("Display P3", DISPLAY_P3)
    Image.fromarray(pixels).save(folder / "a.jpg", icc_profile=profile)


def _make_deep(folder: Path) -> None:
    pixels = np.random.default_rng(0).integers(0, 65536, (12, 16)).astype(np.uint16)
    Image.fromarray(pixels).save(folder / "a.png")


def _make_float(folder: Path) -> None:
    Image.fromarray(np.random.default_rng(0).random((12, 16)).astype(np.float32)).save(folder / "a.tif")


def _make_exr(folder: Path) -> None:
    import OpenEXR

    light = np.random.default_rng(0).random((12, 16, 4)).astype(np.float16)
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {"RGBA": light}).write(str(folder / "a.exr"))


def photo_readers() -> dict[str, Reader]:
    """Of photos of other formats; EXR where its library is installed."""
    made = {
        "heic": (_make_heic, "a.heic", "bytes"),
        "avif": (_make_avif, "a.avif", "bytes"),
        "jpg with a profile": (_make_profiled, "a.jpg", "bytes"),
        "png of 16 bits": (_make_deep, "a.png", "png"),
        "tif of floats": (_make_float, "a.tif", "bytes"),
    }
    if importlib.util.find_spec("OpenEXR") is not None:
        made["exr"] = (_make_exr, "a.exr", "bytes")
    return {name: Reader(make, _read_photo(file), {file: kind}) for name, (make, file, kind) in made.items()}


PROGRAM_READERS: dict[str, Reader] = {**program_readers(), **photo_readers()}
