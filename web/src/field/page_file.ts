/** Files for pages as `cagefield.pages.page_file` writes them: a JSON header, and deflated arrays in order. */

export type Bytes = Uint8Array<ArrayBuffer>;
export type Numbers = Uint8Array | Uint16Array | Int32Array | Float32Array;

interface ArrayEntry {
  name: string;
  type: "u1" | "u2" | "i4" | "f4";
  shape: number[];
  bytes: number;
}

/** Bytes that arrived, and those that are to come where the sender says how many. */
export type OnArrival = (bytes: number) => void;

/** Takes so many bytes at a time from a stream, however it is cut. */
export class ByteReader {
  private held: Bytes[] = [];
  private length = 0;
  private arrived = 0;
  private readonly source: ReadableStreamDefaultReader<Bytes>;

  constructor(
    source: ReadableStream<Bytes> | ArrayBuffer,
    private readonly onArrival: OnArrival = () => undefined,
  ) {
    this.source = (source instanceof ArrayBuffer ? new Blob([source]).stream() : source).getReader();
  }

  /** The next `count` bytes; throws where the stream ends before. */
  async take(count: number): Promise<Bytes> {
    while (this.length < count) {
      const { value, done } = await this.source.read();
      if (done) throw new Error("the file of the field is truncated");
      this.held.push(value);
      this.length += value.length;
      this.arrived += value.length;
      this.onArrival(this.arrived);
    }
    const out = new Uint8Array(count);
    let at = 0;
    while (at < count) {
      const first = this.held[0];
      const part = first.subarray(0, count - at);
      out.set(part, at);
      at += part.length;
      if (part.length === first.length) this.held.shift();
      else this.held[0] = first.subarray(part.length);
    }
    this.length -= count;
    return out;
  }

  cancel(): void {
    this.source.cancel().catch(() => undefined);
  }
}

/** What zlib compressed. */
export async function inflate(bytes: Bytes): Promise<ArrayBuffer> {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return await new Response(stream).arrayBuffer();
}

/** A file's header, and its arrays one after the other. */
export class PageFile<Header> {
  private next = 0;

  private constructor(
    readonly header: Header,
    private readonly entries: ArrayEntry[],
    private readonly reader: ByteReader,
  ) {}

  /** Reads the header of a file of a kind (8 letters) and version; throws where it is another. */
  static async open<Header>(reader: ByteReader, magic: string, version: number): Promise<PageFile<Header>> {
    const start = await reader.take(16);
    const view = new DataView(start.buffer);
    if (String.fromCharCode(...start.subarray(0, 8)) !== magic)
      throw new Error(`not a file of the kind "${magic}"`);
    const found = view.getUint32(8, true);
    if (found !== version)
      throw new Error(`"${magic}" of version ${found}, this page reads ${version}; reload it`);
    const text = new TextDecoder().decode(await reader.take(view.getUint32(12, true)));
    const header = JSON.parse(text) as Header & { arrays: ArrayEntry[] };
    return new PageFile(header, header.arrays, reader);
  }

  /** Bytes of the arrays that have not been read. */
  get left(): number {
    return this.entries.slice(this.next).reduce((sum, entry) => sum + entry.bytes, 0);
  }

  /** The next array, which must have this name. */
  async read(name: string): Promise<Numbers> {
    const entry = this.entries.at(this.next);
    if (entry?.name !== name) throw new Error(`the file of the field has no array "${name}" here`);
    this.next++;
    const raw = await inflate(await this.reader.take(entry.bytes));
    switch (entry.type) {
      case "u1":
        return new Uint8Array(raw);
      case "u2":
        return new Uint16Array(raw);
      case "i4":
        return new Int32Array(raw);
      case "f4":
        return new Float32Array(raw);
    }
  }
}
