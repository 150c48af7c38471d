import { describe, expect, it } from "vitest";
import { Drag } from "../src/editing/drag";
import type { TranslateBy, Vec3 } from "../src/net/protocol";
import { box, expectClose } from "./cages";
import { FakeServer, edit } from "./fake_server";

const by = (x: number): { kind: "translate"; by: Vec3 } => ({ kind: "translate", by: [x, 0, 0] });

function begin(
  target: "field" | "inner" | "outer" | "both" = "field",
  change = {},
): { server: FakeServer; drag: Drag } {
  const server = new FakeServer();
  return { server, drag: new Drag(4, edit(change), target, server.take) };
}

describe("a drag", () => {
  it("moves the lines before the server has answered, and says what it does", () => {
    const { server, drag } = begin();
    drag.move(by(0.2));
    drag.move(by(0.3));
    expectClose(drag.shown.deformed.corners[0], [0, -0.3, -0.3]);
    expectClose(drag.shown.inner.corners[0], [-0.3, -0.3, -0.3]);
    expect(server.got.map((message) => message.type)).toEqual(["drag_begin", "drag", "drag"]);
    expect(server.last).toMatchObject({ drag: 4, seq: 2, operation: by(0.3) });
  });

  it("stops at the outer cage in the same frame, and says so", () => {
    const { drag } = begin();
    drag.move(by(1));
    expect(drag.shown.deformed.corners[1][0]).toBeCloseTo(0.8, 2);
    expect((drag.followed as TranslateBy).by[0]).toBeCloseTo(0.5, 2);
    expect(drag.why).toMatch(/outer cage/);
    drag.move(by(0.4));
    expect(drag.why).toBeNull();
  });

  it("is not confined where it is discrete, or in Set mode", () => {
    for (const { drag } of [begin("field", { kind: "move" }), begin("outer"), begin("both")]) {
      drag.move(by(1));
      expect(drag.why).toBeNull();
    }
  });

  it("takes the server's corners over, and expects the same limit of the next move", () => {
    const { server, drag } = begin();
    drag.move(by(0.4));
    drag.takeAnswer(server.answer(0.5, box([0.2, 0, 0], [0.6, 0.6, 0.6]), "the shell folds"));
    expectClose(drag.shown.deformed.corners[0], [-0.1, -0.3, -0.3]);
    expectClose(drag.shown.deformed.pivot, [0.2, 0, 0]);
    expect(drag.why).toBe("the shell folds");
    drag.move(by(0.44));
    expect(drag.shown.deformed.corners[0][0]).toBeCloseTo(-0.1, 9);
    drag.move(by(0.1));
    expect(drag.why).toBeNull();
  });

  it("does not go back to an older answer", () => {
    const { server, drag } = begin();
    drag.move(by(0.1));
    const older = server.answer(1, box([0.1, 0, 0], [0.6, 0.6, 0.6]), null);
    drag.move(by(0.2));
    drag.takeAnswer(older);
    expectClose(drag.shown.deformed.corners[0], [-0.1, -0.3, -0.3]);
  });

  it("ends with its last operation, and as nothing where nothing moved", () => {
    const moved = begin();
    moved.drag.move(by(0.2));
    moved.drag.end();
    expect(moved.server.last).toEqual({ type: "drag_end", drag: 4, seq: 1, operation: by(0.2) });
    const idle = begin();
    idle.drag.end();
    expect(idle.server.last).toEqual({ type: "drag_cancel", drag: 4 });
  });

  it("leaves everything as it was when it is cancelled", () => {
    const { server, drag } = begin();
    drag.move(by(0.2));
    drag.cancel();
    drag.move(by(0.3));
    expect(drag.shown).toBe(drag.start);
    expect(server.last).toEqual({ type: "drag_cancel", drag: 4 });
  });

  it("of both cages turns both about the inner cage's pivot", () => {
    const { drag } = begin("both", { outer: box([1, 0, 0], [4, 4, 4]), outer_pivot: [1, 0, 0] });
    drag.move({ kind: "rotate", rotation_deg: [0, 0, 90], axes: "world" });
    expectClose(drag.shown.outer!.corners[0], [2, -1, -2]);
    expectClose(drag.shown.inner.corners[0], [0.3, -0.3, -0.3]);
  });

  it("of the inner cage in Set mode takes the deformed one along only while there are no operations", () => {
    const fresh = begin("inner");
    fresh.drag.move(by(0.1));
    expectClose(fresh.drag.shown.deformed.corners[0], [-0.2, -0.3, -0.3]);
    const edited = begin("inner", { operations: ["translation"] });
    edited.drag.move(by(0.1));
    expectClose(edited.drag.shown.deformed.corners[0], [-0.3, -0.3, -0.3]);
  });
});
