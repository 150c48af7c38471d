/** Scale in meters and up direction of the scene. */
import { Compass, Landmark, Ruler, Undo2 } from "lucide";
import type { Actions } from "../editing/actions";
import { roundDecimals } from "../editing/operations";
import type { App } from "../app/app";
import type { State } from "../net/protocol";
import { h, iconButton, section } from "./dom";

export function alignmentPanel(app: App, actions: Actions): HTMLElement {
  const scale = h("div", { class: "quiet scale" });
  const up = h("div", { class: "quiet up-direction" });
  const measure = iconButton(
    Ruler,
    "Scale: measure between two points (Shift+M)",
    () => actions.toggleMeasuring(),
    "scale-measure",
  );
  const points = iconButton(
    Compass,
    "Up: three points of something level (Shift+Y)",
    () => actions.togglePicking("up"),
    "up-points",
  );
  const floor = iconButton(
    Landmark,
    "Up: the floor, the largest plane that is nearly level",
    () => app.send({ type: "up_change", by: "floor" }),
    "up-floor",
  );
  const cameras = iconButton(
    Undo2,
    "Up as the cameras have it",
    () => app.send({ type: "up_change", by: "cameras" }),
    "up-cameras",
  );
  app.store.watch(["state", "measured", "picked"], ({ state, measured, picked }) => {
    scale.textContent = scaleText(state);
    up.textContent = upText(state);
    cameras.disabled = state?.up == null;
    measure.classList.toggle("on", measured !== null);
    points.classList.toggle("on", picked?.purpose === "up");
  });
  return section("Scale and up", h("div", { class: "bar" }, measure, points, floor, cameras), scale, up);
}

function scaleText(state: State | null): string {
  const meters = state?.meters_per_unit ?? null;
  return meters === null
    ? "Scale: units of the capture"
    : `Scale: ${Number(meters.toPrecision(4))} m per unit`;
}

function upText(state: State | null): string {
  const up = state?.up ?? null;
  if (up === null) return "Up: as the cameras have it";
  return `Up: (${up.map((value) => roundDecimals(value, 3)).join(", ")})`;
}
