/** Keys: one table, for doing and for the page that shows them. */
import type { Actions } from "./actions";
import type { App } from "../app/app";
import type { Pointer } from "./pointer";
import { LOOKING, looking } from "../app/store";
import type { Dialogs } from "../ui/dialogs";

/** Keys beside those of the view that pages have which may not change anything. */
const OF_LOOKERS = ["Escape", "Ctrl+C", "?"];

export interface Binding {
  /** As shown: "Ctrl+Shift+Z". Several may do the same. */
  keys: string[];
  what: string;
  group: "Tools" | "Cages" | "Edits" | "View" | "Scene";
  run: () => void;
}

/** All bindings. Letters that have another meaning during a drag are not among them. */
export function bindings(
  app: App,
  actions: Actions,
  pointer: Pointer,
  dialogs: Pick<Dialogs, "saveAs" | "paste">,
): Binding[] {
  return [
    { group: "Tools", keys: ["1", "G"], what: "Move", run: () => actions.tool("translate") },
    { group: "Tools", keys: ["2", "R"], what: "Rotate", run: () => actions.tool("rotate") },
    { group: "Tools", keys: ["3", "S"], what: "Scale", run: () => actions.tool("scale") },
    { group: "Tools", keys: ["4", "Q"], what: "Select: no gizmo", run: () => actions.tool("select") },
    { group: "Tools", keys: ["Tab"], what: "Set mode or Edit mode", run: () => actions.toggleMode() },
    { group: "Tools", keys: ["W"], what: "World axes or cage axes", run: () => actions.toggleAxes() },
    {
      group: "Tools",
      keys: ["Escape"],
      what: "Cancel the drag; clear the selection",
      run: () => actions.escape(() => pointer.cancel()),
    },
    {
      group: "Cages",
      keys: ["C"],
      what: "Set mode: inner cage, outer cage, both",
      run: () => actions.nextCage(),
    },
    {
      group: "Cages",
      keys: ["I"],
      what: "Fit the inner cage to what is dense inside it",
      run: () => actions.fitInner(),
    },
    { group: "Edits", keys: ["D"], what: "Discrete or continuous", run: () => actions.toggleKind() },
    {
      group: "Edits",
      keys: ["U"],
      what: "Fill what is uncovered, or leave it",
      run: () => actions.toggleFill(),
    },
    {
      group: "Edits",
      keys: ["Shift+U"],
      what: "Shadows go along, or stay",
      run: () => actions.toggleShadows(),
    },
    { group: "Edits", keys: ["H"], what: "Hide or show", run: () => actions.hide() },
    { group: "Edits", keys: ["Delete", "Backspace"], what: "Remove", run: () => actions.remove() },
    { group: "Edits", keys: ["Ctrl+D"], what: "Duplicate", run: () => actions.duplicate() },
    { group: "Edits", keys: ["Ctrl+C"], what: "Copy as text; Ctrl+V pastes", run: () => actions.copy() },
    { group: "Edits", keys: ["Shift+V"], what: "Paste from another scene", run: () => dialogs.paste() },
    { group: "Edits", keys: ["Ctrl+Z"], what: "Undo", run: () => actions.command("undo") },
    { group: "Edits", keys: ["Ctrl+Shift+Z", "Ctrl+Y"], what: "Redo", run: () => actions.command("redo") },
    {
      group: "View",
      keys: ["F"],
      what: "Focus on the cage, or on the surface under the mouse",
      run: () => actions.focus(pointer.at.x, pointer.at.y),
    },
    { group: "View", keys: ["V"], what: "Colour, depth, opacity, normals", run: () => actions.nextView() },
    { group: "View", keys: ["L"], what: "Deformed lattice", run: () => actions.toggle("grid") },
    { group: "View", keys: ["O"], what: "Show or hide the cages", run: () => actions.toggle("cages") },
    { group: "View", keys: ["P"], what: "Before and after, side by side", run: () => actions.toggleSplit() },
    { group: "View", keys: ["N"], what: "Show or hide the panel", run: () => actions.toggle("panel") },
    { group: "View", keys: ["Home"], what: "Look from the start", run: () => actions.lookFrom(null) },
    { group: "View", keys: ["["], what: "Previous camera of the scene", run: () => actions.lookFrom(-1) },
    { group: "View", keys: ["]"], what: "Next camera of the scene", run: () => actions.lookFrom(1) },
    { group: "Scene", keys: ["Ctrl+S"], what: "Save", run: () => actions.save() },
    { group: "Scene", keys: ["Ctrl+Shift+S"], what: "Save as", run: () => dialogs.saveAs() },
    { group: "Scene", keys: ["K"], what: "Keyframe of the camera path", run: () => actions.addKey() },
    {
      group: "Scene",
      keys: ["?"],
      what: "All keys",
      run: () => app.store.set({ help: !app.store.now.help }),
    },
  ];
}

/** What the mouse does with a key held; shown with the others. */
export const HELD: { keys: string[]; what: string }[] = [
  { keys: ["B"], what: "Before the edits, while held" },
  { keys: ["Ctrl"], what: "While dragging: snap (15°, tenths, round lengths)" },
  { keys: ["X", "Y", "Z"], what: "While dragging a corner, edge or face: along this axis" },
  { keys: ["Shift+click"], what: "Choose corners, edges and faces to drag together" },
  { keys: ["Double-click"], what: "A new pair of cages around the surface there" },
  { keys: ["Left", "Right", "Wheel"], what: "Orbit, pan, zoom" },
];

/** The event's key as bindings write it. */
export function named(event: Pick<KeyboardEvent, "key" | "ctrlKey" | "metaKey" | "shiftKey">): string {
  const key = event.key.length === 1 ? event.key.toUpperCase() : event.key;
  const control = event.ctrlKey || event.metaKey ? "Ctrl+" : "";
  const shift = event.shiftKey && /^[A-Z]$/.test(key) ? "Shift+" : "";
  return control + shift + key;
}

/** Listens for keys, except where somebody types. */
export function listenForKeys(app: App, actions: Actions, pointer: Pointer, all: Binding[]): void {
  const byKey = new Map(all.flatMap((binding) => binding.keys.map((key) => [key, binding] as const)));
  addEventListener("keydown", (event) => {
    if (isTyping(event.target)) {
      if (event.key === "Enter") leave(event.target);
      return;
    }
    const name = named(event);
    if (event.key === "Control") return snap(true);
    if (name === "B" && !event.repeat) return app.store.set({ before: true });
    if ((name === "X" || name === "Y" || name === "Z") && pointer.constrain(name)) return;
    if (pointer.dragging && name !== "Escape") return;
    if (name === "Ctrl+C" && !getSelection()?.isCollapsed) return;
    const binding = byKey.get(name);
    if (!binding) return;
    event.preventDefault();
    if (looking(app.store.now) && binding.group !== "View" && !OF_LOOKERS.includes(name))
      return app.say(LOOKING, "warning");
    if (!event.repeat || name.endsWith("Z")) binding.run();
  });
  addEventListener("keyup", (event) => {
    if (event.key === "Control") snap(false);
    if (event.key.toUpperCase() === "B") app.store.set({ before: false });
  });
  addEventListener("blur", () => app.store.set({ before: false }));
  addEventListener("paste", (event) => {
    if (!isTyping(event.target)) actions.paste(event.clipboardData?.getData("text/plain") ?? "");
  });

  function snap(held: boolean): void {
    pointer.snapKey = held;
    pointer.follow();
  }
}

/** Lets the keys be shortcuts again after a field was filled in. */
function leave(field: EventTarget | null): void {
  if (field instanceof HTMLInputElement) setTimeout(() => field.blur());
}

function isTyping(target: EventTarget | null): boolean {
  if (!(target instanceof HTMLElement)) return false;
  if (target instanceof HTMLInputElement)
    return !["checkbox", "range", "button", "radio"].includes(target.type);
  return (
    target instanceof HTMLTextAreaElement ||
    target instanceof HTMLSelectElement ||
    target.closest("dialog") !== null
  );
}
