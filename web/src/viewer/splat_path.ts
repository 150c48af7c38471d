/** The edits of splats along a camera path (see `cagefield.formats.page_splat_path`). */
import type { Vec3 } from "../field/level";
import { ByteReader, PageFile } from "../field/page_file";
import { changedRecords, unpackedBits } from "../splats/splat_edits";
import type { SplatEdits } from "../splats/splat_edits";
import { wholes } from "../splats/splat_file";
import { placeAt } from "./path";

export const SPLAT_PATH = "cagesppa";

interface Header {
  count: number;
  /** Of each state: how many splats it changes, and which of the lists it has. */
  changed: number[];
  hidden: number[];
  sources: number[];
  low: Vec3;
  high: Vec3;
  log_scales: [number, number];
  whole: number;
}

/** A state as it came. */
interface State {
  hidden: Uint8Array;
  sources: Int32Array;
  means: Uint16Array;
  rotations: Uint16Array;
  scales: Uint16Array;
  opacities: Uint16Array;
  turns: Uint16Array;
}

interface Unpacked {
  means: Float32Array<ArrayBuffer>;
  covariances: Float32Array<ArrayBuffer>;
}

export class SplatPath {
  /** The states that were shown last, two at most. */
  private readonly unpacked = new Map<State, Unpacked>();

  private constructor(
    private readonly header: Header,
    private readonly times: Float32Array,
    private readonly order: Uint16Array,
    private readonly states: State[],
  ) {}

  static async read(source: ArrayBuffer): Promise<SplatPath> {
    const file = await PageFile.open<Header>(new ByteReader(source), SPLAT_PATH, 1);
    const { header } = file;
    const bytes = async (name: string): Promise<Uint8Array> => (await file.read(name)) as Uint8Array;
    const pairs = async (name: string): Promise<Uint16Array> => wholes(await bytes(name));
    const times = (await file.read("times")) as Float32Array;
    const order = (await file.read("states")) as Uint16Array;
    const hidden: Uint8Array[] = [];
    for (let k = 0; k <= Math.max(...header.hidden); k++) hidden.push(await bytes(`hidden.${k}`));
    const sources: Int32Array[] = [];
    for (let k = 0; k <= Math.max(...header.sources); k++) sources.push((await file.read(`sources.${k}`)) as Int32Array);
    const states: State[] = [];
    for (const n of header.changed.keys())
      states.push({
        hidden: hidden[header.hidden[n]],
        sources: sources[header.sources[n]],
        means: await pairs(`means.${n}`),
        rotations: await pairs(`rotations.${n}`),
        scales: await pairs(`scales.${n}`),
        opacities: await pairs(`opacities.${n}`),
        turns: await pairs(`turns.${n}`),
      });
    return new SplatPath(header, times, order, states);
  }

  /** The edits at seconds from the path's begin; null where they have gone all the way. */
  at(seconds: number): SplatEdits | null {
    const { order, states, header } = this;
    const { first, share } = placeAt(this.times, seconds);
    const [one, other] = [order[first], order[first + 1]];
    const near = share < 0.5 ? one : other;
    if ((one === other || share === 0 || share === 1) && near === header.whole) return null;
    const state = states[near];
    let { means, covariances } = this.numbers(state);
    if (one !== other) {
      const far = states[near === one ? other : one];
      const away = near === one ? share : 1 - share;
      const partners = partnersOf(state.sources, far.sources);
      const others = this.numbers(far);
      means = mixed(means, others.means, partners, 3, away);
      covariances = mixed(covariances, others.covariances, partners, 6, away);
    }
    const records = changedRecords(state.sources, means, covariances, state.opacities, state.turns, null);
    return { count: header.count, hidden: unpackedBits(state.hidden, header.count), changed: state.sources.length, means, records };
  }

  private numbers(state: State): Unpacked {
    let found = this.unpacked.get(state);
    if (!found) {
      found = unpack(state, this.header);
      for (const old of this.unpacked.keys()) if (this.unpacked.size > 1) this.unpacked.delete(old);
      this.unpacked.set(state, found);
    }
    return found;
  }
}

/** Of rising numbers, where the k-th of each value is among others; -1 where it is not. */
export function partnersOf(own: Int32Array, others: Int32Array): Int32Array {
  const out = new Int32Array(own.length).fill(-1);
  let m = 0;
  for (let n = 0; n < own.length; n++) {
    while (m < others.length && others[m] < own[n]) m++;
    if (m < others.length && others[m] === own[n]) out[n] = m++;
  }
  return out;
}

/** Rows of so many numbers, a share of the way to those of their partners. */
function mixed(rows: Float32Array, others: Float32Array, partners: Int32Array, width: number, share: number): Float32Array<ArrayBuffer> {
  const out = Float32Array.from(rows);
  for (let n = 0; n < partners.length; n++) {
    if (partners[n] < 0) continue;
    for (let k = 0; k < width; k++) out[width * n + k] += share * (others[width * partners[n] + k] - out[width * n + k]);
  }
  return out;
}

function unpack({ means, rotations, scales }: State, { low, high, log_scales: logs }: Header): Unpacked {
  const count = means.length / 3;
  const out = { means: new Float32Array(3 * count), covariances: new Float32Array(6 * count) };
  for (let n = 0; n < count; n++) {
    for (let k = 0; k < 3; k++) out.means[3 * n + k] = low[k] + ((high[k] - low[k]) * means[k * count + n]) / 65535;
    const axes = rotationOf(rotations[n], rotations[count + n], rotations[2 * count + n]);
    const variances = [0, 1, 2].map((k) => Math.exp(2 * (logs[0] + ((logs[1] - logs[0]) * scales[k * count + n]) / 65535)));
    let at = 6 * n;
    for (let i = 0; i < 3; i++)
      for (let j = i; j < 3; j++) {
        let sum = 0;
        for (let k = 0; k < 3; k++) sum += axes[3 * i + k] * variances[k] * axes[3 * j + k];
        out.covariances[at++] = sum;
      }
  }
  return out;
}

/** The matrix, row by row, of three numbers as `page_splats.encode_rotations` writes them. */
export function rotationOf(a: number, b: number, c: number): number[] {
  const left = (a >> 15) | ((b >> 15) << 1);
  const three = [a, b, c].map((code) => ((code & 32767) - 16384) / (16383 * Math.SQRT2));
  const most = Math.sqrt(Math.max(0, 1 - three[0] ** 2 - three[1] ** 2 - three[2] ** 2));
  const [w, x, y, z] = [...three.slice(0, left), most, ...three.slice(left)];
  return [
    1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
    2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
    2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y),
  ]; // prettier-ignore
}
