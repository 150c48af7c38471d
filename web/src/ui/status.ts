/** The status line: limit of a drag, notices of the server, frame rate. */
import type { App } from "../app/app";
import { preparationText } from "../app/store";
import { h } from "./dom";

const NOTICE_MS = 12000;

/** Milliseconds after which the preparation of the renderer is shown: later runs take less. */
const MIN_PREPARATION_MS = 2000;

export function status(app: App): HTMLElement {
  const message = h("span", { class: "message" });
  const preparing = h("span", { class: "preparing", hidden: true, role: "status" });
  const loading = h("span", { class: "loading", hidden: true, role: "status" });
  const bar = h("progress", { max: 1 });
  loading.append("Loading the field ", bar);
  loading.title = "Once it is here, this page's own GPU draws";
  app.store.watch(["loading"], ({ loading: share }) => {
    loading.hidden = share === null;
    bar.value = share ?? 0;
  });
  const figures = h("span", { class: "figures" });
  const saved = h("span", { class: "saved" });
  const connection = h("span", { class: "connection" });
  let until: ReturnType<typeof setTimeout> | undefined;
  app.store.watch(["limit", "notice", "mode", "state"], (now) => {
    const notice = now.notice;
    message.className = `message ${now.limit !== null ? "limit" : (notice?.level ?? "")}`;
    message.title = now.limit ?? notice?.text ?? "";
    message.textContent = now.limit !== null ? `The drag stops here: ${now.limit}` : message.title;
  });
  app.store.watch(["notice"], (now) => {
    clearTimeout(until);
    if (now.notice?.level === "info") until = setTimeout(() => app.store.set({ notice: null }), NOTICE_MS);
  });
  let late: ReturnType<typeof setTimeout> | undefined;
  preparing.title =
    "Kernels are compiled once for a machine; what edits uncover, and their shadows, are worked out when a scene is opened";
  app.store.watch(["preparing", "figures", "state"], (now) => {
    const words = preparationText(now);
    if (preparing.textContent !== (words ?? "")) preparing.textContent = words;
    if (words === null) {
      clearTimeout(late);
      late = undefined;
      preparing.hidden = true;
    } else late ??= setTimeout(() => (preparing.hidden = false), MIN_PREPARATION_MS);
  });
  app.store.watch(["figures", "state", "connection"], ({ figures: f, state, connection: c }) => {
    let speed = f.perSecond >= 0.5 && !f.final ? `${f.perSecond.toFixed(0)} pictures/s · ` : "";
    if (f.whole && !f.final) speed = "Refining · ";
    figures.textContent =
      f.width > 0
        ? `${speed}${f.width}×${f.height} · ${f.renderMs.toFixed(0)} ms · ${f.page ? "drawn here" : "by the server"}`
        : "";
    figures.title = [app.page.why ?? "", app.page.location.summary].filter((text) => text !== "").join(" · ");
    saved.textContent = state === null ? "" : state.saved ? "saved" : "not saved";
    saved.classList.toggle("due", state?.saved === false);
    connection.className = `connection ${c}`;
    connection.title = { open: "Connected", connecting: "Connecting…", lost: "The server is gone" }[c];
  });
  return h(
    "footer",
    { class: "status" },
    message,
    h("span", { class: "space" }),
    preparing,
    loading,
    figures,
    saved,
    connection,
  );
}
