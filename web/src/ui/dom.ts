/** Construction of elements and icons. */
import { createElement, type IconNode } from "lucide";

type Properties<T extends keyof HTMLElementTagNameMap> = Partial<
  Omit<HTMLElementTagNameMap[T], "style" | "dataset">
> & {
  class?: string;
  data?: Record<string, string>;
};

/** An element with properties and children. */
export function h<T extends keyof HTMLElementTagNameMap>(
  tag: T,
  { class: name, data, ...properties }: Properties<T> = {},
  ...children: (Node | string | null)[]
): HTMLElementTagNameMap[T] {
  const element = document.createElement(tag);
  if (name !== undefined) element.className = name;
  Object.assign(element.dataset, data);
  Object.assign(element, properties);
  element.append(...children.filter((child) => child !== null));
  return element;
}

export function icon(node: IconNode, size = 18): SVGElement {
  return createElement(node, { width: size, height: size, "stroke-width": 1.75, "aria-hidden": "true" });
}

/** A button with an icon; `title` names its action and key. */
export function iconButton(node: IconNode, title: string, onclick: () => void, name = ""): HTMLButtonElement {
  const button = h("button", { class: `icon ${name}`, title, type: "button", onclick }, icon(node));
  button.setAttribute("aria-label", title);
  return button;
}

/** A link with an icon that downloads a file. */
export function iconLink(node: IconNode, title: string, href: string, download: string): HTMLAnchorElement {
  return h("a", { class: "icon", title, href, download, ariaLabel: title }, icon(node));
}

export function section(title: string, ...children: (Node | null)[]): HTMLDetailsElement {
  return h("details", { class: "section", open: true }, h("summary", {}, title), ...children);
}
