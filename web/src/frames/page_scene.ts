/** The scene as the page's GPU has it: its field, loaded once, and its edits as they come. */
import { OutOfMemory } from "../field/gl";
import { TooLarge } from "../field/atlas";
import type { SceneDrawer } from "../field/scene_drawer";
import type { Vec3 } from "../field/level";
import { readAnyEdits } from "../splats/any_renderer";
import type { AnyEdits } from "../splats/any_renderer";
import type { EditsHeader } from "../net/protocol";

/** What is behind a scene that has no background; as in `render_worker.encoding`. */
const BEHIND: Vec3 = [0.13, 0.13, 0.15];

/** Edits that are shown, or would be. */
export interface TakenEdits {
  header: EditsHeader;
  /** When they came, and were unpacked. */
  received: number;
  taken: number;
}

export interface SceneEvents {
  /** More of the field, or other edits, can be drawn. */
  changed(): void;
  /** The share of the field's file that has come; null once all of it has. */
  arrived(share: number | null): void;
  /** The GPU cannot draw the scene; the server goes on to. */
  failed(why: string): void;
}

export class PageScene {
  /** Why nothing can be drawn; null where it can. */
  why: string | null = "the field is not loaded yet";
  /** The edits that are on the GPU. */
  edits: TakenEdits | null = null;
  /** How often a field was loaded. */
  loads = 0;
  /** The name of the field that is there or on its way; see `Hello.field`. */
  private name: string | null = null;
  /** The page's number when loading it failed; a page that has another one since tries again. */
  private failedAs: number | null = null;
  private unpacked: AnyEdits | null = null;
  private chain: Promise<void> = Promise.resolve();

  constructor(
    private readonly drawer: SceneDrawer<AnyEdits>,
    private readonly events: SceneEvents,
  ) {}

  /** Loads the field of a name, unless it is the one that is there: pages that reconnect, as another one, have it. */
  load(name: string, page: number): void {
    if (name === this.name && (this.failedAs === null || this.failedAs === page)) return;
    this.forget();
    this.name = name;
    void this.fetch(name, page);
  }

  /** Takes a message's edits after those before it; calls `done` with whether they are there now. */
  take(header: EditsHeader, file: ArrayBuffer, done: (why: string | null) => void): void {
    const received = performance.now();
    const { name } = this;
    this.chain = this.chain.then(async () => {
      try {
        const edits = await readAnyEdits(file, this.unpacked);
        await this.drawer.prepare(edits);
        if (name !== this.name) return;
        this.drawer.setEdits(edits);
        this.unpacked = edits;
        this.edits = { header, received, taken: performance.now() };
        done(null);
      } catch (error) {
        if (error instanceof TooLarge || error instanceof OutOfMemory) this.events.failed(error.message);
        done(said(error));
      }
    });
  }

  /** Lets go of a field that is no longer the editor's. */
  forget(): void {
    this.name = this.failedAs = null;
    this.edits = this.unpacked = null;
    this.why = "the field is not loaded yet";
    this.drawer.setEdits(null);
  }

  private async fetch(name: string, page: number): Promise<void> {
    try {
      this.why = "the field is being loaded";
      const answer = await fetch(`field${location.search}`);
      if (name !== this.name) return;
      if (!answer.ok || answer.body === null) {
        this.why = (await answer.text()) || `the field cannot be loaded (${answer.status})`;
        return;
      }
      this.loads += 1;
      const length = Number(answer.headers.get("Content-Length"));
      await this.drawer.load(answer.body, {
        onArrival: (bytes) => this.events.arrived(length > 0 ? Math.min(1, bytes / length) : 0),
        onLevel: () => {
          if (name !== this.name || !this.drawer.editable) return;
          this.drawer.background = this.drawer.level?.field.background ?? BEHIND;
          this.why = null;
          this.events.changed();
        },
      });
    } catch (error) {
      if (name !== this.name) return;
      if (error instanceof TooLarge || error instanceof OutOfMemory) this.events.failed(error.message);
      else {
        this.why = said(error);
        this.failedAs = page;
      }
    } finally {
      this.events.arrived(null);
    }
  }
}

function said(error: unknown): string {
  return error instanceof Error ? error.message : String(error);
}
