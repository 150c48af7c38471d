/** The kind of a scene file, read from its first bytes, and the renderer of that kind. */
import { FieldRenderer } from "../field/field_renderer";
import type { Bytes } from "../field/page_file";
import type { SceneDrawer } from "../field/scene_drawer";
import { MAGIC } from "./splat_file";
import { SplatRenderer } from "./splat_renderer";

export type SceneKind = "voxels" | "splats";

/** A scene file: the kind, read from the first bytes, and all bytes. */
export interface SceneFile {
  kind: SceneKind;
  source: ReadableStream<Bytes>;
}

const MAGIC_BYTES = 8;

/** A renderer of a kind of scene, which may take `memory` bytes of the GPU. */
export function createDrawer(kind: SceneKind, gl: WebGL2RenderingContext, memory?: number): SceneDrawer {
  return kind === "splats" ? new SplatRenderer(gl, memory) : new FieldRenderer(gl, memory);
}

/** The magic of a file, its first 8 letters. */
export function readMagic(bytes: Bytes): string {
  return String.fromCharCode(...bytes.subarray(0, MAGIC_BYTES));
}

/**
 * The kind of a scene file; every file that is not of splats counts as voxels, whose reader checks the magic.
 */
export async function identifyScene(stream: ReadableStream<Bytes>): Promise<SceneFile> {
  const reader = stream.getReader();
  const chunks: Bytes[] = [];
  let length = 0;
  while (length < MAGIC_BYTES) {
    const { value, done } = await reader.read();
    if (done) break;
    chunks.push(value);
    length += value.length;
  }
  const head = new Uint8Array(length);
  let offset = 0;
  for (const chunk of chunks) {
    head.set(chunk, offset);
    offset += chunk.length;
  }
  const source = new ReadableStream<Bytes>({
    start: (controller) => controller.enqueue(head),
    pull: async (controller) => {
      const { value, done } = await reader.read();
      if (done) controller.close();
      else controller.enqueue(value);
    },
    cancel: async (reason) => await reader.cancel(reason),
  });
  return { kind: readMagic(head) === MAGIC ? "splats" : "voxels", source };
}
