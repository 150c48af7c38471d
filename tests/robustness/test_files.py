"""Damaged files of every format, and messages: refused in a line, or read; no traceback, no hang, no memory.

`benchmarks/robustness/files.py` tries thousands of each.
"""

from __future__ import annotations

import importlib.util
import json
import random
import shutil
from pathlib import Path

import mutators
import pytest
from attack import Outcome, attack, attack_by
from hypothesis import given, settings
from hypothesis import strategies as st
from large_external import LARGE_EXTERNAL_READERS
from large_readers import READERS as LARGE_READERS
from readers import NEED_OPENSSL, NEED_TORCH, READERS

from cagefield.edits import dump_edits, parse_edits
from cagefield.errors import CagefieldError
from cagefield.files import json_text, yaml_text
from tiers import nightly_after_first

INPUTS = 1
"""Inputs of each reader with every change; nightly runs of the benchmark try 200."""


EVERY_RUN = (
    *("edits.yaml", "scene folder", "voxel field", "splat field", "autosave", "hotspots", "camera path"),
    *("nerf .tar, new", "TensoRF .th", "svox2 .npz", "nerfacto .ckpt", "Instant-NGP .ingp", "SVRaster .pt"),
    *("transforms.json", "COLMAP, binary", "LLFF", "png", "compressed.ply", "spz 3", "sog", "glb scene"),
    *("poses.json", "token", "messages"),
)
"""Readers of every kind of file; the others are tried nightly."""


@pytest.fixture(scope="module")
def outcomes() -> dict[str, Outcome]:
    """Outcomes of some inputs of the readers of every run, all in one process."""
    return attack([name for name in EVERY_RUN if _why_not(name) is None], 0, INPUTS, "tests")


@pytest.fixture(scope="module")
def other_outcomes() -> dict[str, Outcome]:
    """Outcomes of some inputs of the other readers, all in one process."""
    others = [name for name in READERS if name not in EVERY_RUN]
    return attack([name for name in others if _why_not(name) is None], 0, INPUTS, "tests")


def _why_not(name: str) -> str | None:
    """Why a reader cannot be tested here; None where it can."""
    if name in NEED_TORCH and not importlib.util.find_spec("torch"):
        return "checkpoints are read by PyTorch, which is not installed (extra nerf)"
    if name in NEED_OPENSSL and shutil.which("openssl") is None:
        return "certificates for this test are made by openssl, which is not here"
    return None


@pytest.mark.parametrize("name", EVERY_RUN)
def test_damaged_files(name: str, outcomes: dict[str, Outcome]) -> None:
    check_outcome(name, outcomes)


@pytest.mark.nightly
@pytest.mark.parametrize("name", [name for name in READERS if name not in EVERY_RUN])
def test_damaged_files_of_other_readers(name: str, other_outcomes: dict[str, Outcome]) -> None:
    check_outcome(name, other_outcomes)


def check_outcome(name: str, outcomes: dict[str, Outcome]) -> None:
    """All inputs of a reader were refused or read, without faults; skips where it cannot be tested."""
    if (reason := _why_not(name)) is not None:
        pytest.skip(reason)
    found = outcomes[name]
    assert found.faults == []
    assert found.tried == INPUTS == found.refused + found.read


FOUND = {
    "transforms.json": (715,),
    "LLFF": (70, 141),
    "compressed.ply": (199, 227, 893),
    "nerf config.yml": (765,),
    "COLMAP, binary": (91, 606),
    "COLMAP, text": (342, 890),
    "training": (838, 8937, 9348),
    "tif": (489,),
    "sog": (295,),
    "glb": (284,),
    "poses, photos.json": (687, 852, 5648),
    "poses, database.db": (7496,),
    "training, voxels": (8, 18, 43),
    "training, splats": (14, 140, 334, 383),
    "token": (2, 53),
    "lock": (1, 4, 20),
}
"""Inputs of the benchmark that once ended in a traceback, a page of text, or a gigabyte."""


@pytest.mark.nightly
def test_what_took_memory_stays_cured() -> None:
    """A damaged file that is unpacked to half a million splats, none of which is visible: it took 60 MiB."""
    found = attack(["spz 1"], 5622, 5623)["spz 1"]
    assert (found.refused, found.faults) == (1, [])


@pytest.mark.nightly
def test_archives_of_trainings_are_not_unpacked_beyond_their_size() -> None:
    """Checkpoints that unpack to 256 MiB, or that go on with a step below 0."""
    pytest.importorskip("torch", reason="these trainings are PyTorch's, which is not installed (extra nerf)")
    found = attack_by("training, nerf", (27, 366, 477))
    assert (found.faults, found.tried) == ([], 3)


@pytest.mark.nightly
@pytest.mark.parametrize("name", ["splat field", "training", "bmp", "poses.json"])
def test_large_files_take_twice_as_much_at_most(name: str) -> None:
    """The benchmark does it for all that are large, and some hundred inputs: `files.py --large`."""
    found = attack([name], 0, 4, "tests", large=True)[name]
    assert (found.faults, found.tried) == ([], 4)
    assert found.honest > 8 << 20


@pytest.mark.nightly
@pytest.mark.parametrize("name", LARGE_EXTERNAL_READERS)
def test_large_checkpoints_of_other_programs_take_twice_as_much_at_most(name: str) -> None:
    pytest.importorskip("torch", reason="checkpoints are PyTorch's, which is not installed (extra nerf)")
    found = attack([name], 0, 4, "tests", large=True)[name]
    assert (found.faults, found.tried) == ([], 4)
    assert found.honest > 2 << 20


def test_large_readers_are_known() -> None:
    assert set(LARGE_READERS) < set(READERS)


@pytest.mark.parametrize(
    ("name", "number"),
    [
        parameters
        for name, numbers in FOUND.items()
        for parameters in nightly_after_first((name, number) for number in numbers)
    ],
)
def test_what_was_found_stays_cured(tmp_path: Path, name: str, number: int) -> None:
    reader = READERS[name]
    reader.make(tmp_path)
    honest = {place: (tmp_path / place).read_bytes() for place in reader.damaged}
    chance = random.Random(f" {name} {number}")
    place = chance.choice(list(honest))
    (tmp_path / place).write_bytes(mutators.mutate(reader.damaged[place], honest[place], chance))
    try:
        reader.read(tmp_path)
    except CagefieldError as error:
        assert len(str(error)) < 1000 and "\n" not in str(error)


def test_most_damages_are_seen(outcomes: dict[str, Outcome]) -> None:
    """The inputs are no copies of the honest files."""
    assert sum(found.refused for found in outcomes.values()) > sum(found.read for found in outcomes.values())


def test_faults_are_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Readers that crash, end their process, take memory, also where they refuse, and one that never ends.

    The one that takes memory in small parts is counted again, though its process has kept what it freed.
    """
    import attack as attacking

    _use_faulty_readers(tmp_path, "readers", monkeypatch)
    monkeypatch.setattr(attacking, "HANG", 0.5)
    found = attack(["crash", "death", "memory", "refused", "crumbs", "burn"], 0, 2)
    assert {name: (one.tried, one.crashed, one.over_memory, one.hung) for name, one in found.items()} == {
        "crash": (2, 2, 0, 0),
        "death": (2, 2, 0, 0),
        "memory": (2, 0, 2, 0),
        "refused": (2, 0, 2, 0),
        "crumbs": (2, 0, 2, 0),
        "burn": (2, 0, 0, 2),
    }
    assert found["refused"].refused == 2
    assert all(len(one.faults) == sum((one.crashed, one.over_memory, one.hung)) for one in found.values())


def test_twice_the_honest_memory_is_judged_without_slack(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of large files; beside small ones 2 MiB more than twice as much are no fault."""
    names = ["less than twice", "more than twice", "thrice"]
    _use_faulty_readers(tmp_path, "large_readers", monkeypatch)
    found = attack(names, 0, 2, large=True)
    assert [found[name].over_memory for name in names] == [0, 2, 2]
    assert [len(found[name].faults) for name in names] == [0, 2, 2]
    assert all(20.0 <= found[name].honest / (1 << 20) < 20.5 for name in names)
    _use_faulty_readers(tmp_path, "readers", monkeypatch)
    found = attack(names, 0, 2)
    assert [found[name].over_memory for name in names] == [0, 0, 2]


def _use_faulty_readers(folder: Path, module: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """From now on `attack` has `faulty_readers.py` in the place of that module."""
    import attack as attacking

    here = Path(__file__).parent
    (folder / f"{module}.py").write_text((here / "faulty_readers.py").read_text())
    for name in ("attacked_reader", "mutators", "plain_mutators", "hostile_values"):
        (folder / f"{name}.py").write_text((here / f"{name}.py").read_text())
    monkeypatch.setattr(attacking, "__file__", str(folder / "attack.py"))


# ---- structure ----

_NUMBERS = st.one_of(
    st.floats(allow_subnormal=False),  # which a process with quick kernels takes for 0
    st.integers(),
    st.sampled_from([1e308, -1e308, 10**400]),
    st.booleans(),
    st.none(),
)
_VALUES = st.recursive(
    st.one_of(_NUMBERS, st.text(max_size=8)),
    lambda inner: st.one_of(
        st.lists(inner, max_size=4), st.dictionaries(st.text(max_size=6), inner, max_size=4)
    ),
    max_leaves=12,
)
_VECTORS = st.lists(_NUMBERS, min_size=3, max_size=3)
_CAGES = st.one_of(
    st.fixed_dictionaries({"center": _VECTORS, "size": st.one_of(_NUMBERS, _VECTORS)}),
    st.fixed_dictionaries({"corners": st.lists(_VECTORS, min_size=8, max_size=8)}),
    _VALUES,
)
_EDITS = st.fixed_dictionaries(
    {"inner": _CAGES},
    optional={
        "outer": st.one_of(_CAGES, st.fixed_dictionaries({"margin": _NUMBERS})),
        "operations": st.lists(
            st.one_of(
                st.fixed_dictionaries({"translate": _VECTORS}),
                st.fixed_dictionaries({"rotate_deg": _VECTORS}),
                st.fixed_dictionaries({"scale": st.one_of(_NUMBERS, _VECTORS)}),
                st.fixed_dictionaries(
                    {"move_corner": st.fixed_dictionaries({"corner": _NUMBERS, "by": _VECTORS})}
                ),
                _VALUES,
            ),
            max_size=3,
        ),
        "name": st.text(max_size=12),
        "lattice": _NUMBERS,
        "width": _NUMBERS,
        "adjustment": st.sampled_from(["continuous", "discrete", 1]),
        "fill": _VALUES,
    },
)


@settings(max_examples=25, deadline=None)
@given(st.lists(_EDITS, max_size=3))
def test_edits_of_any_values_are_edits_or_refused(edits: list[object]) -> None:
    text = json.dumps({"version": 1, "edits": edits})
    try:
        stack = parse_edits(text, format="json", check=False)
    except CagefieldError as error:
        assert "\n" not in str(error) and len(str(error)) < 1000
        return
    for format in ("json", "yaml"):
        again = parse_edits(dump_edits(stack, format=format), format=format, check=False)
        assert dump_edits(again) == dump_edits(stack)


@settings(max_examples=60, deadline=None)
@given(_VALUES)
def test_json_and_yaml_are_read_alike(value: object) -> None:
    text = json.dumps(value)
    try:
        read = json_text.loads(text)
    except ValueError:
        return
    assert json.dumps(read) == text
    if isinstance(value, (dict, list)) and text.isascii() and "\\u" not in text and "NaN" not in text:
        try:
            built = yaml_text.loads(text)
        except yaml_text.YamlError:
            return
        assert type(built) is type(value) and len(built) == len(value)


def test_every_mutator_damages() -> None:
    chance = random.Random(0)
    for kind in mutators.KINDS:
        content = b'{"a": [1, 2.5, "x"]}\nb: 3\n'
        assert any(mutators.mutate(kind, content, chance) != content for _ in range(5)), kind
