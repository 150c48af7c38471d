"""XML files of other programs, read without document types, entities, and trees of unbounded size."""

from __future__ import annotations

import codecs
from pathlib import Path
from xml.etree import ElementTree

from cagefield.errors import DatasetError
from cagefield.files.safe_open import read_bytes

MAX_TAGS = 2_000_000
"""Maximum number of characters `<` in a file: a tree takes a hundred bytes and more for each element."""

_BYTE_ORDER_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)


def read_xml(path: Path) -> ElementTree.Element:
    """Root element of an XML file.

    Raises DatasetError for a file that is no XML, has a document type (entities may grow without bounds), or
    is too large.
    """
    try:
        content = read_bytes(path)
        encoding = next((name for mark, name in _BYTE_ORDER_MARKS if content.startswith(mark)), "utf-8")
        text = content.decode(encoding)
    except (OSError, ValueError) as error:
        raise DatasetError(f"{path}: cannot be read ({error})") from None
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise DatasetError(f"{path}: has a document type (<!DOCTYPE), which is not read; remove it")
    if text.count("<") > MAX_TAGS:
        raise DatasetError(f"{path}: has {text.count('<')} tags, at most {MAX_TAGS} are read")
    try:
        return ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError) as error:
        raise DatasetError(
            f"{path}: not valid XML ({error}); the file may be cut off, export it again"
        ) from None


def child_text(element: ElementTree.Element | None, tag: str) -> str | None:
    """Text of an element's child; None where there is none, or no text in it."""
    child = None if element is None else element.find(tag)
    return None if child is None or not (child.text or "").strip() else child.text
