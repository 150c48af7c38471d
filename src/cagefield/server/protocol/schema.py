"""The protocol as one JSON schema, of which the page's types are made.

Printed by `python -m cagefield.server.protocol.schema`.
"""

from __future__ import annotations

import json
from typing import Any

from pydantic import TypeAdapter

from cagefield.server.protocol.client_messages import PageMessage
from cagefield.server.protocol.server_messages import (
    EditsHeader,
    HighlightHeader,
    PictureHeader,
    ServerMessage,
)

_REF = "#/definitions/{model}"
_NUMBER = {"type": "number"}
_TUPLES: dict[str, dict[str, Any]] = {
    "Vec3": {"type": "array", "items": [_NUMBER] * 3, "minItems": 3, "maxItems": 3},
    "Corners": {"type": "array", "items": [{"$ref": "#/definitions/Vec3"}] * 8, "minItems": 8, "maxItems": 8},
}


def schema() -> dict[str, Any]:
    """JSON schema (tuples as in draft 4) that defines every message, `PageMessage` and `ServerMessage`.

    Messages of a page may leave out fields that have a default; messages of a server have them all, and so
    have those of both. Every `type` and `kind` is required.
    """
    page = TypeAdapter(PageMessage).json_schema(ref_template=_REF)
    server = TypeAdapter(ServerMessage).json_schema(ref_template=_REF)
    headers = {
        header.__name__: TypeAdapter(header).json_schema(ref_template=_REF)
        for header in (PictureHeader, EditsHeader, HighlightHeader)
    }
    definitions = {**page.pop("$defs"), **_complete({**server.pop("$defs"), **headers})}
    definitions |= {"PageMessage": page, "ServerMessage": server}
    for definition in definitions.values():
        _require(definition, [n for n, field in definition.get("properties", {}).items() if "const" in field])
    return {"title": "Protocol", "type": "object", "definitions": {**_TUPLES, **_plain(definitions)}}


def _complete(definitions: dict[str, Any]) -> dict[str, Any]:
    """The definitions with all their fields required."""
    for definition in definitions.values():
        _require(definition, list(definition["properties"]))
    return definitions


def _require(definition: dict[str, Any], names: list[str]) -> None:
    if names:
        definition["required"] = sorted({*definition.get("required", []), *names})


def _plain(part: Any) -> Any:
    """The schema with its tuples by name, other arrays of any length, and no titles."""
    if isinstance(part, list):
        return [_plain(item) for item in part]
    if not isinstance(part, dict):
        return part
    # A member of a message may be called "title", too.
    out = {
        key: {name: _plain(member) for name, member in value.items()}
        if key == "properties"
        else _plain(value)
        for key, value in part.items()
        if key not in ("title", "discriminator")
    }
    if "prefixItems" in out:
        items = out.pop("prefixItems")
        numbers = all(item.get("type") == "number" for item in items)
        if (numbers, len(items)) == (True, 3):
            return {"$ref": "#/definitions/Vec3"}
        if (numbers, len(items)) == (False, 8):
            return {"$ref": "#/definitions/Corners"}
        return out | {"items": items}
    out.pop("minItems", None)
    out.pop("maxItems", None)
    return out


if __name__ == "__main__":
    print(json.dumps(schema(), indent=1))
