/** The drawn level of a field: its textures with the layers of edits, and its occupancies. */
import { deleteField, fitLayout, uploadLevel, uploadLevelNow, uploadOccupancy } from "./field_textures";
import type { FieldTextures } from "./field_textures";
import type { AtlasLayout } from "./atlas";
import { LayerTextures, countLayerBricks } from "./layers_on_gpu";
import type { Level } from "./level";
import type { PlacedLayer } from "./page_layers";

type GL = WebGL2RenderingContext;

export class ShownField {
  readonly occupancy: WebGLTexture;
  private layers: LayerTextures | null;
  private solidOccupancy: WebGLTexture | null = null;

  private constructor(
    private readonly gl: GL,
    private readonly memory: number,
    readonly level: Level,
    public textures: FieldTextures,
  ) {
    this.layers = level.last ? new LayerTextures(gl, textures, level) : null;
    this.occupancy = uploadOccupancy(gl, level.occupancy);
  }

  /**
   * Uploads a level with room for layers; null once `wanted` is false. Throws `TooLarge` beyond `memory`
   * bytes.
   */
  static async upload(
    gl: GL,
    memory: number,
    level: Level,
    layers: readonly PlacedLayer[],
    wanted: () => boolean,
  ): Promise<ShownField | null> {
    const textures = await uploadLevel(gl, level, layoutWithLayers(gl, memory, level, layers), wanted);
    return textures && new ShownField(gl, memory, level, textures);
  }

  /** Whether the level has layers; a coarse level has none and shows the field instead. */
  get layered(): boolean {
    return this.layers !== null;
  }

  /** Puts layers into the textures, reallocated if too small; returns the uploaded bytes. */
  putLayers(layers: readonly PlacedLayer[]): number {
    if (this.layers === null) return 0;
    const uploaded = this.layers.set(layers);
    if (uploaded !== null) return uploaded;
    const { gl, level } = this;
    const layout = layoutWithLayers(gl, this.memory, level, layers);
    deleteField(gl, this.textures);
    this.textures = uploadLevelNow(gl, level, layout);
    this.layers = new LayerTextures(gl, this.textures, level);
    return this.layers.set(layers) ?? 0;
  }

  /**
   * An occupancy without empty space, for a coarse level with edits, whose occupancy fits the finest level
   * alone.
   */
  get fullOccupancy(): WebGLTexture {
    const { occupancy } = this.level;
    this.solidOccupancy ??= uploadOccupancy(this.gl, {
      ...occupancy,
      codes: new Uint16Array(occupancy.codes.length).fill(255),
    });
    return this.solidOccupancy;
  }

  dispose(): void {
    deleteField(this.gl, this.textures);
    this.gl.deleteTexture(this.occupancy);
    this.gl.deleteTexture(this.solidOccupancy);
  }
}

function layoutWithLayers(gl: GL, memory: number, level: Level, layers: readonly PlacedLayer[]): AtlasLayout {
  return fitLayout(gl, level, memory, (layout) => (level.last ? countLayerBricks(layers, layout) : 0));
}
