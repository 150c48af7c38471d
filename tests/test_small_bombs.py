"""Small files that ask for much memory, and JSON that no reader expects: refused before it is allocated."""

from __future__ import annotations

import io
import json
import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from cagefield.cameras.camera_paths import load_camera_path
from cagefield.cameras.keyframe_files import load_keys
from cagefield.datasets import load_dataset
from cagefield.datasets.photos import read_photo
from cagefield.edits import EditStack, parse_edits
from cagefield.errors import CagefieldError, DatasetError, EditError, EditFileError, FieldError
from cagefield.fields.field_files import write_tensors
from cagefield.fields.nerf_file import load_nerf
from cagefield.fields.voxel_field import VoxelField
from cagefield.files import json_text, memory
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


def _png(width: int, height: int) -> bytes:
    """A gray picture of zeros, a thousandth of its size."""

    def chunk(kind: bytes, content: bytes) -> bytes:
        code = struct.pack(">I", zlib.crc32(kind + content))
        return struct.pack(">I", len(content)) + kind + content + code

    row, packed = bytes(width + 1), zlib.compressobj(9)
    content = b"".join(packed.compress(row) for _ in range(height)) + packed.flush()
    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", content) + chunk(b"IEND", b"")


def test_a_jpeg_that_is_cut_off_is_one_line(tmp_path: Path) -> None:
    pixels = np.random.default_rng(0).integers(0, 256, (200, 300, 3)).astype(np.uint8)
    out, file = io.BytesIO(), tmp_path / "a.jpg"
    Image.fromarray(pixels).save(out, "JPEG")
    for share in (0.3, 0.9):
        file.write_bytes(out.getvalue()[: int(share * len(out.getvalue()))])
        for read in (read_image, read_photo):
            with pytest.raises(DatasetError, match=r"a\.jpg: .*image file is truncated") as refused:
                read(file)
            assert "\n" not in str(refused.value)


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
    session = Session(Document.from_edits(two), np.array([[-1.0] * 3, [1.0] * 3]), 0.1)
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
        edit.lattice_nodes  # noqa: B018
    assert len(edit.replace(lattice=8).lattice_nodes) == 512
