/** How large pictures may be so that they come quickly enough, from how long the last ones took. */

/** Shares of the full width and height at which pictures are drawn while something moves. */
const SCALES = [1, 0.75, 0.5, 0.35, 0.25, 0.18, 0.12];

export class Pacing {
  /** Milliseconds a pixel, smoothed; null before the first picture. */
  private cost: number | null = null;

  /** `moving`: milliseconds that a picture may take while something moves; `part`: those of a part of a still one. */
  constructor(
    private readonly moving = 28,
    private readonly part = 40,
  ) {}

  /** Takes note of a picture, or part of one, of so many pixels. */
  took(pixels: number, milliseconds: number): void {
    const cost = milliseconds / Math.max(1, pixels);
    this.cost = this.cost === null ? cost : this.cost + 0.3 * (cost - this.cost);
  }

  /** The share of width and height for pictures while something moves. */
  scale(width: number, height: number): number {
    const { cost } = this;
    if (cost === null) return 0.25;
    return (
      SCALES.find((scale) => cost * width * height * scale * scale <= this.moving) ??
      SCALES[SCALES.length - 1]
    );
  }

  /** How many rows of a still picture to draw at a time. */
  rows(width: number, height: number): number {
    if (this.cost === null) return 16;
    return Math.max(4, Math.min(height, Math.floor(this.part / Math.max(1e-9, this.cost * width))));
  }
}

/** Milliseconds until the GPU has done what it was told so far. */
export async function finished(gl: WebGL2RenderingContext): Promise<number> {
  const began = performance.now();
  const fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
  gl.flush();
  if (fence === null) return 0;
  while (!gl.isContextLost() && gl.clientWaitSync(fence, 0, 0) === gl.TIMEOUT_EXPIRED)
    await new Promise((done) => setTimeout(done, 1));
  gl.deleteSync(fence);
  return performance.now() - began;
}
