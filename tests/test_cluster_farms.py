"""The texts for farms in the documentation: all frames, none twice, by commands that are accepted."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from cagefield.cli import main, parse
from cagefield.cli.render import Render
from cagefield.cli.train import Train
from scenes import ball_scene, files_of

PAGE = Path(__file__).parents[1] / "docs/how-to/cluster.md"


def block(kind: str, number: int = 0) -> str:
    """A text of the page of a kind, by default the first one."""
    texts: list[str] = re.findall(rf"```{kind}\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    return texts[number]


def command(folder: Path, script: str) -> dict[str, str]:
    """Environment whose `cagefield` is a shell script."""
    (folder / "bin").mkdir()
    path = folder / "bin/cagefield"
    path.write_text(f"#!/bin/sh\n{script}\n", encoding="utf-8")
    path.chmod(0o755)
    return {**os.environ, "PATH": f"{folder / 'bin'}:{os.environ['PATH']}"}


def frames(words: list[str]) -> list[int]:
    """Frames of a command, which is parsed as `cagefield` does."""
    options = parse(words)
    assert isinstance(options, Render) and options.frames is not None and options.keep
    first, last = ([*map(int, options.frames.split("-"))] * 2)[:2]
    return list(range(first, last + 1))


def test_the_slurm_array_renders_every_frame_once(tmp_path: Path) -> None:
    (tmp_path / "array.sh").write_text(block("bash"), encoding="utf-8")
    array = re.search(r"--array=0-(\d+)", block("bash"))
    assert array is not None
    environment = command(tmp_path, 'echo "$@" >> "$LOG"') | {"LOG": str(tmp_path / "log")}
    for task in range(int(array.group(1)) + 1):
        subprocess.run(
            ["sh", tmp_path / "array.sh"], env=environment | {"SLURM_ARRAY_TASK_ID": str(task)}, check=True
        )
    lines = (tmp_path / "log").read_text(encoding="utf-8").splitlines()
    assert sorted(frame for line in lines for frame in frames(line.split())) == list(range(240))


def test_the_slurm_array_trains_every_capture_and_resumes_what_was_stopped(tmp_path: Path) -> None:
    text = block("bash", 1)
    (tmp_path / "array.sh").write_text(text, encoding="utf-8")
    (tmp_path / "scenes").mkdir()
    (tmp_path / "scenes/STREET.training").touch()
    environment = command(tmp_path, 'echo "$@" >> "$LOG"') | {"LOG": str(tmp_path / "log")}
    assert "--array=0-2" in text
    for task in range(3):
        subprocess.run(
            ["sh", tmp_path / "array.sh"],
            env=environment | {"SLURM_ARRAY_TASK_ID": str(task)},
            check=True,
            cwd=tmp_path,
        )
    trainings = [parse(line.split()) for line in (tmp_path / "log").read_text(encoding="utf-8").splitlines()]
    assert all(isinstance(training, Train) for training in trainings)
    found = [(str(one.photos.data), str(one.out), one.resume) for one in trainings]  # type: ignore[union-attr]
    assert found == [(name, f"scenes/{name}", name == "STREET") for name in ("ROOM", "STREET", "GARDEN")]


def test_the_job_template_names_every_frame() -> None:
    template = yaml.safe_load(block("yaml"))
    values = {item["name"]: item.get("default", "edited") for item in template["parameterDefinitions"]}
    assert (values["Count"], values["Frames"]) == (240, "0-239")
    (step,) = template["steps"]
    action = step["script"]["actions"]["onRun"]
    assert action["command"] == "cagefield"
    known = {f"Param.{name}": str(value) for name, value in values.items()} | {"Task.Param.Frame": "7"}
    words = [re.sub(r"{{(.*?)}}", lambda match: known[match.group(1)], word) for word in action["args"]]
    assert frames(words) == [7]


@pytest.mark.skipif(shutil.which("openjd") is None, reason="openjd-cli is not installed")
@pytest.mark.nightly
def test_the_job_template_runs(tmp_path: Path) -> None:
    """Oracle: the command without a farm."""
    ball_scene().save(tmp_path / "scene")
    expected = tmp_path / "expected"
    assert (
        main(["render", str(tmp_path / "scene"), "-o", str(expected), "--turntable", "3", "--size", "32"])
        == 0
    )
    template = block("yaml").replace('- "--keep"', '- "--keep"\n            - "--size"\n            - "32"')
    (tmp_path / "template.yaml").write_text(template, encoding="utf-8")
    environment = command(tmp_path, f'exec {sys.executable} -m cagefield "$@"')
    given = (f"Scene={tmp_path / 'scene'}", f"Out={tmp_path / 'out'}", "Count=3", "Frames=0-2")
    words = [word for value in given for word in ("-p", value)]
    subprocess.run(
        ["openjd", "run", str(tmp_path / "template.yaml"), *words], env=environment, check=True, timeout=3600
    )
    assert len(files_of(expected)) == 3 and files_of(tmp_path / "out") == files_of(expected)
