/** The script of exported scenes: their viewer, and what tests and other pages need of it under one name. */
import { FieldRenderer } from "../field/field_renderer";
import { readEdits } from "../field/page_edits";
import { readSplatEdits } from "../splats/splat_edits";
import { SplatRenderer } from "../splats/splat_renderer";
import { SceneViewer } from "./viewer";
import type { SceneHeader } from "./viewer";

interface ViewerApi {
  FieldRenderer: typeof FieldRenderer;
  readEdits: typeof readEdits;
  SplatRenderer: typeof SplatRenderer;
  readSplatEdits: typeof readSplatEdits;
  /** The scene that the page shows. */
  viewer?: SceneViewer;
}

declare global {
  interface Window {
    cagefieldViewer: ViewerApi;
  }
}

window.cagefieldViewer = { FieldRenderer, readEdits, SplatRenderer, readSplatEdits };

function element(selector: string): HTMLElement {
  const found = document.querySelector<HTMLElement>(selector);
  if (!found) throw new Error(`the page has no ${selector}`);
  return found;
}

/** The bytes in a script of base64; the text is let go of. */
function embedded(name: string): ArrayBuffer | null {
  const script = document.getElementById(name);
  if (!script) return null;
  const text = atob(script.textContent.trim());
  script.remove();
  const bytes = new Uint8Array(text.length);
  for (let n = 0; n < text.length; n++) bytes[n] = text.charCodeAt(n);
  return bytes.buffer;
}

async function start(header: SceneHeader): Promise<void> {
  const message = element(".message");
  const say = (text: string): void => void (message.textContent = text);
  try {
    const viewer = new SceneViewer(element("canvas") as HTMLCanvasElement, header, say);
    window.cagefieldViewer.viewer = viewer;
    const [compare, play, home] = [element(".compare"), element(".play"), element(".home")];
    const field = embedded("field");
    const edits = embedded("edits");
    compare.hidden = edits === null;
    play.hidden = header.path === null;
    compare.onclick = () => {
      viewer.edited = !viewer.edited;
      compare.textContent = viewer.edited ? "Show before" : "Show after";
    };
    play.onclick = () => viewer.play(!viewer.plays);
    home.onclick = () => viewer.home();
    setInterval(() => void (play.textContent = viewer.plays ? "Stop" : "Play"), 200);
    window.addEventListener("keydown", ({ key }) => {
      if (key === "b") compare.click();
      if (key === " ") play.click();
      if (key === "h") home.click();
    });
    if (field === null) throw new Error("the file holds no field; export the scene again");
    await viewer.run(field, edits);
  } catch (error) {
    say(error instanceof Error ? error.message : String(error));
  }
}

const description = document.getElementById("scene");
if (description) void start(JSON.parse(description.textContent) as SceneHeader);
