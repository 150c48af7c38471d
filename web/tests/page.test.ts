import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { Connection, socketAddress, type Handlers, type Socket } from "../src/net/connection";
import { MOUSE_BINDINGS, bindings, keyName } from "../src/editing/keys";
import { Latency } from "../src/frames/latency";
import { cageOverlay } from "../src/editing/cage_overlay";
import {
  READ_ONLY_NOTICE,
  INITIAL,
  Store,
  preparationText,
  canFill,
  maySend,
  dragObstacle,
  canRelight,
  selectedEdit,
  dragTarget,
} from "../src/app/store";
import { Actions } from "../src/editing/actions";
import type { App } from "../src/app/app";
import type { Pointer } from "../src/editing/pointer";
import type { Hello, PageMessage, Preview } from "../src/net/protocol";
import { edit, state } from "./fake_server";

describe("the connection", () => {
  beforeEach(() => vi.useFakeTimers());
  afterEach(() => vi.useRealTimers());

  it("opens again, ever more patiently, and at once after it had been open", () => {
    const sockets: (Socket & { sent: string[] })[] = [];
    const waits: number[] = [];
    const handlers: Handlers = {
      opened: vi.fn(),
      lost: (wait) => waits.push(wait),
      message: vi.fn(),
      binary: vi.fn(),
    };
    const connection = new Connection(() => {
      const sent: string[] = [];
      const socket = {
        binaryType: "blob" as BinaryType,
        readyState: 1,
        onopen: null,
        onclose: null,
        onmessage: null,
        sent,
        send: (text: string) => void sent.push(text),
      };
      sockets.push(socket);
      return socket;
    }, handlers);
    const close = (): void => {
      const socket = sockets[sockets.length - 1];
      (socket.onclose as unknown as () => void)();
    };
    close();
    expect(connection.send({ type: "presented", picture: 1 })).toBe(false);
    vi.advanceTimersByTime(250);
    close();
    vi.advanceTimersByTime(499);
    expect(sockets).toHaveLength(2);
    vi.advanceTimersByTime(1);
    expect(sockets).toHaveLength(3);
    (sockets[2].onopen as unknown as () => void)();
    expect(connection.send({ type: "presented", picture: 1 })).toBe(true);
    expect(sockets[2].sent).toEqual(['{"type":"presented","picture":1}']);
    close();
    expect(waits).toEqual([250, 500, 250]);
  });

  it("keeps the link's token", () => {
    const page = new URL("http://host:8000/?token=abc#x") as unknown as Location;
    expect(socketAddress(page)).toBe("ws://host:8000/socket?token=abc");
  });
});

describe("the store", () => {
  it("tells of changes only", () => {
    const store = new Store();
    const heard = vi.fn();
    store.watch(["tool"], heard);
    store.set({ tool: "rotate" });
    store.set({ tool: "rotate", mode: "set" });
    expect(heard).toHaveBeenCalledTimes(2);
  });

  it("knows what a drag moves", () => {
    const now = { ...INITIAL, state: state() };
    expect(selectedEdit(now)?.id).toBe(1);
    expect(dragTarget(now)).toBe("field");
    expect(dragTarget({ ...now, mode: "set", cage: "both" })).toBe("both");
    expect(
      dragTarget({ ...now, mode: "set", cage: "outer", state: state({ edits: [edit({ outer: null })] }) }),
    ).toBe("inner");
  });

  it("says what whole pictures wait for", () => {
    const preparing = { type: "preparing", done: 0, of: 4 } as const;
    const quick = { ...INITIAL.figures, width: 200, final: false };
    const filled = state({ edits: [edit({ fill: "surroundings" })] });
    const plain = state({ edits: [edit({ fill: "none", relight: "none" })] });
    expect(preparationText({ ...INITIAL, preparing, state: filled })).toContain("Preparing the renderer 1/4");
    expect(preparationText({ ...INITIAL, preparing, state: filled, figures: quick })).toContain(
      "Computing fill and light",
    );
    expect(preparationText({ ...INITIAL, preparing, state: plain, figures: quick })).toContain(
      "Preparing the renderer 1/4",
    );
    expect(
      preparationText({ ...INITIAL, preparing, state: filled, figures: { ...quick, final: true } }),
    ).toContain("Preparing");
    expect(
      preparationText({ ...INITIAL, preparing: { ...preparing, done: 4 }, state: filled, figures: quick }),
    ).toBeNull();
    expect(preparationText(INITIAL)).toBeNull();
  });

  it("knows what can be filled, and what light can go along with", () => {
    const hello = { splats: false } as Hello;
    const kinds = (["continuous", "move", "copy", "delete"] as const).map((kind) => {
      const now = { ...INITIAL, hello, state: state({ edits: [edit({ kind })] }) };
      return [canFill(now), canRelight(now)];
    });
    expect(kinds).toEqual([
      [false, true],
      [true, true],
      [false, true],
      [true, true],
    ]);
    const splats = {
      ...INITIAL,
      hello: { splats: true } as Hello,
      state: state({ edits: [edit({ kind: "delete" })] }),
    };
    expect([canFill(splats), canRelight(splats)]).toEqual([true, true]);
    expect([canFill(INITIAL), canRelight(INITIAL)]).toEqual([false, false]);
  });

  it("knows what a page may say that may look alone", () => {
    const looker = { ...INITIAL, hello: { read_only: true } as Hello };
    const question = { type: "ask", request: 1, what: "path" } as PageMessage;
    const change = { type: "change", edit: 1, name: "mine" } as PageMessage;
    expect([maySend(looker, question), maySend(looker, change)]).toEqual([true, false]);
    expect([maySend(INITIAL, question), maySend(INITIAL, change)]).toEqual([true, true]);
    expect(dragObstacle(looker, edit())).toBe(READ_ONLY_NOTICE);
  });

  it("says why an edit cannot be dragged", () => {
    expect(dragObstacle(INITIAL, edit())).toBeNull();
    expect(dragObstacle(INITIAL, edit({ locked: true }))).toMatch(/locked/);
    expect(dragObstacle({ ...INITIAL, mode: "set" }, edit({ enabled: false }))).toMatch(/hidden/);
    expect(dragObstacle(INITIAL, edit({ kind: "delete" }))).toMatch(/nothing to move/);
    expect(dragObstacle({ ...INITIAL, mode: "set" }, edit({ kind: "delete" }))).toBeNull();
  });
});

describe("what is drawn", () => {
  const eye: [number, number, number] = [0, -5, 0];
  const forward: [number, number, number] = [0, 1, 0];
  it("is both cages of the selected edit, with a dot on each corner and on faces that look this way", () => {
    const { segments, dots } = cageOverlay({ ...INITIAL, state: state() }, null, [], eye, forward);
    expect(segments).toHaveLength(24);
    expect(dots.filter((dot) => dot.shape === "round")).toHaveLength(8);
    expect(dots.filter((dot) => dot.shape === "square")).toHaveLength(1);
  });

  it("is where the inner cage was, too, once it has moved; and both cages' handles in Set mode", () => {
    const moved = edit({ deformed: edit().inner.map(([x, y, z]) => [x + 0.1, y, z]) as never });
    expect(
      cageOverlay({ ...INITIAL, state: state({ edits: [moved] }) }, null, [], eye, forward).segments,
    ).toHaveLength(36);
    expect(
      cageOverlay({ ...INITIAL, state: state(), mode: "set" }, null, [], eye, forward).dots,
    ).toHaveLength(18);
  });

  it("has the other edits in their colors, hidden ones not, and nothing where cages are off or a page plays", () => {
    const edits = [edit(), edit({ id: 2, color: "#ff0000" }), edit({ id: 3, enabled: false })];
    const { segments } = cageOverlay({ ...INITIAL, state: state({ edits }) }, null, [], eye, forward);
    expect(segments).toHaveLength(48);
    expect(segments.filter(({ srgbColor: color }) => color.r > 0.99 && color.g < 0.01)).toHaveLength(24);
    expect(
      cageOverlay({ ...INITIAL, state: state({ edits }), cages: false }, null, [], eye, forward).segments,
    ).toHaveLength(0);
    const preview: Preview = { type: "preview", page: 1, play: 1, on: true };
    expect(
      cageOverlay({ ...INITIAL, state: state({ edits }), preview }, null, [], eye, forward).segments,
    ).toHaveLength(0);
  });

  it("has no handles where the edit is locked", () => {
    expect(
      cageOverlay({ ...INITIAL, state: state({ edits: [edit({ locked: true })] }) }, null, [], eye, forward)
        .dots,
    ).toHaveLength(0);
  });
});

describe("keys", () => {
  const nobody: unknown = {};
  const noRegions = { cancel: () => false };
  it("each mean one thing, and all that the editor needs is there", () => {
    const all = bindings(nobody as App, nobody as Actions, nobody as Pointer, noRegions, {
      saveAs: vi.fn(),
      paste: vi.fn(),
    }).flatMap((binding) => binding.keys);
    expect(new Set(all).size).toBe(all.length);
    for (const key of [
      "1",
      "2",
      "3",
      "G",
      "R",
      "S",
      "F",
      "H",
      "D",
      "Tab",
      "Delete",
      "Escape",
      "Ctrl+Z",
      "Ctrl+Shift+Z",
      "Ctrl+S",
      "Ctrl+C",
      "?",
    ]) {
      expect(all).toContain(key);
    }
    for (const { keys } of MOUSE_BINDINGS) for (const key of keys) expect(all).not.toContain(key);
  });

  it("switch what is filled, and whether shadows go along, where there is such a thing", () => {
    const store = new Store();
    const app = { store, send: vi.fn(), say: vi.fn() };
    const all = bindings(
      app as unknown as App,
      new Actions(app as unknown as App),
      nobody as Pointer,
      noRegions,
      {
        saveAs: vi.fn(),
        paste: vi.fn(),
      },
    );
    const press = (key: string): void => all.find(({ keys }) => keys.includes(key))!.run();
    store.set({ state: state({ edits: [edit({ kind: "move" })] }) });
    press("U");
    expect(app.send).toHaveBeenLastCalledWith({ type: "change", edit: 1, fill: "none" });
    press("Shift+U");
    expect(app.send).toHaveBeenLastCalledWith({ type: "change", edit: 1, relight: "none" });
    store.set({ state: state({ edits: [edit({ kind: "copy", fill: "none", relight: "none" })] }) });
    press("Shift+U");
    expect(app.send).toHaveBeenLastCalledWith({ type: "change", edit: 1, relight: "occlusion" });
    expect(app.say).not.toHaveBeenCalled();
    press("U");
    expect(app.say).toHaveBeenCalledOnce();
    expect(app.send).toHaveBeenCalledTimes(3);
  });

  it("ask what to paste from another scene, and what is pasted stays a copy", () => {
    const store = new Store({ state: state({ edits: [edit({ kind: "copy", source: "/root/chair" })] }) });
    const app = { store, send: vi.fn(), say: vi.fn() };
    const questions = { saveAs: vi.fn(), paste: vi.fn() };
    const all = bindings(
      app as unknown as App,
      new Actions(app as unknown as App),
      nobody as Pointer,
      noRegions,
      questions,
    );
    const press = (key: string): void => all.find(({ keys }) => keys.includes(key))!.run();
    press("Shift+V");
    expect(questions.paste).toHaveBeenCalledOnce();
    press("D");
    expect(app.send).not.toHaveBeenCalled();
    expect(app.say).toHaveBeenCalledOnce();
  });

  it("are named as they are shown", () => {
    const key = (name: string, control = false, shift = false): string =>
      keyName({ key: name, ctrlKey: control, metaKey: false, shiftKey: shift });
    expect(key("z", true)).toBe("Ctrl+Z");
    expect(key("Z", true, true)).toBe("Ctrl+Shift+Z");
    expect(key("?", false, true)).toBe("?");
    expect(key("Tab")).toBe("Tab");
    expect(key("g")).toBe("G");
    expect(key("+", true)).toBe("Ctrl++");
    const alt = { key: "å", code: "KeyA", altKey: true, ctrlKey: false, metaKey: false, shiftKey: false };
    expect(keyName(alt)).toBe("Alt+A");
  });
});

describe("latency", () => {
  it("goes from the mouse's move to the picture that shows it", () => {
    const latency = new Latency();
    latency.addMove(1, 1, 100);
    latency.addMove(1, 2, 110);
    latency.finishLines(116);
    const picture = {
      time: 180,
      drag: 1,
      seq: 2,
      camera: 1,
      revision: 1,
      width: 100,
      fullWidth: 100,
      whole: false,
      final: false,
    };
    latency.addPresented(picture, 150, 160, 20, 2);
    latency.addPresented({ ...picture, time: 999 }, 150, 160, 20, 2);
    expect(latency.moves[0]).toMatchObject({ lines: 116, presented: null });
    expect(latency.moves[1]).toMatchObject({
      lines: 116,
      received: 150,
      decoded: 160,
      presented: 180,
      renderMs: 20,
    });
  });

  it("counts pictures a second", () => {
    const latency = new Latency();
    for (let time = 0; time <= 1000; time += 100) {
      latency.addPresented(
        { time, drag: 0, seq: 0, camera: 1, revision: 1, width: 1, fullWidth: 1, whole: false, final: false },
        0,
        0,
        0,
        0,
      );
    }
    expect(latency.frameRate(1000)).toBeCloseTo(10, 6);
    expect(latency.frameRate(5000)).toBe(0);
  });
});
