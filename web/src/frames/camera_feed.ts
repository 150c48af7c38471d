/** Camera messages to the server, at most one per frame, and the viewpoints of the images that answer them. */
import type { PageMessage } from "../net/protocol";
import type { Viewpoint } from "./pictures";
import type { Viewport } from "./viewport";

const REST_MS = 140;
const MAX_VIEWPOINTS = 200;

export class CameraFeed {
  seq = 0;
  private readonly viewpoints = new Map<number, Viewpoint>();
  private changed = false;
  private moving = false;
  private restTimer: ReturnType<typeof setTimeout> | undefined;
  /** Whether a button that turns the view is held: the camera then does not count as resting. */
  held = false;
  /** Whether the page draws moving frames, so that the server needs the camera only once it rests. */
  drawnHere: () => boolean = () => false;

  constructor(
    private readonly viewport: Viewport,
    private readonly send: (message: PageMessage) => boolean,
  ) {
    viewport.cameraChanges.push(() => {
      this.changed = true;
      this.moving = true;
      this.waitForRest();
    });
    viewport.beforeFrame.push(() => {
      if (this.changed && !(this.moving && this.drawnHere())) this.sendCamera();
    });
  }

  /** Whether the server knows the camera, and that the camera rests. */
  get resting(): boolean {
    return !this.changed && !this.moving;
  }

  /** Sends the current camera as resting, for example after a connection. */
  restate(): void {
    this.moving = false;
    this.sendCamera();
    this.viewport.invalidate();
  }

  /** The viewpoint of the image that answers a camera message. */
  viewpoint(seq: number): Viewpoint | null {
    return this.viewpoints.get(seq) ?? null;
  }

  private waitForRest(): void {
    clearTimeout(this.restTimer);
    this.restTimer = setTimeout(() => {
      if (this.held) this.waitForRest();
      else this.restate();
    }, REST_MS);
  }

  private sendCamera(): void {
    this.changed = false;
    const { viewport } = this;
    const seq = ++this.seq;
    this.viewpoints.set(seq, {
      viewProjection: viewport.viewProjection,
      eye: viewport.camera.position.clone(),
    });
    this.viewpoints.delete(seq - MAX_VIEWPOINTS);
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
