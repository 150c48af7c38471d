/** Reads edits of splats: small files at once, large ones in a worker, where there can be one. */
import type { FromReader, ToReader } from "./edits_worker";
import EditsWorker from "./edits_worker?worker&inline";
import { readSplatEdits } from "./splat_edits";
import type { SplatEdits } from "./splat_edits";

/** Bytes of a file that is unpacked in some milliseconds. */
const SMALL = 1 << 20;

let worker: Promise<Worker | null> | null = null;

/** What a file holds. One that is not small is let go of. */
export async function readEditsBeside(file: ArrayBuffer): Promise<SplatEdits> {
  const reader = file.byteLength > SMALL ? await (worker ??= begun()) : null;
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

/** A worker that answers, or null where the page may have none. */
function begun(): Promise<Worker | null> {
  return new Promise((resolve) => {
    const found = new EditsWorker();
    found.onmessage = () => resolve(found);
    found.onerror = () => resolve(null);
  });
}
