/** A level of a field on the GPU. */
import { bytesOf, Filler, layoutOf, TooLarge } from "./atlas";
import type { Layout, Texels } from "./atlas";
import { checkMemory, largest, plainUnpacking, texture3D } from "./gl";
import type { Level, Occupancy, Vec3 } from "./level";
import { Stored } from "./quantized_vertices";

type GL = WebGL2RenderingContext;

export interface FieldTextures {
  layout: Layout;
  density: WebGLTexture;
  colours: WebGLTexture[];
  /** Of the field and, behind it along x, the layers of its edits, so many slices of bricks. */
  index: WebGLTexture;
  slices: number;
  bytes: number;
}

/**
 * The share of the bricks, and the least number, for which textures have room beside those that are needed. The cone that is
 * moved beside the built-in digger takes .18 of the field's bricks; textures that are too small are made anew, in 0.7 s.
 */
const SPARE = 1 / 4;
const LEAST_SPARE = 64;

/**
 * The layout of a level with room for the bricks of its layers, and for more where the memory has it. Throws `TooLarge`
 * where it takes more than `limit` bytes.
 */
export function layoutWithin(
  gl: GL,
  level: Level,
  limit: number,
  placesFor: (layout: Layout) => number,
): Layout {
  const side = largest(gl, gl.MAX_3D_TEXTURE_SIZE);
  const needed = placesFor(layoutOf(level, side));
  const least = layoutOf(level, side, needed);
  const bytes = bytesOf(least);
  if (bytes > limit)
    throw new TooLarge(
      `the field takes ${Math.ceil(bytes / 2 ** 20)} MiB of the GPU, more than the ${Math.floor(limit / 2 ** 20)} allowed`,
    );
  if (!level.last) return least;
  try {
    const roomy = layoutOf(
      level,
      side,
      needed + Math.max(LEAST_SPARE, Math.ceil(SPARE * (least.count + needed))),
    );
    return bytesOf(roomy) > limit ? least : roomy;
  } catch (error) {
    if (error instanceof TooLarge) return least;
    throw error;
  }
}

/** Uploads a level, some bricks at a time, and lets the page breathe in between; null once it is not wanted any more. */
export async function uploadLevel(
  gl: GL,
  level: Level,
  layout: Layout,
  wanted: () => boolean,
): Promise<FieldTextures | null> {
  const steps = uploading(gl, level, layout);
  try {
    for (
      let step = steps.next();
      ;
      step = wanted() ? steps.next() : steps.throw(new Error("not wanted any more"))
    ) {
      if (step.done) return step.value;
      await new Promise((done) => setTimeout(done));
    }
  } catch (error) {
    if (!wanted()) return null;
    throw error;
  }
}

/** The same at once. */
export function uploadLevelNow(gl: GL, level: Level, layout: Layout): FieldTextures {
  const steps = uploading(gl, level, layout);
  for (;;) {
    const step = steps.next();
    if (step.done) return step.value;
  }
}

function* uploading(gl: GL, level: Level, layout: Layout): Generator<void, FieldTextures> {
  const { across, edge, dims } = layout;
  const size = across.map((n) => n * edge);
  const made: WebGLTexture[] = [];
  let whole = false;
  try {
    const density = texture3D(gl, gl.R16F, size, gl.LINEAR);
    made.push(density);
    const colours = Array.from({ length: layout.colours }, () => {
      const texture = texture3D(gl, gl.RGBA8, size, gl.LINEAR);
      made.push(texture);
      return texture;
    });
    const filler = new Filler(layout, [Stored.ofLevel(level)]);
    const plane = across[0] * across[1];
    for (let z = 0; z < across[2]; z++) {
      plainUnpacking(gl);
      const numbers = layout.bricks.subarray(z * plane, (z + 1) * plane);
      putTexels(
        gl,
        { layout, density, colours },
        filler.texels(numbers, across[0], across[1]),
        [0, 0, z],
        [across[0], across[1]],
      );
      yield;
    }
    plainUnpacking(gl);
    const index = texture3D(gl, gl.RGBA8UI, [dims[2], dims[1], dims[0]], gl.NEAREST);
    made.push(index);
    gl.texSubImage3D(
      gl.TEXTURE_3D,
      0,
      0,
      0,
      0,
      dims[2],
      dims[1],
      dims[0],
      gl.RGBA_INTEGER,
      gl.UNSIGNED_BYTE,
      layout.index,
    );
    gl.bindTexture(gl.TEXTURE_3D, null);
    checkMemory(gl);
    whole = true;
    return { layout, density, colours, index, slices: dims[0], bytes: bytesOf(layout) };
  } finally {
    if (!whole) for (const texture of made) gl.deleteTexture(texture);
  }
}

/** Uploads the texels of `size` bricks to where the brick `at` of the textures is. */
export function putTexels(
  gl: GL,
  { layout: { edge }, density, colours }: Pick<FieldTextures, "layout" | "density" | "colours">,
  texels: Texels,
  at: Vec3,
  size: readonly [number, number],
): void {
  const put = (texture: WebGLTexture, format: number, type: number, data: ArrayBufferView): void => {
    gl.bindTexture(gl.TEXTURE_3D, texture);
    const [x, y, z] = at.map((n) => n * edge);
    gl.texSubImage3D(gl.TEXTURE_3D, 0, x, y, z, size[0] * edge, size[1] * edge, edge, format, type, data);
  };
  put(density, gl.RED, gl.HALF_FLOAT, texels.density);
  texels.colours.forEach((data, n) => put(colours[n], gl.RGBA, gl.UNSIGNED_BYTE, data));
  gl.bindTexture(gl.TEXTURE_3D, null);
}

/** The codes of an occupancy on the GPU. */
export function uploadOccupancy(gl: GL, { dims, codes }: Occupancy): WebGLTexture {
  plainUnpacking(gl);
  const texture = texture3D(gl, gl.R16UI, [dims[2], dims[1], dims[0]], gl.NEAREST);
  gl.texSubImage3D(
    gl.TEXTURE_3D,
    0,
    0,
    0,
    0,
    dims[2],
    dims[1],
    dims[0],
    gl.RED_INTEGER,
    gl.UNSIGNED_SHORT,
    codes,
  );
  gl.bindTexture(gl.TEXTURE_3D, null);
  return texture;
}

export function deleteField(gl: GL, textures: FieldTextures): void {
  for (const texture of [textures.density, textures.index, ...textures.colours]) gl.deleteTexture(texture);
}
