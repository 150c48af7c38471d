/** Parts of cages under a pixel of the screen. */
import { EDGES, FACES, faceNormal, centroid, type CagePart, type Posed } from "./cage";
import { cageLines, handlesOf, netLine, type NetLine } from "./point_cages";
import type { Corners, Vec3 } from "../net/protocol";

export interface ScreenPoint {
  x: number;
  y: number;
  /** Distance along the viewing direction; at most 0 behind the camera. */
  depth: number;
}

export type Project = (point: Vec3) => ScreenPoint;

/** Distance in pixels within which a corner's or a face's handle, or an edge, is picked. */
const PICK_RADIUS_PIXELS = { corner: 9, face: 8, edge: 6 } as const;

export interface ViewedCage {
  corners: Corners;
  eye: Vec3;
}

/**
 * The part of a cage at pixel (x, y), or null: corners take precedence over faces and faces over edges, and of several
 * the one closest to the camera is picked. Only faces turned to the eye have a handle.
 */
export function pickPart(
  x: number,
  y: number,
  { corners, eye }: ViewedCage,
  project: Project,
): CagePart | null {
  const points = corners.map(project);
  return (
    pickCorner(x, y, corners, project) ??
    closestPart(
      "face",
      visibleFaceCenters(corners, eye).map(
        (p) => p && depthWithin(project(p), x, y, PICK_RADIUS_PIXELS.face),
      ),
    ) ??
    closestPart(
      "edge",
      EDGES.map(([i, j]) => segmentDepthWithin(points[i], points[j], x, y)),
    )
  );
}

/** The corner of a cage at pixel (x, y), or null. */
export function pickCorner(
  x: number,
  y: number,
  corners: readonly Vec3[],
  project: Project,
  kind: "corner" | "point" = "corner",
): CagePart | null {
  return closestPart(
    kind,
    corners.map((corner) => depthWithin(project(corner), x, y, PICK_RADIUS_PIXELS.corner)),
  );
}

/** The corner of a box, or the control point of another cage, at pixel (x, y), or null. */
export function pickHandle(x: number, y: number, cage: Posed, project: Project): CagePart | null {
  return pickCorner(x, y, handlesOf(cage), project, cage.points === undefined ? "corner" : "point");
}

/** The edge of a mesh at pixel (x, y), of several the one closest to the camera, or null. */
export function pickMeshEdge(x: number, y: number, cage: Posed, project: Project): CagePart | null {
  const { points, edges } = cage;
  if (points === undefined || !edges) return null;
  const places = points.map(project);
  const found = closestPart(
    "edge",
    edges.map(([i, j]) => segmentDepthWithin(places[i], places[j], x, y)),
  );
  return found && { ...found, ends: edges[found.index] };
}

/** Centers [3] of the faces turned to the eye; null for the other faces. */
export function visibleFaceCenters(corners: Corners, eye: Vec3): (Vec3 | null)[] {
  return FACES.map((ids, face) => {
    const center = centroid(corners, ids);
    const normal = faceNormal(corners, face);
    const facing = normal.reduce((sum, n, i) => sum + n * (eye[i] - center[i]), 0) > 0;
    return facing ? center : null;
  });
}

/** The line of a lattice's net nearest to pixel (x, y), within a distance in pixels; null for none. */
export function pickNetLine(
  x: number,
  y: number,
  cage: Posed,
  project: Project,
  reach: number,
): NetLine | null {
  const distances = cageLines(cage).map(
    ([from, to]) => segmentDistance(project(from), project(to), x, y)?.distance ?? Infinity,
  );
  const least = Math.min(...distances);
  return least <= reach ? netLine(cage, distances.indexOf(least)) : null;
}

/** Distance in pixels from (x, y) to the closest line, or control point, of a cage on the screen. */
export function distanceToCage(x: number, y: number, cage: Posed, project: Project): number {
  const lines = cageLines(cage).map(
    ([from, to]) => segmentDistance(project(from), project(to), x, y)?.distance ?? Infinity,
  );
  const points = (cage.points ?? []).map(project).filter(({ depth }) => depth > 0);
  return Math.min(...lines, ...points.map((p) => Math.hypot(p.x - x, p.y - y)));
}

function closestPart(kind: CagePart["kind"], depths: (number | null)[]): CagePart | null {
  let best: CagePart | null = null;
  let least = Infinity;
  depths.forEach((depth, index) => {
    if (depth !== null && depth < least) {
      least = depth;
      best = { kind, index };
    }
  });
  return best;
}

function depthWithin(p: ScreenPoint, x: number, y: number, reach: number): number | null {
  return p.depth > 0 && Math.hypot(p.x - x, p.y - y) <= reach ? p.depth : null;
}

function segmentDepthWithin(a: ScreenPoint, b: ScreenPoint, x: number, y: number): number | null {
  const found = segmentDistance(a, b, x, y);
  return found !== null && found.distance <= PICK_RADIUS_PIXELS.edge ? found.depth : null;
}

function segmentDistance(
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
