"""The edit cases: an edit file of the package, and what it should look like.

The truth of a discrete edit is the scene whose part was really moved, stated here without the edit file: an
edit that is applied wrongly does not agree with it. The truth of a continuous edit is the scene seen through
the edit's exact map; inside its cage that of a free-form edit is also the scene whose part is bent, twisted
or pulled in closed form, without the code of edits.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.resources import files
from typing import Literal

import numpy as np

from cagefield.edits import Continuous, Delete, EditStack, Move
from cagefield.edits.edit_files import parse_edits
from cagefield.errors import CagefieldError
from cagefield.procedural import ProceduralScene
from cagefield.procedural.deformations import ArcBend, AxialTwist, PointPull
from cagefield.warps import mesh_flow

WEIGHT_CENTER = (-0.6493, 0.0, 0.142)
PINECONE_CENTER = (0.419, -0.3, -0.211)


@dataclass(frozen=True)
class Case:
    """An edit of a built-in scene: examples/`file` in the package.

    `moved` is the truth of the edit, None where that is the scene seen through the exact map. `deformed` is
    the scene of the truth in closed form, of which the inside of the last edit's inner cage is compared.
    `blend` is that of the vertices' motion inside of a mesh cage: the product's is harmonic.
    """

    scene: str
    name: str
    moved: Callable[[ProceduralScene], ProceduralScene] | None = None
    named_file: str | None = None
    deformed: Callable[[ProceduralScene], ProceduralScene] | None = None
    blend: Literal["harmonic", "mean value"] = "harmonic"

    @property
    def file(self) -> str:
        """Name of the edit file."""
        return self.named_file or f"{self.scene}_{self.name}.yaml"

    @property
    def text(self) -> str:
        """Content of the edit file."""
        return files("cagefield").joinpath("examples").joinpath(self.file).read_text(encoding="utf-8")

    @property
    def given(self) -> EditStack:
        """The edit stack of the file."""
        return parse_edits(self.text, source=self.file)

    @property
    def edits(self) -> EditStack:
        """Measured edits: an exact map, where that is the truth, carries the light along as it was."""
        if self.moved is not None:
            return self.given
        # Results of an edit are kept for all equal edits: another blend takes another name.
        named = {} if self.blend == "harmonic" else {"name": self.name}
        return EditStack(edit.replace(relight="none", **named) for edit in self.given)

    @contextmanager
    def blended(self) -> Iterator[None]:
        """Context in which maps of mesh cages have the case's blend."""
        sweeps = mesh_flow.HARMONIC_SWEEPS
        mesh_flow.HARMONIC_SWEEPS = sweeps if self.blend == "harmonic" else 0
        try:
            yield
        finally:
            mesh_flow.HARMONIC_SWEEPS = sweeps

    @property
    def kind(self) -> str:
        """Kind of the edits: continuous where one of them is, else the kind of the first."""
        if any(isinstance(edit, Continuous) for edit in self.edits):
            return "continuous"
        first = self.edits[0]
        return "delete" if isinstance(first, Delete) else "move" if isinstance(first, Move) else "copy"


CASES = (
    Case("digger", "raise_arm", named_file="digger.yaml"),
    Case("digger", "turn_cabin"),
    Case("digger", "move_cone", lambda s: s.move("cone", translate=(0, -0.97, 0))),
    Case("digger", "copy_cone", lambda s: s.duplicate("cone", translate=(-1.42, -1.03, 0))),
    Case("digger", "delete_bucket", lambda s: s.remove("bucket")),
    Case("chair", "lower_wider"),
    Case("chair", "lean_back"),
    Case("chair", "higher_crest"),
    Case("chair", "move_arm_rest", lambda s: s.move("arm rest left", translate=(0, 0.3, 0))),
    Case("chair", "copy_cushion", lambda s: s.duplicate("cushion", translate=(0, 0, 0.146))),
    Case("chair", "delete_back", lambda s: s.remove("back")),
    Case("microphone", "bigger_head"),
    Case("microphone", "push_head"),
    Case("microphone", "move_weight", lambda s: s.move("weight", translate=(-0.1782, 0, -0.0908))),
    Case(
        "microphone",
        "copy_weight",
        lambda s: s.duplicate("weight", translate=(0, 0, -0.4), scale=0.8, pivot=WEIGHT_CENTER),
    ),
    Case("microphone", "delete_base", lambda s: s.remove("base")),
    Case("plant", "taller"),
    Case("plant", "lopsided"),
    Case(
        "plant",
        "move_pinecone",
        lambda s: s.move(
            "pinecone", translate=(-0.43, -0.31, 0), rotate=(0, 0, np.radians(70)), pivot=PINECONE_CENTER
        ),
    ),
    Case(
        "plant",
        "copy_pinecone",
        lambda s: s.duplicate("pinecone", translate=(0.05, 0.68, -0.0593), scale=0.75, pivot=PINECONE_CENTER),
    ),
    Case("plant", "delete_flower", lambda s: s.remove("flower")),
)

ARM_BEND = ArcBend((0.69, -0.11, 0.58), (0, 0, -1), (1, 0, 0), 0.94, np.radians(40))
STEM_TWIST = AxialTwist((-0.2, 0.12, 0.01), (0, 0, 1), 0.96, np.radians(90))
CABLE_BEND = ArcBend((-0.05, 0.07, 0.28), (0, 0, -1), (1, 0, 0), 0.3, np.radians(35))
CREST_PULL = PointPull((-0.57, 0, 0.97), (0.12, 0, 0.22), 0.45)

FLOWER_PIVOT = (-0.18, 0.11, 0.83)


def _bent_arm(scene: ProceduralScene) -> ProceduralScene:
    parts = ("stick", "bucket")
    return scene.deform(parts, ARM_BEND).move(parts, translate=(0, 0, 0.12))


FREE_FORM_CASES = (
    Case("digger", "bend_arm", deformed=_bent_arm),
    Case("digger", "bend_arm_mesh", deformed=_bent_arm),
    Case(
        "digger",
        "bend_arm_mean_value",
        named_file="digger_bend_arm_mesh.yaml",
        deformed=_bent_arm,
        blend="mean value",
    ),
    Case("digger", "move_painted_cone", lambda s: s.move("cone", translate=(0, -0.97, 0))),
    Case("plant", "twist_stem", deformed=lambda s: s.deform(("plant", "flower"), STEM_TWIST)),
    Case("plant", "pull_flower", deformed=lambda s: s.move("flower", translate=(0.1, -0.1, 0.12))),
    Case(
        "plant",
        "turn_painted_flower",
        deformed=lambda s: s.move(
            "flower", translate=(0.1, -0.1, 0.12), rotate=(0, np.radians(25), 0), pivot=FLOWER_PIVOT
        ),
    ),
    Case("microphone", "straighten_cable", deformed=lambda s: s.deform("cable", CABLE_BEND)),
    Case("chair", "pull_crest", deformed=lambda s: s.deform("back", CREST_PULL)),
)
"""Edits by lattices, meshes, control points and painted selections, measured where they are named: the other
methods of the shell have no such cages."""

_STRETCHED = ("tracks", "body", "cabin", "boom", "stick", "bucket", "cone")

ROOM_CASES = (
    Case(
        "room-digger",
        "taller",
        lambda s: s.move(_STRETCHED, scale=(1, 1, 2), pivot=(0, 0, -0.408)),
        "room_digger_taller.yaml",
    ),
    Case(
        "room-digger",
        "move_cone",
        lambda s: s.move("cone", translate=(-0.25, -1.5, -0.092)),
        "room_digger_move_cone.yaml",
    ),
)
"""Edits of fields trained on the built-in rooms; the continuous one scales whole parts, which has a truth."""


def chosen(scenes: Sequence[str] = (), names: Sequence[str] = ()) -> tuple[Case, ...]:
    """The cases of these scenes and of these names; empty means all but those of free form.

    Raises:
        CagefieldError: a scene or a name that no case has, or no case with both.
    """
    cases = (*CASES, *FREE_FORM_CASES) if names else CASES
    for what, wanted, known in (
        ("scene", scenes, [case.scene for case in cases]),
        ("edit", names, [case.name for case in cases if not scenes or case.scene in scenes]),
    ):
        unknown = [name for name in wanted if name not in known]
        if unknown:
            raise CagefieldError(
                f"there is no {what} {', '.join(map(repr, unknown))} to measure; choose from "
                f"{', '.join(dict.fromkeys(known))}"
            )
    return tuple(
        case for case in cases if (not scenes or case.scene in scenes) and (not names or case.name in names)
    )
