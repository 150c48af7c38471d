"""Chains of edits: an edit with a parent is carried by it, as a finger is by its arm.

The cages and operations of a child are set at rest: in the space of its parent's inner cage, before the
parent's edit moves anything. Let psi_P and psi_C take canonical to deformed points. A child after its parent
is carried there, psi_P psi_C psi_P^-1, so that both together are

    (psi_P psi_C psi_P^-1) psi_P = psi_P psi_C

which is the child's own map directly before its parent's. A chain is therefore resolved by an order of the
stack, exactly, for every kind of parent: no cage is transported, and a composition of one-to-one maps is
one to one. `resolved_edits` is that order; renderers and exports see no parents.
"""

from __future__ import annotations

from collections.abc import Sequence

from cagefield.edits.edit import Edit, Paste
from cagefield.errors import EditError


def application_order(edits: Sequence[Edit]) -> tuple[int, ...]:
    """Numbers of edits, from 0, in the order of application: children in order directly before their parent.

    Edits without a parent keep their order. Raises `EditError` as `parent_numbers`.
    """
    parents = parent_numbers(edits)
    children: dict[int | None, list[int]] = {}
    for number, parent in enumerate(parents):
        children.setdefault(parent, []).append(number)
    # A parent before its children, the last child first: the reverse of the order that is asked for.
    reverse: list[int] = []
    waiting = list(children.get(None, ()))
    while waiting:
        number = waiting.pop()
        reverse.append(number)
        waiting.extend(children.get(number, ()))
    return tuple(reversed(reverse))


def resolved_edits(edits: Sequence[Edit]) -> tuple[Edit, ...]:
    """The edits in the order of application, without parents. Raises `EditError` as `parent_numbers`."""
    if not any(edit.parent for edit in edits):
        return tuple(edits)
    return tuple(edits[number].without_parent for number in application_order(edits))


def parent_numbers(edits: Sequence[Edit]) -> tuple[int | None, ...]:
    """Number of each edit's parent, from 0; None without a parent.

    Raises `EditError` for the first edit whose parent is missing, a paste, or one of two with that name, and
    for parents in a circle.
    """
    numbers: dict[str, list[int]] = {}
    for number, edit in enumerate(edits):
        numbers.setdefault(edit.name, []).append(number)
    parents = [_parent_number(edit, edits, numbers) if edit.parent else None for edit in edits]
    _check_circles(edits, parents)
    return tuple(parents)


def problem_of_chains(edits: Sequence[Edit]) -> tuple[int, str] | None:
    """(number of the edit, error text) of the first fault that `parent_numbers` finds, or None."""
    try:
        parent_numbers(edits)
    except ChainError as error:
        return error.number, str(error)
    return None


class ChainError(EditError):
    """A parent that is not possible; `number` is the place of the child in its stack, from 0."""

    def __init__(self, message: str, number: int) -> None:
        super().__init__(message)
        self.number = number


def ancestors(edits: Sequence[Edit], number: int) -> tuple[int, ...]:
    """Numbers of an edit's parent, the parent's parent, and so on. Raises `EditError` as `parent_numbers`."""
    parents = parent_numbers(edits)
    found: list[int] = []
    while (parent := parents[number]) is not None:
        found.append(parent)
        number = parent
    return tuple(found)


def _parent_number(edit: Edit, edits: Sequence[Edit], numbers: dict[str, list[int]]) -> int:
    named = numbers.get(edit.parent, [])
    child = next(n for n, other in enumerate(edits) if other is edit)
    if len(named) == 1:
        if not isinstance(edits[named[0]], Paste):
            return named[0]
        problem = f'its parent "{edit.parent}" is a paste, which carries no edits; put the edit after it'
    elif named:
        problem = f'its parent "{edit.parent}" is the name of {len(named)} edits; rename all but one'
    else:
        others = [f'"{other.name}"' for other in edits if other.name and other is not edit][:8]
        cure = f"name one of {', '.join(others)}" if others else "name another edit of the stack"
        problem = f'its parent "{edit.parent}" is not in the stack; {cure}, or leave parent out'
    raise ChainError(str(edit.error(problem)), child)


def _check_circles(edits: Sequence[Edit], parents: Sequence[int | None]) -> None:
    rooted: set[int] = set()
    for number in range(len(edits)):
        way: list[int] = []
        at: int | None = number
        while at is not None and at not in rooted:
            if at in way:
                names = " -> ".join(f'"{edits[n].name}"' for n in [*way[way.index(at) :], at])
                raise ChainError(
                    str(edits[at].error(f"parents go in a circle, {names}; leave out one parent")), at
                )
            way.append(at)
            at = parents[at]
        rooted.update(way)
