"""Messages about selected elements: the rendering process picks, the session keeps the selection."""

from __future__ import annotations

import numpy as np

from cagefield.cameras.camera import Camera
from cagefield.errors import CagefieldError
from cagefield.geometry.cage import Cage
from cagefield.selection.brush_and_lasso import Lasso, Rectangle, Stroke
from cagefield.selection.element_selection import Selection
from cagefield.server.editor.session import NOTHING_SELECTED
from cagefield.server.protocol import selection_messages as messages
from cagefield.server.protocol.server_messages import HistogramCounts
from cagefield.server.render_queue.coordinator import Coordinator, Page
from cagefield.server.render_worker.picks import (
    EveryPick,
    FloaterPick,
    FloodPick,
    NeighborPick,
    Pick,
    RangePick,
    RegionPick,
)
from cagefield.server.render_worker.tasks import BoxTask, HistogramTask, PickTask
from cagefield.server.web.point_handlers import load_free_form

_LABELS = {"all": "Select all", "grow": "Grow selection", "shrink": "Shrink selection"}


async def change_selection(coordinator: Coordinator, page: Page, message: messages.SelectionMessage) -> None:
    """Follow a message about selected elements. Raises CagefieldError where it cannot be followed."""
    if isinstance(message, messages.Isolate):
        coordinator.session.isolate(message.on)
    elif isinstance(message, messages.RemoveElements):
        _remove(coordinator, message)
    elif isinstance(message, messages.SelectionCage):
        if message.cage != "box":
            await load_free_form(page, message.cage)
        await _place_cage(coordinator, message)
    elif isinstance(message, messages.ChangeSelection):
        await _change(coordinator, message)
    else:
        label, pick = _pick_of(coordinator, page, message)
        picked = await _picked(coordinator, pick)
        if not picked and message.mode == "replace":
            page.notice("info", "nothing there: the selection is empty")
        coordinator.session.pick(label, picked, message.mode)


def _remove(coordinator: Coordinator, message: messages.RemoveElements) -> None:
    if message.restore:
        coordinator.session.restore_elements()
        return
    if coordinator.store.scene.original is not None:
        raise CagefieldError(
            "the scene has the NeRF that its voxels were baked from, of which nothing can be deleted; "
            "delete with a cage (E, then Delete as its kind)"
        )
    coordinator.session.remove_elements()


async def histogram_of(coordinator: Coordinator, attribute: messages.AttributeName) -> HistogramCounts:
    """Histogram of an attribute of the field's elements, the selected ones counted apart."""
    selection = coordinator.session.document.selection
    found = await coordinator.ask(lambda number: HistogramTask(number, attribute, selection))
    return HistogramCounts(
        low=found.low, high=found.high, counts=list(found.counts), selected=list(found.selected)
    )


async def _change(coordinator: Coordinator, message: messages.ChangeSelection) -> None:
    session = coordinator.session
    before = session.document.selection
    if message.change == "none":
        session.select_elements("Select none", None)
    elif message.change == "invert" and before is not None:
        session.select_elements("Invert selection", before.inverse)
    elif message.change in ("all", "invert"):
        session.pick(_LABELS["all"], await _picked(coordinator, EveryPick()))
    else:
        if before is None:
            raise CagefieldError(NOTHING_SELECTED)
        pick = NeighborPick(before, 1 if message.change == "grow" else -1)
        session.pick(_LABELS[message.change], await _picked(coordinator, pick))


async def _place_cage(coordinator: Coordinator, message: messages.SelectionCage) -> None:
    selection = coordinator.session.document.selection
    if selection is None:
        raise CagefieldError(NOTHING_SELECTED)
    shown = coordinator.shown()
    cage: Cage = await coordinator.ask(
        lambda number: BoxTask(number, shown, selection, message.margin, message.cage)
    )
    coordinator.session.place_around_selection(cage)


def _pick_of(coordinator: Coordinator, page: Page, message: messages.SelectionMessage) -> tuple[str, Pick]:
    """(label of the history, elements to pick) of a message. Raises CagefieldError for impossible ones."""
    if isinstance(message, messages.SelectRegion):
        tolerance = None if message.through else message.tolerance
        return f"Select by {message.shape}", RegionPick(_region_of(message), _camera_of(page), tolerance)
    if isinstance(message, messages.SelectFlood):
        low, high = coordinator.session.bounds
        reach = None if message.reach == 1.0 else message.reach * float(np.linalg.norm(high - low))
        camera = _camera_of(page)
        return "Select by flood", FloodPick(camera, message.x, message.y, message.threshold, reach)
    if isinstance(message, messages.SelectRange):
        if message.low > message.high:
            raise CagefieldError(f"the range of {message.attribute} must have low <= high")
        return f"Select by {message.attribute}", RangePick(message.attribute, message.low, message.high)
    assert isinstance(message, messages.SelectFloaters)
    return "Select floaters", FloaterPick(message.strength)


def _region_of(message: messages.SelectRegion) -> Rectangle | Lasso | Stroke:
    if message.shape == "lasso":
        return Lasso(tuple(message.points))
    if message.shape == "brush":
        return Stroke(tuple(message.points), message.radius)
    if len(message.points) != 2:
        raise CagefieldError(f"a rectangle has 2 corners, got {len(message.points)}")
    return Rectangle(*message.points)


def _camera_of(page: Page) -> Camera:
    if page.camera is None:
        raise CagefieldError("the page has sent no camera yet; try again")
    return page.camera


async def _picked(coordinator: Coordinator, pick: Pick) -> Selection:
    shown = coordinator.shown()
    found: Selection = await coordinator.ask(lambda number: PickTask(number, shown, pick))
    return found
