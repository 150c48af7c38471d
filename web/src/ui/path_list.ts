/** The camera path: keyframes with the share of each edit, playback, and rendering to a video. */
import { Crosshair, Download, Play, Plus, RefreshCw, Repeat, Square, Trash2 } from "lucide";
import type { Actions } from "../editing/actions";
import type { App } from "../app/app";
import { pathDuration } from "../app/camera_path";
import { upOf } from "../app/store";
import type { EditState, Key, Vec3 } from "../net/protocol";
import { h, icon, iconButton, iconLink, section } from "./dom";

export function pathList(
  app: App,
  actions: Actions,
  dialogs: { render: (what: "test_views" | "camera_path") => void; download: (frames: boolean) => void },
): HTMLElement {
  const list = h("ol", { class: "keys" });
  const length = h("span", { class: "quiet" });
  const send = (keys: Key[], loop = app.store.now.state?.loop ?? false): void => {
    app.send({ type: "set_path", keys, loop });
  };
  const keys = (): Key[] => app.store.now.state?.keys ?? [];
  const replaced = (index: number, key: Partial<Key>): Key[] =>
    keys().map((old, i) => (i === index ? { ...old, ...key } : old));
  const play = iconButton(
    Play,
    "Play the path in this page, as its video will be",
    () => app.player.toggle(),
    "play",
  );
  const loop = iconButton(
    Repeat,
    "Back to the first keyframe: a loop",
    () => send(keys(), !app.store.now.state?.loop),
    "loop",
  );
  const film = h(
    "button",
    { type: "button", class: "text", onclick: () => dialogs.render("camera_path") },
    "Render video…",
  );
  const frames = h(
    "button",
    {
      type: "button",
      class: "text",
      title: "Edited splats of each frame: a sequence of files, or USD with time samples",
      onclick: () => dialogs.download(true),
    },
    "Download frames…",
  );
  const file = iconLink(
    Download,
    "Download the camera path, as nerfstudio has it",
    `camera_path.json${location.search}`,
    "camera_path.json",
  );
  const views = h(
    "button",
    { type: "button", class: "text", onclick: () => dialogs.render("test_views") },
    "Render test views…",
  );

  const row = (key: Key, index: number, edits: EditState[]): HTMLElement => {
    const seconds = h("input", {
      type: "number",
      min: "0.1",
      max: "3600",
      step: "0.5",
      value: String(key.seconds),
      title: "Seconds to the next keyframe",
    });
    seconds.onchange = () => send(replaced(index, { seconds: Math.max(0.1, Number(seconds.value) || 2) }));
    const parts = edits.map((edit) => {
      const at = key.parts[String(edit.id)] ?? 1;
      const slider = h("input", {
        type: "range",
        min: "0",
        max: "1",
        step: "0.05",
        value: String(at),
        title: `How far “${edit.name}” has gone here`,
      });
      slider.style.accentColor = edit.color;
      slider.onchange = () => {
        slider.blur();
        send(replaced(index, { parts: { ...key.parts, [edit.id]: Number(slider.value) } }));
      };
      return h("label", { class: "part" }, h("span", {}, edit.name || `edit ${edit.id}`), slider);
    });
    return h(
      "li",
      { class: "key" },
      h(
        "div",
        { class: "row" },
        h("span", { class: "number" }, String(index + 1)),
        seconds,
        h("span", { class: "quiet" }, "s"),
        h("span", { class: "space" }),
        iconButton(Crosshair, "Look from here", () => lookFrom(app, key.c2w, key.fov_y_deg), "go"),
        iconButton(
          RefreshCw,
          "Take the view as it is now",
          () => send(replaced(index, { c2w: app.viewport.c2w })),
          "update",
        ),
        iconButton(Trash2, "Remove this keyframe", () => send(keys().filter((_, i) => i !== index)), "drop"),
      ),
      ...parts,
    );
  };

  // Unchanged rows are reused: a replaced row would lose the text being typed into it.
  let rows = new Map<string, HTMLElement>();
  app.store.watch(["state"], ({ state }) => {
    if (
      state === null ||
      (document.activeElement instanceof HTMLInputElement &&
        list.contains(document.activeElement) &&
        document.activeElement.type === "range")
    )
      return;
    const named = state.edits.map(({ id, name, color }) => [id, name, color]);
    const kept = rows;
    rows = new Map(
      state.keys.map((key, index) => {
        const shown = JSON.stringify([index, key, named]);
        return [shown, kept.get(shown) ?? row(key, index, state.edits)];
      }),
    );
    const made = [...rows.values()];
    made.forEach((item, index) => {
      if (list.children[index] !== item) list.insertBefore(item, list.children[index] ?? null);
    });
    while (list.children.length > made.length) list.lastElementChild?.remove();
    const total = pathDuration(state.keys, state.loop);
    length.textContent = state.keys.length === 0 ? "no keyframes" : `${total.toFixed(1)} s`;
    play.disabled = film.disabled = state.keys.length < 2;
    frames.disabled = state.keys.length === 0;
    frames.hidden = app.store.now.hello?.splats !== true;
    file.hidden = state.keys.length === 0;
    loop.classList.toggle("on", state.loop);
  });
  app.player.changed = (on) => play.replaceChildren(icon(on ? Square : Play));
  return section(
    "Camera path",
    h(
      "div",
      { class: "bar" },
      iconButton(Plus, "Keyframe from this view (K)", () => actions.addKey(), "add-key"),
      play,
      loop,
      file,
      h("span", { class: "space" }),
      length,
    ),
    list,
    h("div", { class: "bar" }, film, frames, views),
  );
}

function lookFrom(app: App, c2w: number[], fov_y_deg: number): void {
  const { hello } = app.store.now;
  if (hello === null) return;
  const around = hello.bounds[0].map((low, i) => 0.5 * (low + hello.bounds[1][i])) as Vec3;
  app.viewport.lookFrom(c2w, fov_y_deg, upOf(app.store.now), around);
}
