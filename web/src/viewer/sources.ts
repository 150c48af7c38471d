/** The files of an exported scene: beside the page, or in the page itself, which the browser reads from its begin. */
import type { Bytes } from "../field/page_file";

export type FileName = "field" | "edits" | "path";

export interface FileEntry {
  bytes: number;
  /** Relative to the page; none where the file is in the page. */
  url?: string;
}

interface Feed {
  stream: ReadableStream<Bytes>;
  controller: ReadableStreamDefaultController<Bytes>;
}

const feeds = new Map<FileName, Feed>();

function feedOf(name: FileName): Feed {
  let feed = feeds.get(name);
  if (!feed) {
    let controller: ReadableStreamDefaultController<Bytes> | undefined;
    const stream = new ReadableStream<Bytes>({ start: (given) => void (controller = given) });
    if (!controller) throw new Error("a stream without a controller");
    feeds.set(name, (feed = { stream, controller }));
  }
  return feed;
}

/** Takes the next part of a file from a script in the page, in base64; null is its end. The script is let go of. */
export function take(name: FileName, text: string | null): void {
  document.currentScript?.remove();
  const { controller } = feedOf(name);
  try {
    if (text === null) controller.close();
    else controller.enqueue(bytesOf(text));
  } catch {
    // Nobody reads the file any more.
  }
}

function bytesOf(text: string): Bytes {
  const raw = atob(text);
  const bytes = new Uint8Array(raw.length);
  for (let n = 0; n < raw.length; n++) bytes[n] = raw.charCodeAt(n);
  return bytes;
}

/** The bytes of a file, as they come. */
export async function open(name: FileName, { url }: FileEntry): Promise<ReadableStream<Bytes>> {
  if (url === undefined) return feedOf(name).stream;
  if (location.protocol === "file:")
    throw new Error(
      "A page may not read files beside it from a disk: open it by a web server (python -m http.server), or export one .html file.",
    );
  const answer = await fetch(url);
  if (!answer.ok || answer.body === null)
    throw new Error(`${url} cannot be loaded (${answer.status}); reload the page.`);
  return answer.body;
}

/** The whole of a stream. */
export async function whole(stream: ReadableStream<Bytes>): Promise<ArrayBuffer> {
  return await new Response(stream).arrayBuffer();
}
