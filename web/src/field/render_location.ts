/** Choice of the render location, page or server, from the measured cost of both in milliseconds per pixel. */

/** Number of the page's frames measured before a comparison. */
const MIN_FRAMES = 6;

/** Factor by which the page may be slower: the page's frames need no transfer. */
const MAX_SLOWDOWN = 1.25;

/** Milliseconds in which the page may draw a complete frame, whatever the server takes. */
export const COMPLETE_FRAME_MS = 200;

/**
 * Factor by which the limit is relaxed while the page draws complete frames, so that the choice does not
 * alternate.
 */
const HYSTERESIS = 1.5;

/** Weight of the newest measurement in a running mean. */
const SMOOTHING = 0.3;

export class RenderLocation {
  /** Milliseconds per pixel; null before the first frame. */
  pageCost: number | null = null;
  serverCost: number | null = null;
  private frames = 0;
  private measuredMoving = false;
  private drawsComplete = false;

  /** Records a frame, or a band, of the page. */
  recordPage(pixels: number, milliseconds: number): void {
    this.frames += 1;
    this.pageCost = smooth(this.pageCost, milliseconds / Math.max(1, pixels));
  }

  /**
   * Records a frame of the server. Moving frames are cheaper per pixel: from the first one on, only they
   * count.
   */
  recordServer(pixels: number, milliseconds: number, moving: boolean): void {
    if (this.measuredMoving && !moving) return;
    const before = moving && !this.measuredMoving ? null : this.serverCost;
    this.serverCost = smooth(before, milliseconds / Math.max(1, pixels));
    this.measuredMoving = moving;
  }

  /** Whether the server draws moving frames faster, as far as both costs are known. */
  get serverIsFaster(): boolean {
    const { pageCost, serverCost } = this;
    if (pageCost === null || serverCost === null || this.frames < MIN_FRAMES) return false;
    return pageCost > MAX_SLOWDOWN * serverCost;
  }

  /**
   * Whether the page draws complete frames of so many pixels: within COMPLETE_FRAME_MS, or faster than the
   * server.
   */
  chooseComplete(pixels: number): boolean {
    const { pageCost, serverCost } = this;
    if (pageCost === null) return false;
    const slack = this.drawsComplete ? HYSTERESIS : 1;
    const isQuick = pageCost * pixels <= slack * COMPLETE_FRAME_MS;
    this.drawsComplete = isQuick || (serverCost !== null && pageCost <= slack * serverCost);
    return this.drawsComplete;
  }

  /** Text with both rates, for the status line's tooltip. */
  get summary(): string {
    return `this page ${describeRate(this.pageCost)}, the server ${describeRate(this.serverCost)}`;
  }
}

function describeRate(cost: number | null): string {
  if (cost === null) return "not measured";
  return `${(1e-3 / Math.max(cost, 1e-9)).toPrecision(2)} million pixels a second`;
}

function smooth(before: number | null, now: number): number {
  return before === null ? now : before + SMOOTHING * (now - before);
}

/**
 * Bytes of GPU memory that a scene may take on a device with so many GiB, where the browser states the
 * number.
 */
export function memoryLimit(deviceMemory: number | undefined): number {
  return Math.min(768, Math.max(96, (deviceMemory ?? 8) * 128)) * 2 ** 20;
}
