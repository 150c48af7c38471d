/**
 * Adaptive resolution: the size of moving frames, and the height of bands of still ones, from the measured
 * cost of a pixel.
 */

/** Shares of the full width and height at which moving frames are drawn. */
const SCALES = [1, 0.75, 0.5, 0.35, 0.25, 0.18, 0.12];

/** Scale and rows of the first frame, before any cost is known. */
const FIRST_SCALE = 0.25;
const FIRST_ROWS = 16;

const MIN_ROWS = 4;

/** Weight of the newest measurement in the running mean of the cost. */
const SMOOTHING = 0.3;

export class AdaptiveResolution {
  /** Milliseconds per pixel, a running mean; null before the first frame. */
  private cost: number | null = null;

  /** `frameBudget`: milliseconds of a moving frame; `bandBudget`: milliseconds of a band of a still frame. */
  constructor(
    private readonly frameBudget = 28,
    private readonly bandBudget = 40,
  ) {}

  /** Records the time of a frame, or of a band, of so many pixels. */
  record(pixels: number, milliseconds: number): void {
    const cost = milliseconds / Math.max(1, pixels);
    this.cost = this.cost === null ? cost : this.cost + SMOOTHING * (cost - this.cost);
  }

  /** Share of the full width and height for moving frames. */
  scale(width: number, height: number): number {
    const { cost } = this;
    if (cost === null) return FIRST_SCALE;
    const fits = (scale: number): boolean => cost * width * height * scale * scale <= this.frameBudget;
    return SCALES.find(fits) ?? SCALES[SCALES.length - 1];
  }

  /** Number of rows in a band of a still frame. */
  bandRows(width: number, height: number): number {
    if (this.cost === null) return FIRST_ROWS;
    const rows = Math.floor(this.bandBudget / Math.max(1e-9, this.cost * width));
    return Math.max(MIN_ROWS, Math.min(height, rows));
  }
}

/** Milliseconds until the GPU has executed all commands so far. */
export async function waitForGpu(gl: WebGL2RenderingContext): Promise<number> {
  const began = performance.now();
  const fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
  gl.flush();
  if (fence === null) return 0;
  while (!gl.isContextLost() && gl.clientWaitSync(fence, 0, 0) === gl.TIMEOUT_EXPIRED)
    await new Promise((done) => setTimeout(done, 1));
  gl.deleteSync(fence);
  return performance.now() - began;
}
