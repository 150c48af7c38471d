/** What of a renderer of the page's GPU the editor uses: `FieldRenderer` is one, `SplatRenderer` another. */
import type { LoadOptions, Picture } from "./field_renderer";
import type { Vec3 } from "./level";
import type { PinholeCamera } from "./march_uniforms";
import type { PageEdits } from "./page_edits";
import type { Bytes } from "./page_file";
import type { Distances, View } from "./views";

export interface SceneDrawer<Edits = PageEdits> {
  background: Vec3;
  /** Whether the edits are seen; false shows the scene before them. */
  edited: boolean;
  /** What it is that is drawn; another object once more of it has come. Null while there is nothing. */
  readonly level: { readonly field: { readonly background: Vec3 | null }; readonly last: boolean } | null;
  /** Whether a few rows of a picture take less time than all of them. */
  readonly inBands: boolean;
  /** Whether the last picture is as good as one of its camera gets: splats may be in the order of a moment ago. */
  readonly inOrder: boolean;
  /** Whether edits would be seen on what has come so far. */
  readonly editable: boolean;
  /** Shaders that were compiled: a picture that had to wait for one says nothing of its speed. */
  readonly compiled: number;
  /** Bytes of edits that were uploaded, the last time and in all. */
  readonly uploaded: { readonly last: number; readonly total: number };
  setSize(width: number, height: number): void;
  setCamera(camera: PinholeCamera): void;
  load(source: ReadableStream<Bytes> | ArrayBuffer, options?: LoadOptions): Promise<void>;
  /** Does beside the page what takes long of showing edits; `setEdits` with the same edits is then quick. */
  prepare(edits: Edits): Promise<void>;
  setEdits(edits: Edits | null): void;
  /** Draws what the camera sees; false while there is nothing to draw. */
  render(picture?: Picture): boolean;
  show(width: number, height: number, framebuffer?: WebGLFramebuffer | null, view?: View): void;
  distances(most: number): Distances;
  /** Waits until the GPU has drawn. */
  wait(): void;
  /** Uploads what was shown again, after the context was lost and restored. */
  restore(): Promise<void>;
  /** Frees what lies on the GPU. */
  dispose(): void;
}
