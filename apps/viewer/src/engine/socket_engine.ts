// The engine behind a WebSocket: kerf view.
import { MessageEngine } from './message_engine';
import type { EngineEvents } from './engine';
import { canUnpack, Unpacker } from './packed';
import { kProtocolVersion } from './protocol';

const kFirstRetryMs = 250;
const kLastRetryMs = 4000;
const kUpgradeRequired = 426; // HTTP status of the engine's address without a socket, docs/protocol.md
const kUploadWindowBytes = 1 << 20; // unsent bytes above which an upload waits

export class SocketEngine extends MessageEngine {
  private socket: WebSocket | null = null;
  private retryMs = kFirstRetryMs;
  private retryTimer = 0;
  private stopped = false;
  /** The last try was refused. */
  private refused = false;
  /** The engine's server has answered since the last try. */
  private answers = false;
  private readonly hurry = (): void => {
    if (!this.socket && !this.stopped) this.connect();
  };

  private readonly url: string;

  constructor(url: string) {
    super();
    this.url = canUnpack() ? `${url}${url.includes('?') ? '&' : '?'}packed=1` : url;
  }

  start(events: EngineEvents): void {
    this.events = events;
    this.stopped = false;
    window.addEventListener('online', this.hurry);
    this.connect();
  }

  stop(): void {
    this.stopped = true;
    window.removeEventListener('online', this.hurry);
    window.clearTimeout(this.retryTimer);
    this.socket?.close();
    this.socket = null;
  }

  resync(): void {
    this.have(0, 0);
    this.socket?.close();
  }

  private connect(): void {
    window.clearTimeout(this.retryTimer);
    if (!this.refused) this.events?.state('connecting');
    const there = this.answers;
    let opened = false;
    let socket: WebSocket;
    try {
      socket = new WebSocket(this.url);
    } catch {
      this.retry();
      return;
    }
    socket.binaryType = 'arraybuffer';
    this.socket = socket;
    socket.onopen = () => {
      opened = true;
      this.send({
        type: 'pageHello',
        protocol: kProtocolVersion,
        session: this.session,
        body: this.body,
        version: this.version,
      });
    };
    let live = false;
    const unpacker = new Unpacker(
      (message) => {
        if (this.socket === socket) this.receive(message);
      },
      (error) => this.countBad(error),
    );
    socket.onmessage = (event) => {
      if (this.socket !== socket || !(event.data instanceof ArrayBuffer)) return;
      if (!live) {
        live = true;
        this.retryMs = kFirstRetryMs;
        this.events?.state('live');
      }
      unpacker.take(event.data);
    };
    socket.onclose = () => {
      if (this.socket !== socket) return;
      this.socket = null;
      this.refused = there && !opened;
      this.events?.state(this.refused ? 'refused' : 'lost');
      this.ask();
      this.retry();
    };
    socket.onerror = () => socket.close();
  }

  /** Scripts are not told why a socket fails. A server that answers, and then opens none, refuses it. */
  private ask(): void {
    this.answers = false;
    const signal = AbortSignal.timeout(kLastRetryMs);
    fetch(this.url.replace(/^ws/, 'http'), { cache: 'no-store', signal }).then(
      (answer) => (this.answers = answer.status === kUpgradeRequired),
      () => {},
    );
  }

  private retry(): void {
    if (this.stopped) return;
    this.retryTimer = window.setTimeout(this.hurry, this.retryMs);
    this.retryMs = Math.min(2 * this.retryMs, kLastRetryMs);
  }

  protected post(bytes: ArrayBuffer): boolean {
    if (this.socket?.readyState !== WebSocket.OPEN) return false;
    this.socket.send(bytes);
    return true;
  }

  protected override async drained(): Promise<void> {
    while (this.socket && this.socket.bufferedAmount > kUploadWindowBytes) {
      await new Promise((resolve) => {
        window.setTimeout(resolve, 10);
      });
    }
  }
}
