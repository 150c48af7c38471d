/** The scene on the page's GPU: its field, loaded once, and its edits as they arrive. */
import { TooLarge } from "../field/atlas";
import { OutOfMemory } from "../field/gl";
import type { Vec3 } from "../field/level";
import type { SceneDrawer } from "../field/scene_drawer";
import type { EditsHeader } from "../net/protocol";
import { identifyScene } from "../splats/drawer_selection";
import type { SceneKind } from "../splats/drawer_selection";

/** Color behind a scene without a background; the same as in `render_worker.encoding`. */
const DEFAULT_BACKGROUND: Vec3 = [0.13, 0.13, 0.15];

const NOT_LOADED = "the field is not loaded yet";

/** Edits on the GPU, and when their file arrived and was decoded (ms of the page's clock). */
export interface AppliedEdits {
  header: EditsHeader;
  received: number;
  decoded: number;
}

export interface SceneEvents {
  /** Another level, or other edits, can be drawn. */
  changed(): void;
  /** The share of the field's file that has arrived; null once the load is over. */
  progressed(share: number | null): void;
  /** The GPU cannot draw the scene, and the server goes on drawing. */
  failed(why: string): void;
}

export class PageScene {
  /** Reason why nothing can be drawn; null where the scene can be drawn. */
  obstacle: string | null = NOT_LOADED;
  /** The renderer of the scene that was loaded last; null before the first load. */
  drawer: SceneDrawer | null = null;
  /** The edits on the GPU. */
  edits: AppliedEdits | null = null;
  /** Number of loads of a field so far. */
  loads = 0;
  private kind: SceneKind | null = null;
  /** The name of the field that is loaded or loading; see `Hello.field`. */
  private name: string | null = null;
  /** The page's number during the failed load; a page with another number loads again. */
  private failedPage: number | null = null;
  /** The decoded edits, which supply the parts that a later file omits. */
  private decoded: unknown = null;
  private queue: Promise<void> = Promise.resolve();

  constructor(
    private readonly createDrawer: (kind: SceneKind) => SceneDrawer,
    private readonly events: SceneEvents,
  ) {}

  /** Whether the load of a field has begun. */
  get requested(): boolean {
    return this.name !== null;
  }

  /**
   * Loads the field of a name, unless it is the current one: a reconnected page, with another number, still
   * has it.
   */
  load(name: string, page: number): void {
    if (name === this.name && (this.failedPage === null || this.failedPage === page)) return;
    this.clear();
    this.name = name;
    void this.fetch(name, page);
  }

  /**
   * Decodes and applies edits in the order of their arrival; calls `done` with null, or with the reason of a
   * failure.
   */
  take(header: EditsHeader, file: ArrayBuffer, done: (why: string | null) => void): void {
    const received = performance.now();
    const { name } = this;
    this.queue = this.queue.then(async () => {
      try {
        const { drawer } = this;
        if (drawer === null) throw new Error(NOT_LOADED);
        const edits = await drawer.readEdits(file, this.decoded);
        await drawer.prepare(edits);
        if (name !== this.name) return;
        drawer.setEdits(edits);
        this.decoded = edits;
        this.edits = { header, received, decoded: performance.now() };
        done(null);
      } catch (error) {
        if (isMemoryError(error)) this.events.failed(error.message);
        done(messageOf(error));
      }
    });
  }

  /** Frees the scene; loads and edits in progress come to nothing. */
  dispose(): void {
    this.clear();
    this.drawer?.dispose();
    this.drawer = this.kind = null;
  }

  private clear(): void {
    this.name = this.failedPage = null;
    this.edits = null;
    this.decoded = null;
    this.obstacle = NOT_LOADED;
    this.drawer?.setEdits(null);
  }

  private async fetch(name: string, page: number): Promise<void> {
    try {
      this.obstacle = "the field is being loaded";
      const answer = await fetch(`field${location.search}`);
      if (name !== this.name) return;
      if (!answer.ok || answer.body === null) {
        this.obstacle = (await answer.text()) || `the field cannot be loaded (${answer.status})`;
        return;
      }
      this.loads += 1;
      const length = Number(answer.headers.get("Content-Length"));
      const { kind, source } = await identifyScene(answer.body);
      if (name !== this.name) {
        await source.cancel();
        return;
      }
      const drawer = this.selectDrawer(kind);
      await drawer.load(source, {
        onArrival: (bytes) => this.events.progressed(length > 0 ? Math.min(1, bytes / length) : 0),
        onLevel: () => {
          if (name !== this.name || !drawer.editable) return;
          drawer.background = drawer.level?.field.background ?? DEFAULT_BACKGROUND;
          this.obstacle = null;
          this.events.changed();
        },
      });
    } catch (error) {
      if (name !== this.name) return;
      if (isMemoryError(error)) this.events.failed(error.message);
      else {
        this.obstacle = messageOf(error);
        this.failedPage = page;
      }
    } finally {
      this.events.progressed(null);
    }
  }

  /** The renderer of a kind of scene: the current one, or a new one in its place. */
  private selectDrawer(kind: SceneKind): SceneDrawer {
    if (this.drawer !== null && this.kind === kind) return this.drawer;
    this.drawer?.dispose();
    this.drawer = this.createDrawer(kind);
    this.kind = kind;
    return this.drawer;
  }
}

function isMemoryError(error: unknown): error is Error {
  return error instanceof TooLarge || error instanceof OutOfMemory;
}

function messageOf(error: unknown): string {
  return error instanceof Error ? error.message : String(error);
}
