/**
 * State of a frame: the view and the edits that it shows, whether a redraw is due, and the header of the
 * page's own frames.
 */
import type { Matrix4 } from "three";
import type { Store } from "../app/store";
import type { SceneDrawer } from "../field/scene_drawer";
import type { PictureHeader } from "../net/protocol";
import type { AppliedEdits } from "./page_scene";

/** The view and the edits of a frame; a change of either makes a redraw due. */
export interface FrameState {
  /** Camera matrix, size, view options and level of detail, compared one by one. */
  view: readonly unknown[];
  edits: AppliedEdits | null;
}

export interface ViewSource {
  readonly viewport: {
    readonly viewProjection: Matrix4;
    readonly pixels: { width: number; height: number };
  };
  readonly store: Store;
}

export interface CameraState {
  /** Number of the last camera message. */
  readonly seq: number;
  /** Whether the server knows the camera, and that the camera rests. */
  readonly resting: boolean;
}

/** The state of no frame: every frame differs from it. */
export const NO_FRAME: FrameState = { view: [], edits: null };

/** The state of the frame that is due now. */
export function currentFrame(
  { viewport, store }: ViewSource,
  level: SceneDrawer["level"],
  edits: AppliedEdits | null,
): FrameState {
  const { view, before, split } = store.now;
  const { width, height } = viewport.pixels;
  return { view: [...viewport.viewProjection.elements, width, height, view, before, split, level], edits };
}

export function hasSameView(one: FrameState, other: FrameState): boolean {
  return one.view.length === other.view.length && one.view.every((value, n) => value === other.view[n]);
}

/** Whether two frames differ in the lattices of their edits alone: after a drag the lattices are finer. */
export function isRefined(now: FrameState, before: FrameState): boolean {
  if (before.edits === null || now.edits === null) return false;
  return before.edits.header.revision === now.edits.header.revision && hasSameView(now, before);
}

/**
 * Whether the server's last frame shows the current view and edits; only a final frame counts if the page
 * draws `all`.
 */
export function isServed(
  last: PictureHeader | null,
  camera: CameraState,
  store: Store,
  edits: AppliedEdits | null,
  all: boolean,
): boolean {
  const { view, before, split } = store.now;
  if (last === null || last.picture === 0 || edits === null) return false;
  if (!camera.resting || last.camera !== camera.seq) return false;
  const { drag, revision } = edits.header;
  const sameView = last.view === view && last.before === before && last.split === split;
  return sameView && last.drag === drag && last.revision >= revision && (last.final || !all);
}

/**
 * The header of a frame drawn by the page: number 0, where the server's frames are numbered from 1. A `complete` frame
 * is final if its edits are: the lattices of a drag, and the first ones after a reconnection, are coarse.
 */
export function ownHeader(
  camera: CameraState,
  store: Store,
  edits: AppliedEdits | null,
  size: readonly [number, number],
  complete: boolean,
  renderMs: number,
): PictureHeader {
  const final = complete && edits?.header.final === true;
  const { view, before, split } = store.now;
  const { drag, seq, revision } = edits?.header ?? { drag: 0, seq: 0, revision: 0 };
  const [width, height] = size;
  return {
    type: "picture",
    picture: 0,
    camera: camera.seq,
    drag,
    seq,
    revision,
    view,
    before,
    split,
    x: 0,
    y: 0,
    width,
    height,
    full_width: width,
    full_height: height,
    whole: complete,
    refinement: final ? 3 : 0,
    final,
    format: "rgb",
    picture_bytes: 0,
    depth_bytes: 0,
    depth_width: 0,
    depth_height: 0,
    depth_scale: 1,
    render_ms: renderMs,
    encode_ms: 0,
  };
}
