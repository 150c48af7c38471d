"""Ray sampling settings from the config of a nerf-pytorch checkpoint; network shapes come from the weights.

yenchenlin/nerf-pytorch writes "key = value" lines (args.txt, config.txt), krrish94/nerf-pytorch YAML
(config.yml). Both are stored beside their checkpoints.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cagefield.errors import FieldError
from cagefield.files import yaml_text
from cagefield.files.safe_open import read_text

CONFIG_NAMES = ("args.txt", "config.txt", "config.yml", "config.yaml")

_CURE = "give the config of the checkpoint's own training (--config)"

_OWN = {
    "N_importance",
    "N_samples",
    "datadir",
    "dataset_type",
    "i_embed",
    "no_ndc",
    "use_viewdirs",
    "white_bkgd",
}


@dataclass(frozen=True)
class SamplingSettings:
    """Ray sampling of a checkpoint; the defaults are those of the Blender scenes.

    near, far: planar depths; samples: (coarse, fine); ndc: True for a forward-facing capture in normalized
    device coordinates; white_background: whether the photos have a white background.
    """

    near: float = 2.0
    far: float = 6.0
    samples: tuple[int, int] = (64, 128)
    lindisp: bool = False
    ndc: bool = False
    white_background: bool = True


def find_config(checkpoint: Path) -> Path | None:
    """Path of the config beside a checkpoint, or None."""
    return next(
        (checkpoint.parent / name for name in CONFIG_NAMES if (checkpoint.parent / name).is_file()), None
    )


def read_config(path: Path | str) -> SamplingSettings:
    """Ray sampling in a config file of either nerf-pytorch.

    Raises:
        FieldError: a missing or invalid config, values of the wrong type, or an encoding that `NerfField`
            lacks.
    """
    path = Path(path)
    if not path.is_file():
        raise FieldError(f"{path}: no such config; give args.txt, config.txt or config.yml of the training")
    try:
        text = read_text(path)
        document = yaml_text.loads(text) if path.suffix in (".yml", ".yaml") else None
    except (OSError, UnicodeDecodeError, yaml_text.YamlError) as error:
        reason = " ".join(str(error).split())[:120].strip()
        raise FieldError(f"{path}: not a readable config ({reason}); {_CURE}") from error
    try:
        return _krrish94(document) if isinstance(document, dict) else _yenchenlin(text)
    except FieldError as error:
        raise FieldError(f"{path}: {error!s:.300}") from None
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        reason = f"{error!s:.60} is missing" if isinstance(error, KeyError) else f"{error!s:.160}"
        raise FieldError(f"{path}: not a nerf-pytorch config ({reason}); {_CURE}") from error


def _yenchenlin(text: str) -> SamplingSettings:
    values: dict[str, str] = {}
    for line in text.splitlines():
        key, equals, value = line.partition("#")[0].partition("=")
        if equals:
            values[key.strip()] = value.strip()
    if not values:
        raise FieldError(f'no line "key = value" in it; {_CURE}')
    if not _OWN & values.keys():
        raise FieldError(f"not a nerf-pytorch config: it has none of {', '.join(sorted(_OWN))}; {_CURE}")
    if values.get("i_embed", "0") not in ("0", "-1"):
        raise FieldError(
            f"i_embed = {values['i_embed']:.40}; only positional encodings (0) or none (-1) are read"
        )

    def flag(name: str) -> bool:
        return values.get(name, "False").lower() in ("true", "1", "yes")

    # The parser's own default is llff
    forward = values.get("dataset_type", "llff") == "llff"
    ndc = forward and not flag("no_ndc")
    if forward and not ndc:
        raise FieldError(
            "no_ndc = True: trained on an LLFF capture without NDC, in a world that nerf-pytorch centers and "
            "may make a sphere, which is not read; train it here: cagefield train --field nerf --ndc off"
        )
    return SamplingSettings(
        near=0.0 if ndc else 2.0,
        far=1.0 if ndc else 6.0,
        samples=(int(values.get("N_samples", 64)), int(values.get("N_importance", 0))),
        lindisp=flag("lindisp"),
        ndc=ndc,
        white_background=flag("white_bkgd"),
    )


def _krrish94(document: dict[str, Any]) -> SamplingSettings:
    data, rays = document["dataset"], document["nerf"]["validation"]
    for part in document.get("models", {}).values():
        for key in ("log_sampling_xyz", "log_sampling_dir"):
            if part.get(key, True) is not True:
                raise FieldError(f"{key} is {part[key]!r:.40}; only octaves (true) are read")
    near, far = float(data["near"]), float(data["far"])
    if not 0.0 <= near < far:
        raise FieldError(f"near is {near:g} and far {far:g}; they must satisfy 0 <= near < far")
    return SamplingSettings(
        near=near,
        far=far,
        samples=(int(rays["num_coarse"]), int(rays["num_fine"])),
        lindisp=bool(rays.get("lindisp", False)),
        ndc=not data["no_ndc"],
        white_background=bool(rays.get("white_background", False)),
    )
