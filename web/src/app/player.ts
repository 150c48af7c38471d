/** Plays the camera path: moves the page's camera, and has pictures show the edits as the video will. */
import { duration, stillAt } from "./camera_path";
import type { Ask, Answer, PageMessage, Preview, Still } from "../net/protocol";
import type { Store } from "./store";

/** What of the page the player needs. */
export interface Playable {
  readonly store: Store;
  send(message: PageMessage): boolean;
  ask(question: Omit<Ask, "type" | "request">): Promise<Answer | null>;
  readonly viewport: {
    beforeFrame: (() => void)[];
    /** Called when the user takes hold of the view. */
    taken: (() => void)[];
    invalidate(): void;
    pose(c2w: readonly number[], fov_y_deg: number): void;
    /** Lets the user orbit from the camera as it is. */
    settle(): void;
  };
}

/** What is played: the stills, how long they take, and since when. */
interface Run {
  play: number;
  stills: Still[];
  whole: number;
  loop: boolean;
  /** When its first frame was drawn; null before. */
  started: number | null;
}

export class Player {
  /** Called when it begins, and when it stops. */
  changed: (on: boolean) => void = () => undefined;
  private plays = 0;
  /** The number of what was asked for and is not played yet. */
  private expected: number | null = null;
  private run: Run | null = null;

  constructor(
    private readonly app: Playable,
    private readonly now: () => number = () => performance.now(),
  ) {
    // First of all: the camera is told, and drawn, as it is set here.
    app.viewport.beforeFrame.unshift(() => this.frame());
    app.viewport.taken.push(() => this.stop());
    app.store.watch(["connection"], ({ connection }) => {
      if (connection === "lost") this.stop();
    });
  }

  get playing(): boolean {
    return this.run !== null || this.expected !== null;
  }

  toggle(): void {
    if (this.playing) this.stop();
    else void this.begin();
  }

  stop(): void {
    if (!this.playing) return;
    const { run } = this;
    this.run = this.expected = null;
    if (run !== null) {
      this.app.send({ type: "play_end", play: run.play });
      this.app.viewport.settle();
    }
    this.changed(false);
  }

  /** The server says that a preview has begun or is over; where it is this one, the player stops. */
  told({ page, play, on }: Preview): void {
    if (!on && page === this.app.store.now.hello?.page && play === this.run?.play) this.stop();
  }

  private async begin(): Promise<void> {
    const play = ++this.plays;
    this.expected = play;
    this.changed(true);
    const answer = await this.app.ask({ what: "path" });
    if (this.expected !== play) return;
    const { state } = this.app.store.now;
    if (answer === null || state === null || !this.app.send({ type: "play_begin", play })) {
      this.stop();
      return;
    }
    this.expected = null;
    const whole = duration(state.keys, state.loop);
    this.run = { play, stills: answer.stills, whole, loop: state.loop, started: null };
    this.app.viewport.invalidate();
  }

  private frame(): void {
    const { run } = this;
    if (run === null) return;
    run.started ??= this.now();
    const since = (this.now() - run.started) / 1000;
    const seconds = run.loop ? since % run.whole : Math.min(since, run.whole);
    const { c2w, fov_y_deg } = stillAt(run.stills, seconds / run.whole);
    this.app.send({ type: "play", play: run.play, seconds });
    this.app.viewport.pose(c2w, fov_y_deg);
    if (!run.loop && since >= run.whole) this.stop();
    else this.app.viewport.invalidate();
  }
}
