"""One page of a soak from its opening to its end: what people do, by chance."""

from __future__ import annotations

import contextlib
import json
import random
import time
import urllib.error
import urllib.request
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from editor_server import PageClient

if TYPE_CHECKING:
    from soak import Soak

EDITS = 4
"""A page that finds more edits than this loads two again."""

START = """{"edits": [
  {"name": "left", "inner": {"center": [-0.3, 0, 0], "size": 0.5}, "outer": {"margin": 0.3}},
  {"name": "right", "inner": {"center": [0.3, 0, 0], "size": 0.5}, "adjustment": "discrete"}
]}"""


@dataclass
class Visit:
    """See the module."""

    soak: Soak
    client: PageClient
    hello: dict[str, Any]
    chance: random.Random
    number: int
    state: dict[str, Any] = field(default_factory=dict)
    count: int = 0
    """Of questions, drags and cameras."""

    dropped: bool = False
    """Another page has taken over what this one drags, or undone it."""

    def __post_init__(self) -> None:
        self.state = self.client.joined
        if self.chance.random() < 0.25:
            # As a page with a GPU does, which then gets edits in the place of pictures.
            self.client.send("drawing", here="all")
        self.look()

    def read(self, seconds: float) -> None:
        """Takes what comes for so long."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            try:
                message = self.client.take(left)
            except TimeoutError:
                return
            if isinstance(message, dict):
                self._read(message)
            self.client.messages.clear()
            self.client.pictures.clear()

    def _read(self, message: dict[str, Any]) -> None:
        if message["type"] == "state":
            self.state = message
        elif message["type"] == "notice" and message["level"] != "info":
            self.soak.refused[" ".join(message["text"].split()[:4])] += 1
            self.dropped |= message["text"].startswith("this drag is over")

    def act(self) -> None:
        """One of the things that people do."""
        actions = {
            self.look: 4, self.drag: 6, self.apply: 3, self.set_cage: 1, self.change: 3, self.travel: 4,
            self.place: 1, self.remove: 1, self.path: 1, self.play: 1, self.job: 0.3, self.save: 1,
            self.ask: 2, self.download: 1, self.show: 1, self.screenshot: 0.3,
        }  # fmt: skip
        if len(self.edits) > EDITS or not self.edits:
            action = self.load
        else:
            [action] = self.chance.choices(list(actions), list(actions.values()))
        action()
        self.soak.done[action.__name__] += 1

    @property
    def edits(self) -> list[dict[str, Any]]:
        """Edits of the last state."""
        found: list[dict[str, Any]] = self.state["edits"]
        return found

    def edit(self) -> int:
        """One of them, rather one that moves something."""
        moving = [edit for edit in self.edits if edit["kind"] != "delete"]
        number: int = self.chance.choice(moving or self.edits)["id"]
        return number

    def look(self) -> None:
        """Turns the camera around the scene, then rests."""
        c2w = np.array(self.hello["start"]["c2w"]).reshape(4, 4)
        angle = self.chance.uniform(-np.pi, np.pi)
        turn = np.eye(4)
        turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        for moving in (True, True, False):
            self.count += 1
            camera = self.hello["start"] | {
                "c2w": (turn @ c2w).ravel().tolist(),
                "width": 96, "height": 64, "seq": self.count, "moving": moving,
            }  # fmt: skip
            self.client.send(**(camera | {"kind": camera.pop("type")}))
            self.read(0.05)

    def operation(self) -> dict[str, Any]:
        """A small move or turn."""
        by = [self.chance.uniform(-0.05, 0.05) for _ in range(3)]
        if self.chance.random() < 0.5:
            return {"kind": "translate", "by": by}
        return {"kind": "scale", "by": [1.0 + value for value in by]}

    def drag(self) -> None:
        """Drags an edit: ends it, gives it up, or leaves it to the next one."""
        self.count += 1
        drag, operation, self.dropped = self.count, self.operation(), False
        self.client.send("drag_begin", drag=drag, edit=self.edit(), target="field")
        for seq in range(1, 11):
            self.client.send("drag", drag=drag, seq=seq, operation=operation)
            self.read(0.03)
            if self.dropped:
                return
        if self.chance.random() < 0.2:
            self.client.send("drag_cancel", drag=drag)
        else:
            self.client.send("drag_end", drag=drag, seq=11, operation=operation)

    def apply(self) -> None:
        """A whole operation."""
        self.client.send("apply", edit=self.edit(), target="field", operation=self.operation())

    def set_cage(self) -> None:
        """Takes the operations back."""
        self.client.send("command", name="reset_operations", edit=self.edit())

    def change(self) -> None:
        """Options."""
        values: dict[str, Any] = self.chance.choice(
            [{"enabled": True}, {"enabled": False}, {"name": f"n{self.chance.randrange(99)}"},
             {"kind": "delete"}, {"kind": "move"}, {"kind": "copy"}, {"fill": "none"},
             {"fill": "surroundings"}, {"relight": "none"}, {"relight": "occlusion"}]
        )  # fmt: skip
        self.client.socket.send(json.dumps({"type": "change", "edit": self.edit()} | values))

    def travel(self) -> None:
        """Back and forth in the history."""
        self.client.send("command", name=self.chance.choice(["undo", "undo", "redo"]))

    def place(self) -> None:
        """A new edit on the surface."""
        self.client.send("place", x=self.chance.random(), y=self.chance.random())

    def remove(self) -> None:
        """One edit less."""
        self.client.send("command", name="remove", edit=self.edit())

    def load(self) -> None:
        """Two edits in the place of all."""
        self.client.send("load_edits", text=START)
        self.read(1.0)

    def path(self) -> None:
        """A camera path of two keys."""
        start = self.hello["start"]
        key = {"c2w": start["c2w"], "fov_y_deg": 50.0, "seconds": 1.0, "parts": {}}
        self.client.send("set_path", keys=[key, key])

    def play(self) -> None:
        """Plays it."""
        self.count += 1
        self.client.send("play_begin", play=self.count)
        for step in range(5):
            self.client.send("play", play=self.count, seconds=0.2 * step)
            self.read(0.1)
        self.client.send("play_end", play=self.count)

    def job(self) -> None:
        """Has the path rendered, over what the last job made; now and then it is stopped."""
        out = self.soak.out / f"{self.number}.mp4"
        self.client.send(
            "render", what="camera_path", out=str(out), width=64, height=48, fps=8, overwrite=True
        )

    def save(self) -> None:
        """Saves the scene."""
        self.client.send("command", name="save")

    def ask(self) -> None:
        """Questions."""
        self.count += 1
        what = self.chance.choice(["surface", "path", "grid", "sources"])
        self.client.send("ask", request=self.count, what=what)

    def download(self) -> None:
        """The files that a page offers."""
        self._get(self.chance.choice(["/edits.yaml", "/camera_path.json", "/field", "/"]))

    def screenshot(self) -> None:
        """The picture as a file."""
        self._get("/screenshot.png")

    def _get(self, path: str) -> None:
        address = f"http://localhost:{self.soak.server.port}{path}"
        request = urllib.request.Request(address, headers=self.soak.server.headers)
        with (
            contextlib.suppress(urllib.error.HTTPError),
            urllib.request.urlopen(request, timeout=60) as answer,
        ):
            answer.read()

    def show(self) -> None:
        """Other views."""
        view = self.chance.choice(["color", "depth", "normals"])
        self.client.send("display", view=view, before=self.chance.random() < 0.2)
