"""Scene folders: what is written is what is read, damage is named, and a failed write changes nothing."""

from __future__ import annotations

import dataclasses
import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from cagefield import Cage, Edit, EditStack, Scene, SplatField, VoxelRenderer, load_dataset, render_sampled
from cagefield.cameras.camera import Camera
from cagefield.errors import CagefieldError, CameraError, EditError, FieldError, SceneError
from cagefield.fields.voxel_field import VoxelField
from cagefield.procedural import make_scene
from cagefield.rendering.splats.splat_renderer import SplatRenderer
from cagefield.scene.scene_files import check_destination
from cagefield.training.evaluation import Evaluation
from cagefield.training.result import TrainResult
from scenes import ball_field, ball_scene, files_of


def test_round_trip_is_exact(tmp_path: Path) -> None:
    inner = Cage.box((0.1, 0.0, 0.0), 0.4)
    edit = Edit.continuous(inner, Cage.box((0.1, 0.0, 0.0), 1.2), name="push").translate((0.1, 0.0, 0.05))
    scene = ball_scene().with_edits(EditStack([edit, Edit.delete(Cage.box((0.4, 0.4, 0.4), 0.2))]))
    scene.save(tmp_path / "scene")
    assert {file.name for file in (tmp_path / "scene").iterdir()} == {
        "field.safetensors",
        "edits.yaml",
        "cameras.json",
        "scene.json",
    }
    again = Scene.open(tmp_path / "scene")
    assert again.edits == scene.edits
    assert again.cameras == scene.cameras
    assert (again.background, again.version) == (scene.background, scene.version)
    for name in ("bounds", "vertices", "density", "sh"):
        np.testing.assert_array_equal(getattr(again.field, name), getattr(scene.field, name))
    assert [path.name for path in tmp_path.iterdir()] == ["scene"]


def test_background_none_survives(tmp_path: Path) -> None:
    Scene(ball_field(), background=None).save(tmp_path / "scene")
    assert Scene.open(tmp_path / "scene").background is None


def test_gains_survive_saving_and_editing(tmp_path: Path) -> None:
    gains = ((0.9, 1.0, 1.1), (1.0, 1.0, 1.0), (1.1, 1.0, 0.9))
    dataclasses.replace(ball_scene(), gains=gains).save(tmp_path / "scene")
    edited = Scene.open(tmp_path / "scene").with_edits(EditStack([Edit.delete(Cage.box((0, 0, 0), 0.2))]))
    edited.save(tmp_path / "edited")
    assert Scene.open(tmp_path / "edited").gains == gains
    ball_scene().save(tmp_path / "plain")
    assert "gains" not in json.loads((tmp_path / "plain" / "scene.json").read_text())
    assert Scene.open(tmp_path / "plain").gains == ()


def test_a_trained_scene_has_the_gains_that_were_fitted(tmp_path: Path) -> None:
    dataset = load_dataset(make_scene("plant", tmp_path / "photos", views=3, size=16, test_views=1))
    gains = np.array([[0.9, 1.0, 1.1], [1.0, 1.0, 1.0], [1.1, 1.0, 0.9]], np.float32)
    train_cameras = tuple(view.camera for view in dataset.train)
    result = TrainResult(ball_field(), 1, 1.0, 0.0, Evaluation(), True, train_cameras, gains)
    scene = Scene.trained(result, dataset)
    np.testing.assert_array_equal(np.array(scene.gains, np.float32), gains)
    assert [len(scene.cameras[split]) for split in ("train", "test", "val")] == [3, 1, 1]
    assert scene.background == (1.0, 1.0, 1.0)
    assert Scene.trained(dataclasses.replace(result, gains=np.ones_like(gains)), dataset).gains == ()


def test_existing_scene_needs_overwrite(tmp_path: Path) -> None:
    path = tmp_path / "scene"
    ball_scene().save(path)
    before = files_of(path)
    other = Scene(ball_field(density=3.0), background=(0.0, 0.0, 0.0))
    with pytest.raises(SceneError, match="exists already; give a new folder, or --overwrite"):
        other.save(path)
    assert files_of(path) == before
    (path / "renders").mkdir()
    (path / "renders" / "mine.png").write_bytes(b"mine")
    other.save(path, overwrite=True)
    assert Scene.open(path).background == (0.0, 0.0, 0.0)
    assert (path / "renders" / "mine.png").read_bytes() == b"mine"
    assert [entry.name for entry in tmp_path.iterdir()] == ["scene"]


def test_other_folders_and_files_are_never_replaced(tmp_path: Path) -> None:
    photos = tmp_path / "photos"
    photos.mkdir()
    (photos / "1.png").write_bytes(b"photo")
    with pytest.raises(SceneError, match="holds no scene and is left as it is"):
        ball_scene().save(photos, overwrite=True)
    assert (photos / "1.png").read_bytes() == b"photo"
    with pytest.raises(SceneError, match="is a file; give a new folder"):
        ball_scene().save(photos / "1.png", overwrite=True)
    (tmp_path / "empty").mkdir()
    ball_scene().save(tmp_path / "empty")
    assert check_destination(tmp_path / "new", overwrite=False) == (tmp_path / "new").resolve()


def test_failed_write_leaves_the_old_scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "scene"
    ball_scene().save(path)
    before = files_of(path)

    def disk_full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("cagefield.scene.scene_values.dump_edits", disk_full)
    with pytest.raises(OSError, match="No space left"):
        ball_scene().save(path, overwrite=True)
    assert files_of(path) == before
    assert [entry.name for entry in tmp_path.iterdir()] == ["scene"]


def test_failed_swap_puts_the_old_scene_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "scene"
    ball_scene().save(path)
    before = files_of(path)
    rename = Path.rename

    def refuse_new(self: Path, target: Path) -> Path:
        if ".new-" in self.name:
            raise PermissionError(13, "Permission denied", str(self))
        return rename(self, target)

    monkeypatch.setattr(Path, "rename", refuse_new)
    monkeypatch.setattr("cagefield.files.atomic.exchange_names", lambda one, other: False)
    with pytest.raises(PermissionError):
        Scene(ball_field(density=3.0)).save(path, overwrite=True)
    assert files_of(path) == before
    assert [entry.name for entry in tmp_path.iterdir()] == ["scene"]


def test_missing_scene_is_named(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="nowhere does not exist; give the folder that"):
        Scene.open(tmp_path / "nowhere")
    (tmp_path / "file").write_text("x")
    with pytest.raises(SceneError, match="is a file, not a folder"):
        Scene.open(tmp_path / "file")
    with pytest.raises(SceneError, match=r"holds no scene\.json: it is not a scene"):
        Scene.open(tmp_path)


@pytest.mark.parametrize("name", ["field.safetensors", "edits.yaml", "cameras.json"])
def test_missing_file_is_named(tmp_path: Path, name: str) -> None:
    ball_scene().save(tmp_path / "scene")
    (tmp_path / "scene" / name).unlink()
    with pytest.raises(SceneError, match=f"{name} is missing; copy it back"):
        Scene.open(tmp_path / "scene")


@pytest.mark.parametrize(
    ("name", "error", "message"),
    [
        ("field.safetensors", FieldError, r"field\.safetensors: not a readable field file .*truncated"),
        ("cameras.json", SceneError, r"cameras\.json is not readable JSON"),
        ("scene.json", SceneError, r"scene\.json is not readable JSON"),
    ],
)
def test_truncated_file_is_named(
    tmp_path: Path, name: str, error: type[CagefieldError], message: str
) -> None:
    ball_scene().save(tmp_path / "scene")
    file = tmp_path / "scene" / name
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    with pytest.raises(error, match=message):
        Scene.open(tmp_path / "scene")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"version": 2}, "version is 2, this cagefield reads up to 1; upgrade cagefield"),
        ({"version": "1"}, "version is '1', expected a whole number"),
        ({"version": 0}, "version is 0, expected a whole number"),
        ({"format": "other"}, "format is 'other', expected \"cagefield-scene\""),
        ({"background": [0, 0, 2]}, r"scene\.json: background must be three numbers in \[0, 1\]"),
        ({"background": "pink"}, r"scene\.json: background must be"),
        ({"gains": [[1, 1, 1]]}, r"scene\.json: 1 gains for 3 train cameras"),
        ({"gains": [[1, 1]] * 3}, r"scene\.json: gains must be a list of \[r, g, b\]"),
        ({"gains": [[1, 1, 1], [1, 0, 1], [1, 1, 1]]}, r"scene\.json: gains\[1\] is \[1.0, 0.0, 1.0\]; each"),
    ],
)
def test_bad_manifest_is_named(tmp_path: Path, changes: dict[str, object], message: str) -> None:
    ball_scene().save(tmp_path / "scene")
    file = tmp_path / "scene" / "scene.json"
    file.write_text(json.dumps({**json.loads(file.read_text()), **changes}))
    with pytest.raises(SceneError, match=message):
        Scene.open(tmp_path / "scene")


@pytest.mark.parametrize(
    ("document", "message"),
    [
        ({"train": {}}, '"train" must be a list of cameras'),
        ({"test": [3]}, r"test\[0\] is no camera"),
        ({"test": [{"c2w": 1}]}, r"test\[0\] is no camera: a camera lacks the key"),
        ([], "must hold a JSON object"),
    ],
)
def test_bad_cameras_are_named(tmp_path: Path, document: object, message: str) -> None:
    ball_scene().save(tmp_path / "scene")
    (tmp_path / "scene" / "cameras.json").write_text(json.dumps(document))
    with pytest.raises(SceneError, match=message):
        Scene.open(tmp_path / "scene")


def test_nan_in_a_camera_is_named(tmp_path: Path) -> None:
    ball_scene().save(tmp_path / "scene")
    file = tmp_path / "scene" / "cameras.json"
    document = json.loads(file.read_text())
    document["train"][1]["c2w"][0][3] = float("nan")
    file.write_text(json.dumps(document))
    with pytest.raises(SceneError, match=r"train\[1\] is no camera: c2w\[0\]\[3\] is nan"):
        Scene.open(tmp_path / "scene")


def test_nan_in_the_field_is_named(tmp_path: Path) -> None:
    from safetensors.numpy import load_file, save_file

    ball_scene().save(tmp_path / "scene")
    file = tmp_path / "scene" / "field.safetensors"
    tensors = load_file(file)
    tensors["density"][7] = np.nan
    save_file(tensors, file, metadata={"kind": "VoxelField", "version": "1", "contracted": "0"})
    with pytest.raises(FieldError, match=r"field\.safetensors: density must be finite, vertex 7"):
        Scene.open(tmp_path / "scene")


def test_bad_edits_are_named(tmp_path: Path) -> None:
    ball_scene().save(tmp_path / "scene")
    (tmp_path / "scene" / "edits.yaml").write_text("version: 1\nedits:\n  - wrong: 1\n")
    with pytest.raises(EditError, match=r"edits\.yaml"):
        Scene.open(tmp_path / "scene")


def test_invalid_scene_values() -> None:
    with pytest.raises(CagefieldError, match=r"background must be three numbers in \[0, 1\]"):
        Scene(ball_field(), background=(0.0, 0.0, 1.5))
    with pytest.raises(SceneError, match="scene version is 2; this cagefield writes version 1"):
        Scene(ball_field(), version=2)
    with pytest.raises(CameraError):
        Camera.from_fov(np.full((4, 4), np.nan), 4, 4, 1.0)


def test_render_agrees_with_the_exact_renderer() -> None:
    inner = Cage.box((0.0, 0.0, 0.0), 1.2)
    lift = (
        Edit.continuous(inner, inner.grown(0.5), lattice=64)
        .rotate((0.0, 0.2, 0.0))
        .translate((0.0, 0.0, 0.2))
    )
    scene = ball_scene().with_edits(EditStack([lift]))
    camera = scene.cameras["test"][1]
    fused, exact = (scene.render(camera, exact=exact, normals=True) for exact in (False, True))
    # Both take two samples a voxel, at different places: 2 gray levels on average, more at the silhouette.
    assert np.abs(fused.rgb - exact.rgb).mean() < 0.008
    assert np.abs(fused.opacity - exact.opacity).max() < 0.15
    assert fused.normals is not None and fused.opacity.max() > 0.99


def test_render_takes_the_scenes_own_background_unless_told() -> None:
    scene = Scene(ball_field(), background=(0.0, 0.0, 1.0))
    camera = ball_scene().cameras["test"][0]
    np.testing.assert_array_equal(scene.render(camera).rgb[0, 0], (0, 0, 1))
    np.testing.assert_array_equal(scene.render(camera, background="black").rgb[0, 0], (0, 0, 0))
    assert scene.render(camera, background="none").background is None


@pytest.mark.parametrize("exact", [False, True])
def test_background_none_is_nothing_behind_the_field_whatever_the_scenes_own_is(exact: bool) -> None:
    scene = Scene(ball_field(), background=(0.0, 0.0, 1.0))
    camera = ball_scene().cameras["test"][0]
    nothing = scene.render(camera, background=None, exact=exact)
    assert nothing.background is None
    # The corner shows no field: straight color 0, where the scene's own background is blue.
    np.testing.assert_array_equal(nothing.rgb[0, 0], (0, 0, 0))
    np.testing.assert_array_equal(nothing.rgb, scene.render(camera, background="none", exact=exact).rgb)
    own = scene.render(camera, background="scene", exact=exact)
    np.testing.assert_array_equal(own.rgb, scene.render(camera, exact=exact).rgb)
    # Division by a small opacity magnifies the float32 rounding of the blue that is taken off again.
    opaque = own.opacity > 0.1
    np.testing.assert_allclose(own.over(None).rgb[opaque], nothing.rgb[opaque], atol=1e-5)


def test_background_none_is_one_thing_for_all_renderers_and_results() -> None:
    camera, voxels = ball_scene().cameras["test"][0], ball_field()
    splats = SplatField(
        means=np.zeros((1, 3), np.float32),
        log_scales=np.full((1, 3), -2.5, np.float32),
        quaternions=np.array([[1, 0, 0, 0]], np.float32),
        opacities=np.array([0.9], np.float32),
        sh=np.ones((1, 1, 3), np.float32),
    )
    renderings = [
        partial(render_sampled, voxels, camera, samples=32),
        partial(VoxelRenderer(voxels).render, camera),
        partial(SplatRenderer(splats).render, camera),
        lambda background: Scene(voxels, background="white").render(camera).over(background),
        Scene(voxels, background=None).render(camera).over,
    ]
    for rendering in renderings:
        result = rendering(background=None)
        assert result is not None and result.background is None, rendering
        assert result.opacity.max() > 0.0 and result.opacity[0, 0] == 0.0
        np.testing.assert_array_equal(result.rgb[0, 0], (0, 0, 0))


def test_scene_is_no_background_but_for_a_scene() -> None:
    with pytest.raises(CagefieldError, match='background must be "white", "black", "none"'):
        Scene(ball_field(), background="scene")  # type: ignore[arg-type]


def test_with_edits_shares_the_field_and_moves_what_it_says() -> None:
    scene = ball_scene()
    camera = Camera.look_at((0, -3, 0), (0, 0, 0), width=48, height=48, fov_x=0.8)
    before = scene.render(camera)
    edited = scene.with_edits(EditStack([Edit.move(Cage.box((0, 0, 0), 1.2)).translate((0, 0, 0.5))]))
    after = edited.render(camera)
    assert edited.renderer.grid.slots is scene.renderer.grid.slots  # with the layers of its patch
    rows = [np.average(np.arange(48), weights=frame.opacity.sum(axis=1)) for frame in (before, after)]
    # 0.5 upwards at distance 3 and focal length 24 / tan(0.4) pixels
    assert rows[0] - rows[1] == pytest.approx(0.5 / 3 * 24 / np.tan(0.4), abs=0.5)
    np.testing.assert_array_equal(edited.with_edits(EditStack([])).render(camera).rgb, before.rgb)


def test_unbounded_scenes_render_beyond_their_box() -> None:
    field = ball_field(resolution=33, radius=1.0)
    unbounded = VoxelField(
        field.bounds / 4.0, field.resolution, field.vertices, field.density, field.sh, contracted=True
    )
    camera = Camera.look_at((0, -2, 0), (0, 0, 0), width=32, height=32, fov_x=1.0)
    scene = Scene(unbounded)
    fused, exact = scene.render(camera), scene.render(camera, exact=True)
    assert np.abs(fused.opacity - exact.opacity).mean() < 0.02
    assert fused.opacity.mean() > 0.05


def test_edits_that_are_no_stack_are_refused() -> None:
    edit = Edit.delete(Cage.box((0, 0, 0), 0.2))
    assert list(ball_scene().with_edits(EditStack([edit])).edits) == [edit]
    with pytest.raises(SceneError, match=r"edits must be an EditStack, got list; give EditStack\(\["):
        ball_scene().with_edits([edit])  # type: ignore[arg-type]


def test_what_is_no_camera_or_no_nerf_is_refused() -> None:
    with pytest.raises(SceneError, match=r"camera must be a Camera, got 'test'; give one such as"):
        ball_scene().render("test")  # type: ignore[arg-type]
    with pytest.raises(SceneError, match=r"or a SplatField, got VoxelField; .* Scene\(bake\(field\)\)"):
        Scene.baked(ball_field(), {})  # type: ignore[arg-type]
