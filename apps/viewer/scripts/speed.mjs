// How fast the page is: pictures a second while it plays and is cut, and the way from pointer to patch, as the page itself measures them.
//   npm run build && node scripts/speed.mjs [--kerf PROGRAM] [--seconds 15] [SCENE...]
// Chromium renders on the CPU, 1280 x 720, as people without graphics see it: in lite, with as many pixels as the page finds time for. Two idle cores, or the figures say nothing.
import { parseArgs } from 'node:util';
import { kProgram, ready, withKerf, withPage } from './page.mjs';

const { values: options, positionals } = parseArgs({
  allowPositionals: true,
  options: { kerf: { type: 'string', default: kProgram }, seconds: { type: 'string', default: '15' } },
});
const scenes = positionals.length > 0 ? positionals : ['steak-on-a-board', 'sheet'];
const seconds = Number(options.seconds);
if (!(seconds >= 3)) throw new Error('--seconds: 3 or more');
const median = (a) => [...a].sort((x, y) => x - y)[a.length >> 1];
const shown = (x) => (Number.isFinite(x) ? x.toFixed(1) : '-');

console.log(
  '| scene | triangles | pictures a second, in motion | while it is cut | pointer to patch, median / 99 % ms | pixels along a side | strokes |',
);
console.log('|---|---|---|---|---|---|---|');
for (const scene of scenes)
  await withKerf(options.kerf, scene, (url) =>
    withPage({ url, viewport: { width: 1280, height: 720 } }, async (page) => {
      await page.goto(url);
      await ready(page);
      const state = () => page.evaluate(() => window.kerf.state());
      if (!(await state()).playing) await page.keyboard.press('Space');
      await page.waitForFunction(() => window.kerf.state().playing);
      /** The page tells it once a second. */
      const watch = async (until) => {
        const all = [];
        while (performance.now() < until) {
          await page.waitForTimeout(1000);
          all.push((await state()).fps);
        }
        return all;
      };
      await page.waitForTimeout(2000);
      const moving = await watch(performance.now() + 500 * seconds);
      await page.keyboard.press('1');
      const { bounds } = await state();
      const at = (x, y) =>
        page.evaluate(
          ([c, r, u, v]) => window.kerf.pickPoint(c[0] + r * u, c[1] + r * v, c[2]),
          [bounds.center, bounds.radius, x, y],
        );
      const end = performance.now() + 1000 * seconds,
        cutting = watch(end);
      let strokes = 0;
      for (; performance.now() < end - 500; strokes++) {
        const x = -0.5 + 0.13 * (strokes % 8),
          a = await at(x, -0.6),
          b = await at(x + 0.06, 0.1 + 0.05 * Math.floor(strokes / 8));
        await page.mouse.move(...a);
        await page.mouse.down();
        for (let i = 1; i <= 30; i++) {
          await page.mouse.move(a[0] + ((b[0] - a[0]) * i) / 30, a[1] + ((b[1] - a[1]) * i) / 30);
          await page.waitForTimeout(16);
        }
        await page.mouse.up();
        await page.keyboard.press('z'); // the next one finds the body as this one did
      }
      const pictures = await cutting,
        s = await state();
      console.log(
        `| ${scene} | ${s.counts.visualTriangles} | ${shown(median(moving))} | ${shown(median(pictures))} | ${shown(s.latency.appliedMedian)} / ${shown(s.latency.applied99)} | ${s.quality.scale} | ${strokes} |`,
      );
    }),
  );
