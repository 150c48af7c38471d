/** What is drawn of the cages: lines and handles, from what the page knows. */
import type { Color } from "three";
import { EDGES, cornersOf, same, type Part } from "./cage";
import { cagesOf, type Cages, type Drag } from "./drag";
import type { Dot } from "./handles";
import { colour, type Segment } from "./lines";
import { facesTowards } from "./picking";
import type { Corners, EditState, Vec3 } from "../net/protocol";
import { obstacle, selected, showsCages, type Editor } from "../app/store";

export interface CageOverlay {
  segments: Segment[];
  dots: Dot[];
}

interface Stroke {
  width: number;
  alpha: number;
  hidden: number;
}

const INNER: Stroke = { width: 2.4, alpha: 1, hidden: 0.6 };
const OUTER: Stroke = { width: 1.5, alpha: 0.75, hidden: 0.35 };
const OUTER_SET: Stroke = { width: 2, alpha: 0.95, hidden: 0.45 };
const IDLE: Stroke = { width: 1, alpha: 0.25, hidden: 0.12 };
const GHOST: Stroke = { width: 1, alpha: 0.5, hidden: 0.3 };
const OTHER: Stroke = { width: 1.4, alpha: 0.6, hidden: 0.25 };
const OTHER_OUTER: Stroke = { width: 1, alpha: 0.25, hidden: 0.1 };
const GRID: Stroke = { width: 0.8, alpha: 0.34, hidden: 0.1 };
const HOVER: Stroke = { width: 4, alpha: 1, hidden: 0.9 };

const WHITE = colour("#ffffff");
const GHOST_COLOUR = colour("#c9ced6");

/** The cages of an edit as they are shown: those of the drag, while one moves them. */
export function shownCages(edit: EditState, drag: Drag | null): Cages {
  return drag?.edit.id === edit.id ? drag.shown : cagesOf(edit);
}

/** The cages whose parts can be dragged, the first in line first. */
export function draggable(editor: Editor, cages: Cages): { cage: "inner" | "outer"; corners: Corners }[] {
  if (editor.mode === "edit") return [{ cage: "inner", corners: cages.deformed.corners }];
  const inner = { cage: "inner" as const, corners: cages.inner.corners };
  if (cages.outer === null) return [inner];
  const outer = { cage: "outer" as const, corners: cages.outer.corners };
  return editor.cage === "outer" ? [outer, inner] : [inner, outer];
}

/** Lines and dots for everything that is to be seen of the edits. */
export function cageOverlay(editor: Editor, drag: Drag | null, grid: Vec3[][], eye: Vec3): CageOverlay {
  const out: CageOverlay = { segments: [], dots: [] };
  if (!showsCages(editor) || editor.state === null) return out;
  const chosen = selected(editor);
  for (const edit of editor.state.edits) {
    if (edit === chosen || !edit.enabled) continue;
    const cages = shownCages(edit, drag);
    const tint = colour(edit.colour);
    cage(out, cages.deformed.corners, tint, OTHER);
    if (cages.outer && edit.kind === "continuous") cage(out, cages.outer.corners, tint, OTHER_OUTER);
  }
  if (chosen !== null) chosenEdit(out, editor, chosen, shownCages(chosen, drag), grid, eye);
  return out;
}

function chosenEdit(
  out: CageOverlay,
  editor: Editor,
  edit: EditState,
  cages: Cages,
  grid: Vec3[][],
  eye: Vec3,
): void {
  const tint = colour(edit.colour);
  const setting = editor.mode === "set";
  const dim = edit.enabled ? 1 : 0.4;
  if (editor.grid) for (const line of grid) polyline(out, line, tint, GRID);
  const [first, second] = setting ? [cages.inner, cages.deformed] : [cages.deformed, cages.inner];
  if (!same(first.corners, second.corners)) cage(out, second.corners, GHOST_COLOUR, GHOST, dim);
  if (cages.outer) {
    const stroke = edit.kind !== "continuous" ? IDLE : setting && editor.cage !== "inner" ? OUTER_SET : OUTER;
    cage(out, cages.outer.corners, tint.clone().lerp(WHITE, 0.35), stroke, dim);
  }
  cage(out, first.corners, tint, INNER, dim);
  if (obstacle(editor, edit) !== null) return;
  for (const { cage: name, corners } of draggable(editor, cages)) {
    const hover = editor.hover?.cage === name ? editor.hover.part : null;
    if (hover) highlight(out, corners, hover);
    const main = name === "outer" ? editor.cage === "outer" : !setting || editor.cage !== "outer";
    dots(out, corners, tint, hover, main ? editor.corners : [], main, eye);
  }
}

function cage(out: CageOverlay, corners: Corners, tint: Color, stroke: Stroke, dim = 1): void {
  for (const [i, j] of EDGES) segment(out, corners[i], corners[j], tint, stroke, dim);
}

function polyline(out: CageOverlay, points: Vec3[], tint: Color, stroke: Stroke): void {
  for (let i = 1; i < points.length; i++) segment(out, points[i - 1], points[i], tint, stroke);
}

function segment(out: CageOverlay, from: Vec3, to: Vec3, tint: Color, stroke: Stroke, dim = 1): void {
  out.segments.push({
    from,
    to,
    colour: tint,
    width: stroke.width,
    alpha: stroke.alpha * dim,
    hidden: stroke.hidden * dim,
  });
}

function highlight(out: CageOverlay, corners: Corners, part: Part): void {
  const own = cornersOf(part);
  if (part.kind === "corner") return;
  for (const [i, j] of EDGES) {
    if (own.includes(i) && own.includes(j)) segment(out, corners[i], corners[j], WHITE, HOVER);
  }
}

function dots(
  out: CageOverlay,
  corners: Corners,
  tint: Color,
  hover: Part | null,
  chosen: number[],
  main: boolean,
  eye: Vec3,
): void {
  const size = main ? 9 : 7;
  facesTowards(corners, eye).forEach((at, index) => {
    if (at === null) return;
    const over = hover?.kind === "face" && hover.index === index;
    out.dots.push({
      at,
      colour: over ? WHITE : tint,
      size: over ? 12 : size - 1,
      shape: "square",
      filled: over,
    });
  });
  corners.forEach((at, index) => {
    const over = hover?.kind === "corner" && hover.index === index;
    const taken = chosen.includes(index);
    out.dots.push({
      at,
      colour: over || taken ? WHITE : tint,
      size: over ? 14 : taken ? 12 : size,
      shape: "round",
      filled: !taken || over,
    });
  });
}
