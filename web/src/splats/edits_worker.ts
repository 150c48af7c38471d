/** Worker that decodes edits of many splats while the page goes on drawing. */
import { readSplatEdits } from "./splat_edits";
import type { SplatEdits } from "./splat_edits";

/** A file, and the port for the answer. */
export interface ToReader {
  file: ArrayBuffer;
  answer: MessagePort;
}

export type FromReader = { edits: SplatEdits } | { why: string };

self.onmessage = async ({ data }: MessageEvent<ToReader>): Promise<void> => {
  const { file, answer } = data;
  try {
    const edits = await readSplatEdits(file);
    answer.postMessage({ edits } satisfies FromReader, [
      edits.hidden.buffer,
      edits.means.buffer,
      edits.records.buffer,
    ]);
  } catch (error) {
    answer.postMessage({ why: error instanceof Error ? error.message : String(error) } satisfies FromReader);
  }
};

self.postMessage("ready");
