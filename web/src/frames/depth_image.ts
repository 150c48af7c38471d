/** The distances of a whole picture, put together from the parts that arrive. */
import type { PictureHeader } from "../net/protocol";

/** Stands for "nothing there": further than any scene, and finite, since shaders interpolate badly with infinity. */
export const NOTHING = 1e9;
const NONE = 65535;

export class DepthImage {
  width = 1;
  height = 1;
  /** Distance along the ray, world units, row by row from the top. */
  data = new Float32Array([NOTHING]);

  /** Takes a part over. Where a part has another resolution than the whole, the whole is resampled first. */
  put(header: PictureHeader, depth: Uint16Array): void {
    if (header.depth_width === 0 || header.depth_height === 0) return;
    const width = Math.max(1, Math.round((header.full_width * header.depth_width) / header.width));
    const height = Math.max(1, Math.round((header.full_height * header.depth_height) / header.height));
    if (width !== this.width || height !== this.height) this.resample(width, height);
    const left = Math.round((header.x * width) / header.full_width);
    const top = Math.round((header.y * height) / header.full_height);
    for (let j = 0; j < header.depth_height && top + j < height; j++) {
      for (let i = 0; i < header.depth_width && left + i < width; i++) {
        const value = depth[j * header.depth_width + i];
        this.data[(top + j) * width + left + i] = value === NONE ? NOTHING : value * header.depth_scale;
      }
    }
  }

  /** Takes a whole picture's distances over, infinite where there is nothing. */
  take(width: number, height: number, depth: Float32Array): void {
    this.width = width;
    this.height = height;
    this.data = depth.map((distance) => (distance < NOTHING ? distance : NOTHING));
  }

  /** The distance at (u, v) in [0,1], from the left and the top; null where there is nothing. */
  at(u: number, v: number): number | null {
    const i = Math.min(this.width - 1, Math.max(0, Math.floor(u * this.width)));
    const j = Math.min(this.height - 1, Math.max(0, Math.floor(v * this.height)));
    const distance = this.data[j * this.width + i];
    return distance < NOTHING ? distance : null;
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
