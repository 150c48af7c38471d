/** Edits of splats along a camera path (see `cagefield.pages.page_splat_path`). */
import type { Vec3 } from "../field/level";
import { ByteReader, PageFile } from "../field/page_file";
import { decodeAxes, covariancesFromAxes, decodeRotation } from "../splats/shapes";
import { encodeChangedRecords, unpackBits } from "../splats/splat_edits";
import type { SplatEdits } from "../splats/splat_edits";
import { joinHighLowBytes } from "../splats/splat_file";
import { intervalAt } from "./camera_path";

export const SPLAT_PATH_MAGIC = "cagesppa";

interface Header {
  count: number;
  /** For each state: the number of changed splats, and the numbers of its arrays in the file. */
  changed: number[];
  hidden: number[];
  sources: number[];
  rotations: number[];
  scales: number[];
  opacities: number[];
  gains: number[];
  /** For each state, the state that its `moves` are differences to; -1 for none. */
  after: number[];
  low: Vec3;
  step: number;
  stretch: number;
  log_scales: [number, number];
  whole: number;
}

type List = "hidden" | "sources" | "rotations" | "scales" | "opacities" | "gains";

/** A state of M splats as the file has it, with `moves` [12, M]. */
interface State {
  hidden: Uint8Array;
  sources: Int32Array;
  shapes: Shapes;
  opacities: Uint16Array;
  gains: Int32Array;
  moves: Uint16Array;
}

/** Shapes of splats before the edits: axes [M, 9], computed at the first use. */
class Shapes {
  private made: Float32Array | null = null;

  constructor(
    private readonly rotations: Uint16Array,
    private readonly scales: Uint16Array,
    private readonly logs: [number, number],
  ) {}

  get axes(): Float32Array {
    return (this.made ??= decodeAxes(this.rotations, this.scales, this.logs));
  }
}

interface SplatGeometry {
  means: Float32Array<ArrayBuffer>;
  covariances: Float32Array<ArrayBuffer>;
}

export class SplatPath {
  /** Geometry of the states used last, at most two. */
  private readonly geometry = new Map<State, SplatGeometry>();

  private constructor(
    private readonly header: Header,
    private readonly times: Float32Array,
    private readonly order: Uint16Array,
    private readonly states: State[],
  ) {}

  static async read(source: ArrayBuffer): Promise<SplatPath> {
    const file = await PageFile.open<Header>(new ByteReader(source), SPLAT_PATH_MAGIC, 2);
    const { header } = file;
    const times = (await file.read("times")) as Float32Array;
    const order = (await file.read("states")) as Uint16Array;
    const lists = new Map<string, Uint8Array | Int32Array>();
    const shapes = new Map<string, Shapes>();
    const list = (name: List, n: number): Uint8Array | Int32Array => lists.get(`${name}.${header[name][n]}`)!;
    const pairs = (name: List, n: number): Uint16Array => joinHighLowBytes(list(name, n) as Uint8Array);
    const states: State[] = [];
    for (const n of header.changed.keys()) {
      // The file has each array where a state first needs it.
      for (const name of ["hidden", "sources", "rotations", "scales", "opacities", "gains"] as const) {
        const key = `${name}.${header[name][n]}`;
        if (!lists.has(key)) lists.set(key, (await file.read(key)) as Uint8Array | Int32Array);
      }
      const key = `${header.rotations[n]} ${header.scales[n]}`;
      if (!shapes.has(key))
        shapes.set(key, new Shapes(pairs("rotations", n), pairs("scales", n), header.log_scales));
      const before = header.after[n] < 0 ? null : states[header.after[n]].moves;
      states.push({
        hidden: list("hidden", n) as Uint8Array,
        sources: list("sources", n) as Int32Array,
        shapes: shapes.get(key)!,
        opacities: pairs("opacities", n),
        gains: list("gains", n) as Int32Array,
        moves: undoDifferences(joinHighLowBytes((await file.read(`moves.${n}`)) as Uint8Array), before),
      });
    }
    return new SplatPath(header, times, order, states);
  }

  /** The edits at a time in seconds from the start of the path; null where the edits are complete. */
  at(seconds: number): SplatEdits | null {
    const { order, states, header } = this;
    const { first, share } = intervalAt(this.times, seconds);
    const [one, other] = [order[first], order[first + 1]];
    const near = share < 0.5 ? one : other;
    if ((one === other || share === 0 || share === 1) && near === header.whole) return null;
    const state = states[near];
    let { means, covariances } = this.geometryOf(state);
    if (one !== other) {
      const far = states[near === one ? other : one];
      const weight = near === one ? share : 1 - share;
      const matches = matchIndices(state.sources, far.sources);
      const farGeometry = this.geometryOf(far);
      means = interpolateRows(means, farGeometry.means, matches, 3, weight);
      covariances = interpolateRows(covariances, farGeometry.covariances, matches, 6, weight);
    }
    const count = state.sources.length;
    const records = encodeChangedRecords(
      state.sources,
      means,
      covariances,
      state.opacities,
      state.moves.subarray(3 * count, 6 * count),
      state.gains,
    );
    return {
      count: header.count,
      hidden: unpackBits(state.hidden, header.count),
      changed: count,
      means,
      records,
    };
  }

  private geometryOf(state: State): SplatGeometry {
    let found = this.geometry.get(state);
    if (!found) {
      found = decodeGeometry(state, this.header);
      for (const old of this.geometry.keys()) if (this.geometry.size > 1) this.geometry.delete(old);
      this.geometry.set(state, found);
    }
    return found;
  }
}

/**
 * Indices [N] of rising numbers in other rising numbers, equal values matched in order; -1 without a match.
 */
export function matchIndices(own: Int32Array, others: Int32Array): Int32Array {
  const out = new Int32Array(own.length).fill(-1);
  let m = 0;
  for (let n = 0; n < own.length; n++) {
    while (m < others.length && others[m] < own[n]) m++;
    if (m < others.length && others[m] === own[n]) out[n] = m++;
  }
  return out;
}

/**
 * Rows of `width` numbers, interpolated by a share towards their matches in `others`; rows without a match
 * stay.
 */
function interpolateRows(
  rows: Float32Array,
  others: Float32Array,
  matches: Int32Array,
  width: number,
  share: number,
): Float32Array<ArrayBuffer> {
  const out = Float32Array.from(rows);
  for (let n = 0; n < matches.length; n++) {
    if (matches[n] < 0) continue;
    for (let k = 0; k < width; k++)
      out[width * n + k] += share * (others[width * matches[n] + k] - out[width * n + k]);
  }
  return out;
}

/** 16-bit numbers from their zigzag-coded differences to others, in place; see `page_splat_path`. */
export function undoDifferences(folded: Uint16Array, before: Uint16Array | null): Uint16Array {
  for (let n = 0; n < folded.length; n++)
    folded[n] = (before === null ? 0 : before[n]) + ((folded[n] >>> 1) ^ -(folded[n] & 1));
  return folded;
}

function decodeGeometry({ moves, shapes }: State, { low, step, stretch }: Header): SplatGeometry {
  const count = moves.length / 12;
  const means = new Float32Array(3 * count);
  const { axes } = shapes;
  const moved = new Float32Array(9 * count);
  for (let n = 0; n < count; n++) {
    const row = (k: number): number => moves[k * count + n];
    for (let k = 0; k < 3; k++) means[3 * n + k] = low[k] + step * row(k);
    const turn = decodeRotation(row(3), row(4), row(5));
    const [xx, xy, xz, yy, yz, zz] = [6, 7, 8, 9, 10, 11].map((k) => stretch * (row(k) - 32768));
    const stretched = [1 + xx, xy, xz, xy, 1 + yy, yz, xz, yz, 1 + zz];
    multiply(moved, 9 * n, multiply([], 0, turn, 0, stretched, 0), 0, axes, 9 * n);
  }
  return { means, covariances: covariancesFromAxes(moved) };
}

type Numbers = number[] | Float32Array;

/** Writes the product of two matrices [3, 3] into `out`; each matrix begins at an offset. */
function multiply<Out extends Numbers>(
  out: Out,
  at: number,
  one: Numbers,
  first: number,
  other: Numbers,
  second: number,
): Out {
  for (let i = 0; i < 3; i++)
    for (let j = 0; j < 3; j++) {
      let sum = 0;
      for (let k = 0; k < 3; k++) sum += one[first + 3 * i + k] * other[second + 3 * k + j];
      out[at + 3 * i + j] = sum;
    }
  return out;
}
