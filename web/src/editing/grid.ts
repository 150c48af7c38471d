/**
 * Deformed grid of the selected edit, requested from the server whenever its cages have moved, one request at
 * a time.
 */
import type { Cages } from "./drag";
import { handlesOf } from "./point_cages";
import type { Answer, EditState, Vec3 } from "../net/protocol";

/** Milliseconds between two requests, at least. */
const REQUEST_INTERVAL_MS = 150;

export class Grid {
  private edit = 0;
  private requestKey = "";
  private lines: Vec3[][] = [];
  private isWaiting = false;

  constructor(
    private readonly ask: (edit: number) => Promise<Answer | null>,
    private readonly changed: () => void,
  ) {}

  /** Makes the next call of `linesFor` request new lines. */
  clear(): void {
    this.requestKey = "";
  }

  /** The last lines received for an edit; new ones are requested if its cages have moved since. */
  linesFor(edit: EditState, { deformed, outer }: Cages): Vec3[][] {
    if (edit.kind !== "continuous" || outer === null || !edit.enabled) return [];
    if (edit.id !== this.edit) {
      this.edit = edit.id;
      this.lines = [];
    }
    const { inner, shell, falloff, width, points } = edit;
    const reach = [points?.radius, points?.falloff, points?.connected];
    const key = JSON.stringify([
      edit.id,
      handlesOf(deformed),
      outer.corners,
      inner,
      shell,
      falloff,
      width,
      reach,
    ]);
    if (key !== this.requestKey && !this.isWaiting) {
      this.requestKey = key;
      this.isWaiting = true;
      void this.ask(edit.id).then((answer) => {
        if (answer !== null && this.edit === edit.id) this.lines = answer.grid;
        this.changed();
        setTimeout(() => {
          this.isWaiting = false;
          this.changed();
        }, REQUEST_INTERVAL_MS);
      });
    }
    return this.lines;
  }
}
