import { afterEach, beforeEach, describe, expect, it, vi } from 'vitest';
import type { EngineEvents } from '../src/engine/engine';
import { decodePageMessage, encodeEngineMessage, type PageMessage } from '../src/engine/protocol';
import { SocketEngine } from '../src/engine/socket_engine';

/** The other end of a connection that only exists here. */
class FakeSocket {
  static all: FakeSocket[] = [];
  static readonly OPEN = 1;
  readyState = 0;
  bufferedAmount = 0;
  binaryType = '';
  onopen: (() => void) | null = null;
  onmessage: ((e: { data: unknown }) => void) | null = null;
  onclose: (() => void) | null = null;
  onerror: (() => void) | null = null;
  sent: PageMessage[] = [];
  constructor(readonly url: string) {
    FakeSocket.all.push(this);
  }
  send(bytes: ArrayBuffer): void {
    this.sent.push(decodePageMessage(bytes));
  }
  open(): void {
    this.readyState = 1;
    this.onopen?.();
  }
  give(data: unknown): void {
    this.onmessage?.({ data });
  }
  close(): void {
    if (this.readyState === 3) return;
    this.readyState = 3;
    this.onclose?.();
  }
}

const hello = (session: bigint): ArrayBuffer =>
  encodeEngineMessage({ type: 'hello', session, client: 1, readOnly: false, tick: 60, name: 's', json: '{}' });

let states: string[], errors: unknown[], answer: () => Promise<{ status: number }>;
const events = new Proxy({} as EngineEvents, {
  get: (_, name) => (x: unknown) => {
    if (name === 'state') states.push(x as string);
  },
});

beforeEach(() => {
  vi.useFakeTimers();
  FakeSocket.all = [];
  states = [];
  errors = [];
  answer = () => Promise.reject(new Error('nobody listens'));
  vi.stubGlobal('fetch', () => answer());
  vi.stubGlobal('WebSocket', FakeSocket);
  vi.stubGlobal(
    'window',
    Object.assign(new EventTarget(), {
      setTimeout: (f: () => void, ms: number) => setTimeout(f, ms),
      clearTimeout: (t: number) => clearTimeout(t),
    }),
  );
  vi.spyOn(console, 'error').mockImplementation((e) => {
    errors.push(e);
  });
});
afterEach(() => {
  vi.useRealTimers();
  vi.unstubAllGlobals();
  vi.restoreAllMocks();
});

describe('the socket engine', () => {
  it('says hello, and is live once the engine answers', () => {
    const e = new SocketEngine('ws://x/engine');
    e.start(events);
    const s = FakeSocket.all[0]!;
    s.open();
    expect(s.sent).toEqual([{ type: 'pageHello', protocol: 7, session: 0n, body: 0, version: 0 }]);
    expect(states).toEqual(['connecting']);
    s.give(hello(9n));
    expect(states).toEqual(['connecting', 'live']);
    e.stop();
  });
  it('connects again with growing pauses, and resumes with session and version', async () => {
    const e = new SocketEngine('ws://x/engine');
    e.start(events);
    FakeSocket.all[0]!.open();
    FakeSocket.all[0]!.give(hello(77n));
    e.have(1, 5);
    FakeSocket.all[0]!.close();
    expect(states).toEqual(['connecting', 'live', 'lost']);
    expect(e.tool({ tool: 0, phase: 0, modifiers: 0, samples: [] })).toBeGreaterThan(0); // goes nowhere, harms nothing
    const waits: number[] = [];
    for (let i = 1; i < 7; i++) {
      const t = Date.now();
      while (FakeSocket.all.length === i) await vi.advanceTimersByTimeAsync(10);
      waits.push(Date.now() - t);
      if (i < 6) FakeSocket.all[i]!.close();
    }
    expect(waits).toEqual([250, 500, 1000, 2000, 4000, 4000]);
    const s = FakeSocket.all[6]!;
    s.open();
    expect(s.sent).toEqual([{ type: 'pageHello', protocol: 7, session: 77n, body: 1, version: 5 }]);
    s.give(hello(77n));
    s.close();
    const t = Date.now();
    while (FakeSocket.all.length === 7) await vi.advanceTimersByTimeAsync(10);
    expect(Date.now() - t).toBe(250);
    e.stop();
    await vi.advanceTimersByTimeAsync(20000);
    expect(FakeSocket.all.length).toBe(8);
  });
  it('tells a server that is gone from one that refuses it, and goes on trying', async () => {
    const e = new SocketEngine('ws://x/engine');
    e.start(events);
    const last = (): FakeSocket => FakeSocket.all[FakeSocket.all.length - 1]!;
    const fails = async (): Promise<string> => {
      last().close();
      const said = states[states.length - 1]!,
        tries = FakeSocket.all.length;
      while (FakeSocket.all.length === tries) await vi.advanceTimersByTimeAsync(10);
      return said;
    };
    last().open();
    last().give(hello(5n));
    expect(await fails()).toBe('lost');
    expect(await fails()).toBe('lost');
    // It answers again: the try that failed meanwhile tells nothing, the next one does.
    answer = () => Promise.resolve({ status: 426 });
    expect(await fails()).toBe('lost');
    expect(await fails()).toBe('refused');
    expect(await fails()).toBe('refused');
    expect(states.slice(-2)).toEqual(['refused', 'refused']);
    // Another server has the port; then nobody.
    answer = () => Promise.resolve({ status: 404 });
    expect(await fails()).toBe('refused');
    expect(await fails()).toBe('lost');
    answer = () => Promise.resolve({ status: 426 });
    await fails();
    expect(await fails()).toBe('refused');
    last().open();
    last().give(hello(5n));
    expect(states[states.length - 1]).toBe('live');
    expect(await fails()).toBe('lost');
    e.stop();
  });
  it('asks for everything after losing track', async () => {
    const e = new SocketEngine('ws://x/engine');
    e.start(events);
    FakeSocket.all[0]!.open();
    FakeSocket.all[0]!.give(hello(3n));
    e.have(1, 5);
    e.resync();
    await vi.advanceTimersByTimeAsync(300);
    FakeSocket.all[1]!.open();
    expect(FakeSocket.all[1]!.sent[0]).toMatchObject({ session: 3n, body: 0, version: 0 });
    e.stop();
  });
  it('counts bad messages and goes on', () => {
    const e = new SocketEngine('ws://x/engine');
    e.start(events);
    const s = FakeSocket.all[0]!;
    s.open();
    s.give(hello(1n));
    s.give(new ArrayBuffer(5));
    s.give('text');
    const bad = hello(1n);
    new DataView(bad).setUint16(2, 9, true);
    s.give(bad);
    expect(e.badMessages).toBe(2);
    expect(errors.length).toBe(2);
    s.give(hello(4n));
    e.have(2, 2);
    expect(states).toEqual(['connecting', 'live']);
    e.stop();
  });
  it('splits long strokes and uploads', async () => {
    const e = new SocketEngine('ws://x/engine');
    e.start(events);
    const s = FakeSocket.all[0]!;
    s.open();
    const sample = { time: 1, origin: [0, 0, 0] as const, direction: [0, 0, 1] as const, pressure: 0 };
    const last = e.tool({ tool: 0, phase: 0, modifiers: 0, samples: Array.from({ length: 2300 }, () => sample) });
    const tools = s.sent.filter((m) => m.type === 'tool');
    expect(tools.map((m) => [m.phase, m.samples.length])).toEqual([
      [0, 1000],
      [1, 1000],
      [1, 300],
    ]);
    expect(tools[2]!.input).toBe(last);
    const up = e.tool({ tool: 0, phase: 2, modifiers: 0, samples: Array.from({ length: 1001 }, () => sample) });
    expect(
      s.sent
        .filter((m) => m.type === 'tool')
        .slice(3)
        .map((m) => m.phase),
    ).toEqual([1, 2]);
    expect(up).toBe(last + 2);
    const bytes = new Uint8Array(100000).map((_, i) => i);
    await e.upload(3, 1, 'm.obj', bytes);
    await e.upload(3, 0, 'empty.obj', new Uint8Array(0));
    const uploads = s.sent.filter((m) => m.type === 'upload');
    expect(uploads.map((m) => [m.offset, m.bytes.length, m.total])).toEqual([
      [0, 49152, 100000],
      [49152, 49152, 100000],
      [98304, 1696, 100000],
      [0, 0, 0],
    ]);
    expect(uploads[1]!.bytes[0]).toBe(49152 % 256);
    s.close();
    await expect(e.upload(4, 0, 'x', bytes)).rejects.toThrow(/lost/);
    e.stop();
  });
});
