/** What the page shows and what is to be seen: whether a picture of its own is owed, and what it says of itself. */
import type { App } from "../app/app";
import type { SceneDrawer } from "../field/scene_drawer";
import type { TakenEdits } from "./page_scene";
import type { PictureHeader } from "../net/protocol";

/** What a picture shows: drawn anew where any of it is other than before. */
export interface Sight {
  parts: readonly unknown[];
  edits: TakenEdits | null;
}

export const NOTHING: Sight = { parts: [], edits: null };

/** What is to be seen now. */
export function sightOf(
  { viewport, store }: App,
  level: SceneDrawer["level"],
  edits: TakenEdits | null,
): Sight {
  const { view, before, split } = store.now;
  const { width, height } = viewport.pixels;
  return { parts: [...viewport.viewProjection.elements, width, height, view, before, split, level], edits };
}

export function sameView(one: Sight, other: Sight): boolean {
  return one.parts.length === other.parts.length && one.parts.every((part, n) => part === other.parts[n]);
}

/** Whether one shows what the other does with other lattices: a drag has ended. */
export function isFiner(now: Sight, before: Sight): boolean {
  return (
    before.edits !== null &&
    now.edits !== null &&
    before.edits.header.revision === now.edits.header.revision &&
    sameView(now, before)
  );
}

/** Whether the server's picture is there and shows what is to be seen; only a final one counts where the page draws `all`. */
export function isServed({ presenter, camera, store }: App, edits: TakenEdits | null, all: boolean): boolean {
  const { last } = presenter;
  const { view, before, split } = store.now;
  if (last === null || last.picture === 0 || edits === null || !camera.resting || last.camera !== camera.seq)
    return false;
  const same =
    last.view === view && last.before === before && last.split === split && last.drag === edits.header.drag;
  return same && last.revision >= edits.header.revision && (last.final || !all);
}

/**
 * What one of the page's pictures shows, in the words for the server's; those are numbered from 1. A `whole` one is
 * final unless better edits come: those of a drag, and the first ones after a reconnection, are of coarse lattices.
 */
export function ownHeader(
  { camera, store }: App,
  edits: TakenEdits | null,
  size: [number, number],
  whole: boolean,
  renderMs: number,
): PictureHeader {
  const final = whole && edits?.header.final === true;
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
