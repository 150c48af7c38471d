/**
 * State machine of the page's own rendering.
 *
 *     idle -> loading -> moving <-> all
 *     refused(why)    from any of them, until the server's edits are others
 *     closed(why)     from any of them, for good
 *
 * `idle`: the server draws, and its first complete frame is still to come, or the connection is lost. `loading`: the
 * server draws, and the page loads the scene. `moving`: the page draws while the camera or an edit moves. `all`: the
 * page draws all frames.
 */
import type { DrawnHere } from "../app/store";

export type RenderState =
  | { name: "idle" }
  | { name: "loading" }
  | { name: "moving" }
  | { name: "all" }
  | { name: "refused"; why: string; pictured: number | undefined }
  | { name: "closed"; why: string };

/** Facts that decide the next state. */
export interface RenderFacts {
  connected: boolean;
  /** The server's number of the edits that frames show; a refusal holds for one number. */
  pictured: number | undefined;
  /** Whether the load of the scene has begun. */
  requested: boolean;
  /** Whether the scene can be drawn. */
  drawable: boolean;
  /** Whether the page draws complete frames too: the finest level is loaded, and the page is fast enough. */
  drawsAll: boolean;
}

export const IDLE: RenderState = { name: "idle" };

/**
 * The state that follows from the facts; `closed` is final, and `refused` lasts as long as `pictured` is the
 * same.
 */
export function nextState(state: RenderState, facts: RenderFacts): RenderState {
  if (state.name === "closed") return state;
  if (state.name === "refused" && (!facts.connected || facts.pictured === state.pictured)) return state;
  if (!facts.connected || !facts.requested) return IDLE;
  if (!facts.drawable) return { name: "loading" };
  return { name: facts.drawsAll ? "all" : "moving" };
}

/** The frames that the page draws in a state, in the words of the protocol. */
export function drawnHere(state: RenderState): DrawnHere {
  return state.name === "moving" || state.name === "all" ? state.name : "nothing";
}

/** The reason for which the server draws, where the state has one. */
export function reasonOf(state: RenderState): string | null {
  return state.name === "refused" || state.name === "closed" ? state.why : null;
}
