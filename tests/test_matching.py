"""Matches of photos' features: the same from one process and from several, and a failure is named."""

from __future__ import annotations

import contextlib

import numpy as np
import pytest

from cagefield.datasets.sfm import features
from cagefield.datasets.sfm.features import Photo
from cagefield.datasets.sfm.matching import match
from cagefield.errors import DatasetError
from posed_photos import textured_capture

pycolmap = pytest.importorskip("pycolmap", reason="features are matched by pycolmap")


@pytest.fixture(scope="module")
def extracted(tmp_path_factory):
    """(a database with the features of six photos, their names)."""
    capture = textured_capture(tmp_path_factory.mktemp("matching"), 6)
    names = sorted(path.relative_to(capture).as_posix() for path in capture.glob("*/*.png"))
    database = capture / "database.db"
    camera = pycolmap.Camera(model="PINHOLE", width=320, height=240, params=[352.0, 352.0, 157.0, 125.0])
    features.create_database(database, [camera], [Photo(name, 0) for name in names])
    features.extract(database, capture, names, features=1024, longer_side=320)
    return database, names


def matched(extracted, folder, **options):
    database, names = extracted
    copy = folder / "database.db"
    copy.write_bytes(database.read_bytes())
    shares = []
    match(
        copy,
        names,
        features.all_pairs(len(names)),
        on_progress=lambda share, _: shares.append(share),
        **options,
    )
    assert shares == sorted(shares) and shares[-1] == 1.0
    with features.silence_log(), contextlib.closing(pycolmap.Database.open(copy)) as opened:
        geometries = opened.read_two_view_geometries()
        return dict(zip(*opened.read_all_matches(), strict=True)), dict(zip(*geometries, strict=True))


@pytest.mark.nightly
@pytest.mark.parametrize("verify", [True, False])
def test_several_processes_match_as_one(extracted, tmp_path, verify):
    found = {}
    for processes in (1, 2):
        folder = tmp_path / str(processes)
        folder.mkdir()
        found[processes] = matched(extracted, folder, verify=verify, processes=processes)
        assert sorted(path.name for path in folder.iterdir()) == ["database.db"]
    (one, geometry), (two, other) = found[1], found[2]
    assert one.keys() == two.keys() and len(one) == 15 and max(len(m) for m in one.values()) > 100
    for pair in one:
        np.testing.assert_array_equal(one[pair], two[pair])
    assert geometry.keys() == other.keys() and bool(geometry) == verify
    for pair in geometry:
        np.testing.assert_array_equal(geometry[pair].inlier_matches, other[pair].inlier_matches)


def test_a_process_that_fails_is_named(extracted, tmp_path, monkeypatch):
    monkeypatch.setattr("sys.executable", "/bin/false")
    with pytest.raises(DatasetError, match="matching stopped with status 1"):
        matched(extracted, tmp_path, verify=False, processes=2)
    assert [path.name for path in tmp_path.iterdir()] == ["database.db"]
