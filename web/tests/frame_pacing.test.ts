import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { Store } from "../src/app/store";
import { FramePacer } from "../src/frames/frame_pacing";
import type { PacerHost } from "../src/frames/frame_pacing";
import type { Hello, PictureHeader } from "../src/net/protocol";
import { PICTURE } from "./headers";

const FRAME_MS = 16;

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

/** A pacer, the messages it sends, and the calls of its host. */
function pacing() {
  const store = new Store();
  const [send, show, say, recordServerFrame, orbitAt] = [vi.fn(), vi.fn(), vi.fn(), vi.fn(), vi.fn()];
  const orbitGuessed: (() => void)[] = [];
  const afterFrame: ((time: number) => void)[] = [];
  const facts = {
    superseded: false,
    dragging: false,
    camera: 3,
    position: [9, 9, 9],
    depth: 2 as number | null,
  };
  const host = {
    store,
    send,
    say,
    recordServerFrame,
    supersedes: () => facts.superseded,
    isDragging: () => facts.dragging,
    viewport: {
      orbitGuessed,
      afterFrame,
      frameTime: FRAME_MS,
      invalidate: vi.fn(),
      orbitAt,
      camera: { position: { toArray: () => facts.position } },
    },
    pictures: { show, depth: { at: () => facts.depth } },
    camera: {
      viewpoint: () => null,
      get seq() {
        return facts.camera;
      },
    },
  };
  const pacer = new FramePacer(host as unknown as PacerHost);
  return {
    store,
    send,
    show,
    say,
    recordServerFrame,
    orbitAt,
    orbitGuessed,
    facts,
    pacer,
    /** Redraws the canvas: requests the next frames, then the drawn ones are on the screen. */
    redraw: (milliseconds = 1000): void => {
      pacer.requestNext();
      afterFrame.forEach((finish) => finish(performance.now()));
      vi.advanceTimersByTime(milliseconds);
    },
    /** Delivers a frame of the server, and waits until it is decoded. */
    deliver: async (header: PictureHeader): Promise<void> => {
      const before = recordServerFrame.mock.calls.length;
      pacer.take(new ArrayBuffer(5), header, 0);
      await vi.waitFor(() => expect(recordServerFrame.mock.calls.length).toBe(before + 1));
    },
  };
}

describe("frame pacing", () => {
  it("acknowledges a superseded frame, and shows the figures of the page's own", async () => {
    const { pacer, facts, store, send, show, redraw, deliver } = pacing();
    facts.superseded = true;
    pacer.add({ ...PICTURE, picture: 0, final: false, render_ms: 5 }, 0, 0);
    redraw();
    await deliver(PICTURE);
    redraw();
    expect(send.mock.calls).toEqual([[{ type: "presented", picture: 7 }]]);
    expect([store.now.figures.page, store.now.figures.renderMs, pacer.last?.picture]).toEqual([true, 5, 0]);
    expect(show).not.toHaveBeenCalled();
    facts.superseded = false;
    await deliver({ ...PICTURE, picture: 8 });
    redraw();
    expect(show).toHaveBeenCalledOnce();
    expect([store.now.figures.page, store.now.figures.renderMs, pacer.last?.picture]).toEqual([false, 60, 8]);
  });

  it("requests a drag's next frame half a frame later, after the actions before a request", async () => {
    const { pacer, facts, send, redraw, deliver } = pacing();
    const order: string[] = [];
    pacer.beforeRequest.push(() => order.push("action"));
    send.mockImplementation(() => order.push("presented"));
    facts.dragging = true;
    await deliver(PICTURE);
    redraw(0.5 * FRAME_MS - 1);
    expect(order).toEqual([]);
    vi.advanceTimersByTime(1);
    expect(order).toEqual(["action", "presented"]);
  });

  it("requests at once where edits are acknowledged, and each number once", () => {
    const { pacer, facts, send, redraw } = pacing();
    facts.dragging = true;
    pacer.acknowledge([4, 5]);
    redraw(0);
    redraw(1000);
    expect(send.mock.calls).toEqual([
      [{ type: "presented", picture: 4 }],
      [{ type: "presented", picture: 5 }],
    ]);
  });

  it("reports a frame that cannot be decoded, and requests the next", async () => {
    const { pacer, send, say, show } = pacing();
    vi.stubGlobal("createImageBitmap", () => Promise.reject(new Error("not a JPEG")));
    pacer.take(new ArrayBuffer(5), { ...PICTURE, format: "jpeg" }, 0);
    await vi.waitFor(() => expect(say).toHaveBeenCalledOnce());
    expect(send.mock.calls).toEqual([[{ type: "presented", picture: 7 }]]);
    expect(show).not.toHaveBeenCalled();
  });

  it("takes the orbit's center from the depth of the next frame, only inside the field", async () => {
    const { orbitGuessed, facts, store, orbitAt, deliver } = pacing();
    const bounds = [
      [0, 0, 0],
      [1, 1, 1],
    ];
    store.set({ hello: { bounds } as Hello });
    const frame = async (camera: number): Promise<void> => {
      facts.camera = camera;
      await deliver({ ...PICTURE, camera });
    };
    orbitGuessed.forEach((call) => call());
    await frame(4);
    expect(orbitAt).not.toHaveBeenCalled();
    facts.position = [0.5, 0.5, 0.5];
    orbitGuessed.forEach((call) => call());
    await deliver({ ...PICTURE, camera: 4 });
    expect(orbitAt).not.toHaveBeenCalled();
    await frame(5);
    await frame(6);
    expect(orbitAt.mock.calls).toEqual([[2]]);
  });
});
