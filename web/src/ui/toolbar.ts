/** The toolbar on the left: tools, Set and Edit mode, axes, cages, snapping. */
import {
  Axis3d,
  Box,
  Boxes,
  Globe,
  LassoSelect,
  Magnet,
  MousePointer2,
  Move3d,
  Paintbrush,
  PaintBucket,
  PencilRuler,
  Radius,
  Rotate3d,
  MapPin,
  Ruler,
  Scale3d,
  Spline,
  Square,
  SquareDashed,
  SquareDashedMousePointer,
  type IconNode,
} from "lucide";
import type { Actions } from "../editing/actions";
import type { App } from "../app/app";
import { isReadOnly, type Editor, type SelectTool } from "../app/store";
import { h, iconButton } from "./dom";

const SELECT_TOOLS: [IconNode, SelectTool, string][] = [
  [Paintbrush, "brush", "Select with a brush (M); [ and ] change its size"],
  [LassoSelect, "lasso", "Select with a lasso (J)"],
  [SquareDashedMousePointer, "rectangle", "Select in a rectangle (Shift+drag)"],
  [PaintBucket, "flood", "Select what is connected to a click"],
];

export function toolbar(app: App, actions: Actions): HTMLElement {
  const bar = h("nav", { class: "tools" });
  const lit: [HTMLButtonElement, (now: Editor) => boolean][] = [];
  const setOnly: HTMLElement[] = [];
  const editing: HTMLElement[] = [];
  const add = (button: HTMLButtonElement, on: (now: Editor) => boolean): HTMLButtonElement => {
    lit.push([button, on]);
    return button;
  };
  const group = (...buttons: HTMLElement[]): HTMLElement => h("div", { class: "group" }, ...buttons);
  const tools = (...buttons: HTMLElement[]): HTMLElement => {
    const made = group(...buttons);
    editing.push(made);
    return made;
  };
  const snap = add(
    iconButton(Magnet, "Snap; Ctrl does the opposite while held", () => actions.toggle("snap"), "snap"),
    (e) => e.snap,
  );
  const proportional = add(
    iconButton(
      Radius,
      "Proportional editing of control points (O); the wheel changes its radius while dragging",
      () => actions.toggleProportional(false),
      "proportional",
    ),
    (e) => e.proportional,
  );
  editing.push(snap, proportional);
  const cages = group(
    add(
      iconButton(Square, "Move the inner cage (C)", () => actions.setCage("inner"), "cage-inner"),
      (e) => e.cage === "inner",
    ),
    add(
      iconButton(SquareDashed, "Move the outer cage (C)", () => actions.setCage("outer"), "cage-outer"),
      (e) => e.cage === "outer",
    ),
    add(
      iconButton(Boxes, "Move both cages (C)", () => actions.setCage("both"), "cage-both"),
      (e) => e.cage === "both",
    ),
  );
  setOnly.push(cages);
  bar.append(
    tools(
      add(
        iconButton(MousePointer2, "Select: no gizmo (4, Q)", () => actions.setTool("select"), "tool-select"),
        (e) => e.selecting === null && e.tool === "select",
      ),
      add(
        iconButton(Move3d, "Move (1, G)", () => actions.setTool("translate"), "tool-translate"),
        (e) => e.selecting === null && e.tool === "translate",
      ),
      add(
        iconButton(Rotate3d, "Rotate (2, R)", () => actions.setTool("rotate"), "tool-rotate"),
        (e) => e.selecting === null && e.tool === "rotate",
      ),
      add(
        iconButton(Scale3d, "Scale (3, S)", () => actions.setTool("scale"), "tool-scale"),
        (e) => e.selecting === null && e.tool === "scale",
      ),
    ),
    tools(
      add(
        iconButton(
          PencilRuler,
          "Set mode: move cages, never the field (Tab)",
          () => actions.setMode("set"),
          "mode-set",
        ),
        (e) => e.mode === "set",
      ),
      add(
        iconButton(
          Spline,
          "Edit mode: the field follows the inner cage (Tab)",
          () => actions.setMode("edit"),
          "mode-edit",
        ),
        (e) => e.mode === "edit",
      ),
    ),
    tools(
      ...SELECT_TOOLS.map(([node, tool, title]) =>
        add(
          iconButton(node, title, () => actions.toggleSelecting(tool), `select-${tool}`),
          (e) => e.selecting === tool,
        ),
      ),
    ),
    cages,
    tools(
      add(
        iconButton(Globe, "Along the world's axes (W)", () => app.store.set({ axes: "world" }), "axes-world"),
        (e) => e.axes === "world",
      ),
      add(
        iconButton(Box, "Along the cage's own axes (W)", () => app.store.set({ axes: "cage" }), "axes-cage"),
        (e) => e.axes === "cage",
      ),
    ),
    group(
      snap,
      proportional,
      add(
        iconButton(
          Ruler,
          "Measure between two points (Shift+M); sets the scale in meters",
          () => actions.toggleMeasuring(),
          "measure",
        ),
        (e) => e.measured !== null,
      ),
      add(
        iconButton(
          MapPin,
          "Place hotspots on the surface (Shift+H)",
          () => actions.toggleHotspots(),
          "place-hotspot",
        ),
        (e) => e.placesHotspot,
      ),
      add(
        iconButton(Axis3d, "Show or hide the cages (Shift+O)", () => actions.toggle("cages"), "cages"),
        (e) => e.cages,
      ),
    ),
  );
  app.store.watch(
    [
      "hello",
      "tool",
      "selecting",
      "measured",
      "placesHotspot",
      "mode",
      "cage",
      "axes",
      "snap",
      "proportional",
      "cages",
    ],
    (now) => {
      for (const element of editing) element.hidden = isReadOnly(now);
      for (const [button, on] of lit) button.classList.toggle("on", on(now));
      for (const element of setOnly) element.classList.toggle("away", now.mode !== "set" || isReadOnly(now));
    },
  );
  return bar;
}
