"""Photos of other formats, depths and colors, against values written out by hand."""

from __future__ import annotations

import json
import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from cagefield.datasets import load_dataset
from cagefield.datasets.photos import find_photo, read_header, read_photo, report_conversions
from cagefield.datasets.raw_photos import find_raw_photos, write_upright
from cagefield.errors import DatasetError
from cagefield.images.image_files import read_image
from heic_photos import BLUE, HEIC, RED, TURNED_HEIC, WHITE
from icc_profiles import DISPLAY_P3, SRGB, matrix_profile
from posed_photos import ring

ALPHA = 4


def deep_png(path: Path, values: np.ndarray) -> None:
    """A PNG of 16 bits a channel; values uint16 [H,W] or [H,W,C]."""

    def chunk(name: bytes, content: bytes) -> bytes:
        return (
            struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))
        )

    height, width = values.shape[:2]
    kind = {1: 0, 2: 4, 3: 2, 4: 6}[1 if values.ndim == 2 else values.shape[2]]
    rows = b"".join(b"\0" + row.astype(">u2").tobytes() for row in values)
    head = struct.pack(">IIBBBBB", width, height, 16, kind, 0, 0, 0)
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")
    )  # fmt: skip


def transfer(linear: float) -> float:
    """The sRGB transfer function, IEC 61966-2-1."""
    return 12.92 * linear if linear <= 0.0031308 else 1.055 * linear ** (1 / 2.4) - 0.055


# ---- HEIC and AVIF ----


def test_heic_photos_have_their_colors(tmp_path):
    (tmp_path / "a.heic").write_bytes(HEIC)
    for pixels in (read_photo(tmp_path / "a.heic"), read_image(tmp_path / "a.heic")):
        assert pixels.shape == (48, 64, 3)
        for (y, x), color in (((4, 4), WHITE), ((40, 4), RED), ((40, 60), BLUE)):
            np.testing.assert_allclose(pixels[y, x], color, atol=4)  # HEVC of quality 60
    header = read_header(tmp_path / "a.heic")
    assert (header.width, header.height, header.alpha, header.conversion) == (64, 48, False, None)


def test_the_rotation_of_a_heic_file_belongs_to_its_pixels(tmp_path):
    (tmp_path / "a.HEIC").write_bytes(TURNED_HEIC)
    header = read_header(tmp_path / "a.HEIC")
    assert (header.width, header.height) == (48, 64)
    pixels = read_photo(tmp_path / "a.HEIC")
    np.testing.assert_allclose(pixels[4, 44], WHITE, atol=4)  # upper right
    np.testing.assert_allclose(pixels[4, 4], RED, atol=4)
    np.testing.assert_allclose(pixels[60, 24], BLUE, atol=4)
    photo = write_upright(tmp_path / "a.HEIC", "a.HEIC", tmp_path / "out")  # not turned twice
    assert (photo.width, photo.height, photo.name) == (48, 64, "a.HEIC.jpg")
    with Image.open(photo.path) as image:
        assert image.format == "JPEG"
        np.testing.assert_allclose(np.asarray(image)[4, 44], WHITE, atol=6)


@pytest.mark.parametrize("orientation", [1, 3, 6, 8])
def test_avif_photos_are_turned_as_their_file_says(tmp_path, orientation):
    """Pillow writes the orientation as `irot` and `imir`, which belong to the pixels."""
    pixels = np.zeros((48, 64, 3), np.uint8)
    pixels[:16, :16], pixels[32:, 48:] = 255, (0, 0, 250)
    exif = Image.Exif()
    exif[0x0112] = orientation
    Image.fromarray(pixels).save(tmp_path / "a.avif", quality=90, subsampling="4:4:4", exif=exif)
    turns = {1: 0, 3: 2, 6: 3, 8: 1}[orientation]  # quarters anticlockwise
    expected = np.rot90(pixels, turns)
    header = read_header(tmp_path / "a.avif")
    assert (header.height, header.width) == expected.shape[:2]
    found = read_photo(tmp_path / "a.avif")
    np.testing.assert_allclose(found[4::8, 4::8], expected[4::8, 4::8], atol=40)
    photo = write_upright(tmp_path / "a.avif", "a.avif", tmp_path / "out")
    np.testing.assert_allclose(read_photo(photo.path)[4::8, 4::8], expected[4::8, 4::8], atol=40)


def test_the_content_decides_about_the_format(tmp_path):
    (tmp_path / "a.jpg").write_bytes(HEIC)
    assert read_photo(tmp_path / "a.jpg").shape == (48, 64, 3)
    photo = write_upright(tmp_path / "a.jpg", "a.jpg", tmp_path / "out")
    with Image.open(photo.path) as image:
        assert image.format == "JPEG"


def test_heic_files_are_found_without_their_extension(tmp_path):
    (tmp_path / "IMG_1.HEIC").write_bytes(HEIC)
    assert find_photo(tmp_path / "IMG_1") == tmp_path / "IMG_1.HEIC"
    assert find_raw_photos(tmp_path) == [tmp_path / "IMG_1.HEIC"]


def test_heic_files_that_claim_a_huge_size_are_refused(tmp_path):
    lying = HEIC.replace(
        b"ispe" + struct.pack(">III", 0, 64, 64), b"ispe" + struct.pack(">III", 0, 30000, 30000)
    )
    assert lying != HEIC
    # The crop of the picture would say 64 x 48; without it the size counts.
    lying = lying.replace(b"clap", b"free")
    (tmp_path / "a.heic").write_bytes(lying)
    with pytest.raises(DatasetError, match=r"a\.heic: not a readable image \(30000 x 30000 pixels"):
        read_header(tmp_path / "a.heic")


def test_damaged_heic_files_are_one_line(tmp_path):
    for cut in (20, 200, 420, 500):
        (tmp_path / "a.heic").write_bytes(HEIC[:cut])
        with pytest.raises(DatasetError, match=r"a\.heic: ") as caught:
            read_photo(tmp_path / "a.heic")
        assert "\n" not in str(caught.value)


def test_without_pi_heif_the_cure_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pi_heif", None)
    (tmp_path / "a.heic").write_bytes(HEIC)
    message = r"a\.heic: HEIC photos are read by pi-heif; pip install pi-heif, or convert it to JPEG$"
    for read in (
        read_header,
        read_photo,
        read_image,
        lambda path: write_upright(path, "a", tmp_path / "out"),
    ):
        with pytest.raises(DatasetError, match=message):
            read(tmp_path / "a.heic")


# ---- 16 bits, floats, EXR ----


@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_16_bit_png_are_scaled_by_their_range_not_by_their_maximum(tmp_path, channels):
    values = np.array([[0, 1285, 12850, 25700]], np.uint16)  # 257 times 0, 5, 50, 100: no white in it
    stacked = values if channels == 1 else np.stack([values] * channels, axis=-1)
    deep_png(tmp_path / "a.png", stacked)
    found = read_photo(tmp_path / "a.png")
    assert found.shape[2] == (4 if channels in (2, 4) else 3)
    np.testing.assert_array_equal(found[0, :, 0], [0, 5, 50, 100])
    np.testing.assert_array_equal(read_image(tmp_path / "a.png"), found)
    assert read_header(tmp_path / "a.png").conversion == "of 16 bits a channel, converted to 8"


@pytest.mark.parametrize("compression", [None, "tiff_lzw"])
def test_16_bit_tiff(tmp_path, compression):
    Image.fromarray(np.array([[0, 257 * 7, 65535]], np.uint16)).save(
        tmp_path / "a.tif", compression=compression
    )
    np.testing.assert_array_equal(read_photo(tmp_path / "a.tif")[0, :, 1], [0, 7, 255])
    assert "16 bits" in str(read_header(tmp_path / "a.tif").conversion)


def test_float_tiff_is_linear_light(tmp_path):
    values = np.array([[0.0, 0.002, 0.18, 1.0, 7.0, -1.0, np.nan, np.inf]], np.float32)
    Image.fromarray(values).save(tmp_path / "a.tif")
    expected = [round(255 * transfer(v)) for v in (0.0, 0.002, 0.18, 1.0, 1.0, 0.0, 0.0, 1.0)]
    np.testing.assert_array_equal(read_photo(tmp_path / "a.tif")[0, :, 2], expected)
    assert expected[2] == 118  # 18 % gray
    assert "linear light" in str(read_header(tmp_path / "a.tif").conversion)


def write_exr(path: Path, channels: dict[str, np.ndarray], **header: object) -> None:
    OpenEXR = pytest.importorskip("OpenEXR", reason="OpenEXR is not installed")
    said = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **header}
    OpenEXR.File(said, channels).write(str(path))


def test_exr_photos_are_encoded_and_their_alpha_is_straight(tmp_path):
    light = np.array([[0.0, 0.002, 0.18, 1.0, 3.0]], np.float32)
    alpha = np.array([[1.0, 1.0, 0.5, 0.25, 0.0]], np.float32)
    write_exr(tmp_path / "a.exr", {"R": light * alpha, "G": light * alpha, "B": 0 * light, "A": alpha})
    found = read_photo(tmp_path / "a.exr")
    assert found.shape == (1, 5, 4) and read_header(tmp_path / "a.exr").alpha
    expected = [round(255 * transfer(v)) for v in (0.0, 0.002, 0.18, 1.0, 0.0)]  # nothing where alpha is 0
    np.testing.assert_array_equal(found[0, :, 0], expected)
    np.testing.assert_array_equal(found[0, :, 2], 0)
    np.testing.assert_array_equal(found[0, :, ALPHA - 1], [255, 255, 128, 64, 0])


def test_exr_halves_gray_layers_and_windows(tmp_path):
    light = np.full((2, 3), 0.18, np.float16)
    write_exr(tmp_path / "gray.exr", {"Y": light})
    np.testing.assert_array_equal(read_photo(tmp_path / "gray.exr"), np.full((2, 3, 3), 118))
    layers = {f"beauty.{c}": light for c in "RGB"} | {"depth.Z": light.astype(np.float32)}
    write_exr(tmp_path / "layers.exr", layers)
    np.testing.assert_array_equal(read_photo(tmp_path / "layers.exr"), np.full((2, 3, 3), 118))
    corners = (np.array([-1, -1], np.int32), np.array([4, 2], np.int32))
    write_exr(tmp_path / "window.exr", dict.fromkeys("RGB", light), displayWindow=corners)
    found = read_photo(tmp_path / "window.exr")
    assert found.shape == (4, 6, 3)
    np.testing.assert_array_equal(found[1:3, 1:4], 118)
    assert found.sum() == 118 * 2 * 3 * 3


def test_exr_without_colors_and_of_huge_sizes(tmp_path):
    write_exr(tmp_path / "z.exr", {"Z": np.ones((2, 2), np.float32)})
    with pytest.raises(DatasetError, match=r"no channels R, G, B or Y, only Z"):
        read_header(tmp_path / "z.exr")
    corners = (np.array([0, 0], np.int32), np.array([40000, 40000], np.int32))
    write_exr(tmp_path / "huge.exr", {c: np.ones((2, 2), np.float32) for c in "RGB"}, displayWindow=corners)
    with pytest.raises(DatasetError, match=r"40001 x 40001 pixels, at most 100 million are read"):
        read_header(tmp_path / "huge.exr")


def test_damaged_exr_files_are_one_line_and_nothing_else(tmp_path, capfd):
    noise = np.random.default_rng(0).random((64, 64)).astype(np.float32)
    write_exr(tmp_path / "a.exr", dict.fromkeys("RGB", noise))
    content = (tmp_path / "a.exr").read_bytes()
    for damaged in (content[:100], content[: len(content) // 2], content[:9000] + bytes(50) + content[9050:]):
        (tmp_path / "a.exr").write_bytes(damaged)
        with pytest.raises(DatasetError, match=r"a\.exr: ") as caught:
            read_photo(tmp_path / "a.exr")
        assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")


def test_without_openexr_the_cure_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "OpenEXR", None)
    (tmp_path / "a.exr").write_bytes(b"\x76\x2f\x31\x01" + bytes(100))
    with pytest.raises(
        DatasetError, match=r"a\.exr: EXR photos need OpenEXR; pip install 'cagefield\[exr\]'"
    ):
        read_header(tmp_path / "a.exr")


# ---- color profiles ----


def p3_to_srgb(color: tuple[int, int, int]) -> list[float]:
    """8-bit sRGB of 8-bit Display P3 by the matrices of both, written out."""
    c = np.array(color) / 255
    linear = np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)
    matrix = [[1.22494, -0.22494, 0.0], [-0.04206, 1.04206, 0.0], [-0.01964, -0.07864, 1.09828]]
    return [255 * transfer(v) for v in np.clip(np.array(matrix) @ linear, 0, 1)]


@pytest.mark.parametrize("name", ["a.png", "a.jpg", "a.tif", "a.webp"])
def test_display_p3_becomes_srgb(tmp_path, name):
    color = (200, 90, 70)
    profile = matrix_profile("Display P3", DISPLAY_P3)
    options = {"lossless": True} if name == "a.webp" else {"quality": 100, "subsampling": 0}
    Image.new("RGB", (16, 16), color).save(tmp_path / name, icc_profile=profile, **options)
    np.testing.assert_allclose(read_photo(tmp_path / name)[8, 8], p3_to_srgb(color), atol=2)
    np.testing.assert_allclose(read_image(tmp_path / name)[8, 8], p3_to_srgb(color), atol=2)
    conversion = read_header(tmp_path / name).conversion
    assert conversion == "with the color profile Display P3, converted to sRGB"
    photo = write_upright(tmp_path / name, name, tmp_path / "out")
    with Image.open(photo.path) as image:
        assert "icc_profile" not in image.info
        np.testing.assert_allclose(np.asarray(image)[8, 8], p3_to_srgb(color), atol=3)


def test_alpha_stays_where_colors_are_converted(tmp_path):
    Image.new("RGBA", (4, 4), (200, 90, 70, 128)).save(
        tmp_path / "a.png", icc_profile=matrix_profile("Display P3", DISPLAY_P3)
    )
    found = read_photo(tmp_path / "a.png")[0, 0]
    np.testing.assert_allclose(found[:3], p3_to_srgb((200, 90, 70)), atol=2)
    assert found[3] == 128


@pytest.mark.parametrize("profile", [matrix_profile("sRGB by another name", SRGB), b"no profile", bytes(128)])
def test_srgb_and_broken_profiles_change_nothing(tmp_path, profile):
    pixels = np.arange(48, dtype=np.uint8).reshape(4, 4, 3) * 5
    Image.fromarray(pixels).save(tmp_path / "a.png", icc_profile=profile)
    np.testing.assert_array_equal(read_photo(tmp_path / "a.png"), pixels)
    assert read_header(tmp_path / "a.png").conversion is None


def test_a_profile_of_another_kind_of_color_changes_nothing(tmp_path):
    Image.new("L", (4, 4), 77).save(tmp_path / "a.png", icc_profile=matrix_profile("P3", DISPLAY_P3))
    np.testing.assert_array_equal(read_photo(tmp_path / "a.png"), np.full((4, 4, 3), 77))


# ---- what is said ----


def test_conversions_are_said_once_for_all_photos(tmp_path):
    profile = matrix_profile("Display P3", DISPLAY_P3)
    for n in range(3):
        deep_png(tmp_path / f"{n}.png", np.full((4, 4, 3), 257 * 9, np.uint16))
    Image.new("RGB", (4, 4)).save(tmp_path / "3.png", icc_profile=profile)
    Image.new("RGB", (4, 4)).save(tmp_path / "4.png")
    with pytest.warns(UserWarning) as said:
        report_conversions(tmp_path, sorted(tmp_path.glob("*.png")) * 2)
    assert [str(w.message) for w in said] == [
        f"{tmp_path}: 3 photos of 16 bits a channel, converted to 8",
        f"{tmp_path}: 1 photo with the color profile Display P3, converted to sRGB",
    ]


def test_a_capture_of_16_bit_photos_is_loaded(tmp_path):
    pixels = np.random.default_rng(0).integers(0, 256, (4, 12, 16, 3))
    poses = ring(4)
    for n in range(4):
        deep_png(tmp_path / f"{n}.png", pixels[n].astype(np.uint16) * 257)
    frames = [{"file_path": f"{n}.png", "transform_matrix": poses[n].tolist()} for n in range(4)]
    (tmp_path / "transforms.json").write_text(json.dumps({"fl_x": 20.0, "frames": frames}))
    with pytest.warns(UserWarning, match=r": 4 photos of 16 bits a channel, converted to 8$"):
        dataset = load_dataset(tmp_path)
    np.testing.assert_array_equal(dataset.train[0].load(), pixels[1])  # the first tests
