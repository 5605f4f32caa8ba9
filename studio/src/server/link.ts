/** The socket to the server: what is sent waits until it is accepted, however often the connection breaks. */

import type { Commit, FromPage, FromServer, Redo, State, Undo } from "./messages";

type Edit = Omit<Commit, "base"> | Omit<Undo, "base"> | Omit<Redo, "base">;

export class Link {
  /** Edits that the server has not taken yet, oldest first. */
  readonly waiting: Edit[] = [];
  revision = -1;
  onState: (state: State) => void = () => {};
  onMessage: (message: FromServer) => void = () => {};
  /** Told when the connection breaks and when it is there again. */
  onConnection: (there: boolean) => void = () => {};
  private socket: WebSocket | null = null;
  private sent = 0; // of `waiting`
  private pause = 250;
  private later: FromPage[] = [];

  constructor(private url: string) {
    this.connect();
    window.addEventListener("online", () => this.connect());
  }

  get there(): boolean {
    return this.socket?.readyState === WebSocket.OPEN;
  }

  private connect(): void {
    if (this.socket && this.socket.readyState <= WebSocket.OPEN) return;
    const socket = new WebSocket(this.url);
    this.socket = socket;
    this.sent = 0;
    let first = true;
    socket.onmessage = (event) => {
      const message = JSON.parse(event.data as string) as FromServer;
      if (first && message.type === "state") {
        first = false;
        this.pause = 250;
        this.onConnection(true);
      }
      this.hear(message);
    };
    socket.onclose = () => {
      if (this.socket !== socket) return;
      this.socket = null;
      this.onConnection(false);
      setTimeout(() => this.connect(), this.pause);
      this.pause = Math.min(this.pause * 1.6, 5000);
    };
  }

  private hear(message: FromServer): void {
    if (message.type === "accepted") {
      this.revision = message.revision;
      this.waiting.shift();
      this.sent--;
      this.flush();
    }
    if (message.type === "unkept") {
      this.sent = 0;
      setTimeout(() => this.flush(), 2000);
    }
    if (message.type === "state") {
      // As this page left it: what waits is sent now. Otherwise somebody else was there, and the page decides.
      const same = message.revision === this.revision;
      this.sent = 0;
      if (same && this.waiting.length) {
        this.flush();
        return;
      }
      this.revision = message.revision;
      this.onState(message);
      return;
    }
    this.onMessage(message);
  }

  edit(edit: Edit): void {
    this.waiting.push(edit);
    this.flush();
  }

  private flush(): void {
    // One at a time: each says which revision it changes.
    if (!this.there || this.sent) return;
    if (!this.waiting.length) {
      for (const message of this.later.splice(0)) this.socket!.send(JSON.stringify(message));
      return;
    }
    this.sent = 1;
    this.socket!.send(JSON.stringify({ ...this.waiting[0], base: this.revision }));
  }

  send(message: FromPage): boolean {
    if (!this.there) return false;
    // What is asked for is asked of what the page shows: after the edits that are on their way.
    this.later.push(message);
    this.flush();
    return true;
  }
}
