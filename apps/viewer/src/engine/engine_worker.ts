// The worker in which the engine runs: kerf.wasm called in time, and messages carried to and from the page.
import { makeKerf, nextMessage, putFile, saidBy, withBytes, type Kerf } from './kerf_module';
import type { WorkerOptions } from './worker_engine';

/** What the page sends: messages of the protocol, and these. */
export type ToWorker = ArrayBuffer | { start: WorkerOptions } | { again: true };
/** What it gets: messages of the protocol, and these. `ready`: the engine listens to a new connection. */
export type FromWorker = ArrayBuffer | { ready: true } | { failed: string };

const kTickMs = 1000 / 60;
/** A page that does something has a tick at once, but not more often than this. As in apps/kerf/view_server.cpp. */
const kLeastTickMs = 4;

interface Self {
  postMessage(message: FromWorker, transfer?: Transferable[]): void;
  onmessage: ((event: MessageEvent<ToWorker>) => void) | null;
}
const page = self as unknown as Self;

let kerf: Kerf | null = null;
let client = 0;
let lastTick = 0,
  nextTick = 0,
  ticking = false;
let timer: ReturnType<typeof setTimeout> | undefined;
/** Of the module, on its error stream. */
let lastWords = '';

async function fetched(address: string): Promise<Response> {
  const answer = await fetch(address);
  if (!answer.ok || !answer.body) throw new Error(`${address} is not there (${answer.status})`);
  return answer;
}

async function load(options: WorkerOptions): Promise<void> {
  const { from } = options;
  const scenes =
    typeof from === 'string'
      ? fetched(new URL('scenes.json', from).href).then((answer) => answer.json() as Promise<Record<string, string>>)
      : from.scenes;
  const packed =
    typeof from === 'string'
      ? await fetched(new URL('kerf.wasm.packed', from).href)
      : new Response(Uint8Array.from(atob(from.code), (c) => c.charCodeAt(0)));
  const code = new Response(packed.body!.pipeThrough(new DecompressionStream('gzip')), {
    headers: { 'Content-Type': 'application/wasm' },
  });
  const made = await makeKerf(code, (words) => (lastWords += words));
  const path = (name: string): string => `/scenes/${name}.toml`;
  for (const [name, text] of Object.entries(await scenes)) {
    putFile(made, path(name), text);
    withBytes(made, path(name), (at, size) => made.offer_scene(at, size));
  }
  const session = Math.floor(Math.random() * 2 ** 52) + 1;
  if (withBytes(made, path(options.scene), (at, size) => made.start(at, size, session)) !== 0)
    throw new Error(saidBy(made));
  kerf = made;
  lastTick = nextTick = performance.now();
  connect(made);
  guarded(tick);
}

function connect(k: Kerf): void {
  client = k.connect();
  page.postMessage({ ready: true });
}

/** Hands on what the engine has to say. */
function flush(k: Kerf): void {
  for (let message = nextMessage(k, client); message; message = nextMessage(k, client))
    page.postMessage(message, [message]);
}

function tick(): void {
  const now = performance.now();
  ticking = true;
  kerf!.begin_tick((now - lastTick) / 1000);
  lastTick = now;
  stepOn();
}

/** Between two steps the page is heard: its messages come before what is sent over this channel after them. */
const channel = new MessageChannel();
channel.port1.onmessage = () => guarded(stepOn);

function stepOn(): void {
  const k = kerf!;
  if (k.step_due() !== 0) {
    channel.port2.postMessage(null);
    return;
  }
  k.end_tick();
  ticking = false;
  flush(k);
  nextTick = Math.max(nextTick + kTickMs, performance.now()); // what is late is late
  waitForTick();
  if (k.tick_wanted() !== 0) tickSoon();
}

function tickSoon(): void {
  if (ticking) return;
  const soon = Math.max(performance.now(), lastTick + kLeastTickMs);
  if (soon >= nextTick) return;
  nextTick = soon;
  waitForTick();
}

function waitForTick(): void {
  clearTimeout(timer);
  timer = setTimeout(() => guarded(tick), Math.max(0, nextTick - performance.now()));
}

function receive(bytes: ArrayBuffer): void {
  const k = kerf!;
  withBytes(k, new Uint8Array(bytes), (at, size) => k.receive(client, at, size));
  flush(k); // patches before anything else
  if (k.tick_wanted() !== 0) tickSoon();
}

function fail(error: unknown): void {
  kerf = null;
  clearTimeout(timer);
  const why = error instanceof Error ? error.message : String(error);
  page.postMessage({ failed: lastWords ? `${why}: ${lastWords.trim()}` : why });
}

/** A module that has trapped is not called again. */
function guarded(call: () => void): void {
  if (!kerf) return;
  try {
    call();
  } catch (error) {
    fail(error);
  }
}

page.onmessage = ({ data }) => {
  if (data instanceof ArrayBuffer) {
    guarded(() => receive(data));
  } else if ('start' in data) {
    load(data.start).catch(fail);
  } else {
    guarded(() => {
      kerf!.disconnect(client);
      connect(kerf!);
    });
  }
};
