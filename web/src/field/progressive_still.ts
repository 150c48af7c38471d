/** A picture at rest, drawn whole in bands of rows so that the page goes on answering; given up when anything moves. */

/** Milliseconds after the last change until the picture counts as at rest. */
export const SETTLES = 60;

/** The same where the whole picture may take long and is drawn at once, in the middle of a drag. */
export const RESTS = 400;

export class Still {
  private changed = -Infinity;
  private row = 0;
  private done = false;

  /** Something is other than before, so that the picture begins anew; `whole` where one was drawn at once. */
  moved(now: number, whole: boolean): void {
    this.changed = now;
    this.row = 0;
    this.done = whole;
  }

  /** Whether the whole picture of what is to be seen was drawn. */
  get whole(): boolean {
    return this.done;
  }

  /** The rows to draw now, at most so many; null where none are, or nothing has changed for less than `settles` ms. */
  next(
    now: number,
    height: number,
    most: number,
    settles = SETTLES,
  ): { first: number; count: number } | null {
    if (this.done || now - this.changed < settles) return null;
    return { first: this.row, count: Math.min(most, height - this.row) };
  }

  /** The rows were drawn; whether all of them are. */
  drew({ first, count }: { first: number; count: number }, height: number): boolean {
    this.row = first + count;
    this.done = this.row >= height;
    return this.done;
  }
}
