/** What lies over the picture: the split's slider, the drag's numbers, lines for the user, a lost server. */
import type { App } from "../app/app";
import { described } from "../editing/operations";
import type { Pointer } from "../editing/pointer";
import { h } from "./dom";
import { looking } from "../app/store";

const TOAST_STAYS = 7000;

/** Milliseconds between changes of the readout where the processor draws the page: each costs half a frame. */
const TEXT_EVERY = 150;

export function overlay(app: App, pointer: Pointer): HTMLElement {
  const layer = h("div", { class: "overlay" });
  layer.append(splitter(app), readout(app, pointer), toasts(app), lost(app), opening(app), hint(app));
  return layer;
}

/** A bar to drag: the field before its edits on the left of it, after them on the right. */
function splitter(app: App): HTMLElement {
  const bar = h(
    "div",
    { class: "splitter" },
    h("span", { class: "before" }, "before"),
    h("span", { class: "grip" }),
    h("span", { class: "after" }, "after"),
  );
  bar.onpointerdown = (event) => bar.setPointerCapture(event.pointerId);
  bar.onpointermove = (event) => {
    if (!bar.hasPointerCapture(event.pointerId)) return;
    const box = app.viewport.canvas.getBoundingClientRect();
    app.store.set({ split: Math.min(0.98, Math.max(0.02, (event.clientX - box.left) / box.width)) });
  };
  app.store.watch(["split"], ({ split }) => {
    bar.hidden = split === null;
    bar.style.left = `${100 * (split ?? 0)}%`;
  });
  return bar;
}

/** What the drag amounts to, beside the mouse. */
function readout(app: App, pointer: Pointer): HTMLElement {
  const label = h("div", { class: "readout" });
  label.hidden = true;
  let written = -Infinity;
  let later: ReturnType<typeof setTimeout> | null = null;
  app.viewport.beforeFrame.push(() => {
    const { drag } = app;
    const followed = drag === null || drag.ended ? null : drag.followed;
    const now = performance.now();
    if (followed !== null && !label.hidden && app.viewport.software && now - written < TEXT_EVERY) {
      later ??= setTimeout(() => {
        later = null;
        app.viewport.invalidate();
      }, TEXT_EVERY);
      return;
    }
    written = now;
    label.hidden = followed === null;
    if (drag === null || followed === null) return;
    label.textContent = described(followed);
    label.classList.toggle("limit", drag.why !== null);
    const { width, height } = app.viewport.points;
    const x = Math.min(pointer.at.x + 18, width - label.offsetWidth - 6);
    const y = Math.min(pointer.at.y + 18, height - label.offsetHeight - 6);
    label.style.transform = `translate(${x}px, ${y}px)`;
  });
  return label;
}

function toasts(app: App): HTMLElement {
  const list = h("div", { class: "toasts" });
  app.store.watch(["notice"], ({ notice }) => {
    if (notice === null || notice.level === "info") return;
    const toast = h(
      "div",
      { class: `toast ${notice.level}`, role: "alert", onclick: () => toast.remove() },
      notice.text,
    );
    list.append(toast);
    while (list.children.length > 3) list.firstElementChild?.remove();
    setTimeout(() => toast.remove(), TOAST_STAYS);
  });
  return list;
}

function lost(app: App): HTMLElement {
  const line = h("div", { class: "lost", role: "alert" }, "The server is gone. Trying again…");
  app.store.watch(["connection"], ({ connection }) => {
    line.hidden = connection !== "lost";
  });
  return line;
}

/** How far a file of splats is on its way to the server, and that it is being read there. */
function opening(app: App): HTMLElement {
  const name = h("span");
  const bar = h("progress", { max: 1 });
  const line = h("div", { class: "opening", role: "status" }, name, bar);
  app.store.watch(["upload"], ({ upload }) => {
    line.hidden = upload === null;
    if (upload === null) return;
    name.textContent = upload.share < 1 ? `Sending ${upload.name}` : `Opening ${upload.name}`;
    if (upload.share < 1) bar.value = upload.share;
    else bar.removeAttribute("value");
  });
  return line;
}

function hint(app: App): HTMLElement {
  const line = h(
    "div",
    { class: "hint" },
    "Double-click the picture to put a pair of cages around what is there",
  );
  app.store.watch(["state", "hello"], (now) => {
    line.hidden = looking(now) || now.state === null || now.state.edits.length > 0;
  });
  return line;
}
