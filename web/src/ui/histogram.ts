/** Histogram of an attribute of the field's elements; a drag over it selects the range. */
import type { App } from "../app/app";
import type { Ask, HistogramCounts, SelectionCount } from "../net/protocol";
import { h } from "./dom";

type Attribute = NonNullable<Ask["attribute"]>;

const ATTRIBUTES: Attribute[] = ["opacity", "size", "hue", "saturation", "value", "red", "green", "blue"];

const WIDTH = 268;
const HEIGHT = 64;

export function histogram(app: App): HTMLElement {
  const choice = h(
    "select",
    { ariaLabel: "Attribute of the histogram" },
    ...ATTRIBUTES.map((name) => h("option", { value: name }, name)),
  );
  const canvas = h("canvas", { width: WIDTH, height: HEIGHT, title: "Drag over it to select a range" });
  const range = h("span", { class: "quiet range" });
  const whole = h(
    "details",
    { class: "histogram" },
    h("summary", {}, "By attribute"),
    h("div", { class: "row" }, choice, range),
    canvas,
  );
  let counts: HistogramCounts | null = null;
  let dragged: [number, number] | null = null;
  let shown: SelectionCount | null | undefined;
  let asked = 0;

  const attribute = (): Attribute => choice.value as Attribute;

  const refresh = (): void => {
    if (!whole.open) return;
    shown = app.store.now.state?.selection ?? null;
    const question = ++asked;
    void app.ask({ what: "histogram", attribute: attribute() }).then((answer) => {
      if (question !== asked || !answer?.histogram) return;
      counts = answer.histogram;
      draw();
    });
  };
  const draw = (): void => {
    const context = canvas.getContext("2d")!;
    context.clearRect(0, 0, WIDTH, HEIGHT);
    range.textContent = "";
    if (counts === null) return;
    const most = Math.log1p(Math.max(...counts.counts, 1));
    const step = WIDTH / counts.counts.length;
    const bar = (count: number, n: number): void => {
      const height = (Math.log1p(count) / most) * (HEIGHT - 2);
      context.fillRect(n * step, HEIGHT - height, step - 1, height);
    };
    context.fillStyle = "#5d6673";
    counts.counts.forEach(bar);
    context.fillStyle = "#ff9a2b";
    counts.selected.forEach(bar);
    if (dragged === null) return;
    const [a, b] = [Math.min(...dragged), Math.max(...dragged)];
    context.fillStyle = "#4c9ffe44";
    context.fillRect(a * WIDTH, 0, (b - a) * WIDTH, HEIGHT);
    range.textContent = `${short(valueAt(a))} to ${short(valueAt(b))}`;
  };
  const valueAt = (share: number): number => {
    const { low, high } = counts!;
    // Bins of sizes are even in their logarithm.
    return attribute() === "size" ? low * (high / low) ** share : low + (high - low) * share;
  };
  const place = (event: PointerEvent): number => {
    const box = canvas.getBoundingClientRect();
    return Math.min(1, Math.max(0, (event.clientX - box.left) / box.width));
  };
  canvas.onpointerdown = (event) => {
    if (counts === null) return;
    canvas.setPointerCapture(event.pointerId);
    dragged = [place(event), place(event)];
    draw();
  };
  canvas.onpointermove = (event) => {
    if (dragged === null) return;
    dragged[1] = place(event);
    draw();
  };
  canvas.onpointerup = () => {
    if (dragged === null || counts === null) return;
    const [low, high] = [Math.min(...dragged), Math.max(...dragged)].map(valueAt);
    dragged = null;
    const mode = app.store.now.selectMode;
    app.send({ type: "select_range", attribute: attribute(), low, high, mode });
    draw();
  };
  choice.onchange = refresh;
  whole.ontoggle = refresh;
  app.store.watch(["hello"], ({ hello }) => {
    const size = choice.querySelector<HTMLOptionElement>("option[value=size]")!;
    size.disabled = hello?.splats === false;
    counts = null;
    draw();
    refresh();
  });
  app.store.watch(["state"], ({ state }) => {
    const selection = state?.selection ?? null;
    if (JSON.stringify(selection) !== JSON.stringify(shown)) refresh();
  });
  return whole;
}

function short(value: number): string {
  return Number(value.toPrecision(3)).toString();
}
