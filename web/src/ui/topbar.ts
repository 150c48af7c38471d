/** The bar at the top: scene, undo and redo, view, saving. */
import {
  Camera,
  CircleQuestionMark,
  Columns2,
  Download,
  FileDown,
  FolderOpen,
  Grid3x3,
  PanelRight,
  Pyramid,
  Redo2,
  Save,
  SaveAll,
  Undo2,
} from "lucide";
import type { Actions } from "../editing/actions";
import type { App } from "../app/app";
import { READ_ONLY_NOTICE, isReadOnly, type View } from "../app/store";
import { SPLAT_SUFFIXES } from "../net/upload";
import type { Dialogs } from "./dialogs";
import { h, iconButton, iconLink } from "./dom";

const VIEWS: [View, string][] = [
  ["color", "Color"],
  ["depth", "Depth"],
  ["opacity", "Opacity"],
  ["normals", "Normals"],
];

export function topbar(
  app: App,
  actions: Actions,
  dialogs: Pick<Dialogs, "saveAs" | "download">,
): HTMLElement {
  const name = h("span", { class: "scene-name" });
  const unsaved = h("span", { class: "unsaved", title: "There are unsaved changes" });
  const mode = h("span", { class: "mode-badge" });
  const undo = iconButton(Undo2, "Undo (Ctrl+Z)", () => actions.command("undo"), "undo");
  const redo = iconButton(Redo2, "Redo (Ctrl+Shift+Z)", () => actions.command("redo"), "redo");
  const views = VIEWS.map(([view, label]) =>
    h(
      "button",
      { type: "button", title: `${label} (V)`, onclick: () => actions.setView(view), data: { view } },
      label,
    ),
  );
  const split = iconButton(
    Columns2,
    "Before and after, side by side (P); hold B for before",
    () => actions.toggleSplit(),
    "split",
  );
  const grid = iconButton(Grid3x3, "Deformed lattice (L)", () => actions.toggle("grid"), "grid");
  const file = h("input", {
    type: "file",
    accept: [".yaml", ".yml", ".json", ".obj", ...SPLAT_SUFFIXES].join(),
    hidden: true,
  });
  file.onchange = () => {
    const chosen = file.files?.[0];
    if (chosen) void actions.load(chosen);
    file.value = "";
  };
  const mesh = h("input", { type: "file", accept: ".obj,.ply,.glb", hidden: true, class: "mesh-file" });
  mesh.onchange = () => {
    const chosen = mesh.files?.[0];
    if (chosen) void actions.placeMesh(chosen);
    mesh.value = "";
  };
  const addMesh = iconButton(Pyramid, "A mesh file as a cage…", () => mesh.click(), "mesh-cage");
  const save = iconButton(Save, "Save (Ctrl+S)", () => actions.save(), "save");
  const saveAs = iconButton(SaveAll, "Save as… (Ctrl+Shift+S)", () => dialogs.saveAs(), "save-as");
  const load = iconButton(FolderOpen, "Load an edit file, or open splats…", () => file.click(), "load");
  const splats = iconButton(
    FileDown,
    "Download the edited scene: splats, or a page…",
    () => dialogs.download(false),
    "download",
  );
  const panel = iconButton(PanelRight, "Panel (N)", () => actions.toggle("panel"), "panel-toggle");
  app.store.watch(["state", "hello", "view", "split", "grid", "panel", "mode"], (now) => {
    name.textContent = now.hello?.name ?? "";
    unsaved.classList.toggle("shown", now.state?.saved === false);
    save.classList.toggle("due", now.state?.saved === false);
    const isLooking = isReadOnly(now);
    for (const button of [save, saveAs, load, addMesh]) button.hidden = isLooking;
    undo.disabled = isLooking || (now.state?.entry ?? 0) <= 0;
    redo.disabled = isLooking || now.state === null || now.state.entry >= now.state.history.length - 1;
    for (const button of views) button.classList.toggle("on", button.dataset.view === now.view);
    splats.hidden = isLooking;
    split.classList.toggle("on", now.split !== null);
    grid.classList.toggle("on", now.grid);
    panel.classList.toggle("on", now.panel);
    mode.textContent = isLooking ? "Read only" : now.mode === "set" ? "Set cages" : "Edit field";
    mode.title = isLooking ? READ_ONLY_NOTICE : "";
    mode.dataset.mode = isLooking ? "look" : now.mode;
  });
  const screenshot = iconLink(Camera, "Screenshot of the field", "screenshot.png", "screenshot.png");
  app.store.watch(["hello"], ({ hello }) => {
    const query = new URLSearchParams(location.search);
    if (hello !== null) query.set("page", String(hello.page));
    screenshot.search = query.toString();
  });
  return h(
    "header",
    { class: "top" },
    h("span", { class: "brand" }, "cagefield"),
    name,
    unsaved,
    mode,
    h("span", { class: "space" }),
    h("div", { class: "group" }, undo, redo),
    h("div", { class: "segments" }, ...views),
    h("div", { class: "group" }, split, grid),
    h("span", { class: "space" }),
    h(
      "div",
      { class: "group" },
      save,
      saveAs,
      load,
      addMesh,
      iconLink(Download, "Download the edit file", `edits.yaml${location.search}`, "edits.yaml"),
      splats,
      screenshot,
    ),
    h(
      "div",
      { class: "group" },
      iconButton(CircleQuestionMark, "All keys (?)", () => actions.toggle("help"), "keys-button"),
      panel,
    ),
    file,
    mesh,
  );
}
