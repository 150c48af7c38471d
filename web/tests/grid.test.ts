import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { cagesOf } from "../src/editing/drag";
import { Grid } from "../src/editing/grid";
import { apply } from "../src/editing/operations";
import type { Answer, Vec3 } from "../src/net/protocol";
import { edit } from "./fake_server";

beforeEach(() => vi.useFakeTimers());
afterEach(() => vi.useRealTimers());

const LINE: Vec3[][] = [
  [
    [0, 0, 0],
    [1, 0, 0],
  ],
];

function answer(grid: Vec3[][]): Answer {
  return {
    type: "answer",
    request: 1,
    point: null,
    normal: null,
    text: null,
    grid,
    stills: [],
    sources: [],
    tracks: [],
    histogram: null,
    failed: false,
  };
}

function moved(by: number): ReturnType<typeof cagesOf> {
  const cages = cagesOf(edit());
  return { ...cages, deformed: apply({ kind: "translate", by: [by, 0, 0] }, cages.deformed) };
}

it("asks one question at a time, and keeps the old lines until there are new ones", async () => {
  const waiting: ((found: Answer | null) => void)[] = [];
  const grid = new Grid(() => new Promise((resolve) => waiting.push(resolve)), vi.fn());
  expect(grid.linesFor(edit(), moved(0))).toEqual([]);
  for (const by of [0.1, 0.2, 0.3]) grid.linesFor(edit(), moved(by));
  expect(waiting).toHaveLength(1);
  waiting[0](answer(LINE));
  await vi.advanceTimersByTimeAsync(0);
  expect(grid.linesFor(edit(), moved(0.3))).toEqual(LINE);
  expect(waiting).toHaveLength(1);
  await vi.advanceTimersByTimeAsync(200);
  expect(grid.linesFor(edit(), moved(0.3))).toEqual(LINE);
  expect(waiting).toHaveLength(2);
  waiting[1](null);
  await vi.advanceTimersByTimeAsync(200);
  expect(grid.linesFor(edit(), moved(0.3))).toEqual(LINE);
  expect(waiting).toHaveLength(2);
});

it("shows no other edit's lines, and none of what has no shell", async () => {
  const grid = new Grid(() => Promise.resolve(answer(LINE)), vi.fn());
  grid.linesFor(edit(), moved(0));
  await vi.advanceTimersByTimeAsync(200);
  expect(grid.linesFor(edit(), moved(0))).toEqual(LINE);
  expect(grid.linesFor(edit({ kind: "copy" }), moved(0))).toEqual([]);
  expect(grid.linesFor(edit({ id: 2 }), moved(0))).toEqual([]);
});
