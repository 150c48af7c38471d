/** Help page: all key bindings. */
import { MOUSE_BINDINGS, type Binding } from "../editing/keys";
import type { App } from "../app/app";
import { h } from "./dom";

const GROUPS: Binding["group"][] = ["Tools", "Cages", "Selection", "Edits", "View", "Scene"];

export function help(app: App, bindings: Binding[]): HTMLElement {
  const line = ({ keys, action }: Pick<Binding, "keys" | "action">): HTMLElement =>
    h(
      "div",
      { class: "binding" },
      h("span", {}, ...keys.map((key) => h("kbd", {}, key))),
      h("span", {}, action),
    );
  const groups = GROUPS.map((group) =>
    h("div", {}, h("h2", {}, group), ...bindings.filter((binding) => binding.group === group).map(line)),
  );
  const page = h("div", { class: "help", onclick: () => app.store.set({ help: false }) });
  page.append(
    h("div", { class: "sheet" }, ...groups, h("div", {}, h("h2", {}, "Mouse"), ...MOUSE_BINDINGS.map(line))),
  );
  app.store.watch(["help"], (now) => {
    page.hidden = !now.help;
  });
  return page;
}
