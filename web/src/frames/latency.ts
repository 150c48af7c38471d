/** Latency from a motion of the mouse to the frame that shows it, in ms of the page's clock. */
export interface Move {
  drag: number;
  seq: number;
  /** Time of the mouse event. */
  moved: number;
  /** Time at which the moved lines are on the screen. */
  lines: number | null;
  /** Times at which the image arrived, was decoded, and is on the screen. */
  received: number | null;
  decoded: number | null;
  presented: number | null;
  renderMs: number;
  encodeMs: number;
  width: number;
}

export interface Presented {
  time: number;
  drag: number;
  seq: number;
  camera: number;
  revision: number;
  width: number;
  fullWidth: number;
  /** Whether it completes a whole picture, and whether nothing refines that. */
  whole: boolean;
  final: boolean;
}

const MAX_RECORDS = 2000;

export class Latency {
  readonly moves: Move[] = [];
  readonly presented: Presented[] = [];
  /** Time from the last motion that an image has shown to that image; 0 before the first one. */
  lastMove = 0;

  /** Records a motion of the mouse in a drag. */
  addMove(drag: number, seq: number, time: number): void {
    this.moves.push({
      drag,
      seq,
      moved: time,
      lines: null,
      received: null,
      decoded: null,
      presented: null,
      renderMs: 0,
      encodeMs: 0,
      width: 0,
    });
    if (this.moves.length > MAX_RECORDS) this.moves.shift();
  }

  /** Records that a redraw is on the screen, with the lines of all motions so far. */
  finishLines(time: number): void {
    for (let i = this.moves.length - 1; i >= 0 && this.moves[i].lines === null; i--)
      this.moves[i].lines = time;
  }

  /** Records an image on the screen, for the motion that it shows. */
  addPresented(
    picture: Presented,
    received: number,
    decoded: number,
    renderMs: number,
    encodeMs: number,
  ): void {
    this.presented.push(picture);
    if (this.presented.length > MAX_RECORDS) this.presented.shift();
    if (picture.drag === 0) return;
    const move = this.moves.find((m) => m.drag === picture.drag && m.seq === picture.seq);
    if (move?.presented !== null) return;
    this.lastMove = picture.time - move.moved;
    Object.assign(move, {
      received,
      decoded,
      presented: picture.time,
      renderMs,
      encodeMs,
      width: picture.fullWidth,
    });
  }

  /** Images per second, over the last two seconds. */
  frameRate(now: number): number {
    const recent = this.presented.filter((picture) => now - picture.time < 2000);
    if (recent.length < 2) return 0;
    return ((recent.length - 1) * 1000) / Math.max(1, recent[recent.length - 1].time - recent[0].time);
  }
}
