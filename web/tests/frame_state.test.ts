import { Matrix4 } from "three";
import { describe, expect, it } from "vitest";
import { Store } from "../src/app/store";
import {
  currentFrame,
  hasSameView,
  isRefined,
  isServed,
  NO_FRAME,
  ownHeader,
} from "../src/frames/frame_state";
import type { AppliedEdits } from "../src/frames/page_scene";
import type { PictureHeader } from "../src/net/protocol";
import { appliedEdits, PICTURE } from "./headers";

const RESTING = { seq: 3, resting: true };

function source() {
  const store = new Store();
  const viewport = { viewProjection: new Matrix4(), pixels: { width: 4, height: 2 } };
  return { store, viewport };
}

describe("the state of a frame", () => {
  it("differs from no frame, and is equal to itself", () => {
    const frame = currentFrame(source(), null, null);
    expect(hasSameView(frame, NO_FRAME)).toBe(false);
    expect(hasSameView(frame, currentFrame(source(), null, null))).toBe(true);
  });

  it("depends on the camera, the size, the view options and the level", () => {
    const level = { field: { background: null }, last: true } as never;
    const changes: ((to: ReturnType<typeof source>) => void)[] = [
      ({ viewport }) => void (viewport.viewProjection.elements[12] = 1e-9),
      ({ viewport }) => void (viewport.pixels.width = 5),
      ({ viewport }) => void (viewport.pixels.height = 5),
      ({ store }) => store.set({ view: "normals" }),
      ({ store }) => store.set({ before: true }),
      ({ store }) => store.set({ split: 0.5 }),
    ];
    const before = currentFrame(source(), null, null);
    for (const change of changes) {
      const changed = source();
      change(changed);
      expect(hasSameView(currentFrame(changed, null, null), before)).toBe(false);
    }
    expect(hasSameView(currentFrame(source(), level, null), before)).toBe(false);
  });

  it("is refined if the edits alone differ, within one revision", () => {
    const frame = (revision: number, width = 4) => {
      const from = source();
      from.viewport.pixels.width = width;
      return currentFrame(from, null, appliedEdits({ revision }));
    };
    expect(isRefined(frame(2), frame(2))).toBe(true);
    expect(isRefined(frame(3), frame(2))).toBe(false);
    expect(isRefined(frame(2, 8), frame(2))).toBe(false);
    expect(isRefined(frame(2), NO_FRAME)).toBe(false);
  });
});

describe("a served frame", () => {
  const served = (
    header: Partial<PictureHeader> | null,
    options: { camera?: typeof RESTING; all?: boolean; edits?: AppliedEdits | null } = {},
  ): boolean => {
    const { camera, all, edits } = { camera: RESTING, all: false, edits: appliedEdits(), ...options };
    return isServed(header && { ...PICTURE, ...header }, camera, new Store(), edits, all);
  };

  it("shows the current camera, view and edits", () => {
    expect(served({})).toBe(true);
    expect(served({ revision: 2 })).toBe(true);
    const others: Partial<PictureHeader>[] = [
      { camera: 2 },
      { view: "normals" },
      { before: true },
      { split: 0.5 },
      { drag: 1 },
    ];
    for (const header of others) expect(served(header)).toBe(false);
    expect(served({ revision: 0 })).toBe(false);
    expect(served({}, { camera: { seq: 3, resting: false } })).toBe(false);
  });

  it("is none of the page's own, and none before the first edits", () => {
    expect(served(null)).toBe(false);
    expect(served({ picture: 0 })).toBe(false);
    expect(served({}, { edits: null })).toBe(false);
  });

  it("must be final where the page draws all frames", () => {
    expect(served({ final: false })).toBe(true);
    expect(served({ final: false }, { all: true })).toBe(false);
    expect(served({ final: true }, { all: true })).toBe(true);
  });
});

describe("the header of a frame of the page", () => {
  it("is final where the frame is complete and its edits are final", () => {
    const finals = [appliedEdits(), appliedEdits({ final: false }), null].flatMap((edits) =>
      [true, false].map((complete) => ownHeader(RESTING, new Store(), edits, [4, 2], complete, 1).final),
    );
    expect(finals).toEqual([true, false, false, false, false, false]);
  });

  it("has number 0, and the camera, size, edits and view of the frame", () => {
    const store = new Store();
    store.set({ view: "depth", split: 0.25 });
    const edits = appliedEdits({ drag: 5, seq: 6, revision: 8 });
    expect(ownHeader({ seq: 11, resting: false }, store, edits, [4, 2], true, 12)).toMatchObject({
      picture: 0,
      camera: 11,
      drag: 5,
      seq: 6,
      revision: 8,
      view: "depth",
      split: 0.25,
      full_width: 4,
      full_height: 2,
      render_ms: 12,
    });
  });
});
