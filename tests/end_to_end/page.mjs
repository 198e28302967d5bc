// What the page does with windows, keys, dialogs, lost connections, fingers and readers of screens (see browser.mjs):
//   node tests/end_to_end/page.mjs PROGRAM [OUT [PART OF A NAME...]]
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { check as checkOn, difference, drag, finish, line, openPage, out, rest, sceneShows, squareFile, startServer, state, stopServer, until, viewer } from './browser.mjs';

/** Each check begins with the steak in a window of this size, whatever became of the one before. */
const kWindow = { width: 900, height: 640 };
const check = (name, use) => checkOn(name, () => page, async () => {
  await page.setViewportSize(kWindow);
  const { scene: shownNow, connection } = await state(page);
  if (connection === 'live' && shownNow !== 'steak') await scene('steak');
  await use();
});
let server = await startServer('steak');
let page = await openPage(server.url);

const shown = (id) => page.evaluate((i) => { const e = document.getElementById(i); return !e.hidden && e.getClientRects().length > 0; }, id);
const text = (id) => page.evaluate((i) => document.getElementById(i).textContent, id);
const toasts = () => page.evaluate(() => [...document.querySelectorAll('#toasts p')].map((p) => p.textContent));
const says = (part) => page.waitForFunction((t) => [...document.querySelectorAll('#toasts p')].some((p) => p.textContent.includes(t)), part);
const scene = async (name) => {
  const { bodies } = await state(page);
  await page.evaluate((n) => { window.kerf.app.command(8, [], n); }, name);
  await until(page, ([n, b]) => window.kerf.state().scene === n && window.kerf.state().ready && window.kerf.state().bodies > b, [name, bodies]);
};
const playing = (on) => until(page, (want) => window.kerf.state().playing === want, on);
const drop = (name, bytes) => page.evaluate(([n, t]) => {
  const files = new DataTransfer();
  files.items.add(new File([t], n));
  document.body.dispatchEvent(new DragEvent('drop', { dataTransfer: files, bubbles: true, cancelable: true }));
}, [name, bytes]);

/** The sheet with nothing below it; every shipped scene with weight has a floor. */
const floorless = async () => {
  const { bodies } = await state(page), text = readFileSync(join(viewer, '../../scenes/sheet.toml'), 'utf8');
  await drop('floorless.toml', text.replace(/\[\[obstacle\]\][\s\S]*?\n\n/, ''));
  await until(page, (b) => window.kerf.state().ready && window.kerf.state().bodies > b && window.kerf.state().floor === null, bodies);
};

/** How much the picture around the middle of the body changes where the body is left out. */
async function bodyShows() {
  await page.mouse.move(5, 300);
  const shot = async (visible) => {
    await page.evaluate((v) => { window.kerf.app.mesh.group.visible = v; window.kerf.app.resetCamera(); }, visible);
    await page.waitForTimeout(700);
    return page.screenshot();
  };
  const without = await shot(false), with_ = await shot(true);
  const at = await page.evaluate(() => window.kerf.pickPoint(...window.kerf.state().bounds.center));
  return difference(page, without, with_, at.map(Math.round), 40);
}

const overlaps = () => page.evaluate(() => {
  const parts = ['brand', 'scene', 'connection', 'recording', 'claim', 'readout', 'banner', 'loading', 'away'].map((id) => [id, document.getElementById(id)])
    .concat([...document.querySelectorAll('.card')].map((e) => [e.id || e.className, e]))
    .map(([name, e]) => [name, e, e.getBoundingClientRect()]).filter(([, , r]) => r.width > 0);
  return parts.flatMap(([m, e, a], i) => parts.slice(i + 1)
    .filter(([, f, b]) => !e.contains(f) && !f.contains(e) && a.left < b.right - 1 && b.left < a.right - 1 && a.top < b.bottom - 1 && b.top < a.bottom - 1)
    .map(([n]) => `${m} and ${n}`)).concat(parts.filter(([, , r]) => r.left < 0 || r.right > innerWidth + 0.5 || r.top < 0 || r.bottom > innerHeight + 0.5).map(([n]) => `${n} is cut off`));
});

await check('a body is seen after the window changed and another scene came', async () => {
  await page.keyboard.press('Space');
  for (const [first, size, second] of [['trainer', [760, 700], 'sheet'], ['sheet', [900, 640], 'trainer']]) {
    await scene(first);
    await page.setViewportSize({ width: size[0], height: size[1] });
    await page.waitForTimeout(300);
    await scene(second);
    const shows = await bodyShows();
    assert.ok(shows > 5, `${second} after ${first}: leaving the body out changes the picture by ${shows}`);
  }
});

await check('a scene opens with its body whole between the controls, at a desk and on a phone', async () => {
  const size = page.viewportSize();
  for (const viewport of [{ width: 1280, height: 720 }, { width: 390, height: 844 }]) {
    await page.setViewportSize(viewport);
    for (const name of ['spiral', 'draped-sheet-104', 'tube', 'steak-on-a-board']) {
      await scene(name);
      if (!(await state(page)).playing) await page.keyboard.press('Space');
      await until(page, () => window.kerf.state().time > 1.5);  // what hangs has sunk
      await page.waitForTimeout(500);
      const hidden = await page.evaluate(() => {
        const s = window.kerf.app.mesh.state, under = new Set();
        for (let v = 0; v < s.nv; v += Math.ceil(s.nv / 150)) {
          const [x, y] = window.kerf.pickRest(...s.rest.subarray(3 * v, 3 * v + 3)), met = document.elementFromPoint(x, y);
          if (!['view', 'ink'].includes(met?.id)) under.add(met?.closest('[id]')?.id ?? `nothing: ${Math.round(x)}, ${Math.round(y)}`);
          for (const id of ['hint', 'transport']) {  // the hint lets the pointer through
            const b = document.getElementById(id).getBoundingClientRect();
            if (x > b.left && x < b.right && y > b.top && y < b.bottom) under.add(id);
          }
        }
        return [...under];
      });
      await page.screenshot({ path: join(out, `opens-${name}-${viewport.width}.png`) });
      assert.deepEqual(hidden, [], `${name}, ${viewport.width} pixels wide: over the body lies`);
    }
  }
  await page.setViewportSize(size);
});

await check('the tray is seen whole where its scene opens, and the steak no smaller than half the window', async () => {
  const size = page.viewportSize();
  for (const viewport of [{ width: 1280, height: 720 }, { width: 390, height: 844 }, { width: 844, height: 390 }]) {
    await page.setViewportSize(viewport);
    await scene('steak-on-a-board');
    await until(page, () => window.kerf.app.things.tools.length > 0);  // a frame has placed them
    await page.waitForTimeout(500);
    const under = await page.evaluate(() => [[-0.09, 0.135], [0.11, 0.135], [-0.09, 0.265], [0.11, 0.265]].map(([x, y]) => {
      const at = window.kerf.pickPoint(x, y, -0.0225), met = document.elementFromPoint(...at);
      return ['view', 'ink'].includes(met?.id) ? null : met?.closest('[id]')?.id ?? `nothing: ${at}`;
    }).filter((e) => e));
    if (viewport.height > 400) assert.deepEqual(under, [], `${viewport.width} pixels wide: over corners of the tray lies`);
    const { bounds: { center: [x, y, z] } } = await state(page), [a, b] = await page.evaluate((ps) => ps.map((p) => window.kerf.pickPoint(...p)), [[x - 0.1, y, z], [x + 0.1, y, z]]);
    const part = Math.hypot(a[0] - b[0], a[1] - b[1]) / Math.min(viewport.width, viewport.height);
    assert.ok(part > 0.5, `the steak takes ${part} of the shorter side`);
  }
  await page.setViewportSize(size);
});

await check('what was clicked does not keep the keyboard', async () => {
  let saved = 0;
  page.on('download', () => { saved++; });
  const was = (await state(page)).playing;
  const picture = page.waitForEvent('download');
  await page.click('#picture');
  await picture;
  await page.keyboard.press('Space');
  await playing(!was);
  await page.keyboard.press('Space');
  await playing(was);
  await page.click('#panel-toggle');
  await page.click('#view-wireframe');
  await page.keyboard.press('Space');
  await playing(!was);
  assert.equal((await state(page)).views.wireframe, true);
  await page.keyboard.press('w');
  assert.equal((await state(page)).views.wireframe, false);
  await page.selectOption('#quality', 'lite');
  await page.click('#quality');
  await page.keyboard.press('Escape');
  for (const [key, tool] of [['4', 'grasp'], ['v', 'shaver'], ['1', 'scalpel']]) {
    await page.keyboard.press(key);
    assert.equal((await state(page)).tool, tool, `${key} with a select in focus`);
  }
  await page.click('#reset');
  const time = (await state(page)).time;
  await page.keyboard.press('Space');
  await playing(was);
  assert.ok((await state(page)).time >= 0 && time >= 0);
  await page.keyboard.press('m');
  await page.waitForTimeout(300);
  assert.equal(saved, 1, 'pictures saved');
});

await check('an operation goes on, however the dialog of its end is closed', async () => {
  await scene('trainer');
  await page.evaluate(() => { window.kerf.app.play(true); document.getElementById('view').focus(); });
  await playing(true);
  for (const [how, close] of [['Escape', () => page.keyboard.press('Escape')], ['the cross', () => page.click('#result form button')], ['Go on', () => page.click('#result-on')]]) {
    await page.keyboard.press('d');
    await until(page, () => document.getElementById('result').open);
    await playing(false);
    await close();
    await until(page, () => !document.getElementById('result').open);
    await page.waitForTimeout(300);  // the page shows at once what it asks for; the engine has answered by then
    assert.equal((await state(page)).playing, true, how);
  }
  // The dialog tells what the panel behind it tells, also of what happens until the engine pauses.
  await page.keyboard.press('d');
  await playing(false);
  const times = () => page.evaluate(() => ['#score', '#result-table'].map((t) => document.querySelector(`${t} tbody`).innerText));
  await page.evaluate(() => { const { app } = window.kerf; app.score({ ...app.scoreNow, time: app.scoreNow.time + 0.2, loosePieces: 2 }); });
  const [behind, told] = await times();
  assert.equal(told, behind);
  assert.match(await text('result-words'), /2 loose pieces are left behind/);
  await page.click('#result-on');
  await page.keyboard.press('d');  // at once: what closing sets in motion does not go on behind the dialog
  await until(page, () => document.getElementById('result').open);
  await playing(false);
  await page.waitForTimeout(300);
  assert.equal((await state(page)).playing, false, 'it is open again');
  await page.click('#result-on');
  await playing(true);
  // Another scene ends the operation: it is not told to go on.
  await page.keyboard.press('d');
  await playing(false);
  await scene('sheet');
  assert.equal(await page.evaluate(() => document.getElementById('result').open), false);
});

await check('a window that changes ends a stroke where it is', async () => {
  await page.setViewportSize({ width: 1280, height: 720 });
  await page.evaluate(() => { window.kerf.app.reset(); window.kerf.app.resetCamera(); window.kerf.app.play(false); document.getElementById('view').focus(); });
  await playing(false);
  await page.waitForTimeout(500);
  const drawn = async () => { await page.waitForTimeout(500); const { version, undoDepth, stroke, ink, drawn: { wall } } = await state(page); return { version, undoDepth, stroke, ink, wall }; };
  /** Draws, changes the window in the middle, and draws on; what was there before, then, and at the end. */
  const interrupted = async (key) => {
    await page.setViewportSize({ width: 1280, height: 720 });
    await page.waitForTimeout(300);
    await page.keyboard.press(key);
    const before = await drawn(), [a, b, c] = await Promise.all([[-0.03, 0.04, 0.01], [-0.03, -0.01, 0.01], [0.02, -0.03, 0.01]].map((p) => rest(page, p)));
    await page.mouse.move(...a);
    await page.mouse.down();
    await page.mouse.move(...b, { steps: 8 });
    await page.mouse.move(...c, { steps: 8 });
    const middle = await drawn();
    assert.equal(middle.stroke, true, key);
    await page.setViewportSize({ width: 900, height: 600 });
    await until(page, () => !window.kerf.state().stroke);
    if (key === '1') await until(page, (n) => window.kerf.state().undoDepth > n, before.undoDepth);
    const then = await drawn();
    await page.mouse.move(c[0], c[1] + 40, { steps: 5 });
    await page.mouse.move(...b, { steps: 5 });
    await page.mouse.up();
    const end = await drawn();
    assert.deepEqual(then, end, `${key}: nothing more is drawn`);
    assert.equal(end.stroke, false);
    assert.equal(end.ink, 0);
    return { before, middle, end };
  };
  const scalpel = await interrupted('1');
  assert.equal(scalpel.end.undoDepth, scalpel.before.undoDepth + 1);
  assert.ok(scalpel.middle.wall > scalpel.before.wall && scalpel.end.wall >= scalpel.middle.wall, 'what was drawn stays cut');
  await page.screenshot({ path: join(out, 'window-changed.png') });
  for (const key of ['2', '3']) {
    const waiting = await interrupted(key);
    assert.deepEqual(waiting.end, waiting.before, `${key} is taken back`);
  }
  await page.keyboard.press('1');
  const [from, to] = await line(page, [0.04, -0.02, 0.01], [0.04, 0.02, 0.01], 0);
  await drag(page, from, to);
  await until(page, (n) => window.kerf.state().undoDepth > n, scalpel.end.undoDepth);  // pressed again, it cuts
  await page.setViewportSize({ width: 900, height: 640 });
  await page.evaluate(() => window.kerf.app.play(true));
});

await check('two presses before the engine answers are two presses', async () => {
  const was = (await state(page)).playing;
  const after = (presses) => page.evaluate((n) => { for (let i = 0; i < n; i++) document.getElementById('play').click(); return window.kerf.state().playing; }, presses);
  assert.equal(await after(2), was);
  await page.waitForTimeout(400);
  assert.equal((await state(page)).playing, was);
  assert.equal(await after(3), !was);
  await page.waitForTimeout(400);
  assert.equal((await state(page)).playing, !was);
  await after(1);
  await playing(was);
  // A step pauses: a press right after it plays.
  if (!(await state(page)).playing) await after(1);
  await page.evaluate(() => { document.getElementById('step').click(); document.getElementById('play').click(); });
  await page.waitForTimeout(400);
  assert.ok((await state(page)).playing, 'Step and Play in one breath');
});

await check('what the keyboard led to keeps the keys that it needs', async () => {
  const was = (await state(page)).playing;
  await page.focus('#transport #undo').catch(() => {});
  await page.evaluate(() => document.getElementById('home').focus());
  await page.keyboard.press('Tab');
  await page.keyboard.press('Shift+Tab');
  assert.equal(await page.evaluate(() => document.activeElement.id), 'home');
  const before = await page.evaluate(() => { window.kerf.look(20, 30); return window.kerf.state().camera.position; });
  await page.keyboard.press('Space');  // presses the button
  await until(page, (p) => Math.hypot(...window.kerf.state().camera.position.map((x, k) => x - p[k])) > 0.01, before);
  assert.equal((await state(page)).playing, was);
  // Every control is met by Tab, and the picture is one of them.
  const met = new Set();
  await page.evaluate(() => document.getElementById('view').focus());
  for (let i = 0; i < 60; i++) {
    await page.keyboard.press('Tab');
    met.add(await page.evaluate(() => document.activeElement.id || document.activeElement.dataset.tool || ''));
  }
  for (const id of ['scene', 'panel-toggle', 'help-open', 'play', 'step', 'speed', 'reset', 'home', 'scope', 'picture', 'view', 'scalpel'])
    assert.ok(met.has(id), `Tab does not come to ${id}: ${[...met].join(' ')}`);
  await page.evaluate(() => document.getElementById('view').focus());
});

await check('a dialog tells its own trouble, in words of its fields', async () => {
  const cube = 'v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1\nf 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n';
  await drop('cube.obj', cube);
  await until(page, () => document.getElementById('upload').open && !document.getElementById('upload-error').hidden);
  assert.match(await text('upload-error'), /cube\.obj: no collision mesh could be made: .*its collision mesh/);
  await page.screenshot({ path: join(out, 'dialog.png') });
  assert.ok(!(await toasts()).some((t) => t.includes('no collision mesh')), 'not behind the dialog too');
  await page.keyboard.press('Escape');
  await drop('cloth.obj', squareFile(12));
  await until(page, () => document.getElementById('upload').open && !document.getElementById('upload-error').hidden);
  assert.match(await text('upload-error'), /is an open surface.*under Thickness/);
  assert.ok(!/--|\[body\]|kerf info/.test(await text('upload-error')));
  assert.equal(await page.evaluate(() => document.activeElement.id), 'upload-thickness');
  assert.equal(await page.inputValue('#upload-thickness'), '2 %');
  await page.fill('#upload-thickness', 'thin');
  await page.keyboard.press('Enter');
  assert.match(await text('upload-error'), /number above 0/);
  await page.fill('#upload-thickness', '1,5 %');
  await page.keyboard.press('Enter');
  await sceneShows(page, 'cloth');
});

await check('a million triangles dropped show how far they are, then a body that is cut', async () => {
  const n = 707;
  if ((await state(page)).playing) await page.keyboard.press('Space');  // it hangs by its far rim, and would swing
  await playing(false);
  await page.evaluate(async (fields) => {
    const lines = [];
    for (let j = 0; j <= fields; j++) for (let i = 0; i <= fields; i++) lines.push(`v ${((200 * i) / fields).toFixed(4)} ${((150 * j) / fields).toFixed(4)} 0`);
    for (let j = 0; j < fields; j++) {
      for (let i = 0; i < fields; i++) {
        const a = j * (fields + 1) + i + 1;
        lines.push(`f ${a} ${a + 1} ${a + fields + 2}`, `f ${a} ${a + fields + 2} ${a + fields + 1}`);
      }
    }
    const files = new DataTransfer();
    files.items.add(new File([`${lines.join('\n')}\n`], 'million.obj'));
    window.seen = new Set();
    const app = window.kerf.app, tell = app.listener.loading.bind(app.listener);
    app.listener.loading = (now) => { tell(now); if (now && !document.getElementById('loading').hidden) window.seen.add(document.getElementById('loading-text').textContent); };
    document.body.dispatchEvent(new DragEvent('drop', { dataTransfer: files, bubbles: true, cancelable: true }));
  }, n);
  const patient = (test) => page.waitForFunction(test, null, { timeout: 120000 });
  await patient(() => document.getElementById('upload').open);  // it is a sheet: how thick?
  const started = Date.now();
  await page.fill('#upload-thickness', '1');
  await page.keyboard.press('Enter');
  await patient(() => window.kerf.state().scene === 'million' && window.kerf.state().drawn.skin > 990000);
  console.log(`     shown after ${((Date.now() - started) / 1000).toFixed(1)} s; told: ${(await page.evaluate(() => [...window.seen])).join(', ')}`);
  assert.ok((await page.evaluate(() => window.seen.size)) >= 3);
  const body = await state(page);
  assert.ok(body.drawn.skin >= 2 * n * n);
  await patient(() => window.kerf.state().counts?.collisionTriangles < 2000);
  await page.keyboard.press('2');
  const [from, to] = await line(page, [0.1, 0.01, 0], [0.1, 0.14, 0]);
  await drag(page, from, to);
  await patient(() => window.kerf.state().pieces === 2);
  assert.equal((await state(page)).cut.invariants === 1, false);
  await page.screenshot({ path: join(out, 'million.png') });
});

await check('recording is seen for as long as it goes on', async () => {
  await page.keyboard.press('Shift+R');
  assert.ok(await shown('recording'));
  await until(page, () => document.getElementById('recording-time').textContent === '0:02');
  const download = page.waitForEvent('download');
  await page.click('#recording');
  assert.match((await download).suggestedFilename(), /steak\.kerfrec/);
  assert.equal(await shown('recording'), false);
});

await check('the colours of the views have a legend', async () => {
  await page.keyboard.press('m');
  for (const [figure, views, words] of [[1, ['wireframe', 'collision', 'hexahedra'], /visual mesh.*collision mesh.*hexahedra/s], [5, ['wireframe', 'collision', 'feet'], /collision vertex.*collision edge.*collision triangle/s], [18, ['collision', 'hexahedra'], /collision mesh.*hexahedra/s]]) {
    await page.click(`#figures button:has-text("${figure}")`);
    const on = Object.entries((await state(page)).views).filter(([, v]) => v).map(([k]) => k);
    assert.deepEqual(on.sort(), views.sort());
    assert.match(await text('legend'), words);
  }
  await page.screenshot({ path: join(out, 'legend.png') });
  for (const view of ['collision', 'hexahedra', 'shaded']) await page.click(`#view-${view}`);
  assert.equal(await shown('legend'), false);
  await page.keyboard.press('m');
});

await check('a cut is explained in three views, and the views are as before', async () => {
  const views = async () => Object.entries((await state(page)).views).filter(([, v]) => v).map(([k]) => k).sort();
  const { bodies } = await state(page);
  await page.evaluate(() => { window.kerf.app.reset(); document.getElementById('hint').hidden = true; });
  await until(page, (n) => window.kerf.state().bodies > n && window.kerf.state().undoDepth === 0 && document.getElementById('explain-open').disabled, bodies);
  await page.keyboard.press(',');
  assert.equal(await shown('explain'), false, 'nothing is cut');
  await page.keyboard.press('2');
  const [from, to] = await line(page, [-0.004, -0.088, 0.01], [-0.004, 0.02, 0.01]);
  await drag(page, from, to);
  await until(page, () => window.kerf.state().undoDepth > 0);
  await page.keyboard.press('b');
  const before = await views();
  assert.deepEqual(before, ['bound', 'shaded']);
  await page.keyboard.press('m');
  await page.click('#explain-open');
  assert.equal(await shown('panel'), false);
  const camera = (await state(page)).camera.position;
  const steps = [[['collision', 'hexahedra', 'wireframe'], /three meshes/], [['collision', 'feet', 'wireframe'], /bound to/], [['collision', 'hexahedra'], /went through \d+ triangles/]];
  for (const [i, [wanted, words]] of steps.entries()) {
    if (i > 0) await page.keyboard.press('Enter');  // the button has the focus
    assert.deepEqual(await views(), wanted);
    assert.match(await text('explain'), words);
    assert.equal(await shown('hint'), false);
    await page.waitForTimeout(700);
    await page.screenshot({ path: join(out, `explain-${i + 1}.png`) });
    assert.deepEqual(await overlaps(), []);
  }
  for (const [width, height] of [[390, 844], [844, 390], [900, 640]]) {
    await page.setViewportSize({ width, height });
    await page.waitForTimeout(300);
    assert.deepEqual(await overlaps(), [], `${width} x ${height}`);
    await page.screenshot({ path: join(out, `explain-${width}.png`) });
  }
  await page.click('#explain-back');
  assert.deepEqual(await views(), steps[1][0]);
  await page.keyboard.press('Escape');
  assert.equal(await shown('explain'), false);
  assert.deepEqual(await views(), before);
  (await state(page)).camera.position.forEach((x, k) => assert.ok(Math.abs(x - camera[k]) < 0.02, 'the view stays'));
  await page.keyboard.press(',');
  for (const _ of steps) await page.keyboard.press('Enter');
  assert.equal(await shown('explain'), false, 'done');
  assert.deepEqual(await views(), before);
  await page.keyboard.press(',');
  await page.keyboard.press('z');  // the cut is gone
  await until(page, () => document.getElementById('explain').hidden);
  assert.deepEqual(await views(), before);
  await page.keyboard.press('b');
});

await check('readouts belong to the scene that is shown', async () => {
  const [from, to] = await line(page, [-0.004, -0.088, 0.01], [-0.004, 0.088, 0.01]);
  await page.keyboard.press('2');
  await drag(page, from, to);
  await until(page, () => window.kerf.state().pieces === 2);
  assert.notEqual(await text('r-cut'), '–');
  await page.evaluate(() => window.kerf.app.engine.resync());  // the same body once more
  const { bodies } = await state(page);
  await until(page, (b) => window.kerf.state().bodies > b && window.kerf.state().connection === 'live', bodies);
  assert.notEqual(await text('r-cut'), '–');
  await scene('steak');  // the same scene, uncut
  assert.equal(await text('r-cut'), '–');
  await scene('sheet');
  await until(page, () => document.getElementById('r-cut').textContent === '–');
  if ((await state(page)).playing) await page.keyboard.press('Space');
  await until(page, () => document.getElementById('r-fps').textContent === 'at rest');
});

await check('a page that watches is told what its drags do', async () => {
  const second = await openPage(server.url);
  await until(second, () => window.kerf.state().role.clients === 2);
  const hint = await second.evaluate(() => document.getElementById('hint').textContent);
  assert.match(hint, /watching: a drag turns the view.*C takes/);
  const before = (await state(second)).camera.position;
  await drag(second, [450, 300], [520, 320]);
  await until(second, (p) => Math.hypot(...window.kerf.state().camera.position.map((x, k) => x - p[k])) > 0.01, before);
  await second.keyboard.press('c');
  await until(second, () => window.kerf.state().toolAllowed);
  assert.doesNotMatch(await second.evaluate(() => document.getElementById('hint').textContent + document.getElementById('hint').hidden), /watching.*false/);
  await second.close();
  await until(page, () => window.kerf.state().toolAllowed);
});

await check('scenes are chosen from seven tiles, the others under More', async () => {
  await page.evaluate(() => document.getElementById('view').focus());
  await page.keyboard.press('/');
  await until(page, () => document.getElementById('scenes').open);
  await until(page, () => [...document.querySelectorAll('#tiles img')].every((i) => i.complete));
  const tiles = await page.evaluate(() => [...document.querySelectorAll('#tiles button')].map((b) => ({
    name: b.dataset.scene, picture: b.querySelector('img').naturalWidth > 0, title: b.querySelector('strong').textContent, goal: b.querySelector('span').textContent })));
  assert.equal(tiles.length, 7);
  assert.equal(tiles[0].name, 'steak-on-a-board', 'what kerf view opens stands first');
  assert.equal(tiles[6].name, 'trainer', 'what takes most skill stands last');
  for (const t of tiles) assert.ok(t.picture && t.title.length > 5 && t.goal.length > 10, JSON.stringify(t));
  assert.ok((await page.evaluate(() => document.querySelectorAll('#more-scenes button').length)) >= 10);
  await page.screenshot({ path: join(out, 'tiles.png') });
  await page.keyboard.press('Tab');
  await page.click('#tiles [data-scene="tube"]');
  await sceneShows(page, 'tube');
  assert.equal(await page.evaluate(() => document.getElementById('scenes').open), false);
  assert.match(await text('scene-title'), /Tube/);
  await page.keyboard.press('/');
  await page.click('#scenes summary');
  await page.click('#more-scenes [data-scene="sheet"]');
  await until(page, () => window.kerf.state().scene === 'sheet');
});

await check('what is drawn as a floor is an obstacle; where there is none, the page says so once', async () => {
  const place = await page.evaluate(() => [innerWidth / 2, innerHeight / 2].map(Math.round));
  const empty = async (elevation) => {
    await page.evaluate((e) => { window.kerf.app.mesh.group.visible = false; window.kerf.app.things.group.visible = false; window.kerf.look(-110, e); }, elevation);
    await page.waitForTimeout(500);
    return page.screenshot();
  };
  for (const [name, floor] of [['floorless', null], ['tube', null], ['meniscus-probe', null], ['sheet', -0.45], ['spiral', -0.1], ['crossing-strips', -0.15], ['draped-sheet-1500', -0.47], ['steak-on-a-board', -0.0305]]) {
    await (name === 'floorless' ? floorless() : scene(name));
    await page.evaluate(() => window.kerf.app.play(true));
    const { frames } = await state(page);
    await until(page, (f) => window.kerf.state().frames > f + 5, frames);
    const { floor: drawn } = await state(page);
    assert.ok(floor === null ? drawn === null : Math.abs(drawn - floor) < 1e-6, `${name}: ${drawn}`);
    if (floor !== null) continue;
    const [low, high] = [await empty(15), await empty(50)];  // nothing is left that would move with the eye
    assert.ok(await difference(page, low, high, place, 100) < 0.5, `${name}: something else is drawn`);
    await page.evaluate(() => { window.kerf.app.mesh.group.visible = window.kerf.app.things.group.visible = true; });
  }
  const told = async (name) => { await (name === 'floorless' ? floorless() : scene(name)); await page.waitForTimeout(300); return await shown('hint') && /no floor here/.test(await text('hint')); };
  assert.equal(await told('floorless'), true);
  assert.equal(await told('tube'), false, 'there is no weight');
  assert.equal(await told('spiral'), false);
  assert.equal(await told('floorless'), true, 'nobody has closed it yet');
  assert.equal(await told('meniscus'), true);
  assert.equal(await told('meniscus-probe'), false, 'the plateau holds what is cut off');
  assert.equal(await told('floorless'), true);
  await page.screenshot({ path: join(out, 'no-floor.png') });
  await page.click('#hint-close');
  assert.equal(await told('spiral') || await told('floorless'), false);
});

await check('the instrument is where the pointer is, and fades when that is elsewhere', async () => {
  await scene('steak-on-a-board');
  await page.keyboard.press('1');
  await page.evaluate(() => { document.getElementById('hint').hidden = true; window.kerf.app.resetCamera(); });
  const level = (want) => until(page, (l) => window.kerf.state().bladeLevel === l, want);
  /** Where its tip is in the window, and how long it is there. */
  const inWindow = () => page.evaluate(() => {
    const g = window.kerf.app.blade.group.children.find((c) => c.visible && c.type === 'Group'), at = (z) => window.kerf.pickPoint(...g.localToWorld(g.position.clone().set(0, 0, z)).toArray());
    const tip = window.kerf.pickPoint(...window.kerf.state().bladeTip), [a, b] = [at(0), at(1)];
    return { tip, length: Math.hypot(a[0] - b[0], a[1] - b[1]) };
  });
  const middle = await rest(page, [0, 0, 0.01]), tools = [30, 320];
  const near = (a, b) => assert.ok(Math.hypot(a[0] - b[0], a[1] - b[1]) < 4, `${a} is not at ${b}`);
  await page.mouse.move(...middle);
  await level(1);
  const opening = await inWindow();
  near(opening.tip, middle);
  await page.screenshot({ path: join(out, 'blade-on.png') });
  const passed = page.evaluate(() => new Promise((done) => {
    const seen = [], look = () => { seen.push(window.kerf.state().bladeLevel); if (seen.at(-1) === 0) done(seen); else requestAnimationFrame(look); };
    look();
  }));
  await page.mouse.move(...tools);
  assert.ok((await passed).filter((l) => l > 0 && l < 1).length >= 2, `it fades: ${await passed}`);
  assert.equal((await state(page)).blade, false);
  await page.screenshot({ path: join(out, 'blade-off.png') });
  await page.mouse.move(...middle);
  await level(1);
  for (let i = 0; i < 8; i++) await page.mouse.wheel(0, -120);  // the pointer rests
  await page.waitForTimeout(900);
  const zoomed = await inWindow();
  near(zoomed.tip, middle);
  assert.ok(zoomed.length < 1.2 * opening.length, `${zoomed.length} pixels long, ${opening.length} before`);
  await page.screenshot({ path: join(out, 'blade-zoomed.png') });
  await page.evaluate(() => window.kerf.app.resetCamera());
  await page.mouse.move(...middle);
  await level(1);
  await page.mouse.down({ button: 'right' });
  await page.mouse.move(middle[0] + 40, middle[1], { steps: 4 });
  await level(0);
  await page.mouse.up({ button: 'right' });
  await level(1);
  await page.mouse.down();
  await page.mouse.move(...tools, { steps: 10 });
  await page.waitForTimeout(600);
  assert.equal((await state(page)).bladeLevel, 1, 'a stroke is under way');
  await page.mouse.up();
  await level(0);
});

await check('forceps stay at what they hold: a piece that is lifted, and nothing that was left held', async () => {
  await scene('steak-on-a-board');
  await page.evaluate(() => { document.getElementById('hint').hidden = true; window.kerf.app.resetCamera(); });
  if (!(await state(page)).playing) await page.keyboard.press('Space');
  await playing(true);
  const middle = [0, -0.02, 0.02], [x, y] = await rest(page, middle), loop = [];
  for (let i = 0; i <= 24; i++) loop.push([x + 45 * Math.cos(0.26 * i), y + 32 * Math.sin(0.26 * i)]);
  await page.keyboard.press('3');
  await page.mouse.move(...loop[0]);
  await page.mouse.down();
  for (const p of loop) await page.mouse.move(...p);
  await page.mouse.up();
  await until(page, () => window.kerf.state().pieces === 2);
  await page.keyboard.press('4');
  await page.mouse.move(x, y);
  const tipAt = (p) => until(page, ([u, v]) => { const [a, b] = window.kerf.pickPoint(...window.kerf.state().bladeTip); return Math.hypot(a - u, b - v) < 2; }, p);
  await tipAt([x, y]);
  /** The tip, the vertex that is held, and the pointer, in the window. */
  const apart = async (pointer) => {
    const tip = await page.evaluate(() => window.kerf.pickPoint(...window.kerf.state().bladeTip)), to = (p) => Math.hypot(p[0] - tip[0], p[1] - tip[1]);
    return { piece: to(await rest(page, middle)), pointer: to(pointer) };
  };
  const first = await apart([x, y]), to = [x + 80, y + 30];
  await page.mouse.down();
  await page.mouse.move(...to, { steps: 12 });
  await until(page, (t) => window.kerf.state().time > t, (await state(page)).time + 1.5);
  const carried = await apart(to);
  await page.screenshot({ path: join(out, 'carried.png') });
  assert.ok(Math.abs(carried.piece - first.piece) < 4, `the tip is ${carried.piece} pixels beside the place that it took hold of ${first.piece} beside`);
  assert.ok(carried.pointer > 20, 'the piece is lifted');
  await page.keyboard.down('Shift');
  await page.mouse.up();
  await page.keyboard.up('Shift');
  // Beside the body the hand closes on nothing, whatever else is held.
  const beside = await page.evaluate(() => { document.getElementById('hint').hidden = true; return window.kerf.pickPoint(0.09, -0.1, -0.01); });
  assert.ok(beside.every((x, k) => x > 0 && x + 20 < Object.values(kWindow)[k]), `${beside} lies in the window`);
  await page.mouse.move(...beside);
  await tipAt(beside);
  await page.mouse.down();
  await page.mouse.move(beside[0] + 20, beside[1], { steps: 4 });
  await tipAt([beside[0] + 20, beside[1]]);
  await page.waitForTimeout(500);
  const empty = await apart([beside[0] + 20, beside[1]]);
  await page.mouse.up();
  await page.keyboard.press('1');
  assert.ok(empty.pointer < 4, `with nothing in it the tip is ${empty.pointer} pixels from the pointer`);
});

await check('in a joint shafts come in from outside, and a probe held over nothing says so', async () => {
  await scene('trainer');
  await page.evaluate(() => { document.getElementById('hint').hidden = true; });
  await page.keyboard.press('q');
  await until(page, () => window.kerf.state().scopeOn);
  const over = async (tool, at) => {
    await page.keyboard.press(tool);
    await page.mouse.move(...at);
    await until(page, ([u, v]) => { const [a, b] = window.kerf.pickPoint(...window.kerf.state().bladeTip); return window.kerf.state().bladeLevel === 1 && Math.hypot(a - u, b - v) < 2; }, at);
  };
  const at = [0.3, 0.42].map((part, k) => Math.round(part * Object.values(page.viewportSize())[k]));
  for (const tool of ['v', '1', '4', '9', '0', 'u']) {
    await over(tool, at);
    const ends = await page.evaluate(() => {
      const { blade, stage } = window.kerf.app, g = blade.group.children.find((c) => c.visible && c.type === 'Group'), far = [];
      blade.group.updateMatrixWorld(true);
      g.traverseVisible((o) => {
        if (!o.isMesh) return;
        o.geometry.computeBoundingBox();
        const { min, max } = o.geometry.boundingBox;
        for (const y of [min.y, max.y]) far.push(min.clone().add(max).multiplyScalar(0.5).setY(y).applyMatrix4(o.matrixWorld));
      });
      const end = far.sort((a, b) => b.distanceTo(blade.tip) - a.distanceTo(blade.tip))[0];
      return { seen: stage.sees(end), ways: end.distanceTo(blade.tip) / stage.camera.position.distanceTo(blade.tip) };
    });
    assert.ok(!ends.seen || ends.ways > 3, `${tool}: its shaft ends in the picture, ${ends.ways} of the way from the eye behind the tip`);
  }
  await page.screenshot({ path: join(out, 'shaft.png') });
  // The middle of the opening of the meniscus, where the bone below is seen.
  await page.keyboard.press('i');
  const gap = [0.5, 0.62].map((part, k) => Math.round(part * Object.values(page.viewportSize())[k]));
  // The answer of what was on the body under the pointer comes after the press, as it does where the engine is busy.
  await page.evaluate(() => {
    const { hover } = window.kerf.app, hit = hover.hit.bind(hover);
    hover.hit = (answer) => { delete hover.hit; window.late = () => hit(answer); };
    hover.changed = true;
    hover.send(performance.now());
  });
  await page.waitForFunction(() => window.late);
  await page.mouse.move(...gap);
  await page.mouse.down();
  await page.evaluate(() => window.late());
  await says('Nothing is felt here');
  await page.mouse.up();
  await page.mouse.move(...at);
  await page.waitForFunction(() => [...document.querySelectorAll('#toasts p')].every((p) => !p.textContent.includes('felt')), null, { timeout: 30000 });
  await page.mouse.down();
  await page.mouse.move(...gap, { steps: 10 });  // the probe goes on as deep as it was
  await page.waitForTimeout(600);
  assert.ok(!(await toasts()).some((t) => t.includes('felt')), 'it has felt the body');
  await page.mouse.up();
  await page.keyboard.press('q');
  await page.keyboard.press('1');
});

await check('what fell out of the picture is said, and shown on request only', async () => {
  await floorless();
  await page.evaluate(() => { window.kerf.app.command(4, [0.5]); document.getElementById('hint').hidden = true; });
  if ((await state(page)).playing) await page.keyboard.press('Space');
  await playing(false);
  await page.evaluate(() => window.kerf.app.command(5));  // at rest, however late it has stopped
  await until(page, () => window.kerf.state().time === 0 && !window.kerf.state().playing);
  await page.keyboard.press('3');
  const circle = [];
  for (let i = 0; i <= 20; i++) circle.push(await rest(page, [0.2 * Math.cos(0.3 * i), 0.2 * Math.sin(0.3 * i), 0]));
  await page.mouse.move(...circle[0]);
  await page.mouse.down();
  for (const p of circle) await page.mouse.move(...p);
  await page.mouse.up();
  await until(page, () => window.kerf.state().pieces === 2 && window.kerf.state().outOfView.all === 2);
  await page.mouse.move(450, 600);
  await page.keyboard.press('Space');
  const camera = () => page.evaluate(() => window.kerf.state().camera.position);
  const before = await camera();
  assert.equal(await shown('away'), false);
  await until(page, () => window.kerf.state().outOfView.outside === 1);
  const fallen = Date.now();
  await page.keyboard.press('Space');
  await playing(false);
  await until(page, () => !document.getElementById('away').hidden);
  assert.ok(Date.now() - fallen > 350, 'not at once');
  assert.equal(await text('away-show'), '1 piece is out of view. Show it');
  (await camera()).forEach((x, k) => assert.ok(Math.abs(x - before[k]) < 1e-6, 'nobody has moved the view'));
  const inPicture = async (p) => { const [x, y] = await rest(page, p), { width, height } = page.viewportSize(); return x > 0 && x < width && y > 0 && y < height; };
  assert.equal(await inPicture([0, 0, 0]), false);
  assert.deepEqual(await overlaps(), []);
  await page.screenshot({ path: join(out, 'away.png') });
  await page.focus('#help-open');
  await page.keyboard.press('Tab');
  assert.equal(await page.evaluate(() => document.activeElement.id), 'away-show');
  const way = page.evaluate(() => new Promise((done) => {
    const seen = new Set(), began = performance.now(), look = () => { seen.add(window.kerf.state().camera.position.join()); if (performance.now() - began > 1500) done(seen.size); else requestAnimationFrame(look); };
    look();
  }));
  await page.keyboard.press('Enter');
  assert.ok(await way >= 4, 'the view goes there bit by bit');
  await until(page, () => document.getElementById('away').hidden);
  for (const p of [[0, 0, 0], [0.45, 0.45, 0], [-0.45, -0.45, 0]]) assert.ok(await inPicture(p), `${p} is seen`);
  assert.equal(await page.evaluate(() => document.activeElement.id), 'view');
  await page.screenshot({ path: join(out, 'away-shown.png') });
  await page.evaluate(() => window.kerf.look(-90, 10, 0.5, [0, 0, 0]));
  await page.keyboard.press('h');
  for (const p of [[0, 0, 0], [0.45, 0.45, 0], [-0.45, -0.45, 0]]) assert.ok(await inPicture(p), `H: ${p} is seen`);
  await page.keyboard.press('Space');
  await page.evaluate(() => { window.kerf.app.command(4, [1]); });
});

await check('pieces are weighed: beside the pointer, in a list, and on the tray', async () => {
  await scene('steak-on-a-board');
  await page.setViewportSize({ width: 1100, height: 720 });
  await page.evaluate(() => { document.getElementById('hint').hidden = true; window.kerf.look(-110, 50, 0.6); });
  if (!(await state(page)).playing) await page.keyboard.press('Space');
  await playing(true);
  const at = (p) => page.evaluate((q) => window.kerf.pickPoint(...q), p);
  const label = (kind) => page.evaluate((k) => [...document.querySelectorAll(`.weight.${k}`)].filter((e) => !e.hidden).map((e) => e.textContent).join(), kind);
  const says = (kind, words) => until(page, ([k, w]) => [...document.querySelectorAll(`.weight.${k}`)].some((e) => !e.hidden && new RegExp(w).test(e.textContent)), [kind, words]);
  const list = () => page.evaluate(() => [...document.querySelectorAll('#weights-rows tr')].map((r) => [...r.children].map((c) => parseFloat(c.textContent))));
  await page.waitForTimeout(600);
  await page.mouse.move(...await rest(page, [0.06, 0.02, 0.01]));
  await page.waitForTimeout(600);
  assert.equal(await label('beside'), '', 'only with forceps');
  await page.keyboard.press('4');
  await says('beside', '^\\d+ g$');
  const uncut = parseFloat(await label('beside'));
  await says('tray', '^tray: 0 g$');
  assert.equal(await shown('weights'), false, 'nothing to compare');

  // The smaller piece weighs what the skin beyond the cut encloses.
  await page.keyboard.press('2');
  await page.evaluate(() => { document.getElementById('hint').hidden = true; });
  await drag(page, await at([0.03, -0.11, 0]), await at([0.03, 0.11, 0]), 6);
  await until(page, () => document.querySelectorAll('#weights-rows tr').length === 2);
  assert.equal(await shown('weights'), true);
  const beyond = await page.evaluate(() => {
    const { rest: r, skin, ns, wall, nw } = window.kerf.app.mesh.state;
    // x = a + b y: where the walls stand. Seen from a point of theirs they enclose nothing.
    let [n, x, y, xy, yy, volume] = [3 * nw, 0, 0, 0, 0, 0];
    for (const v of wall.subarray(0, n)) { x += r[3 * v]; y += r[3 * v + 1]; xy += r[3 * v] * r[3 * v + 1]; yy += r[3 * v + 1] ** 2; }
    const b = (n * xy - x * y) / (n * yy - y * y), a = (x - b * y) / n, p = (v) => [r[3 * v] - a, r[3 * v + 1], r[3 * v + 2]];
    for (let t = 0; t < ns; t++) {
      const [u, v, w] = [0, 1, 2].map((k) => p(skin[3 * t + k]));
      if (u[0] + v[0] + w[0] > b * (u[1] + v[1] + w[1])) volume += (u[0] * (v[1] * w[2] - v[2] * w[1]) + u[1] * (v[2] * w[0] - v[0] * w[2]) + u[2] * (v[0] * w[1] - v[1] * w[0])) / 6;
    }
    return 1000 * volume * window.kerf.app.info.material.density;
  });
  const [large, small] = await list();
  assert.ok(Math.abs(small[0] - beyond) < 0.01 * uncut, `${small[0]} g; ${beyond} g lie beyond the cut`);
  assert.ok(Math.abs(large[0] + small[0] - uncut) <= 1.5 && Math.abs(large[1] + small[1] - 100) <= 1, `${large} and ${small} are not ${uncut} g`);
  assert.deepEqual(await overlaps(), []);
  await page.screenshot({ path: join(out, 'weights.png') });

  // It is held, and laid on the tray.
  await page.keyboard.press('4');
  const from = await rest(page, [0.07, 0.02, 0.01]), words = `${small[0]} g, ${small[1]} %`;
  await page.mouse.move(...from);
  await says('beside', `^${words}$`);
  await page.mouse.down();
  await page.mouse.move(from[0], from[1] - 100, { steps: 8 });
  await page.waitForTimeout(500);
  assert.equal(await label('beside'), words, 'what is held');
  assert.equal(await label('tray'), 'tray: 0 g');
  // Slowly, for it swings; what lies free is carried level.
  const high = [from[0], from[1] - 100], over = await at([0.02, 0.2, 0]);
  for (let i = 1; i <= 30; i++) {
    await page.mouse.move(...high.map((x, k) => x + ((over[k] - x) * i) / 30));
    await page.waitForTimeout(60);
  }
  await until(page, (t) => window.kerf.state().time > t, (await state(page)).time + 2);
  await page.mouse.up();
  await says('tray', `^tray: ${words}$`);
  assert.deepEqual(await page.evaluate(() => { const b = document.querySelector('.weight.tray').getBoundingClientRect(); return [...document.querySelectorAll('.card')].filter((e) => { const c = e.getBoundingClientRect(); return c.width > 0 && b.left < c.right && c.left < b.right && b.top < c.bottom && c.top < b.bottom; }).map((e) => e.id || e.className); }), [], 'nothing lies over it');
  await page.screenshot({ path: join(out, 'tray.png') });
  // What it says goes where the tray is not seen: behind the board, from below, and under the controls.
  for (const [azimuth, elevation] of [[-110, 5], [-110, -30], [90, 45]]) {
    await page.evaluate((v) => { window.kerf.look(...v); }, [azimuth, elevation]);
    await until(page, () => [...document.querySelectorAll('.weight.tray')].every((e) => e.hidden));
  }
  await page.evaluate(() => { window.kerf.look(-110, 50); });
  await says('tray', `^tray: ${words}$`);
  await page.mouse.move(...await at([0.13, -0.1, -0.01]));
  await until(page, () => [...document.querySelectorAll('.weight.beside')].every((e) => e.hidden));

  await page.keyboard.press('Shift+W');
  assert.equal(await shown('weights'), false);
  await page.click('#pieces');
  assert.equal(await shown('weights'), true);
  await page.keyboard.press('m');
  assert.equal(await shown('weights'), false, 'the panel has its place');
  await page.keyboard.press('m');
  await page.keyboard.press('z');
  await until(page, () => document.querySelectorAll('#weights-rows tr').length === 1);
  assert.equal((await list())[0][0], uncut);
  await page.keyboard.press('Shift+W');
  await page.evaluate(() => { window.kerf.app.setTool('scalpel'); });
  await page.setViewportSize({ width: 900, height: 640 });
});

await check('a scene shows what its title says, then hands the tools over', async () => {
  /** Cosine between the view and that of the scene's own commands. */
  const alongView = () => page.evaluate(() => {
    const { position, target } = window.kerf.state().camera, view = window.kerf.app.info.script.view, way = position.map((x, k) => x - target[k]);
    return view.reduce((sum, x, k) => sum + x * way[k], 0) / Math.hypot(...view) / Math.hypot(...way);
  });
  await page.evaluate(() => { window.kerf.app.setTool('scalpel'); });
  for (const [name, pieces] of [['steak-on-a-board', 2], ['crossing-strips', 3], ['tube', 1]]) {
    await scene(name);
    await page.click('#show');
    await until(page, () => window.kerf.state().showing);
    assert.equal(await text('show'), 'Your turn');
    assert.match(await text('hint'), /Watch/);
    await until(page, () => window.kerf.app.blade.visible || window.kerf.app.things.tools.length > 0);
    const depth = (await state(page)).undoDepth;
    await page.mouse.click(450, 400);  // hands are off meanwhile
    await page.waitForFunction(() => !window.kerf.state().showing, null, { timeout: 60000 });
    const after = await state(page);
    assert.equal(after.pieces, pieces, name);
    assert.ok(await alongView() > 0.99, 'seen as its own picture sees it');
    const size = page.viewportSize();
    await page.setViewportSize({ width: size.width, height: size.height - 60 });
    await page.waitForTimeout(300);
    assert.ok(await alongView() > 0.99, 'in a window of another size too');
    await page.setViewportSize(size);
    assert.ok(after.undoDepth > depth || after.redoDepth > 0 || after.cuts > 0 || after.drawn.wall > 0);
    assert.equal(await text('show'), 'Show me');
    await page.keyboard.press('r');  // the scene anew, for hands
    await until(page, (shown) => window.kerf.state().time < shown && window.kerf.state().drawn.wall === 0 && window.kerf.state().undoDepth === 0, after.time);
    assert.equal((await state(page)).showing, false);
    if (name === 'tube') assert.ok(await alongView() < 0.9, 'worked on in the view of all bodies');
  }
  await page.keyboard.press(';');
  await until(page, () => window.kerf.state().showing);
  await page.click('#show');  // my turn, at once
  await until(page, () => !window.kerf.state().showing);
  const { bodies } = await state(page);
  await drop('idle.toml', '[body]\nmodel = "sheet"\n');
  await until(page, (b) => window.kerf.state().ready && window.kerf.state().bodies > b, bodies);
  await until(page, () => document.getElementById('show').hidden);  // nothing is commanded there
});

await check('lost and back: nothing lies over anything, and what was lost is said', async () => {
  await scene('trainer');
  await page.evaluate(() => document.getElementById('hint-close').click());
  await page.keyboard.press('2');
  const [from, to] = await line(page, [0, 0.006, 0], [0, 0.018, 0], 1);
  await drag(page, from, to);
  await until(page, () => window.kerf.state().undoDepth > 0);
  const { port } = server;
  await stopServer(server, 'SIGKILL');
  await until(page, () => window.kerf.state().connection !== 'live');
  for (const [width, height] of [[1280, 720], [1000, 640], [800, 600], [700, 500], [390, 844], [844, 390]]) {
    await page.setViewportSize({ width, height });
    await page.waitForTimeout(300);
    assert.deepEqual(await overlaps(), [], `${width} x ${height}`);
  }
  await page.setViewportSize({ width: 900, height: 640 });
  server = await startServer('steak', port);
  await until(page, () => window.kerf.state().connection === 'live' && window.kerf.state().toolAllowed);
  await says('started again: what was cut before is gone');
  assert.equal(await shown('banner'), false);
});

await check('a page that is refused says which address is good, and comes back when its own is', async () => {
  const { port, url } = server, said = (part) => until(page, (t) => !document.getElementById('banner').hidden && document.getElementById('banner').textContent.includes(t), part);
  await stopServer(server, 'SIGKILL');
  await said('connects again by itself');
  server = await startServer('steak', port, 'another-token');
  await said('started anew');
  assert.match(await text('banner'), /Open the address that it printed now/);
  assert.equal(await text('connection'), 'refused');
  assert.deepEqual(await overlaps(), []);
  await page.screenshot({ path: join(out, 'refused.png') });
  await page.waitForTimeout(2500);  // two more tries
  assert.match(await text('banner'), /started anew/);
  const wrong = await page.context().newPage();
  await wrong.goto(url);
  await until(wrong, () => /refuses this address.*with its token/.test(document.getElementById('banner').textContent));
  await wrong.close();
  await stopServer(server, 'SIGKILL');
  await said('connects again by itself');
  server = await startServer('steak', port);
  await until(page, () => window.kerf.state().connection === 'live' && window.kerf.state().toolAllowed);
  assert.equal(await shown('banner'), false);
});

await check('weights and score leave the tools free in every window', async () => {
  await page.setViewportSize({ width: 390, height: 844 });
  await page.keyboard.press('2');
  await scene('steak');
  await page.evaluate(() => { window.kerf.app.play(false); document.getElementById('hint').hidden = true; });
  await playing(false);
  const [from, to] = await line(page, [-0.004, -0.088, 0.01], [-0.004, 0.088, 0.01]);
  await drag(page, from, to);
  await until(page, () => window.kerf.state().pieces === 2);
  if (!(await shown('weights'))) await page.click('#pieces');
  await until(page, () => document.querySelectorAll('#weights-rows tr').length === 2);
  await scene('trainer');
  await until(page, () => window.kerf.state().score !== null && document.querySelectorAll('#weights-rows tr').length === 1);
  if (!(await shown('weights'))) await page.click('#pieces');
  await page.evaluate(() => window.kerf.app.play(false));
  for (const [width, height] of [[390, 844], [360, 640], [844, 390], [820, 1180], [1280, 720], [900, 640]]) {
    await page.setViewportSize({ width, height });
    for (const key of ['9', '1']) {  // with a size, and without
      await page.keyboard.press(key);
      // As many rows as there can be: they have room, or are scrolled.
      await page.evaluate(() => {
        const rows = document.getElementById('weights-rows');
        while (rows.children.length < 8) rows.append(rows.children[0].cloneNode(true));
        document.getElementById('hint').hidden = false;
      });
      await page.waitForTimeout(300);
      assert.ok(await shown('weights') && await shown('score'));
      assert.deepEqual(await overlaps(), [], `${width} x ${height}, tool ${key}`);
      const covered = await page.evaluate(() => {
        const strip = document.getElementById('tools').getBoundingClientRect();
        return [...document.querySelectorAll('#tools button, #transport button, #finish')].map((b) => [b, b.getBoundingClientRect()])
          .map(([b, r]) => [b, r.left + r.width / 2, r.top + r.height / 2])
          .filter(([b, x, y]) => b.getClientRects().length > 0 && !(b.dataset.tool && (x < strip.left || x > strip.right || y < strip.top || y > strip.bottom)))  // scrolled out of the strip
          .filter(([b, x, y]) => !b.contains(document.elementFromPoint(x, y))).map(([b]) => b.id || b.dataset.tool);
      });
      assert.deepEqual(covered, [], `${width} x ${height}, tool ${key}`);
    }
    await page.screenshot({ path: join(out, `weights-${width}x${height}.png`) });
  }
  await page.setViewportSize({ width: 900, height: 640 });
  await page.keyboard.press('Shift+W');
  await page.evaluate(() => { window.kerf.app.play(true); document.getElementById('hint').hidden = true; });
});

await check('the mark of the arthroscope lies under no card', async () => {
  await scene('trainer');
  await page.keyboard.press('q');
  await until(page, () => window.kerf.state().scopeOn);
  for (const [width, height] of [[1280, 720], [900, 640], [390, 844], [844, 390]]) {
    await page.setViewportSize({ width, height });
    for (const [key, turn] of [['1', 0], ['9', 0], ['9', 90], ['1', 90], ['1', 180]]) {
      await page.keyboard.press(key);
      await page.evaluate((t) => { window.kerf.app.turnScope(t - (180 / Math.PI) * window.kerf.app.stage.scope.turnedBy); document.getElementById('hint').hidden = false; }, turn);
      await page.waitForTimeout(600);
      const over = await page.evaluate(() => {
        const m = document.getElementById('scope-notch').getBoundingClientRect();
        return [...document.querySelectorAll('.card')].filter((e) => { const c = e.getBoundingClientRect(); return c.width > 0 && m.left < c.right && c.left < m.right && m.top < c.bottom && c.top < m.bottom; }).map((e) => e.id || e.className);
      });
      assert.deepEqual(over, [], `${width} x ${height}, tool ${key}, turned by ${turn}`);
      if (key === '1' && turn === 0) await page.screenshot({ path: join(out, `notch-${width}.png`) });
    }
  }
  await page.setViewportSize({ width: 900, height: 640 });
  await page.keyboard.press('1');
  await page.keyboard.press('q');
  await until(page, () => !window.kerf.state().scopeOn);
});

await check('on its side a phone shows the whole body, with an instrument that has a size', async () => {
  await page.keyboard.press('9');
  await page.evaluate(() => { window.kerf.app.play(false); document.getElementById('hint').hidden = true; });
  for (const [width, height] of [[844, 390], [667, 375], [932, 430], [740, 360], [600, 360]]) {
    await page.setViewportSize({ width, height });
    await page.waitForTimeout(300);
    await page.evaluate(() => window.kerf.app.resetCamera());
    await page.waitForTimeout(300);
    assert.ok(await shown('size') && await shown('transport'));
    assert.deepEqual(await overlaps(), [], `${width} x ${height}`);
    const hidden = await page.evaluate(() => {
      const { rest: r, nv } = window.kerf.app.mesh.state;
      let all = 0, under = 0;
      for (let v = 0; v < nv; v += 13) { const [x, y] = window.kerf.pickRest(...r.slice(3 * v, 3 * v + 3)); all++; if (document.elementFromPoint(x, y)?.id !== 'view') under++; }
      return under / all;
    });
    // Too narrow for one row, the size stands above the buttons.
    assert.ok(hidden < (width < 660 ? 0.1 : 0.01), `cards hide ${hidden.toFixed(3)} of the body in ${width} x ${height}`);
    const small = await page.evaluate(() => [...document.querySelectorAll('#transport button, #tools button, #top button, #size input')].filter((e) => e.getClientRects().length > 0)
      .map((e) => [e.id || e.dataset.tool, e.getBoundingClientRect()]).filter(([, r]) => r.width < 43.5 || r.height < 43.5).map(([n, r]) => `${n}: ${r.width.toFixed(0)} x ${r.height.toFixed(0)}`));
    assert.deepEqual(small, [], `${width} x ${height}`);
    await page.screenshot({ path: join(out, `low-${width}.png`) });
  }
  // Beside the panel, nothing that is pressed lies under it.
  await page.setViewportSize({ width: 844, height: 390 });
  await page.keyboard.press('m');
  await page.waitForTimeout(300);
  const covered = await page.evaluate(() => [...document.querySelectorAll('#transport button, #size input')].map((b) => [b, b.getBoundingClientRect()])
    .filter(([b, r]) => r.width > 0 && !b.contains(document.elementFromPoint(r.left + r.width / 2, r.top + r.height / 2))).map(([b]) => b.id));
  await page.screenshot({ path: join(out, 'low-panel.png') });
  assert.deepEqual(covered, []);
  assert.ok(await page.evaluate(() => document.getElementById('panel').contains(document.getElementById('speed'))));
  await page.keyboard.press('m');
  await page.keyboard.press('1');
  await page.setViewportSize({ width: 900, height: 640 });
  await page.evaluate(() => window.kerf.app.play(true));
});

await check('on touch everything can be hit, and says what it is', async () => {
  const cdp = await page.context().newCDPSession(page);
  await scene('trainer');
  await cdp.send('Emulation.setTouchEmulationEnabled', { enabled: true, maxTouchPoints: 5 });
  for (const [width, height] of [[390, 844], [360, 640], [844, 390], [820, 1180]]) {
    await page.setViewportSize({ width, height });
    await page.waitForTimeout(400);
    await page.screenshot({ path: join(out, `touch-${width}x${height}.png`) });
    assert.ok(await page.evaluate(() => matchMedia('(pointer: coarse)').matches));
    const small = await page.evaluate(() => { document.getElementById('away').hidden = false; document.getElementById('away-show').textContent = '2 pieces are out of view. Show them'; const found = [...document.querySelectorAll('button, select, input, summary')].filter((e) => e.getClientRects().length > 0 && !e.closest('dialog'))
      .map((e) => [e.id || e.dataset.tool || e.textContent.trim(), e.getBoundingClientRect()]).filter(([, r]) => r.width < 43.5 || r.height < 43.5).map(([n, r]) => `${n}: ${r.width.toFixed(0)} x ${r.height.toFixed(0)}`); document.getElementById('away').hidden = true; return found; });
    assert.deepEqual(small, [], `${width} x ${height}`);
    const words = await page.evaluate(() => [...document.querySelectorAll('#tools button')].filter((b) => !b.hidden && b.querySelector('.word').getClientRects().length === 0).length);
    assert.equal(words, 0, 'tools without words');
    // The body has most of the picture.
    const covered = await page.evaluate(() => {
      const cards = [...document.querySelectorAll('.card')].map((e) => e.getBoundingClientRect());
      let n = 0, all = 0;
      for (let y = 4; y < innerHeight; y += 8) for (let x = 4; x < innerWidth; x += 8) { all++; if (cards.some((r) => x >= r.left && x < r.right && y >= r.top && y < r.bottom)) n++; }
      return n / all;
    });
    assert.ok(covered < 0.5, `cards cover ${covered.toFixed(2)} of ${width} x ${height}`);
    const beyond = await page.evaluate(() => {
      for (const [id, text] of [['r-fps', '60'], ['r-step', '12.3'], ['r-cut', '143'], ['r-pieces', '12'], ['r-pieces-word', 'pieces']]) document.getElementById(id).textContent = text;
      return [...document.querySelectorAll('#top :is(button, span), #transport button')].map((e) => [e.id || e.textContent.trim(), e.getBoundingClientRect()]).filter(([, r]) => r.width > 1 && r.right > innerWidth - 4).map(([n]) => n);
    });
    assert.deepEqual(beyond, [], `cut off at ${width} x ${height} after a cut`);
  }
  // Two fingers lead the arthroscope and push it in; the second takes back what the first began.
  await page.setViewportSize({ width: 390, height: 844 });
  await page.evaluate(() => { localStorage.removeItem('kerf.used-grasp'); window.kerf.app.setTool('scalpel'); });
  await page.click('#tools [data-tool=grasp]');
  assert.doesNotMatch(await text('hint'), /Shift/, 'there is no key');
  await page.click('#tools [data-tool=scalpel]');
  await page.click('#scope');
  await until(page, () => window.kerf.state().scopeOn);
  const touch = (type, ...points) => cdp.send('Input.dispatchTouchEvent', { type, touchPoints: points.map(([x, y], id) => ({ x, y, id })) });
  const eye = async () => (await state(page)).camera.position, from = await eye(), { undoDepth } = await state(page);
  await touch('touchStart', [150, 400]);
  await touch('touchStart', [150, 400], [250, 400]);
  for (let i = 1; i <= 6; i++) await touch('touchMove', [150, 400], [250 + 10 * i, 400]);
  await touch('touchEnd');
  assert.ok(Math.hypot(...(await eye()).map((x, k) => x - from[k])) > 1e-5, 'it is led');
  const depth = () => page.evaluate(() => window.kerf.app.stage.scope.depth), deep = await depth(), led = await eye();
  await touch('touchStart', [180, 400]);
  await touch('touchStart', [180, 400], [220, 400]);
  for (let i = 1; i <= 6; i++) await touch('touchMove', [180 - 8 * i, 400], [220 + 8 * i, 400]);
  await touch('touchEnd');
  assert.ok((await depth()) > deep + 0.02, `pushed from ${deep} to ${await depth()}`);
  assert.ok(Math.hypot(...(await eye()).map((x, k) => x - led[k])) > 1e-5);
  assert.equal((await state(page)).undoDepth, undoDepth);
  await page.click('#scope');
  await cdp.send('Emulation.setTouchEmulationEnabled', { enabled: false });
  await cdp.detach();
});

await check('a scene says what to try until that was read; words beside the pointer stay in the window', async () => {
  await page.evaluate(() => { localStorage.removeItem('kerf.goal-spiral'); localStorage.setItem('kerf.used-scalpel', '1'); window.kerf.app.setTool('scalpel'); });
  await scene('spiral');
  await until(page, () => /Cut a spiral/.test(document.getElementById('hint-text').textContent));
  assert.equal(await shown('hint'), true);
  await page.click('#hint-close');
  await scene('sheet');
  await scene('spiral');
  await page.waitForTimeout(300);
  assert.equal(await shown('hint'), false);
  await scene('steak');
  await page.setViewportSize({ width: 390, height: 844 });
  await page.keyboard.press('4');
  await page.evaluate(() => { window.kerf.look(-90, 60, 0.8 * window.kerf.app.stage.size); });
  await page.waitForTimeout(600);
  const [x, y] = await page.evaluate(() => {
    const { rest: r, nv } = window.kerf.app.mesh.state, all = [];
    for (let v = 0; v < nv; v += 7) all.push(window.kerf.pickRest(...r.slice(3 * v, 3 * v + 3)));
    return all.filter(([u, v]) => document.elementFromPoint(u, v)?.id === 'view').reduce((a, b) => (b[0] > a[0] && b[0] < innerWidth - 8 ? b : a), [0, 0]);
  });
  await page.mouse.move(x - 6, y);
  await until(page, () => [...document.querySelectorAll('.weight.beside')].some((e) => !e.hidden));
  assert.ok(x > 350, `the body ends at ${x}`);
  const right = await page.evaluate(() => Math.max(...[...document.querySelectorAll('.weight.beside')].map((e) => e.getBoundingClientRect().right)));
  assert.ok(right <= 390, `it ends at ${right} of 390`);
  await page.evaluate(() => { window.kerf.app.setTool('scalpel'); });
  await page.setViewportSize({ width: 900, height: 640 });
});

await check('what does nothing says so; from below the board hides nothing; another scene opens in its own view', async () => {
  const board = await startServer('steak-on-a-board'), before = page;
  page = await openPage(board.url);
  await page.setViewportSize({ width: 1000, height: 700 });
  if ((await state(page)).playing) await page.keyboard.press('Space');
  await until(page, () => !window.kerf.state().playing);
  const { bounds } = await state(page), [cx, cy, cz] = bounds.center;
  const steak = await page.evaluate((c) => window.kerf.pickPoint(...c), [cx, cy, cz]);
  const press = async (key, a, b) => { await page.keyboard.press(key); await page.mouse.move(...a); await page.mouse.down(); await page.mouse.move(...b, { steps: 6 }); await page.mouse.up(); };
  const aside = [950, 620];
  await press('1', aside, [900, 640]);
  await says('met nothing of the body');
  await press('v', steak, [steak[0] + 4, steak[1]]);
  await says('Nothing was smoothed');
  await press('9', aside, aside);
  await says('nothing here to bite');
  await press('a', aside, [900, 640]);
  await says('nothing here to take away');
  assert.equal((await state(page)).undoDepth, 0);
  // Seen from below, the middle of the picture is the steak's other side: red, not the board's underside.
  const red = async () => {
    await page.waitForTimeout(800);
    const shot = await page.screenshot({ clip: { x: steak[0] - 10, y: steak[1] - 10, width: 20, height: 20 } });
    return page.evaluate(async (base64) => {
      const image = await createImageBitmap(new Blob([Uint8Array.from(atob(base64), (c) => c.charCodeAt(0))], { type: 'image/png' }));
      const g = new OffscreenCanvas(20, 20).getContext('2d');
      g.drawImage(image, 0, 0);
      const d = g.getImageData(0, 0, 20, 20).data;
      let sum = [0, 0];
      for (let i = 0; i < d.length; i += 4) sum = [sum[0] + d[i], sum[1] + d[i + 1]];
      return sum[0] / (sum[1] + 1);
    }, shot.toString('base64'));
  };
  await page.mouse.move(5, 350);
  await page.evaluate((c) => window.kerf.look(-90, -60, 0.5, c), [cx, cy, cz]);
  const [u, v] = await page.evaluate((c) => window.kerf.pickPoint(...c), [cx, cy, cz]);
  steak[0] = u, steak[1] = v;
  const below = await red();
  assert.ok(below > 2, `red over green ${below.toFixed(2)} from below`);
  await page.screenshot({ path: join(out, 'from-below.png') });
  await page.keyboard.press('q');
  await until(page, () => window.kerf.state().scopeOn);
  await page.evaluate(() => window.kerf.app.command(8, [0], 'sheet'));
  await until(page, () => window.kerf.state().scene === 'sheet');
  await until(page, () => !window.kerf.state().scopeOn && !document.documentElement.hasAttribute('data-scope'));
  assert.equal(await page.getAttribute('#scope', 'aria-pressed'), 'false');
  await page.close();
  await stopServer(board);
  page = before;
});

await check('names, contrast and structure are what readers of screens need', async () => {
  await page.setViewportSize({ width: 1000, height: 700 });
  const axe = readFileSync(join(viewer, 'node_modules/axe-core/axe.min.js'), 'utf8');
  const audit = async (where) => {
    await page.evaluate(axe);
    const found = await page.evaluate(() => window.axe.run(document, { runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'best-practice'] }));
    return found.violations.flatMap((v) => v.nodes.map((n) => `${where}: ${v.id}: ${n.target.join(' ')} (${n.failureSummary.split('\n')[1] ?? ''})`));
  };
  const wrong = [];
  for (const theme of ['light', 'dark']) {
    await page.evaluate((t) => { const s = document.getElementById('theme'); s.value = t; s.dispatchEvent(new Event('change')); }, theme);
    await page.evaluate(() => { document.getElementById('hint').hidden = false; document.getElementById('panel').hidden = true; });
    wrong.push(...await audit(theme));
    await page.evaluate(() => { document.getElementById('panel').hidden = false; for (const d of document.querySelectorAll('#panel details')) d.open = true; });
    wrong.push(...await audit(`${theme}, panel`));
    await page.evaluate(() => { document.getElementById('panel').hidden = true; });
    for (const id of ['help', 'upload', 'result', 'scenes']) {
      await page.evaluate((i) => document.getElementById(i).showModal(), id);
      wrong.push(...await audit(`${theme}, ${id}`));
      await page.evaluate((i) => document.getElementById(i).close(), id);
    }
  }
  await page.evaluate(() => { const s = document.getElementById('theme'); s.value = 'auto'; s.dispatchEvent(new Event('change')); });
  assert.deepEqual([...new Set(wrong)], []);
});

await stopServer(server);
await finish();
