"""Picture formats beside Pillow's own: HEIF (HEIC) through pi-heif, AVIF through Pillow, OpenEXR.

The first bytes of a file decide. The rotation and mirroring of a HEIF or AVIF file (`irot`, `imir`) are part
of its pixels (ISO/IEC 23008-12, 6.5.10 and 6.5.12): they are always applied, and EXIF's copy of them is not.
"""

from __future__ import annotations

import struct
from typing import BinaryIO

from PIL import Image, ImageOps, UnidentifiedImageError

from cagefield.errors import DatasetError

HEIF_BRANDS = (b"heic", b"heix", b"heim", b"heis", b"hevc", b"hevx", b"hevm", b"hevs", b"mif1", b"msf1")
AVIF_BRANDS = (b"avif", b"avis")

EFFICIENT_FORMATS = ("HEIF", "AVIF")
"""Formats by Pillow's names whose flat areas take next to no bytes."""

EXR_MAGIC = b"\x76\x2f\x31\x01"

_FTYP_BYTES = 1 << 10  # of the box of brands that are looked at
_ORIENTATION = 0x0112


def brands(start: bytes) -> tuple[bytes, ...]:
    """The major and compatible brands of an ISO media file that begins with these bytes; none of others."""
    if len(start) < 16 or start[4:8] != b"ftyp":
        return ()
    size = min(struct.unpack_from(">I", start)[0], len(start))
    return (start[8:12], *(start[i : i + 4] for i in range(16, size - 3, 4)))


def open_picture(file: BinaryIO) -> Image.Image:
    """The picture in an open file, of which the header is read.

    Raises DatasetError where a decoder is not installed, and what Pillow and its decoders raise.
    """
    start = file.read(_FTYP_BYTES)
    file.seek(0)
    if start[:4] == EXR_MAGIC:
        from cagefield.images.exr import ExrPicture

        return ExrPicture(file, file.name)
    found = brands(start)
    if any(brand in AVIF_BRANDS for brand in found):
        return _open_avif(file)
    if any(brand in HEIF_BRANDS for brand in found):
        return _open_heif(file)
    try:
        return Image.open(file)
    except UnidentifiedImageError:  # Pillow's message shows the open file, not its name
        raise UnidentifiedImageError("no picture of a format that Pillow reads") from None


def _open_avif(file: BinaryIO) -> Image.Image:
    from PIL import AvifImagePlugin, features

    if not features.check("avif"):
        raise DatasetError(
            f"{file.name}: this Pillow reads no AVIF; pip install -U pillow, or convert the photo to JPEG"
        )
    return AvifImagePlugin.AvifImageFile(file, file.name)


def _open_heif(file: BinaryIO) -> Image.Image:
    try:
        import pi_heif
        from pi_heif.as_plugin import HeifImageFile
    except ImportError:
        raise DatasetError(
            f"{file.name}: HEIC photos are read by pi-heif; pip install pi-heif, or convert it to JPEG"
        ) from None
    options = pi_heif.options
    options.THUMBNAILS = options.DEPTH_IMAGES = options.AUX_IMAGES = False
    picture: Image.Image = HeifImageFile(file, file.name)
    return picture


def orientation_is_pixels(image: Image.Image) -> bool:
    """Whether EXIF's orientation stands for a rotation that belongs to the pixels, and is not applied yet."""
    return image.format == "AVIF" and image.getexif().get(_ORIENTATION, 1) != 1


def turned_as_stored(image: Image.Image) -> Image.Image:
    """A picture with its format's own rotation applied."""
    turned = ImageOps.exif_transpose(image)
    turned.format = image.format
    return turned
