// The pictures of the page's scene tiles, made by the page: each scene shows itself until a moment.
//   node scripts/tiles.mjs [--kerf PROGRAM] [SCENE...]        into public/scenes; all, or those named; needs a built page
import { mkdirSync } from 'node:fs';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { kProgram, ready, showUntil, withKerf, withPage, withQuery } from './page.mjs';

const at = process.argv.indexOf('--kerf');
const kerf = at > 0 ? process.argv[at + 1] : kProgram;
const out = fileURLToPath(new URL('../public/scenes', import.meta.url));
mkdirSync(out, { recursive: true });

/** Scene: moment (s; 0: before it is shown), azimuth, elevation (degrees), distance in diagonals. */
const kTiles = {
  'steak-on-a-board': [1.15, -112, 38, 1.35],
  trainer: [0.5, -100, 40, 1.3],
  spiral: [2.4, -105, 24, 1.9],
  'draped-sheet-1500': [2.45, -110, 30, 1.5],
  'crossing-strips': [1.2, -110, 28, 1.4],
  tube: [1.34, 22, 10, 1.25],
  'suture-pad': [1.6, -60, 34, 1.35],
};

const named = process.argv.slice(2).filter((a) => a in kTiles);
for (const [scene, [moment, azimuth, elevation, distance]] of Object.entries(kTiles)) {
  if (named.length > 0 && !named.includes(scene)) continue;
  await withKerf(kerf, scene, (url) =>
    withPage({ url, viewport: { width: 400, height: 250 } }, async (page) => {
      await page.goto(withQuery(url, 'ui=0&quality=full'));
      await ready(page);
      await showUntil(page, { moment, azimuth, elevation, distance });
      await page.waitForTimeout(1500);
      await page.screenshot({ path: join(out, `${scene}.jpg`), type: 'jpeg', quality: 72 });
    }),
  );
  console.log(join(out, `${scene}.jpg`));
}
