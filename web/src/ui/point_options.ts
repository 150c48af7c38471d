/** Options of lattices and control points: cells, bend, twist and taper, radius and falloff. */
import type { Pane } from "tweakpane";
import type { Actions } from "../editing/actions";
import type { App } from "../app/app";
import type { Operation } from "../editing/operations";
import type { Curve } from "../editing/point_cages";
import type { EditState, Subdivide } from "../net/protocol";
import { selectedEdit } from "../app/store";

const CURVES = { Smooth: "smooth", Sphere: "sphere", Root: "root", Sharp: "sharp", Linear: "linear" };
const INTERPOLATIONS = { "B-spline": "bspline", Linear: "linear" };
const AXES = { X: "x", Y: "y", Z: "z" };
const ENDS = { Start: "start", Middle: "middle", End: "end" };
const MAX_CELLS = 7;

type BendBy = Extract<Operation, { kind: "bend" }>;

export interface PointOptions {
  /** Takes the values of the selected edit; the pane is refreshed after it. */
  show(edit: EditState): void;
}

export function pointOptions(app: App, actions: Actions, pane: Pane): PointOptions {
  const model = {
    cells: { x: 1, y: 1, z: 4 },
    interpolation: "bspline",
    curve: "smooth",
    radius: 0.1,
    falloff: "smooth",
    connected: false,
    axis: "z",
    fixed: "start",
    degrees: 30,
    factor: 0.5,
  };
  let shown: EditState | null = null;
  const apply = (operation: Operation): void => {
    const edit = selectedEdit(app.store.now);
    if (edit === null) return;
    const target = app.store.now.mode === "edit" ? "field" : "inner";
    app.send({ type: "apply", edit: edit.id, target, operation });
  };
  const axisAndEnd = (): Pick<BendBy, "axis" | "fixed"> => ({
    axis: model.axis as BendBy["axis"],
    fixed: model.fixed as BendBy["fixed"],
  });

  const lattice = pane.addFolder({ title: "Lattice", expanded: false });
  const bounds = { min: 1, max: MAX_CELLS, step: 1 };
  lattice.addBinding(model, "cells", { label: "Cells", x: bounds, y: bounds, z: bounds });
  lattice.addBinding(model, "interpolation", { label: "Interpolation", options: INTERPOLATIONS });
  lattice.addButton({ title: "Subdivide" }).on("click", () => {
    const { x, y, z } = model.cells;
    actions.subdivide([x, y, z], model.interpolation as Subdivide["interpolation"]);
  });
  lattice
    .addBinding(model, "curve", { label: "Proportional", options: CURVES })
    .on("change", ({ value }) => app.store.set({ curve: value as Curve }));

  const bend = pane.addFolder({ title: "Bend, twist, taper", expanded: false });
  bend.addBinding(model, "axis", { label: "Axis", options: AXES });
  bend.addBinding(model, "fixed", { label: "Fixed end", options: ENDS });
  bend.addBinding(model, "degrees", { label: "Angle °", min: -720, max: 720 });
  bend
    .addButton({ title: "Bend" })
    .on("click", () => apply({ kind: "bend", ...axisAndEnd(), degrees: model.degrees }));
  bend
    .addButton({ title: "Twist" })
    .on("click", () => apply({ kind: "twist", ...axisAndEnd(), degrees: model.degrees }));
  bend.addBinding(model, "factor", { label: "Factor", min: 0.01, max: 100 });
  bend
    .addButton({ title: "Taper" })
    .on("click", () => apply({ kind: "taper", ...axisAndEnd(), factor: model.factor }));

  const reach = pane.addFolder({ title: "Control points" });
  reach.addBinding(model, "radius", { label: "Radius", min: 1e-6 }).on("change", ({ value, last }) => {
    const before = shown?.points?.radius ?? null;
    if (last && shown !== null && before !== null && Math.abs(value - before) > 1e-9)
      app.send({ type: "point_reach", edit: shown.id, radius: value });
  });
  reach.addBinding(model, "falloff", { label: "Falloff", options: CURVES }).on("change", ({ value }) => {
    if (shown?.points?.falloff && value !== shown.points.falloff)
      app.send({ type: "point_reach", edit: shown.id, falloff: value as Curve });
  });
  reach.addBinding(model, "connected", { label: "Connected only" }).on("change", ({ value }) => {
    if (shown?.points && value !== shown.points.connected)
      app.send({ type: "point_reach", edit: shown.id, connected: value });
  });

  return {
    show(edit) {
      shown = edit;
      const { points } = edit;
      lattice.hidden = edit.kind !== "continuous" || edit.cage === "points" || edit.cage === "mesh";
      bend.hidden = edit.cage !== "lattice" && edit.cage !== "mesh";
      reach.hidden = edit.cage !== "points";
      model.curve = app.store.now.curve;
      if (points?.radius != null && points.falloff !== null)
        Object.assign(model, {
          radius: points.radius,
          falloff: points.falloff,
          connected: points.connected,
        });
    },
  };
}
