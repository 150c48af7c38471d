import { afterEach, describe, expect, it, vi } from "vitest";
import { Actions } from "../src/editing/actions";
import { Store } from "../src/app/store";
import { isSplatFile, uploadAddress, uploadFile, type Request } from "../src/net/upload";
import type { App } from "../src/app/app";
import { state } from "./fake_server";

/** A request that a test answers. */
function fakeRequest(): Request & { sent: unknown[]; address: string } {
  const request = {
    status: 0,
    responseText: "",
    onload: null,
    onerror: null,
    upload: { onprogress: null },
    sent: [] as unknown[],
    address: "",
    open: (method: string, address: string) => void (request.address = `${method} ${address}`),
    send: (body: unknown) => void request.sent.push(body),
  };
  return request;
}

describe("files of splats", () => {
  it("are known by their names", () => {
    expect(
      ["a.PLY", "b.compressed.ply", "c.spz", "d.sog", "e.splat", "f.ksplat", "g.glb"].every(isSplatFile),
    ).toBe(true);
    expect(["edits.yaml", "ply", "a.plyx", "camera_path.json"].some(isSplatFile)).toBe(false);
  });

  it("are sent to the page's own server, with its token", () => {
    const page = new URL("http://host:8000/?token=abc#x") as unknown as Location;
    expect(uploadAddress(page, "my bike&co.ply")).toBe(
      "http://host:8000/open?token=abc&name=my+bike%26co.ply",
    );
  });

  it("tell how far they are, and what the server says", async () => {
    const request = fakeRequest();
    const file = new File(["ply"], "a.ply");
    const shares: number[] = [];
    const answer = uploadFile(request, file, "http://host/open?name=a.ply", (share) => shares.push(share));
    expect(request.address).toBe("POST http://host/open?name=a.ply");
    expect(request.sent).toEqual([file]);
    const progress = request.upload.onprogress as unknown as (event: {
      loaded: number;
      total: number;
    }) => void;
    progress({ loaded: 1, total: 4 });
    progress({ loaded: 4, total: 4 });
    expect(shares).toEqual([0.25, 1]);
    Object.assign(request, { status: 400, responseText: "a.ply: not a PLY file\n" });
    (request.onload as unknown as () => void)();
    expect(await answer).toBe("a.ply: not a PLY file");
  });

  it("are refused in one line where the server is gone", async () => {
    const request = fakeRequest();
    const answer = uploadFile(request, new File([], "a.ply"), "http://host/open", () => undefined);
    (request.onerror as unknown as () => void)();
    expect(await answer).toMatch(/a\.ply could not be sent/);
  });
});

describe("saving", () => {
  afterEach(() => vi.unstubAllGlobals());

  it("asks for a folder where a file was opened, and does not where a scene was", () => {
    const sent: unknown[] = [];
    const app = {
      store: new Store({ state: state({ is_file: true }) }),
      send: (message: unknown) => sent.push(message),
    };
    const whereTo = vi.fn();
    const actions = new Actions(app as unknown as App, whereTo);
    actions.save();
    expect(whereTo).toHaveBeenCalledOnce();
    expect(sent).toEqual([]);
    app.store.set({ state: state() });
    actions.save();
    expect(sent).toEqual([{ type: "command", name: "save", edit: null }]);
  });
});
