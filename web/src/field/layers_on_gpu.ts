/** The layers of edits in the textures of their field: only those that are other than before are uploaded. */
import { entryOf, Filler } from "./atlas";
import { putTexels } from "./field_textures";
import type { FieldTextures } from "./field_textures";
import { checkMemory, plainUnpacking, texture3D } from "./gl";
import type { Level } from "./level";
import { indexWith, ownBricks } from "./page_layers";
import type { Layer, PlacedLayer } from "./page_layers";
import { Places } from "./layer_offsets";
import { Stored } from "./quantized_vertices";

type GL = WebGL2RenderingContext;

/** How many places layers take in the textures of a layout. */
export function placesFor(layers: readonly PlacedLayer[], layout: FieldTextures["layout"]): number {
  const different = new Map(layers.map(({ layer }) => [layer.key, layer]));
  return [...different.values()].reduce((sum, layer) => sum + ownBricks(layer, layout).length, 0);
}

export class LayersOnGpu {
  private readonly places: Places;
  private field: Stored | null = null;
  private shown = "[]";

  constructor(
    private readonly gl: GL,
    private readonly textures: FieldTextures,
    private readonly level: Level,
  ) {
    const { across, count } = textures.layout;
    this.places = new Places(count, across[0] * across[1] * across[2]);
  }

  /** Puts these layers in the place of those before; the bytes uploaded, or null where the textures have no room. */
  set(layers: readonly PlacedLayer[]): number | null {
    const now = JSON.stringify(layers.map(({ layer, place, first, end }) => [layer.key, place, first, end]));
    if (now === this.shown) return 0;
    this.places.keep(new Set(layers.map(({ layer }) => layer.key)));
    let uploaded = 0;
    for (const { layer } of layers) {
      if (this.places.of(layer.key)) continue;
      const numbers = ownBricks(layer, this.textures.layout);
      const places = this.places.take(layer.key, numbers.length);
      if (places === null) {
        this.shown = "";
        return null;
      }
      uploaded += this.upload(layer, numbers, places);
    }
    uploaded += this.putIndex(layers);
    this.shown = now;
    checkMemory(this.gl);
    return uploaded;
  }

  private upload(layer: Layer, numbers: Int32Array, places: Int32Array): number {
    const { gl, textures, level } = this;
    const { layout } = textures;
    this.field ??= Stored.ofLevel(level);
    const filler = new Filler(layout, [new Stored(layer, layout.brick, layer.low, layer.dims), this.field]);
    plainUnpacking(gl);
    numbers.forEach((number, n) => {
      const [x, y, z] = entryOf(places[n], layout.across);
      putTexels(gl, textures, filler.texels([number], 1, 1), [x, y, z], [1, 1]);
    });
    return numbers.length * layout.edge ** 3 * (2 + 4 * layout.colours);
  }

  private putIndex(layers: readonly PlacedLayer[]): number {
    const { gl, textures } = this;
    const { dims, index } = indexWith(textures.layout, layers, (layer) => this.places.of(layer.key) ?? []);
    plainUnpacking(gl);
    if (dims[0] !== textures.slices) {
      gl.deleteTexture(textures.index);
      textures.index = texture3D(gl, gl.RGBA8UI, [dims[2], dims[1], dims[0]], gl.NEAREST);
      textures.slices = dims[0];
    }
    gl.bindTexture(gl.TEXTURE_3D, textures.index);
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
      index,
    );
    gl.bindTexture(gl.TEXTURE_3D, null);
    return index.length;
  }
}
