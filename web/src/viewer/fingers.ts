/** Mouse and touch on a canvas: one finger or the left button turns, two fingers shift and pinch. */

export interface Moves {
  /** By pixels. */
  turn(x: number, y: number): void;
  shift(x: number, y: number): void;
  /** By a factor of the distance. */
  zoom(by: number): void;
}

interface Finger {
  x: number;
  y: number;
  /** Another button, or Shift: it shifts. */
  shifts: boolean;
}

export function listen(canvas: HTMLCanvasElement, moves: Moves): void {
  const fingers = new Map<number, Finger>();
  canvas.style.touchAction = "none";
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, { x: event.clientX, y: event.clientY, shifts: event.button !== 0 || event.shiftKey });
  });
  for (const name of ["pointerup", "pointercancel"] as const)
    canvas.addEventListener(name, (event) => fingers.delete(event.pointerId));
  canvas.addEventListener("pointermove", (event) => {
    const finger = fingers.get(event.pointerId);
    if (!finger) return;
    const [x, y] = [event.clientX - finger.x, event.clientY - finger.y];
    const other = [...fingers.entries()].find(([id]) => id !== event.pointerId)?.[1];
    if (other) {
      const before = Math.hypot(finger.x - other.x, finger.y - other.y);
      const after = Math.hypot(event.clientX - other.x, event.clientY - other.y);
      // Each of the two fingers moves the middle by half of its way.
      moves.shift(x / 2, y / 2);
      if (before > 1 && after > 1) moves.zoom(before / after);
    } else if (finger.shifts) moves.shift(x, y);
    else moves.turn(x, y);
    finger.x = event.clientX;
    finger.y = event.clientY;
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
