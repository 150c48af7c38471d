"""Numbers, words and sizes that readers do not expect."""

from __future__ import annotations

NUMBERS = (
    "1e999",
    "-1e999",
    "9" * 400,
    "-" + "9" * 5000,
    "NaN",
    "Infinity",
    "-Infinity",
    "0",
    "-1",
    "1e308",
    "5e-324",
    "1e39",
    "2147483648",
    "4294967295",
    "9223372036854775808",
    "0.5",
    "-0.0",
    "1e-400",
    "16777217",
    "1000000",
)
WORDS = (
    "\\ud800",
    "\\u0000",
    "\\udfff\\ud800",
    "\u202e\u0301" * 20,
    "x" * 10_000,
    "",
    "..",
    "../../etc/passwd",
    "/",
    "\U0001f9ff",
    "\\uFFFF",
    "%s%n",
    "~",
    "\u00e9\u0301",
    "a\\nb",
    "con",
    "\ufeff",
)
YAML = (
    "!!int ''",
    "!!float x",
    "!!binary '*'",
    "!!timestamp x",
    "!!python/object/apply:os.system [id]",
    "*a",
    "&a [*a]",
    "!!set {a, b}",
    "<<: 3",
    "? [a]",
    "|",
    ".inf",
    ".nan",
    "1:60:60",
    "0b2",
    "0x",
    "1_0",
    "2001-99-99",
    "!!omap [1]",
    "!!null x",
    "!!bool 2",
    "%TAG",
    "- -",
    "\t",
)
DEEP = (30, 100, 2_000, 100_000)
INTEGERS = (0, 1, 2, 255, 65535, 2**31 - 1, 2**31, 2**32 - 1, 2**40, 2**62, 2**63 - 1, 2**64 - 1)
FLOATS = (0.0, -1.0, float("nan"), float("inf"), 3.4e38, 1e-45, 1e300)
BOMB = 256 << 20
"""Bytes that a bomb unpacks to: more than any honest file here takes."""
