// Random gestures on the page, made up from a seed: strokes, loops, drags, clicks, keys, buttons, windows, in any order. What the page draws must
// then be what the engine has, as a page that has just come is told it (see browser.mjs):
//   node tests/end_to_end/gestures.mjs PROGRAM [OUT] [GESTURES] [SEED] [SCENE...]
// The recording of all of it must replay to the same bits. A failure names seed and gesture.
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { writeFileSync } from 'node:fs';
import { join } from 'node:path';

const [gestures, seed, ...scenes] = process.argv.slice(4);
process.argv.length = Math.min(process.argv.length, 4);  // names of checks come from nowhere else
const { check: checkOn, finish, openPage, out, program, startServer, state, stopServer, until } = await import('./browser.mjs');

const kEvery = 25;  // gestures between two looks
const kScenes = scenes.length > 0 ? scenes : ['steak', 'trainer', 'sheet'];
let random = Number(seed ?? 1) >>> 0;
const any = () => { random = (Math.imul(random, 1664525) + 1013904223) >>> 0; return random / 2 ** 32; };
const below = (n) => Math.floor(any() * n), one = (list) => list[below(list.length)], chance = (p) => any() < p;

let page = null;
const check = (name, use) => checkOn(name, () => page, use);
const did = [];

/** A place of the window on the body, or somewhere else. */
async function somewhere(on = 0.8) {
  const size = page.viewportSize();
  if (!chance(on)) return [below(size.width), below(size.height)];
  const { bounds } = await state(page);
  const at = await page.evaluate(([c, r, p]) => window.kerf.pickPoint(c[0] + r * p[0], c[1] + r * p[1], c[2]), [bounds.center, 1.1 * bounds.radius, [2 * any() - 1, 2 * any() - 1]]);
  return [Math.max(1, Math.min(size.width - 2, at[0])), Math.max(1, Math.min(size.height - 2, at[1]))];
}
async function path() {
  const a = await somewhere(), b = await somewhere(), n = 2 + below(30);
  const kind = below(4), out = [];
  for (let i = 0; i <= n; i++) {
    const t = i / n;
    if (kind === 0) out.push([a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]);
    else if (kind === 1) { const w = 7 * t, r = Math.hypot(b[0] - a[0], b[1] - a[1]) / 3; out.push([a[0] + r * Math.cos(w), a[1] + r * Math.sin(w)]); }
    else if (kind === 2) out.push([a[0] + t * (b[0] - a[0]) + (i % 2 ? 25 : -25), a[1] + t * (b[1] - a[1]) + (i % 2 ? 15 : -15)]);
    else out.push([a[0] + t * (b[0] - a[0]) + 40 * (any() - 0.5), a[1] + t * (b[1] - a[1]) + 40 * (any() - 0.5)]);
  }
  return out;
}
const kToolKeys = ['1', '2', '3', '4', '5', '6', '7', '8', '9', '0', 'v', 'u', 'a', 'i'];
const kCutting = ['1', '1', '1', '2', '3', '9', '0'];

const kGestures = {
  async stroke() {
    await page.keyboard.press(chance(0.7) ? one(kCutting) : one(kToolKeys));
    const places = await path(), shift = chance(0.15), button = chance(0.08) ? 'right' : 'left', breaks = chance(0.15) ? below(places.length) : -1;
    if (shift) await page.keyboard.down('Shift');
    await page.mouse.move(...places[0]);
    await page.mouse.down({ button });
    for (const [i, p] of places.entries()) {
      await page.mouse.move(...p);
      if (chance(0.1)) await page.waitForTimeout(below(30));
      if (i !== breaks) continue;
      const how = below(6);
      did.push(`  broken off by ${['Escape', 'another tool', 'Z', 'a second button', 'the window', 'Space'][how]}`);
      if (how === 0) await page.keyboard.press('Escape');
      else if (how === 1) await page.keyboard.press(one(kToolKeys));
      else if (how === 2) await page.keyboard.press('z');
      else if (how === 3) { await page.mouse.down({ button: 'right' }); await page.mouse.up({ button: 'right' }); }
      else if (how === 4) await page.evaluate(() => window.dispatchEvent(new Event('blur')));
      else await page.keyboard.press('Space');
    }
    await page.mouse.up({ button });
    if (shift) await page.keyboard.up('Shift');
  },
  async click() { await page.mouse.click(...await somewhere()); },
  async undo() { for (let i = 1 + below(3); i > 0; i--) await page.keyboard.press('z'); },
  async redo() { await page.keyboard.press('Shift+Z'); },
  async play() { await page.keyboard.press('Space'); },
  async step() { await page.keyboard.press('.'); },
  async turn() {
    const [a, b] = [await somewhere(), await somewhere()];
    await page.mouse.move(...a);
    await page.mouse.down({ button: 'right' });
    await page.mouse.move(...b, { steps: 4 });
    await page.mouse.up({ button: 'right' });
  },
  async zoom() { await page.mouse.move(...await somewhere()); await page.mouse.wheel(0, 200 * (any() - 0.5)); },
  async home() { await page.keyboard.press('h'); },
  async views() { await page.keyboard.press(one(['s', 's', 'w', 'o', 'x', 'b', 'l', 'n', 'k'])); },
  async window() { await page.setViewportSize(one([{ width: 900, height: 640 }, { width: 500, height: 700 }, { width: 1000, height: 500 }])); },
  async panel() { await page.keyboard.press('m'); },
  async scope() { await page.keyboard.press('q'); },
  async size() { await page.keyboard.press(one(['<', '>'])); },
  async gravity() { await page.keyboard.press('g'); },
  async help() { await page.keyboard.press('?'); await page.keyboard.press('Escape'); },
  async wait() { await page.waitForTimeout(below(400)); },
};
const kOften = { stroke: 12, click: 3, undo: 3, redo: 1, play: 1, turn: 2, wait: 2 };
const kBag = Object.keys(kGestures).flatMap((name) => Array(kOften[name] ?? 1).fill(name));

/** What a page draws and shows, arrays as hashes. */
const told = (p) => p.evaluate(() => {
  const hash = (array) => {
    const bytes = new Uint8Array(array.buffer, array.byteOffset, array.byteLength);
    let h = 2166136261;
    for (let i = 0; i < bytes.length; i++) h = Math.imul(h ^ bytes[i], 16777619);
    return `${array.length}:${(h >>> 0).toString(16)}`;
  };
  const s = window.kerf.app.mesh.state, k = window.kerf.state();
  return {
    version: s.version, rest: hash(s.rest.subarray(0, 3 * s.nv)), normal: hash(s.normal.subarray(0, 4 * s.nv)), copy: hash(s.copy.subarray(0, s.nv)),
    offset: hash(s.offset.subarray(0, 3 * s.nv)), skin: hash(s.skin.subarray(0, 3 * s.ns)), wall: hash(s.wall.subarray(0, 3 * s.nw)),
    copies: hash(s.copies.subarray(0, 8 * s.nc)), cells: hash(s.cells.subarray(0, 4 * s.nc)), nodes: hash(s.nodes.subarray(0, 3 * s.nn)),
    fixed: hash(window.kerf.app.mesh.fixed), pieces: k.pieces, counts: k.counts, undoDepth: k.undoDepth, redoDepth: k.redoDepth, playing: k.playing, time: k.time, score: k.score,
    read: document.getElementById('r-pieces').textContent,
  };
});

/** Resolves when the engine has done all that the page asked for: a ray is answered after it. A step of a body that is jammed may take a second. */
const allDone = () => new Promise((resolve) => {
  const app = window.kerf.app, hit = app.hit.bind(app), asked = app.engine.ray([0, 0, 1], [0, 0, 1]);
  app.hit = (answer) => {
    hit(answer);
    if (answer.input < asked) return;
    delete app.hit;
    resolve();
  };
});

async function compare(server) {
  await page.keyboard.press('Escape');  // a stroke that was left, or the panel
  if ((await state(page)).playing) await page.keyboard.press('Space');
  await until(page, () => !window.kerf.state().playing && !window.kerf.state().stroke);
  await page.evaluate(allDone);
  // What the engine has is on the page once the time stands still and the version too.
  for (let last = '', same = 0, round = 0; same < 3; round++) {
    assert.ok(round < 200, `it does not come to rest: ${last}`);
    await page.waitForTimeout(150);
    const s = await state(page), now = `${s.version} ${s.time} ${s.undoDepth} ${s.stats?.pieces}`;
    same = now === last ? same + 1 : 0;
    last = now;
  }
  const fresh = await openPage(server.url);
  await until(fresh, () => window.kerf.state().stats !== null);
  await page.waitForTimeout(300);
  const [mine, theirs] = [await told(page), await told(fresh)];
  await fresh.close();
  await until(page, () => window.kerf.state().role.clients === 1);
  assert.deepEqual(mine, theirs);
  const s = await state(page);
  const buttons = await page.evaluate(() => ['undo', 'redo'].map((id) => document.getElementById(id).disabled));
  assert.deepEqual(buttons, [s.undoDepth === 0, s.redoDepth === 0], 'undo and redo');
  assert.equal(s.stats.bad, 0, 'messages that the engine could not read');
  assert.ok(s.toolAllowed && s.connection === 'live');
}

for (const name of kScenes) {
  await check(`${gestures ?? 300} gestures in ${name}, seed ${seed ?? 1}`, async () => {
    const server = await startServer(name);
    page = await openPage(server.url);
    await page.evaluate(() => {
      window.recorded = null;
      window.broken = [];
      const app = window.kerf.app, cut = app.listener.cut.bind(app.listener);
      app.listener.file = (file, bytes) => { window.recorded = new TextDecoder().decode(bytes); };
      app.listener.cut = (r) => { if (r && r.invariants === 1) window.broken.push(r.text); cut(r); };
      app.setRecording(true);
    });
    const total = Math.ceil(Number(gestures ?? 300) / kScenes.length);
    did.length = 0;
    const file = join(out, `gestures-${name}.kerfrec`);
    const saveRecording = async () => {
      await page.evaluate(() => { window.kerf.app.setRecording(false); });
      await until(page, () => window.recorded !== null);
      writeFileSync(file, await page.evaluate(() => window.recorded));
    };
    try {
      for (let i = 1; i <= total; i++) {
        const what = one(kBag);
        did.push(`${i} ${what}`);
        await kGestures[what]();
        if (i % kEvery === 0 || i === total) await compare(server);
      }
      assert.deepEqual(await page.evaluate(() => window.broken), [], 'broken invariants');
      await saveRecording();
    } catch (e) {
      e.message += `\nafter ${did.slice(-kEvery - 5).join(', ')}`;
      await saveRecording().then(() => { e.message += `\nrecorded in ${file}`; }, (why) => { e.message += `\nnot recorded: ${why.message}`; });
      throw e;
    }
    const last = await state(page);
    const replay = spawn(program, ['replay', file], { stdio: 'ignore' });
    assert.equal(await new Promise((r) => { replay.on('exit', r); }), 0, `kerf replay ${file}`);
    console.log(`     ${last.cuts} cuts, ${last.pieces} pieces, ${last.counts.visualTriangles} triangles`);
    await page.close();
    await stopServer(server);
  });
}
await finish();
