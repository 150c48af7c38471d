/** Values that come often, given on less often: the newest, once in so many milliseconds; the last is never lost. */
export class Throttle<T> {
  private given = -Infinity;
  private timer: ReturnType<typeof setTimeout> | undefined;

  constructor(
    private readonly every: number,
    private readonly give: (value: T) => void,
  ) {}

  /** Gives the value on now, where it is time or `atOnce`; else as soon as it is, unless a newer one has come. */
  put(value: T, atOnce = false): void {
    clearTimeout(this.timer);
    const wait = atOnce ? 0 : this.given + this.every - performance.now();
    if (wait > 0) this.timer = setTimeout(() => this.pass(value), wait);
    else this.pass(value);
  }

  private pass(value: T): void {
    this.given = performance.now();
    this.give(value);
  }
}
