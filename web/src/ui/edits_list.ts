/** The list of edits with name, color, visibility, lock and order, and the actions for the selected edit. */
import {
  ChevronDown,
  ChevronUp,
  CircleDot,
  ClipboardPaste,
  Copy,
  Eye,
  EyeOff,
  FlipHorizontal,
  Lock,
  LockOpen,
  Plus,
  Trash2,
  TriangleAlert,
} from "lucide";
import type { Actions } from "../editing/actions";
import type { App } from "../app/app";
import type { EditState } from "../net/protocol";
import { isReadOnly, selectedEdit } from "../app/store";
import type { Dialogs } from "./dialogs";
import { h, icon, iconButton, section } from "./dom";

const KIND: Record<EditState["kind"], string> = {
  continuous: "continuous",
  move: "move",
  copy: "copy",
  delete: "delete",
};

const HINT = "Double-click the picture to put a pair of cages around what is there.";

export function editsList(app: App, actions: Actions, dialogs: Pick<Dialogs, "paste">): HTMLElement {
  const list = h("ul", { class: "edits" });
  const empty = h("p", { class: "empty" });
  const needSelected: HTMLButtonElement[] = [];
  const button = (...parameters: Parameters<typeof iconButton>): HTMLButtonElement => {
    const made = iconButton(...parameters);
    needSelected.push(made);
    return made;
  };
  const reorder = (by: number): void =>
    actions.withSelected((edit) => {
      const at = app.store.now.state!.edits.findIndex((other) => other.id === edit.id);
      app.send({ type: "reorder", edit: edit.id, to: Math.max(0, at + by) });
    });
  const mirrors = h("span", { class: "mirror" });
  for (const axis of ["x", "y", "z"] as const) {
    const made = h(
      "button",
      { type: "button", title: `Mirrored copy across ${axis}`, onclick: () => actions.mirror(axis) },
      axis,
    );
    needSelected.push(made);
    mirrors.append(made);
  }
  mirrors.prepend(icon(FlipHorizontal, 16));
  const bar = h(
    "div",
    { class: "bar" },
    iconButton(
      Plus,
      "New edit in the middle of the view; or double-click the picture",
      () => actions.place(),
      "add",
    ),
    iconButton(
      CircleDot,
      "New control point in the middle of the view; or Ctrl+double-click the picture",
      () => actions.placePoint(),
      "add-point",
    ),
    iconButton(ClipboardPaste, "Paste from another scene… (Shift+V)", () => dialogs.paste(), "paste-scene"),
    button(Copy, "Duplicate (Ctrl+D)", () => actions.duplicate(), "duplicate"),
    mirrors,
    button(ChevronUp, "Earlier in the stack", () => reorder(-1), "up"),
    button(ChevronDown, "Later in the stack", () => reorder(1), "down"),
    h("span", { class: "space" }),
    button(Trash2, "Remove (Delete)", () => actions.removeSelected(), "remove"),
  );
  // Unchanged rows are reused: a row replaced between two clicks would lose the double click.
  let rows = new Map<string, HTMLElement>();
  app.store.watch(["hello"], (now) => {
    empty.textContent = isReadOnly(now) ? "There are no edits." : HINT;
  });
  app.store.watch(["state"], ({ state }) => {
    const edits = state?.edits ?? [];
    if (!(document.activeElement instanceof HTMLInputElement && list.contains(document.activeElement))) {
      const kept = rows;
      rows = new Map(
        edits.map((edit, index) => {
          const key = rowKey(edit, index);
          return [key, kept.get(key) ?? row(app, edit, index)];
        }),
      );
      const made = [...rows.values()];
      if (made.length !== list.children.length || made.some((item, index) => item !== list.children[index])) {
        list.replaceChildren(...made);
      }
      made.forEach((item, index) => item.classList.toggle("chosen", edits[index].id === state?.selected));
    }
    empty.hidden = edits.length > 0;
    const none = selectedEdit(app.store.now) === null;
    for (const each of needSelected) each.disabled = none;
  });
  return section("Edits", list, empty, bar);
}

/** Key of the content of a row, apart from the selection. */
function rowKey(edit: EditState, index: number): string {
  return JSON.stringify([
    index,
    edit.id,
    edit.name,
    edit.color,
    edit.kind,
    edit.enabled,
    edit.locked,
    edit.problem,
    edit.source,
  ]);
}

function row(app: App, edit: EditState, index: number): HTMLElement {
  const change = (what: { enabled: boolean } | { locked: boolean } | { name: string }): void => {
    app.send({ type: "change", edit: edit.id, ...what });
  };
  const swatch = h("span", { class: "swatch" });
  swatch.style.background = edit.color;
  const name = h(
    "span",
    { class: "name", title: "Double-click to rename" },
    edit.name || `edit ${index + 1}`,
  );
  name.ondblclick = () =>
    !isReadOnly(app.store.now) && rename(name, edit.name, (text) => change({ name: text }));
  const problem =
    edit.problem === null
      ? null
      : h("span", { class: "problem", title: edit.problem }, icon(TriangleAlert, 15));
  const item = h(
    "li",
    { class: `edit${edit.enabled ? "" : " off"}`, draggable: true, data: { edit: String(edit.id) } },
    swatch,
    name,
    problem,
    h(
      "span",
      { class: "kind", title: edit.source === null ? "" : `from ${edit.source}` },
      edit.source === null ? KIND[edit.kind] : "paste",
    ),
    iconButton(
      edit.enabled ? Eye : EyeOff,
      edit.enabled ? "Hide (H)" : "Show (H)",
      () => change({ enabled: !edit.enabled }),
      "eye",
    ),
    iconButton(
      edit.locked ? Lock : LockOpen,
      edit.locked ? "Unlock" : "Lock",
      () => change({ locked: !edit.locked }),
      "lock",
    ),
  );
  item.onclick = (event) => {
    if (event.target instanceof Element && event.target.closest("button, input") === null) {
      app.send({ type: "command", name: "select", edit: edit.id });
    }
  };
  item.ondragstart = (event) => event.dataTransfer?.setData("application/x-edit", String(edit.id));
  item.ondragover = (event) => event.preventDefault();
  item.ondrop = (event) => {
    const dragged = Number(event.dataTransfer?.getData("application/x-edit"));
    if (dragged > 0 && dragged !== edit.id) app.send({ type: "reorder", edit: dragged, to: index });
  };
  return item;
}

function rename(label: HTMLElement, text: string, done: (text: string) => void): void {
  const input = h("input", { class: "rename", value: text, maxLength: 200 });
  const finish = (keep: boolean): void => {
    input.onblur = null;
    input.replaceWith(label);
    if (keep && input.value !== text) done(input.value);
  };
  input.onblur = () => finish(true);
  input.onkeydown = (event) => {
    if (event.key === "Enter") finish(true);
    if (event.key === "Escape") finish(false);
  };
  label.replaceWith(input);
  input.focus();
  input.select();
}
