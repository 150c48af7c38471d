"""Test files on the processes of `pytest -n N --dist loadfile`: long ones first, families in one process.

A process compiles a kernel that is not on the disk as it starts its device, though another one compiles it
too; and a fixture of a session is made once in each process.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import Any

import pytest

FAMILIES: dict[str, tuple[str, ...]] = {
    "marches through edits": (
        "test_renderer",
        "test_grade",
        "test_field_page",
        "test_page_layers",
        "test_exporting_page",
        "test_exporting_free_form",
        "test_completion",
        "test_diffuse_irradiance",
        "test_directional_light",
        "test_continuous_relighting",
        "test_pasting",
        "test_edit_refresh",
        "test_renderer_parts",
    ),
    "splats on the device": ("test_splat_training_device", "test_splat_device", "test_device_sorting"),
    "editors of the trained digger": (
        "test_editor_panel",
        "test_editor_page",
        "test_page_field",
    ),
    "trainings of voxel fields": (
        "test_training",
        "test_training_kernels",
        "test_cli_train",
        "test_training_schedule",
    ),
}
"""Files that compile the same kernels in the test process, or have a fixture of the session in common; those
that compile most come first, so that the others find kernels of Numba on the disk."""

LONG: tuple[str, ...] = (
    "test_editor_gestures",
    "test_poses",
    "test_training_splat",
    "test_server_socket",
    "test_flow_shell",
    "test_training_nerf",
    "test_captures",
    "test_page_splats",
    "test_kills",
    "test_cli_export",
    "test_files",
    "test_server_files",
    "test_datasets_points",
    "test_deformed_splats",
    "test_pose_verification",
    "test_several",
    "test_disks",
)
"""Other files whose tests take long, by measured CPU time."""

_FAMILY_OF = {name: family for family, names in FAMILIES.items() for name in names}


def unit_of(node_id: str) -> str:
    """The unit of work of a test: the family of its file, else its file."""
    path = node_id.split("::", 1)[0]
    return _FAMILY_OF.get(_stem(path), path)


def long_first(node_ids: Iterable[str]) -> list[int]:
    """Order of tests by indices: FAMILIES, then LONG, then files by their number of tests; within a file as
    given."""
    ids = list(node_ids)
    tests = Counter(id.split("::", 1)[0] for id in ids)
    places = {name: place for place, name in enumerate([*_FAMILY_OF, *LONG])}

    def key(index: int) -> tuple[int, int, str]:
        path = ids[index].split("::", 1)[0]
        return places.get(_stem(path), len(places)), -tests[path], path

    return sorted(range(len(ids)), key=key)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """The scheduler of `--dist loadfile` with families as units of work."""
    if config.getvalue("dist") != "loadfile":
        return None
    from xdist.scheduler import LoadFileScheduling

    class FamilyScheduling(LoadFileScheduling):
        def _split_scope(self, nodeid: str) -> str:
            return unit_of(nodeid)

    return FamilyScheduling(config, log)


def _stem(path: str) -> str:
    """File name without its folder and ending."""
    return path.rsplit("/", 1)[-1].removesuffix(".py")
