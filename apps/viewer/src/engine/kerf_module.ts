// kerf.wasm (apps/wasm): what it exports, what it needs of a system, and how bytes go in and out.

export interface Kerf {
  memory: WebAssembly.Memory;
  _initialize(): void;
  allocate(size: number): number;
  release(at: number): void;
  text(): number;
  text_size(): number;
  put_file(path: number, pathSize: number, bytes: number, size: number): void;
  offer_scene(path: number, pathSize: number): number;
  start(path: number, pathSize: number, session: number): number;
  connect(): number;
  disconnect(client: number): void;
  receive(client: number, bytes: number, size: number): void;
  next(client: number): number;
  next_size(): number;
  gives_up(client: number): number;
  begin_tick(seconds: number): void;
  step_due(): number;
  end_tick(): void;
  tick_wanted(): number;
  replay(path: number, pathSize: number): number;
}

const kNoSystem = 52; // ENOSYS of WASI

/** What the C library asks of its system: a clock, and where to say its last words. Files are the module's own. */
function system(memory: () => DataView, say: (words: string) => void): WebAssembly.ModuleImports {
  const calls: Record<string, (...a: never[]) => unknown> = {
    clock_time_get: (id: number, _precision: bigint, out: number) => {
      const ms = id === 0 ? performance.timeOrigin + performance.now() : performance.now();
      memory().setBigUint64(out, BigInt(Math.round(ms * 1e6)), true);
      return 0;
    },
    fd_write: (_file: number, parts: number, count: number, written: number) => {
      const view = memory();
      let size = 0;
      for (let i = 0; i < count; i++) {
        const at = view.getUint32(parts + 8 * i, true),
          n = view.getUint32(parts + 8 * i + 4, true);
        say(new TextDecoder().decode(new Uint8Array(view.buffer, at, n)));
        size += n;
      }
      view.setUint32(written, size, true);
      return 0;
    },
    environ_sizes_get: (count: number, size: number) => {
      memory().setUint32(count, 0, true);
      memory().setUint32(size, 0, true);
      return 0;
    },
    environ_get: () => 0,
    random_get: (at: number, size: number) => {
      crypto.getRandomValues(new Uint8Array(memory().buffer, at, size));
      return 0;
    },
    proc_exit: () => {
      throw new Error('it gave up');
    },
  };
  return new Proxy(calls, {
    get: (all, name) => all[name as string] ?? (() => kNoSystem),
  }) as WebAssembly.ModuleImports;
}

/** `say` gets what the module writes to its error stream, which it does only before it ends. */
export async function makeKerf(code: BufferSource | Response, say: (words: string) => void): Promise<Kerf> {
  let kerf: Kerf | null = null;
  const imports = { wasi_snapshot_preview1: system(() => new DataView(kerf!.memory.buffer), say) };
  const made =
    code instanceof Response
      ? await WebAssembly.instantiateStreaming(code, imports)
      : await WebAssembly.instantiate(code, imports);
  kerf = made.instance.exports as unknown as Kerf;
  kerf._initialize();
  return kerf;
}

/** Calls with bytes in the module's memory, which are gone after the call. */
export function withBytes<T>(kerf: Kerf, data: string | Uint8Array, use: (at: number, size: number) => T): T {
  const bytes = typeof data === 'string' ? new TextEncoder().encode(data) : data;
  const at = kerf.allocate(Math.max(1, bytes.length));
  if (at === 0) throw new Error('there is not enough memory');
  new Uint8Array(kerf.memory.buffer, at, bytes.length).set(bytes);
  const result = use(at, bytes.length);
  kerf.release(at);
  return result;
}

export function putFile(kerf: Kerf, path: string, content: string | Uint8Array): void {
  withBytes(kerf, path, (p, pn) => withBytes(kerf, content, (c, cn) => kerf.put_file(p, pn, c, cn)));
}

/** What the last call that failed has to say. */
export function saidBy(kerf: Kerf): string {
  return new TextDecoder().decode(new Uint8Array(kerf.memory.buffer, kerf.text(), kerf.text_size()).slice());
}

/** The next message for a page, as bytes of its own. */
export function nextMessage(kerf: Kerf, client: number): ArrayBuffer | null {
  const at = kerf.next(client);
  return at === 0 ? null : new Uint8Array(kerf.memory.buffer, at, kerf.next_size()).slice().buffer;
}
