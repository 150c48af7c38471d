/** State of the editor's page, with listeners that are called at each change. */
import type { CagePart } from "../editing/cage";
import type { Curve } from "../editing/point_cages";
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
  SelectRegion,
  State,
  Vec3,
} from "../net/protocol";

export type Tool = "select" | "translate" | "rotate" | "scale";
export type View = NonNullable<DisplayMessage["view"]>;
/** Frames that the page draws itself. */
export type DrawnHere = Drawing["here"];
/** Tool that selects elements of the field with the left button. */
export type SelectTool = "brush" | "lasso" | "rectangle" | "flood";
/** How picked elements join those selected before. */
export type SelectMode = NonNullable<SelectRegion["mode"]>;
export type CageName = "inner" | "outer" | "both";
export type Target = "field" | CageName;

export interface Hover {
  part: CagePart;
  cage: "inner" | "outer";
}

export interface Figures {
  perSecond: number;
  renderMs: number;
  encodeMs: number;
  width: number;
  height: number;
  /** Whether the whole frame is there, and whether nothing refines it. */
  whole: boolean;
  final: boolean;
  /** Whether the page's own GPU drew the frame. */
  page: boolean;
}

/** Points of the surface, world space, that a tool collects: of a level plane, or of pairs that align a paste. */
export interface PickedPoints {
  purpose: "up" | "paste";
  points: Vec3[];
}

/** Values of the store without a tool whose clicks take points of the surface. */
export const NO_POINT_TOOL: Pick<Editor, "measured" | "placesHotspot" | "picked"> = {
  measured: null,
  placesHotspot: false,
  picked: null,
};

export interface Editor {
  connection: "connecting" | "open" | "lost";
  hello: Hello | null;
  state: State | null;
  mode: "set" | "edit";
  tool: Tool;
  axes: Axes;
  /** The cage that Set mode moves. */
  cage: CageName;
  /** Whether the button for snapping is on; the key reverses the button. */
  snap: boolean;
  view: View;
  before: boolean;
  split: number | null;
  grid: boolean;
  cages: boolean;
  panel: boolean;
  help: boolean;
  /** Corners, or control points, that are dragged together, by the gizmo or by one of them. */
  corners: number[];
  /** Whether control points around the dragged ones go along in part. */
  proportional: boolean;
  /** Radius of that, world units; null before the first drag, which takes it from the cage. */
  proportionalRadius: number | null;
  curve: Curve;
  hover: Hover | null;
  /** The tool that selects elements; null for the tools of cages. */
  selecting: SelectTool | null;
  /** The points of the measured distance, world space, two at most; null without the measuring tool. */
  measured: Vec3[] | null;
  /** Whether a click places a hotspot. */
  placesHotspot: boolean;
  /** The points that a tool collects; null without such a tool. */
  picked: PickedPoints | null;
  selectMode: SelectMode;
  /** Radius of the brush, a share of the height of the view. */
  brushRadius: number;
  /** Whether regions select through the field, not the visible surface alone. */
  through: boolean;
  /** Depth behind the visible surface up to which regions select, in cells. */
  depthTolerance: number;
  floodOpacity: number;
  /** Reach of a flood, a share of the diagonal of the field's box; 1 without a bound. */
  floodReach: number;
  /** Reason for the limit of the drag in progress; null without a limit. */
  limit: string | null;
  notice: Notice | null;
  /** Progress of the renderer's preparation; null before the server reports it. */
  preparing: Preparing | null;
  jobs: Job[];
  /** A file that this page is uploading, and the share that has been sent. */
  upload: { name: string; share: number } | null;
  /** The preview of the camera path that frames show, of this or another page; null without a preview. */
  preview: Preview | null;
  /** The share of the field's file that has arrived; null without a load in progress. */
  loading: number | null;
  figures: Figures;
}

export const INITIAL: Editor = {
  connection: "connecting",
  hello: null,
  state: null,
  mode: "edit",
  tool: "translate",
  axes: "world",
  cage: "inner",
  snap: false,
  view: "color",
  before: false,
  split: null,
  grid: false,
  cages: true,
  panel: true,
  help: false,
  corners: [],
  proportional: false,
  proportionalRadius: null,
  curve: "smooth",
  hover: null,
  selecting: null,
  measured: null,
  placesHotspot: false,
  picked: null,
  selectMode: "replace",
  brushRadius: 0.04,
  through: false,
  depthTolerance: 1.5,
  floodOpacity: 0.3,
  floodReach: 1,
  limit: null,
  notice: null,
  preparing: null,
  jobs: [],
  upload: null,
  preview: null,
  loading: null,
  figures: {
    perSecond: 0,
    renderMs: 0,
    encodeMs: 0,
    width: 0,
    height: 0,
    whole: false,
    final: false,
    page: false,
  },
};

export type Listener = (now: Editor, before: Editor) => void;

export class Store {
  private editor: Editor;
  private readonly listeners: Listener[] = [];

  constructor(start: Partial<Editor> = {}) {
    this.editor = { ...INITIAL, ...start };
  }

  get now(): Editor {
    return this.editor;
  }

  /** Applies changes and calls the listeners, unless all values are equal to the current ones. */
  set(change: Partial<Editor>): void {
    const before = this.editor;
    const keys = Object.keys(change) as (keyof Editor)[];
    if (keys.every((key) => Object.is(before[key], change[key]))) return;
    this.editor = { ...before, ...change };
    const now = this.editor;
    for (const listener of this.listeners) listener(now, before);
  }

  /** Adds a listener for all changes. */
  listen(listener: Listener): void {
    this.listeners.push(listener);
  }

  /** Calls an action now and at each change of one of the values. */
  watch(keys: (keyof Editor)[], action: (now: Editor) => void): void {
    this.listen((now, before) => {
      if (keys.some((key) => now[key] !== before[key])) action(now);
    });
    action(this.editor);
  }
}

/** The selected edit; null without a selection. */
export function selectedEdit(editor: Editor): EditState | null {
  const state = editor.state;
  return state?.edits.find((edit) => edit.id === state.selected) ?? null;
}

/** Whether clicks take points of the surface. */
export function hasPointTool(editor: Editor): boolean {
  return editor.measured !== null || editor.placesHotspot || editor.picked !== null;
}

/** The direction that is up: the document's, else the cameras'. */
export function upOf(editor: Editor): Vec3 {
  return editor.state?.up ?? editor.hello?.up ?? [0, 0, 1];
}

/** Whether cages are visible: a preview has none, like its video. */
export function showsCages(editor: Editor): boolean {
  return editor.cages && editor.preview === null;
}

/** Target of a drag of the selected edit: the field in Edit mode, cages in Set mode. */
export function dragTarget(editor: Editor): Target {
  if (editor.mode === "edit") return "field";
  return selectedEdit(editor)?.outer === null ? "inner" : editor.cage;
}

/** Notice of a page with a read-only link. */
export const READ_ONLY_NOTICE = "this link may look but not change anything";

/** Messages that the server accepts from a read-only page. */
const READ_ONLY_MESSAGES: PageMessage["type"][] = ["camera", "display", "presented", "drawing", "ask"];

/** Whether the page has a read-only link. */
export function isReadOnly(editor: Editor): boolean {
  return editor.hello?.read_only === true;
}

/** Whether the server accepts a message from this page. */
export function maySend(editor: Editor, message: PageMessage): boolean {
  return !isReadOnly(editor) || READ_ONLY_MESSAGES.includes(message.type);
}

/** Reason why the edit cannot be dragged; null if it can. */
export function dragObstacle(editor: Editor, edit: EditState): string | null {
  const { mode } = editor;
  if (isReadOnly(editor)) return READ_ONLY_NOTICE;
  if (edit.locked) return `“${edit.name}” is locked`;
  if (!edit.enabled) return `“${edit.name}” is hidden; show it (H) to move it`;
  if (mode === "edit" && edit.kind === "delete")
    return "a delete has nothing to move; choose another kind, or Set mode (Tab)";
  return null;
}

/** Whether shadows can move with the selected edit: with every kind of edit. */
export function canRelight(editor: Editor): boolean {
  return selectedEdit(editor) !== null;
}

/** Text for the work of the renderer before the first complete frames; null once it is done. */
export function preparationText({ preparing, figures, state }: Editor): string | null {
  if (preparing === null || preparing.done >= preparing.of) return null;
  const patched =
    state?.edits.some((edit) => edit.enabled && (edit.fill !== "none" || edit.relight !== "none")) ?? false;
  if (patched && figures.width > 0 && !figures.final) return "Computing fill and light";
  return `Preparing the renderer ${preparing.done + 1}/${preparing.of} – a machine's first run only`;
}

/** Whether the selected edit uncovers an area that can be filled; a copy keeps its source in place. */
export function canFill(editor: Editor): boolean {
  const edit = selectedEdit(editor);
  return edit !== null && edit.kind !== "continuous" && edit.kind !== "copy";
}
