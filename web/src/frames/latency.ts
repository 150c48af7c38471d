/** How long it takes from the mouse's move to what shows it, by the page's own clock. */
export interface Move {
  drag: number;
  seq: number;
  /** When the mouse moved: the event's time. */
  moved: number;
  /** When the frame with the moved lines could be on the screen. */
  lines: number | null;
  /** When the picture came, was decoded, and could be on the screen. */
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
  final: boolean;
}

const REMEMBERED = 2000;

export class Latency {
  readonly moves: Move[] = [];
  readonly presented: Presented[] = [];

  /** The mouse has moved and the drag with it. */
  moved(drag: number, seq: number, time: number): void {
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
    if (this.moves.length > REMEMBERED) this.moves.shift();
  }

  /** A frame is on the screen: it shows the lines of all moves so far. */
  framed(time: number): void {
    for (let i = this.moves.length - 1; i >= 0 && this.moves[i].lines === null; i--)
      this.moves[i].lines = time;
  }

  /** A picture is on the screen; the moves up to the one that it shows are done with. */
  shown(picture: Presented, received: number, decoded: number, renderMs: number, encodeMs: number): void {
    this.presented.push(picture);
    if (this.presented.length > REMEMBERED) this.presented.shift();
    if (picture.drag === 0) return;
    const move = this.moves.find((m) => m.drag === picture.drag && m.seq === picture.seq);
    if (move?.presented !== null) return;
    Object.assign(move, {
      received,
      decoded,
      presented: picture.time,
      renderMs,
      encodeMs,
      width: picture.fullWidth,
    });
  }

  /** Pictures a second, over the last two seconds. */
  perSecond(now: number): number {
    const recent = this.presented.filter((picture) => now - picture.time < 2000);
    if (recent.length < 2) return 0;
    return ((recent.length - 1) * 1000) / Math.max(1, recent[recent.length - 1].time - recent[0].time);
  }
}
