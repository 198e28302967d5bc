// The README's first picture, made by the page: a steak on its board is cut with the mouse and pulled apart.
//   node scripts/readme_picture.mjs [--kerf PROGRAM] [--out FILE] [--quality full|low|lite]      needs a built page
import { statSync, writeFileSync } from 'node:fs';
import { fileURLToPath } from 'node:url';
import { drag, kProgram, ready, withKerf, withPage, withQuery } from './page.mjs';
import { shrink } from './shrink.mjs';

const option = (name, otherwise) => {
  const at = process.argv.indexOf(`--${name}`);
  return at > 0 ? process.argv[at + 1] : otherwise;
};
const kerf = option('kerf', kProgram),
  out = option('out', fileURLToPath(new URL('../../../docs/steak.png', import.meta.url))),
  quality = option('quality', 'full');
const kWidth = 1200; // pixels of the file: fewer than of the picture, which smooths edges
const kMostBytes = 400_000;

await withKerf(kerf, 'steak-on-a-board', (url) =>
  withPage({ url, viewport: { width: 1600, height: 1000 } }, async (page) => {
    await page.goto(withQuery(url, 'ui=0&quality=lite'));
    await ready(page);
    const at = (x, y, z = 0) => page.evaluate((p) => window.kerf.pickPoint(...p), [x, y, z]);
    const look = (azimuth, elevation, distance = 1.5, target = [0, 0, 0]) =>
      page.evaluate(
        ([a, e, d, t]) => window.kerf.look(a, e, d * window.kerf.app.stage.size, t),
        [azimuth, elevation, distance, target],
      );
    const simulated = async (seconds) => {
      const until = await page.evaluate((s) => window.kerf.state().time + s, seconds);
      await page.waitForFunction((t) => window.kerf.state().time >= t, until, { timeout: 120000 });
    };
    const pieces = (n) => page.waitForFunction((k) => window.kerf.state().pieces === k, n, { timeout: 60000 });
    const tool = (name) => page.evaluate((t) => window.kerf.app.setTool(t), name);
    /** Drags with the forceps and leaves held there what they hold. */
    const pull = async (from, to) => {
      await page.mouse.move(...from);
      await page.mouse.down();
      for (let i = 1; i <= 24; i++) {
        await page.mouse.move(...from.map((x, k) => x + ((to[k] - x) * i) / 24));
        await page.waitForTimeout(40);
      }
      await simulated(0.5);
      await page.keyboard.down('Shift');
      await page.mouse.up();
      await page.keyboard.up('Shift');
    };

    // Seen from above, drags are level.
    await look(-90, 89);
    await tool('scalpel');
    const curve = [];
    for (let i = 0; i <= 24; i++) {
      const x = -0.125 + (0.25 * i) / 24;
      curve.push(await at(x, -0.012 + 0.014 * Math.sin(26 * x)));
    }
    await drag(page, curve, 1);
    await pieces(2);
    await tool('line');
    await drag(page, [await at(0.035, 0.11), await at(0.03, -0.006)], 6);
    await pieces(3);
    await tool('grasp');
    await pull(await at(-0.01, -0.055), await at(-0.025, -0.1));
    await pull(await at(0.075, 0.03), await at(0.1, 0.045));
    await simulated(1);

    await page.evaluate(() => window.kerf.app.play(false));
    await tool('hand');
    await page.mouse.move(5, 5);
    await look(-70, 34, 1.36, [0, -0.02, 0]);
    await page.evaluate((q) => window.kerf.app.setQuality(q), quality); // cutting needs many pictures
    await page.waitForTimeout(6000);
    writeFileSync(out, await shrink(page, await page.screenshot(), kWidth));
  }),
);
const bytes = statSync(out).size;
console.log(`${out}: ${bytes} bytes`);
if (bytes > kMostBytes) throw new Error(`${out} has ${bytes} bytes; ${kMostBytes} are the most`);
