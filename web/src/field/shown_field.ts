/** A level of a field that is drawn: its textures, the layers of its edits in them, and the grids that rays leap by. */
import { deleteField, layoutWithin, uploadLevel, uploadLevelNow, uploadOccupancy } from "./field_textures";
import type { FieldTextures } from "./field_textures";
import type { Layout } from "./atlas";
import { LayersOnGpu, placesFor } from "./layers_on_gpu";
import type { Level } from "./level";
import type { PlacedLayer } from "./page_layers";

type GL = WebGL2RenderingContext;

export class ShownField {
  readonly occupancy: WebGLTexture;
  private layers: LayersOnGpu | null;
  private solid: WebGLTexture | null = null;

  private constructor(
    private readonly gl: GL,
    private readonly memory: number,
    readonly level: Level,
    public textures: FieldTextures,
  ) {
    this.layers = level.last ? new LayersOnGpu(gl, textures, level) : null;
    this.occupancy = uploadOccupancy(gl, level.occupancy);
  }

  /** Uploads a level, with room for layers; null once it is not wanted. Throws `TooLarge` beyond `memory` bytes. */
  static async upload(
    gl: GL,
    memory: number,
    level: Level,
    layers: readonly PlacedLayer[],
    wanted: () => boolean,
  ): Promise<ShownField | null> {
    const textures = await uploadLevel(gl, level, layoutFor(gl, memory, level, layers), wanted);
    return textures && new ShownField(gl, memory, level, textures);
  }

  /** Whether it has layers: the coarse level has none, and shows the field in their place. */
  get layered(): boolean {
    return this.layers !== null;
  }

  /** Puts layers into the textures, which are made anew with more room where they have too little; bytes uploaded. */
  putLayers(layers: readonly PlacedLayer[]): number {
    if (this.layers === null) return 0;
    const uploaded = this.layers.set(layers);
    if (uploaded !== null) return uploaded;
    const { gl, level } = this;
    const layout = layoutFor(gl, this.memory, level, layers);
    deleteField(gl, this.textures);
    this.textures = uploadLevelNow(gl, level, layout);
    this.layers = new LayersOnGpu(gl, this.textures, level);
    return this.layers.set(layers) ?? 0;
  }

  /** An occupancy without anything to leap over, for a coarse level under edits: theirs is that of the full one. */
  get withoutLeaps(): WebGLTexture {
    const { occupancy } = this.level;
    this.solid ??= uploadOccupancy(this.gl, {
      ...occupancy,
      codes: new Uint16Array(occupancy.codes.length).fill(255),
    });
    return this.solid;
  }

  dispose(): void {
    deleteField(this.gl, this.textures);
    this.gl.deleteTexture(this.occupancy);
    this.gl.deleteTexture(this.solid);
  }
}

function layoutFor(gl: GL, memory: number, level: Level, layers: readonly PlacedLayer[]): Layout {
  return layoutWithin(gl, level, memory, (layout) => (level.last ? placesFor(layers, layout) : 0));
}
