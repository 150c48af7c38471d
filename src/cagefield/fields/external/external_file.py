"""Safetensors files of an ExternalField: its arrays by name, its options as JSON in the header."""

from __future__ import annotations

import json
from pathlib import Path

from cagefield.errors import FieldError
from cagefield.fields.external.external_field import ExternalField
from cagefield.fields.external.instant_ngp import InstantNgpField
from cagefield.fields.external.nerfacto import NerfactoField
from cagefield.fields.external.plenoctree import PlenOctreeField
from cagefield.fields.external.svraster import SvrasterField
from cagefield.fields.external.tensorf import TensorfField
from cagefield.fields.field_files import read_tensors, write_tensors
from cagefield.files import json_text

FORMAT_VERSION = "1"

_CURE = "copy it back or import the checkpoint again"

EXTERNAL_KINDS: dict[str, type[ExternalField]] = {
    kind.KIND: kind for kind in (TensorfField, PlenOctreeField, NerfactoField, InstantNgpField, SvrasterField)
}
"""Classes of fields by the kind in the header."""


def save_external(field: ExternalField, path: str | Path) -> None:
    """Write the field to a safetensors file; the folder must exist."""
    metadata = {"kind": field.KIND, "version": FORMAT_VERSION, "options": json.dumps(field.options())}
    write_tensors(path, field.arrays(), metadata)


def load_external(path: str | Path, kind: str) -> ExternalField:
    """Field of a safetensors file whose header names a kind of `EXTERNAL_KINDS`; does not need PyTorch.

    Raises:
        FieldError: the file is missing, truncated, of another kind or a newer version, or has arrays and
            options that do not fit each other.
    """
    metadata, arrays = read_tensors(path, kind, FORMAT_VERSION, _CURE)
    try:
        options = json_text.loads(metadata["options"])
        if not isinstance(options, dict):
            raise TypeError("options are no object")
        return EXTERNAL_KINDS[kind].from_arrays(arrays, options)
    except FieldError as error:
        raise FieldError(f"{path}: {error}") from error
    except (KeyError, IndexError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise FieldError(f"{path}: damaged header ({error!s:.160}); {_CURE}") from error
