import { expect, test } from "vitest";
import { placeAt } from "../src/viewer/camera_path";
import { poseBetween } from "../src/viewer/flight";
import { projectPoint } from "../src/viewer/hotspots";
import { roundLength } from "../src/viewer/scale_bar";

const UP: [number, number, number] = [0, 0, 1];

test("a flight turns evenly about the target", () => {
  const one = { eye: [2, 0, 0] as [number, number, number], target: UP, fov_y_deg: 40 };
  const from = { ...one, target: [0, 0, 0] as [number, number, number] };
  const to = { eye: [0, 8, 0] as [number, number, number], target: from.target, fov_y_deg: 60 };
  expect(poseBetween(from, to, 0, UP).eye).toEqual([2, 0, 0]);
  const middle = poseBetween(from, to, 0.5, UP);
  middle.eye.forEach((value, k) => expect(value).toBeCloseTo([4 / Math.SQRT2, 4 / Math.SQRT2, 0][k], 12));
  expect(middle.fov_y_deg).toBe(50);
  // Opposite directions turn about the vertical.
  const back = { ...to, eye: [-2, 0, 0] as [number, number, number] };
  poseBetween(from, back, 0.5, UP).eye.forEach((value, k) => expect(value).toBeCloseTo([0, 2, 0][k], 12));
});

test("a mark is seen before a surface and hidden behind it", () => {
  const canvas = { clientWidth: 200, clientHeight: 100 } as HTMLCanvasElement;
  // At the origin, looking along -z.
  const orbit = {
    eye: [0, 0, 0] as [number, number, number],
    c2w: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1],
  };
  const at = (surface: number, point: [number, number, number]): ReturnType<typeof projectPoint> =>
    projectPoint(
      {
        canvas,
        orbit,
        focal: 100,
        extent: 1,
        distances: { width: 2, height: 1, values: new Float32Array([surface, Infinity]) },
      },
      point,
    );
  expect(at(4, [-1, 0.5, -2])).toEqual({ x: 50, y: 25, seen: true });
  expect(at(1, [-1, 0.5, -2]).seen).toBe(false);
  expect(at(1, [1, 0.5, -2]).seen).toBe(true);
  expect(at(Infinity, [0, 0, 2]).seen).toBe(false);
  expect(at(Infinity, [3, 0, -2]).seen).toBe(false);
});

test("a mark goes with its part along the path, and is hidden where that is not there", () => {
  const still = { c2w: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1], fov_y_deg: 40 };
  const path = { stills: [still, still, still], seconds: 2, loop: false };
  const places: ([number, number, number] | null)[] = [null, [1, 0, 0], [3, 0, 2]];
  expect(placeAt(places, path, 0)).toBeNull();
  expect(placeAt(places, path, 0.5)).toBeNull();
  expect(placeAt(places, path, 1)).toEqual([1, 0, 0]);
  expect(placeAt(places, path, 1.5)).toEqual([2, 0, 1]);
  expect(placeAt(places, path, 9)).toEqual([3, 0, 2]);
  // Round a loop, between the last still and the first.
  expect(
    placeAt(
      [
        [0, 0, 0],
        [1, 0, 0],
        [4, 0, 0],
      ],
      { ...path, loop: true, seconds: 3 },
      2.5,
    ),
  ).toEqual([2, 0, 0]);
});

test("the scale bar has a round length", () => {
  expect(roundLength(0.01)).toEqual({ label: "1 m", pixels: 100 });
  expect(roundLength(0.02)).toEqual({ label: "2 m", pixels: 100 });
  expect(roundLength(0.0004).label).toBe("5 cm");
  expect(roundLength(12).label).toBe("1 km");
});
