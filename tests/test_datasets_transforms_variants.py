"""transforms.json as other programs write it: the same views as of the plain file."""

from __future__ import annotations

import json
import time
from pathlib import Path

import numpy as np
import pytest

from cagefield.cli import main
from cagefield.datasets import load_dataset
from cagefield.datasets.transforms.transforms_json import read_json
from cagefield.errors import DatasetError
from posed_photos import ring, save

N, WIDTH, HEIGHT = 9, 24, 16


def _values(folder: Path) -> dict:
    frames = []
    for i, pose in enumerate(ring(N)):
        save(folder / f"images/{i}.png", np.full((HEIGHT, WIDTH, 3), 20 * i, np.uint8))
        frames.append({"file_path": f"images/{i}.png", "transform_matrix": pose.tolist()})
    return {"fl_x": 30.0, "fl_y": 31.0, "cx": 12.5, "cy": 8.25, "k1": 0.04, "frames": frames}


def _load(folder: Path, values: dict | str, name: str = "transforms.json", encoding: str = "utf-8"):
    text = values if isinstance(values, str) else json.dumps(values)
    (folder / name).write_text(text, encoding=encoding)
    return load_dataset(folder)


def _assert_right(data) -> None:
    views = sorted((*data.train, *data.test), key=lambda view: view.load()[0, 0, 0])
    assert len(views) == N and len(data.test) == 2
    for view, pose in zip(views, ring(N), strict=True):
        np.testing.assert_allclose(view.camera.c2w, pose, atol=1e-12)
        assert (view.camera.fx, view.camera.cy, view.camera.distortion[0]) == (30.0, 8.25, 0.04)


@pytest.mark.parametrize("name", ["transforms.json", "transform.json", "transform_train.json"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_names_and_encodings(tmp_path, name, encoding):
    _assert_right(_load(tmp_path, _values(tmp_path), name, encoding))


@pytest.mark.parametrize("model", ["SIMPLE_RADIAL", "RADIAL", "OPENCV", "opencv", "PINHOLE"])
def test_perspective_models(tmp_path, model):
    _assert_right(_load(tmp_path, {**_values(tmp_path), "camera_model": model}))


def test_small_faults_of_the_text(tmp_path):
    values = {**_values(tmp_path), "fl_x": "30.0", "totp": [float("nan")], "note": "a // b, }"}
    text = json.dumps(values)[:-1] + ", // the end\n /* none */ }"
    _assert_right(_load(tmp_path, text))


def test_faults_of_the_text_keep_the_place_of_errors(tmp_path):
    text = '{ /* one\n two */ "a": "x\\" // no comment", // three\n "b": [1, 2,], }'
    values = read_json(_written(tmp_path, text))
    assert values == {"a": 'x" // no comment', "b": [1, 2]}
    with pytest.raises(DatasetError, match="not valid JSON at line 3, column 7 "):
        read_json(_written(tmp_path, text.replace("[1, 2,]", "!!!")))


@pytest.mark.parametrize("part", ['"', '\\"', "/*", ",", '"a', "//\n", ", ", "\\", "}"])
def test_damaged_text_takes_linear_time(tmp_path, part):
    """A megabyte is passed by within seconds; where each character began a search to the end, in hours."""
    began = time.process_time()
    with pytest.raises(DatasetError, match="not valid JSON"):
        read_json(_written(tmp_path, '{"a": ' + part * (1_000_000 // len(part))))
    assert time.process_time() - began < 5.0


def _written(folder: Path, text: str) -> Path:
    (folder / "a.json").write_text(text)
    return folder / "a.json"


def test_uniform_scale_of_rotations_is_taken_out_and_said(tmp_path):
    values = _values(tmp_path)
    for frame in values["frames"]:
        matrix = np.array(frame["transform_matrix"])
        matrix[:3, :3] *= 0.33
        frame["transform_matrix"] = matrix.tolist()
    with pytest.warns(
        UserWarning, match="rotations of 9 poses are scaled by 0.33 to 0.33; the scale is taken"
    ):
        _assert_right(_load(tmp_path, values))


def test_frames_that_cannot_be_used_are_left_out_and_named(tmp_path):
    values = _values(tmp_path)
    pose = values["frames"][0]["transform_matrix"]
    values["frames"] += [
        {"transform_matrix": pose},
        {"file_path": "./images/3.png", "transform_matrix": pose},
    ]
    save(tmp_path / "images/x.png", np.zeros((HEIGHT, WIDTH, 3), np.uint8))
    bad = [[-float("inf")] * 4, [float("nan")] * 4, [0] * 4, [0, 0, 0, 1]]
    values["frames"].append({"file_path": "images/x.png", "transform_matrix": bad})
    with pytest.warns(UserWarning) as said:
        _assert_right(_load(tmp_path, values))
    text = " ".join(str(one.message) for one in said)
    assert "1 frames are left out, they have no file_path: frames[9]" in text
    assert "1 frames are left out, their photos are listed before: images/3.png" in text
    assert "1 of 12 frames are left out, they have no finite pose: images/x.png" in text


def test_applied_scale_and_transform_are_the_similarity(tmp_path):
    values = {**_values(tmp_path), "applied_scale": 0.25}
    values["applied_transform"] = [[0, 1, 0, 3], [1, 0, 0, 4], [0, 0, -1, 5]]
    data = _load(tmp_path, values)
    point = np.array([1.0, 2.0, 3.0, 1.0])
    np.testing.assert_allclose((data.source_to_world @ point)[:3], [0.25 * 5, 0.25 * 5, 0.25 * 2])
    with pytest.raises(DatasetError, match="'applied_scale' must be positive, got -1"):
        _load(tmp_path, {**values, "applied_scale": -1})


def test_info_describes_a_data_set(tmp_path, capsys):
    _load(tmp_path, _values(tmp_path))
    assert main(["info", str(tmp_path)]) == 0
    text = capsys.readouterr().out
    assert "train: 7, 24x16" in text and "9 x opencv" in text and "masks       0 of 9 photos" in text
