/** What is under the mouse, among the parts of the cages as they are on the screen. */
import { EDGES, FACES, faceNormal, middle, type Part } from "./cage";
import type { Corners, Vec3 } from "../net/protocol";

export interface ScreenPoint {
  x: number;
  y: number;
  /** Distance along the view; not above 0 behind the camera. */
  depth: number;
}

export type Project = (point: Vec3) => ScreenPoint;

/** Pixels within which a corner's or a face's handle, or an edge, is meant. */
const REACH = { corner: 9, face: 8, edge: 6 } as const;

export interface Candidate {
  corners: Corners;
  eye: Vec3;
}

/**
 * The part of a cage at pixel (x, y), or null: corners before faces before edges, and of several the one
 * nearest to the camera. Only faces that look towards the eye have a handle.
 */
export function pick(x: number, y: number, { corners, eye }: Candidate, project: Project): Part | null {
  const points = corners.map(project);
  return (
    pickCorner(x, y, corners, project) ??
    nearest(
      "face",
      facesTowards(corners, eye).map((p) => p && near(project(p), x, y, REACH.face)),
    ) ??
    nearest(
      "edge",
      EDGES.map(([i, j]) => nearSegment(points[i], points[j], x, y)),
    )
  );
}

/** The corner of a cage at pixel (x, y), or null. */
export function pickCorner(x: number, y: number, corners: Corners, project: Project): Part | null {
  return nearest(
    "corner",
    corners.map((corner) => near(project(corner), x, y, REACH.corner)),
  );
}

/** The middle of each face that looks towards the eye, null for the others. */
export function facesTowards(corners: Corners, eye: Vec3): (Vec3 | null)[] {
  return FACES.map((ids, face) => {
    const centre = middle(corners, ids);
    const normal = faceNormal(corners, face);
    const facing = normal.reduce((sum, n, i) => sum + n * (eye[i] - centre[i]), 0) > 0;
    return facing ? centre : null;
  });
}

/** Distance in pixels from (x, y) to a cage's nearest edge on the screen. */
export function distanceToEdges(x: number, y: number, corners: Corners, project: Project): number {
  const points = corners.map(project);
  return Math.min(...EDGES.map(([i, j]) => segment(points[i], points[j], x, y)?.distance ?? Infinity));
}

function nearest(kind: Part["kind"], depths: (number | null)[]): Part | null {
  let best: Part | null = null;
  let least = Infinity;
  depths.forEach((depth, index) => {
    if (depth !== null && depth < least) {
      least = depth;
      best = { kind, index };
    }
  });
  return best;
}

function near(p: ScreenPoint, x: number, y: number, reach: number): number | null {
  return p.depth > 0 && Math.hypot(p.x - x, p.y - y) <= reach ? p.depth : null;
}

function nearSegment(a: ScreenPoint, b: ScreenPoint, x: number, y: number): number | null {
  const found = segment(a, b, x, y);
  return found !== null && found.distance <= REACH.edge ? found.depth : null;
}

function segment(
  a: ScreenPoint,
  b: ScreenPoint,
  x: number,
  y: number,
): { distance: number; depth: number } | null {
  if (a.depth <= 0 || b.depth <= 0) return null;
  const dx = b.x - a.x;
  const dy = b.y - a.y;
  const length = dx * dx + dy * dy;
  const t = length > 0 ? Math.min(1, Math.max(0, ((x - a.x) * dx + (y - a.y) * dy) / length)) : 0;
  return {
    distance: Math.hypot(a.x + t * dx - x, a.y + t * dy - y),
    depth: a.depth + t * (b.depth - a.depth),
  };
}
