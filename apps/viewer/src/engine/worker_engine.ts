// The engine in a worker of the page: no server. Messages are the socket's, and what a connection does by itself is said in words.
import type { EngineEvents } from './engine';
import type { FromWorker, ToWorker } from './engine_worker';
import EngineWorker from './engine_worker?worker&inline';
import { MessageEngine } from './message_engine';
import { kProtocolVersion } from './protocol';

const kFailed = 4; // code of an error, docs/protocol.md

export interface WorkerOptions {
  /** Where kerf.wasm.packed and scenes.json are: a folder's address, which ends with a slash, or what they hold, the first as base 64. */
  from: string | { code: string; scenes: Record<string, string> };
  /** The scene that is shown first. */
  scene: string;
}

export class WorkerEngine extends MessageEngine {
  private worker: Worker | null = null;

  constructor(private readonly options: WorkerOptions) {
    super();
  }

  start(events: EngineEvents): void {
    this.events = events;
    events.state('connecting');
    const worker = new EngineWorker();
    this.worker = worker;
    worker.onmessage = (event: MessageEvent<FromWorker>) => this.take(event.data);
    worker.onerror = (event) => this.end(`the engine did not start (${event.message || 'its script is missing'})`);
    this.tell({ start: this.options });
  }

  stop(): void {
    this.worker?.terminate();
    this.worker = null;
  }

  resync(): void {
    this.have(0, 0);
    this.tell({ again: true });
  }

  private take(data: FromWorker): void {
    if (data instanceof ArrayBuffer) {
      this.receive(data);
    } else if ('failed' in data) {
      this.end(data.failed);
    } else {
      this.events?.state('live');
      this.send({
        type: 'pageHello',
        protocol: kProtocolVersion,
        session: this.session,
        body: this.body,
        version: this.version,
      });
    }
  }

  /** It can't go on: the page stays as it is. */
  private end(why: string): void {
    this.stop();
    this.events?.error({
      type: 'error',
      input: 0,
      code: kFailed,
      text: `The engine in this page has ended: ${why}. Load the page again.`,
    });
    this.events?.state('lost');
  }

  private tell(message: ToWorker): void {
    this.worker?.postMessage(message);
  }

  protected post(bytes: ArrayBuffer): boolean {
    if (!this.worker) return false;
    this.worker.postMessage(bytes, [bytes]);
    return true;
  }
}
