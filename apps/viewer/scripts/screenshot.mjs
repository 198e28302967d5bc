// Pictures of the page with the mock engine, or of the server at KERF_URL:  node scripts/screenshot.mjs FOLDER [name...]
import { mkdirSync } from 'node:fs';
import { join } from 'node:path';
import { drag, ready, withPage } from './page.mjs';

const folder = process.argv[2] ?? 'shots',
  only = process.argv.slice(3);
mkdirSync(folder, { recursive: true });
const at = (page, x, y, z = 0.011) => page.evaluate(([a, b, c]) => window.kerf.pickPoint(a, b, c), [x, y, z]);
const key = async (page, ...keys) => {
  for (const k of keys) await page.keyboard.press(k);
};

/** A cut from the near side, held open. */
async function openCut(page, scene) {
  if (scene !== 'steak') {
    await page.evaluate((name) => window.kerf.app.command(8, [], name), scene);
    await page.waitForTimeout(300);
  }
  await drag(page, [await at(page, 0.005, -0.1), await at(page, 0.012, 0.012)], 2);
  await page.waitForTimeout(300);
  await page.evaluate(() => {
    const mock = window.kerf.app.engine.mock;
    for (const [x, dx] of [
      [-0.03, -0.022],
      [0.045, 0.03],
    ]) {
      const hold = mock.grasp(mock.intersect([x, -0.045, 1], [0, 0, -1]));
      hold.target[0] += dx;
      hold.target[2] += 0.022;
    }
    for (let i = 0; i < 300; i++) mock.step(1 / 60);
    mock.holds = [];
    window.kerf.app.play(false);
  });
  await page.mouse.move(...(await at(page, 0.012, 0.02, 0.012)));
  await page.waitForTimeout(4000);
}

const shots = {
  steak: { query: 'quality=full', run: async () => {} },
  cut: {
    query: 'quality=full',
    run: async (page) => {
      await drag(page, [await at(page, 0.01, -0.1), await at(page, 0.012, 0.005)]);
      await page.waitForTimeout(900);
      await key(page, '4');
      await drag(page, [await at(page, 0.03, -0.045), await at(page, 0.075, -0.06, 0.03)]);
      await page.mouse.move(...(await at(page, -0.05, 0.0)));
      await page.waitForTimeout(1200);
    },
  },
  open: { query: 'quality=full', run: (page) => openCut(page, 'steak') },
  openmeniscus: { query: 'quality=full', run: (page) => openCut(page, 'meniscus') },
  opensheet: { query: 'quality=full', run: (page) => openCut(page, 'sheet') },
  lite: {
    query: 'quality=lite',
    run: async (page) => {
      await drag(page, [await at(page, 0.01, -0.1), await at(page, 0.012, 0.005)]);
      await page.waitForTimeout(600);
    },
  },
  low: {
    query: 'quality=low',
    run: async (page) => {
      await page.waitForTimeout(600);
    },
  },
  views: {
    query: 'quality=full',
    run: async (page) => {
      await key(page, 'x', 'o', 'l');
      await page.waitForTimeout(500);
    },
  },
  wire: {
    query: 'quality=lite',
    run: async (page) => {
      await drag(page, [await at(page, -0.02, -0.1), await at(page, -0.012, 0.0)]);
      await key(page, 's', 'w', 'o', 'b');
      await page.waitForTimeout(500);
    },
  },
  meniscus: {
    query: 'quality=full',
    run: async (page) => {
      await page.evaluate((name) => window.kerf.app.command(8, [], name), 'meniscus');
      await page.waitForTimeout(1500);
    },
  },
  sheet: {
    query: 'quality=full',
    run: async (page) => {
      await page.evaluate((name) => window.kerf.app.command(8, [], name), 'sheet');
      await page.waitForTimeout(1500);
    },
  },
  panel: {
    query: 'quality=low&panel',
    dark: true,
    run: async (page) => {
      await drag(page, [await at(page, 0.01, -0.1), await at(page, 0.012, 0.1)]);
      await page.evaluate(() => {
        for (const d of document.querySelectorAll('#panel details')) d.open = true;
      });
      await page.waitForTimeout(2500);
      await page.evaluate(() => {
        document.getElementById('plots-section').scrollIntoView();
      });
      await page.waitForTimeout(500);
    },
  },
  panellight: {
    query: 'quality=low&panel',
    run: async (page) => {
      await page.waitForTimeout(1500);
    },
  },
  help: {
    query: 'quality=lite',
    run: async (page) => {
      await key(page, '?');
      await page.waitForTimeout(300);
    },
  },
  phone: {
    query: 'quality=lite',
    viewport: { width: 390, height: 780 },
    touch: true,
    scale: 2,
    run: async (page) => {
      await page.waitForTimeout(500);
    },
  },
  landscape: {
    query: 'quality=lite',
    viewport: { width: 780, height: 360 },
    run: async (page) => {
      await page.waitForTimeout(500);
    },
  },
  dark: { query: 'quality=full', dark: true, run: (page) => openCut(page, 'steak') },
  hex: {
    query: 'quality=full',
    run: async (page) => {
      await openCut(page, 'steak');
      await key(page, 'x');
      await page.waitForTimeout(1500);
    },
  },
  files: {
    query: 'quality=lite&panel',
    dark: true,
    run: async (page) => {
      await page.locator('#panel summary', { hasText: 'Files' }).click();
      await page.locator('#panel summary', { hasText: 'Material' }).click();
      await page.setInputFiles('#files', [
        { name: 'knee.obj', mimeType: 'text/plain', buffer: Buffer.from('v 0 0 0 '.repeat(9)) },
        { name: 'knee-collision.obj', mimeType: 'text/plain', buffer: Buffer.from('v 0 0 0') },
      ]);
      await page.waitForTimeout(500);
    },
  },
  stroke: {
    query: 'quality=lite',
    run: async (page) => {
      await key(page, '3');
      const a = await at(page, -0.03, 0.01);
      await page.mouse.move(...a);
      await page.mouse.down();
      for (let i = 1; i < 20; i++)
        await page.mouse.move(...(await at(page, -0.03 + 0.03 * Math.sin(i / 4), 0.01 - 0.03 * (1 - Math.cos(i / 4)))));
      await page.waitForTimeout(600);
    },
  },
  lost: {
    query: 'quality=lite',
    run: async (page) => {
      await page.evaluate(() => {
        const e = window.kerf.app.engine;
        e.stop();
        e.events.state('lost');
      });
      await page.waitForTimeout(300);
    },
  },
  phonepanel: {
    query: 'quality=lite&panel',
    viewport: { width: 390, height: 780 },
    dark: true,
    touch: true,
    scale: 2,
    run: async (page) => {
      await page.waitForTimeout(500);
    },
  },
};

for (const [name, shot] of Object.entries(shots)) {
  if (only.length > 0 && !only.includes(name)) continue;
  await withPage({ ...shot, url: process.env.KERF_URL }, async (page, url) => {
    await page.goto(process.env.KERF_URL ? `${url}?${shot.query}` : `${url}?engine=mock&${shot.query}`);
    await ready(page);
    await shot.run(page);
    const file = join(folder, `${name}.png`);
    await page.screenshot({ path: file });
    const s = await page.evaluate(() => window.kerf.state());
    console.log(
      file,
      JSON.stringify({
        fps: s.fps,
        pieces: s.pieces,
        version: s.version,
        drawn: s.drawn,
        latency: s.latency,
        quality: s.quality,
      }),
    );
  });
}
