/** Dialogs before files are written: destination, size, format. */
import type { App } from "../app/app";
import { describeDistance } from "../editing/measure_tool";
import { selectedEdit } from "../app/store";
import type { ExportSplats, HotspotState, PointPair, PutHotspot } from "../net/protocol";
import { h } from "./dom";

const FORMS: [ExportSplats["form"], string][] = [
  ["ply", ".ply: every program, large"],
  ["spz", ".spz: a tenth of that"],
  ["sog", ".sog: for the web, smallest"],
  ["compressed.ply", ".compressed.ply: PlayCanvas"],
  ["splat", ".splat: no view-dependent color"],
  ["glb", ".glb: glTF"],
  ["usda", ".usda: USD text, largest"],
  ["usdc", ".usdc: USD, with usd-core"],
  ["usdz", ".usdz: USD package, with usd-core"],
];
const STREAMED: [string, string][] = [["lod", ".zip: streamed SOG, levels of detail for the web"]];

const PAGE = "page";
const LEVELS = "levels";
const VOXEL_PAGE: [string, string][] = [[PAGE, ".html: a page for any browser, with path and hotspots"]];
const SPLAT_PAGES: [string, string][] = [
  ...VOXEL_PAGE,
  [LEVELS, ".zip: a page with levels of detail, for a web site"],
];

/** Values of a hotspot; `id` is null for a new one. */
export type HotspotDraft = Omit<HotspotState, "id" | "hidden"> & { id: number | null };

/** The message that writes a hotspot. */
export function putHotspot({ id, title, text, position, camera, follows }: HotspotDraft): PutHotspot {
  return { type: "put_hotspot", hotspot: id, title, text, position, camera, follows };
}

/** Lengths that the server takes. */
const MAX_TITLE = 120;
const MAX_TEXT = 2000;

export interface Dialogs {
  element: HTMLElement;
  saveAs: () => void;
  paste: () => void;
  /** Asks for the format of the edited scene: as it is now, or its splats in each frame of the camera path. */
  download: (frames: boolean) => void;
  /** Asks how many meters a distance in units of the scene is. */
  scale: (distance: number) => void;
  /** Asks for the title and the text of a hotspot; `before` are its values so far. */
  hotspot: (before: HotspotDraft) => void;
  /** Asks how long the camera path rests at each hotspot, and makes it their tour. */
  tour: () => void;
  /** Asks how the selected paste is aligned by pairs of points. */
  align: (pairs: PointPair[]) => void;
  render: (what: "test_views" | "camera_path") => void;
}

export function dialogs(app: App): Dialogs {
  const host = h("div");
  const field = (label: string, input: HTMLElement): HTMLElement =>
    h("label", { class: "field" }, h("span", {}, label), input);
  const text = (value: string): HTMLInputElement =>
    h("input", { type: "text", value, required: true, maxLength: 1000, spellcheck: false });
  const number = (value: number, min: number, max: number): HTMLInputElement =>
    h("input", { type: "number", value: String(value), min: String(min), max: String(max), required: true });
  const check = (): HTMLInputElement => h("input", { type: "checkbox" });

  function ask(title: string, action: string, fields: HTMLElement[], done: () => void): void {
    const cancel = h("button", { type: "button", class: "text", onclick: () => dialog.close() }, "Cancel");
    const form = h(
      "form",
      { method: "dialog" },
      h("h2", {}, title),
      ...fields,
      h("div", { class: "bar end" }, cancel, h("button", { class: "text primary" }, action)),
    );
    const dialog = h("dialog", { onclose: () => dialog.remove() }, form);
    form.onsubmit = done;
    host.append(dialog);
    dialog.showModal();
  }

  return {
    element: host,
    saveAs() {
      const path = text(app.store.now.state?.path ?? "");
      const overwrite = check();
      ask(
        "Save the scene as",
        "Save",
        [field("Folder", path), field("Replace what is there", overwrite)],
        () => {
          app.send({ type: "save_as", path: path.value, overwrite: overwrite.checked });
        },
      );
      path.select();
    },
    paste() {
      void app.ask({ what: "sources" }).then((answer) => {
        if (answer === null || answer.failed) return;
        const splats = app.store.now.hello?.splats === true;
        if (answer.sources.length === 0) {
          const what = splats ? "no other scene of splats and no splat file" : "no other scene of voxels";
          app.say(
            `${what} lies beside this scene; put one there, or start the editor with --root`,
            "warning",
          );
          return;
        }
        const source = h(
          "select",
          { name: "source" },
          ...answer.sources.map((path) => h("option", { value: path }, path)),
        );
        ask(
          "Paste from another scene",
          "Paste",
          [h("label", { class: "field" }, h("span", {}, splats ? "Scene or file" : "Scene"), source)],
          () => {
            app.expectEdit();
            app.send({ type: "paste_scene", source: source.value });
          },
        );
      });
    },
    scale(distance) {
      const known = app.store.now.state?.meters_per_unit ?? null;
      const meters = h("input", { type: "number", min: "0", step: "any", required: true, name: "meters" });
      meters.value = known === null ? "" : String(Number((distance * known).toPrecision(6)));
      ask(`Distance: ${describeDistance(distance, null)}`, "Set the scale", [field("Meters", meters)], () => {
        const length = Number(meters.value);
        if (length > 0) app.send({ type: "scale_change", meters_per_unit: length / distance });
      });
    },
    align(pairs) {
      const edit = selectedEdit(app.store.now);
      if (edit === null) return;
      const refine = h("input", { type: "checkbox", name: "refine", checked: true });
      const keepScale = h("input", { type: "checkbox", name: "keep_scale" });
      const colors = h("input", { type: "checkbox", name: "match_colors" });
      const fields = [
        field("Bring the surfaces together (ICP)", refine),
        field("Keep the scale of the pairs", keepScale),
        field("Match the colors", colors),
      ];
      ask(`Align “${edit.name}” by ${pairs.length} pairs`, "Align", fields, () => {
        app.store.set({ picked: null });
        app.send({
          type: "align_paste",
          edit: edit.id,
          pairs,
          refine: refine.checked,
          keep_scale: keepScale.checked,
          match_colors: colors.checked,
        });
      });
    },
    hotspot(before) {
      const title = h("input", { value: before.title, required: true, maxLength: MAX_TITLE, name: "title" });
      const text = h("textarea", { value: before.text, maxLength: MAX_TEXT, name: "text", rows: 5 });
      const keepsView = h("input", { type: "checkbox", name: "view", checked: before.camera !== null });
      const follows = h("input", { type: "checkbox", name: "follows", checked: before.follows });
      const fields = [
        field("Title", title),
        field("Text", text),
        field("Look from this view", keepsView),
        field("Follow the edits", follows),
      ];
      ask(
        before.id === null ? "New hotspot" : "Hotspot",
        before.id === null ? "Place" : "Change",
        fields,
        () => {
          if (title.value.trim() === "") return;
          const { camera, fov } = { camera: app.viewport.c2w, fov: app.viewport.camera.fov };
          const view = before.camera ?? { c2w: camera, fov_y_deg: fov };
          app.send(
            putHotspot({
              ...before,
              title: title.value,
              text: text.value,
              camera: keepsView.checked ? view : null,
              follows: follows.checked,
            }),
          );
        },
      );
    },
    tour() {
      const stop = number(3, 0.1, 600);
      Object.assign(stop, { name: "stop", step: "any" });
      const keys = app.store.now.state?.keys.length ?? 0;
      const note = keys === 0 ? "" : `The ${keys} keyframes of the path are replaced; undo has them.`;
      const fields = [field("Seconds at each hotspot", stop), h("p", { class: "quiet" }, note)];
      ask("Tour of the hotspots as the camera path", "Make the path", fields, () =>
        app.send({ type: "tour_path", stop: Number(stop.value) }),
      );
    },
    download(frames) {
      const hasSplats = app.store.now.hello?.splats === true;
      const pages = hasSplats ? SPLAT_PAGES : VOXEL_PAGE;
      const forms = frames ? FORMS : hasSplats ? [...FORMS, ...STREAMED, ...pages] : pages;
      const form = h(
        "select",
        { name: "form" },
        ...forms.map(([value, label]) => h("option", { value }, label)),
      );
      const fps = number(24, 1, 120);
      fps.name = "fps";
      const kind = h("p", { class: "quiet" });
      const explain = (): void => {
        kind.textContent = form.value.startsWith("usd")
          ? "one file, its frames as time samples"
          : "a .zip, a file for each frame";
      };
      const most = number(1, 1, 1e9);
      Object.assign(most, { name: "splats", value: "", required: false, placeholder: "all" });
      const budget = number(1, 1, 1e9);
      Object.assign(budget, { name: "budget", value: "", required: false, placeholder: "all" });
      const mostField = field("At most so many splats", most);
      const budgetField = field("Splats held at a time", budget);
      form.onchange = () => {
        explain();
        mostField.hidden = [PAGE, LEVELS].includes(form.value);
        budgetField.hidden = form.value !== LEVELS;
      };
      form.onchange(new Event("change"));
      const fields = [field("File", form)];
      if (frames) fields.push(field("Frames per second", fps), kind);
      else fields.push(mostField, budgetField);
      const title = frames ? "Download the splats of each frame of the path" : "Download the edited scene";
      ask(title, "Download", fields, () => {
        if (!frames && [PAGE, LEVELS].includes(form.value)) {
          const levels = form.value === LEVELS;
          const count = levels && budget.value !== "" ? Number(budget.value) : null;
          app.send({ type: "export_page", levels, budget: count });
          return;
        }
        app.send({
          type: "export",
          form: form.value as ExportSplats["form"],
          along_path: frames,
          fps: Number(fps.value),
          splats: most.value === "" ? null : Number(most.value),
        });
      });
    },
    render(what) {
      const film = what === "camera_path";
      const base = (app.store.now.state?.path ?? "").replace(/\/+$/, "");
      const out = text(film ? `${base}.mp4` : `${base}-views`);
      const { width, height } = app.viewport.points;
      const sizes = [number(roundToEven(width), 16, 4096), number(roundToEven(height), 16, 4096)];
      const fps = number(24, 1, 120);
      const overwrite = check();
      const fields = [field(film ? "File" : "Folder", out)];
      if (film)
        fields.push(field("Width", sizes[0]), field("Height", sizes[1]), field("Pictures per second", fps));
      fields.push(field("Replace what is there", overwrite));
      ask(film ? "Render the camera path" : "Render the test views", "Render", fields, () => {
        app.send({
          type: "render",
          what,
          out: out.value,
          overwrite: overwrite.checked,
          fps: Number(fps.value),
          width: Number(sizes[0].value),
          height: Number(sizes[1].value),
        });
      });
    },
  };
}

function roundToEven(x: number): number {
  return 2 * Math.round(x / 2);
}
