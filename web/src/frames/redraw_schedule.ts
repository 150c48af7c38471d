/** Schedule of redraws: at most one for each frame of the browser, on demand. */
export class RedrawSchedule {
  private scheduled = false;
  /** Timer of a redraw that waits for another one. */
  private deferred: ReturnType<typeof setTimeout> | undefined;

  /** `redraw` gets the time at which its frame began. */
  constructor(private readonly redraw: (began: number) => void) {}

  /** Schedules a redraw for the browser's next frame. */
  request(): void {
    if (this.scheduled) return;
    this.scheduled = true;
    clearTimeout(this.deferred);
    this.deferred = undefined;
    requestAnimationFrame((began) => {
      this.scheduled = false;
      this.redraw(began);
    });
  }

  /** Schedules a redraw in so many milliseconds, if none comes before. */
  requestWithin(ms: number): void {
    if (!this.scheduled) this.deferred ??= setTimeout(() => this.request(), ms);
  }
}
