/** What a tab keeps of itself when its page is loaded again: its tools, and where it looks from. */
import type { Editor } from "./store";

const TOOLS = "cagefield.tools";
const CAMERA = "cagefield.camera";
const KEPT = ["mode", "tool", "axes", "cage", "view", "grid", "panel"] as const;

/** The tools as they were; nothing at the first visit. */
export function recallTools(): Partial<Editor> {
  return read(TOOLS) ?? {};
}

/** The camera-to-world pose as it was, row by row; null at the first visit. */
export function recallCamera(): number[] | null {
  return read(CAMERA) as number[] | null;
}

export function remember(editor: Editor, camera: number[]): void {
  sessionStorage.setItem(TOOLS, JSON.stringify(Object.fromEntries(KEPT.map((key) => [key, editor[key]]))));
  sessionStorage.setItem(CAMERA, JSON.stringify(camera));
}

function read(key: string): unknown {
  const text = sessionStorage.getItem(key);
  if (text === null) return null;
  try {
    return JSON.parse(text);
  } catch {
    return null;
  }
}
