// How tissue looks in lite, the quality of machines without graphics, judged by pixels (see browser.mjs):
//   node tests/end_to_end/looks.mjs PROGRAM [OUT [PART OF A NAME...]]
import assert from 'node:assert/strict';
import { check as checkOn, drag, finish, openPage, sceneShows, settled, startServer, state, still, until } from './browser.mjs';

const server = await startServer('steak-on-a-board');
const page = await openPage(`${server.url}&ui=0`);
const check = (name, use) => checkOn(name, () => page, use);

const look = (...how) => page.evaluate((h) => window.kerf.look(...h), how);
/** Red, green, blue and opacity (0 to 255) of the pixels of boxes, row by row. */
async function pixels(boxes) {
  await page.waitForTimeout(700);
  const shot = await page.screenshot();
  return page.evaluate(async ([base64, boxes]) => {
    const image = await createImageBitmap(new Blob([Uint8Array.from(atob(base64), (c) => c.charCodeAt(0))], { type: 'image/png' }));
    const g = new OffscreenCanvas(image.width, image.height).getContext('2d');
    g.drawImage(image, 0, 0);
    const of = (x, y, w, h) => [...g.getImageData(Math.round(x), Math.round(y), w, h).data];
    return boxes.map((b) => of(b.x, b.y, b.w, b.h));
  }, [shot.toString('base64'), boxes]);
}
const places = (points) => page.evaluate((ps) => ps.map((p) => window.kerf.pickPoint(...p)), points);

await page.mouse.move(5, 300);
await settled(page, [0.05, 0, 0.02]);
if ((await state(page)).playing) await page.keyboard.press('Space');
await until(page, () => !window.kerf.state().playing);
const { bounds } = await state(page), [cx, cy, cz] = bounds.center, r = bounds.radius;

await check('a wet surface has a highlight: from two sides it looks different', async () => {
  // What has no highlight looks the same from everywhere. Around each point of the upper side a square without fat counts.
  const half = 3, side = 2 * half + 1;
  const points = await page.evaluate(() => {
    const { rest, normal, nv } = window.kerf.app.mesh.state, up = [];
    for (let v = 0; v < nv; v++) if (normal[4 * v + 2] > 0.7 * 32767) up.push([...rest.slice(3 * v, 3 * v + 3)]);
    return up.filter((_, i) => i % Math.ceil(up.length / 200) === 0);
  });
  const seen = [];
  for (const azimuth of [-90, 130]) {
    await look(azimuth, 48, 2.6 * r, [cx, cy, cz]);
    const boxes = await pixels((await page.evaluate((ps) => ps.map((p) => window.kerf.pickRest(...p)), points)).map(([x, y]) => ({ x: x - half, y: y - half, w: side, h: side })));
    seen.push(boxes.map((d) => d.filter((_, i) => i % 4 === 1).sort((x, y) => x - y)));
  }
  // Green of meat without light on it is little; where the square of one side is even, it is meat alone.
  const even = points.map((_, i) => i).filter((i) => seen.some((s) => s[i].at(-1) < 60));
  const apart = even.map((i) => Math.abs(seen[0][i][side * half] - seen[1][i][side * half])).sort((x, y) => y - x);
  assert.ok(even.length > 15, `${even.length} places of meat`);
  assert.ok(apart[2] > 25, `the largest differences in green are ${apart.slice(0, 5)}`);
});

await check('edges of fat are no stairs seen near', async () => {
  await look(-60, 30, 0.35 * r, [cx + 0.3 * r, cy - 0.4 * r, cz + 0.1 * r]);
  const [x, y, w, h] = [150, 330, 600, 270], [d] = await pixels([{ x, y, w, h }]);
  let steps = 0, least = 255, most = 0;
  for (let j = 0; j < h; j++) {
    for (let i = 0; i + 1 < w; i++) {
      const green = d[4 * (j * w + i) + 1];
      least = Math.min(least, green);
      most = Math.max(most, green);
      if (Math.abs(green - d[4 * (j * w + i + 1) + 1]) > 45) steps++;
    }
  }
  assert.ok(most - least > 100, `fat and meat are in view: ${least} to ${most}`);
  assert.ok(steps < 50, `${steps} neighbours differ by more than 45`);
});

await check('what stands still is drawn with finer edges, what moves is not', async () => {
  const fineness = () => page.evaluate(() => { const view = document.getElementById('view'); return view.width / view.clientWidth; });
  /** Neighbours across the rim of the board against what is behind it that differ by nearly all. */
  const stairs = async () => {
    const shot = await page.screenshot();
    return page.evaluate(async (base64) => {
      const image = await createImageBitmap(new Blob([Uint8Array.from(atob(base64), (c) => c.charCodeAt(0))], { type: 'image/png' }));
      const g = new OffscreenCanvas(image.width, image.height).getContext('2d');
      g.drawImage(image, 0, 0);
      const d = g.getImageData(0, 0, image.width, image.height).data;
      let n = 0;
      for (let i = 0; i + 8 < d.length; i += 4) if (Math.abs(d[i + 2] - d[i + 6]) > 60) n++;
      return n;
    }, shot.toString('base64'));
  };
  await look(-75, 35, 3 * r, [cx, cy, cz]);
  await page.waitForTimeout(100);
  const moved = [await fineness(), await stairs()];
  await still(page);
  await page.waitForTimeout(300);
  const stands = [await fineness(), await stairs()];
  assert.deepEqual([moved[0], stands[0]], [1, 2]);
  assert.ok(stands[1] < 0.8 * moved[1], `${moved[1]} steps of colour while it moves, ${stands[1]} when it stands`);
  await look(-75, 36);
  await page.waitForTimeout(100);
  assert.equal(await fineness(), 1);
});

await check('what a body lies on is darker beside it', async () => {
  await look(-90, 60, 3 * r, [cx, cy, cz]);
  // On the side of the sun (-x), where no shadow falls: the last pixels of the board before the meat, and those a way off.
  const [[from, y], [to]] = await places([[cx - 1.05 * r, cy, cz - 0.05 * r], [cx, cy, cz]]);
  const w = Math.round(to - from), [d] = await pixels([{ x: from, y, w, h: 1 }]);
  const isMeat = (i) => d[4 * i] > 3 * d[4 * i + 1];
  let rim = 0;
  while (rim < w && !isMeat(rim)) rim++;
  const mean = (a, b) => { let s = 0; for (let i = a; i < b; i++) s += d[4 * i + 1]; return s / (b - a); };
  assert.ok(rim > 40 && rim < w, `the board is seen for ${rim} of ${w} pixels`);
  const beside = mean(rim - 6, rim - 2), off = mean(rim - 38, rim - 30);
  assert.ok(beside < off - 2, `${beside} beside the body, ${off} away from it`);
});

await check('no light is seen between a body and what it lies on', async () => {
  // The near rim from low: below the last red of each column lies the board, in the shade of the rim first.
  await look(-110, 22, 1.1 * r, [cx - 0.3 * r, cy - 0.5 * r, cz]);
  const [w, h] = [300, 400], [d] = await pixels([{ x: 300, y: 220, w, h }]);
  const at = (i, j) => d.slice(4 * (j * w + i), 4 * (j * w + i) + 3), meat = ([red, green]) => red > 2.4 * green;
  let lit = 0, columns = 0;
  for (let i = 0; i < w; i += 4) {
    let rim = h - 1;
    while (rim >= 0 && !meat(at(i, rim))) rim--;
    if (rim < 0 || rim + 30 > h) continue;
    const green = Array.from({ length: 18 }, (_, k) => at(i, rim + 2 + k)[1]);
    columns++;
    if (Math.max(...green.slice(0, 4)) > 1.3 * Math.min(...green)) lit++;
  }
  assert.ok(columns > 40, `${columns} columns with a rim`);
  assert.ok(lit < 0.25 * columns, `${lit} of ${columns} columns are lit below the rim`);
});

await check('the wall of a fresh cut is darker than when it has dried', async () => {
  await look(-100, 32, 1.6 * r, [cx - 0.05 * r, cy - 0.45 * r, cz]);
  await page.keyboard.press('Space');
  await until(page, () => window.kerf.state().playing);
  await page.keyboard.press('1');
  const [from, to] = await places([[cx - 0.05 * r, cy - 1.0 * r, cz], [cx, cy + 0.25 * r, cz + 0.1 * r]]);
  const { patches: before, time: began } = await state(page);
  await drag(page, [from[0], from[1] + 20], to);
  await until(page, (n) => window.kerf.state().patches > n, before);
  await page.waitForTimeout(500);
  await page.keyboard.press('4');
  const [lip] = await places([[cx - 0.16 * r, cy - 0.45 * r, cz + 0.12 * r]]);
  await page.keyboard.down('Shift');
  await drag(page, lip, [lip[0] - 60, lip[1] - 10]);
  await page.keyboard.up('Shift');
  await page.waitForTimeout(800);
  await page.keyboard.press('Space');
  await until(page, () => !window.kerf.state().playing);
  await page.mouse.move(5, 300);
  const born = await page.evaluate((t) => { const { birth, nv } = window.kerf.app.mesh.state; return birth.subarray(0, nv).filter((b) => b >= t).length; }, began);
  // As old as the body: what a page shows that comes later.
  const age = (time) => page.evaluate((t) => { const { app } = window.kerf, m = app.mesh; m.state.birth.fill(t ?? app.time); m.attributes.birth.needsUpdate = true; app.touch(true); }, time);
  const light = async () => (await pixels([{ x: 200, y: 100, w: 500, h: 400 }]))[0].reduce((s, v, i) => s + (i % 4 < 3 ? v : 0), 0);
  await age(null);
  const fresh = await light();
  await age(-1e6);
  const dry = await light();
  assert.ok(dry - fresh > 30000, `dry ${dry}, fresh ${fresh}`);
  assert.ok(born > 100, `${born} vertices are as young as the cut`);
});

await check('through the arthroscope a joint is around, and what is looked at is neither dark nor washed out', async () => {
  await page.evaluate(() => window.kerf.app.command(8, [0], 'trainer'));
  await sceneShows(page, 'trainer');
  await page.mouse.move(5, 300);
  await page.keyboard.press('q');
  await until(page, () => window.kerf.state().scopeOn);
  const { width, height } = page.viewportSize(), half = 20;
  const box = (x, y) => ({ x: x - half, y: y - half, w: 2 * half, h: 2 * half });
  const channel = (d, c) => d.filter((_, i) => i % 4 === c), mean = (a) => a.reduce((x, y) => x + y, 0) / a.length;
  // Synovium is red and uneven.
  const [wall] = await pixels([{ x: 0.5 * width - 0.2 * height, y: 0.1 * height, w: Math.round(0.4 * height), h: Math.round(0.1 * height) }]);
  const red = channel(wall, 0);
  assert.ok(mean(red) > 1.3 * mean(channel(wall, 1)) && mean(red) > 30, `red ${mean(red)}, green ${mean(channel(wall, 1))}`);
  assert.ok(Math.max(...red) - Math.min(...red) > 15, `the wall is one red: ${Math.min(...red)} to ${Math.max(...red)}`);
  // A camera sets its light: the middle of the picture stays as bright while the optic goes in to half the way.
  for (const push of [0, 0.08, 0.08]) {
    await page.evaluate((by) => { const { app } = window.kerf; app.stage.scope.push(by); app.stage.placeScope(); app.touch(true); }, push);
    const [middle] = await pixels([box(0.5 * width, 0.4 * height)]), light = mean(channel(middle, 1));
    assert.ok(light > 60 && light < 235, `green ${light} in the middle, after ${push} of the way`);
  }
});

await finish();
