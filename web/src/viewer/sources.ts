/**
 * Files of an exported scene: beside the page, or embedded in the page as scripts, which arrive one after the
 * other.
 */
import type { Bytes } from "../field/page_file";

export type FileName = "field" | "edits" | "path";

export interface FileEntry {
  bytes: number;
  /** Address relative to the page; absent for an embedded file. */
  url?: string;
}

interface Feed {
  stream: ReadableStream<Bytes>;
  controller: ReadableStreamDefaultController<Bytes>;
}

const feeds = new Map<FileName, Feed>();

function feedFor(name: FileName): Feed {
  let feed = feeds.get(name);
  if (!feed) {
    let controller: ReadableStreamDefaultController<Bytes> | undefined;
    const stream = new ReadableStream<Bytes>({ start: (given) => void (controller = given) });
    if (!controller) throw new Error("a stream without a controller");
    feeds.set(name, (feed = { stream, controller }));
  }
  return feed;
}

/**
 * Takes the next chunk of an embedded file, in base64, from a script of the page, and removes the script;
 * null ends the file.
 */
export function takeBytes(name: FileName, text: string | null): void {
  document.currentScript?.remove();
  const { controller } = feedFor(name);
  try {
    if (text === null) controller.close();
    else controller.enqueue(decodeBase64(text));
  } catch {
    // The reader of the file has stopped.
  }
}

function decodeBase64(text: string): Bytes {
  const raw = atob(text);
  const bytes = new Uint8Array(raw.length);
  for (let n = 0; n < raw.length; n++) bytes[n] = raw.charCodeAt(n);
  return bytes;
}

/** The bytes of a file, as a stream. */
export async function openFile(name: FileName, { url }: FileEntry): Promise<ReadableStream<Bytes>> {
  return url === undefined ? feedFor(name).stream : await openBeside(url);
}

/** The bytes of a file beside the page, as a stream. */
export async function openBeside(url: string): Promise<ReadableStream<Bytes>> {
  if (location.protocol === "file:")
    throw new Error(
      "A browser does not let a page read files beside it on a disk: serve the folder (python -m http.server), or export a single .html file.",
    );
  const answer = await fetch(url);
  if (!answer.ok || answer.body === null)
    throw new Error(`${url} cannot be loaded (${answer.status}); reload the page.`);
  return answer.body;
}

/** All bytes of a stream. */
export async function readAll(stream: ReadableStream<Bytes>): Promise<ArrayBuffer> {
  return await new Response(stream).arrayBuffer();
}
