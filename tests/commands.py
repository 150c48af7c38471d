"""The command line as a test sees it: what it prints, and the one line with which it refuses."""

from __future__ import annotations

import pytest

from cagefield.cli import main


def printed(capsys: pytest.CaptureFixture[str], *argv: object) -> str:
    """Standard output of a command that succeeds."""
    capsys.readouterr()
    assert main([str(arg) for arg in argv]) == 0
    return capsys.readouterr().out


def refused(capsys: pytest.CaptureFixture[str], *argv: object) -> str:
    """The one line that a refused command prints on stderr."""
    capsys.readouterr()
    assert main([str(arg) for arg in argv]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("cagefield: ") and err.count("\n") == 1 and err.endswith("\n")
    assert "Traceback" not in err
    return err


def given_up(capsys: pytest.CaptureFixture[str], *argv: object) -> str:
    """The line with which a command ends that fails on its way, after lines of its progress."""
    capsys.readouterr()
    assert main([str(arg) for arg in argv]) == 2
    err = capsys.readouterr().err
    *progress, last = err.splitlines()
    assert last.startswith("cagefield: ") and "Traceback" not in err
    assert not any(line.startswith("cagefield: ") and "warning" not in line for line in progress)
    return last
