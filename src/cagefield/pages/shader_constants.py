"""Constants that the page's shaders share with Python, of which `web/src/field/layout.ts` is generated.

Printed as JSON by `python -m cagefield.pages.shader_constants`.
"""

from __future__ import annotations

import json

from cagefield.edits.device import packing
from cagefield.pages import row_layout
from cagefield.rendering.splats.kernels import projection

SPLAT_NAMES = ("BLUR", "SLOPE_BLUR", "ALPHA_MIN", "ALPHA_MAX", "LEAST_COMPENSATION")
"""Constants of the projection and blending of splats."""


def shader_constants() -> dict[str, dict[str, float]]:
    """Names and values of the constants, by the name of the TypeScript object that holds them."""
    rows = {name: value for name, value in vars(row_layout).items() if name.isupper()}
    splats = {name: getattr(projection, name) for name in SPLAT_NAMES}
    return {"EDIT_LAYOUT": {**rows, "EDGE": packing.EDGE}, "SPLAT_CONSTANTS": splats}


if __name__ == "__main__":
    print(json.dumps(shader_constants(), indent=1))
