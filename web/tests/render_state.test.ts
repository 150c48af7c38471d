import { describe, expect, it } from "vitest";
import { drawnHere, IDLE, nextState, reasonOf } from "../src/frames/render_state";
import type { RenderFacts, RenderState } from "../src/frames/render_state";

const FACTS: RenderFacts = { connected: true, pictured: 1, requested: true, drawable: true, drawsAll: true };

describe("the state of the page's rendering", () => {
  it("goes from idle by loading and moving to all, and back", () => {
    const name = (facts: Partial<RenderFacts>): string => nextState(IDLE, { ...FACTS, ...facts }).name;
    expect(name({ requested: false })).toBe("idle");
    expect(name({ drawable: false })).toBe("loading");
    expect(name({ drawsAll: false })).toBe("moving");
    expect(name({})).toBe("all");
    expect(nextState({ name: "all" }, { ...FACTS, connected: false }).name).toBe("idle");
  });

  it("stays closed, whatever follows", () => {
    const closed: RenderState = { name: "closed", why: "no GPU" };
    expect(nextState(closed, FACTS)).toBe(closed);
    expect(nextState(closed, { ...FACTS, connected: false })).toBe(closed);
    expect([drawnHere(closed), reasonOf(closed)]).toEqual(["nothing", "no GPU"]);
  });

  it("stays refused until the server's edits are others", () => {
    const refused: RenderState = { name: "refused", why: "too many edits", pictured: 1 };
    expect(nextState(refused, FACTS)).toBe(refused);
    expect(nextState(refused, { ...FACTS, connected: false, pictured: 2 })).toBe(refused);
    expect(nextState(refused, { ...FACTS, pictured: 2 })).toEqual({ name: "all" });
    expect([drawnHere(refused), reasonOf(refused)]).toEqual(["nothing", "too many edits"]);
  });

  it("draws moving frames, or all", () => {
    expect([drawnHere(IDLE), drawnHere({ name: "loading" })]).toEqual(["nothing", "nothing"]);
    expect([drawnHere({ name: "moving" }), drawnHere({ name: "all" })]).toEqual(["moving", "all"]);
    expect(reasonOf({ name: "all" })).toBeNull();
  });
});
