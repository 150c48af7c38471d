/** Tells the server where the page looks from, once a frame, and remembers it for the pictures that answer. */
import type { PageMessage } from "../net/protocol";
import type { Viewpoint } from "./pictures";
import type { Viewport } from "./viewport";

const REST_AFTER = 140;
const REMEMBERED = 200;

export class CameraFeed {
  seq = 0;
  private readonly viewpoints = new Map<number, Viewpoint>();
  private changed = false;
  private moving = false;
  private rest: ReturnType<typeof setTimeout> | undefined;
  /** Whether a button is held that turns the view: then it does not rest. */
  held = false;
  /** Whether the page draws the moving view, so that the server need not know of it before it rests. */
  drawnHere: () => boolean = () => false;

  constructor(
    private readonly viewport: Viewport,
    private readonly send: (message: PageMessage) => boolean,
  ) {
    viewport.cameraChanged.push(() => {
      this.changed = true;
      this.moving = true;
      this.waitForRest();
    });
    viewport.beforeFrame.push(() => {
      if (this.changed && !(this.moving && this.drawnHere())) this.tell();
    });
  }

  /** Whether the server knows the camera, and that it rests. */
  get resting(): boolean {
    return !this.changed && !this.moving;
  }

  /** Sends the camera as it is, at rest: after connecting, say. */
  restate(): void {
    this.moving = false;
    this.tell();
    this.viewport.invalidate();
  }

  /** Where the picture of a camera message was taken from. */
  viewpoint(seq: number): Viewpoint | null {
    return this.viewpoints.get(seq) ?? null;
  }

  private waitForRest(): void {
    clearTimeout(this.rest);
    this.rest = setTimeout(() => {
      if (this.held) this.waitForRest();
      else this.restate();
    }, REST_AFTER);
  }

  private tell(): void {
    this.changed = false;
    const { viewport } = this;
    const seq = ++this.seq;
    this.viewpoints.set(seq, {
      viewProjection: viewport.viewProjection,
      eye: viewport.camera.position.clone(),
    });
    this.viewpoints.delete(seq - REMEMBERED);
    const { width, height } = viewport.pixels;
    this.send({
      type: "camera",
      seq,
      c2w: viewport.c2w,
      width: Math.min(4096, Math.max(16, width)),
      height: Math.min(4096, Math.max(16, height)),
      fov_y_deg: viewport.camera.fov,
      moving: this.moving,
    });
  }
}
