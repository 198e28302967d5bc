// Pictures of shipped scenes in the README and the docs, made by the page: each scene shows itself until a moment.
//   node scripts/scene_pictures.mjs [--kerf PROGRAM] [--out FOLDER] [PICTURE...]      needs a built page
import { writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { parseArgs } from 'node:util';
import { kProgram, ready, showUntil, withKerf, withPage, withQuery } from './page.mjs';
import { shrink } from './shrink.mjs';

const { values: options, positionals: named } = parseArgs({
  options: {
    kerf: { type: 'string', default: kProgram },
    out: { type: 'string', default: fileURLToPath(new URL('../../../docs', import.meta.url)) },
  },
  allowPositionals: true,
});
const kSpeed = 0.1; // simulated per real second
const kMostBytes = 200_000;

const kRim = { azimuth: 97, elevation: 50, middle: [0, 0.014, 0] }; // of a meniscus, where it is thin
/** Picture: its scene, its width in the file (pixels), when (s), from where, and whether without instruments. */
const kPictures = {
  sheet: { scene: 'sheet', wide: 640, moment: 1.9, azimuth: 100, elevation: 32, distance: 1.3 },
  meniscus: { scene: 'meniscus', wide: 640, moment: 1.15, azimuth: 108, elevation: 48, distance: 1.42, bare: true },
  punch: { scene: 'punch', wide: 900, moment: 0.7, ...kRim, distance: 0.75, bare: true },
  'contour-before': { scene: 'contour', wide: 900, moment: 0.07, speed: 0.02, ...kRim, distance: 0.6, bare: true },
  'contour-after': { scene: 'contour', wide: 900, moment: 1.5, ...kRim, distance: 0.6, bare: true },
};

for (const [name, picture] of Object.entries(kPictures)) {
  if (named.length > 0 && !named.includes(name)) continue;
  await withKerf(options.kerf, picture.scene, (url) =>
    withPage({ url, viewport: { width: 1280, height: 800 } }, async (page) => {
      await page.goto(withQuery(url, 'ui=0&quality=lite')); // a moment needs many pictures
      await ready(page);
      await showUntil(page, { speed: kSpeed, ...picture });
      await page.mouse.move(2, 2);
      await page.evaluate((bare) => {
        const { app } = window.kerf;
        if (bare) app.blade.group.visible = app.things.group.visible = false;
        app.setQuality('full');
      }, picture.bare);
      await page.waitForTimeout(4000);
      const bytes = await shrink(page, await page.screenshot(), picture.wide),
        file = join(options.out, `${name}.png`);
      writeFileSync(file, bytes);
      console.log(`${file}: ${bytes.length} bytes, at ${await page.evaluate(() => window.kerf.state().time)} s`);
      if (bytes.length > kMostBytes) throw new Error(`${file} has ${bytes.length} bytes; ${kMostBytes} are the most`);
    }),
  );
}
