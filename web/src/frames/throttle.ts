/** Throttle of frequent values: forwards the newest once per interval, and never drops the last one. */
export class Throttle<T> {
  private lastTime = -Infinity;
  private timer: ReturnType<typeof setTimeout> | undefined;

  constructor(
    private readonly intervalMs: number,
    private readonly forward: (value: T) => void,
  ) {}

  /** Whether a value would be forwarded at once. */
  get isDue(): boolean {
    return performance.now() >= this.lastTime + this.intervalMs;
  }

  /**
   * Forwards a value now if the interval is over or `atOnce`; else at its end, unless a newer value arrives.
   */
  put(value: T, atOnce = false): void {
    clearTimeout(this.timer);
    const wait = atOnce ? 0 : this.lastTime + this.intervalMs - performance.now();
    if (wait > 0) this.timer = setTimeout(() => this.forwardNow(value), wait);
    else this.forwardNow(value);
  }

  private forwardNow(value: T): void {
    this.lastTime = performance.now();
    this.forward(value);
  }
}
