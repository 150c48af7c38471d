import { Matrix4 } from "three";
import { afterEach, describe, expect, it, vi } from "vitest";
import { Store } from "../src/app/store";
import { PageRenderer, renderRequest } from "../src/frames/page_renderer";
import type { RenderRequest } from "../src/frames/page_renderer";
import type { Hello, PageMessage, PictureHeader, State } from "../src/net/protocol";
import { fakeDrawer, stubField } from "./fake_drawer";
import { EDITS, PICTURE } from "./headers";

afterEach(() => vi.unstubAllGlobals());

/** A renderer whose server is connected, and has sent a state and, unless `final` is false, a final frame. */
function rendering(request: RenderRequest = "all", { software = false, final = true } = {}) {
  const fetch = stubField();
  const { drawer, asDrawer, arrive } = fakeDrawer();
  const store = new Store();
  const sent: PageMessage[] = [];
  const frames = {
    last: null as PictureHeader | null,
    add: vi.fn((header: PictureHeader) => void (frames.last = header)),
    acknowledge: vi.fn(),
  };
  const beforeFrame: (() => void)[] = [];
  const host = {
    store,
    viewport: {
      software,
      renderer: { resetState: vi.fn() },
      camera: { fov: 50 },
      c2w: [],
      canvas: { addEventListener: vi.fn() },
      beforeFrame,
      invalidate: vi.fn(),
      viewProjection: new Matrix4(),
      pixels: { width: 64, height: 48 },
    },
    pictures: { showOwn: vi.fn() },
    camera: { seq: 3, resting: true, restate: vi.fn() },
    frames,
    send: (message: PageMessage) => sent.push(message) > 0,
    say: vi.fn(),
  };
  const page = new PageRenderer(host, request, () => asDrawer);
  const connect = (number: number): void =>
    store.set({
      connection: "open",
      hello: { field: "a", page: number } as Hello,
      state: { pictured: 1 } as State,
      figures: { ...store.now.figures, final },
    });
  connect(1);
  const load = async (last: boolean): Promise<void> => {
    await vi.waitFor(() => expect(drawer.load).toHaveBeenCalledOnce());
    arrive(last);
  };
  const takeEdits = async (): Promise<void> => {
    const before = drawer.setEdits.mock.calls.length;
    page.takeEdits(EDITS, new ArrayBuffer(1));
    await vi.waitFor(() => expect(drawer.setEdits.mock.calls.length).toBe(before + 1));
    await Promise.resolve();
  };
  const redraw = (): void => beforeFrame.forEach((action) => action());
  return { page, host, store, sent, drawer, fetch, frames, connect, load, arrive, takeEdits, redraw };
}

describe("rendering by the page", () => {
  it("is requested by the address", () => {
    const searches = ["?render=server", "?render=page", "?render=all", "?render=x", ""];
    expect(searches.map(renderRequest)).toEqual(["server", "page", "all", "fastest", "fastest"]);
  });

  it("loads nothing before the server's first final frame", () => {
    expect(rendering("all", { final: false }).fetch).not.toHaveBeenCalled();
    expect(rendering("all").fetch).toHaveBeenCalledOnce();
  });

  it("stays with the server by request, or without a GPU", () => {
    for (const { page, fetch } of [rendering("server"), rendering("fastest", { software: true })]) {
      expect(page.why).not.toBeNull();
      expect([page.here, page.draws, fetch.mock.calls.length]).toEqual(["nothing", false, 0]);
    }
  });

  it("announces moving frames with the first level, and all with the last", async () => {
    const { page, sent, load, arrive } = rendering();
    await load(false);
    expect(sent).toEqual([{ type: "drawing", here: "moving" }]);
    arrive(true);
    expect(sent.slice(1)).toEqual([{ type: "drawing", here: "all" }]);
    expect([page.why, page.draws]).toEqual([null, false]);
  });

  it("draws a frame once the edits are applied, and acknowledges the edits", async () => {
    const { page, host, frames, load, takeEdits, redraw } = rendering();
    await load(true);
    redraw();
    expect(page.drawn).toBe(0);
    await takeEdits();
    await vi.waitFor(() => expect(page.draws).toBe(true));
    redraw();
    expect(page.drawn).toBe(1);
    expect(host.pictures.showOwn).toHaveBeenCalledOnce();
    expect(frames.last).toMatchObject({ picture: 0, camera: 3, revision: EDITS.revision });
    await vi.waitFor(() => expect(frames.acknowledge.mock.calls).toEqual([[[EDITS.picture]]]));
  });

  it("supersedes every server frame in state all, only older ones of a resting camera in state moving", async () => {
    const all = rendering();
    await all.load(true);
    await all.takeEdits();
    await vi.waitFor(() => expect(all.page.supersedes(PICTURE)).toBe(true));
    const moving = rendering();
    await moving.load(false);
    await moving.takeEdits();
    await vi.waitFor(() => expect(moving.page.draws).toBe(true));
    expect(moving.page.supersedes(PICTURE)).toBe(false);
    expect(moving.page.supersedes({ ...PICTURE, revision: 0 })).toBe(true);
    moving.host.camera.resting = false;
    expect(moving.page.supersedes(PICTURE)).toBe(true);
  });

  it("leaves edits that it cannot draw to the server, until there are others", async () => {
    const { page, store, sent, host, load } = rendering();
    await load(true);
    page.takeEdits({ ...EDITS, why: "too many edits" }, new ArrayBuffer(0));
    expect([page.why, page.here]).toEqual(["too many edits", "nothing"]);
    expect(sent.slice(1)).toEqual([
      { type: "presented", picture: EDITS.picture },
      { type: "drawing", here: "nothing" },
    ]);
    expect(host.camera.restate).toHaveBeenCalledOnce();
    store.set({ state: { pictured: 2 } as State });
    expect([page.why, page.here]).toEqual([null, "all"]);
    expect(sent.at(-1)).toEqual({ type: "drawing", here: "all" });
  });

  it("announces itself again after a reconnection, without another load", async () => {
    const { page, store, sent, fetch, load, connect } = rendering();
    await load(true);
    store.set({ connection: "lost" });
    expect(page.here).toBe("nothing");
    connect(2);
    expect(sent).toEqual([
      { type: "drawing", here: "all" },
      { type: "drawing", here: "all" },
    ]);
    expect(fetch).toHaveBeenCalledOnce();
  });
});
