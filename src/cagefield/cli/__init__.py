"""The `cagefield` command: one module per subcommand, heavy imports inside `run`.

Bad input ends with one line on stderr and exit code 2; nothing is overwritten without `--overwrite`.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any, Protocol

import cagefield
from cagefield.errors import CagefieldError, line_of, warnings_in_one_line

if TYPE_CHECKING:

    class Command(Protocol):
        """A parsed subcommand."""

        def run(self) -> None: ...


_LONGEST = 1200
"""Characters of an error message, which quotes the user's input."""

_DESCRIPTION = """Edit the geometry of a captured radiance field with two nested cages.

`cagefield demo` shows the whole chain on a built-in scene; `cagefield --version` prints the version."""


def main(argv: Sequence[str] | None = None) -> int:
    """Exit code of the command line `argv` (the process's own for None): 0, or 2 for bad input."""
    args = list(sys.argv[1:] if argv is None else argv)
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")  # names of folders may be no UTF-8
    if args in (["--version"], ["-V"]):
        print(f"cagefield {cagefield.__version__}")
        return 0
    try:
        command = parse(args or ["--help"])
        if isinstance(command, int):
            return command
        with warnings_in_one_line():
            command.run()
    except CagefieldError as error:
        return _refuse(str(error))
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except OSError as error:
        return _refuse(line_of(error))
    except MemoryError as error:
        return _refuse(f"there is not enough memory ({error or 'the system gave no more'})")
    except KeyboardInterrupt:
        print("cagefield: interrupted", file=sys.stderr)
        return 130
    return 0


def parse(args: list[str]) -> Command | int:
    """The subcommand that `args` ask for, or an exit code: 0 after help, 2 after a complaint."""
    import tyro

    from cagefield.cli.align import Align
    from cagefield.cli.bake import Bake
    from cagefield.cli.bench import Bench, bench_command
    from cagefield.cli.convert import Convert
    from cagefield.cli.demo import Demo
    from cagefield.cli.edit import ApplyEdits
    from cagefield.cli.export import Export
    from cagefield.cli.hotspot import HotspotCommand
    from cagefield.cli.import_field import ImportField
    from cagefield.cli.info import Info
    from cagefield.cli.make_scene import MakeScene
    from cagefield.cli.poses import Poses
    from cagefield.cli.render import Render
    from cagefield.cli.select import Select
    from cagefield.cli.train import Train
    from cagefield.cli.view import View

    # The benchmarks take a second to import, so only their own command line does.
    bench: Any = bench_command() if args[:1] == ["bench"] else Bench
    if args[:1] == ["bench"] and bench is Bench:
        return bench()
    commands = (
        Annotated[Demo, tyro.conf.subcommand("demo")]
        | Annotated[MakeScene, tyro.conf.subcommand("make-scene")]
        | Annotated[Poses, tyro.conf.subcommand("poses")]
        | Annotated[Train, tyro.conf.subcommand("train")]
        | Annotated[ImportField, tyro.conf.subcommand("import")]
        | Annotated[Convert, tyro.conf.subcommand("convert")]
        | Annotated[Bake, tyro.conf.subcommand("bake")]
        | Annotated[View, tyro.conf.subcommand("view")]
        | Annotated[ApplyEdits, tyro.conf.subcommand("edit")]
        | Annotated[Select, tyro.conf.subcommand("select")]
        | Annotated[Align, tyro.conf.subcommand("align")]
        | Annotated[HotspotCommand, tyro.conf.subcommand("hotspot")]
        | Annotated[Export, tyro.conf.subcommand("export")]
        | Annotated[Render, tyro.conf.subcommand("render")]
        | Annotated[Info, tyro.conf.subcommand("info")]
        | Annotated[bench, tyro.conf.subcommand("bench")]
    )
    complaint = io.StringIO()
    try:
        with contextlib.redirect_stderr(complaint):
            command: Command = tyro.cli(commands, prog="cagefield", description=_DESCRIPTION, args=args)
    except SystemExit as stop:
        if not stop.code:
            return 0
        return _refuse(_missing_output(args, complaint.getvalue()) or _without_box(complaint.getvalue()))
    return command


def _missing_output(args: list[str], complaint: str) -> str | None:
    """One line for a command whose output is given without -o; None for every other complaint."""
    text = " ".join(_without_box(complaint).split())
    found = re.search(r"Missing from (cagefield [\w-]+): -o PATH.*; Unrecognized options: ([^;]+);", text)
    if found is None or found[2] not in args or found[2].startswith("-"):
        return None
    return f"{found[1]} takes its output as -o OUT; give -o {found[2]}"


def _without_box(text: str) -> str:
    """tyro's framed message as one line: its paragraphs, with the title where they do not repeat it."""
    paragraphs = [""]
    title = ""
    for line in text.splitlines():
        words = line.strip("─╭╮╰╯│ ")
        if line.startswith("╭"):
            title = words
        elif words.strip("-"):
            paragraphs[-1] += words.rstrip(".") + " "
        elif paragraphs[-1]:
            paragraphs.append("")
    message = "; ".join(paragraph.strip() for paragraph in paragraphs if paragraph)
    return message if message.lower().startswith(title.lower()) else f"{title}: {message}"


def _refuse(message: str) -> int:
    """Exit code 2, after one line on stderr."""
    line = " ".join(message.split())
    line = line if len(line) <= _LONGEST else f"{line[: _LONGEST - 200]} ... {line[-200:]}"
    print("cagefield: " + line, file=sys.stderr)
    return 2
