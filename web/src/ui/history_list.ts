/** The list of the history's entries, each a link back to its state. */
import type { App } from "../app/app";
import { h, section } from "./dom";

export function historyList(app: App): HTMLElement {
  const list = h("ol", { class: "history" });
  app.store.watch(["state"], ({ state }) => {
    if (state === null) return;
    list.replaceChildren(
      ...state.history.map((text, entry) => {
        const when = entry === state.entry ? " now" : entry > state.entry ? " undone" : "";
        const go = (): void => void app.send({ type: "go_to", entry });
        return h("li", { class: `entry${when}`, onclick: go, data: { entry: String(entry) } }, text);
      }),
    );
    const now = list.children[state.entry] as HTMLElement | undefined;
    if (now) list.scrollTop = now.offsetTop - list.offsetTop - list.clientHeight / 2;
  });
  return section("History", list);
}
