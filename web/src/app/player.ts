/**
 * Playback of the camera path: the page's camera follows the path, and frames show the edits as the video
 * does.
 */
import { pathDuration, stillAt, trackAt } from "./camera_path";
import type {
  Ask,
  Answer,
  HotspotState,
  HotspotTrack,
  PageMessage,
  Preview,
  Still,
  Vec3,
} from "../net/protocol";
import type { Store } from "./store";

/** The parts of the editor that the player uses. */
export interface Playable {
  readonly store: Store;
  send(message: PageMessage): boolean;
  ask(question: Omit<Ask, "type" | "request">): Promise<Answer | null>;
  readonly viewport: {
    beforeFrame: (() => void)[];
    /** Called when the user begins to turn the view. */
    userTurns: (() => void)[];
    invalidate(): void;
    pose(c2w: readonly number[], fov_y_deg: number): void;
    /** Lets the user orbit from the camera as it is. */
    resetOrbit(): void;
  };
}

/** A playback in progress. */
interface Run {
  play: number;
  stills: Still[];
  /** Places of the hotspots that the edits carry along, by their number. */
  tracks: Map<number, HotspotTrack["places"]>;
  /** Share of the duration of the frame that is shown. */
  share: number;
  /** Duration of the path in seconds. */
  duration: number;
  loop: boolean;
  /** Time of the first frame, in ms; null before it. */
  started: number | null;
}

export class Player {
  /** Called when a playback begins, and when it stops. */
  changed: (on: boolean) => void = () => undefined;
  private plays = 0;
  /** The number of the playback whose stills were requested and have not arrived. */
  private expected: number | null = null;
  private run: Run | null = null;

  constructor(
    private readonly app: Playable,
    private readonly now: () => number = () => performance.now(),
  ) {
    // The first action of a frame: the camera is sent and drawn in the pose that is set here.
    app.viewport.beforeFrame.unshift(() => this.frame());
    app.viewport.userTurns.push(() => this.stop());
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
      this.app.viewport.resetOrbit();
    }
    this.changed(false);
  }

  /** Where a hotspot is seen in the frame that this page plays; null where it is hidden, or without a playback. */
  placeOf(hotspot: Pick<HotspotState, "id" | "position" | "hidden">): Vec3 | null {
    if (this.run === null) return null;
    const places = this.run.tracks.get(hotspot.id);
    if (places === undefined) return hotspot.hidden ? null : hotspot.position;
    return trackAt(places, this.run.share);
  }

  /** Stops the playback if the server has ended its preview. */
  takePreview({ page, play, on }: Preview): void {
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
    const { keys, loop } = state;
    this.run = {
      play,
      stills: answer.stills,
      tracks: new Map(answer.tracks.map(({ hotspot, places }) => [hotspot, places])),
      share: 0,
      duration: pathDuration(keys, loop),
      loop,
      started: null,
    };
    this.app.viewport.invalidate();
  }

  private frame(): void {
    const { run } = this;
    if (run === null) return;
    run.started ??= this.now();
    const elapsed = (this.now() - run.started) / 1000;
    const seconds = run.loop ? elapsed % run.duration : Math.min(elapsed, run.duration);
    run.share = seconds / run.duration;
    const { c2w, fov_y_deg } = stillAt(run.stills, run.share);
    this.app.send({ type: "play", play: run.play, seconds });
    this.app.viewport.pose(c2w, fov_y_deg);
    if (!run.loop && elapsed >= run.duration) this.stop();
    else this.app.viewport.invalidate();
  }
}
