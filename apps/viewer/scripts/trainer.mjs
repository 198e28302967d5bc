// Makes the pictures of docs/trainer.md: the trainer played in the page, from outside and through the arthroscope.
//   npm run build && node scripts/trainer.mjs --kerf ../../build/release/kerf --out ../../docs [--meshes FOLDER]
import { mkdirSync, writeFileSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { parseArgs } from 'node:util';
import { ready, withKerf, withPage, withQuery } from './page.mjs';

const { values: options } = parseArgs({
  options: {
    kerf: { type: 'string', default: 'kerf' },
    out: { type: 'string', default: 'trainer' },
    meshes: { type: 'string' },
  },
});
const out = resolve(options.out);
mkdirSync(out, { recursive: true });

async function play(scene, use) {
  const meshes = options.meshes ? ['--meshes', resolve(options.meshes)] : [];
  const seen = { viewport: { width: 960, height: 640 }, scale: 1.5 };
  await withKerf(
    options.kerf,
    scene,
    (url) =>
      withPage({ url, ...seen }, async (page) => {
        await page.goto(withQuery(url, 'ui=0&quality=full'));
        await ready(page);
        await use(page);
      }),
    meshes,
  );
}

const until = (page, test, arg) => page.waitForFunction(test, arg, { timeout: 120000 });
const rest = (page, p) => page.evaluate((q) => window.kerf.pickRest(...q), p);
async function drag(page, points, steps = 12) {
  await page.mouse.move(...points[0]);
  await page.mouse.down();
  for (const p of points.slice(1)) await page.mouse.move(...p, { steps });
  await page.mouse.up();
}
async function save(page, name) {
  await page.waitForTimeout(1500);
  // Wet tissue is all gradients: few colours would show as steps.
  const bytes = await page.evaluate(async () => {
    const image = await createImageBitmap(await window.kerf.app.picture()),
      canvas = new OffscreenCanvas(image.width, image.height),
      url = new FileReader();
    canvas.getContext('2d').drawImage(image, 0, 0);
    const blob = await canvas.convertToBlob({ type: 'image/jpeg', quality: 0.86 });
    return new Promise((done) => {
      url.onload = () => done(url.result.split(',')[1]);
      url.readAsDataURL(blob);
    });
  });
  writeFileSync(join(out, `${name}.jpg`), Buffer.from(bytes, 'base64'));
  console.log(join(out, `${name}.jpg`));
}

/** Probes, bites and shaves the lesion, with a picture of each. */
async function operate(page, name, { look, probe, bites, size, shave }) {
  await page.evaluate(([a, e, d, t]) => {
    window.kerf.look(a, e, d, t);
  }, look);
  if (probe) {
    await page.keyboard.press('i');
    await page.mouse.move(...(await rest(page, probe)));
    await page.mouse.down();
    await until(page, () => Math.hypot(...window.kerf.state().rigid[0].force) > 0.1);
    await save(page, `${name}-probe`);
    await page.mouse.up();
    await until(page, () => Math.hypot(...window.kerf.state().rigid[0].force) === 0);
    await page.waitForTimeout(2000);
  }
  await page.evaluate((s) => {
    window.kerf.app.setInstrumentSize('punch', s / window.kerf.app.stage.size);
  }, size);
  await page.keyboard.press('9');
  for (const p of bites) {
    const before = (await page.evaluate(() => window.kerf.state())).undoDepth;
    await page.mouse.move(...(await rest(page, p)));
    await page.mouse.down();
    await page.mouse.up();
    await until(page, (n) => window.kerf.state().undoDepth > n, before);
  }
  await page.mouse.move(2, 2);
  await save(page, `${name}-bitten`);
  await page.keyboard.press('q');
  await save(page, `${name}-arthroscope`);
  await page.keyboard.press('v');
  await drag(page, await Promise.all(shave.map((p) => rest(page, p))), 40);
  await drag(page, await Promise.all([...shave].reverse().map((p) => rest(page, p))), 40);
  await page.mouse.move(2, 2);
  await save(page, `${name}-shaved`);
  console.log(JSON.stringify((await page.evaluate(() => window.kerf.state())).score));
}

await play('trainer', (page) =>
  operate(page, 'trainer', {
    look: [110, 42, 0.062, [0, 0.0125, 0]],
    probe: [0.0, 0.0105, 0.002],
    bites: [
      [-0.0012, 0.0128, 0.001],
      [0.0012, 0.0128, 0.001],
    ],
    size: 0.0016,
    shave: [
      [-0.003, 0.0132, 0.001],
      [0, 0.012, 0.001],
      [0.003, 0.0132, 0.001],
    ],
  }),
);
if (options.meshes) {
  await play('trainer-knee', (page) =>
    operate(page, 'knee', {
      look: [-80, 38, 0.062, [0.004, 0.021, -0.001]],
      probe: [0.0072, 0.0245, 0],
      bites: [
        [0.0058, 0.024, 0],
        [0.0084, 0.0233, 0],
      ],
      size: 0.0017,
      shave: [
        [0.004, 0.0255, 0],
        [0.007, 0.0256, 0],
        [0.01, 0.024, 0],
      ],
    }),
  );
}
