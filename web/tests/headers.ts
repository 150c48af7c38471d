/** Headers of frames and edits for tests. */
import type { AppliedEdits } from "../src/frames/page_scene";
import type { EditsHeader, PictureHeader } from "../src/net/protocol";

/** The header of a final server frame of 1 x 1 pixels, number 7, of camera message 3 and revision 1. */
export const PICTURE: PictureHeader = {
  type: "picture",
  picture: 7,
  camera: 3,
  drag: 0,
  seq: 0,
  revision: 1,
  view: "color",
  before: false,
  split: null,
  x: 0,
  y: 0,
  width: 1,
  height: 1,
  full_width: 1,
  full_height: 1,
  whole: true,
  refinement: 3,
  final: true,
  format: "rgb",
  picture_bytes: 3,
  depth_bytes: 2,
  depth_width: 1,
  depth_height: 1,
  depth_scale: 1,
  render_ms: 60,
  encode_ms: 1,
};

/** The header of the final edits of revision 1. */
export const EDITS: EditsHeader = {
  type: "edits",
  picture: 9,
  drag: 0,
  seq: 0,
  revision: 1,
  final: true,
  why: null,
  map_ms: 0,
  encode_ms: 0,
};

export function appliedEdits(changes: Partial<EditsHeader> = {}): AppliedEdits {
  return { header: { ...EDITS, ...changes }, received: 10, decoded: 20 };
}
