/** Lines and handles of all cages for the state of the editor. */
import type { Color } from "three";
import { EDGES, partCorners, type CagePart, type Posed } from "./cage";
import { carryCages } from "./carrier";
import { areSimilarCages, cagesOf, targetCage, type Cages, type Drag } from "./drag";
import type { Dot } from "./handles";
import { color, type Segment } from "./lines";
import { visibleFaceCenters } from "./picking";
import { cageLines, circle, handlesOf, middleOf } from "./point_cages";
import type { Corners, EditState, Vec3 } from "../net/protocol";
import { dragObstacle, selectedEdit, showsCages, type Editor } from "../app/store";

export interface CageOverlay {
  segments: Segment[];
  dots: Dot[];
}

interface Stroke {
  width: number;
  alpha: number;
  hiddenAlpha: number;
}

const INNER: Stroke = { width: 2.4, alpha: 1, hiddenAlpha: 0.6 };
const NET: Stroke = { width: 1.4, alpha: 0.85, hiddenAlpha: 0.3 };
const REACH: Stroke = { width: 1.2, alpha: 0.9, hiddenAlpha: 0.9 };
const OUTER: Stroke = { width: 1.5, alpha: 0.75, hiddenAlpha: 0.35 };
const OUTER_SET: Stroke = { width: 2, alpha: 0.95, hiddenAlpha: 0.45 };
const IDLE: Stroke = { width: 1, alpha: 0.25, hiddenAlpha: 0.12 };
const GHOST: Stroke = { width: 1, alpha: 0.5, hiddenAlpha: 0.3 };
const OTHER: Stroke = { width: 1.4, alpha: 0.6, hiddenAlpha: 0.25 };
const OTHER_OUTER: Stroke = { width: 1, alpha: 0.25, hiddenAlpha: 0.1 };
const GRID: Stroke = { width: 0.8, alpha: 0.34, hiddenAlpha: 0.1 };
const HOVER: Stroke = { width: 4, alpha: 1, hiddenAlpha: 0.9 };

const WHITE = color("#ffffff");
const GHOST_COLOR = color("#c9ced6");

/** The cages of an edit as they are drawn: those of the drag of this edit, if any, where its parents carry them. */
export function shownCages(edit: EditState, drag: Drag | null): Cages {
  return carryCages(edit.carrier, restCages(edit, drag));
}

/** The cages of an edit at rest: those of the drag of this edit, if any. */
export function restCages(edit: EditState, drag: Drag | null): Cages {
  return drag?.edit.id === edit.id ? drag.shown : cagesOf(edit);
}

/** The cages whose parts can be dragged, in order of precedence. */
export function draggableCages(editor: Editor, cages: Cages): { cage: "inner" | "outer"; posed: Posed }[] {
  if (editor.mode === "edit") return [{ cage: "inner", posed: cages.deformed }];
  const inner = { cage: "inner" as const, posed: cages.inner };
  if (cages.outer === null) return [inner];
  const outer = { cage: "outer" as const, posed: cages.outer };
  return editor.cage === "outer" ? [outer, inner] : [inner, outer];
}

/** Lines and dots of all visible edits. */
export function cageOverlay(
  editor: Editor,
  drag: Drag | null,
  grid: Vec3[][],
  eye: Vec3,
  forward: Vec3,
): CageOverlay {
  const out: CageOverlay = { segments: [], dots: [] };
  if (!showsCages(editor) || editor.state === null) return out;
  const chosen = selectedEdit(editor);
  for (const edit of editor.state.edits) {
    if (edit === chosen || !edit.enabled) continue;
    const cages = shownCages(edit, drag);
    const tint = color(edit.color);
    addCage(out, cages.deformed, tint, OTHER);
    if (hasOwnPoints(edit)) addPoints(out, cages.deformed, tint);
    if (cages.outer && edit.kind === "continuous" && !edit.outer_follows)
      addCage(out, cages.outer, tint, OTHER_OUTER);
  }
  if (chosen === null) return out;
  const cages = shownCages(chosen, drag);
  addSelectedEdit(out, editor, chosen, cages, grid, eye);
  if (chosen.cage === "points") addReach(out, editor, cages, color(chosen.color), forward);
  if (drag?.operation?.kind === "move_points" && (drag.operation.radius ?? 0) > 0) {
    const center = middleOf(targetCage(cages, drag.target), drag.operation.points);
    addPolyline(out, circle(center, drag.operation.radius!, forward), WHITE, REACH);
  }
  return out;
}

/** Whether points are drawn by themselves: those of a lattice are on its net. */
function hasOwnPoints(edit: EditState): boolean {
  return edit.cage === "points" || edit.cage === "mesh";
}

function addSelectedEdit(
  out: CageOverlay,
  editor: Editor,
  edit: EditState,
  cages: Cages,
  grid: Vec3[][],
  eye: Vec3,
): void {
  const tint = color(edit.color);
  const setting = editor.mode === "set";
  const dim = edit.enabled ? 1 : 0.4;
  if (editor.grid) for (const line of grid) addPolyline(out, line, tint, GRID);
  const [first, second] = setting ? [cages.inner, cages.deformed] : [cages.deformed, cages.inner];
  if (!areSimilarCages(first, second)) addCage(out, second, GHOST_COLOR, GHOST, dim);
  if (cages.outer && !edit.outer_follows) {
    const stroke = edit.kind !== "continuous" ? IDLE : setting && editor.cage !== "inner" ? OUTER_SET : OUTER;
    addCage(out, cages.outer, tint.clone().lerp(WHITE, 0.35), stroke, dim);
  }
  addCage(out, first, tint, edit.cage === "lattice" || edit.cage === "mesh" ? NET : INNER, dim);
  if (dragObstacle(editor, edit) !== null) {
    if (hasOwnPoints(edit)) addPoints(out, first, tint);
    return;
  }
  for (const { cage: name, posed } of draggableCages(editor, cages)) {
    const hover = editor.hover?.cage === name ? editor.hover.part : null;
    if (hover && posed.points === undefined) addHighlight(out, posed.corners, hover);
    if (hover?.ends && posed.points) {
      const [i, j] = hover.ends;
      addSegment(out, posed.points[i], posed.points[j], WHITE, HOVER);
    }
    const main = name === "outer" ? editor.cage === "outer" : !setting || editor.cage !== "outer";
    addDots(out, posed, tint, hover, main ? editor.corners : [], main, eye);
  }
}

function addCage(out: CageOverlay, cage: Posed, tint: Color, stroke: Stroke, dim = 1): void {
  for (const [from, to] of cageLines(cage)) addSegment(out, from, to, tint, stroke, dim);
}

/** Control points on their own of an edit that cannot be dragged now. */
function addPoints(out: CageOverlay, cage: Posed, tint: Color): void {
  for (const position of handlesOf(cage))
    out.dots.push({ position, color: tint, size: 6, shape: "round", filled: true });
}

/** Circles with the radius of control points. */
function addReach(out: CageOverlay, editor: Editor, cages: Cages, tint: Color, forward: Vec3): void {
  const cage = editor.mode === "set" ? cages.inner : cages.deformed;
  for (const point of handlesOf(cage))
    addPolyline(out, circle(point, cage.radius ?? 0, forward), tint, OUTER);
}

function addPolyline(out: CageOverlay, points: Vec3[], tint: Color, stroke: Stroke): void {
  for (let i = 1; i < points.length; i++) addSegment(out, points[i - 1], points[i], tint, stroke);
}

function addSegment(out: CageOverlay, from: Vec3, to: Vec3, tint: Color, stroke: Stroke, dim = 1): void {
  out.segments.push({
    from,
    to,
    srgbColor: tint,
    width: stroke.width,
    alpha: stroke.alpha * dim,
    hiddenAlpha: stroke.hiddenAlpha * dim,
  });
}

function addHighlight(out: CageOverlay, corners: Corners, part: CagePart): void {
  const own = partCorners(part);
  if (part.kind === "corner") return;
  for (const [i, j] of EDGES) {
    if (own.includes(i) && own.includes(j)) addSegment(out, corners[i], corners[j], WHITE, HOVER);
  }
}

function addDots(
  out: CageOverlay,
  cage: Posed,
  tint: Color,
  hover: CagePart | null,
  chosen: number[],
  main: boolean,
  eye: Vec3,
): void {
  const size = main ? 9 : 7;
  const faces = cage.points === undefined ? visibleFaceCenters(cage.corners, eye) : [];
  faces.forEach((center, index) => {
    if (center === null) return;
    const over = hover?.kind === "face" && hover.index === index;
    out.dots.push({
      position: center,
      color: over ? WHITE : tint,
      size: over ? 12 : size - 1,
      shape: "square",
      filled: over,
    });
  });
  handlesOf(cage).forEach((corner, index) => {
    const over = (hover?.kind === "corner" || hover?.kind === "point") && hover.index === index;
    const taken = chosen.includes(index);
    out.dots.push({
      position: corner,
      color: over || taken ? WHITE : tint,
      size: over ? 14 : taken ? 12 : size,
      shape: "round",
      filled: !taken || over,
    });
  });
}
