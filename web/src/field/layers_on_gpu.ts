/** Layers of edits in the textures of their field, with uploads of the changed layers alone. */
import { indexEntry, TexelWriter } from "./atlas";
import { putTexels } from "./field_textures";
import type { FieldTextures } from "./field_textures";
import { checkMemory, resetUnpacking, texture3D } from "./gl";
import type { Level } from "./level";
import { buildLayerIndex, changedBricks } from "./page_layers";
import type { Layer, PlacedLayer } from "./page_layers";
import { OffsetAllocator } from "./layer_offsets";
import { VertexIndex } from "./quantized_vertices";

type GL = WebGL2RenderingContext;

/** Number of bricks that layers take in the textures of a layout. */
export function countLayerBricks(layers: readonly PlacedLayer[], layout: FieldTextures["layout"]): number {
  const different = new Map(layers.map(({ layer }) => [layer.key, layer]));
  return [...different.values()].reduce((sum, layer) => sum + changedBricks(layer, layout).length, 0);
}

export class LayerTextures {
  private readonly allocator: OffsetAllocator;
  private fieldVertices: VertexIndex | null = null;
  private shownKey = "[]";

  constructor(
    private readonly gl: GL,
    private readonly textures: FieldTextures,
    private readonly level: Level,
  ) {
    const { atlasBricks: across, count } = textures.layout;
    this.allocator = new OffsetAllocator(count, across[0] * across[1] * across[2]);
  }

  /** Replaces the layers; returns the uploaded bytes, or null if the textures have no room. */
  set(layers: readonly PlacedLayer[]): number | null {
    const now = JSON.stringify(layers.map(({ layer, place, first, end }) => [layer.key, place, first, end]));
    if (now === this.shownKey) return 0;
    this.allocator.retain(new Set(layers.map(({ layer }) => layer.key)));
    let uploaded = 0;
    for (const { layer } of layers) {
      if (this.allocator.get(layer.key)) continue;
      const numbers = changedBricks(layer, this.textures.layout);
      const places = this.allocator.allocate(layer.key, numbers.length);
      if (places === null) {
        this.shownKey = "";
        return null;
      }
      uploaded += this.upload(layer, numbers, places);
    }
    uploaded += this.putIndex(layers);
    this.shownKey = now;
    checkMemory(this.gl);
    return uploaded;
  }

  private upload(layer: Layer, numbers: Int32Array, places: Int32Array): number {
    const { gl, textures, level } = this;
    const { layout } = textures;
    this.fieldVertices ??= VertexIndex.fromLevel(level);
    const filler = new TexelWriter(layout, [
      new VertexIndex(layer, layout.brick, layer.low, layer.dims),
      this.fieldVertices,
    ]);
    resetUnpacking(gl);
    numbers.forEach((number, n) => {
      const [x, y, z] = indexEntry(places[n], layout.atlasBricks);
      putTexels(gl, textures, filler.texels([number], 1, 1), [x, y, z], [1, 1]);
    });
    return numbers.length * layout.edge ** 3 * (2 + 4 * layout.colorTextures);
  }

  private putIndex(layers: readonly PlacedLayer[]): number {
    const { gl, textures } = this;
    const { dims, index } = buildLayerIndex(
      textures.layout,
      layers,
      (layer) => this.allocator.get(layer.key) ?? [],
    );
    resetUnpacking(gl);
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
