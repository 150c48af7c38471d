"""Photos found by the names of camera files written on other machines."""

from __future__ import annotations

import unicodedata
from pathlib import Path

import pytest

from cagefield.datasets.photo_names import find_photos, view_name


def _tree(base: Path, *names: str) -> Path:
    for name in names:
        (base / name).parent.mkdir(parents=True, exist_ok=True)
        (base / name).write_bytes(b"x")
    return base


@pytest.mark.parametrize(
    ("there", "asked"),
    [
        ("images/a.jpg", "images/a.jpg"),
        ("images/a.jpg", "./images/a.jpg"),
        ("images/a.jpg", "images\\a.jpg"),
        ("images/a.jpg", ".\\images\\a.jpg"),
        ("images/a.jpg", "./../{base}/images/a.jpg"),
        ("images/a.jpg", "images/a"),
        ("images/a.JPG", "images/a.jpg"),
        ("images/a.jpg", "images/A.JPG"),
        ("Images/a.jpg", "images/a.jpg"),
        ("images/a.png", "images/a.jpg"),
        ("images/a.jpg", "images/a.HEIC"),
        ("images/a.jpeg", "images/a.JPG"),
        ("images/my photo (1).jpg", "images/my%20photo%20(1).jpg"),
        ("images/100%20.jpg", "images/100%20.jpg"),
        (
            "images/" + unicodedata.normalize("NFC", "é.jpg"),
            "images/" + unicodedata.normalize("NFD", "é.jpg"),
        ),
        (
            "images/" + unicodedata.normalize("NFD", "é.jpg"),
            "images/" + unicodedata.normalize("NFC", "é.jpg"),
        ),
        ("images/a.jpg", "C:\\Users\\me\\capture\\images\\a.jpg"),
        ("images/a.jpg", "/home/me/capture/images/a.jpg"),
        ("images/a.jpg", "file:///home/me/capture/images/a.jpg"),
        ("images/a.jpg", "/content/drive/MyDrive/photos/a.png"),
        ("images/a.jpg", "a.jpg"),
        ("a.jpg", "images/a.jpg"),
        ("images/IMG_1.2.jpg", "images/IMG_1.2"),
    ],
)
def test_a_name_finds_its_photo(tmp_path, there, asked):
    _tree(tmp_path, there, "elsewhere/other.jpg")
    asked = asked.replace("{base}", tmp_path.name)
    assert {n: p.resolve() for n, p in find_photos(tmp_path, [asked]).photos.items()} == {
        asked: (tmp_path / there).resolve()
    }


def test_the_longest_end_decides(tmp_path):
    _tree(tmp_path, "front/images/1.jpg", "back/images/1.jpg", "images_2/1.jpg")
    names = ["D:/x/front/images/1.jpg", "D:/x/back/images/1.jpg"]
    found = find_photos(tmp_path, names)
    assert [found.photos[n].relative_to(tmp_path).as_posix() for n in names] == [
        "front/images/1.jpg",
        "back/images/1.jpg",
    ]
    assert set(found.moved) == set(names)
    assert found.relative_view_name(names[0], tmp_path) == "front/images/1.jpg"
    with pytest.warns(
        UserWarning, match="here: 2 of 2 photos are not where it says, found below .*D:/x/front"
    ):
        found.report(Path("here"), tmp_path)


def test_copies_and_masks_are_no_photos_of_a_moved_name(tmp_path):
    _tree(tmp_path, "images/1.jpg", "images_4/1.jpg", "masks/1.png", "depths/1.jpg")
    assert find_photos(tmp_path, ["/x/photos/1.jpg"]).photos == {"/x/photos/1.jpg": tmp_path / "images/1.jpg"}


def test_an_ambiguous_end_finds_nothing_and_is_named(tmp_path):
    _tree(tmp_path, "a/1.jpg", "b/1.jpg")
    found = find_photos(tmp_path, ["/x/1.jpg"])
    assert not found.photos and found.ambiguous == ["/x/1.jpg"]
    with pytest.warns(
        UserWarning, match="here: the ends of 1 names fit several photos below .*: /x/1.jpg; put"
    ):
        found.report(Path("here"), tmp_path)


def test_two_names_do_not_share_a_photo_by_their_ends(tmp_path):
    _tree(tmp_path, "images/1.jpg")
    found = find_photos(tmp_path, ["/x/day1/1.jpg", "/x/day2/1.jpg"])
    assert not found.photos and sorted(found.ambiguous) == ["/x/day1/1.jpg", "/x/day2/1.jpg"]


def test_a_missing_photo_is_not_replaced_by_one_that_another_name_has(tmp_path):
    _tree(tmp_path, "train/r_0.png")
    found = find_photos(tmp_path, ["test/r_0", "train/r_0"])
    assert found.photos == {"train/r_0": tmp_path / "train/r_0.png"}


def test_a_photo_missing_in_a_folder_that_is_there_is_missing(tmp_path):
    _tree(tmp_path, "front/1.jpg", "back/2.jpg")
    assert find_photos(tmp_path, ["front/2.jpg"]).photos == {}


@pytest.mark.parametrize(
    "hidden", ["images/._a.jpg", "__MACOSX/images/a.jpg", "images/@eaDir/a.jpg", ".x/a.jpg"]
)
def test_hidden_files_are_no_photos(tmp_path, hidden):
    _tree(tmp_path, hidden, "images/b.jpg")
    assert find_photos(tmp_path, ["/x/images/a.jpg", "images/._a.jpg"]).photos == {}


@pytest.mark.parametrize(
    "name", ["", ".", "/", "..", "a" * 5000, "images/\0.jpg", "x/" * 2000, "%00", "images"]
)
def test_no_name_breaks_it(tmp_path, name):
    _tree(tmp_path, "images/b.jpg")
    assert find_photos(tmp_path, [name]).photos == {}


def test_view_names():
    assert view_name(".\\images\\a b.jpg") == "images/a b.jpg"
