/** Row of the panel with the edit that carries the selected one. */
import type { FolderApi } from "tweakpane";
import type { EditState } from "../net/protocol";

export interface ParentRow {
  /** Shows the parent of an edit, among all edits that can be one. */
  show(edit: EditState, edits: readonly EditState[]): void;
}

/** Adds the row; `choose` takes the number of the chosen edit, 0 for none. */
export function parentRow(folder: FolderApi, choose: (parent: number) => void): ParentRow {
  const model = { parent: 0 };
  let key = "";
  let row: { dispose(): void; refresh(): void; disabled: boolean } | null = null;
  return {
    show(edit, edits) {
      model.parent = edit.parent ?? 0;
      const options = Object.fromEntries([["None", 0], ...candidates(edit, edits)]);
      const now = JSON.stringify([edit.id, options]);
      if (now !== key || row === null) {
        row?.dispose();
        key = now;
        const binding = folder.addBinding(model, "parent", { label: "Parent", options });
        binding.element.title = "The edit that carries this one: a finger follows its arm.";
        binding.on("change", ({ value }) => choose(value));
        row = binding;
      }
      row.disabled = edit.locked;
      row.refresh();
    },
  };
}

/** Named edits that can carry an edit: no pastes, and none that the edit itself carries. */
export function candidates(edit: EditState, edits: readonly EditState[]): [string, number][] {
  const byId = new Map(edits.map((each) => [each.id, each]));
  const isCarried = (other: EditState | undefined): boolean => {
    for (let at = other; at !== undefined; at = at.parent === null ? undefined : byId.get(at.parent))
      if (at.id === edit.id) return true;
    return false;
  };
  const named = edits.filter((other) => other.name !== "" && other.source === null && !isCarried(other));
  return named.map((other) => [other.name, other.id]);
}
