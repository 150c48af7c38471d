/**
 * Edits along a camera path: states at times, and interpolation between two of them (see
 * `cagefield.pages.page_path`).
 */
import { EDIT_LAYOUT } from "../field/layout";
import { joinBytePlanes } from "../field/level";
import type { Vec3 } from "../field/level";
import { ByteReader, PageFile } from "../field/page_file";
import type { Lattice, PageEdits } from "../field/page_edits";
import { readLayer } from "../field/page_layers";
import type { Layer, PlacedLayer } from "../field/page_layers";
import { mixFloat16 } from "./float16";
import { intervalAt } from "./camera_path";

interface PathHeader {
  edits: number[];
  boxes: number[];
  /** For each state, the numbers of its lattices. */
  lattices: number[][];
  /** Number of lattices in the file. */
  stored: number;
  /** For each state, [layer, place, first, end] of its layers (see `PlacedLayer`). */
  layers: [number, number, number, number][][];
  layer_keys: string[];
  preserve_opacity: boolean;
  origin: Vec3;
  dims: Vec3;
}

interface State {
  edits: number;
  boxes: number;
  rows: Float32Array;
  lattices: Lattice[];
  layers: PlacedLayer[];
}

const { BOX_ROWS, BOX_VECTOR, EDIT_ROWS, GRADE_SCALARS, HEXAHEDRON, HEXAHEDRON_ROWS, Y_BOX_VECTOR } =
  EDIT_LAYOUT;

/**
 * First rows of the boxes of an edit, whose union is taken between two states: its own, and those of its
 * hexahedra.
 */
const EDIT_BOX_ROWS = [BOX_VECTOR, HEXAHEDRON + Y_BOX_VECTOR, HEXAHEDRON + HEXAHEDRON_ROWS + Y_BOX_VECTOR];

export class PathEdits {
  private constructor(
    private readonly header: PathHeader,
    private readonly times: Float32Array,
    private readonly order: Uint16Array,
    private readonly occupancy: PageEdits["occupancy"],
    private readonly states: State[],
  ) {}

  static async read(source: ArrayBuffer): Promise<PathEdits> {
    const file = await PageFile.open<PathHeader>(new ByteReader(source), "cagepath", 2);
    const { header } = file;
    const times = (await file.read("times")) as Float32Array;
    const order = (await file.read("states")) as Uint16Array;
    const codes = (await file.read("occupancy")) as Uint16Array;
    const rows: Float32Array[] = [];
    const stored: Lattice[] = [];
    for (const n of header.edits.keys()) rows.push((await file.read(`rows.${n}`)) as Float32Array);
    for (let k = 0; k < header.stored; k++)
      stored.push({ key: `${k}`, halves: joinBytePlanes((await file.read(`lattice.${k}`)) as Uint8Array) });
    const layers: Layer[] = [];
    for (const [k, key] of header.layer_keys.entries()) layers.push(await readLayer(file, `layer.${k}`, key));
    const states = header.edits.map((edits, n) => {
      const placed = header.layers[n].map(([k, place, first, end]) => ({
        layer: layers[k],
        place,
        first,
        end,
      }));
      return {
        edits,
        boxes: header.boxes[n],
        rows: rows[n],
        lattices: header.lattices[n].map((k) => stored[k]),
        layers: placed,
      };
    });
    const occupancy = { key: "path", origin: header.origin, dims: header.dims, codes, changed: null };
    return new PathEdits(header, times, order, occupancy, states);
  }

  /** The edits at a time in seconds from the start of the path. */
  at(seconds: number): PageEdits {
    const { order, states } = this;
    const { first, share } = intervalAt(this.times, seconds);
    const one = states[order[first]];
    const other = states[order[first + 1]];
    const near = share < 0.5 ? one : other;
    if (one === other || !haveSameKinds(one, other)) return this.edits(near, near.rows, near.lattices);
    const lattices = one.lattices.map((lattice, n) => {
      if (lattice === other.lattices[n]) return lattice;
      const key = `${lattice.key} ${other.lattices[n].key} ${share}`;
      return { key, halves: mixFloat16(lattice.halves, other.lattices[n].halves, share) };
    });
    return this.edits(one, interpolateRows(one, other, share), lattices);
  }

  private edits({ edits, boxes, layers }: State, rows: Float32Array, lattices: Lattice[]): PageEdits {
    return {
      edits,
      boxes,
      preserveOpacity: this.header.preserve_opacity,
      rows,
      lattices,
      layers,
      occupancy: this.occupancy,
    };
  }
}

/**
 * Whether two states have the same kinds of edits: the fourth numbers of the rows state the kinds, but for those of
 * grades, which are interpolated.
 */
function haveSameKinds(one: State, other: State): boolean {
  if (one.edits !== other.edits || one.boxes !== other.boxes) return false;
  for (let n = 0; 4 * n < one.rows.length; n++) {
    const differs = one.rows[4 * n + 3] !== other.rows[4 * n + 3];
    if (differs && !(n < one.edits * EDIT_ROWS && isGradeRow(n % EDIT_ROWS))) return false;
  }
  return true;
}

/** Whether the fourth number of a row of an edit is one of its grade. */
function isGradeRow(row: number): boolean {
  return row >= GRADE_SCALARS && row !== HEXAHEDRON + HEXAHEDRON_ROWS;
}

/** Rows between those of two states; boxes contain the boxes of both. */
function interpolateRows(
  { edits, boxes, rows }: State,
  { rows: others }: State,
  share: number,
): Float32Array {
  const out = rows.map((value, n) => value + share * (others[n] - value));
  const unite = (low: number): void => {
    for (let n = 4 * low; n < 4 * low + 3; n++) out[n] = Math.min(rows[n], others[n]);
    for (let n = 4 * low + 4; n < 4 * low + 7; n++) out[n] = Math.max(rows[n], others[n]);
  };
  for (let e = 0; e < edits; e++) for (const low of EDIT_BOX_ROWS) unite(e * EDIT_ROWS + low);
  for (let b = 0; b < boxes; b++) unite(edits * EDIT_ROWS + BOX_ROWS * b);
  return out;
}
