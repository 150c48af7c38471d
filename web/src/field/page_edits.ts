/** Files of edits of voxels (see `cagefield.pages.page_edits`). */
import { joinBytePlanes } from "./level";
import type { Occupancy, Vec3 } from "./level";
import { ByteReader, PageFile } from "./page_file";
import { readLayer } from "./page_layers";
import type { PlacedLayer } from "./page_layers";

interface EditsHeader {
  edits: number;
  boxes: number;
  preserve_opacity: boolean;
  lattices: { key: string; nodes: number }[];
  layers: { key: string; place: number; first: number; end: number }[];
  occupancy: { key: string; origin: Vec3; dims: Vec3; part: { of: string; low: Vec3; dims: Vec3 } | null };
}

export interface Lattice {
  /** Digest of the content. */
  key: string;
  /** [nodes, 3] float16 bits: displacements, world units. */
  halves: Uint16Array;
}

/** Occupancy of the deformed field. */
export interface DeformedOccupancy extends Occupancy {
  key: string;
  /** The part that differs from the occupancy with the key `of`; null if unknown. */
  changed: { of: string; low: Vec3; dims: Vec3; codes: Uint16Array } | null;
}

export interface PageEdits {
  edits: number;
  boxes: number;
  preserveOpacity: boolean;
  /** [EDIT_ROWS edits + BOX_ROWS boxes, 4], in the layout of `cagefield.pages.row_layout`. */
  rows: Float32Array;
  lattices: Lattice[];
  layers: PlacedLayer[];
  occupancy: DeformedOccupancy;
}

/** The edits of a file; `before` supplies the omitted parts. Throws for a part that neither has. */
export async function readEdits(source: ArrayBuffer, before: PageEdits | null = null): Promise<PageEdits> {
  const file = await PageFile.open<EditsHeader>(new ByteReader(source), "cageedit", 3);
  const { header } = file;
  const rows = (await file.read("rows")) as Float32Array;
  const lattices: Lattice[] = [];
  for (const [n, { key }] of header.lattices.entries()) {
    const known = [...lattices, ...(before?.lattices ?? [])].find((lattice) => lattice.key === key);
    lattices.push(known ?? { key, halves: joinBytePlanes((await file.read(`lattice.${n}`)) as Uint8Array) });
  }
  const layers: PlacedLayer[] = [];
  for (const [n, { key, ...where }] of header.layers.entries()) {
    const known = [...layers, ...(before?.layers ?? [])].find(({ layer }) => layer.key === key);
    layers.push({ layer: known?.layer ?? (await readLayer(file, `layer.${n}`, key)), ...where });
  }
  const { key, origin, dims, part } = header.occupancy;
  const old = before?.occupancy ?? null;
  let occupancy: DeformedOccupancy;
  if (old?.key === key) occupancy = old;
  else {
    const codes = (await file.read("occupancy")) as Uint16Array;
    if (part === null) occupancy = { key, origin, dims, codes, changed: null };
    else if (old?.key === part.of)
      occupancy = {
        key,
        origin,
        dims,
        codes: replacePart(old, part.low, part.dims, codes),
        changed: { ...part, codes },
      };
    else throw new Error("the edits are a difference to edits that this page does not have; reload it");
  }
  return {
    edits: header.edits,
    boxes: header.boxes,
    preserveOpacity: header.preserve_opacity,
    rows,
    lattices,
    layers,
    occupancy,
  };
}

/** The codes of an occupancy after the replacement of the part of `size` at `low`. */
export function replacePart(
  { dims, codes }: Occupancy,
  low: Vec3,
  size: Vec3,
  part: Uint16Array,
): Uint16Array {
  const out = codes.slice();
  let n = 0;
  for (let x = low[0]; x < low[0] + size[0]; x++)
    for (let y = low[1]; y < low[1] + size[1]; y++, n += size[2])
      out.set(part.subarray(n, n + size[2]), (x * dims[1] + y) * dims[2] + low[2]);
  return out;
}
