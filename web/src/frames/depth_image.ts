/** Distances of an image, assembled from the parts that arrive. */
import type { PictureHeader } from "../net/protocol";

/**
 * Distance of a ray that hits nothing: beyond any scene, and finite, because shaders interpolate infinity
 * badly.
 */
export const EMPTY_DISTANCE = 1e9;
const EMPTY_CODE = 65535;

export class DepthImage {
  width = 1;
  height = 1;
  /** Distance along the ray, world units, row by row from the top. */
  data = new Float32Array([EMPTY_DISTANCE]);

  /** Adds a part; the whole image is resampled first if the part has another resolution. */
  addPart(header: PictureHeader, depth: Uint16Array): void {
    if (header.depth_width === 0 || header.depth_height === 0) return;
    const width = Math.max(1, Math.round((header.full_width * header.depth_width) / header.width));
    const height = Math.max(1, Math.round((header.full_height * header.depth_height) / header.height));
    if (width !== this.width || height !== this.height) this.resample(width, height);
    const left = Math.round((header.x * width) / header.full_width);
    const top = Math.round((header.y * height) / header.full_height);
    for (let j = 0; j < header.depth_height && top + j < height; j++) {
      for (let i = 0; i < header.depth_width && left + i < width; i++) {
        const value = depth[j * header.depth_width + i];
        this.data[(top + j) * width + left + i] =
          value === EMPTY_CODE ? EMPTY_DISTANCE : value * header.depth_scale;
      }
    }
  }

  /** Replaces all distances; infinite ones hit nothing. */
  replace(width: number, height: number, depth: Float32Array): void {
    this.width = width;
    this.height = height;
    this.data = depth.map((distance) => (distance < EMPTY_DISTANCE ? distance : EMPTY_DISTANCE));
  }

  /** The distance at (u, v) in [0,1], from the left and the top; null where the ray hits nothing. */
  at(u: number, v: number): number | null {
    const i = Math.min(this.width - 1, Math.max(0, Math.floor(u * this.width)));
    const j = Math.min(this.height - 1, Math.max(0, Math.floor(v * this.height)));
    const distance = this.data[j * this.width + i];
    return distance < EMPTY_DISTANCE ? distance : null;
  }

  private resample(width: number, height: number): void {
    const data = new Float32Array(width * height);
    for (let j = 0; j < height; j++) {
      const row = Math.floor(((j + 0.5) * this.height) / height) * this.width;
      for (let i = 0; i < width; i++) {
        data[j * width + i] = this.data[row + Math.floor(((i + 0.5) * this.width) / width)];
      }
    }
    this.data = data;
    this.width = width;
    this.height = height;
  }
}
