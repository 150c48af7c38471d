import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { Throttle } from "../src/frames/throttle";

describe("values that come often", () => {
  beforeEach(() => vi.useFakeTimers());
  afterEach(() => vi.useRealTimers());

  it("the last one is given on although nothing follows it", () => {
    const given: number[] = [];
    const throttle = new Throttle<number>(300, (value) => given.push(value));
    throttle.put(1, true);
    for (const value of [2, 3, 4]) {
      vi.advanceTimersByTime(20);
      throttle.put(value);
    }
    expect(given).toEqual([1]);
    vi.advanceTimersByTime(239);
    expect(given).toEqual([1]);
    vi.advanceTimersByTime(1);
    expect(given).toEqual([1, 4]);
    vi.advanceTimersByTime(1000);
    expect(given).toEqual([1, 4]);
  });

  it("a stream of them is given on once in so many milliseconds", () => {
    const given: number[] = [];
    const throttle = new Throttle<number>(300, (value) => given.push(value));
    for (let at = 0; at <= 1200; at += 50) {
      throttle.put(at);
      vi.advanceTimersByTime(50);
    }
    expect(given).toEqual([0, 250, 550, 850, 1150]);
  });

  it("what is given on at once takes the place of what waits", () => {
    const given: string[] = [];
    const throttle = new Throttle<string>(300, (value) => given.push(value));
    throttle.put("moving");
    throttle.put("moving still");
    throttle.put("final", true);
    vi.advanceTimersByTime(1000);
    expect(given).toEqual(["moving", "final"]);
  });
});
