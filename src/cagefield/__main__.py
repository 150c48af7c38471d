"""`python -m cagefield`."""

from __future__ import annotations

import sys

from cagefield.cli import main

sys.exit(main())
