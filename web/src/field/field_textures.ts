/** A level of a field on the GPU. */
import { bytesOf, Filler, layoutOf, TooLarge } from "./atlas";
import type { Layout } from "./atlas";
import { checkMemory, plainUnpacking, texture3D } from "./gl";
import type { Level, Occupancy } from "./level";

type GL = WebGL2RenderingContext;

export interface FieldTextures {
  layout: Layout;
  density: WebGLTexture;
  colours: WebGLTexture[];
  index: WebGLTexture;
  bytes: number;
}

/**
 * Uploads a level, a layer of bricks at a time, and lets the page breathe in between. Throws `TooLarge` where it takes
 * more than `limit` bytes.
 */
export async function uploadLevel(gl: GL, level: Level, limit: number, wanted: () => boolean): Promise<FieldTextures | null> {
  const layout = layoutOf(level, gl.getParameter(gl.MAX_3D_TEXTURE_SIZE) as number);
  const bytes = bytesOf(layout);
  if (bytes > limit)
    throw new TooLarge(`the field takes ${Math.ceil(bytes / 2 ** 20)} MiB of the GPU, more than the ${Math.floor(limit / 2 ** 20)} allowed`);
  const { across, edge, dims } = layout;
  const size = across.map((n) => n * edge);
  const made: WebGLTexture[] = [];
  try {
    const density = texture3D(gl, gl.R16F, size, gl.LINEAR);
    made.push(density);
    const colours = Array.from({ length: layout.colours }, () => {
      const texture = texture3D(gl, gl.RGBA8, size, gl.LINEAR);
      made.push(texture);
      return texture;
    });
    const filler = new Filler(level, layout);
    for (let place = 0; place < across[2]; place++) {
      const layer = filler.layer(place);
      plainUnpacking(gl);
      const put = (texture: WebGLTexture, format: number, type: number, data: ArrayBufferView): void => {
        gl.bindTexture(gl.TEXTURE_3D, texture);
        gl.texSubImage3D(gl.TEXTURE_3D, 0, 0, 0, place * edge, size[0], size[1], edge, format, type, data);
      };
      put(density, gl.RED, gl.HALF_FLOAT, layer.density);
      layer.colours.forEach((data, n) => put(colours[n], gl.RGBA, gl.UNSIGNED_BYTE, data));
      gl.bindTexture(gl.TEXTURE_3D, null);
      await new Promise((done) => setTimeout(done));
      if (!wanted()) throw new Error("not wanted any more");
    }
    plainUnpacking(gl);
    const index = texture3D(gl, gl.RGBA8UI, [dims[2], dims[1], dims[0]], gl.NEAREST);
    made.push(index);
    gl.texSubImage3D(gl.TEXTURE_3D, 0, 0, 0, 0, dims[2], dims[1], dims[0], gl.RGBA_INTEGER, gl.UNSIGNED_BYTE, layout.index);
    gl.bindTexture(gl.TEXTURE_3D, null);
    checkMemory(gl);
    return { layout, density, colours, index, bytes };
  } catch (error) {
    for (const texture of made) gl.deleteTexture(texture);
    if (!wanted()) return null;
    throw error;
  }
}

/** The codes of an occupancy on the GPU. */
export function uploadOccupancy(gl: GL, { dims, codes }: Occupancy): WebGLTexture {
  plainUnpacking(gl);
  const texture = texture3D(gl, gl.R16UI, [dims[2], dims[1], dims[0]], gl.NEAREST);
  gl.texSubImage3D(gl.TEXTURE_3D, 0, 0, 0, 0, dims[2], dims[1], dims[0], gl.RED_INTEGER, gl.UNSIGNED_SHORT, codes);
  gl.bindTexture(gl.TEXTURE_3D, null);
  return texture;
}

export function deleteField(gl: GL, textures: FieldTextures): void {
  for (const texture of [textures.density, textures.index, ...textures.colours]) gl.deleteTexture(texture);
}
