/** Textures of a level of a field. */
import { layoutBytes, TexelWriter, createLayout, TooLarge } from "./atlas";
import type { AtlasLayout, Texels } from "./atlas";
import { checkMemory, deviceLimit, resetUnpacking, texture3D } from "./gl";
import type { Level, Occupancy, Vec3 } from "./level";
import { VertexIndex } from "./quantized_vertices";

type GL = WebGL2RenderingContext;

export interface FieldTextures {
  layout: AtlasLayout;
  density: WebGLTexture;
  colors: WebGLTexture[];
  /** Index of the field's bricks and, behind them along x, of the layers' bricks: `slices` slices in all. */
  index: WebGLTexture;
  slices: number;
  bytes: number;
}

/**
 * Spare room of the textures: a share of the bricks, and a minimum number. The cone moved beside the built-in digger takes
 * .18 of the field's bricks; a reallocation of too small textures takes 0.7 s.
 */
const SPARE_SHARE = 1 / 4;
const MIN_SPARE_BRICKS = 64;

/**
 * The layout of a level with room for the bricks of its layers, and with spare room if the memory allows it. Throws
 * `TooLarge` beyond `limit` bytes.
 */
export function fitLayout(
  gl: GL,
  level: Level,
  limit: number,
  placesFor: (layout: AtlasLayout) => number,
): AtlasLayout {
  const side = deviceLimit(gl, gl.MAX_3D_TEXTURE_SIZE);
  const needed = placesFor(createLayout(level, side));
  const least = createLayout(level, side, needed);
  const bytes = layoutBytes(least);
  if (bytes > limit)
    throw new TooLarge(
      `the field takes ${Math.ceil(bytes / 2 ** 20)} MiB of the GPU, more than the ${Math.floor(limit / 2 ** 20)} allowed`,
    );
  if (!level.last) return least;
  try {
    const roomy = createLayout(
      level,
      side,
      needed + Math.max(MIN_SPARE_BRICKS, Math.ceil(SPARE_SHARE * (least.count + needed))),
    );
    return layoutBytes(roomy) > limit ? least : roomy;
  } catch (error) {
    if (error instanceof TooLarge) return least;
    throw error;
  }
}

/** Uploads a level in steps with pauses that keep the page responsive; null once `wanted` is false. */
export async function uploadLevel(
  gl: GL,
  level: Level,
  layout: AtlasLayout,
  wanted: () => boolean,
): Promise<FieldTextures | null> {
  const steps = uploadSteps(gl, level, layout);
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

/** Uploads a level without pauses. */
export function uploadLevelNow(gl: GL, level: Level, layout: AtlasLayout): FieldTextures {
  const steps = uploadSteps(gl, level, layout);
  for (;;) {
    const step = steps.next();
    if (step.done) return step.value;
  }
}

function* uploadSteps(gl: GL, level: Level, layout: AtlasLayout): Generator<void, FieldTextures> {
  const { atlasBricks: across, edge, dims } = layout;
  const size = across.map((n) => n * edge);
  const made: WebGLTexture[] = [];
  let whole = false;
  try {
    const density = texture3D(gl, gl.R16F, size, gl.LINEAR);
    made.push(density);
    const colors = Array.from({ length: layout.colorTextures }, () => {
      const texture = texture3D(gl, gl.RGBA8, size, gl.LINEAR);
      made.push(texture);
      return texture;
    });
    const filler = new TexelWriter(layout, [VertexIndex.fromLevel(level)]);
    const plane = across[0] * across[1];
    for (let z = 0; z < across[2]; z++) {
      resetUnpacking(gl);
      const numbers = layout.bricks.subarray(z * plane, (z + 1) * plane);
      putTexels(
        gl,
        { layout, density, colors },
        filler.texels(numbers, across[0], across[1]),
        [0, 0, z],
        [across[0], across[1]],
      );
      yield;
    }
    resetUnpacking(gl);
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
    return { layout, density, colors, index, slices: dims[0], bytes: layoutBytes(layout) };
  } finally {
    if (!whole) for (const texture of made) gl.deleteTexture(texture);
  }
}

/** Uploads the texels of `size` bricks to the position of the brick `at` of the textures. */
export function putTexels(
  gl: GL,
  { layout: { edge }, density, colors }: Pick<FieldTextures, "layout" | "density" | "colors">,
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
  texels.colors.forEach((data, n) => put(colors[n], gl.RGBA, gl.UNSIGNED_BYTE, data));
  gl.bindTexture(gl.TEXTURE_3D, null);
}

/** A texture of the codes of an occupancy. */
export function uploadOccupancy(gl: GL, { dims, codes }: Occupancy): WebGLTexture {
  resetUnpacking(gl);
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
  for (const texture of [textures.density, textures.index, ...textures.colors]) gl.deleteTexture(texture);
}
