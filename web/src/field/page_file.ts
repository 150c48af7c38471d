/** Container of files for pages (`cagefield.pages.page_file`): a JSON header, and deflated arrays in order. */

export type Bytes = Uint8Array<ArrayBuffer>;
export type Numbers = Uint8Array | Uint16Array | Int32Array | Float32Array;

interface ArrayEntry {
  name: string;
  type: "u1" | "u2" | "i4" | "f4";
  shape: number[];
  bytes: number;
}

/** Callback with the number of bytes that have arrived. */
export type OnArrival = (bytes: number) => void;

/** Reader of byte counts from a stream, independent of the stream's chunks. */
export class ByteReader {
  private chunks: Bytes[] = [];
  private buffered = 0;
  private arrived = 0;
  private readonly source: ReadableStreamDefaultReader<Bytes>;

  constructor(
    source: ReadableStream<Bytes> | ArrayBuffer,
    private readonly onArrival: OnArrival = () => undefined,
  ) {
    this.source = (source instanceof ArrayBuffer ? new Blob([source]).stream() : source).getReader();
  }

  /** The next `count` bytes; throws if the stream ends earlier. */
  async take(count: number): Promise<Bytes> {
    while (this.buffered < count) {
      const { value, done } = await this.source.read();
      if (done) throw new Error("the file of the field is truncated");
      this.chunks.push(value);
      this.buffered += value.length;
      this.arrived += value.length;
      this.onArrival(this.arrived);
    }
    const out = new Uint8Array(count);
    let at = 0;
    while (at < count) {
      const first = this.chunks[0];
      const part = first.subarray(0, count - at);
      out.set(part, at);
      at += part.length;
      if (part.length === first.length) this.chunks.shift();
      else this.chunks[0] = first.subarray(part.length);
    }
    this.buffered -= count;
    return out;
  }

  cancel(): void {
    this.source.cancel().catch(() => undefined);
  }
}

/** Decompressed bytes of zlib data. */
export async function inflate(bytes: Bytes): Promise<ArrayBuffer> {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return await new Response(stream).arrayBuffer();
}

/** The header of a file, and its arrays in order. */
export class PageFile<Header> {
  private next = 0;

  private constructor(
    readonly header: Header,
    private readonly entries: ArrayEntry[],
    private readonly reader: ByteReader,
  ) {}

  /** Reads the header of a file; throws for another magic (8 letters) or version. */
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

  /** Bytes of the unread arrays. */
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
