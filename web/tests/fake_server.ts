import type { Corners, Dragged, EditState, PageMessage, State } from "../src/net/protocol";
import { box } from "./cages";

/** An edit with concentric boxes of half-size .3 in .8. */
export function edit(change: Partial<EditState> = {}): EditState {
  const inner: Corners = box([0, 0, 0], [0.6, 0.6, 0.6]);
  return {
    id: 1,
    name: "edit 1",
    color: "#4cc2ff",
    enabled: true,
    locked: false,
    kind: "continuous",
    source: null,
    shell: "flow",
    falloff: "smooth",
    width: 1,
    lattice: 0,
    lattice_error: null,
    grade: { exposure: 0, temperature: 0, tint: 0, saturation: 1, hue_deg: 0, opacity: 1 },
    fill: "surroundings",
    relight: "occlusion",
    inner,
    deformed: inner,
    outer: box([0, 0, 0], [1.6, 1.6, 1.6]),
    cage: "box",
    points: null,
    outer_follows: false,
    pivot: [0, 0, 0],
    inner_pivot: [0, 0, 0],
    outer_pivot: [0, 0, 0],
    operations: [],
    parent: null,
    carrier: null,
    problem: null,
    ...change,
  };
}

export function state(change: Partial<State> = {}): State {
  return {
    type: "state",
    revision: 1,
    pictured: 1,
    edits: [edit()],
    selected: 1,
    history: ["Open"],
    entry: 0,
    saved: true,
    path: "scene",
    is_file: false,
    preserve_opacity: false,
    meters_per_unit: null,
    up: null,
    keys: [],
    loop: false,
    hotspots: [],
    selection: null,
    removed: null,
    isolated: false,
    ...change,
  };
}

/** A server that lets translations go half-way, and keeps what it was sent. */
export class FakeServer {
  readonly got: PageMessage[] = [];
  readonly take = (message: PageMessage): boolean => {
    this.got.push(message);
    return true;
  };

  get last(): PageMessage {
    return this.got[this.got.length - 1];
  }

  answer(part: number, deformed: Corners, why: string | null): Dragged {
    const drag = this.got.filter((message) => message.type === "drag").at(-1)!;
    const { inner, outer } = edit();
    const points = { points: [], deformed_points: [], carried: [] };
    return { type: "dragged", drag: drag.drag, seq: drag.seq, part, why, inner, deformed, outer, ...points };
  }
}
