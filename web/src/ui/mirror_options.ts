/** Buttons that reflect the content of a discrete edit along an axis of its cage. */
import type { Pane } from "tweakpane";
import type { Operation } from "../editing/operations";
import type { EditState } from "../net/protocol";

export interface MirrorOptions {
  show(edit: EditState): void;
}

export function mirrorOptions(pane: Pane, apply: (operation: Operation) => void): MirrorOptions {
  const folder = pane.addFolder({ title: "Mirror the content", expanded: false });
  const buttons = (["x", "y", "z"] as const).map((axis) =>
    folder
      .addButton({ title: `Along ${axis} of the cage` })
      .on("click", () => apply({ kind: "mirror", axis })),
  );
  return {
    show(edit) {
      folder.hidden = edit.kind === "continuous" || edit.kind === "delete";
      for (const button of buttons) button.disabled = edit.locked;
    },
  };
}
