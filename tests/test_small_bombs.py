"""Small files that ask for much memory, and JSON that no reader expects: refused before it is allocated."""

from __future__ import annotations

import io
import json
import struct
import zlib
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from cagefield.cameras.camera_paths import load_camera_path
from cagefield.cameras.keyframe_files import load_keys
from cagefield.datasets import load_dataset
from cagefield.datasets.photos import read_photo
from cagefield.edits import EditStack, parse_edits
from cagefield.edits.device.edit_lattice import nodes_of
from cagefield.errors import CagefieldError, DatasetError, EditError, EditFileError, FieldError
from cagefield.fields.field_files import write_tensors
from cagefield.fields.nerf_file import load_nerf
from cagefield.fields.voxel_field import VoxelField
from cagefield.files import json_text, memory
from cagefield.images import image_files
from cagefield.images.image_files import read_image
from cagefield.scene.scene_files import is_scene, read_cameras
from cagefield.server.editor.document import Document
from cagefield.server.editor.session import Session


def grid(folder: Path, side: int, stored: int) -> Path:
    """A field file with a grid of `side` vertices an axis, `stored` of them."""
    tensors = {
        "bounds": np.array([[-1.0] * 3, [1.0] * 3]),
        "resolution": np.full(3, side, np.int64),
        "vertices": np.arange(stored, dtype=np.int64),
        "density": np.ones(stored, np.float32),
        "sh": np.zeros((stored, 1, 3), np.float32),
    }
    header = {"kind": "VoxelField", "version": "1", "contracted": "0"}
    write_tensors(folder / "field.safetensors", tensors, header)
    return folder / "field.safetensors"


def test_a_grid_that_holds_next_to_nothing_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FieldError, match=r"2048 x 2048 x 2048 would take 34\.4 GB for 10 stored vertices"):
        VoxelField.load(grid(tmp_path, 2048, 10))
    assert VoxelField.load(grid(tmp_path, 512, 10)).resolution == (512,) * 3
    assert VoxelField.load(grid(tmp_path, 640, 300_000)).resolution == (640,) * 3


def test_a_picture_is_not_asked_for_more_than_its_file_holds(tmp_path: Path) -> None:
    """A chunk that claims 4 GB: pillow asks for them, and Python fetches memory before it reads.

    A petabyte is a MemoryError on every machine.
    """
    content = bytearray(_png(16, 12))
    at = content.index(b"IDAT") - 4
    content[at : at + 4] = struct.pack(">I", 0xFFFF0017)
    (tmp_path / "a.png").write_bytes(content)
    with image_files.opened_picture(tmp_path / "a.png") as picture:
        file = picture.fp
        file.seek(0)
        assert file.read(1 << 50) == bytes(content) and file.read(1 << 50) == b""
        assert file.read(10) == b"" and file.seek(8) == 8 and file.read() == bytes(content[8:])


def _png(width: int, height: int) -> bytes:
    """A grey picture of zeros, a thousandth of its size."""

    def chunk(kind: bytes, content: bytes) -> bytes:
        code = struct.pack(">I", zlib.crc32(kind + content))
        return struct.pack(">I", len(content)) + kind + content + code

    row, packed = bytes(width + 1), zlib.compressobj(9)
    content = b"".join(packed.compress(row) for _ in range(height)) + packed.flush()
    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", content) + chunk(b"IEND", b"")


def _tiff(strips: int, tag: tuple[int, int], big: bool = False) -> bytes:
    """A grey picture of 64 x `strips` pixels, a strip for each line, with a further tag (type, count)."""
    kind, count = tag
    form, start = ("<HHQQ", b"II+\0\x08\0\0\0") if big else ("<HHLL", b"II*\0")
    head, tags = (16, 20) if big else (8, 12)
    pixels = head + (8 if big else 2) + 9 * tags + (8 if big else 4)
    offsets = pixels + 64 * strips
    entries = [
        (256, 3, 1, 64), (257, 3, 1, strips), (258, 3, 1, 8), (259, 3, 1, 1), (262, 3, 1, 1),
        (273, 4, strips, offsets if strips > 1 else pixels), (278, 3, 1, 1),
        (279, 4, strips, offsets + 4 * strips if strips > 1 else 64), (60_000, kind, count, head),
    ]  # fmt: skip
    content = start + struct.pack("<Q" if big else "<L", head) + struct.pack("<Q" if big else "<H", 9)
    content += b"".join(struct.pack(form, *entry) for entry in entries) + bytes(8 if big else 4)
    content += bytes(64 * strips)
    content += struct.pack(f"<{strips}L", *(pixels + 64 * n for n in range(strips)))
    return content + struct.pack(f"<{strips}L", *[64] * strips)


@pytest.mark.parametrize("big", [False, True])
def test_a_tiff_whose_tags_are_long_is_refused_before_they_are_read(tmp_path: Path, big: bool) -> None:
    """Of each number pillow makes one of Python's: a picture of 6 MB took 75."""
    file = tmp_path / "a.tif"
    for good in (_tiff(1, (3, 1), big), _tiff(2000, (4, 20_000), big)):
        file.write_bytes(good)
        assert read_image(file).shape[1:] == (64, 3)
    for bad, count in (((4, 270_000), 270_000), ((5, 34_000), 272_000)):
        file.write_bytes(_tiff(5000, bad, big) + bytes(1_000_000))
        with pytest.raises(DatasetError, match=f"its tags hold {count + 10_006} numbers"):
            read_image(file)


def _jpeg(width: int, height: int, **options: object) -> bytes:
    """Noise, and something behind the end, as some cameras leave it."""
    pixels = np.random.default_rng(0).integers(0, 256, (height, width, 3)).astype(np.uint8)
    out = io.BytesIO()
    Image.fromarray(pixels).save(out, "JPEG", **options)
    return out.getvalue() + b"\xff\xd8\xff\xd9 more"


@pytest.mark.parametrize("size", [(1, 1), (17, 9), (160, 121)])
def test_jpegs_are_read_to_the_last_pixel(
    tmp_path: Path, size: tuple[int, int], capfd: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "a.jpg"
    for quality, subsampling, restarts, progressive in product((5, 95), (0, 2), (0, 1), (False, True)):
        options = {"subsampling": subsampling, "restart_marker_blocks": restarts, "progressive": progressive}
        file.write_bytes(_jpeg(*size, quality=quality, **options))
        with Image.open(file) as expected:
            np.testing.assert_array_equal(read_image(file), np.asarray(expected))
        assert read_photo(file).shape == (*size[::-1], 3)
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize("restarts", [0, 1])
def test_a_jpeg_that_lacks_pixels_is_refused(tmp_path: Path, restarts: int) -> None:
    """They were made up: 200 kB became 39 million pixels."""
    content, file = bytearray(_jpeg(300, 200, restart_marker_blocks=restarts)), tmp_path / "a.jpg"
    at = content.index(b"\xff\xc0") + 5
    for side in (at, at + 2):
        damaged = content.copy()
        damaged[side : side + 2] = struct.pack(">H", 65_500)
        file.write_bytes(damaged)
        for read in (read_image, read_photo):
            with pytest.raises(DatasetError, match="image file is truncated"):
                read(file)


@pytest.mark.filterwarnings("ignore:Image size")  # pillow's own
def test_a_picture_of_too_many_pixels_is_refused_by_its_header(tmp_path: Path) -> None:
    file = tmp_path / "a.png"
    file.write_bytes(_png(13_000, 13_000))
    assert file.stat().st_size < 1_000_000
    with pytest.raises(DatasetError, match="13000 x 13000 pixels, at most 100 million are read; shrink it"):
        read_image(file)
    file.write_bytes(_png(30, 20))
    assert read_image(file).shape == (20, 30, 3)


def lattices(*resolutions: int) -> str:
    """An edit file of continuous edits with these lattices."""
    edit = {"inner": {"center": [0, 0, 0], "size": 1}, "outer": {"margin": 0.5}}
    return json.dumps({"edits": [edit | {"lattice": resolution} for resolution in resolutions]})


def test_lattices_have_a_limit_together() -> None:
    with pytest.raises(EditFileError, match="403 million nodes together, at most 134 million are kept"):
        parse_edits(lattices(512, 512, 512), format="json")
    with pytest.warns(UserWarning, match="lattices above 64 are made 64"):
        mended = parse_edits(lattices(512, 512, 32), format="json", mend=True)
    assert [edit.lattice for edit in mended] == [64, 64, 32]
    one = parse_edits(lattices(512), format="json")
    with pytest.raises(EditError, match="million nodes together"):
        EditStack([*one, *one]).check()
    two = [*one, one[0].replace(lattice=None)]
    session = Session(Document.of(two), np.array([[-1.0] * 3, [1.0] * 3]), 0.1)
    for attempt in (lambda: session.change(2, lattice=512), lambda: session.duplicate(1)):
        with pytest.raises(EditError, match="million nodes together"):
            attempt()
    assert len(session.document.entries) == 2


def test_layers_with_astronomic_numbers_are_refused(tmp_path: Path) -> None:
    header = {"kind": "NerfField", "version": "1", "options": json.dumps({"rectified_feature": [True]})}
    weights = {"coarse.trunk.999999999999.weight": np.zeros((4, 4), np.float32)}
    write_tensors(tmp_path / "a.safetensors", weights, header)
    with pytest.raises(FieldError, match=r"coarse\.trunk\.999999999999 is beyond its 1 tensors"):
        load_nerf(tmp_path / "a.safetensors")


def test_checkpoints_that_claim_more_than_they_hold_are_refused(tmp_path: Path) -> None:
    torch = pytest.importorskip("torch")
    from cagefield.formats.nerf.nerf_pytorch import read_checkpoint

    file = tmp_path / "a.tar"
    wide = torch.zeros(1).expand(32_768, 32_768)
    torch.save({"network_fn_state_dict": {"pts_linears.0.weight": wide}}, file)
    assert file.stat().st_size < 10_000
    with pytest.raises(FieldError, match="its tensors say that they hold 4294967296 bytes or more"):
        read_checkpoint(file)
    state = {"layers_xyz.999999999999.weight": torch.zeros(4, 4), "layer1.weight": torch.zeros(4, 4)}
    torch.save({"model_coarse_state_dict": state}, file)
    with pytest.raises(FieldError, match="999999999999 is beyond its"):
        read_checkpoint(file)


TEXTS = {
    "deep": "[" * 500 + "]" * 500,
    "very deep": "[" * 200_000,
    "deep objects": '{"a":' * 500 + "1" + "}" * 500,
    "long number": "9" * 5_000,
    "number of 400 digits": "9" * 400,
    "infinite": "1e999",
}


@pytest.mark.parametrize("where", ["alone", "inside"])
@pytest.mark.parametrize("text", TEXTS.values(), ids=TEXTS.keys())
def test_every_reader_of_json_refuses_in_a_line(tmp_path: Path, text: str, where: str) -> None:
    keys = ("train", "camera_path", "keyframes", "frames", "fps", "camera_angle_x", "render_width", "format")
    whole = text if where == "alone" else "{" + ",".join(f'"{key}": {text}' for key in keys) + "}"
    with pytest.raises(ValueError):
        json_text.loads(whole)
    for name in ("cameras.json", "path.json", "scene.json"):
        (tmp_path / name).write_text(whole)
    (tmp_path / "photos").mkdir()
    (tmp_path / "photos" / "transforms.json").write_text(whole)
    for read in (
        lambda: read_cameras(tmp_path / "cameras.json"),
        lambda: load_camera_path(tmp_path / "path.json"),
        lambda: load_keys(tmp_path / "path.json"),
        lambda: load_dataset(tmp_path / "photos"),
    ):
        with pytest.raises(CagefieldError) as caught:
            read()
        assert len(str(caught.value)) < 600
    assert not is_scene(tmp_path)


def test_json_that_is_honest_is_read() -> None:
    assert json_text.loads('{"a": [1, -2.5, 1e300, "x", null, true]}') == {
        "a": [1, -2.5, 1e300, "x", None, True]
    }


def test_a_lattice_that_would_take_most_of_the_memory_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    free = memory.free_memory()
    assert free is None or free > 1 << 20
    monkeypatch.setattr(memory, "free_memory", lambda: 3 * 10**9)
    (edit,) = parse_edits(
        '{"edits": [{"inner": {"center": [0, 0, 0], "size": 1}, "outer": {"margin": 0.5}, "lattice": 512,'
        ' "operations": [{"translate": [0.1, 0, 0]}]}]}',
        format="json",
    )
    with pytest.raises(EditError, match=r"512 nodes per axis takes 4\.3 GB, of the 3\.0 GB that are free"):
        nodes_of(edit)
    assert len(nodes_of(edit.replace(lattice=8))) == 512
