/**
 * Frame pacing: decoding of the server's frames in order, their presentation, and the request for the next
 * ones.
 */
import type { Vector3 } from "three";
import type { Figures, Store } from "../app/store";
import type { PageMessage, PictureHeader } from "../net/protocol";
import type { CameraFeed } from "./camera_feed";
import { Latency } from "./latency";
import { decode, unpack } from "./picture_message";
import type { Pictures } from "./pictures";
import { Throttle } from "./throttle";

/**
 * Milliseconds between updates of the figures while frames keep coming: a changed text costs a frame of its
 * own.
 */
const FIGURES_INTERVAL_MS = 300;

/**
 * Delay of the request for a drag's next frame, in frame times after the start of a frame with a new image. A shorter
 * delay makes the image wait here and show an older drag; a longer one lowers the frame rate.
 */
const REQUEST_DELAY_FRAMES = 0.5;

/** A frame, and when it arrived and was decoded (ms of the page's clock). */
interface ReceivedFrame {
  header: PictureHeader;
  received: number;
  decoded: number;
}

/** The parts of the editor that the pacer uses. */
export interface PacerHost {
  readonly store: Store;
  readonly viewport: {
    /** Called after the orbit's center was guessed. */
    orbitGuessed: (() => void)[];
    afterFrame: ((time: number) => void)[];
    readonly frameTime: number;
    readonly camera: { readonly position: Pick<Vector3, "toArray"> };
    orbitAt(distance: number): void;
    invalidate(): void;
  };
  readonly pictures: Pick<Pictures, "show"> & { readonly depth: Pick<Pictures["depth"], "at"> };
  readonly camera: Pick<CameraFeed, "seq" | "viewpoint">;
  isDragging(): boolean;
  /** Records the time that the server took for a frame. */
  recordServerFrame(header: PictureHeader): void;
  /** Whether the page itself has drawn the content of a frame of the server. */
  supersedes(header: PictureHeader): boolean;
  send(message: PageMessage): boolean;
  say(text: string, level: "warning"): void;
}

export class FramePacer {
  readonly latency = new Latency();
  /** Called before a frame is requested: messages that the frame should show are to be sent first. */
  beforeRequest: (() => void)[] = [];
  /** Header of the frame shown last, the page's own (number 0) or the server's. */
  last: PictureHeader | null = null;
  /** Time of the last frame or state. */
  lastNews = 0;
  private decoding: Promise<void> = Promise.resolve();
  /** Frames that the next redraw shows, and shown frames that are not on the screen yet. */
  private undrawn: ReceivedFrame[] = [];
  private drawn: ReceivedFrame[] = [];
  /** Numbers to acknowledge at the next redraw: edits it shows, and superseded frames. */
  private acknowledged: number[] = [];
  /** Number of the first camera message whose frame gives the orbit's center; null once it is known. */
  private orbitFrom: number | null = null;
  private readonly figures: Throttle<Figures>;
  /** Figures of a drag, which the next redraw shows: a text that changes between two costs a frame of its own. */
  private nextFigures: Figures | null = null;

  constructor(private readonly host: PacerHost) {
    const { viewport, store } = host;
    this.figures = new Throttle<Figures>(FIGURES_INTERVAL_MS, (figures) => store.set({ figures }));
    viewport.orbitGuessed.push(() => this.awaitOrbitCenter());
    viewport.afterFrame.push((time) => this.finishFrame(time));
  }

  /** Adds a frame drawn by the page, which the next redraw shows. */
  add(header: PictureHeader, received: number, decoded: number): void {
    this.last = header;
    this.lastNews = performance.now();
    this.setOrbitCenter(header.camera);
    this.drawn.push({ header, received, decoded });
  }

  /** Acknowledges edits, or superseded frames, at the next redraw, so that the server sends the next ones. */
  acknowledge(numbers: number[]): void {
    this.acknowledged.push(...numbers);
  }

  /** Decodes a frame of the server off the main thread, and shows frames in the order of their arrival. */
  take(message: ArrayBuffer, header: PictureHeader, start: number): void {
    const received = performance.now();
    const { picture, depth } = unpack(message, header, start);
    const decoding = decode(header, picture);
    this.decoding = this.decoding.then(async () => {
      try {
        this.show(header, await decoding, depth, received);
      } catch {
        this.host.say("a picture from the server could not be decoded", "warning");
        this.host.send({ type: "presented", picture: header.picture });
      }
    });
  }

  /** Requests the next frames while the current redraw goes to the screen. */
  requestNext(): void {
    const { host } = this;
    if (this.nextFigures !== null && this.figures.isDue) {
      this.figures.put(this.nextFigures);
      this.nextFigures = null;
    }
    const numbers = [...this.undrawn.map(({ header }) => header.picture), ...this.acknowledged];
    if (numbers.length > 0) {
      const waits = host.isDragging() && this.acknowledged.length === 0;
      const request = (): void => {
        for (const action of this.beforeRequest) action();
        for (const picture of numbers) host.send({ type: "presented", picture });
      };
      setTimeout(request, waits ? REQUEST_DELAY_FRAMES * host.viewport.frameTime : 0);
    }
    this.drawn.push(...this.undrawn);
    this.undrawn = [];
    this.acknowledged = [];
  }

  private show(
    header: PictureHeader,
    image: ImageBitmap | ImageData,
    depth: Uint16Array,
    received: number,
  ): void {
    const { host } = this;
    const decoded = performance.now();
    host.recordServerFrame(header);
    if (host.supersedes(header)) {
      if (image instanceof ImageBitmap) image.close();
      host.viewport.invalidate();
      this.acknowledge([header.picture]);
    } else {
      host.pictures.show(header, image, depth, host.camera.viewpoint(header.camera));
      this.setOrbitCenter(header.camera);
      this.last = header;
      this.undrawn.push({ header, received, decoded });
    }
    this.lastNews = performance.now();
  }

  /**
   * From inside the field, whose middle is no useful center of the orbit, the next frame's depth gives the
   * center.
   */
  private awaitOrbitCenter(): void {
    const { store, viewport, camera } = this.host;
    const { hello } = store.now;
    if (hello === null) return;
    const [low, high] = hello.bounds;
    const isInside = viewport.camera.position.toArray().every((x, i) => low[i] < x && x < high[i]);
    this.orbitFrom = isInside ? camera.seq + 1 : null;
  }

  /** Sets the awaited center of the orbit to the surface in the middle of the frame of a camera message. */
  private setOrbitCenter(camera: number): void {
    const { pictures, viewport } = this.host;
    if (this.orbitFrom === null || camera < this.orbitFrom || camera !== this.host.camera.seq) return;
    const distance = pictures.depth.at(0.5, 0.5);
    if (distance === null) return;
    viewport.orbitAt(distance);
    this.orbitFrom = null;
  }

  private finishFrame(time: number): void {
    this.latency.finishLines(time);
    const { drawn } = this;
    this.drawn = [];
    for (const frame of drawn) this.record(frame);
  }

  /** Records the latency and the figures of a frame that is on the screen. */
  private record({ header, received, decoded }: ReceivedFrame): void {
    const time = performance.now();
    const { drag, seq, camera, revision, width, full_width, full_height, whole, final } = header;
    const { render_ms: renderMs, encode_ms: encodeMs } = header;
    const presented = { time, drag, seq, camera, revision, width, fullWidth: full_width, whole, final };
    this.latency.addPresented(presented, received, decoded, renderMs, encodeMs);
    const figures: Figures = {
      perSecond: this.latency.frameRate(time),
      renderMs,
      encodeMs,
      width: full_width,
      height: full_height,
      whole,
      final,
      page: header.picture === 0,
    };
    this.nextFigures = this.host.isDragging() && !final ? figures : null;
    if (this.nextFigures === null) this.figures.put(figures, final);
  }
}
