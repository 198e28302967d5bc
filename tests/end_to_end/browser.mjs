// What the browser tests share: `kerf view`, Debian's headless Chromium, gestures, and checks one after another.
//   node tests/end_to_end/TEST.mjs PROGRAM [OUT [PART OF A NAME...]]
// Pictures and measurements go to OUT; with parts of names only those checks run. Needs npm ci && npm run build in apps/viewer; status 77:
// something of that is missing.
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { createRequire } from 'node:module';
import { tmpdir } from 'node:os';
import { join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';

export const viewer = fileURLToPath(new URL('../../apps/viewer/', import.meta.url));
const chrome = process.env.CHROMIUM ?? '/usr/bin/chromium';
const skip = (why) => { console.log(`skipped: ${why}`); process.exit(77); };
if (!existsSync(join(viewer, 'node_modules/playwright-core'))) skip('no node_modules in apps/viewer (npm ci)');
if (!existsSync(join(viewer, 'dist/index.html'))) skip('the page is not built (npm run build in apps/viewer)');
if (!existsSync(chrome)) skip(`no ${chrome}`);
const { chromium } = createRequire(join(viewer, 'package.json'))('playwright-core');

export const program = resolve(process.argv[2] ?? 'build/dev/kerf');
export const out = resolve(process.argv[3] ?? 'out/viewer-test');
mkdirSync(out, { recursive: true });

// --- The server ------------------------------------------------------------------------------------------------------

const servers = new Set();
/** What went wrong beside the checks: errors of pages, servers that were killed. */
export const errors = [];
/** kerf view of a scene; ends with an error if it does. */
export function startServer(scene, port = 0, token = 'token-of-this-test') {
  return new Promise((done, fail) => {
    const child = spawn(program, ['view', scene, '--port', String(port), '--no-browser', '--token', token, '--page', join(viewer, 'dist')], { stdio: ['ignore', 'pipe', 'pipe'] });
    servers.add(child);
    let text = '';
    const exited = new Promise((r) => child.on('exit', (code, signal) => {
      servers.delete(child);
      if (signal && !child.killed) errors.push(`kerf view was ended by ${signal}, not by this test (SIGKILL: out of memory?): ${text}`);
      r({ code, signal, text });
    }));
    const hear = (bytes) => {
      text += bytes;
      const found = /kerf view: (http:\S+)/.exec(text);
      if (found) done({ child, url: found[1], port: Number(new URL(found[1]).port), exited });
    };
    child.stdout.on('data', hear);
    child.stderr.on('data', (b) => { text += b; });
    exited.then((e) => fail(new Error(`kerf view ended: ${e.code} ${e.text}`)));
  });
}
export async function stopServer(server, signal = 'SIGINT') {
  server.child.kill(signal);
  return server.exited;
}
/** A flat square of n x n fields as an OBJ file, `size` long. */
export function squareFile(n, size = 1) {
  let text = '';
  for (let j = 0; j <= n; j++) for (let i = 0; i <= n; i++) text += `v ${(size * i) / n} ${(size * j) / n} 0\n`;
  for (let j = 0; j < n; j++) {
    for (let i = 0; i < n; i++) {
      const a = j * (n + 1) + i + 1;
      text += `f ${a} ${a + 1} ${a + n + 2}\nf ${a} ${a + n + 2} ${a + n + 1}\n`;
    }
  }
  return text;
}
/** CPU seconds of a process so far. */
export function cpuSeconds(pid) {
  const fields = readFileSync(`/proc/${pid}/stat`, 'utf8').replace(/^.*\) /, '').split(' ');
  return (Number(fields[11]) + Number(fields[12])) / 100;
}

// --- The browser -----------------------------------------------------------------------------------------------------

const profile = mkdtempSync(join(tmpdir(), 'kerf-page-'));
const context = await chromium.launchPersistentContext(profile, {
  executablePath: chrome, headless: true, viewport: { width: 900, height: 640 },
  args: ['--no-sandbox', '--use-gl=angle', '--use-angle=gl-egl', '--ignore-gpu-blocklist', '--disable-quic', '--no-first-run',
    '--disable-background-networking', '--disable-component-update', '--disable-sync'],
});
export async function openPage(url, viewport) {
  const page = await context.newPage();
  if (viewport) await page.setViewportSize(viewport);
  page.on('pageerror', (e) => errors.push(e.message));
  page.on('console', (m) => { if (/bad message|does not fit/.test(m.text())) errors.push(m.text()); });
  await page.goto(`${url}${url.includes('?') ? '&' : '?'}quality=lite`);
  await ready(page);
  return page;
}
export const ready = (page) => page.waitForFunction(() => window.kerf?.state().ready && window.kerf.state().frames > 5, null, { timeout: 60000 });
export const state = (page) => page.evaluate(() => window.kerf.state());
export const until = (page, test, arg) => page.waitForFunction(test, arg, { timeout: 90000 });
/** Waits for a scene: its body is drawn, and no dialog keeps the keys. */
export const sceneShows = (page, name) => until(page, (n) => window.kerf.state().scene === n && window.kerf.state().ready && !document.querySelector('dialog[open]'), name);
export const rest = (page, p) => page.evaluate((q) => window.kerf.pickRest(...q), p);
/** A line in the window through the places of two rest points and beyond them by a part of its length, less where a panel would lie under its end. */
export async function line(page, a, b, beyond = 0.25) {
  const [p, q] = [await rest(page, a), await rest(page, b)];
  const d = [q[0] - p[0], q[1] - p[1]];
  const ends = [[p, -1], [q, 1]].map(([end, way]) => [1, 0.8, 0.6, 0.4].map((part) => end.map((x, k) => x + way * part * beyond * d[k])));
  return page.evaluate((ways) => ways.map((places) => {
    const free = places.find(([x, y]) => document.elementFromPoint(x, y)?.id === 'view');
    if (!free) throw new Error(`no end of a line lies on the view: ${JSON.stringify(places)}`);
    return free;
  }), ends);
}
/** Waits until a place of the body keeps to its pixel for a while of the body's own time, which goes slower than the clock on a loaded machine. */
export async function settled(page, place) {
  for (let round = 0; round < 40; round++) {
    const from = (await state(page)).time, [x, y] = await rest(page, place);
    let moved = 0;
    for (let k = 1; k <= 5; k++) {
      await until(page, (t) => window.kerf.state().time > t, from + 0.1 * k);
      const [u, v] = await rest(page, place);
      moved = Math.max(moved, Math.hypot(u - x, v - y));
    }
    if (moved < 1) return;
  }
  throw new Error('the body does not come to rest');
}
/** Waits for the finer picture of what stands still, in lite. */
export const still = (page) => until(page, () => { const view = document.getElementById('view'); return view.width > view.clientWidth; });
export async function drag(page, from, to, steps = 24) {
  await page.mouse.move(...from);
  await page.mouse.down();
  for (let i = 1; i <= steps; i++) await page.mouse.move(from[0] + ((to[0] - from[0]) * i) / steps, from[1] + ((to[1] - from[1]) * i) / steps);
  await page.mouse.up();
}
/** Mean difference of two pictures (0 to 255) over a square around a place. */
export function difference(page, a, b, [x, y], half) {
  return page.evaluate(async ([p, q, cx, cy, r]) => {
    const pixels = async (base64) => {
      const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
      const image = await createImageBitmap(new Blob([bytes], { type: 'image/png' }));
      const canvas = new OffscreenCanvas(2 * r, 2 * r), g = canvas.getContext('2d');
      g.drawImage(image, r - cx, r - cy);
      return g.getImageData(0, 0, 2 * r, 2 * r).data;
    };
    const [m, n] = [await pixels(p), await pixels(q)];
    let sum = 0;
    for (let i = 0; i < m.length; i++) sum += Math.abs(m[i] - n[i]);
    return sum / (m.length * 0.75);
  }, [a.toString('base64'), b.toString('base64'), x, y, half]);
}

let failed = 0;
const only = process.argv.slice(4);
/** Runs one check; `page()` is the page that a failure is photographed on. */
export async function check(name, page, use) {
  if (only.length > 0 && !only.some((o) => name.includes(o))) return;
  const started = Date.now();
  try {
    await use();
    assert.deepEqual(errors.splice(0), []);
    console.log(`ok   ${name} (${((Date.now() - started) / 1000).toFixed(1)} s)`);
  } catch (e) {
    failed++;
    console.log(`FAIL ${name}: ${e.message ?? e}\n${e.stack ?? ''}`);  // a stack has the words that an error was made with, not what was added
    for (const error of errors.splice(0)) console.log(`     ${error}`);
    try {
      await page().screenshot({ path: join(out, `failed-${name.replace(/\W+/g, '-').slice(0, 30)}.png`) });
      console.log(JSON.stringify(await state(page())));
    } catch { /* the page is gone */ }
  }
}

/** Ends browser and servers, and this process with 0 or 1. */
export async function finish() {
  await context.close();
  for (const child of servers) child.kill('SIGKILL');
  rmSync(profile, { recursive: true, force: true });
  process.exit(failed > 0 ? 1 : 0);
}
