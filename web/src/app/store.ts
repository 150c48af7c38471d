/** What the page knows and shows; views listen, one change at a time. */
import type { Part } from "../editing/cage";
import type { Axes } from "../editing/operations";
import type {
  Drawing,
  EditState,
  Hello,
  Job,
  DisplayMessage,
  Notice,
  PageMessage,
  Preparing,
  Preview,
  State,
} from "../net/protocol";

export type Tool = "select" | "translate" | "rotate" | "scale";
export type View = NonNullable<DisplayMessage["view"]>;
/** Which pictures the page draws itself. */
export type DrawnHere = Drawing["here"];
export type CageName = "inner" | "outer" | "both";
export type Target = "field" | CageName;

export interface Hover {
  part: Part;
  cage: "inner" | "outer";
}

export interface Figures {
  perSecond: number;
  renderMs: number;
  encodeMs: number;
  width: number;
  height: number;
  final: boolean;
  /** Whether the page's own GPU drew it. */
  page: boolean;
}

export interface Editor {
  connection: "connecting" | "open" | "lost";
  hello: Hello | null;
  state: State | null;
  mode: "set" | "edit";
  tool: Tool;
  axes: Axes;
  /** Which cage Set mode moves. */
  cage: CageName;
  /** Snapping, while its key is held or its button is on. */
  snap: boolean;
  view: View;
  before: boolean;
  split: number | null;
  grid: boolean;
  cages: boolean;
  panel: boolean;
  help: boolean;
  /** Corners that are dragged together, by the gizmo or by any of them. */
  corners: number[];
  hover: Hover | null;
  /** Why the drag that goes on stopped, or null. */
  limit: string | null;
  notice: Notice | null;
  /** How much of the renderer is ready, or null before it was said. */
  preparing: Preparing | null;
  jobs: Job[];
  /** A file that this page opens, and the share of it that has been sent. */
  upload: { name: string; share: number } | null;
  /** What a page plays of the camera path, and pictures show, or null. */
  preview: Preview | null;
  /** The share of the field's file that has come, while it is loaded; else null. */
  loading: number | null;
  figures: Figures;
}

export const START: Editor = {
  connection: "connecting",
  hello: null,
  state: null,
  mode: "edit",
  tool: "translate",
  axes: "world",
  cage: "inner",
  snap: false,
  view: "colour",
  before: false,
  split: null,
  grid: false,
  cages: true,
  panel: true,
  help: false,
  corners: [],
  hover: null,
  limit: null,
  notice: null,
  preparing: null,
  jobs: [],
  upload: null,
  preview: null,
  loading: null,
  figures: { perSecond: 0, renderMs: 0, encodeMs: 0, width: 0, height: 0, final: false, page: false },
};

export type Listener = (now: Editor, before: Editor) => void;

export class Store {
  private editor: Editor;
  private readonly listeners: Listener[] = [];

  constructor(start: Partial<Editor> = {}) {
    this.editor = { ...START, ...start };
  }

  get now(): Editor {
    return this.editor;
  }

  /** Takes changes over and tells the listeners, unless nothing is other than before. */
  set(change: Partial<Editor>): void {
    const before = this.editor;
    const keys = Object.keys(change) as (keyof Editor)[];
    if (keys.every((key) => Object.is(before[key], change[key]))) return;
    this.editor = { ...before, ...change };
    const now = this.editor;
    for (const listener of this.listeners) listener(now, before);
  }

  /** Calls a listener at every change. */
  listen(listener: Listener): void {
    this.listeners.push(listener);
  }

  /** Calls an action now, and whenever one of these values is another. */
  watch(keys: (keyof Editor)[], action: (now: Editor) => void): void {
    this.listen((now, before) => {
      if (keys.some((key) => now[key] !== before[key])) action(now);
    });
    action(this.editor);
  }
}

/** The selected edit, or null. */
export function selected(editor: Editor): EditState | null {
  const state = editor.state;
  return state?.edits.find((edit) => edit.id === state.selected) ?? null;
}

/** Whether cages are to be seen: a preview has none, as its video. */
export function showsCages(editor: Editor): boolean {
  return editor.cages && editor.preview === null;
}

/** What a drag of the selected edit moves: the field in Edit mode, cages in Set mode. */
export function target(editor: Editor): Target {
  if (editor.mode === "edit") return "field";
  return selected(editor)?.outer === null ? "inner" : editor.cage;
}

/** What a page is told that came by a link which may not change anything. */
export const LOOKING = "this link may look but not change anything";

/** What such a page may say: the server takes nothing else of it. */
const OF_LOOKERS: PageMessage["type"][] = ["camera", "display", "presented", "drawing", "ask"];

/** Whether the page may look but not change anything. */
export function looking(editor: Editor): boolean {
  return editor.hello?.read_only === true;
}

/** Whether the server takes a message of this page. */
export function maySay(editor: Editor, message: PageMessage): boolean {
  return !looking(editor) || OF_LOOKERS.includes(message.type);
}

/** Whether the edit can be dragged at all, or why not. */
export function obstacle(editor: Editor, edit: EditState): string | null {
  const { mode } = editor;
  if (looking(editor)) return LOOKING;
  if (edit.locked) return `“${edit.name}” is locked`;
  if (!edit.enabled) return `“${edit.name}” is hidden; show it (H) to move it`;
  if (mode === "edit" && edit.kind === "delete")
    return "a delete has nothing to move; choose another kind, or Set mode (Tab)";
  return null;
}

/** Whether there is a selected edit: all of them may take light along. */
export function relightable(editor: Editor): boolean {
  return selected(editor) !== null;
}

/** What the renderer still does before whole pictures come as they will, in words; null once they do. */
export function awaited({ preparing, figures, state }: Editor): string | null {
  if (preparing === null || preparing.done >= preparing.of) return null;
  const patched =
    state?.edits.some((edit) => edit.enabled && (edit.fill !== "none" || edit.relight !== "none")) ?? false;
  if (patched && figures.width > 0 && !figures.final) return "Working out what is filled, and the light";
  return `Preparing the renderer ${preparing.done + 1}/${preparing.of} – a machine's first run only`;
}

/** Whether the selected edit uncovers something that can be filled; a copy leaves its source where it is. */
export function fillable(editor: Editor): boolean {
  const edit = selected(editor);
  return edit !== null && edit.kind !== "continuous" && edit.kind !== "copy";
}
