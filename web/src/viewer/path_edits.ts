/** The edits along a camera path: states, and what lies between two of them (see `cagefield.formats.page_path`). */
import { ROW } from "../field/edits_glsl";
import { joined } from "../field/level";
import type { Vec3 } from "../field/level";
import { ByteReader, PageFile } from "../field/page_file";
import type { Bytes } from "../field/page_file";
import type { PageEdits } from "../field/page_edits";
import { mixedHalves } from "./halves";

interface PathHeader {
  edits: number[];
  boxes: number[];
  /** First node and number of nodes of each lattice that moves. */
  moving: [number, number][];
  /** Of each state, which lattices it has there; and how many there are. */
  nodes: number[][];
  lattices: number;
  preserve_opacity: boolean;
  origin: Vec3;
  dims: Vec3;
}

interface State {
  edits: number;
  boxes: number;
  rows: Float32Array;
  /** The lattices that move. */
  nodes: Uint16Array[];
}

/** Rows of an edit of which lower and upper ends of a box are kept: its own, and those of its two hexahedra. */
const LOWS = [0, 12, 30];

export class PathEdits {
  private constructor(
    private readonly header: PathHeader,
    private readonly times: Float32Array,
    private readonly order: Uint16Array,
    private readonly occupancy: PageEdits["occupancy"],
    private readonly lattice: Uint16Array,
    private readonly states: State[],
  ) {}

  static async read(source: ReadableStream<Bytes> | ArrayBuffer): Promise<PathEdits> {
    const file = await PageFile.open<PathHeader>(new ByteReader(source), "cagepath", 1);
    const { header } = file;
    const times = (await file.read("times")) as Float32Array;
    const order = (await file.read("states")) as Uint16Array;
    const codes = (await file.read("occupancy")) as Uint16Array;
    const lattice = joined((await file.read("lattice")) as Uint8Array);
    const rows: Float32Array[] = [];
    const lattices: Uint16Array[] = [];
    for (const n of header.edits.keys()) rows.push((await file.read(`rows.${n}`)) as Float32Array);
    for (let k = 0; k < header.lattices; k++) lattices.push(joined((await file.read(`nodes.${k}`)) as Uint8Array));
    const states = header.edits.map((edits, n) => {
      return { edits, boxes: header.boxes[n], rows: rows[n], nodes: header.nodes[n].map((k) => lattices[k]) };
    });
    return new PathEdits(header, times, order, { origin: header.origin, dims: header.dims, codes }, lattice, states);
  }

  /** The edits at seconds from the path's begin. */
  at(seconds: number): PageEdits {
    const { times, order, states } = this;
    const last = times.length - 1;
    let k = 0;
    while (k < last - 1 && times[k + 1] <= seconds) k++;
    const share = Math.max(0, Math.min(1, (seconds - times[k]) / Math.max(1e-9, times[k + 1] - times[k])));
    const one = states[order[k]];
    const other = states[order[k + 1]];
    const near = share < 0.5 ? one : other;
    if (one === other || !alike(one, other)) return this.edits(near, near.rows, near.nodes);
    const nodes = one.nodes.map((lattice, n) =>
      lattice === other.nodes[n] ? lattice : mixedHalves(lattice, other.nodes[n], share),
    );
    return this.edits(one, mixedRows(one, other, share), nodes);
  }

  private edits({ edits, boxes }: State, rows: Float32Array, nodes: Uint16Array[]): PageEdits {
    const lattice = this.lattice.slice();
    nodes.forEach((part, n) => lattice.set(part, 3 * this.header.moving[n][0]));
    return { edits, boxes, preserveOpacity: this.header.preserve_opacity, rows, lattice, occupancy: this.occupancy };
  }
}

/** Whether two states have the same kinds of edits: the fourth numbers of their rows say of which kind they are. */
function alike(one: State, other: State): boolean {
  if (one.edits !== other.edits || one.boxes !== other.boxes) return false;
  for (let n = 3; n < one.rows.length; n += 4) if (one.rows[n] !== other.rows[n]) return false;
  return true;
}

function mixedRows({ edits, boxes, rows }: State, { rows: others }: State, share: number): Float32Array {
  const out = rows.map((value, n) => value + share * (others[n] - value));
  const hold = (low: number): void => {
    for (let n = 4 * low; n < 4 * low + 3; n++) out[n] = Math.min(rows[n], others[n]);
    for (let n = 4 * low + 4; n < 4 * low + 7; n++) out[n] = Math.max(rows[n], others[n]);
  };
  for (let e = 0; e < edits; e++) for (const low of LOWS) hold(e * ROW + low);
  for (let b = 0; b < boxes; b++) hold(edits * ROW + 2 * b);
  return out;
}
