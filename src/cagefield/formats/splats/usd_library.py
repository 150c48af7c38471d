"""USD library (`usd-core`, package pxr), imported where it is used, and its errors as ours.

The library writes its messages to stderr, several lines each; they are collected here instead.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

from cagefield.errors import FieldError

INSTALL = "pip install 'cagefield[usd]'"


def import_usd(name: object, action: str) -> Any:
    """Namespace of the modules of pxr: Gf, Sdf, Tf, Usd, UsdGeom, UsdUtils, Vt.

    Raises:
        FieldError: the library is not installed; `name` is the file, `action` such as "is read".
    """
    try:
        from pxr import Gf, Sdf, Tf, Usd, UsdGeom, UsdUtils, Vt
    except ImportError:
        raise FieldError(f"{name}: USD {action} by usd-core, which is not installed; {INSTALL}") from None
    return SimpleNamespace(Gf=Gf, Sdf=Sdf, Tf=Tf, Usd=Usd, UsdGeom=UsdGeom, UsdUtils=UsdUtils, Vt=Vt)


@contextmanager
def quiet_usd(usd: Any) -> Iterator[None]:
    """Context in which the library prints no messages."""
    delegate = usd.UsdUtils.CoalescingDiagnosticDelegate()
    try:
        yield
    finally:
        delegate.TakeUncoalescedDiagnostics()
        del delegate


def message_of(error: BaseException) -> str:
    """One line of an error of the library: its first message without the place in the library's code."""
    text = " ".join(str(error).split())
    if " : '" in text:
        text = text.split(" : '", 1)[1].split("' Error in ", 1)[0].rstrip("'")
    return text[:160]
