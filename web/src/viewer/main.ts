/** The script of exported scenes: their viewer, and what tests and other pages need of it under one name. */
import { FieldRenderer } from "../field/field_renderer";
import { readEdits } from "../field/page_edits";
import { readEditsBeside } from "../splats/edits_reader";
import { readSplatEdits } from "../splats/splat_edits";
import { SplatRenderer } from "../splats/splat_renderer";
import { take } from "./sources";
import { SceneViewer } from "./viewer";
import type { SceneHeader } from "./viewer";

interface ViewerApi {
  FieldRenderer: typeof FieldRenderer;
  readEdits: typeof readEdits;
  SplatRenderer: typeof SplatRenderer;
  readSplatEdits: typeof readSplatEdits;
  readEditsBeside: typeof readEditsBeside;
  /** Takes parts of files that are in the page itself. */
  take: typeof take;
  /** The scene that the page shows. */
  viewer?: SceneViewer;
}

declare global {
  interface Window {
    cagefieldViewer: ViewerApi;
  }
}

window.cagefieldViewer = { FieldRenderer, readEdits, SplatRenderer, readSplatEdits, readEditsBeside, take };

function element(selector: string): HTMLElement {
  const found = document.querySelector<HTMLElement>(selector);
  if (!found) throw new Error(`the page has no ${selector}`);
  return found;
}

async function start(header: SceneHeader): Promise<void> {
  const message = element(".message");
  const bar = element(".arrived") as HTMLProgressElement;
  const say = (text: string): void => void (message.textContent = text);
  try {
    const viewer = new SceneViewer(element("canvas") as HTMLCanvasElement, header, say, (share) => {
      bar.value = share;
      bar.hidden = share >= 1;
    });
    window.cagefieldViewer.viewer = viewer;
    const [compare, play, home] = [element(".compare"), element(".play"), element(".home")];
    compare.hidden = !header.files.edits;
    compare.onclick = () => (viewer.edited = !viewer.edited);
    play.onclick = () => viewer.play(!viewer.plays);
    home.onclick = () => viewer.home();
    setInterval(() => {
      play.hidden = !viewer.canPlay;
      play.textContent = viewer.plays ? "Stop" : "Play";
      compare.textContent = viewer.edited ? "Show before" : "Show after";
    }, 100);
    window.addEventListener("keydown", ({ key, target }) => {
      if (key === "b") compare.click();
      // A button that has the focus takes the space itself.
      if (key === " " && !(target instanceof HTMLButtonElement)) play.click();
      if (key === "h") home.click();
    });
    await viewer.run();
  } catch (error) {
    bar.hidden = true;
    say(error instanceof Error ? error.message : String(error));
  }
}

const description = document.getElementById("scene");
if (description) void start(JSON.parse(description.textContent) as SceneHeader);
