// The page and `kerf view` together, as a person would use them (see browser.mjs):
//   node tests/end_to_end/viewer.mjs PROGRAM [OUT]
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { writeFileSync } from 'node:fs';
import net from 'node:net';
import { join } from 'node:path';
import { check as checkOn, cpuSeconds, difference, drag, errors, finish, line, openPage, out, program, ready, rest, sceneShows, settled, squareFile, startServer, state, still, stopServer, until } from './browser.mjs';

const check = (name, use) => checkOn(name, () => page, use);
const report = {};

// --- The checks ------------------------------------------------------------------------------------------------------

let server = await startServer('steak');
let page = await openPage(server.url);

await check('a cut dragged across the steak makes two pieces and shows', async () => {
  const before = await state(page);
  assert.equal(before.pieces, 1);
  assert.equal(before.connection, 'live');
  assert.ok(before.role.held);
  await settled(page, [-0.004, -0.088, 0.01]);
  await page.keyboard.press('Space');
  await until(page, () => !window.kerf.state().playing);
  const [from, to] = await line(page, [-0.004, -0.088, 0.01], [-0.004, 0.088, 0.01]);
  const near = [], far = [20, 620];
  for (const y of [-0.065, -0.05, -0.035, -0.02]) near.push(await rest(page, [-0.004, y, 0.01]));
  await page.mouse.move(5, 300);
  await page.waitForTimeout(600);
  const quiet = await page.screenshot({ path: join(out, 'steak-before.png') });
  await page.keyboard.press('Space');
  await drag(page, from, to);
  await until(page, () => window.kerf.state().cut?.outcome === 0);
  const after = await state(page);
  assert.equal(after.cut.pieces, 2);
  assert.equal(after.cut.invariants, 0, after.cut.text);
  assert.equal(after.cuts, 1);
  await until(page, () => window.kerf.state().undoDepth === 1);
  assert.ok(after.cut.trianglesCut > 10 && after.cut.totalMs > 0);
  for (const count of Object.keys(after.cut.counts)) assert.ok(after.cut.counts[count] > before.counts[count], count);
  assert.ok(after.drawn.wall > 50 && after.drawn.skin > before.drawn.skin && after.drawn.vertices > before.drawn.vertices);
  assert.equal(after.bodies, 1);  // all of it came in patches
  report.steakCut = after.cut;

  // Pulled apart, the slit is seen.
  await page.keyboard.press('4');
  const hold = await rest(page, [-0.03, -0.06, 0.01]);
  await page.mouse.move(...hold);
  await page.mouse.down();
  await page.mouse.move(hold[0] - 60, hold[1] + 10, { steps: 15 });
  await until(page, (t) => window.kerf.state().time > t, (await state(page)).time + 0.7);
  await page.keyboard.press('Space');
  await page.mouse.move(5, 300, { steps: 2 });
  await page.keyboard.down('Shift');
  await page.mouse.up();
  await page.keyboard.up('Shift');
  await page.waitForTimeout(600);
  const open = await page.screenshot({ path: join(out, 'steak-open.png') });
  // Through the slit the board is seen, and somewhere it is not as dark as the meat.
  const along = [];
  for (const at of near) along.push(await difference(page, quiet, open, at, 30));
  const changed = Math.max(...along), still = await difference(page, quiet, open, far, 10);
  report.steakPicture = { nearCut: changed, elsewhere: still };
  assert.ok(changed > 8, `the picture near the cut differs by ${changed} only`);
  assert.ok(still < 2, `the picture far from it differs by ${still}`);
});

await check('a slit that is closed shows as a line', async () => {
  await page.keyboard.press('r');
  await until(page, () => window.kerf.state().undoDepth === 0 && window.kerf.state().pieces === 1 && !window.kerf.state().playing);
  await page.keyboard.press('2');
  const [from, to] = await line(page, [-0.004, -0.088, 0.01], [-0.004, 0.088, 0.01]), on = from.map((x, k) => 0.6 * x + 0.4 * to[k]);
  await page.mouse.move(5, 300);
  await page.waitForTimeout(600);
  const whole = await page.screenshot();
  await drag(page, from, to);
  await until(page, () => window.kerf.state().pieces === 2);
  await page.mouse.move(5, 300);
  await page.waitForTimeout(600);
  const slit = await page.screenshot({ path: join(out, 'steak-slit.png') });
  const shows = await difference(page, whole, slit, on, 12), beside = await difference(page, whole, slit, [on[0] + 40, on[1]], 10);
  assert.ok(shows > 1.5 && beside < 0.5, `the picture on the slit differs by ${shows}, beside it by ${beside}`);
});

await check('undo and redo by the keyboard', async () => {
  await page.keyboard.press('1');
  const cut = await state(page);
  await page.keyboard.press('z');
  await until(page, () => window.kerf.state().undoDepth === 0 && window.kerf.state().pieces === 1);
  assert.equal((await state(page)).drawn.wall, 0);
  await page.keyboard.press('Shift+Z');
  await until(page, () => window.kerf.state().redoDepth === 0 && window.kerf.state().pieces === 2);
  assert.deepEqual((await state(page)).drawn, cut.drawn);
});

await check('a page that is loaded again sees the same body', async () => {
  const before = await state(page);
  await page.reload();
  await ready(page);
  await until(page, () => window.kerf.state().pieces === 2);
  const after = await state(page);
  assert.deepEqual([after.version, after.drawn, after.undoDepth], [before.version, before.drawn, before.undoDepth]);
  assert.ok(after.role.held);
});

await check('two pages: one holds the tools, both see', async () => {
  const second = await openPage(server.url);
  await until(second, () => window.kerf.state().role.clients === 2);
  assert.equal((await state(second)).role.held, false);
  const [a, b] = [await state(page), await state(second)];
  assert.deepEqual([a.version, a.drawn], [b.version, b.drawn]);
  await page.bringToFront();
  await page.keyboard.press('z');
  await until(page, () => window.kerf.state().pieces === 1);
  await second.bringToFront();
  await until(second, () => window.kerf.state().pieces === 1 && window.kerf.state().drawn.wall === 0);
  await page.close();
  await until(second, () => window.kerf.state().role.held);
  page = second;
});

await check('garbage from elsewhere disturbs nobody', async () => {
  for (const bytes of ['GET / HTTP/9.9\r\n\r\n', '\0'.repeat(4000), `GET /engine HTTP/1.1\r\nHost: evil.example\r\n\r\n`, 'x'.repeat(100000)]) {
    await new Promise((done) => {
      const socket = net.connect(server.port, '127.0.0.1', () => { socket.end(bytes); });
      socket.on('error', done);
      socket.on('close', done);
      socket.resume();
      setTimeout(() => socket.destroy(), 500);
    });
  }
  const before = (await state(page)).frames;
  await page.keyboard.press('Space');
  await until(page, (n) => window.kerf.state().frames > n + 5, before);
});

await check('the server killed and started again: the page comes back by itself', async () => {
  const { port } = server;
  await stopServer(server, 'SIGKILL');
  await until(page, () => window.kerf.state().connection !== 'live');
  assert.equal((await state(page)).toolAllowed, false);
  server = await startServer('steak', port);
  await until(page, () => window.kerf.state().connection === 'live' && window.kerf.state().toolAllowed);
  const frames = (await state(page)).frames;
  await until(page, (n) => window.kerf.state().frames > n + 5, frames);
  await settled(page, [0.03, -0.076, 0.01]);
  const [from, to] = await line(page, [0.03, 0.076, 0.01], [0.03, -0.076, 0.01]);  // the near end may lie below the buttons
  await drag(page, from, to);
  await until(page, () => window.kerf.state().cut?.outcome === 0 && window.kerf.state().pieces === 2);
});

await check('what is fixed is hatched while it can be changed', async () => {
  const rim = await rest(page, [0, 0.068, 0.01]), free = await rest(page, [0, -0.03, 0.01]);
  await page.keyboard.press('Space');
  await until(page, () => !window.kerf.state().playing);
  const shot = async (key) => {
    await page.keyboard.press(key);
    await page.mouse.move(5, 300);
    await page.waitForTimeout(700);
    await still(page);
    return page.screenshot({ path: join(out, `fixed-${key}.png`) });
  };
  assert.ok((await state(page)).fixed > 10);
  const plain = await shot('1'), hatched = await shot('5'), again = await shot('1');
  const there = await difference(page, plain, hatched, rim, 12), elsewhere = await difference(page, plain, hatched, free, 12);
  assert.ok(there > 10 && elsewhere < 0.5, `the fixed rim differs by ${there}, the rest by ${elsewhere}`);
  assert.ok(await difference(page, plain, again, rim, 12) < 0.5);
  await page.keyboard.press('Space');
});

await check('a second button, a pen, and a finger beside it', async () => {
  const cdp = await page.context().newCDPSession(page);
  const [from, to] = await line(page, [-0.05, -0.04, 0.01], [-0.05, 0.04, 0.01], 0), depth = (await state(page)).undoDepth;
  // The right button goes down and up during a stroke: it is still one.
  await page.mouse.move(...from);
  await page.mouse.down();
  await page.mouse.move(0.5 * (from[0] + to[0]), 0.5 * (from[1] + to[1]), { steps: 10 });
  await page.mouse.down({ button: 'right' });
  await page.mouse.move(0.25 * from[0] + 0.75 * to[0], 0.25 * from[1] + 0.75 * to[1], { steps: 5 });
  await page.mouse.up({ button: 'right' });
  await page.mouse.move(...to, { steps: 5 });
  await page.mouse.up();
  await until(page, (n) => window.kerf.state().undoDepth === n, depth + 1);
  // Once a pen was seen, a finger turns the view.
  const pen = (type, buttons) => cdp.send('Input.dispatchMouseEvent', { type, x: 5, y: 300, button: 'left', buttons, clickCount: 1, pointerType: 'pen', force: 0.5 });
  await pen('mousePressed', 1);
  await pen('mouseReleased', 0);
  const before = (await state(page)).camera.position, touch = (type, ...touchPoints) => cdp.send('Input.dispatchTouchEvent', { type, touchPoints });
  await touch('touchStart', { x: from[0], y: from[1] });
  for (let i = 1; i < 8; i++) await touch('touchMove', { x: from[0] + 15 * i, y: from[1] });
  await touch('touchEnd');
  await until(page, (c) => Math.hypot(...window.kerf.state().camera.position.map((x, k) => x - c[k])) > 0.05, before);
  assert.equal((await state(page)).undoDepth, depth + 1);
  await page.keyboard.press('h');
});

await check('another scene, a recording that replays to the same bits', async () => {
  await page.evaluate(() => { window.kerf.app.command(8, [], 'meniscus'); });
  await sceneShows(page, 'meniscus');
  await page.waitForTimeout(1000);
  await page.evaluate(() => {
    window.recorded = null;
    const app = window.kerf.app, listener = app.listener.file.bind(app.listener);
    app.listener.file = (name, bytes) => { window.recorded = { name, text: new TextDecoder().decode(bytes) }; void listener; };
    app.setRecording(true);
  });
  const before = await state(page);
  const [from, to] = await line(page, [0, 0.006, 0], [0, 0.018, 0], 2);  // the second place is the inner rim
  await drag(page, from, to, 40);
  await until(page, () => window.kerf.state().undoDepth === 1 && window.kerf.state().cut?.outcome === 0 && window.kerf.state().cuts === 1);
  const after = await state(page);
  report.meniscusCut = after.cut;
  assert.equal(after.cut.invariants, 0, after.cut.text);
  assert.equal(after.cut.pieces, 2);
  assert.ok(after.drawn.wall > 20 && after.cut.counts.visualTriangles > before.counts.visualTriangles);
  await page.waitForTimeout(500);
  await page.screenshot({ path: join(out, 'meniscus-cut.png') });
  await page.keyboard.press('z');
  await until(page, () => window.kerf.state().pieces === 1);
  await page.evaluate(() => { window.kerf.app.setRecording(false); });
  await until(page, () => window.recorded !== null);
  const recorded = await page.evaluate(() => window.recorded);
  assert.equal(recorded.name, 'meniscus.kerfrec');
  const file = join(out, recorded.name);
  writeFileSync(file, recorded.text);
  const replay = spawn(program, ['replay', file], { stdio: 'inherit' });
  assert.equal(await new Promise((r) => replay.on('exit', r)), 0);
});

await check('a bite, a shave and a piece taken away in the trainer, with a score', async () => {
  await page.evaluate(() => { window.kerf.app.command(8, [], 'trainer'); });
  await sceneShows(page, 'trainer');
  await until(page, () => window.kerf.state().score !== null);
  await page.waitForTimeout(500);
  assert.equal((await state(page)).score.lesionRemoved, 0);
  // The lesion is drawn: red at its place, not beside it.
  await page.mouse.move(5, 300);
  const [lesion, beside] = [await rest(page, [0, 0.0125, 0.002]), await rest(page, [0.006, 0.016, 0.002])];
  const shot = await page.screenshot();
  const colour = (at) => page.evaluate(async ([base64, x, y]) => {
    const image = await createImageBitmap(new Blob([Uint8Array.from(atob(base64), (c) => c.charCodeAt(0))], { type: 'image/png' }));
    const g = new OffscreenCanvas(7, 7).getContext('2d');
    g.drawImage(image, 3 - x, 3 - y);
    const d = g.getImageData(0, 0, 7, 7).data;
    let red = 0, green = 0;
    for (let i = 0; i < d.length; i += 4) { red += d[i]; green += d[i + 1]; }
    return red / green;
  }, [shot.toString('base64'), ...at]);
  const [marked, plain] = [await colour(lesion), await colour(beside)];
  assert.ok(marked > 1.2 * plain, `the lesion's red over green is ${marked}, beside it ${plain}`);

  await page.keyboard.press('9');
  await page.mouse.move(...lesion);
  await until(page, () => window.kerf.app.blade.bite.visible);  // the preview
  await page.mouse.down();
  await page.mouse.up();
  await until(page, () => window.kerf.state().undoDepth === 2 && window.kerf.state().score.lesionRemoved > 0.3);
  const bitten = await state(page);
  assert.equal(bitten.pieces, 1);
  assert.equal(bitten.cut.invariants, 0, bitten.cut.text);
  assert.ok(bitten.score.roughness > 0);
  await page.screenshot({ path: join(out, 'trainer-bitten.png') });

  await page.keyboard.press('v');
  const [a, b] = [await rest(page, [-0.0025, 0.0132, 0.0015]), await rest(page, [0.0025, 0.0132, 0.0015])];
  await drag(page, a, b, 20);
  await until(page, () => window.kerf.state().undoDepth === 3);
  await until(page, (r) => window.kerf.state().score.roughness < 0.9 * r, bitten.score.roughness);
  assert.equal((await state(page)).cut.invariants, 0);

  // A bite that is left lying is pulled out and gone.
  await page.keyboard.press('9');
  const piece = await rest(page, [0.007, 0.0145, 0.002]);
  await page.keyboard.down('Shift');
  await page.mouse.move(...piece);
  await page.mouse.down();
  await page.mouse.up();
  await page.keyboard.up('Shift');
  await until(page, () => window.kerf.state().pieces === 2);
  await page.keyboard.press('a');
  await drag(page, piece, [piece[0] + 40, piece[1] - 40], 10);
  await until(page, () => window.kerf.state().pieces === 1);
  await page.keyboard.press('d');
  await page.waitForSelector('#result[open]');
  assert.match(await page.textContent('#result-table'), /healthy removed/);
  await page.screenshot({ path: join(out, 'trainer-score.png') });
  assert.equal((await state(page)).playing, false);
  await page.click('#result-on');
  await until(page, () => window.kerf.state().playing);
  await page.keyboard.press('z');
  await until(page, () => window.kerf.state().pieces === 2);
  report.trainer = (await state(page)).score;
  await page.keyboard.press('1');
});

await check('nothing lies over anything on a phone, on its side, on a tablet or a desk', async () => {
  await page.keyboard.press('9');  // an instrument with a size, in a scene with a score: as many cards as there can be
  for (const [width, height] of [[390, 844], [844, 390], [820, 1180], [1280, 720], [900, 640]]) {
    await page.setViewportSize({ width, height });
    const wrong = await page.evaluate(() => {
      document.getElementById('hint').hidden = false;
      document.getElementById('hint-text').textContent = 'Click to bite a piece out, over the rim too; drag to bite on. Hold Shift to leave the pieces lying.';
      const cards = [...document.querySelectorAll('.card')].map((e) => [e.id || e.textContent.slice(0, 20), e.getBoundingClientRect()]).filter(([, r]) => r.width > 0);
      const outside = cards.filter(([, r]) => r.left < 0 || r.top < 0 || r.right > innerWidth || r.bottom > innerHeight).map(([name]) => `${name} is cut off`);
      const over = cards.flatMap(([m, a], i) => cards.slice(i + 1).filter(([, b]) => a.left < b.right - 1 && b.left < a.right - 1 && a.top < b.bottom - 1 && b.top < a.bottom - 1).map(([n]) => `${m} and ${n}`));
      return [...outside, ...over];
    });
    assert.deepEqual(wrong, [], `${width} x ${height}`);
  }
  await page.keyboard.press('1');
});

await check('own meshes are loaded and cut', async () => {
  const file = (name, text) => ({ name, mimeType: 'text/plain', buffer: Buffer.from(text) });
  await page.setInputFiles('#files', [file('cloth.obj', squareFile(40)), file('cloth_collision.obj', squareFile(6))]);
  await page.fill('#upload-thickness', '0.02');
  await page.click('#upload-go');
  await sceneShows(page, 'cloth');
  assert.equal(await page.evaluate(() => document.getElementById('scene-title').textContent), 'cloth');
  // It hangs by its far rim and swings: cut as it lies at the start.
  await page.keyboard.press('Space');
  await until(page, () => !window.kerf.state().playing);
  await page.keyboard.press('r');
  await until(page, () => window.kerf.state().time === 0);
  await page.waitForTimeout(500);
  const [from, to] = await line(page, [0, 0.7, 0], [1, 0.7, 0], 0.15);
  await drag(page, from, to, 40);
  await until(page, () => window.kerf.state().cut?.outcome === 0);
  const after = await state(page);
  assert.equal(after.cut.pieces, 2);
  assert.equal(after.cut.invariants, 0, after.cut.text);
  await page.keyboard.press('Space');
});

await check('an open sheet alone is asked for its thickness, a picture is refused', async () => {
  const offer = (name, text) => page.evaluate(([n, t]) => {
    const files = new DataTransfer();
    files.items.add(new File([t], n));
    document.body.dispatchEvent(new DragEvent('drop', { dataTransfer: files, bubbles: true, cancelable: true }));
  }, [name, text]);
  const says = (text) => page.waitForFunction((t) => [...document.querySelectorAll('#toasts p')].some((p) => p.textContent.includes(t)), text);
  await offer('photo.png', 'no mesh');
  await says("photo.png can't be opened");
  await offer('cloth.obj', squareFile(8, 80));
  await until(page, () => document.getElementById('upload').open);
  await page.fill('#upload-thickness', '2');
  await page.click('#upload-go');
  await sceneShows(page, 'cloth');
});

await check('a tool led by the pointer presses on a body that lies on a board', async () => {
  const file = join(out, 'board.toml');
  writeFileSync(file, `[body]\nmodel = "steak"\n[simulation]\ntime_step = 0.005\n
[[obstacle]]\nname = "board"\nshape = "box"\nsize = [0.34, 0.26, 0.02]\nposition = [0, 0, -0.0215]\n
[[obstacle]]\nshape = "plane"\nposition = [0, 0, -0.0315]\n
[[tool]]\nid = "ball"\nkind = "sphere"\nradius = 0.008\nposition = [0.02, -0.02, 0.03]\n`);
  const kitchen = await startServer(file);
  const cook = await openPage(kitchen.url);
  await until(cook, () => window.kerf.state().things.length === 3 && window.kerf.state().touching > 10);
  await cook.keyboard.press('8');
  await cook.keyboard.press('k');
  await until(cook, () => window.kerf.app.things.contactPoints.geometry.drawRange.count > 10);
  const before = (await state(cook)).rigid[0];
  await cook.mouse.move(...await cook.evaluate((p) => window.kerf.pickPoint(...p), before.place.position));
  await cook.mouse.down();
  await cook.mouse.move(...await cook.evaluate(([x, y]) => window.kerf.pickPoint(x, y, -0.008), before.place.position), { steps: 12 });  // in the plane that faces the eye
  await until(cook, () => Math.hypot(...window.kerf.state().rigid[0].force) > 0.1);
  const pressed = (await state(cook)).rigid[0];
  assert.ok(pressed.place.position[2] < before.place.position[2] - 0.004, 'it went down');
  assert.ok(pressed.force[2] > 0, 'the steak pushes it up');
  await cook.screenshot({ path: join(out, 'board.png') });
  await cook.mouse.wheel(0, 120);  // away from the eye, or nearer: it moves, the view does not zoom
  const camera = (await state(cook)).camera.position;
  await until(cook, (p) => Math.hypot(...window.kerf.state().rigid[0].pose.position.map((x, i) => x - p[i])) > 1e-3, pressed.pose.position);
  const moved = Math.hypot(...(await state(cook)).camera.position.map((x, i) => x - camera[i]));
  assert.ok(moved < 1e-6, `the camera moved by ${moved} m`);
  await cook.mouse.up();
  await cook.close();
  await stopServer(kitchen);
});

await check('measurements: latency, traffic, CPU (reported, not judged)', async () => {
  await page.close();
  page = await openPage(server.url, { width: 320, height: 240 });
  // The panels cover such a small window: the pointer goes through them.
  await page.addStyleTag({ content: 'body * { pointer-events: none !important } #view { pointer-events: auto !important }' });
  await page.evaluate(() => { window.kerf.app.command(8, [], 'steak'); });
  await sceneShows(page, 'steak');
  await page.waitForTimeout(1500);
  const pid = server.child.pid;
  const [cpu, frames, time] = [cpuSeconds(pid), (await state(page)).frames, Date.now()];
  await page.waitForTimeout(4000);
  const seconds = (Date.now() - time) / 1000;
  report.serverCpu = (cpuSeconds(pid) - cpu) / seconds;
  report.framesPerSecond = ((await state(page)).frames - frames) / seconds;
  report.frameBytes = 64 + 12 * (await state(page)).drawn.nodes;
  report.step = (await state(page)).stats;
  await page.evaluate(() => { window.kerf.app.latency.reset(); });
  for (let k = 0; k < 4; k++) {
    const x = -0.045 + 0.03 * k, [from, to] = await line(page, [x, -0.07, 0.01], [x, 0.07, 0.01], 0.2);
    await page.mouse.move(...from);
    await page.mouse.down();
    for (let i = 1; i <= 60; i++) {
      await page.mouse.move(from[0] + ((to[0] - from[0]) * i) / 60, from[1] + ((to[1] - from[1]) * i) / 60);
      await page.waitForTimeout(12);
    }
    await page.mouse.up();
    await page.waitForTimeout(200);
    if (k % 2 === 1) await page.keyboard.press('z');
  }
  // And pulling: the body follows in the next frame.
  await page.keyboard.press('4');
  const hold = await rest(page, [0.02, -0.05, 0.01]);
  await page.mouse.move(...hold);
  await page.mouse.down();
  for (let i = 1; i <= 80; i++) {
    await page.mouse.move(hold[0] + 20 * Math.sin(i / 6), hold[1] + 6 * Math.sin(i / 4));
    await page.waitForTimeout(12);
  }
  await page.mouse.up();
  report.latency = (await state(page)).latency;
  report.patches = (await state(page)).patches;
  assert.ok(report.latency.count > 20 && report.latency.motion.count > 20);
  const said = (l) => `median ${l.appliedMedian?.toFixed(1)} ms, 99 % ${l.applied99?.toFixed(1)} ms (${l.count} inputs)`;
  console.log(`     pointer to cut: ${said(report.latency)}; to pull: ${said(report.latency.motion)}; `
    + `frame ${report.frameBytes} bytes; server ${(100 * report.serverCpu).toFixed(1)} % of a core at ${report.framesPerSecond.toFixed(0)} frames a second`);
});

await check('a port in use is said so', async () => {
  await assert.rejects(startServer('steak', server.port), new RegExp(`ended: 2 kerf: port ${server.port} is in use; give another`));
});

await check('Ctrl-C ends it cleanly', async () => {
  const ended = await stopServer(server);
  assert.equal(ended.code, 0);
  assert.match(ended.text, /stopped/);
  await until(page, () => window.kerf.state().connection !== 'live');
});

writeFileSync(join(out, 'viewer.json'), `${JSON.stringify(report, null, 1)}\n`);
await finish();
