"""Safetensors files of a NerfField: the weights by name, the options as JSON in the header."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from cagefield.errors import FieldError
from cagefield.fields.field_files import read_tensors, write_tensors
from cagefield.fields.mlp import Linear, Mlp
from cagefield.fields.nerf_field import NerfField
from cagefield.files import json_text

KIND = "NerfField"
FORMAT_VERSION = "1"

_OPTIONS = ("near", "far", "samples", "lindisp", "ndc", "bounded")


def save_nerf(field: NerfField, path: str | Path) -> None:
    """Write the field to a safetensors file (float32); the folder must exist."""
    networks = {"coarse": field.coarse, "fine": field.fine}
    state = {}
    for part, network in networks.items():
        for name, layer in [] if network is None else network.layers():
            state[f"{part}.{name}.weight"] = layer.weight
            state[f"{part}.{name}.bias"] = layer.bias
    options = {name: getattr(field, name) for name in _OPTIONS}
    options["bounds"] = field.bounds.tolist()
    options["rectified_feature"] = [n.rectified_feature for n in networks.values() if n is not None]
    metadata = {"kind": KIND, "version": FORMAT_VERSION, "options": json.dumps(options)}
    write_tensors(path, state, metadata)


def load_nerf(path: str | Path) -> NerfField:
    """NerfField of a safetensors file; does not need PyTorch.

    Raises:
        FieldError: the file is missing, truncated, of another kind or a newer version, or has tensors of
            mismatching shapes.
    """
    cure = "copy it back or import the checkpoint again"
    metadata, tensors = read_tensors(path, KIND, FORMAT_VERSION, cure)
    try:
        options = json_text.loads(metadata["options"])
        rectified = list(options.pop("rectified_feature"))
        coarse = _network(tensors, "coarse", bool(rectified[0]))
        fine = _network(tensors, "fine", bool(rectified[1])) if len(rectified) > 1 else None
        if options["ndc"] is not None:
            options["ndc"] = tuple(options["ndc"])
        return NerfField(coarse, fine, **options)
    except FieldError as error:
        raise FieldError(f"{path}: {error}") from error
    except (KeyError, IndexError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise FieldError(f"{path}: damaged header ({error}); write the field again") from error


def _network(tensors: dict[str, Any], part: str, rectified: bool) -> Mlp:
    def take(name: str) -> Linear:
        missing = [k for k in ("weight", "bias") if f"{part}.{name}.{k}" not in tensors]
        if missing:
            raise FieldError(f"tensor missing: {part}.{name}.{missing[0]}")
        return Linear(tensors[f"{part}.{name}.weight"], tensors[f"{part}.{name}.bias"], f"{part}.{name}")

    def count(prefix: str) -> int:
        pattern = re.compile(rf"{part}\.{prefix}\.(\d+)\.")
        found = {int(m.group(1)) for m in map(pattern.match, tensors) if m}
        if found and max(found) >= len(tensors):
            raise FieldError(f"{part}.{prefix}.{max(found)} is beyond its {len(tensors)} tensors")
        return max(found, default=-1) + 1

    return Mlp(
        trunk=tuple(take(f"trunk.{index}") for index in range(max(1, count("trunk")))),
        density=take("density"),
        rgb=take("rgb"),
        feature=take("feature") if f"{part}.feature.weight" in tensors else None,
        view=tuple(take(f"view.{index}") for index in range(count("view"))),
        rectified_feature=rectified,
    )
