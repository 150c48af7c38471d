"""`cagefield edit`: an edit file applied to a scene."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import tyro

from cagefield.cli.options import Flag, OptionalOutput
from cagefield.errors import CagefieldError


@dataclass(frozen=True)
class ApplyEdits:
    """Apply an edit file to a scene: the field stays, the scene's edits are replaced by the file's."""

    scene: tyro.conf.Positional[Path]
    """Scene folder."""
    edits: tyro.conf.Positional[Path]
    """Edit file, YAML or JSON."""
    out: OptionalOutput = None
    """New scene folder; left out, the scene itself is changed, which needs --overwrite."""
    append: Flag = False
    """Put the file's edits after those the scene has, instead of in their place."""
    check: Flag = False
    """Only say what would change; write nothing."""
    overwrite: Flag = False
    """Replace the scene that is there."""

    def run(self) -> None:
        """Check every edit, write the scene, print the changes."""
        from cagefield.cli.report import describe_edits
        from cagefield.edits import EditStack, Paste
        from cagefield.edits.edit_files import load_edits
        from cagefield.edits.paste_paths import rebased
        from cagefield.geometry.control_points import ControlPoints
        from cagefield.scene.scene import Scene
        from cagefield.scene.scene_files import check_destination

        destination = self.out or self.scene
        if self.out is None and not (self.overwrite or self.check):
            raise CagefieldError(
                f"without -o the scene {self.scene} itself would change; give -o NEW_SCENE, or --overwrite"
            )
        scene = Scene.open(self.scene)
        stack = EditStack(
            rebased(load_edits(self.edits), self.edits.absolute().parent, self.scene.absolute())
        )
        if self.append:
            stack = EditStack([*scene.edits, *stack])
        stack.check()
        for edit in stack:
            if isinstance(edit, Paste) and edit.enabled:
                scene.with_edits(EditStack([edit.replace(relight="none")])).prepared_edits  # noqa: B018  a scene that is not there
        edited = scene.with_edits(stack)
        if any(isinstance(edit.inner, ControlPoints) and edit.inner.is_unprepared for edit in stack):
            edited.patcher.with_detours(stack.edits)
        lines = describe_edits(edited)
        if not self.check:
            check_destination(destination, self.overwrite)
            edited.save(destination, self.overwrite)
        print("\n".join(lines))
        print(f"{'checked, nothing written' if self.check else f'scene written to {destination}'}")
