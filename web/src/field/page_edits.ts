/** An edit stack as it comes over the wire (see `cagefield.formats.page_edits`). */
import { joined } from "./level";
import type { Occupancy, Vec3 } from "./level";
import { ByteReader, PageFile } from "./page_file";

interface EditsHeader {
  edits: number;
  boxes: number;
  preserve_opacity: boolean;
  origin: Vec3;
  dims: Vec3;
}

export interface PageEdits {
  edits: number;
  boxes: number;
  preserveOpacity: boolean;
  /** [edits * ROW + boxes * 2, 4]. */
  rows: Float32Array;
  /** [nodes, 3] halves: displacements of all lattices. */
  lattice: Uint16Array;
  /** Of the deformed field. */
  occupancy: Occupancy;
}

export async function readEdits(source: ArrayBuffer): Promise<PageEdits> {
  const reader = new ByteReader(source);
  const { header, ...file } = await opened(reader);
  const rows = (await file.read("rows")) as Float32Array;
  const lattice = joined((await file.read("lattice")) as Uint8Array);
  const codes = (await file.read("occupancy")) as Uint16Array;
  return {
    edits: header.edits,
    boxes: header.boxes,
    preserveOpacity: header.preserve_opacity,
    rows,
    lattice,
    occupancy: { origin: header.origin, dims: header.dims, codes },
  };
}

async function opened(reader: ByteReader): Promise<{ header: EditsHeader; read: (name: string) => Promise<unknown> }> {
  const file = await PageFile.open<EditsHeader>(reader, "cageedit", 1);
  return { header: file.header, read: (name) => file.read(name) };
}
