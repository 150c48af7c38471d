/** State of a tab that survives a reload: the tools, and the camera. */
import type { Editor } from "./store";

const TOOLS = "cagefield.tools";
const CAMERA = "cagefield.camera";
const TOOL_KEYS = ["mode", "tool", "axes", "cage", "view", "grid", "panel"] as const;

/** The stored tools; empty at the first visit. */
export function recallTools(): Partial<Editor> {
  return read(TOOLS) ?? {};
}

/** The stored camera-to-world matrix, row by row; null at the first visit. */
export function recallCamera(): number[] | null {
  return read(CAMERA) as number[] | null;
}

export function storeSession(editor: Editor, camera: number[]): void {
  sessionStorage.setItem(
    TOOLS,
    JSON.stringify(Object.fromEntries(TOOL_KEYS.map((key) => [key, editor[key]]))),
  );
  sessionStorage.setItem(CAMERA, JSON.stringify(camera));
}

/** Whether something is used for the first time in this browser; false from then on. */
export function isFirstUse(name: string): boolean {
  if (localStorage.getItem(name) !== null) return false;
  localStorage.setItem(name, "used");
  return true;
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
