import { vi } from "vitest";
import type { LoadOptions, SceneDrawer } from "../src/field/scene_drawer";

/** A renderer without a GPU: a test calls `arrive` in place of the arrival of a level. */
export function fakeDrawer() {
  let options: LoadOptions = {};
  const drawer = {
    background: [0, 0, 0],
    edited: true,
    onOrder: null,
    level: null as { field: { background: null }; last: boolean } | null,
    inBands: false,
    inOrder: true,
    editable: true,
    compiled: 0,
    uploaded: { last: 0, total: 0 },
    setSize: vi.fn(),
    setCamera: vi.fn(),
    load: vi.fn((_source: unknown, given: LoadOptions) => {
      options = given;
      return Promise.resolve();
    }),
    restore: vi.fn(() => Promise.resolve()),
    readEdits: vi.fn((file: ArrayBuffer, before: unknown) => Promise.resolve({ file, before } as unknown)),
    prepare: vi.fn(() => Promise.resolve()),
    setEdits: vi.fn(),
    render: vi.fn(() => true),
    show: vi.fn(),
    distances: vi.fn(() => ({})),
    wait: vi.fn(),
    dispose: vi.fn(),
  };
  const arrive = (last: boolean): void => {
    drawer.level = { field: { background: null }, last };
    options.onLevel?.(last ? 2 : 1, 2);
  };
  return { drawer, asDrawer: drawer as unknown as SceneDrawer, arrive };
}

/** Answers every fetch with the first bytes of a scene file of voxels; returns the mock. */
export function stubField() {
  const fetch = vi.fn(() => Promise.resolve(new Response("cagepage with more bytes")));
  vi.stubGlobal("fetch", fetch);
  vi.stubGlobal("location", { search: "?token=1" });
  return fetch;
}
