/** Histogram of an attribute of the field's elements; a drag over it selects the range. */
import type { App } from "../app/app";
import type { Ask, HistogramCounts, SelectionCount } from "../net/protocol";
import { h } from "./dom";

type Attribute = NonNullable<Ask["attribute"]>;

const ATTRIBUTES: Attribute[] = ["opacity", "size", "hue", "saturation", "value", "red", "green", "blue"];

const SVG = "http://www.w3.org/2000/svg";
const WIDTH = 268;
const HEIGHT = 64;

export function histogram(app: App): HTMLElement {
  const choice = h(
    "select",
    { ariaLabel: "Attribute of the histogram" },
    ...ATTRIBUTES.map((name) => h("option", { value: name }, name)),
  );
  const chart = document.createElementNS(SVG, "svg");
  chart.setAttribute("viewBox", `0 0 ${WIDTH} ${HEIGHT}`);
  chart.setAttribute("preserveAspectRatio", "none");
  const [all, chosen, between] = ["all", "chosen", "between"].map((name) => {
    const path = document.createElementNS(SVG, "path");
    path.setAttribute("class", name);
    return path;
  });
  chart.append(all, chosen, between);
  const range = h("span", { class: "quiet range" });
  const whole = h(
    "details",
    { class: "histogram" },
    h("summary", {}, "By attribute"),
    h("div", { class: "row", title: "Drag over the bars to select a range" }, choice, range),
    chart,
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
    all.setAttribute("d", counts === null ? "" : bars(counts.counts, counts.counts));
    chosen.setAttribute("d", counts === null ? "" : bars(counts.selected, counts.counts));
    const [a, b] = dragged === null ? [0, 0] : [Math.min(...dragged), Math.max(...dragged)];
    between.setAttribute("d", `M${a * WIDTH} 0H${b * WIDTH}V${HEIGHT}H${a * WIDTH}Z`);
    range.textContent =
      dragged === null || counts === null ? "" : `${short(valueAt(a))} to ${short(valueAt(b))}`;
  };
  const valueAt = (share: number): number => {
    const { low, high } = counts!;
    // Bins of sizes are even in their logarithm.
    return attribute() === "size" ? low * (high / low) ** share : low + (high - low) * share;
  };
  const place = (event: PointerEvent): number => {
    const box = chart.getBoundingClientRect();
    return Math.min(1, Math.max(0, (event.clientX - box.left) / box.width));
  };
  chart.onpointerdown = (event) => {
    if (counts === null) return;
    chart.setPointerCapture(event.pointerId);
    dragged = [place(event), place(event)];
    draw();
  };
  chart.onpointermove = (event) => {
    if (dragged === null) return;
    dragged[1] = place(event);
    draw();
  };
  chart.onpointerup = () => {
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

/** Path of the bars of some counts; heights are logarithmic, the highest of `scale` fills the chart. */
function bars(counts: number[], scale: number[]): string {
  const most = Math.log1p(Math.max(...scale, 1));
  const step = WIDTH / counts.length;
  return counts
    .map((count, n) => {
      const height = (Math.log1p(count) / most) * (HEIGHT - 2);
      return `M${n * step} ${HEIGHT}v${-height}h${step - 1}v${height}Z`;
    })
    .join("");
}
