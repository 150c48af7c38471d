/**
 * Elements over the image: the slider of the split view, the numbers of a drag, notices, the loss of the
 * server.
 */
import type { App } from "../app/app";
import { describeOperation } from "../editing/operations";
import type { Pointer } from "../editing/pointer";
import { h } from "./dom";
import { hasPointTool, isReadOnly } from "../app/store";

const TOAST_STAYS = 7000;

/**
 * Under software rendering, where a change of text costs half a frame: least interval of the readout in ms, and the
 * time after which it is written without a frame that is drawn anyway.
 */
const TEXT_EVERY = 150;
const TEXT_WITHOUT_FRAME = 400;

export function overlay(app: App, pointer: Pointer): HTMLElement {
  const layer = h("div", { class: "overlay" });
  layer.append(splitter(app), readout(app, pointer), toasts(app), lost(app), opening(app), hint(app));
  return layer;
}

/** The slider of the split view: the field before the edits on its left, after the edits on its right. */
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

/** Numbers of the drag, beside the mouse. */
function readout(app: App, pointer: Pointer): HTMLElement {
  const label = h("div", { class: "readout" });
  label.hidden = true;
  let written = -Infinity;
  let later: ReturnType<typeof setTimeout> | undefined;
  const write = (): void => {
    clearTimeout(later);
    const { drag } = app;
    const followed = drag === null || drag.ended ? null : drag.followed;
    const isEarly = performance.now() < written + TEXT_EVERY;
    if (followed !== null && !label.hidden && app.viewport.software && isEarly) {
      later = setTimeout(write, TEXT_WITHOUT_FRAME);
      return;
    }
    written = performance.now();
    label.hidden = followed === null;
    if (drag === null || followed === null) return;
    label.textContent = describeOperation(followed);
    label.classList.toggle("limit", drag.why !== null);
    const { width, height } = app.viewport.points;
    const x = Math.min(pointer.position.x + 18, width - label.offsetWidth - 6);
    const y = Math.min(pointer.position.y + 18, height - label.offsetHeight - 6);
    label.style.transform = `translate(${x}px, ${y}px)`;
  };
  app.viewport.beforeFrame.push(write);
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

/** Progress of an upload of splats, and of its opening on the server. */
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
  app.store.watch(["state", "hello", "measured", "placesHotspot", "picked"], (now) => {
    const hasEdits = now.state === null || now.state.edits.length > 0;
    line.hidden = isReadOnly(now) || hasEdits || hasPointTool(now);
  });
  return line;
}
