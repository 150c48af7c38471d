/** Mouse and touch on a canvas: one finger or the left button turns, two fingers shift and pinch. */

export interface Moves {
  /** By pixels. */
  turn(x: number, y: number): void;
  shift(x: number, y: number): void;
  /** By a factor of the distance. */
  zoom(by: number): void;
}

interface Point {
  x: number;
  y: number;
}

interface Finger {
  /** Where it is, and where it was when it was last followed. */
  at: Point;
  from: Point;
  /** Another button, or Shift: it shifts. */
  shifts: boolean;
}

const between = (a: Point, b: Point): number => Math.hypot(a.x - b.x, a.y - b.y);

export function listen(canvas: HTMLCanvasElement, moves: Moves): void {
  const fingers = new Map<number, Finger>();
  let waiting = false;

  /** Follows all fingers at once: of two, each event tells of one alone. */
  const follow = (): void => {
    const held = [...fingers.values()];
    if (held.length === 0) return;
    const two = held.slice(0, 2);
    const mean = (axis: "x" | "y"): number =>
      two.reduce((sum, { at, from }) => sum + at[axis] - from[axis], 0) / two.length;
    const [x, y] = [mean("x"), mean("y")];
    if (two.length === 2 || two[0].shifts) {
      if (x !== 0 || y !== 0) moves.shift(x, y);
    } else if (x !== 0 || y !== 0) moves.turn(x, y);
    if (two.length === 2) {
      const [before, after] = [between(two[0].from, two[1].from), between(two[0].at, two[1].at)];
      if (before > 1 && after > 1 && before !== after) moves.zoom(before / after);
    }
    for (const finger of held) finger.from = finger.at;
  };

  canvas.style.touchAction = "none";
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    follow();
    const at = { x: event.clientX, y: event.clientY };
    fingers.set(event.pointerId, { at, from: at, shifts: event.button !== 0 || event.shiftKey });
  });
  for (const name of ["pointerup", "pointercancel"] as const)
    canvas.addEventListener(name, (event) => {
      follow();
      fingers.delete(event.pointerId);
    });
  canvas.addEventListener("pointermove", (event) => {
    const finger = fingers.get(event.pointerId);
    if (!finger) return;
    finger.at = { x: event.clientX, y: event.clientY };
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => {
      waiting = false;
      follow();
    });
  });
  canvas.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 30 : 1;
      moves.zoom(Math.exp(0.0012 * lines * event.deltaY));
    },
    { passive: false },
  );
}
