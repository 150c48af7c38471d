/** Options and numbers of the selected edit. */
import { Pane, type BladeApi } from "tweakpane";
import type { Actions } from "../editing/actions";
import type { App } from "../app/app";
import { halfExtent } from "../editing/cage";
import { operationAtRest } from "../editing/carrier";
import { targetCage } from "../editing/drag";
import { roundDecimals, type Operation } from "../editing/operations";
import type { Change, EditState, Vec3 } from "../net/protocol";
import { canFill, canRelight, selectedEdit, dragTarget } from "../app/store";
import { h, section } from "./dom";
import { gradeOptions } from "./grade_options";
import { mirrorOptions } from "./mirror_options";
import { parentRow } from "./parent_row";
import { pointOptions } from "./point_options";

interface Point {
  x: number;
  y: number;
  z: number;
}

const KINDS = { Continuous: "continuous", Move: "move", Copy: "copy", Delete: "delete" };
const SHELLS = { Flow: "flow", Trilinear: "trilinear" };
const FALLOFFS = { Smooth: "smooth", Linear: "linear" };
const SHADOWS = { "Contact shadows": "occlusion", "Cast shadows too": "shadow", None: "none" };
const LATTICES = { Exact: 0, "32³": 32, "64³": 64, "128³": 128, "256³": 256 };

export function options(app: App, actions: Actions): HTMLElement {
  const host = h("div", { class: "pane" });
  const operations = h("ol", { class: "operations" });
  const pane = new Pane({ container: host });
  const model = {
    kind: "continuous",
    from: "",
    shell: "flow",
    falloff: "smooth",
    width: 1,
    lattice: 0,
    error: "",
    fills: true,
    relight: "occlusion",
    margin: 0.2,
    preserve: false,
    position: point(0, 0, 0),
    turn: point(0, 0, 0),
    scale: point(1, 1, 1),
  };
  let filling = false;
  const change = (what: Omit<Change, "type" | "edit">): void => {
    const edit = selectedEdit(app.store.now);
    if (!filling && edit !== null) app.send({ type: "change", edit: edit.id, ...what });
  };
  const applyNow = (operation: Operation): void => {
    const edit = selectedEdit(app.store.now);
    if (edit !== null)
      app.send({ type: "apply", edit: edit.id, target: dragTarget(app.store.now), operation });
  };

  /** Updates the model after the change in progress, and sends nothing to the server. */
  const settle = (change: () => void): void => {
    setTimeout(() => {
      filling = true;
      change();
      pane.refresh();
      filling = false;
    });
  };

  const numbers = pane.addFolder({ title: "Numbers" });
  const position = numbers.addBinding(model, "position", { label: "Position", format: short });
  position.on("change", ({ value, last }) => {
    const edit = selectedEdit(app.store.now);
    if (filling || !last || edit === null) return;
    const { pivot } = targetCage(app.shownCages(edit), dragTarget(app.store.now));
    const by = vectorOf(value).map((x, i) => roundDecimals(x - pivot[i])) as Vec3;
    if (Math.hypot(...by) > 1e-9) applyNow(operationAtRest(edit.carrier, { kind: "translate", by }));
  });
  numbers.addBinding(model, "turn", { label: "Turn by °", format: short }).on("change", ({ value, last }) => {
    if (filling || !last || vectorOf(value).every((x) => x === 0)) return;
    applyNow({ kind: "rotate", rotation_deg: vectorOf(value), axes: app.store.now.axes });
    settle(() => (model.turn = point(0, 0, 0)));
  });
  numbers.addBinding(model, "scale", { label: "Scale by", format: short }).on("change", ({ value, last }) => {
    if (filling || !last || vectorOf(value).every((x) => x === 1)) return;
    if (vectorOf(value).every((x) => x > 0))
      applyNow({ kind: "scale", by: vectorOf(value), axes: app.store.now.axes });
    else app.say("scale factors must be above 0", "warning");
    settle(() => (model.scale = point(1, 1, 1)));
  });

  const kind = pane.addFolder({ title: "Kind" });
  const kinds = kind.addBinding(model, "kind", { label: "Kind", options: KINDS });
  kinds.on("change", ({ value }) => change({ kind: value as EditState["kind"] }));
  const from = kind.addBinding(model, "from", { label: "Pasted from", readonly: true });
  const continuous = [
    kind
      .addBinding(model, "shell", { label: "Shell", options: SHELLS })
      .on("change", ({ value }) => change({ shell: value as EditState["shell"] })),
    kind
      .addBinding(model, "falloff", { label: "Falloff", options: FALLOFFS })
      .on("change", ({ value }) => change({ falloff: value as EditState["falloff"] })),
    kind
      .addBinding(model, "width", { label: "Width", min: 0.05, max: 1, step: 0.05 })
      .on("change", ({ value, last }) => {
        if (last) change({ width: value });
      }),
    kind
      .addBinding(model, "lattice", { label: "Map nodes", options: LATTICES })
      .on("change", ({ value }) => change({ lattice: value })),
    kind.addBinding(model, "error", { label: "Its error", readonly: true }),
  ] as const;
  const fills = kind.addBinding(model, "fills", { label: "Fill what is uncovered" });
  fills.on("change", ({ value }) => change({ fill: value ? "surroundings" : "none" }));
  addTooltip(
    fills,
    "The ground or wall that the thing stood on goes on where it was; off, a hole stays (U).",
  );
  const relight = kind.addBinding(model, "relight", { label: "Shadows go along", options: SHADOWS });
  relight.on("change", ({ value }) => change({ relight: value as EditState["relight"] }));
  addTooltip(
    relight,
    "Soft shadows where things touch leave with the thing and appear at its new place, those of a dominant light too, where one is found, or all stay (Shift+U).",
  );
  const parents = parentRow(kind, (parent) => change({ parent }));
  kind.addBinding(model, "preserve", { label: "Keep opacity" }).on("change", ({ value }) => {
    if (!filling) app.send({ type: "scene_change", preserve_opacity: value });
  });

  const mirror = mirrorOptions(pane, applyNow);
  const grade = gradeOptions(pane, (values) => change({ grade: values }));

  const cages = pane.addFolder({ title: "Cages" });
  cages.addButton({ title: "Fit the inner cage (I)" }).on("click", () => actions.fitInner());
  cages.addBinding(model, "margin", { label: "Margin", min: 0.001, format: short });
  cages.addButton({ title: "Outer cage by margin" }).on("click", () => actions.outerMargin(model.margin));

  const align = pane.addButton({ title: "Align by pairs of points (Shift+A)" });
  align.on("click", () => actions.togglePicking("paste"));

  const points = pointOptions(app, actions, pane);

  const removeLast = h(
    "button",
    {
      type: "button",
      class: "text",
      onclick: () => actions.withSelected((edit) => actions.command("remove_last_operation", edit.id)),
    },
    "Take the last one back",
  );
  const reset = h(
    "button",
    {
      type: "button",
      class: "text",
      onclick: () => actions.withSelected((edit) => actions.command("reset_operations", edit.id)),
    },
    "Reset",
  );
  const whole = section(
    "Selected edit",
    host,
    h("div", { class: "subtitle" }, "Operations"),
    operations,
    h("div", { class: "bar" }, removeLast, reset),
  );

  let marginOf: number | null = null;
  app.store.watch(["state", "mode", "cage"], (now) => {
    const edit = selectedEdit(now);
    whole.hidden = edit === null;
    if (edit === null) return;
    const { pivot } = targetCage(app.shownCages(edit), dragTarget(now));
    Object.assign(model, {
      kind: edit.kind,
      from: edit.source?.split(/[\\/]/).at(-1) ?? "",
      shell: edit.shell,
      falloff: edit.falloff,
      width: edit.width,
      lattice: edit.lattice,
      error: latticeError(edit),
      fills: edit.fill !== "none",
      relight: edit.relight,
      preserve: now.state?.preserve_opacity ?? false,
      position: point(...pivot),
    });
    if (marginOf !== edit.id) {
      marginOf = edit.id;
      model.margin = roundDecimals(0.5 * halfExtent(edit.inner), 3);
    }
    const [shell, falloff, width, lattice, error] = continuous;
    for (const binding of continuous) binding.hidden = edit.kind !== "continuous";
    falloff.hidden = width.hidden =
      edit.kind !== "continuous" || edit.shell !== "flow" || edit.cage === "points";
    error.hidden = lattice.hidden || edit.lattice === 0;
    kinds.hidden = edit.source !== null;
    align.hidden = edit.source === null;
    align.disabled = edit.locked;
    from.hidden = edit.source === null;
    relight.hidden = !canRelight(now);
    fills.hidden = !canFill(now);
    for (const binding of [shell, lattice, fills, relight]) binding.disabled = edit.locked;
    if (edit.cage !== "box") shell.disabled = true;
    filling = true;
    points.show(edit);
    parents.show(edit, now.state?.edits ?? []);
    grade.show(edit);
    mirror.show(edit);
    pane.refresh();
    filling = false;
    operations.replaceChildren(...edit.operations.map((text) => h("li", {}, text)));
    removeLast.disabled = reset.disabled = edit.operations.length === 0;
  });
  return whole;
}

/**
 * Adds a tooltip to a control, and its label and tooltip for screen readers: the label is a separate element.
 */
function addTooltip(binding: BladeApi, what: string): void {
  binding.element.title = what;
  const input = binding.element.querySelector("input, select")!;
  input.setAttribute("aria-label", binding.element.querySelector(".tp-lblv_l")!.textContent);
  input.setAttribute("aria-description", what);
}

function latticeError(edit: EditState): string {
  if (edit.lattice_error === null) return "being measured";
  const [most, mean] = edit.lattice_error;
  if (most === 0) return "none";
  return `≤ ${most.toPrecision(2)}, mean ${mean.toPrecision(2)} voxels`;
}

function point(x: number, y: number, z: number): Point {
  return { x, y, z };
}

function vectorOf({ x, y, z }: Point): Vec3 {
  return [x, y, z];
}

function short(x: number): string {
  return String(roundDecimals(Number(x.toPrecision(4))));
}
