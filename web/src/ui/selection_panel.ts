/** Selected elements of the field: how tools select, actions, floaters, and histograms of attributes. */
import { Pane } from "tweakpane";
import type { Actions } from "../editing/actions";
import type { App } from "../app/app";
import type { SelectMode } from "../app/store";
import { h, section } from "./dom";
import { histogram } from "./histogram";

const MODES = { Replace: "replace", Add: "add", Subtract: "subtract", Intersect: "intersect" };

export function selectionPanel(app: App, actions: Actions): HTMLElement {
  const { store } = app;
  const count = h("p", { class: "empty selected-count" });
  const host = h("div", { class: "pane" });
  const pane = new Pane({ container: host });
  const model = {
    mode: store.now.selectMode as string,
    radius: store.now.brushRadius,
    through: store.now.through,
    depth: store.now.depthTolerance,
    opacity: store.now.floodOpacity,
    reach: store.now.floodReach,
    strength: 0.5,
    margin: 1,
  };
  pane
    .addBinding(model, "mode", { label: "Mode", options: MODES })
    .on("change", ({ value }) => store.set({ selectMode: value as SelectMode }));
  const radius = pane.addBinding(model, "radius", { label: "Brush size", min: 0.005, max: 0.5 });
  radius.on("change", ({ value }) => store.set({ brushRadius: value }));
  pane
    .addBinding(model, "through", { label: "Through all" })
    .on("change", ({ value }) => store.set({ through: value }));
  const depth = pane.addBinding(model, "depth", { label: "Depth, cells", min: 0, max: 20, step: 0.5 });
  depth.on("change", ({ value }) => store.set({ depthTolerance: value }));
  pane
    .addBinding(model, "opacity", { label: "Flood from", min: 0.02, max: 0.98 })
    .on("change", ({ value }) => store.set({ floodOpacity: value }));
  pane
    .addBinding(model, "reach", { label: "Flood reach", min: 0.01, max: 1 })
    .on("change", ({ value }) => store.set({ floodReach: value }));
  pane
    .addBinding(model, "strength", { label: "Floaters", min: 0, max: 1, step: 0.05 })
    .on("change", ({ last }) => {
      if (last) selectFloaters();
    });
  pane.addBinding(model, "margin", { label: "Cells around", min: 0, max: 20, step: 0.5 });

  function selectFloaters(): void {
    app.send({ type: "select_floaters", strength: model.strength });
  }

  const button = (text: string, title: string, name: string, onclick: () => void): HTMLButtonElement =>
    h("button", { type: "button", class: `text ${name}`, title, onclick }, text);
  const needSelected = [
    button("Invert", "Select all others (Ctrl+I)", "invert", () => actions.changeSelection("invert")),
    button("Grow", "One cell more around (Ctrl and +)", "grow", () => actions.changeSelection("grow")),
    button("Shrink", "One cell less around (Ctrl and -)", "shrink", () => actions.changeSelection("shrink")),
  ];
  const enclosing = (
    [
      ["Cage around it", "A new edit with a cage around the selection (E)", "enclose", "box"],
      ["Lattice", "A new edit with a lattice around the selection (Shift+E)", "enclose-lattice", "lattice"],
      ["Mesh", "A new edit with a closed mesh around the selection (Alt+E)", "enclose-mesh", "mesh"],
    ] as const
  ).map(([text, title, name, cage]) =>
    button(text, title, name, () => actions.encloseSelection(cage, model.margin)),
  );
  const isolate = button("Isolate", "Show the selection alone, or all again (/)", "isolate", () =>
    actions.toggleIsolated(),
  );
  const remove = button("Delete selected", "Delete the selection (Ctrl+Delete)", "delete-selected", () =>
    actions.removeElements(),
  );
  const restore = button("Restore deleted", "Restore all that was deleted", "restore-deleted", () =>
    actions.restoreElements(),
  );
  const chart = histogram(app);
  const whole = section(
    "Selection",
    count,
    h(
      "div",
      { class: "bar" },
      button("All", "Select all (A)", "all", () => actions.changeSelection("all")),
      button("None", "Select none (Alt+A)", "none", () => actions.changeSelection("none")),
      ...needSelected,
    ),
    host,
    h(
      "div",
      { class: "bar" },
      button("Floaters", "Select probable floaters", "floaters", selectFloaters),
      ...enclosing,
      isolate,
    ),
    h("div", { class: "bar" }, remove, restore),
    chart,
  );
  whole.classList.add("selection");
  whole.open = false;

  store.watch(["selecting"], ({ selecting }) => {
    if (selecting !== null) whole.open = true;
  });
  store.watch(["brushRadius"], ({ brushRadius }) => {
    model.radius = brushRadius;
    radius.refresh();
  });
  store.watch(["through"], ({ through }) => {
    depth.disabled = through;
  });
  store.watch(["state", "hello"], ({ state, hello }) => {
    const selection = state?.selection ?? null;
    const noun = hello?.splats === true ? "splats" : "cells";
    count.textContent =
      selection === null
        ? `No ${noun} are selected: brush (M), lasso (J), or Shift+drag.`
        : `${selection.count.toLocaleString("en")} of ${selection.total.toLocaleString("en")} ${noun} selected`;
    const removed = state?.removed ?? null;
    restore.hidden = removed === null;
    restore.textContent = `Restore ${removed?.count.toLocaleString("en") ?? ""} ${noun}`;
    isolate.disabled = selection === null && state?.isolated !== true;
    isolate.textContent = state?.isolated === true ? "Show all" : "Isolate";
    for (const each of [...needSelected, ...enclosing, remove]) each.disabled = selection === null;
  });
  return whole;
}
