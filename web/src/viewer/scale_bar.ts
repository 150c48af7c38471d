/** Scale bar: a round length in meters at the distance of the orbit's center. */
import { length, subtract } from "./vectors";
import type { Vec3 } from "./vectors";

const MAX_PIXELS = 140;
const UNITS: [string, number][] = [
  ["km", 1000],
  ["m", 1],
  ["cm", 0.01],
  ["mm", 0.001],
];

/** The longest round length (1, 2 or 5 times a power of ten) of at most MAX_PIXELS, and its pixels. */
export function roundLength(metersPerPixel: number): { label: string; pixels: number } {
  const most = MAX_PIXELS * metersPerPixel;
  const power = 10 ** Math.floor(Math.log10(most));
  const meters = power * (most / power >= 5 ? 5 : most / power >= 2 ? 2 : 1);
  const [unit, size] = UNITS.find(([, one]) => meters >= one * (1 - 1e-9)) ?? UNITS[UNITS.length - 1];
  return { label: `${Number((meters / size).toPrecision(6))} ${unit}`, pixels: meters / metersPerPixel };
}

/** Sizes the bar for a camera; `focal` in CSS pixels. */
export function showScale(
  bar: HTMLElement,
  orbit: { readonly eye: Vec3; readonly target: Vec3 },
  focal: number,
  metersPerUnit: number,
): void {
  const distance = length(subtract(orbit.eye, orbit.target));
  const { label, pixels } = roundLength((metersPerUnit * distance) / focal);
  bar.style.width = `${pixels}px`;
  bar.textContent = label;
  bar.hidden = false;
}
