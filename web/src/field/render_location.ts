/** Who draws sooner, the page or the server: both are measured, in milliseconds a pixel. */

/** Pictures of the page that are measured before it is judged. */
const MEASURED = 6;

/** How many times as long the page may take: its pictures come at once, the server's have a way to go. */
const LENIENCE = 1.25;

/** Milliseconds in which the page may draw a whole picture whatever the server takes. */
export const WHOLE = 200;

export class Choice {
  /** Milliseconds a pixel; null before there was a picture. */
  page: number | null = null;
  server: number | null = null;
  private pictures = 0;
  private wasMoving = false;
  private isWhole = false;

  /** The page has drawn a picture, or a part of one, of so many pixels. */
  drew(pixels: number, milliseconds: number): void {
    this.pictures += 1;
    this.page = smoothed(this.page, milliseconds / Math.max(1, pixels));
  }

  /** The server has; pictures of what moves, which are quicker, say more than those at rest. */
  served(pixels: number, milliseconds: number, moving: boolean): void {
    if (this.wasMoving && !moving) return;
    this.server = smoothed(
      moving && !this.wasMoving ? null : this.server,
      milliseconds / Math.max(1, pixels),
    );
    this.wasMoving = moving;
  }

  /** Whether the server draws what moves sooner, as far as both are known. */
  get serverIsFaster(): boolean {
    return (
      this.page !== null &&
      this.server !== null &&
      this.pictures >= MEASURED &&
      this.page > LENIENCE * this.server
    );
  }

  /** Whether the page draws pictures at rest of so many pixels, too: they come soon, or sooner than the server's. */
  whole(pixels: number): boolean {
    if (this.page === null) return false;
    // Not to and fro where it is close.
    const slack = this.isWhole ? 1.5 : 1;
    this.isWhole =
      this.page * pixels <= slack * WHOLE || (this.server !== null && this.page <= slack * this.server);
    return this.isWhole;
  }

  /** Both rates in words, for whoever wants to know why. */
  get words(): string {
    const rate = (cost: number | null): string =>
      cost === null
        ? "not measured"
        : `${(1e-3 / Math.max(cost, 1e-9)).toPrecision(2)} million pixels a second`;
    return `this page ${rate(this.page)}, the server ${rate(this.server)}`;
  }
}

function smoothed(before: number | null, now: number): number {
  return before === null ? now : before + 0.3 * (now - before);
}

/** Bytes of textures that a field may take on a device of so many GiB, where the browser says how many. */
export function memoryLimit(deviceMemory: number | undefined): number {
  return Math.min(768, Math.max(96, (deviceMemory ?? 8) * 128)) * 2 ** 20;
}
