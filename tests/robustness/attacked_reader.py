"""The process that is attacked: reads one damaged input after the other and says what came of each.

python attacked_reader.py FOLDER SEED MODULE READER FIRST LAST [READER FIRST LAST ...]: makes a reader's
honest seed in FOLDER/NUMBER, and for every number from FIRST to LAST damages it, reads it, and prints one
line of JSON. The input that is read lies in that folder. MODULE has the READERS.
"""

from __future__ import annotations

import contextlib
import ctypes
import gc
import importlib
import json
import random
import resource
import sys
import time
import traceback
import warnings
from pathlib import Path
from typing import Any

MOST = 3 << 30
"""Bytes of addresses that reading may take: a request for more is a MemoryError, and counted."""

LONGEST = 1000
"""Characters of a refusal."""


def main(folder: Path, seed: str, module: str, work: list[str]) -> None:
    """See the module."""
    here = Path(__file__).resolve().parent
    sys.path[:0] = [str(here), str(here.parent)]
    warnings.simplefilter("ignore")
    known = importlib.import_module(module).READERS

    for number, at in enumerate(range(0, len(work), 3)):
        place = folder / str(number)
        place.mkdir()
        attacked(known[work[at]], work[at], place, range(int(work[at + 1]), int(work[at + 2])), seed)


def attacked(reader: Any, name: str, folder: Path, numbers: range, seed: str) -> None:
    """Damages and reads one reader's seed, as often as there are numbers."""
    import mutators

    reader.make(folder)
    honest = {place: (folder / place).read_bytes() for place in reader.damaged}
    reader.read(folder)
    gc.collect()
    gc.freeze()  # modules, through which every later collection would go
    memory = max(_measured(lambda: reader.read(folder)) for _ in range(3))
    limit = _now("VmSize") + MOST
    resource.setrlimit(resource.RLIMIT_AS, (limit, resource.RLIM_INFINITY))
    say({"reader": name, "folder": str(folder), "honest": memory})
    for number in numbers:
        chance = random.Random(f"{seed} {name} {number}")
        place = chance.choice(list(honest))
        (folder / place).write_bytes(mutators.mutate(reader.damaged[place], honest[place], chance))
        if name == "messages":
            (folder / "which").write_text(json.dumps(place))
        say({"begin": number, "place": place})
        result: list[str] = []
        begun = time.process_time()
        taken = _measured(lambda: result.extend(_attempt(reader, folder)))  # noqa: B023
        seconds = time.process_time() - begun
        say({"end": number, "what": result[0], "text": result[1][:300], "memory": taken, "seconds": seconds})
        (folder / place).write_bytes(honest[place])
    resource.setrlimit(resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))


def _attempt(reader: Any, folder: Path) -> tuple[str, str]:
    """(what came of reading, a line about it)."""
    from cagefield.errors import CagefieldError, line_of

    try:
        reader.read(folder)
    except (CagefieldError, OSError) as error:
        text = str(error) if isinstance(error, CagefieldError) else line_of(error)
        return ("refused" if len(text) < LONGEST else "long"), text
    except MemoryError:
        return "memory", "MemoryError"
    except BaseException as error:
        trace = traceback.extract_tb(error.__traceback__)
        own = [frame for frame in trace if "cagefield" in frame.filename] or trace
        at = f"{Path(own[-1].filename).name}:{own[-1].lineno}"
        return "crashed", f"{type(error).__name__}: {str(error)[:160]!r} at {at}"
    return "read", ""


def say(content: dict[str, Any]) -> None:
    """One line on stdout."""
    print(json.dumps(content), flush=True)


def _measured(work: Any) -> int:
    """Bytes that the process grew by while it worked, at most."""
    _let_go()
    Path("/proc/self/clear_refs").write_text("5")  # the peak begins anew
    before = _now("VmRSS")
    work()
    return max(0, _now("VmHWM") - before)


def _let_go() -> None:
    """Gives the system back what earlier inputs took, so that it is not overlooked when the next takes it."""
    gc.collect()
    with contextlib.suppress(AttributeError):  # not in every C library
        ctypes.CDLL(None).malloc_trim(0)


def _now(field: str) -> int:
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(field + ":"):
            return int(line.split()[1]) << 10
    raise RuntimeError(f"this system does not say its {field}")


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2], sys.argv[3], sys.argv[4:])
