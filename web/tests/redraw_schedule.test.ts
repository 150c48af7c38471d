import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { RedrawSchedule } from "../src/frames/redraw_schedule";

beforeEach(() => {
  vi.useFakeTimers();
  vi.stubGlobal("requestAnimationFrame", (draw: (time: number) => void) => setTimeout(() => draw(0), 16));
});

afterEach(() => {
  vi.unstubAllGlobals();
  vi.useRealTimers();
});

function schedule(): { redraws: RedrawSchedule; times: () => number } {
  const redraw = vi.fn();
  return { redraws: new RedrawSchedule(redraw), times: () => redraw.mock.calls.length };
}

it("redraws once a frame, however often a redraw is requested", () => {
  const { redraws, times } = schedule();
  redraws.request();
  redraws.request();
  vi.advanceTimersByTime(20);
  expect(times()).toBe(1);
  redraws.request();
  vi.advanceTimersByTime(20);
  expect(times()).toBe(2);
});

it("redraws at the end of a wait in which nothing else was drawn", () => {
  const { redraws, times } = schedule();
  redraws.requestWithin(150);
  vi.advanceTimersByTime(100);
  redraws.requestWithin(150); // the first wait counts
  expect(times()).toBe(0);
  vi.advanceTimersByTime(70);
  expect(times()).toBe(1);
  vi.advanceTimersByTime(300);
  expect(times()).toBe(1);
});

it("leaves a redraw that waits to one that is requested before", () => {
  const { redraws, times } = schedule();
  redraws.requestWithin(150);
  vi.advanceTimersByTime(50);
  redraws.request();
  redraws.requestWithin(150);
  vi.advanceTimersByTime(400);
  expect(times()).toBe(1);
});
