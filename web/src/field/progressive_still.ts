/**
 * Progressive drawing of a still frame: bands of rows that leave the page responsive, restarted by every
 * change.
 */

/** Milliseconds after the last change until the frame counts as still. */
export const SETTLE_MS = 60;

/** Milliseconds of the same wait where a complete frame may take long and cannot be drawn in bands. */
export const UNBANDED_SETTLE_MS = 400;

/** A band of rows, from the bottom of the frame. */
export interface Band {
  first: number;
  count: number;
}

export class ProgressiveStill {
  private changedAt = -Infinity;
  private nextRow = 0;
  private complete = false;

  /**
   * Restarts the frame after a change at time `now` (ms); `complete` if the change was drawn as a complete
   * frame.
   */
  restart(now: number, complete: boolean): void {
    this.changedAt = now;
    this.nextRow = 0;
    this.complete = complete;
  }

  /** Whether the complete frame has been drawn. */
  get isComplete(): boolean {
    return this.complete;
  }

  /**
   * The band to draw now, at most `maxRows` rows; null if the frame is complete or has changed less than
   * `settleMs` ago.
   */
  nextBand(now: number, height: number, maxRows: number, settleMs = SETTLE_MS): Band | null {
    if (this.complete || now - this.changedAt < settleMs) return null;
    return { first: this.nextRow, count: Math.min(maxRows, height - this.nextRow) };
  }

  /** Records a drawn band; returns whether the frame is complete. */
  finishBand({ first, count }: Band, height: number): boolean {
    this.nextRow = first + count;
    this.complete = this.nextRow >= height;
    return this.complete;
  }
}
