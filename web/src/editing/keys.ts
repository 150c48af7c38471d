/** Key bindings: one table for the actions and for the help page. */
import type { Actions } from "./actions";
import type { App } from "../app/app";
import type { Pointer } from "./pointer";
import type { RegionTools } from "./region_tools";
import { READ_ONLY_NOTICE, isReadOnly } from "../app/store";
import type { Dialogs } from "../ui/dialogs";

/** Keys that read-only pages have in addition to those of the view. */
const READ_ONLY_KEYS = ["Escape", "Ctrl+C", "Shift+M", "?"];

export interface Binding {
  /** Keys with the same action, as the help shows them: "Ctrl+Shift+Z". */
  keys: string[];
  action: string;
  group: "Tools" | "Cages" | "Selection" | "Edits" | "View" | "Scene";
  run: () => void;
}

/** All bindings, apart from the letters that constrain a drag. */
export function bindings(
  app: App,
  actions: Actions,
  pointer: Pointer,
  regions: Pick<RegionTools, "cancel">,
  dialogs: Pick<Dialogs, "saveAs" | "paste">,
): Binding[] {
  return [
    { group: "Tools", keys: ["1", "G"], action: "Move", run: () => actions.setTool("translate") },
    { group: "Tools", keys: ["2", "R"], action: "Rotate", run: () => actions.setTool("rotate") },
    { group: "Tools", keys: ["3", "S"], action: "Scale", run: () => actions.setTool("scale") },
    { group: "Tools", keys: ["4", "Q"], action: "Select: no gizmo", run: () => actions.setTool("select") },
    { group: "Tools", keys: ["Tab"], action: "Set mode or Edit mode", run: () => actions.toggleMode() },
    { group: "Tools", keys: ["W"], action: "World axes or cage axes", run: () => actions.toggleAxes() },
    {
      group: "Tools",
      keys: ["Escape"],
      action: "Cancel the drag; clear the selection",
      run: () => actions.escape(() => regions.cancel() || pointer.cancel()),
    },
    {
      group: "Cages",
      keys: ["C"],
      action: "Set mode: inner cage, outer cage, both",
      run: () => actions.nextCage(),
    },
    {
      group: "Cages",
      keys: ["I"],
      action: "Fit the inner cage to the dense part of its content",
      run: () => actions.fitInner(),
    },
    {
      group: "Cages",
      keys: ["O"],
      action: "Proportional editing: control points around the dragged ones go along; also while dragging",
      run: () => actions.toggleProportional(true),
    },
    {
      group: "Cages",
      keys: ["Alt+O"],
      action: "Connected only: control points reach through dense matter alone",
      run: () => actions.toggleConnected(),
    },
    {
      group: "Tools",
      keys: ["Shift+M"],
      action: "Measure between two points; sets the scene's scale in meters",
      run: () => actions.toggleMeasuring(),
    },
    {
      group: "Tools",
      keys: ["Shift+Y"],
      action: "Up direction by three points of something level",
      run: () => actions.togglePicking("up"),
    },
    {
      group: "Edits",
      keys: ["Shift+A"],
      action: "Align a paste by three pairs of points",
      run: () => actions.togglePicking("paste"),
    },
    {
      group: "Scene",
      keys: ["Shift+H"],
      action: "Place hotspots: points with a title and text, for exported pages",
      run: () => actions.toggleHotspots(),
    },
    {
      group: "Selection",
      keys: ["M"],
      action: "Brush: paint over elements; [ and ] change its size",
      run: () => actions.toggleSelecting("brush"),
    },
    { group: "Selection", keys: ["J"], action: "Lasso", run: () => actions.toggleSelecting("lasso") },
    {
      group: "Selection",
      keys: ["A"],
      action: "Select all",
      run: () => actions.changeSelection("all"),
    },
    {
      group: "Selection",
      keys: ["Alt+A"],
      action: "Select none",
      run: () => actions.changeSelection("none"),
    },
    {
      group: "Selection",
      keys: ["Ctrl+I"],
      action: "Invert the selection",
      run: () => actions.changeSelection("invert"),
    },
    {
      group: "Selection",
      keys: ["Ctrl++", "Ctrl+="],
      action: "Grow the selection",
      run: () => actions.changeSelection("grow"),
    },
    {
      group: "Selection",
      keys: ["Ctrl+-"],
      action: "Shrink the selection",
      run: () => actions.changeSelection("shrink"),
    },
    {
      group: "Selection",
      keys: ["E"],
      action: "Enclose the selection in a new cage: a box",
      run: () => actions.encloseSelection(),
    },
    {
      group: "Selection",
      keys: ["Shift+E"],
      action: "Enclose it in a lattice of control points",
      run: () => actions.encloseSelection("lattice"),
    },
    {
      group: "Selection",
      keys: ["Alt+E"],
      action: "Enclose it in a closed mesh",
      run: () => actions.encloseSelection("mesh"),
    },
    {
      group: "Selection",
      keys: ["Ctrl+Delete"],
      action: "Delete the selected elements",
      run: () => actions.removeElements(),
    },
    {
      group: "Selection",
      keys: ["/"],
      action: "Isolate the selection, or show everything again",
      run: () => actions.toggleIsolated(),
    },
    { group: "Edits", keys: ["D"], action: "Discrete or continuous", run: () => actions.toggleKind() },
    {
      group: "Edits",
      keys: ["U"],
      action: "Fill what is uncovered, or leave it",
      run: () => actions.toggleFill(),
    },
    {
      group: "Edits",
      keys: ["Shift+U"],
      action: "Shadows go along, or stay",
      run: () => actions.toggleShadows(),
    },
    { group: "Edits", keys: ["H"], action: "Hide or show", run: () => actions.toggleEnabled() },
    {
      group: "Edits",
      keys: ["Delete", "Backspace"],
      action: "Remove the edit; with a selecting tool, delete the selected elements",
      run: () => actions.remove(),
    },
    { group: "Edits", keys: ["Ctrl+D"], action: "Duplicate", run: () => actions.duplicate() },
    { group: "Edits", keys: ["Ctrl+C"], action: "Copy as text; Ctrl+V pastes", run: () => actions.copy() },
    { group: "Edits", keys: ["Shift+V"], action: "Paste from another scene", run: () => dialogs.paste() },
    { group: "Edits", keys: ["Ctrl+Z"], action: "Undo", run: () => actions.command("undo") },
    { group: "Edits", keys: ["Ctrl+Shift+Z", "Ctrl+Y"], action: "Redo", run: () => actions.command("redo") },
    {
      group: "View",
      keys: ["F"],
      action: "Focus on the cage, or on the surface under the mouse",
      run: () => actions.focus(pointer.position.x, pointer.position.y),
    },
    { group: "View", keys: ["V"], action: "Color, depth, opacity, normals", run: () => actions.nextView() },
    { group: "View", keys: ["L"], action: "Deformed lattice", run: () => actions.toggle("grid") },
    {
      group: "View",
      keys: ["Shift+O"],
      action: "Show or hide the cages",
      run: () => actions.toggle("cages"),
    },
    {
      group: "View",
      keys: ["P"],
      action: "Before and after, side by side",
      run: () => actions.toggleSplit(),
    },
    { group: "View", keys: ["N"], action: "Show or hide the panel", run: () => actions.toggle("panel") },
    { group: "View", keys: ["Home"], action: "Look from the start", run: () => actions.lookFrom(null) },
    {
      group: "View",
      keys: ["["],
      action: "Previous camera of the scene; smaller brush",
      run: () => actions.resizeBrush(-1) || actions.lookFrom(-1),
    },
    {
      group: "View",
      keys: ["]"],
      action: "Next camera of the scene; larger brush",
      run: () => actions.resizeBrush(1) || actions.lookFrom(1),
    },
    { group: "Scene", keys: ["Ctrl+S"], action: "Save", run: () => actions.save() },
    { group: "Scene", keys: ["Ctrl+Shift+S"], action: "Save as", run: () => dialogs.saveAs() },
    { group: "Scene", keys: ["K"], action: "Keyframe of the camera path", run: () => actions.addKey() },
    {
      group: "Scene",
      keys: ["?"],
      action: "All keys",
      run: () => app.store.set({ help: !app.store.now.help }),
    },
  ];
}

/** Actions of the mouse, some with a key held; the help shows them with the keys. */
export const MOUSE_BINDINGS: { keys: string[]; action: string }[] = [
  { keys: ["B"], action: "Before the edits, while held" },
  { keys: ["Ctrl"], action: "While dragging: snap (15°, tenths, round lengths)" },
  { keys: ["X", "Y", "Z"], action: "While dragging a corner, edge or face: along this axis" },
  {
    keys: ["Wheel", "PageUp", "PageDown"],
    action: "While dragging points: radius of proportional editing",
  },
  { keys: ["Shift+click"], action: "Choose corners, edges, faces or control points to drag together" },
  { keys: ["Alt+click"], action: "Choose a row of a lattice's points; with Ctrl a plane; Shift adds" },
  { keys: ["Shift+drag"], action: "Beside the cages: select in a rectangle" },
  {
    keys: ["Shift", "Ctrl"],
    action: "While selecting: add, subtract; both: intersect. Alt+drag orbits",
  },
  { keys: ["Double-click"], action: "A new pair of cages around the surface there" },
  { keys: ["Ctrl+double-click"], action: "A new control point on the surface there" },
  { keys: ["Left", "Right", "Wheel"], action: "Orbit, pan, zoom" },
];

/** Name of an event's key in the notation of the bindings. */
export function keyName(
  event: Pick<KeyboardEvent, "key" | "ctrlKey" | "metaKey" | "shiftKey"> &
    Partial<Pick<KeyboardEvent, "altKey" | "code">>,
): string {
  // With Alt some systems type other letters: the key's place on the keyboard counts.
  const letter = event.altKey === true ? /^Key([A-Z])$/.exec(event.code ?? "") : null;
  if (letter !== null && !event.ctrlKey) return `Alt+${letter[1]}`;
  const key = event.key.length === 1 ? event.key.toUpperCase() : event.key;
  const control = event.ctrlKey || event.metaKey ? "Ctrl+" : "";
  const shift = event.shiftKey && /^[A-Z]$/.test(key) ? "Shift+" : "";
  return control + shift + key;
}

/** Listens for keys, except while the user types into a field. */
export function listenForKeys(app: App, actions: Actions, pointer: Pointer, all: Binding[]): void {
  const byKey = new Map(all.flatMap((binding) => binding.keys.map((key) => [key, binding] as const)));
  addEventListener("keydown", (event) => {
    if (isTyping(event.target)) {
      if (event.key === "Enter") blurLater(event.target);
      return;
    }
    const name = keyName(event);
    if (event.key === "Control") return snap(true);
    if (name === "B" && !event.repeat) return app.store.set({ before: true });
    if ((name === "X" || name === "Y" || name === "Z") && pointer.constrain(name)) return;
    if (name === "PageUp" && pointer.resizeReach(1)) return event.preventDefault();
    if (name === "PageDown" && pointer.resizeReach(-1)) return event.preventDefault();
    if (name === "O" && pointer.dragging && !event.repeat) {
      app.store.set({ proportional: !app.store.now.proportional });
      return pointer.applyMotion();
    }
    const binding = byKey.get(name);
    if (pointer.dragging && name !== "Escape") {
      // Not the browser's own action either: another focus, its window to save the page.
      if (binding) event.preventDefault();
      return;
    }
    if (name === "Ctrl+C" && !getSelection()?.isCollapsed) return;
    if (!binding) return;
    event.preventDefault();
    if (isReadOnly(app.store.now) && binding.group !== "View" && !READ_ONLY_KEYS.includes(name))
      return app.say(READ_ONLY_NOTICE, "warning");
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
    pointer.applyMotion();
  }
}

/** Removes the focus from a field after the Enter key, so that keys are shortcuts again. */
function blurLater(field: EventTarget | null): void {
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
