/**
 * Interface of a WebGL2 renderer that draws a scene and its edits: `FieldRenderer` and `SplatRenderer`
 * implement it.
 */
import type { Vec3 } from "./level";
import type { PinholeCamera } from "./march_uniforms";
import type { Bytes, OnArrival } from "./page_file";
import type { Distances, View } from "./views";

export interface LoadOptions {
  onArrival?: OnArrival;
  /** Opens a file beside the scene's own: one with details. Without it the coarse level is all. */
  openBeside?: (url: string) => Promise<ReadableStream<Bytes>>;
  /** Called when details have replaced coarse parts of the scene. */
  onDetails?: () => void;
  /** Called where there is no room for so many of the nodes of details in the image. */
  onCoarse?: (nodes: number, of: number) => void;
  /** Called where details could not be loaded after the scene was complete, with the reason. */
  onFailure?: (reason: string) => void;
  /** Called when a level can be drawn, from coarse to fine; levels are numbered from 1. */
  onLevel?: (number: number, count: number) => void;
}

/** Options of one rendered image. */
export interface RenderOptions {
  normals?: boolean;
  /** Splats must be sorted for this very camera, and the call waits for the sort. */
  sorted?: boolean;
  /** Counts of samples and texture reads in place of depth. */
  count?: boolean;
  /** Rows to draw, from the bottom: an image drawn in parts keeps the page responsive on slow GPUs. */
  rows?: { first: number; count: number };
  /** Columns to draw, from the left. */
  columns?: { first: number; count: number };
}

export interface SceneDrawer<Edits = unknown> {
  background: Vec3;
  /** Whether the edits are applied; false draws the scene before the edits. */
  edited: boolean;
  /** Called when a redraw would improve the image: the splats have been sorted for the camera. */
  onOrder: (() => void) | null;
  /** The level that is drawn, another object for each level; null before the first one. */
  readonly level: { readonly field: { readonly background: Vec3 | null }; readonly last: boolean } | null;
  /** Whether drawing a few rows takes less time than drawing the whole image. */
  readonly inBands: boolean;
  /** Whether the splats of the last image were in the depth order of its camera; true for voxels. */
  readonly inOrder: boolean;
  /** Whether edits can be applied to the levels loaded so far. */
  readonly editable: boolean;
  /** Number of compiled shaders: the time of an image that waited for a compilation is no measure of speed. */
  readonly compiled: number;
  /** Bytes of edits uploaded, by the last `setEdits` and by all. */
  readonly uploaded: { readonly last: number; readonly total: number };
  setSize(width: number, height: number): void;
  setCamera(camera: PinholeCamera): void;
  /** Loads a scene; a later call replaces one in progress. Throws `TooLarge` beyond the memory limit. */
  load(source: ReadableStream<Bytes> | ArrayBuffer, options?: LoadOptions): Promise<void>;
  /** Decodes a file of edits; `before` supplies the parts that the file omits because the page has them. */
  readEdits(file: ArrayBuffer, before: Edits | null): Promise<Edits>;
  /** Does the slow part of showing edits ahead of `setEdits`, which is then quick for the same edits. */
  prepare(edits: Edits): Promise<void>;
  setEdits(edits: Edits | null): void;
  /** Draws the camera's image; false while there is nothing to draw. */
  render(options?: RenderOptions): boolean;
  show(width: number, height: number, framebuffer?: WebGLFramebuffer | null, view?: View): void;
  /** At most about `most` distances of the drawn image, top row first. */
  distances(most: number): Distances;
  /** Waits until the GPU has drawn. */
  wait(): void;
  /** Uploads the scene again after the GL context was lost and restored. */
  restore(): Promise<void>;
  /** Frees all GPU objects. */
  dispose(): void;
}
