/** WebSocket connection to the server, with reconnection after exponentially growing waits. */
import type { PageMessage, ServerMessage } from "./protocol";

const MIN_WAIT_MS = 250;
const MAX_WAIT_MS = 4000;

/** The members of a WebSocket that are used; tests substitute them. */
export type Socket = Pick<
  WebSocket,
  "binaryType" | "readyState" | "onopen" | "onclose" | "onmessage" | "send"
>;

export interface Handlers {
  opened(): void;
  /** The connection is lost; the next attempt follows in `wait` milliseconds. */
  lost(wait: number): void;
  message(message: ServerMessage): void;
  /** A binary message; see `picture_message`. */
  binary(bytes: ArrayBuffer): void;
}

export class Connection {
  private socket: Socket | null = null;
  private wait = MIN_WAIT_MS;

  constructor(
    private readonly open: () => Socket,
    private readonly handlers: Handlers,
  ) {
    this.connect();
  }

  /** Sends a message; false without a connection. */
  send(message: PageMessage): boolean {
    if (this.socket?.readyState !== 1) return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }

  private connect(): void {
    const socket = this.open();
    this.socket = socket;
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.wait = MIN_WAIT_MS;
      this.handlers.opened();
    };
    socket.onmessage = ({ data }: MessageEvent<string | ArrayBuffer>) => {
      if (typeof data === "string") this.handlers.message(JSON.parse(data) as ServerMessage);
      else this.handlers.binary(data);
    };
    socket.onclose = () => {
      this.socket = null;
      this.handlers.lost(this.wait);
      setTimeout(() => this.connect(), this.wait);
      this.wait = Math.min(2 * this.wait, MAX_WAIT_MS);
    };
  }
}

/** Address of the server's socket, with the token of the page's link, if any. */
export function socketAddress(page: Location): string {
  const address = new URL("socket", page.href);
  address.protocol = page.protocol === "https:" ? "wss:" : "ws:";
  address.search = page.search;
  address.hash = "";
  return address.href;
}
