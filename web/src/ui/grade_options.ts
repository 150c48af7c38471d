/** Sliders of the selected edit's color: its grade (see `cagefield.edits.grade`). */
import type { Pane } from "tweakpane";
import type { EditState, GradeValues } from "../net/protocol";

const NEUTRAL: GradeValues = {
  exposure: 0,
  temperature: 0,
  tint: 0,
  saturation: 1,
  hue_deg: 0,
  opacity: 1,
};

type Name = keyof GradeValues;

/** Label, lowest and highest value, and step of each slider; files and Python take wider ranges. */
const SLIDERS: [Name, string, number, number, number][] = [
  ["exposure", "Exposure", -4, 4, 0.05],
  ["temperature", "Temperature", -2, 2, 0.05],
  ["tint", "Tint", -2, 2, 0.05],
  ["saturation", "Saturation", 0, 3, 0.05],
  ["hue_deg", "Hue °", -180, 180, 1],
  ["opacity", "Opacity", 0, 4, 0.05],
];

export interface GradeOptions {
  /** Shows an edit's values without sending any; the caller refreshes the pane. */
  show(edit: EditState): void;
}

/** The folder "Color"; `send` is given all values at the end of a change. */
export function gradeOptions(pane: Pane, send: (values: GradeValues) => void): GradeOptions {
  const model = { ...NEUTRAL };
  const folder = pane.addFolder({ title: "Color", expanded: false });
  let showing = false;
  const bindings = SLIDERS.map(([name, label, min, max, step]) =>
    folder.addBinding(model, name, { label, min, max, step }).on("change", ({ last }) => {
      if (last && !showing) send({ ...model });
    }),
  );
  const reset = folder.addButton({ title: "Own colors" }).on("click", () => send({ ...NEUTRAL }));
  return {
    show(edit) {
      showing = true;
      Object.assign(model, NEUTRAL, edit.grade);
      folder.hidden = edit.kind === "delete" || edit.cage === "points";
      for (const binding of bindings) {
        binding.disabled = edit.locked;
        binding.refresh();
      }
      reset.disabled = edit.locked;
      showing = false;
    },
  };
}
