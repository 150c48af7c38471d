/** Draws whatever a file for pages holds, voxels or splats. */
import { FieldRenderer } from "../field/field_renderer";
import type { LoadOptions, Picture } from "../field/field_renderer";
import type { Vec3 } from "../field/level";
import type { PinholeCamera } from "../field/march_uniforms";
import { readEdits } from "../field/page_edits";
import type { PageEdits } from "../field/page_edits";
import type { Bytes } from "../field/page_file";
import type { SceneDrawer } from "../field/scene_drawer";
import type { Distances, View } from "../field/views";
import { readEditsBeside } from "./edits_reader";
import { EDITS_MAGIC } from "./splat_edits";
import type { SplatEdits } from "./splat_edits";
import { MAGIC } from "./splat_file";
import { SplatRenderer } from "./splat_renderer";

export type AnyEdits = PageEdits | SplatEdits;

export class AnyRenderer implements SceneDrawer<AnyEdits> {
  /** Called when another picture would be better: splats have been sorted for the camera. */
  onOrder: (() => void) | null = null;
  private inner: FieldRenderer | SplatRenderer;
  private loading = 0;

  constructor(
    private readonly gl: WebGL2RenderingContext,
    private readonly memory?: number,
  ) {
    this.inner = new FieldRenderer(gl, memory);
  }

  get background(): Vec3 {
    return this.inner.background;
  }

  set background(colour: Vec3) {
    this.inner.background = colour;
  }

  get edited(): boolean {
    return this.inner.edited;
  }

  set edited(on: boolean) {
    this.inner.edited = on;
  }

  get level(): SceneDrawer["level"] {
    return this.inner.level;
  }

  get inBands(): boolean {
    return this.inner.inBands;
  }

  get inOrder(): boolean {
    return this.inner.inOrder;
  }

  get editable(): boolean {
    return this.inner.editable;
  }

  get compiled(): number {
    return this.inner.compiled;
  }

  get uploaded(): SceneDrawer["uploaded"] {
    return this.inner.uploaded;
  }

  setSize(width: number, height: number): void {
    this.inner.setSize(width, height);
  }

  setCamera(camera: PinholeCamera): void {
    this.inner.setCamera(camera);
  }

  /** Loads voxels or splats; what was there of the other kind is let go of. A later call takes the place of this one. */
  async load(source: ReadableStream<Bytes> | ArrayBuffer, options: LoadOptions = {}): Promise<void> {
    const turn = ++this.loading;
    const { start, whole } = await begun(source);
    if (turn !== this.loading) {
      if (!(whole instanceof ArrayBuffer)) await whole.cancel();
      return;
    }
    const splats = start === MAGIC;
    if (splats !== this.inner instanceof SplatRenderer) {
      const { background, edited } = this.inner;
      this.inner.dispose();
      this.inner = splats ? new SplatRenderer(this.gl, this.memory) : new FieldRenderer(this.gl, this.memory);
      Object.assign(this.inner, { background, edited });
      if (this.inner instanceof SplatRenderer) this.inner.onOrder = () => this.onOrder?.();
    }
    await this.inner.load(whole, options);
  }

  async restore(): Promise<void> {
    await this.inner.restore();
  }

  /** Has the splats of edits sorted; of voxels nothing takes long. */
  async prepare(edits: AnyEdits): Promise<void> {
    if (this.inner instanceof SplatRenderer && isOfSplats(edits)) await this.inner.prepare(edits);
  }

  /** Edits of what is loaded; null for none. */
  setEdits(edits: AnyEdits | null): void {
    if (this.inner instanceof SplatRenderer) {
      if (edits !== null && !isOfSplats(edits))
        throw new Error("edits of voxels, the page shows splats; reload it");
      this.inner.setEdits(edits);
    } else {
      if (isOfSplats(edits)) throw new Error("edits of splats, the page shows voxels; reload it");
      this.inner.setEdits(edits);
    }
  }

  render(picture: Picture = {}): boolean {
    return this.inner.render(picture);
  }

  show(
    width: number,
    height: number,
    framebuffer: WebGLFramebuffer | null = null,
    view: View = "colour",
  ): void {
    this.inner.show(width, height, framebuffer, view);
  }

  distances(most: number): Distances {
    return this.inner.distances(most);
  }

  wait(): void {
    this.inner.wait();
  }

  dispose(): void {
    this.loading++;
    this.inner.dispose();
  }
}

/** Edits of voxels, what a file leaves out of them from `before`, or of splats, which a file has whole. */
export async function readAnyEdits(source: ArrayBuffer, before: AnyEdits | null): Promise<AnyEdits> {
  if (magicOf(new Uint8Array(source)) === EDITS_MAGIC) return await readEditsBeside(source);
  return await readEdits(source, isOfSplats(before) ? null : before);
}

function isOfSplats(edits: AnyEdits | null): edits is SplatEdits {
  return edits !== null && "hidden" in edits;
}

/** The first 8 letters of a file: which kind it is of. */
export function magicOf(bytes: Bytes): string {
  return String.fromCharCode(...bytes.subarray(0, 8));
}

/** The first 8 letters of a file, and the whole of it. */
async function begun(
  source: ReadableStream<Bytes> | ArrayBuffer,
): Promise<{ start: string; whole: ReadableStream<Bytes> | ArrayBuffer }> {
  if (source instanceof ArrayBuffer) return { start: magicOf(new Uint8Array(source)), whole: source };
  const reader = source.getReader();
  const held: Bytes[] = [];
  let length = 0;
  while (length < 8) {
    const { value, done } = await reader.read();
    if (done) break;
    held.push(value);
    length += value.length;
  }
  const first = new Uint8Array(length);
  let at = 0;
  for (const part of held) {
    first.set(part, at);
    at += part.length;
  }
  const whole = new ReadableStream<Bytes>({
    start: (controller) => controller.enqueue(first),
    pull: async (controller) => {
      const { value, done } = await reader.read();
      if (done) controller.close();
      else controller.enqueue(value);
    },
    cancel: async (reason) => await reader.cancel(reason),
  });
  return { start: magicOf(first), whole };
}
