"""Image formats beside Pillow's own: HEIF (HEIC) through pi-heif, AVIF through Pillow, OpenEXR.

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

_BRAND_BOX_BYTES = 1 << 10  # of the box of brands that are looked at
_ORIENTATION_TAG = 0x0112


def media_brands(start: bytes) -> tuple[bytes, ...]:
    """Major and compatible brands of an ISO media file that begins with these bytes; none of other files."""
    if len(start) < 16 or start[4:8] != b"ftyp":
        return ()
    size = min(struct.unpack_from(">I", start)[0], len(start))
    return (start[8:12], *(start[i : i + 4] for i in range(16, size - 3, 4)))


def open_decoder(file: BinaryIO) -> Image.Image:
    """Image of an open file, of which the header is read.

    Raises DatasetError where a decoder is not installed, and the errors of Pillow and its decoders.
    """
    start = file.read(_BRAND_BOX_BYTES)
    file.seek(0)
    if start[:4] == EXR_MAGIC:
        from cagefield.images.exr import ExrImage

        return ExrImage(file, file.name)
    brands = media_brands(start)
    if any(brand in AVIF_BRANDS for brand in brands):
        return _open_avif(file)
    if any(brand in HEIF_BRANDS for brand in brands):
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


def needs_rotation(image: Image.Image) -> bool:
    """Whether EXIF's orientation stands for a rotation that belongs to the pixels, and is not applied yet."""
    return image.format == "AVIF" and image.getexif().get(_ORIENTATION_TAG, 1) != 1


def apply_rotation(image: Image.Image) -> Image.Image:
    """Image with its format's own rotation applied."""
    turned = ImageOps.exif_transpose(image)
    turned.format = image.format
    return turned
