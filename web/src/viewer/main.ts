/** Script of exported scenes: the viewer, and the renderers under one global name. */
import { FieldRenderer } from "../field/field_renderer";
import { readEdits } from "../field/page_edits";
import { readEditsInWorker } from "../splats/edits_reader";
import { readSplatEdits } from "../splats/splat_edits";
import { SplatRenderer } from "../splats/splat_renderer";
import { HotspotMarks } from "./hotspots";
import { showScale } from "./scale_bar";
import { takeBytes } from "./sources";
import { SceneViewer } from "./viewer";
import type { SceneHeader } from "./viewer";

interface ViewerApi {
  FieldRenderer: typeof FieldRenderer;
  readEdits: typeof readEdits;
  SplatRenderer: typeof SplatRenderer;
  readSplatEdits: typeof readSplatEdits;
  readEditsBeside: typeof readEditsInWorker;
  /** Takes chunks of embedded files. */
  take: typeof takeBytes;
  /** The viewer of the page. */
  viewer?: SceneViewer;
  hotspots?: HotspotMarks;
}

declare global {
  interface Window {
    cagefieldViewer: ViewerApi;
  }
}

window.cagefieldViewer = {
  FieldRenderer,
  readEdits,
  SplatRenderer,
  readSplatEdits,
  readEditsBeside: readEditsInWorker,
  take: takeBytes,
};

function findElement(selector: string): HTMLElement {
  const found = document.querySelector<HTMLElement>(selector);
  if (!found) throw new Error(`the page has no ${selector}`);
  return found;
}

async function start(header: SceneHeader): Promise<void> {
  const message = findElement(".message");
  const bar = findElement(".arrived") as HTMLProgressElement;
  const say = (text: string): void => void (message.textContent = text);
  try {
    const viewer = new SceneViewer(findElement("canvas") as HTMLCanvasElement, header, say, (share) => {
      bar.value = share;
      bar.hidden = share >= 1;
    });
    window.cagefieldViewer.viewer = viewer;
    const [compare, play, home] = [findElement(".compare"), findElement(".play"), findElement(".home")];
    compare.hidden = !header.files.edits;
    compare.onclick = () => (viewer.edited = !viewer.edited);
    play.onclick = () => viewer.play(!viewer.plays);
    home.onclick = () => viewer.home();
    const marks = connectHotspots(viewer, header);
    const scaleBar = findElement(".scale");
    viewer.onFrame = () => {
      marks.arrange();
      if (header.meters_per_unit !== undefined)
        showScale(scaleBar, viewer.orbit, viewer.focal, header.meters_per_unit);
    };
    setInterval(() => {
      play.hidden = !viewer.canPlay;
      play.textContent = viewer.plays ? "Stop" : "Play";
      compare.textContent = viewer.edited ? "Show before" : "Show after";
    }, 100);
    window.addEventListener("keydown", ({ key, target }) => {
      if (key === "b") compare.click();
      // A focused button handles the space key itself.
      if (key === " " && !(target instanceof HTMLButtonElement)) play.click();
      if (key === "h") home.click();
      if (key === "ArrowRight") marks.step(1);
      if (key === "ArrowLeft") marks.step(-1);
      if (key === "Escape") marks.close();
    });
    await viewer.run();
  } catch (error) {
    bar.hidden = true;
    say(error instanceof Error ? error.message : String(error));
  }
}

/** Connects the marks, the card and the buttons of the tour. */
function connectHotspots(viewer: SceneViewer, header: SceneHeader): HotspotMarks {
  const card = findElement(".card");
  const marks = new HotspotMarks(viewer, header.hotspots ?? [], findElement(".hotspots"), card);
  window.cagefieldViewer.hotspots = marks;
  for (const [selector, by] of [
    [".previous", -1],
    [".next", 1],
  ] as const) {
    const button = findElement(selector);
    button.hidden = marks.hotspots.length === 0;
    button.onclick = () => marks.step(by);
  }
  findElement(".close").onclick = () => marks.close();
  return marks;
}

const description = document.getElementById("scene");
if (description) void start(JSON.parse(description.textContent) as SceneHeader);
