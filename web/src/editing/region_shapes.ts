/** Regions of the view that select elements: their points, and the messages about them. */
import type { SelectMode, SelectTool } from "../app/store";
import type { SelectFlood, SelectRegion } from "../net/protocol";

/** CSS pixels from the left and the top of the view. */
export interface ScreenPosition {
  x: number;
  y: number;
}

/** A region that is being drawn. */
export interface DrawnRegion {
  tool: SelectTool;
  mode: SelectMode;
  points: ScreenPosition[];
}

export interface RegionOptions {
  brushRadius: number;
  through: boolean;
  depthTolerance: number;
  floodOpacity: number;
  floodReach: number;
}

/** Distance in pixels below which a further point of a lasso or a stroke is left out. */
const MIN_STEP_PIXELS = 2;

/** Points of a message, at most: the server takes 4096. */
const MAX_POINTS = 4000;

/** Distance in pixels below which a lasso or a rectangle counts as a click, which selects nothing. */
const MIN_REGION_PIXELS = 3;

/**
 * The mode of a region: the modifier keys add, subtract or intersect. Without them a brush adds to the selection
 * where other tools replace it.
 */
export function regionMode(
  tool: SelectTool,
  chosen: SelectMode,
  { shiftKey, ctrlKey, metaKey }: Pick<MouseEvent, "shiftKey" | "ctrlKey" | "metaKey">,
): SelectMode {
  const control = ctrlKey || metaKey;
  if (shiftKey && control) return "intersect";
  if (shiftKey) return "add";
  if (control) return "subtract";
  return tool === "brush" && chosen === "replace" ? "add" : chosen;
}

/** The points of a region after the mouse has moved. */
export function extended({ tool, points }: DrawnRegion, to: ScreenPosition): ScreenPosition[] {
  if (tool === "rectangle") return [points[0], to];
  const last = points[points.length - 1];
  return Math.hypot(to.x - last.x, to.y - last.y) < MIN_STEP_PIXELS ? points : [...points, to];
}

/** The message that selects by a region of a view; null for one without an area. */
export function regionMessage(
  { tool, mode, points }: DrawnRegion,
  view: { width: number; height: number },
  options: RegionOptions,
): SelectRegion | SelectFlood | null {
  const share = ({ x, y }: ScreenPosition): [number, number] => [x / view.width, y / view.height];
  if (tool === "flood") {
    const [x, y] = share(points[0]).map((value) => Math.min(1, Math.max(0, value)));
    const { floodOpacity: threshold, floodReach: reach } = options;
    return { type: "select_flood", x, y, threshold, reach, mode };
  }
  if (tool !== "brush" && (extent(points) < MIN_REGION_PIXELS || (tool === "lasso" && points.length < 3)))
    return null;
  return {
    type: "select_region",
    shape: tool,
    points: thinned(points).map(share),
    radius: options.brushRadius,
    mode,
    through: options.through,
    tolerance: options.depthTolerance,
  };
}

/** Every other point as often as there are too many; the last one stays. */
function thinned(points: ScreenPosition[]): ScreenPosition[] {
  let kept = points;
  while (kept.length > MAX_POINTS) kept = kept.filter((_, n) => n % 2 === 0 || n === kept.length - 1);
  return kept;
}

/** The longer side of the box around points. */
function extent(points: ScreenPosition[]): number {
  const span = (values: number[]): number => Math.max(...values) - Math.min(...values);
  return Math.max(span(points.map(({ x }) => x)), span(points.map(({ y }) => y)));
}
