/** Reader of edits of splats: small files at once, large ones in a worker if the page may have one. */
import type { FromReader, ToReader } from "./edits_worker";
import EditsWorker from "./edits_worker?worker&inline";
import { readSplatEdits } from "./splat_edits";
import type { SplatEdits } from "./splat_edits";

/** Bytes of a file that is decoded within some milliseconds. */
const MAX_SYNCHRONOUS_BYTES = 1 << 20;

let worker: Promise<Worker | null> | null = null;

/** The edits of a file; the buffer of a large file is transferred to the worker. */
export async function readEditsInWorker(file: ArrayBuffer): Promise<SplatEdits> {
  const reader = file.byteLength > MAX_SYNCHRONOUS_BYTES ? await (worker ??= startWorker()) : null;
  if (reader === null) return await readSplatEdits(file);
  const { port1, port2 } = new MessageChannel();
  const answer = new Promise<FromReader>((resolve) => {
    port1.onmessage = ({ data }: MessageEvent<FromReader>) => resolve(data);
  });
  reader.postMessage({ file, answer: port2 } satisfies ToReader, [file, port2]);
  const found = await answer;
  port1.close();
  if ("why" in found) throw new Error(found.why);
  return found.edits;
}

/** A worker that has answered; null if the page may have none. */
function startWorker(): Promise<Worker | null> {
  return new Promise((resolve) => {
    const found = new EditsWorker();
    found.onmessage = () => resolve(found);
    found.onerror = () => resolve(null);
  });
}
