"""Runs one of the commands in this process, which is killed at one of its calls; `kill_points` starts it."""

from __future__ import annotations

import sys
from pathlib import Path

from kill_commands import COMMANDS, SLOW_COMMANDS
from kill_points import run

if __name__ == "__main__":
    _name, _folder, _at, _writing, _writes = sys.argv[1:]
    _work = {**COMMANDS, **SLOW_COMMANDS}[_name].work
    run(lambda say: _work(Path(_folder), say), Path(_folder), int(_at), int(_writing), _writes == "1")
