// The engine as WebAssembly (build/wasm/kerf.wasm), as the page's worker uses it. Left out where it has not been built, unless KERF_NEEDS_MODULE is set.
import { existsSync, readFileSync } from 'node:fs';
import { fileURLToPath } from 'node:url';
import { describe, expect, it } from 'vitest';
import { makeKerf, nextMessage, putFile, saidBy, withBytes, type Kerf } from '../src/engine/kerf_module';
import { Phase, ToolCode, decodeEngineMessage, encodePageMessage, kProtocolVersion } from '../src/engine/protocol';
import type { EngineMessage, PageMessage, ToolSample } from '../src/engine/protocol';

const root = fileURLToPath(new URL('../../..', import.meta.url));
const code = `${root}/build/wasm/kerf.wasm`;

async function start(scene: string): Promise<{ kerf: Kerf; client: number }> {
  const kerf = await makeKerf(readFileSync(code), () => {});
  putFile(kerf, `/scenes/${scene}.toml`, readFileSync(`${root}/scenes/${scene}.toml`));
  const path = `/scenes/${scene}.toml`;
  expect(withBytes(kerf, path, (at, n) => kerf.offer_scene(at, n))).toBe(0);
  expect(withBytes(kerf, path, (at, n) => kerf.start(at, n, 1))).toBe(0);
  return { kerf, client: kerf.connect() };
}
function send(kerf: Kerf, client: number, message: PageMessage): void {
  const bytes = new Uint8Array(encodePageMessage(message));
  withBytes(kerf, bytes, (at, n) => kerf.receive(client, at, n));
}
function heard(kerf: Kerf, client: number): EngineMessage[] {
  const all: EngineMessage[] = [];
  for (let m = nextMessage(kerf, client); m; m = nextMessage(kerf, client)) all.push(decodeEngineMessage(m));
  return all;
}
function tick(kerf: Kerf, seconds: number): void {
  kerf.begin_tick(seconds);
  while (kerf.step_due() !== 0);
  kerf.end_tick();
}
const hello = { type: 'pageHello', protocol: kProtocolVersion, session: 0n, body: 0, version: 0 } as const;

describe.skipIf(!existsSync(code) && !process.env.KERF_NEEDS_MODULE)('kerf.wasm', () => {
  it('says hello and sends the body', async () => {
    const { kerf, client } = await start('sheet');
    send(kerf, client, hello);
    const types = heard(kerf, client).map((m) => m.type);
    expect(types).toContain('hello');
    expect(types).toContain('body');
  });

  it('cuts a sheet in two along a line of view rays', async () => {
    const { kerf, client } = await start('sheet');
    send(kerf, client, hello);
    const body = heard(kerf, client).find((m) => m.type === 'body');
    expect(body).toBeDefined();
    tick(kerf, 1 / 60);
    heard(kerf, client);
    const at = (y: number): ToolSample => ({ time: 0, origin: [0.003, y, 1], direction: [0, 0, -1], pressure: 0.5 });
    let input = 1;
    for (const [phase, ys] of [
      [Phase.Down, [-0.5]],
      [Phase.Move, Array.from({ length: 60 }, (_, i) => -0.5 + i / 60)],
      [Phase.Up, [0.5]],
    ] as [number, number[]][])
      send(kerf, client, {
        type: 'tool',
        input: input++,
        tool: ToolCode.Scalpel,
        phase,
        modifiers: 0,
        size: 0,
        samples: ys.map(at),
      });
    tick(kerf, 1 / 60);
    const cut = heard(kerf, client).find((m) => m.type === 'cut');
    expect(cut).toBeDefined();
  });

  it('says in a sentence what is wrong with a scene', async () => {
    const kerf = await makeKerf(readFileSync(code), () => {});
    putFile(kerf, '/scenes/x.toml', '[body]\nmodel = "stake"\n');
    expect(withBytes(kerf, '/scenes/x.toml', (at, n) => kerf.start(at, n, 1))).not.toBe(0);
    expect(saidBy(kerf)).toMatch(/steak/);
    putFile(kerf, '/scenes/y.toml', '[body\n');
    expect(withBytes(kerf, '/scenes/y.toml', (at, n) => kerf.start(at, n, 1))).not.toBe(0);
    expect(saidBy(kerf)).toMatch(/y:1: /);
  });
});
