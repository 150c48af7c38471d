/** Draws whatever a file for pages holds, voxels or splats, with the methods of `FieldRenderer`. */
import { FieldRenderer } from "../field/field_renderer";
import type { LoadOptions, PinholeCamera } from "../field/field_renderer";
import type { Vec3 } from "../field/level";
import { readEdits } from "../field/page_edits";
import type { PageEdits } from "../field/page_edits";
import type { Bytes } from "../field/page_file";
import type { Targets, Reading } from "../field/targets";
import { EDITS_MAGIC, readSplatEdits } from "./splat_edits";
import type { SplatEdits } from "./splat_edits";
import { MAGIC } from "./splat_file";
import { SplatRenderer } from "./splat_renderer";
import type { SplatPicture } from "./splat_renderer";

export type AnyEdits = PageEdits | SplatEdits;

export class AnyRenderer {
  /** Called when another picture would be better: splats have been sorted for the camera. */
  onOrder: (() => void) | null = null;
  private inner: FieldRenderer | SplatRenderer;

  constructor(private readonly gl: WebGL2RenderingContext) {
    this.inner = new FieldRenderer(gl);
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

  get targets(): Targets {
    return this.inner.targets;
  }

  /** The background that the file says; null where it says nothing. */
  get fileBackground(): Vec3 | null {
    return this.inner instanceof SplatRenderer ? this.inner.fileBackground : (this.inner.level?.field.background ?? null);
  }

  setSize(width: number, height: number): void {
    this.inner.setSize(width, height);
  }

  setCamera(camera: PinholeCamera): void {
    this.inner.setCamera(camera);
  }

  /** Loads voxels or splats; what was there of the other kind is let go of. */
  async load(source: ReadableStream<Bytes> | ArrayBuffer, options: LoadOptions = {}): Promise<void> {
    const { start, whole } = await begun(source);
    const splats = start === MAGIC;
    if (splats !== this.inner instanceof SplatRenderer) {
      const { background, edited } = this.inner;
      this.inner.dispose();
      this.inner = splats ? new SplatRenderer(this.gl) : new FieldRenderer(this.gl);
      Object.assign(this.inner, { background, edited });
      if (this.inner instanceof SplatRenderer) this.inner.onOrder = () => this.onOrder?.();
    }
    await this.inner.load(whole, options);
  }

  async restore(): Promise<void> {
    await this.inner.restore();
  }

  /** Edits of what is loaded; null for none. */
  setEdits(edits: AnyEdits | null): void {
    const ofSplats = edits !== null && "hidden" in edits;
    if (this.inner instanceof SplatRenderer) {
      if (edits !== null && !ofSplats) throw new Error("edits of voxels, the page shows splats; reload it");
      this.inner.setEdits(edits);
    } else {
      if (ofSplats) throw new Error("edits of splats, the page shows voxels; reload it");
      this.inner.setEdits(edits);
    }
  }

  render(picture: SplatPicture = {}): boolean {
    return this.inner.render(picture);
  }

  show(width: number, height: number, framebuffer: WebGLFramebuffer | null = null): void {
    this.inner.show(width, height, framebuffer);
  }

  read(normals = false): Reading {
    return this.inner.read(normals);
  }

  readDepth(): Float32Array {
    return this.inner.readDepth();
  }

  dispose(): void {
    this.inner.dispose();
  }
}

/** Edits of voxels or of splats. */
export async function readAnyEdits(source: ArrayBuffer): Promise<AnyEdits> {
  return magicOf(new Uint8Array(source)) === EDITS_MAGIC ? await readSplatEdits(source) : await readEdits(source);
}

function magicOf(bytes: Bytes): string {
  return String.fromCharCode(...bytes.subarray(0, 8));
}

/** The first 8 letters of a file, and the whole of it. */
async function begun(source: ReadableStream<Bytes> | ArrayBuffer): Promise<{ start: string; whole: ReadableStream<Bytes> | ArrayBuffer }> {
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
