/** An edit stack on the GPU, with uploads of the changed parts alone. */
import { EDIT_LAYOUT } from "./layout";
import { checkMemory, deviceLimit, resetUnpacking, setFilter, texture3D } from "./gl";
import type { PageEdits } from "./page_edits";

const { MAX_ROWS, NODES_PER_TEXTURE_ROW } = EDIT_LAYOUT;

type GL = WebGL2RenderingContext;

/** Position of a lattice in the texture, in rows of NODES_PER_TEXTURE_ROW nodes. */
interface PlacedLattice {
  key: string;
  row: number;
}

export class EditTextures {
  /** Bytes uploaded by the last `set`, and by all. */
  readonly uploaded = { last: 0, total: 0 };
  private current: PageEdits | null = null;
  private buffer: WebGLBuffer | null = null;
  private lattices: { texture: WebGLTexture; rows: number; placed: PlacedLattice[] } | null = null;
  private occupancy: { texture: WebGLTexture; key: string; dims: readonly number[] } | null = null;

  constructor(private readonly gl: GL) {}

  /** The edits on the GPU; null for none. */
  get edits(): PageEdits | null {
    return this.current;
  }

  /** The occupancy codes, by which rays skip empty space. */
  get bricks(): WebGLTexture | null {
    return this.occupancy?.texture ?? null;
  }

  /** Adds bytes that were uploaded for the edits by others. */
  countUpload(bytes: number): void {
    this.uploaded.last += bytes;
    this.uploaded.total += bytes;
  }

  /** Replaces the edits; throws for more edits than the shader or the memory of the GPU holds. */
  set(edits: PageEdits | null): void {
    this.uploaded.last = 0;
    if (edits === null || edits.edits === 0) {
      this.dispose();
      return;
    }
    if (edits.rows.length > 4 * MAX_ROWS) throw new Error("more edits than the page's shader holds");
    this.putRows(edits);
    this.putLattices(edits);
    this.putOccupancy(edits);
    this.current = edits;
    this.uploaded.total += this.uploaded.last;
  }

  /** Binds the rows to the program's uniform block; returns the texture of the lattices. */
  bind(program: WebGLProgram): WebGLTexture | null {
    const { gl } = this;
    gl.uniformBlockBinding(program, gl.getUniformBlockIndex(program, "Edits"), 0);
    gl.bindBufferBase(gl.UNIFORM_BUFFER, 0, this.buffer);
    return this.lattices?.texture ?? null;
  }

  /** Drops the objects of a lost context. */
  forget(): void {
    this.current = this.buffer = this.lattices = this.occupancy = null;
  }

  dispose(): void {
    const { gl } = this;
    gl.deleteBuffer(this.buffer);
    gl.deleteTexture(this.lattices?.texture ?? null);
    gl.deleteTexture(this.occupancy?.texture ?? null);
    this.forget();
  }

  private putRows({ rows }: PageEdits): void {
    const { gl } = this;
    const isNew = this.buffer === null;
    this.buffer ??= gl.createBuffer();
    gl.bindBuffer(gl.UNIFORM_BUFFER, this.buffer);
    if (isNew) gl.bufferData(gl.UNIFORM_BUFFER, 16 * MAX_ROWS, gl.DYNAMIC_DRAW);
    gl.bufferSubData(gl.UNIFORM_BUFFER, 0, rows);
    gl.bindBuffer(gl.UNIFORM_BUFFER, null);
    this.uploaded.last += rows.byteLength;
  }

  private putLattices({ lattices }: PageEdits): void {
    const { gl } = this;
    const heights = lattices.map(({ halves }) => Math.ceil(halves.length / (3 * NODES_PER_TEXTURE_ROW)));
    const rows = Math.max(
      1,
      heights.reduce((sum, height) => sum + height, 0),
    );
    if (rows > deviceLimit(gl, gl.MAX_TEXTURE_SIZE))
      throw new Error("the edits' lattices do not fit into a texture of the GPU");
    if (this.lattices === null || rows > this.lattices.rows) {
      gl.deleteTexture(this.lattices?.texture ?? null);
      this.lattices = { texture: this.latticeTexture(rows), rows, placed: [] };
    }
    const { texture, placed } = this.lattices;
    resetUnpacking(gl);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    let row = 0;
    this.lattices.placed = lattices.map(({ key, halves }, n) => {
      const at: PlacedLattice = { key, row };
      if (placed.every((before) => before.key !== key || before.row !== at.row)) {
        const whole = 3 * NODES_PER_TEXTURE_ROW * heights[n];
        const data = halves.length === whole ? halves : new Uint16Array(whole);
        if (data !== halves) data.set(halves);
        gl.texSubImage2D(
          gl.TEXTURE_2D,
          0,
          0,
          row,
          NODES_PER_TEXTURE_ROW,
          heights[n],
          gl.RGB,
          gl.HALF_FLOAT,
          data,
        );
        this.uploaded.last += data.byteLength;
      }
      row += heights[n];
      return at;
    });
    gl.bindTexture(gl.TEXTURE_2D, null);
    checkMemory(gl);
  }

  private latticeTexture(rows: number): WebGLTexture {
    const { gl } = this;
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGB16F, NODES_PER_TEXTURE_ROW, rows);
    setFilter(gl, gl.TEXTURE_2D, gl.NEAREST);
    return texture;
  }

  private putOccupancy({ occupancy: { key, dims, codes, changed } }: PageEdits): void {
    const { gl, occupancy: before } = this;
    if (before?.key === key) return;
    resetUnpacking(gl);
    const fits = before !== null && before.dims.every((n, axis) => n === dims[axis]);
    if (!fits) gl.deleteTexture(before?.texture ?? null);
    const texture = fits ? before.texture : texture3D(gl, gl.R16UI, [dims[2], dims[1], dims[0]], gl.NEAREST);
    const part = fits && changed?.of === before.key ? changed : { low: [0, 0, 0], dims, codes };
    gl.bindTexture(gl.TEXTURE_3D, texture);
    const [x, y, z] = part.low;
    gl.texSubImage3D(
      gl.TEXTURE_3D,
      0,
      z,
      y,
      x,
      part.dims[2],
      part.dims[1],
      part.dims[0],
      gl.RED_INTEGER,
      gl.UNSIGNED_SHORT,
      part.codes,
    );
    gl.bindTexture(gl.TEXTURE_3D, null);
    this.occupancy = { texture, key, dims };
    this.uploaded.last += part.codes.byteLength;
  }
}
