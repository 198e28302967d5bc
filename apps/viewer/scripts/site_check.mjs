// Uses build/site as a visitor would, served by a plain static server, in Debian's Chromium; or a page of scripts/share, from the disk:
//   scripts/site && node scripts/site_check.mjs [--site FOLDER] [--scene NAME]... [--file PAGE] [--picture FILE]
// Exit status 1: something failed; it says what. Times are said, not judged.
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { createServer } from 'node:net';
import { basename } from 'node:path';
import { fileURLToPath, pathToFileURL } from 'node:url';
import { parseArgs } from 'node:util';
import { drag, withPage } from './page.mjs';

const { values: options } = parseArgs({
  options: {
    site: { type: 'string', default: fileURLToPath(new URL('../../../build/site', import.meta.url)) },
    scene: { type: 'string', multiple: true },
    file: { type: 'string' },
    picture: { type: 'string' },
    size: { type: 'string', default: '800x560' },
  },
});
const [width, height] = options.size.split('x').map(Number);
const scenes = options.scene ?? (options.file ? [] : ['steak']);

const port = await new Promise((found) => {
  const probe = createServer().listen(0, '127.0.0.1', () => {
    const { port: free } = probe.address();
    probe.close(() => found(free));
  });
});
const server = spawn('python3', ['-m', 'http.server', String(port), '--bind', '127.0.0.1', '-d', options.site], {
  stdio: 'ignore',
});
const url = `http://127.0.0.1:${port}/`;
for (let i = 0; i < 100; i++) {
  if (
    await fetch(url).then(
      (r) => r.ok,
      () => false,
    )
  )
    break;
  await new Promise((r) => setTimeout(r, 100));
}
const pages = scenes.map((scene) => [scene, `${url}?scene=${scene}&quality=lite`]);
if (options.file) pages.push([basename(options.file, '.html'), `${pathToFileURL(options.file)}?quality=lite`]);
let failed = 0;
for (const [scene, address] of pages) {
  const errors = [];
  try {
    await withPage({ url, viewport: { width, height } }, async (page) => {
      page.on('console', (m) => {
        if (m.type() === 'error') errors.push(m.text());
      });
      page.on('pageerror', (e) => errors.push(e.message));
      const state = () => page.evaluate(() => window.kerf.state());
      const began = performance.now();
      await page.goto(address);
      await page.waitForFunction(() => window.kerf?.state().ready, null, { timeout: 120000 });
      const there = performance.now() - began;
      await page.waitForFunction(() => window.kerf.state().frames > 5, null, { timeout: 120000 });
      const before = await state();
      const { center, radius } = before.bounds;
      const at = (x, y) =>
        page.evaluate(
          ([c, r, u, v]) => window.kerf.pickPoint(c[0] + r * u, c[1] + r * v, c[2]),
          [center, radius, x, y],
        );
      await page.keyboard.press('1');
      await drag(page, [await at(0.1, -1.1), await at(0.1, 1.1)], 24);
      await page.waitForFunction(() => window.kerf.state().undoDepth === 1, null, { timeout: 60000 });
      const after = await state();
      assert.ok(after.drawn.vertices > before.drawn.vertices, 'nothing is cut');
      if (options.picture) await page.screenshot({ path: options.picture.replace('.png', `-${scene}.png`) });
      await page.keyboard.press('z');
      await page.waitForFunction(() => window.kerf.state().undoDepth === 0, null, { timeout: 60000 });
      const undone = await state();
      assert.equal(undone.drawn.vertices, before.drawn.vertices);
      console.log(
        `ok   ${scene}: body after ${there.toFixed(0)} ms, cut into ${after.cut?.pieces} pieces, ` +
          `pointer to cut ${after.latency.appliedMedian?.toFixed(1)} / ${after.latency.applied99?.toFixed(1)} ms`,
      );
    });
    assert.deepEqual(errors, []);
  } catch (e) {
    failed++;
    console.log(`FAIL ${scene}: ${e.stack ?? e}; ${errors.join('; ')}`);
  }
}
server.kill();
process.exit(failed > 0 ? 1 : 0);
