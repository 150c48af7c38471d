/** Pictures from when they come, or the page draws them, until they are on the screen and the next ones are asked for. */
import type { App } from "../app/app";
import { Latency } from "./latency";
import { decode, unpack } from "./picture_message";
import type { PictureHeader } from "../net/protocol";
import type { Figures } from "../app/store";
import { Throttle } from "./throttle";

/** Milliseconds between figures while pictures keep coming: a text that changes costs a frame of its own. */
const FIGURES_EVERY = 300;

/**
 * When a drag's next picture is asked for, frames after the beginning of one that draws a picture. Sooner, and it
 * would wait here to be drawn and show an older drag; later, and there would be fewer of them.
 */
const ASKED_AFTER = 0.5;

/** A picture, and when it came and was decoded. */
interface Arrived {
  header: PictureHeader;
  received: number;
  decoded: number;
}

export class Presenter {
  readonly latency = new Latency();
  /** Called before a picture is asked for: what it should show is to be sent. */
  beforeAsking: (() => void)[] = [];
  last: PictureHeader | null = null;
  /** When a picture or a state last came. */
  news = 0;
  private chain: Promise<void> = Promise.resolve();
  /** Pictures that the next frame draws, and those drawn that are not on the screen yet. */
  private undrawn: Arrived[] = [];
  private drawn: Arrived[] = [];
  /** Edits that the next frame shows, and pictures that nobody gets to see. */
  private taken: number[] = [];
  /** The first camera message whose picture says what to orbit around, where that is yet to be seen. */
  private orbitFrom: number | null = null;
  /** The figures below the picture: those of the last one, however soon it came after the one before it. */
  private readonly figures: Throttle<Figures>;

  constructor(private readonly app: App) {
    const { viewport, store } = app;
    this.figures = new Throttle<Figures>(FIGURES_EVERY, (figures) => store.set({ figures }));
    viewport.guessed.push(() => this.orbitGuessed());
    viewport.afterFrame.push((time) => this.framed(time));
  }

  /** Takes note of a picture of the page's own, which the next frame shows. */
  drew(header: PictureHeader, received: number, decoded: number): void {
    this.last = header;
    this.news = performance.now();
    this.orbitSeen(header.camera);
    this.drawn.push({ header, received, decoded });
  }

  /** The next frame shows edits, or a picture came too late: the server may send the next ones. */
  acknowledge(edits: number[]): void {
    this.taken.push(...edits);
  }

  /** Decodes a picture away from the main thread, and shows pictures in the order in which they came. */
  take(bytes: ArrayBuffer, header: PictureHeader, start: number): void {
    const { app } = this;
    const received = performance.now();
    const { picture, depth } = unpack(bytes, header, start);
    const decoding = decode(header, picture);
    this.chain = this.chain.then(async () => {
      try {
        const image = await decoding;
        const decoded = performance.now();
        app.page.served(header);
        // Of what the page draws itself, what the server sends comes too late.
        if (app.page.outdates(header)) {
          if (image instanceof ImageBitmap) image.close();
          app.viewport.invalidate();
          this.acknowledge([header.picture]);
        } else {
          app.pictures.show(header, image, depth, app.camera.viewpoint(header.camera));
          this.orbitSeen(header.camera);
          this.last = header;
          this.undrawn.push({ header, received, decoded });
        }
        this.news = performance.now();
      } catch {
        app.say("a picture from the server could not be decoded", "warning");
        app.send({ type: "presented", picture: header.picture });
      }
    });
  }

  /** Asks for the next picture while the frame with this one is drawn and goes to the screen. */
  askForMore(): void {
    const pictures = this.undrawn.map(({ header }) => header.picture);
    const numbers = [...pictures, ...this.taken];
    if (numbers.length > 0) {
      const waits = this.app.drag !== null && this.taken.length === 0;
      setTimeout(
        () => {
          for (const action of this.beforeAsking) action();
          for (const picture of numbers) this.app.send({ type: "presented", picture });
        },
        waits ? ASKED_AFTER * this.app.viewport.frameTime : 0,
      );
    }
    this.drawn.push(...this.undrawn);
    this.undrawn = [];
    this.taken = [];
  }

  /** From amid the field, whose middle is nothing to orbit around, the next picture says what is. */
  private orbitGuessed(): void {
    const { store, viewport, camera } = this.app;
    const { hello } = store.now;
    if (hello === null) return;
    const [low, high] = hello.bounds;
    const amid = viewport.camera.position.toArray().every((x, i) => low[i] < x && x < high[i]);
    this.orbitFrom = amid ? camera.seq + 1 : null;
  }

  /** Once: the orbit's centre is what the picture of a camera message shows in the middle of the view. */
  private orbitSeen(camera: number): void {
    const { pictures, viewport } = this.app;
    if (this.orbitFrom === null || camera < this.orbitFrom || camera !== this.app.camera.seq) return;
    const distance = pictures.depth.at(0.5, 0.5);
    if (distance === null) return;
    viewport.orbitAt(distance);
    this.orbitFrom = null;
  }

  private framed(time: number): void {
    this.latency.framed(time);
    const shown = this.drawn;
    this.drawn = [];
    for (const picture of shown) this.presented(picture);
  }

  private presented({ header, received, decoded }: Arrived): void {
    const time = performance.now();
    const { drag, seq, camera, revision, width, full_width, final, render_ms, encode_ms } = header;
    this.latency.shown(
      { time, drag, seq, camera, revision, width, fullWidth: full_width, final },
      received,
      decoded,
      render_ms,
      encode_ms,
    );
    const figures: Figures = {
      perSecond: this.latency.perSecond(time),
      renderMs: render_ms,
      encodeMs: encode_ms,
      width: full_width,
      height: header.full_height,
      final,
      page: header.picture === 0,
    };
    this.figures.put(figures, final);
  }
}
