/** The socket to the server: opened again by itself, ever more patiently, when it is lost. */
import type { PageMessage, ServerMessage } from "./protocol";

const FIRST_WAIT = 250;
const LONGEST_WAIT = 4000;

/** What of a WebSocket is used, so that tests can stand in for it. */
export type Socket = Pick<
  WebSocket,
  "binaryType" | "readyState" | "onopen" | "onclose" | "onmessage" | "send"
>;

export interface Handlers {
  opened(): void;
  /** The socket is gone; the next attempt is in `wait` milliseconds. */
  lost(wait: number): void;
  message(message: ServerMessage): void;
  /** A header, and bytes behind it; see `picture_message`. */
  binary(bytes: ArrayBuffer): void;
}

export class Connection {
  private socket: Socket | null = null;
  private wait = FIRST_WAIT;

  constructor(
    private readonly open: () => Socket,
    private readonly handlers: Handlers,
  ) {
    this.connect();
  }

  /** Sends a message; false where nobody is there to take it. */
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
      this.wait = FIRST_WAIT;
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
      this.wait = Math.min(2 * this.wait, LONGEST_WAIT);
    };
  }
}

/** The address of the server's socket, with the page's token where its link has one. */
export function socketAddress(page: Location): string {
  const address = new URL("socket", page.href);
  address.protocol = page.protocol === "https:" ? "wss:" : "ws:";
  address.search = page.search;
  address.hash = "";
  return address.href;
}
