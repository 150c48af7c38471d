"""`python -m benchmarks`: the commands of `cagefield bench`."""

from __future__ import annotations

import sys

from cagefield.cli import main

if __name__ == "__main__":
    sys.exit(main(["bench", *sys.argv[1:]]))
