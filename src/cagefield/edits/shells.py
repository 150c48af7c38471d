"""Shell kinds of a continuous edit: the map between its cages, as a value with the options of that map."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

from cagefield.errors import EditError
from cagefield.geometry.cage import Cage
from cagefield.warps import FALLOFFS, Falloff, Shell, TrilinearShell, flow_between


@dataclass(frozen=True)
class ShellKind(ABC):
    """Factory of the map between the cages of a continuous edit."""

    @property
    @abstractmethod
    def name(self) -> str:
        """Name of the kind in files and messages."""

    @abstractmethod
    def build(self, inner: Cage, deformed: Cage, outer: Cage) -> Shell:
        """Shell map between the outer cage and the inner cage, which goes from `inner` to `deformed`."""

    def problem_of_inner(self, inner: Cage) -> str | None:
        """Why the kind has no map around such an inner cage, and the cure; None where it has one."""
        return None


def problem_of_falloff(falloff: str, width: float) -> str | None:
    """Error text for an unknown falloff profile or a width outside (0, 1]; None for valid ones."""
    if falloff not in FALLOFFS:
        return f'falloff must be one of {", ".join(FALLOFFS)}, got "{falloff!s:.40}"'
    if not 0.0 < width <= 1.0:
        return f"width must be above 0 and at most 1 (the whole shell), got {width!r}"
    return None


@dataclass(frozen=True)
class Flow(ShellKind):
    """Flow of a velocity field between the cages; never folds.

    Parameters
    - falloff: profile by which the motion fades between the cages, "smooth" or "linear".
    - width: share of the shell that moves, in (0, 1]: from "only near the inner cage" to the whole shell.

    Raises `EditError` for an unknown profile and a width outside (0, 1].
    """

    falloff: str = "smooth"
    width: float = 1.0

    def __post_init__(self) -> None:
        problem = problem_of_falloff(self.falloff, self.width)
        if problem is not None:
            raise EditError(problem)

    @property
    def name(self) -> str:
        return "flow"

    def build(self, inner: Cage, deformed: Cage, outer: Cage) -> Shell:
        return flow_between(inner, deformed, outer, Falloff(self.falloff, self.width))

    def problem_of_inner(self, inner: Cage) -> str | None:
        if not inner.has_own_falloff or self == SMOOTH_FLOW:
            return None
        return (
            f"{inner.plural_noun} have a falloff and a radius of their own; leave out falloff and width of"
            " the shell"
        )


@dataclass(frozen=True)
class Trilinear(ShellKind):
    """Trilinear interpolation between the cages' faces, the paper's shell; folds under large motions."""

    @property
    def name(self) -> str:
        return "trilinear"

    def build(self, inner: Cage, deformed: Cage, outer: Cage) -> Shell:
        return TrilinearShell(inner, deformed, outer)

    def problem_of_inner(self, inner: Cage) -> str | None:
        if inner.is_hexahedron:
            return None
        return f"a trilinear shell joins cages with 8 corners, not {inner.plural_noun}; use the flow shell"


SHELL_KINDS: dict[str, type[Flow] | type[Trilinear]] = {"flow": Flow, "trilinear": Trilinear}
"""Shell kinds by the names of edit files."""


SMOOTH_FLOW = Flow()
"""The default shell kind."""


@dataclass(frozen=True)
class ShellSettings:
    """Settings of a continuous edit: its outer cage, shell kind, lattice and fold check.

    A discrete edit has no shell. Its `shell_settings` come from edit files and from the editor, have no
    effect, and become those of a continuous edit when the kind of the edit is changed.
    """

    outer: Cage | None = None
    shell: ShellKind = SMOOTH_FLOW
    lattice: int | None = None
    allow_folding: bool = False


NO_SHELL = ShellSettings()
"""Settings of a discrete edit that has never been continuous."""


def shell_kind(name: str) -> ShellKind:
    """Shell kind of a name, "flow" or "trilinear", with its default options.

    Raises `EditError` for an unknown name.
    """
    problem = problem_of_shell_name(name)
    if problem is not None:
        raise EditError(problem)
    return SHELL_KINDS[name]()


def problem_of_shell_name(name: str) -> str | None:
    """Error text for the name of an unknown shell kind; None for a known one."""
    if name in SHELL_KINDS:
        return None
    return f'shell must be one of {", ".join(SHELL_KINDS)}, got "{name!s:.40}"'


def problem_of_unused_falloff(flow: Flow, owner: str) -> str | None:
    """Error text for a falloff or width, other than the default, of an `owner` without a flow shell."""
    for option in ("falloff", "width"):
        if getattr(flow, option) != getattr(SMOOTH_FLOW, option):
            return (
                f'{option} is an option of the flow shell, and a {owner} has none; set shell="flow" (and'
                f' adjustment="continuous") or leave {option} out'
            )
    return None
