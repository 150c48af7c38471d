import { describe, expect, it } from "vitest";
import { Matrix4, Quaternion, Vector3 } from "three";
import { pathDuration, stillAt } from "../src/app/camera_path";
import { Player, type Playable } from "../src/app/player";
import { Store } from "../src/app/store";
import type { Answer, Hello, Key, PageMessage, Still, Vec3 } from "../src/net/protocol";
import { expectClose } from "./cages";
import { state } from "./fake_server";

/** Looks from (x, 0, 5), turned about the vertical by degrees. */
function still(x: number, turn_deg: number, fov_y_deg: number): Still {
  const turned = new Quaternion().setFromAxisAngle(new Vector3(0, 1, 0), (turn_deg * Math.PI) / 180);
  const pose = new Matrix4().compose(new Vector3(x, 0, 5), turned, new Vector3(1, 1, 1));
  return { c2w: pose.transpose().toArray(), fov_y_deg };
}

const STILLS = [still(0, 0, 40), still(1, 20, 50), still(4, 60, 60)];
const KEYS: Key[] = [STILLS[0], STILLS[2]].map((key) => ({ ...key, seconds: 2, parts: {} }));

describe("the camera path", () => {
  it("takes each key's time to the next one, back to the first one in a loop", () => {
    expect(pathDuration(KEYS, false)).toBe(2);
    expect(pathDuration(KEYS, true)).toBe(4);
    expect(pathDuration(KEYS.slice(1), true)).toBe(0);
  });

  it("goes through the server's stills, which are evenly spread over its time", () => {
    for (const [n, expected] of STILLS.entries()) {
      const found = stillAt(STILLS, n / 2);
      expectClose(found.c2w, expected.c2w);
      expect(found.fov_y_deg).toBeCloseTo(expected.fov_y_deg, 9);
    }
    expectClose(stillAt(STILLS, 9).c2w, STILLS[2].c2w);
  });

  it("goes evenly between two stills", () => {
    expectClose(stillAt(STILLS, 0.625).c2w, still(1.75, 30, 52.5).c2w);
    expect(stillAt(STILLS, 0.625).fov_y_deg).toBeCloseTo(52.5, 9);
  });
});

/** A page with a clock, whose server answers with STILLS. */
class FakePage implements Playable {
  readonly store = new Store({
    hello: { page: 3 } as Hello,
    state: state({ keys: KEYS }),
    connection: "open",
  });
  readonly sent: PageMessage[] = [];
  readonly poses: number[][] = [];
  readonly changes: boolean[] = [];
  settled = 0;
  time = 1000;
  answer: Partial<Answer> | null = { stills: STILLS, tracks: [] };
  readonly viewport = {
    beforeFrame: [] as (() => void)[],
    userTurns: [] as (() => void)[],
    invalidate: (): void => undefined,
    pose: (c2w: readonly number[]): void => void this.poses.push([...c2w]),
    resetOrbit: (): void => {
      this.settled += 1;
    },
  };
  readonly player = new Player(this, () => this.time);

  constructor() {
    this.player.changed = (on) => this.changes.push(on);
  }

  send(message: PageMessage): boolean {
    this.sent.push(message);
    return true;
  }

  ask(): Promise<Answer | null> {
    return Promise.resolve(this.answer as Answer | null);
  }

  async begin(): Promise<void> {
    this.player.toggle();
    await Promise.resolve();
    await Promise.resolve();
  }

  frame(after: number): void {
    this.time += 1000 * after;
    for (const action of this.viewport.beforeFrame) action();
  }
}

describe("the player", () => {
  it("tells where it is with each camera, and stops at the end", async () => {
    const page = new FakePage();
    await page.begin();
    page.frame(5); // the clock starts with the first frame, however late that is
    page.frame(1);
    expect(page.player.playing).toBe(true);
    page.frame(3);
    expect(page.sent).toEqual([
      { type: "play_begin", play: 1 },
      { type: "play", play: 1, seconds: 0 },
      { type: "play", play: 1, seconds: 1 },
      { type: "play", play: 1, seconds: 2 },
      { type: "play_end", play: 1 },
    ]);
    expect(page.poses).toHaveLength(3);
    page.poses.forEach((pose, n) => expectClose(pose, STILLS[n].c2w));
    expect([page.changes, page.settled, page.player.playing]).toEqual([[true, false], 1, false]);
    page.frame(1);
    expect(page.poses).toHaveLength(3);
  });

  it("has hotspots where the edits carry them in the frame that it plays", async () => {
    const page = new FakePage();
    const still = { id: 1, position: [7, 7, 7] as Vec3, hidden: false };
    const carried = { id: 2, position: [4, 0, 0] as Vec3, hidden: true };
    page.answer = { stills: STILLS, tracks: [{ hotspot: 2, places: [[0, 0, 0], [2, 0, 0], null] }] };
    expect(page.player.placeOf(still)).toBeNull();
    await page.begin();
    page.frame(0);
    expect(page.player.placeOf(carried)).toEqual([0, 0, 0]);
    page.frame(0.5); // a quarter of the path
    expect(page.player.placeOf(carried)).toEqual([1, 0, 0]);
    expect(page.player.placeOf(still)).toEqual([7, 7, 7]);
    expect(page.player.placeOf({ ...still, hidden: true })).toBeNull();
    page.frame(0.75);
    expect(page.player.placeOf(carried)).toBeNull();
  });

  it("goes round in a loop until it is stopped", async () => {
    const page = new FakePage();
    page.store.set({ state: state({ keys: KEYS, loop: true }) });
    await page.begin();
    page.frame(0);
    page.frame(9);
    expect(page.sent.at(-1)).toEqual({ type: "play", play: 1, seconds: 1 });
    page.player.toggle();
    expect(page.sent.at(-1)).toEqual({ type: "play_end", play: 1 });
  });

  it("stops when the server says that its preview is over, and for no other", async () => {
    const page = new FakePage();
    await page.begin();
    page.frame(0);
    page.player.takePreview({ type: "preview", page: 3, play: 1, on: true });
    page.player.takePreview({ type: "preview", page: 2, play: 1, on: false });
    page.player.takePreview({ type: "preview", page: 3, play: 9, on: false });
    expect(page.player.playing).toBe(true);
    page.player.takePreview({ type: "preview", page: 3, play: 1, on: false });
    expect(page.player.playing).toBe(false);
  });

  it("stops when the user takes the view, and when the server is gone", async () => {
    for (const leave of [
      (page: FakePage) => page.viewport.userTurns[0](),
      (page: FakePage) => page.store.set({ connection: "lost" }),
    ]) {
      const page = new FakePage();
      await page.begin();
      page.frame(0);
      leave(page);
      expect(page.player.playing).toBe(false);
    }
  });

  it("does not begin where the path has no answer, or it was stopped meanwhile", async () => {
    const page = new FakePage();
    page.answer = null;
    await page.begin();
    expect([page.sent, page.changes]).toEqual([[], [true, false]]);
    page.answer = { stills: STILLS };
    page.player.toggle();
    page.player.toggle();
    await Promise.resolve();
    await Promise.resolve();
    page.frame(0);
    expect([page.sent, page.poses, page.player.playing]).toEqual([[], [], false]);
  });
});
