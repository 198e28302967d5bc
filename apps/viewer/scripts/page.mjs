// Opens the built page in Debian's Chromium: for screenshots and measurements without a server.
import { spawn } from 'node:child_process';
import { createServer } from 'node:http';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { extname, join, normalize } from 'node:path';
import { fileURLToPath } from 'node:url';
import { chromium } from 'playwright-core';

const kTypes = { '.html': 'text/html', '.js': 'text/javascript', '.css': 'text/css', '.svg': 'image/svg+xml' };
export const kFlags = [
  '--no-sandbox',
  '--use-gl=angle',
  '--use-angle=gl-egl',
  '--ignore-gpu-blocklist',
  '--disable-background-networking',
  '--disable-component-update',
  '--disable-sync',
  '--no-first-run',
];

/** Serves a folder on a free port of the loopback address, with the headers that kerf view sends. */
export async function serve(folder) {
  const server = createServer((request, response) => {
    const path = normalize(new URL(request.url, 'http://x').pathname).replace(/\/$/, '/index.html');
    try {
      const body = readFileSync(join(folder, path));
      response.writeHead(200, {
        'Content-Type': kTypes[extname(path)] ?? 'application/octet-stream',
        'Content-Security-Policy':
          "default-src 'self'; img-src 'self' blob: data:; connect-src 'self'; object-src 'none'; base-uri 'none'; frame-ancestors 'none'",
      });
      response.end(body);
    } catch {
      response.writeHead(404).end();
    }
  });
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  return { url: `http://127.0.0.1:${server.address().port}/`, close: () => server.close() };
}

const root = fileURLToPath(new URL('..', import.meta.url));
/** The program, unless `--kerf` says otherwise. */
export const kProgram = join(root, '../../build/release/kerf');

/** Runs `use(url)` beside `kerf view` of a scene, with the built page. */
export async function withKerf(kerf, scene, use, more = []) {
  const all = ['view', scene, '--port', '0', '--no-browser', '--page', join(root, 'dist'), ...more];
  const program = spawn(kerf, all, { stdio: ['ignore', 'pipe', 'inherit'] });
  const ended = new Promise((done) => program.on('exit', (code, signal) => done(code ?? signal)));
  try {
    const url = await new Promise((found, failed) => {
      let said = '';
      program.stdout.on('data', (bytes) => {
        said += bytes;
        const address = /kerf view: (http:\S+)\s/.exec(said);
        if (address) found(address[1]);
      });
      program.on('error', failed);
      void ended.then((code) => failed(new Error(`${kerf} ended: ${code}`)));
    });
    return await use(url);
  } finally {
    program.kill('SIGINT');
    const code = await ended;
    if (code !== 0) console.error(`kerf view ended: ${code}`);
  }
}
/** An address with more in its query. */
export const withQuery = (url, query) => `${url}${url.includes('?') ? '&' : '?'}${query}`;

/** Runs `use(page, url)` with the built page's folder served and a fresh browser. */
export async function withPage(options, use) {
  const dist = fileURLToPath(new URL('../dist', import.meta.url));
  const server = options.url ? { url: options.url, close() {} } : await serve(dist);
  const profile = mkdtempSync(join(tmpdir(), 'kerf-page-'));
  const context = await chromium.launchPersistentContext(profile, {
    executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
    headless: true,
    args: kFlags,
    viewport: options.viewport ?? { width: 1280, height: 720 },
    colorScheme: options.dark ? 'dark' : 'light',
    hasTouch: options.touch ?? false,
    deviceScaleFactor: options.scale ?? 1,
  });
  try {
    const page = context.pages()[0] ?? (await context.newPage());
    page.on('console', (m) => {
      if (m.type() === 'error' || m.type() === 'warning') console.error(`page ${m.type()}: ${m.text()}`);
    });
    page.on('pageerror', (e) => console.error(`page: ${e.stack ?? e.message}`));
    return await use(page, server.url);
  } finally {
    await context.close();
    server.close();
    rmSync(profile, { recursive: true, force: true });
  }
}

/** Waits until the page shows a body. */
export const ready = (page) =>
  page.waitForFunction(() => window.kerf?.state().ready && window.kerf.state().frames > 5, null, { timeout: 60000 });

/**
 * Lets the scene show itself until a moment (s; 0: before it is shown), stops it there and looks at the body: degrees, and diagonals from `middle`,
 * or from where the body is. `speed`: simulated per real second; a slow picture then comes before the scene has gone far on.
 */
export async function showUntil(page, { moment, azimuth, elevation, distance, middle, speed = 1 }) {
  const shows = await page.evaluate(() => window.kerf.app.info.script !== null);
  if (shows && moment > 0) {
    await page.evaluate(() => window.kerf.app.show(true));
    await page.waitForFunction(() => window.kerf.state().showing);
    await page.evaluate((s) => window.kerf.app.command(4, [s]), speed);
  }
  await page.waitForFunction((t) => window.kerf.state().time >= t, moment, { timeout: 300000 });
  await page.evaluate(() => window.kerf.app.play(false));
  await page.evaluate(
    ([a, e, d, m]) => window.kerf.look(a, e, d * window.kerf.app.stage.size, m ?? window.kerf.state().bounds.center),
    [azimuth, elevation, distance, middle],
  );
}

/** Drags with the mouse through window positions. */
export async function drag(page, points, steps = 12) {
  await page.mouse.move(...points[0]);
  await page.mouse.down();
  for (const p of points.slice(1)) await page.mouse.move(...p, { steps });
  await page.mouse.up();
}
