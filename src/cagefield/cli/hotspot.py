"""`cagefield hotspot`: points of a scene with a title and a text, for the editor and exported pages."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from cagefield.cli.options import Flag
from cagefield.errors import CagefieldError

if TYPE_CHECKING:
    from cagefield.scene.hotspots import Hotspot, HotspotView
    from cagefield.scene.scene import Scene


@dataclass(frozen=True)
class HotspotCommand:
    """Add, change or remove hotspots: points of the edited scene with a title, a text and a camera.

    Exported pages mark them, and a click flies there; `render --hotspots` makes a video that stops at each.
    Without an option the hotspots are listed.
    """

    scene: tyro.conf.Positional[Path]
    """Scene folder."""
    add: str | None = None
    """Title of a hotspot to add, at --at."""
    change: str | None = None
    """Title, or number in the list from 1, of a hotspot whose --at, --text, --camera or --title change."""
    title: str | None = None
    """New title of --change."""
    at: Annotated[tuple[float, float, float] | None, tyro.conf.arg(metavar="X Y Z")] = None
    """Position, world units, where the edited scene shows it."""
    text: str | None = None
    """Plain text, which pages show beside it."""
    follow: Literal["yes", "no"] | None = None
    """Whether the edits carry the hotspot and its camera along; without it a new one stays at --at."""
    camera: Annotated[tuple[str, int] | None, tyro.conf.arg(metavar="SPLIT INDEX")] = None
    """Camera to look from, one of the scene's: test 3, say. Without one, halfway from the first view."""
    remove: tuple[str, ...] = ()
    """Titles or numbers of hotspots to remove."""
    order: tuple[str, ...] = ()
    """Titles or numbers of all hotspots in the order of the tour."""
    load: Path | None = None
    """YAML or JSON file with a list `hotspots`, which replaces those of the scene."""
    dump: Path | None = None
    """Write the hotspots into such a file."""
    tour: Path | None = None
    """Write the tour as a camera path (.json), which rests at each hotspot; videos, exports along a path and
    the editor take it."""
    stop: float = 3.0
    """Seconds at each hotspot of --tour."""
    overwrite: Flag = False
    """Replace the file of --dump or --tour."""

    def run(self) -> None:
        """Check the options, write the scene's manifest, list the hotspots."""
        from cagefield.scene.scene import Scene

        self._check()
        scene = Scene.open(self.scene, whole=True)
        hotspots = self._changed(scene)
        if hotspots != scene.hotspots:
            dataclasses.replace(scene, hotspots=hotspots).save_manifest(self.scene)
        if self.dump is not None:
            self._write(hotspots, self.dump)
        shown = self._shown(dataclasses.replace(scene, hotspots=hotspots))
        if self.tour is not None:
            self._write_tour(scene, [hotspot for hotspot in shown if hotspot is not None], self.tour)
        for number, (hotspot, seen) in enumerate(zip(hotspots, shown, strict=True), start=1):
            place = ", ".join(f"{round(value, 12) + 0.0:.6g}" for value in (seen or hotspot).position)
            notes = [
                *(["camera"] if hotspot.view else []),
                *(["follows the edits"] if hotspot.follows else []),
                *(["hidden by them"] if seen is None else []),
            ]
            print(f"{number:<4}{hotspot.title}  ({place}){''.join(f', {note}' for note in notes)}")
        if not hotspots:
            print("no hotspots")

    def _shown(self, scene: Scene) -> tuple[Hotspot | None, ...]:
        from cagefield.scene.hotspot_motion import moving_edits, shown_hotspots

        return shown_hotspots(scene.hotspots, moving_edits(scene))

    def _placed(self, scene: Scene, hotspot: Hotspot, follows: bool) -> Hotspot:
        """Hotspot at a place of the edited scene, which follows the edits from there or stays."""
        from cagefield.scene.hotspot_motion import edits_with_detours, following

        if not follows:
            return hotspot
        placed = following(hotspot, edits_with_detours(scene))
        if placed is None:
            raise CagefieldError("the edits leave nothing at --at that a hotspot could follow; move --at")
        return placed

    def _check(self) -> None:
        actions = [self.add, self.change, self.load, self.remove or None, self.order or None]
        if sum(action is not None for action in actions) > 1:
            raise CagefieldError(
                "--add, --change, --remove, --order and --load exclude each other; give one of them"
            )
        values = (self.at, self.text, self.camera, self.follow)
        if any(value is not None for value in values) and self.add is None and self.change is None:
            raise CagefieldError(
                "--at, --text, --camera and --follow are for --add and --change; give its title"
            )
        if self.add is not None and self.at is None:
            raise CagefieldError("--add needs a position; give --at X Y Z")
        if self.title is not None and self.change is None:
            raise CagefieldError("--title is for --change; give the old title or the number")
        if self.tour is not None and self.tour.suffix.lower() != ".json":
            raise CagefieldError(f"{self.tour}: a camera path is a .json file; give such a name")
        for path in (self.dump, self.tour):
            if path is not None and path.exists() and not self.overwrite:
                raise CagefieldError(f"{path} exists already; give another name, or --overwrite")

    def _write_tour(self, scene: Scene, hotspots: list[Hotspot], path: Path) -> None:
        from cagefield.cameras.keyframe_files import dump_path
        from cagefield.cameras.keyframes import Timeline
        from cagefield.files.atomic import replaced_file
        from cagefield.scene.hotspot_tour import tour_keys

        keys = tour_keys(hotspots, scene.first_camera, scene.up, stop_seconds=self.stop)
        with replaced_file(path, parents=False) as draft:
            draft.write_text(dump_path(keys, loop=False), encoding="utf-8")
        seconds = Timeline(keys, loop=False).seconds
        print(f"a camera path of {len(hotspots)} stops, {seconds:g} s, written to {path}")

    def _changed(self, scene: Scene) -> tuple[Hotspot, ...]:
        """The hotspots after the changes that the options ask for."""
        from cagefield.scene.hotspots import Hotspot, find_hotspot, hotspots_from_file

        hotspots = scene.hotspots
        if self.add is not None and self.at is not None:
            hotspot = Hotspot(self.add, self.at, _lines(self.text or ""), self._view(scene))
            return (*hotspots, self._placed(scene, hotspot, self.follow == "yes"))
        if self.change is not None:
            index = find_hotspot(hotspots, self.change)
            values = {
                "title": self.title,
                "position": self.at,
                "text": None if self.text is None else _lines(self.text),
                "view": self._view(scene),
            }
            given = {name: value for name, value in values.items() if value is not None}
            before = hotspots[index]
            follows = before.follows if self.follow is None else self.follow == "yes"
            if set(given) <= {"title", "text"} and follows == before.follows:
                changed = dataclasses.replace(before, **given)  # type: ignore[arg-type]
            else:
                seen = self._shown(scene)[index] or dataclasses.replace(before, follows=False)
                moved = dataclasses.replace(seen, **given)  # type: ignore[arg-type]
                changed = self._placed(scene, moved, follows)
            return (*hotspots[:index], changed, *hotspots[index + 1 :])
        if self.remove:
            gone = {find_hotspot(hotspots, name) for name in self.remove}
            return tuple(hotspot for index, hotspot in enumerate(hotspots) if index not in gone)
        if self.order:
            indices = [find_hotspot(hotspots, name) for name in self.order]
            if sorted(indices) != list(range(len(hotspots))):
                raise CagefieldError(f"--order must name each of the {len(hotspots)} hotspots once")
            return tuple(hotspots[index] for index in indices)
        return hotspots if self.load is None else hotspots_from_file(self.load)

    def _view(self, scene: Scene) -> HotspotView | None:
        from cagefield.scene.hotspots import view_of_camera

        if self.camera is None:
            return None
        split, index = self.camera
        cameras = scene.cameras.get(split, ())
        if not 0 <= index < len(cameras):
            known = ", ".join(f"{name} 0 to {len(c) - 1}" for name, c in scene.cameras.items() if c) or "none"
            raise CagefieldError(f"--camera {split} {index} is no camera of the scene, which has {known}")
        return view_of_camera(cameras[index])

    def _write(self, hotspots: tuple[Hotspot, ...], path: Path) -> None:
        import yaml

        from cagefield.files.atomic import replaced_file

        document = {"hotspots": [hotspot.to_dict() for hotspot in hotspots]}
        with replaced_file(path, parents=False) as draft:
            draft.write_text(
                yaml.safe_dump(document, sort_keys=False, allow_unicode=True, default_flow_style=None),
                encoding="utf-8",
            )


def _lines(text: str) -> str:
    r"""A text of the command line, in which \n begins a line."""
    return text.replace("\\n", "\n")
