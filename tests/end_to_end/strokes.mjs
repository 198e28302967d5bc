// Strokes come whole, however busy page and engine are (see browser.mjs):
//   node tests/end_to_end/strokes.mjs PROGRAM [OUT [PART OF A NAME...]]
import assert from 'node:assert/strict';
import { check as checkOn, finish, openPage, ready, rest, sceneShows, settled, startServer, state, stopServer, until } from './browser.mjs';

const check = (name, use) => checkOn(name, () => page, use);
const server = await startServer('steak');
let page = await openPage(server.url);

/** What leaves the page: its Tool messages, as docs/protocol.md says. */
const sent = [];
page.on('websocket', (socket) => socket.on('framesent', ({ payload }) => {
  if (typeof payload === 'string' || payload.readUInt16LE(0) !== 66) return;
  const samples = [];
  for (let i = 0; i < payload.readUInt32LE(24); i++)
    samples.push({ time: payload.readDoubleLE(32 + 64 * i), direction: [0, 1, 2].map((k) => payload.readDoubleLE(64 + 64 * i + 8 * k)) });
  sent.push({ input: payload.readUInt32LE(8), tool: payload.readUInt32LE(12), phase: payload.readUInt32LE(16), samples });
}));
await page.reload();
await ready(page);
/** Waits until a stroke is up, and gives all samples that were sent. */
async function whole() {
  for (let round = 0; round < 300 && sent.at(-1)?.phase !== 2; round++) await new Promise((r) => { setTimeout(r, 20); });
  assert.deepEqual([sent[0].phase, sent.at(-1).phase], [0, 2], 'down first, up last');
  return sent.splice(0);
}
const samplesOf = (messages) => messages.flatMap((m) => m.samples);
/** Rays of places of the window. */
const rays = (places) => page.evaluate((list) => list.map(([x, y]) => {
  const box = document.getElementById('view').getBoundingClientRect();
  return window.kerf.app.stage.ray(x - box.left, y - box.top).direction;
}), places);
async function sameRays(samples, places) {
  const expected = await rays(places);
  assert.equal(samples.length, expected.length, 'samples that the engine was sent');
  samples.forEach((s, i) => assert.ok(Math.hypot(...s.direction.map((x, k) => x - expected[i][k])) < 1e-9, `sample ${i} has another ray`));
}
/** A wavy line over the steak of n places after the first, at y. Strokes along different lines meet material that is whole. */
async function wave(n, y) {
  const [a, b] = [await rest(page, [-0.05, y, 0.01]), await rest(page, [0.05, y, 0.01])];
  return Array.from({ length: n + 1 }, (_, i) => [Math.round(a[0] + ((b[0] - a[0]) * i) / n), Math.round(a[1] + (i % 2 ? 3 : 0) + ((b[1] - a[1]) * i) / n)]);
}
const busy = (ms) => page.evaluate((t) => { setTimeout(() => { const end = performance.now() + t; while (performance.now() < end); }, 0); }, ms);

await settled(page, [0, -0.03, 0.01]);
await page.keyboard.press('Space');  // nothing moves: what is drawn over stays where it is
await until(page, () => !window.kerf.state().playing);

await check('all samples of a stroke reach the engine, those that the browser has put together too', async () => {
  // Made up: events with the same time stamp, in any number.
  for (const [events, each, y] of [[400, 1, -0.035], [60, 20, -0.02]]) {
    const places = await wave(events * each, y);
    await page.mouse.move(...places[0]);
    await page.mouse.down();
    await page.evaluate(([list, n]) => {
      const view = document.getElementById('view');
      for (let i = 0; i < list.length; i += n) {
        const make = ([x, y], coalescedEvents) => new PointerEvent('pointermove', { pointerId: 1, pointerType: 'mouse', clientX: x, clientY: y, buttons: 1, bubbles: true, ...(coalescedEvents ? { coalescedEvents } : {}) });
        const group = list.slice(i, i + n);
        view.dispatchEvent(make(group.at(-1), group.map((p) => make(p))));
      }
    }, [places.slice(1), each]);
    await page.mouse.up();
    const messages = await whole();
    await sameRays(samplesOf(messages), [places[0], ...places.slice(1), places[0]]);
    assert.equal((await state(page)).stats.bad, 0);
  }
});

await check('all samples of a mouse reach the engine, while the page is busy and while the engine is', async () => {
  const cdp = await page.context().newCDPSession(page);
  for (const [what, y] of [['nothing', -0.005], ['page', 0.01], ['engine', 0.025]]) {
    const places = await wave(300, y);
    await page.mouse.move(...places[0]);
    await page.mouse.down();
    const moves = [];
    for (let i = 1; i < places.length; i++) {
      if (i % 100 === 20 && what === 'page') await busy(400);
      if (i === 20 && what === 'engine') server.child.kill('SIGSTOP');
      if (i === 220 && what === 'engine') server.child.kill('SIGCONT');
      moves.push(cdp.send('Input.dispatchMouseEvent', { type: 'mouseMoved', x: places[i][0], y: places[i][1], button: 'left', buttons: 1 }));
      if (what !== 'page') await new Promise((r) => { setTimeout(r, 4); });
    }
    await Promise.all(moves);
    await page.mouse.up();
    const messages = await whole(), samples = samplesOf(messages);
    await sameRays(samples, [...places, places[0]]);
    for (let i = 1; i < samples.length; i++) assert.ok(samples[i].time >= samples[i - 1].time, 'in order');
    console.log(`     ${what} busy: ${samples.length} samples in ${messages.length} messages, at most ${Math.max(...messages.map((m) => m.samples.length))} in one`);
    await until(page, (input) => window.kerf.state().cut?.input === input, messages.at(-1).input);
    assert.equal((await state(page)).cut.outcome, 0, 'something is cut');
    assert.equal((await state(page)).stats.bad, 0);
  }
});

await check('a circle is cut as a circle: no corner that an eye can see', async () => {
  await page.keyboard.press('r');
  await until(page, () => !window.kerf.state().playing && window.kerf.state().time === 0);
  await page.evaluate(() => { window.kerf.look(-10, 70); });
  await page.waitForTimeout(500);
  const [middle, radius, n] = [await rest(page, [0, 0.02, 0.01]), 75, 80];
  const at = (i) => [middle[0] + radius * Math.cos((2 * Math.PI * i) / n), middle[1] + radius * Math.sin((2 * Math.PI * i) / n)];
  const { cuts } = await state(page);
  await page.mouse.move(...at(0));
  await page.mouse.down();
  for (let i = 1; i <= n; i++) await page.mouse.move(...at(i));
  await page.mouse.up();
  await until(page, (k) => window.kerf.state().cuts > k, cuts);
  await page.waitForTimeout(1500);
  // The lips on the side that is seen, in pixels: how far beside the circle, and how far off its tangent.
  const seen = await page.evaluate(([x, y, r]) => {
    const { state: body, crease: { lips } } = window.kerf.app.mesh, rest = (v) => body.rest.subarray(3 * v, 3 * v + 3);
    const seen = { edges: 0, beside: 0, askew: 0, longest: 0 };
    for (let e = 0; e < lips.count; e++) {
      const [a, b] = [rest(lips.ends[2 * e]), rest(lips.ends[2 * e + 1])];
      if (a[2] < 0.003 || b[2] < 0.003) continue;
      const p = window.kerf.pickRest(...a), q = window.kerf.pickRest(...b), length = Math.hypot(q[0] - p[0], q[1] - p[1]);
      const radial = [(p[0] + q[0]) / 2 - x, (p[1] + q[1]) / 2 - y], away = Math.hypot(...radial);
      if (Math.abs(away - r) > 0.2 * r) continue;  // of other strokes
      seen.edges++;
      seen.beside = Math.max(seen.beside, Math.abs(away - r));
      seen.longest = Math.max(seen.longest, length);
      if (length > 3) seen.askew = Math.max(seen.askew, Math.abs(Math.asin((radial[0] * (q[0] - p[0]) + radial[1] * (q[1] - p[1])) / (away * length))));
    }
    seen.askew *= 180 / Math.PI;
    return seen;
  }, [...middle, radius]);
  console.log(`     ${JSON.stringify(seen)}`);
  assert.ok(seen.edges > 100);
  assert.ok(seen.beside < 1.5 && seen.askew < 20 && seen.longest < 12, 'half a pixel between a chord and the circle');
});

await check('a stroke from near one rim to near the other parts the body, of a finger from farther away', async () => {
  await page.evaluate(() => { window.kerf.app.command(8, [], 'sheet'); });
  await sceneShows(page, 'sheet');
  await page.keyboard.press('r');  // flat
  await until(page, () => !window.kerf.state().playing && window.kerf.state().time === 0);
  await page.mouse.move(5, 300);
  await page.waitForTimeout(800);
  const cdp = await page.context().newCDPSession(page);
  await page.evaluate(() => { window.kerf.look(-20, 50); });
  await page.waitForTimeout(500);
  const box = await page.evaluate(() => window.kerf.app.info.box);
  const [a, b, middle] = await page.evaluate(([lo, hi]) => [hi[1], lo[1], 0.5 * (lo[1] + hi[1])].map((y) => window.kerf.pickPoint(0.1 * hi[0], y, hi[2])), [box.min, box.max]);
  const inside = (p, pixels) => { const d = Math.hypot(middle[0] - p[0], middle[1] - p[1]); return [0, 1].map((k) => p[k] + (pixels * (middle[k] - p[k])) / d); };
  const pieces = async (kind, pixels) => {
    const [from, to] = [inside(a, pixels), inside(b, pixels)], cuts = (await state(page)).cuts;
    const at = (i) => [0, 1].map((k) => from[k] + ((to[k] - from[k]) * i) / 30);
    if (kind === 'mouse') {
      await page.mouse.move(...from);
      await page.mouse.down();
      for (let i = 1; i <= 30; i++) await page.mouse.move(...at(i));
      await page.mouse.up();
    } else {
      const touch = (type, ...points) => cdp.send('Input.dispatchTouchEvent', { type, touchPoints: points.map(([x, y]) => ({ x, y })) });
      await touch('touchStart', from);
      for (let i = 1; i <= 30; i++) await touch('touchMove', at(i));
      await touch('touchEnd');
    }
    await until(page, (n) => window.kerf.state().cuts > n, cuts);
    const n = (await state(page)).pieces;
    await page.keyboard.press('z');
    await until(page, () => window.kerf.state().undoDepth === 0 && window.kerf.state().pieces === 1);
    return n;
  };

  assert.deepEqual([await pieces('mouse', 5), await pieces('mouse', 16), await pieces('touch', 16), await pieces('touch', 40)], [2, 1, 2, 1]);
});

/** Pixels of the ink, and where they begin and end in the window. */
const inkSeen = () => page.evaluate(() => {
  const c = document.getElementById('ink'), at = c.getBoundingClientRect();
  const seen = { pixels: 0, from: [Infinity, Infinity], to: [-Infinity, -Infinity] };
  if (c.hidden || c.width === 0 || c.height === 0) return seen;
  const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
  for (let i = 0; 4 * i < d.length; i++) {
    if (d[4 * i + 3] === 0) continue;
    seen.pixels++;
    const place = [at.left + ((i % c.width) * at.width) / c.width, at.top + (Math.floor(i / c.width) * at.height) / c.height];
    for (const k of [0, 1]) { seen.from[k] = Math.min(seen.from[k], place[k]); seen.to[k] = Math.max(seen.to[k], place[k]); }
  }
  return seen;
});
const inked = async () => (await inkSeen()).pixels;
/** A line across the sheet that lies flat, from beside it to beside it, in n places. */
async function across(n) {
  await page.evaluate(() => { window.kerf.look(0, 80); });
  await page.waitForTimeout(300);
  const ends = await page.evaluate(() => [-0.6, 0.6].map((y) => window.kerf.pickPoint(0.05, y, 0)));
  return Array.from({ length: n + 1 }, (_, i) => [0, 1].map((k) => ends[0][k] + ((ends[1][k] - ends[0][k]) * i) / n));
}
async function draw(places) {
  await page.mouse.move(...places[0]);
  await page.mouse.down();
  for (const p of places.slice(1)) await page.mouse.move(...p);
}
async function afresh() {
  await page.keyboard.press('r');
  await until(page, () => window.kerf.state().undoDepth === 0 && window.kerf.state().pieces === 1 && !window.kerf.state().playing);
  await page.keyboard.press('1');
}

await check('what was drawn is ink until it is cut', async () => {
  await afresh();
  const places = await across(60);
  server.child.kill('SIGSTOP');
  try {
    await draw(places);
    await page.waitForTimeout(300);
    assert.equal((await state(page)).ink, 61);
    const { pixels: whole, from, to } = await inkSeen();
    for (const k of [0, 1]) {
      const along = [places[0][k], places[60][k]];
      assert.ok(Math.abs(from[k] - Math.min(...along)) < 4 && Math.abs(to[k] - Math.max(...along)) < 4, `ink from ${from} to ${to}, the line from ${places[0]} to ${places[60]}`);
    }
    await page.mouse.up();
    await page.waitForTimeout(600);
    assert.equal((await state(page)).ink, 62, 'the pointer is up, and nothing is cut yet');
    const length = Math.hypot(places[60][0] - places[0][0], places[60][1] - places[0][1]);
    const after = await inked();
    assert.ok(whole > 1.5 * length && after >= whole, `${whole} and ${after} pixels of ink on a line of ${length}`);
  } finally {
    server.child.kill('SIGCONT');
  }
  await until(page, () => window.kerf.state().pieces === 2 && window.kerf.state().ink === 0);
  await page.waitForTimeout(500);
  assert.equal(await inked(), 0);
  // While the engine keeps up there is ink at the pointer at most.
  await afresh();
  await draw(places.slice(0, 40));
  await until(page, () => window.kerf.state().ink <= 1);
  await page.keyboard.press('Escape');
  await page.mouse.up();
  await until(page, () => window.kerf.state().ink === 0 && window.kerf.state().undoDepth === 0);
});

await check('a stroke in whose middle the page goes is cut as far as it was drawn', async () => {
  for (const [key, how] of [['1', 'reload'], ['2', 'reload'], ['1', 'blur'], ['2', 'blur'], ['4', 'blur']]) {
    await afresh();
    const places = await across(30);
    await page.keyboard.press(key);
    await draw(places);
    if (how === 'reload') {
      await page.reload();
      await ready(page);
    } else {
      await page.evaluate(() => window.dispatchEvent(new Event('blur')));
    }
    await page.mouse.up();
    const cut = key === '4' ? 0 : 1;
    await until(page, (n) => window.kerf.state().undoDepth === n && window.kerf.state().stats?.pieces === n + 1, cut).catch((e) => { throw new Error(`${key} ${how}: ${e.message}`); });
  }
});

await stopServer(server);
await finish();
