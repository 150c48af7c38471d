import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { ownHeader } from "../src/frames/frame_state";
import { Presenter } from "../src/frames/frame_pacing";
import { Store } from "../src/app/store";
import type { App } from "../src/app/app";
import type { TakenEdits } from "../src/frames/page_scene";
import type { PictureHeader } from "../src/net/protocol";

const HEADER: PictureHeader = {
  type: "picture",
  picture: 7,
  camera: 3,
  drag: 0,
  seq: 0,
  revision: 1,
  view: "colour",
  before: false,
  split: null,
  x: 0,
  y: 0,
  width: 1,
  height: 1,
  full_width: 1,
  full_height: 1,
  final: true,
  format: "rgb",
  picture_bytes: 3,
  depth_bytes: 2,
  depth_width: 1,
  depth_height: 1,
  depth_scale: 1,
  render_ms: 60,
  encode_ms: 1,
};

beforeEach(() => {
  vi.useFakeTimers();
  vi.stubGlobal(
    "ImageData",
    class {
      data = new Uint8ClampedArray(4);
    },
  );
  vi.stubGlobal(
    "ImageBitmap",
    class {
      close = vi.fn();
    },
  );
});
afterEach(() => {
  vi.useRealTimers();
  vi.unstubAllGlobals();
});

it("says of a picture that came too late that the next may come, and shows the figures of the page's own", async () => {
  const store = new Store();
  const [send, show, served] = [vi.fn(), vi.fn(), vi.fn()];
  let late = true;
  const frames: ((time: number) => void)[] = [];
  const app = {
    store,
    send,
    drag: null,
    viewport: { guessed: [], afterFrame: frames, frameTime: 16, invalidate: vi.fn() },
    page: { served, outdates: () => late },
    pictures: { show },
    camera: { viewpoint: () => null, seq: 3 },
  } as unknown as App;
  const presenter = new Presenter(app);
  const frame = (): void => {
    presenter.askForMore();
    frames.forEach((framed) => framed(performance.now()));
    vi.advanceTimersByTime(1000);
  };
  presenter.drew({ ...HEADER, picture: 0, final: false, render_ms: 5 }, 0, 0);
  frame();
  presenter.take(new ArrayBuffer(5), HEADER, 0);
  await vi.waitFor(() => expect(served).toHaveBeenCalled());
  frame();
  expect(send.mock.calls).toEqual([[{ type: "presented", picture: 7 }]]);
  expect([store.now.figures.page, store.now.figures.renderMs, presenter.last?.picture]).toEqual([true, 5, 0]);
  expect(show).not.toHaveBeenCalled();
  late = false;
  presenter.take(new ArrayBuffer(5), { ...HEADER, picture: 8 }, 0);
  await vi.waitFor(() => expect(show).toHaveBeenCalled());
  frame();
  expect([store.now.figures.page, store.now.figures.renderMs, presenter.last?.picture]).toEqual([
    false,
    60,
    8,
  ]);
});

it("calls a whole picture of the page's own final once its edits are", () => {
  const app = { store: new Store(), camera: { seq: 3 } } as unknown as App;
  const taken = (final: boolean): TakenEdits =>
    ({ header: { drag: 0, seq: 0, revision: 2, final }, received: 0, taken: 0 }) as unknown as TakenEdits;
  const finals = [taken(true), taken(false), null].flatMap((edits) =>
    [true, false].map((whole) => ownHeader(app, edits, [4, 2], whole, 1).final),
  );
  expect(finals).toEqual([true, false, false, false, false, false]);
});
