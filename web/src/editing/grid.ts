/** The faint grid of the selected edit, asked for again as its cages move: it may lag behind them, never queue. */
import type { Cages } from "./drag";
import type { Answer, EditState, Vec3 } from "../net/protocol";

/** Shortest time between two questions, milliseconds. */
const PAUSE = 150;

export class Grid {
  private edit = 0;
  private key = "";
  private lines: Vec3[][] = [];
  private asking = false;

  constructor(
    private readonly ask: (edit: number) => Promise<Answer | null>,
    private readonly changed: () => void,
  ) {}

  /** Nothing is known any more. */
  forget(): void {
    this.key = "";
  }

  /** The newest lines of an edit; where its cages have moved on, newer ones are asked for. */
  of(edit: EditState, { deformed, outer }: Cages): Vec3[][] {
    if (edit.kind !== "continuous" || outer === null || !edit.enabled) return [];
    if (edit.id !== this.edit) {
      this.edit = edit.id;
      this.lines = [];
    }
    const { inner, shell, falloff, width } = edit;
    const key = JSON.stringify([edit.id, deformed.corners, outer.corners, inner, shell, falloff, width]);
    if (key !== this.key && !this.asking) {
      this.key = key;
      this.asking = true;
      void this.ask(edit.id).then((answer) => {
        if (answer !== null && this.edit === edit.id) this.lines = answer.grid;
        this.changed();
        setTimeout(() => {
          this.asking = false;
          this.changed();
        }, PAUSE);
      });
    }
    return this.lines;
  }
}
