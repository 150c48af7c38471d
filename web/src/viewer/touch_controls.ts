/** Mouse and touch controls of a canvas: one finger or the left button orbits, two fingers pan and pinch. */

/** Change of the logarithm of the distance, per pixel of the wheel. */
const ZOOM_PER_WHEEL_PIXEL = 0.0012;
const PIXELS_PER_WHEEL_LINE = 30;

export interface CameraMoves {
  /** Orbits by pixels. */
  turn(x: number, y: number): void;
  /** Pans by pixels. */
  shift(x: number, y: number): void;
  /** Multiplies the distance to the orbit's center. */
  zoom(factor: number): void;
}

interface Point {
  x: number;
  y: number;
}

/** A finger on the canvas, or a pressed mouse button. */
interface PressedPointer {
  position: Point;
  /** The position up to which the pointer's motion has been applied. */
  applied: Point;
  /** Whether the pointer pans: another button than the left one, or Shift. */
  shifts: boolean;
}

const distance = (a: Point, b: Point): number => Math.hypot(a.x - b.x, a.y - b.y);

/**
 * Applies the motion of all pointers together: with two fingers, each event states the motion of one alone.
 */
function applyMotion(pointers: PressedPointer[], moves: CameraMoves): void {
  if (pointers.length === 0) return;
  const leading = pointers.slice(0, 2);
  const meanMotion = (axis: "x" | "y"): number =>
    leading.reduce((sum, { position, applied }) => sum + position[axis] - applied[axis], 0) / leading.length;
  const [x, y] = [meanMotion("x"), meanMotion("y")];
  const moved = x !== 0 || y !== 0;
  const [first, second] = leading;
  if (leading.length === 2) {
    if (moved) moves.shift(x, y);
    const before = distance(first.applied, second.applied);
    const after = distance(first.position, second.position);
    if (before > 1 && after > 1 && before !== after) moves.zoom(before / after);
  } else if (moved && first.shifts) moves.shift(x, y);
  else if (moved) moves.turn(x, y);
  for (const pointer of pointers) pointer.applied = pointer.position;
}

export function listenForMoves(canvas: HTMLCanvasElement, moves: CameraMoves): void {
  const pointers = new Map<number, PressedPointer>();
  const apply = (): void => applyMotion([...pointers.values()], moves);
  let scheduled = false;
  canvas.style.touchAction = "none";
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    apply();
    const position = { x: event.clientX, y: event.clientY };
    const shifts = event.button !== 0 || event.shiftKey;
    pointers.set(event.pointerId, { position, applied: position, shifts });
  });
  for (const name of ["pointerup", "pointercancel"] as const)
    canvas.addEventListener(name, (event) => {
      apply();
      pointers.delete(event.pointerId);
    });
  canvas.addEventListener("pointermove", (event) => {
    const pointer = pointers.get(event.pointerId);
    if (!pointer) return;
    pointer.position = { x: event.clientX, y: event.clientY };
    if (scheduled) return;
    scheduled = true;
    requestAnimationFrame(() => {
      scheduled = false;
      apply();
    });
  });
  canvas.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      const pixels = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? PIXELS_PER_WHEEL_LINE : 1;
      moves.zoom(Math.exp(ZOOM_PER_WHEEL_PIXEL * pixels * event.deltaY));
    },
    { passive: false },
  );
}
