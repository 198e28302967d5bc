// The pictures of the page's scene tiles, made by the page: each scene shows itself until a moment.
//   node scripts/tiles.mjs [--kerf PROGRAM] [SCENE...]        into public/scenes; all, or those named; needs a built page
import { spawn } from 'node:child_process';
import { mkdirSync } from 'node:fs';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { ready, withPage } from './page.mjs';

const root = fileURLToPath(new URL('..', import.meta.url));
const at = process.argv.indexOf('--kerf');
const kerf = at > 0 ? process.argv[at + 1] : join(root, '../../build/release/kerf');
const out = join(root, 'public/scenes');
mkdirSync(out, { recursive: true });

/** Scene: moment (s; 0: before it is shown), azimuth, elevation (degrees), distance in diagonals. */
const kTiles = {
  'steak-on-a-board': [1.15, -112, 38, 1.35],
  trainer: [0.7, -100, 40, 1.3],
  spiral: [2.4, -105, 24, 1.9],
  'draped-sheet-1500': [2.45, -110, 30, 1.5],
  'crossing-strips': [1.2, -110, 28, 1.4],
  tube: [1.34, 22, 10, 1.25],
};

const named = process.argv.slice(2).filter((a) => a in kTiles);
for (const [scene, [moment, azimuth, elevation, distance]] of Object.entries(kTiles)) {
  if (named.length > 0 && !named.includes(scene)) continue;
  const server = spawn(kerf, ['view', scene, '--port', '0', '--no-browser', '--page', join(root, 'dist')], {
    stdio: ['ignore', 'pipe', 'inherit'],
  });
  const url = await new Promise((found) => {
    let said = '';
    server.stdout.on('data', (b) => {
      said += b;
      const m = /kerf view: (http:\S+)/.exec(said);
      if (m) found(m[1]);
    });
  });
  await withPage({ url, viewport: { width: 400, height: 250 } }, async (page) => {
    await page.goto(`${url}${url.includes('?') ? '&' : '?'}ui=0&quality=full`);
    await ready(page);
    const shows = await page.evaluate(() => window.kerf.app.info.script !== null);
    if (shows) {
      await page.evaluate(() => window.kerf.app.show(true));
      await page.waitForFunction(() => window.kerf.state().showing);
    }
    await page.waitForFunction((t) => window.kerf.state().time >= t, moment, { timeout: 300000 });
    await page.evaluate(() => window.kerf.app.togglePlay());
    await page.evaluate(
      ([a, e, d]) => {
        const s = window.kerf.state();
        window.kerf.look(a, e, d * window.kerf.app.stage.size, s.bounds.center);
      },
      [azimuth, elevation, distance],
    );
    await page.waitForTimeout(1500);
    await page.screenshot({ path: join(out, `${scene}.jpg`), type: 'jpeg', quality: 72 });
  });
  server.kill('SIGKILL');
  console.log(join(out, `${scene}.jpg`));
}
