import { afterEach, describe, expect, it, vi } from "vitest";
import { OutOfMemory } from "../src/field/gl";
import { PageScene } from "../src/frames/page_scene";
import { fakeDrawer, stubField } from "./fake_drawer";
import { EDITS } from "./headers";

afterEach(() => vi.unstubAllGlobals());

function pageScene() {
  const fetch = stubField();
  const { drawer, asDrawer, arrive } = fakeDrawer();
  const events = { changed: vi.fn(), progressed: vi.fn(), failed: vi.fn() };
  const createDrawer = vi.fn(() => asDrawer);
  const scene = new PageScene(createDrawer, events);
  const load = async (name: string, page: number): Promise<void> => {
    const before = drawer.load.mock.calls.length;
    scene.load(name, page);
    await vi.waitFor(() => expect(drawer.load.mock.calls.length).toBe(before + 1));
  };
  const take = async (revision: number): Promise<string | null> =>
    new Promise((resolve) => scene.take({ ...EDITS, revision }, new ArrayBuffer(1), resolve));
  return { scene, drawer, events, fetch, createDrawer, arrive, load, take };
}

describe("the scene on the page's GPU", () => {
  it("can be drawn from its first level on", async () => {
    const { scene, events, arrive, load, createDrawer } = pageScene();
    expect([scene.requested, scene.drawer]).toEqual([false, null]);
    await load("a", 1);
    expect(createDrawer.mock.calls).toEqual([["voxels"]]);
    expect([scene.requested, scene.obstacle]).toEqual([true, "the field is being loaded"]);
    arrive(false);
    expect([scene.obstacle, scene.loads]).toEqual([null, 1]);
    expect(events.changed).toHaveBeenCalledOnce();
  });

  it("is loaded once by name, also for a page with another number", async () => {
    const { scene, fetch, load, createDrawer } = pageScene();
    await load("a", 1);
    scene.load("a", 1);
    scene.load("a", 2);
    expect(fetch).toHaveBeenCalledOnce();
    await load("b", 2);
    expect([fetch.mock.calls.length, createDrawer.mock.calls.length]).toEqual([2, 1]);
  });

  it("is loaded again after a failure by a page with another number alone", async () => {
    const { scene, fetch, load, drawer } = pageScene();
    drawer.load.mockRejectedValueOnce(new Error("broken file"));
    await load("a", 1);
    await vi.waitFor(() => expect(scene.obstacle).toBe("broken file"));
    scene.load("a", 1);
    expect(fetch).toHaveBeenCalledOnce();
    await load("a", 2);
    expect(fetch).toHaveBeenCalledTimes(2);
  });

  it("reports a GPU without memory for it", async () => {
    const { drawer, events, load } = pageScene();
    drawer.load.mockRejectedValueOnce(new OutOfMemory());
    await load("a", 1);
    await vi.waitFor(() => expect(events.failed).toHaveBeenCalledOnce());
  });

  it("applies edits in order, each decoded with those before it", async () => {
    const { scene, drawer, load, arrive, take } = pageScene();
    expect(await take(1)).toBe("the field is not loaded yet");
    await load("a", 1);
    arrive(true);
    expect(await Promise.all([take(2), take(3)])).toEqual([null, null]);
    expect(drawer.readEdits.mock.calls[0][1]).toBeNull();
    expect(drawer.readEdits.mock.calls[1][1]).toBe(drawer.setEdits.mock.calls.at(-2)?.[0]);
    expect(scene.edits?.header.revision).toBe(3);
    drawer.readEdits.mockRejectedValueOnce(new Error("a gap"));
    expect(await take(4)).toBe("a gap");
    expect(scene.edits?.header.revision).toBe(3);
  });

  it("loses its edits and its renderer when it is disposed of", async () => {
    const { scene, drawer, load, arrive, take } = pageScene();
    await load("a", 1);
    arrive(true);
    await take(2);
    scene.dispose();
    expect([scene.edits, scene.drawer, scene.requested]).toEqual([null, null, false]);
    expect(drawer.dispose).toHaveBeenCalledOnce();
  });
});
