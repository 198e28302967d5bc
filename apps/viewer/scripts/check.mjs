// Uses the built page as a person would, with the engine that runs in the page, and checks its own account of what
// happened:  npm run build && npm run check
import assert from 'node:assert/strict';
import { mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { drag, ready, withPage } from './page.mjs';

const viewport = { width: 800, height: 560 };
const state = (page) => page.evaluate(() => window.kerf.state());
const at = (page, x, y, z = 0.011) => page.evaluate(([a, b, c]) => window.kerf.pickPoint(a, b, c), [x, y, z]);
const until = (page, test, arg) => page.waitForFunction(test, arg, { timeout: 30000 });
const open = async (page, url, query = '') => {
  await page.goto(`${url}?engine=mock&quality=lite${query}`);
  await ready(page);
};
const away = (a, b) => Math.hypot(...a.map((v, i) => v - b[i]));
const only = process.argv.slice(2);
let failed = 0;

async function check(name, options, use) {
  if (only.length > 0 && !only.some((o) => name.includes(o))) return;
  const started = Date.now();
  const errors = [];
  try {
    await withPage({ viewport, ...options }, async (page, url) => {
      page.on('pageerror', (e) => errors.push(e.message));
      await use(page, url);
    });
    assert.deepEqual(errors, []);
    console.log(`ok   ${name} (${((Date.now() - started) / 1000).toFixed(1)} s)`);
  } catch (e) {
    failed++;
    console.log(`FAIL ${name}: ${e.stack ?? e}`);
  }
}

await check('a cut through the body makes two pieces, undo and redo', {}, async (page, url) => {
  await open(page, url);
  const before = await state(page);
  await drag(page, [await at(page, 0.012, -0.1), await at(page, 0.012, 0.1)]);
  await until(page, () => window.kerf.state().cut?.pieces === 2);
  const after = await state(page);
  assert.ok(after.drawn.wall > 0 && after.drawn.vertices > before.drawn.vertices && after.version > before.version);
  assert.equal(after.undoDepth, 1);
  assert.ok(away(after.camera.position, before.camera.position) < 1e-6);
  assert.ok(after.latency.count > 0);
  await page.keyboard.press('z');
  await until(page, () => window.kerf.state().undoDepth === 0);
  const undone = await state(page);
  assert.deepEqual(
    [undone.drawn.vertices, undone.drawn.skin, undone.drawn.wall, undone.drawn.copies],
    [before.drawn.vertices, before.drawn.skin, 0, before.drawn.copies],
  );
  await page.keyboard.press('Shift+Z');
  await until(page, (n) => window.kerf.state().drawn.vertices === n, after.drawn.vertices);
});

await check(
  'the shader skins as trilinear interpolation does, and normals follow the surface',
  {},
  async (page, url) => {
    await page.goto(`${url}?engine=mock&quality=low`);
    await ready(page);
    await drag(page, [await at(page, 0.012, -0.1), await at(page, 0.012, 0.1)], 3);
    await until(page, () => window.kerf.state().cut?.pieces === 2);
    await page.waitForTimeout(500);
    const result = await page.evaluate(() => {
      const { app, skinningSource } = window.kerf,
        s = app.mesh.state,
        u = app.mesh.cells.uniforms;
      const gl = document.createElement('canvas').getContext('webgl2'),
        program = gl.createProgram();
      const shader = (type, source) => {
        const x = gl.createShader(type);
        gl.shaderSource(x, `#version 300 es\nprecision highp float; precision highp int;\n${source}`);
        gl.compileShader(x);
        if (!gl.getShaderParameter(x, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(x));
        gl.attachShader(program, x);
      };
      shader(
        gl.VERTEX_SHADER,
        `#define KERF_SMOOTH\n${skinningSource.replace('in uint copyId', 'layout(location=2) in uint copyId')}
      layout(location=0) in vec3 place; layout(location=1) in vec4 direction; out vec3 p, n;
      void main() { kSkin(place, direction.xyz); p = kPos; n = kNrm; gl_Position = vec4(0.0); }`,
      );
      shader(gl.FRAGMENT_SHADER, 'out vec4 c; void main() { c = vec4(1.0); }');
      gl.transformFeedbackVaryings(program, ['p', 'n'], gl.INTERLEAVED_ATTRIBS);
      gl.linkProgram(program);
      if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
      gl.useProgram(program);
      const buffer = (data, location, size, call) => {
        gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
        gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
        gl.enableVertexAttribArray(location);
        call(location, size);
      };
      buffer(s.rest.subarray(0, 3 * s.nv), 0, 3, (l, k) => gl.vertexAttribPointer(l, k, gl.FLOAT, false, 0, 0));
      buffer(s.normal.subarray(0, 4 * s.nv), 1, 4, (l, k) => gl.vertexAttribPointer(l, k, gl.SHORT, true, 0, 0));
      buffer(s.copy.subarray(0, s.nv), 2, 1, (l, k) => gl.vertexAttribIPointer(l, k, gl.UNSIGNED_INT, 0, 0));
      const at = (name) => gl.getUniformLocation(program, name);
      ['uPose', 'uNormals', 'uFrames'].forEach((name, unit) => {
        const image = u[name].value.image;
        gl.activeTexture(gl.TEXTURE0 + unit);
        gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
        gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, image.width, image.height, 0, gl.RGBA, gl.FLOAT, image.data);
        for (const p of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, p, gl.NEAREST);
        gl.uniform1i(at(name), unit);
      });
      const feedback = gl.createBuffer();
      gl.bindBuffer(gl.TRANSFORM_FEEDBACK_BUFFER, feedback);
      gl.bufferData(gl.TRANSFORM_FEEDBACK_BUFFER, 24 * s.nv, gl.STATIC_READ);
      gl.bindBufferBase(gl.TRANSFORM_FEEDBACK_BUFFER, 0, feedback);
      gl.enable(gl.RASTERIZER_DISCARD);
      gl.beginTransformFeedback(gl.POINTS);
      gl.drawArrays(gl.POINTS, 0, s.nv);
      gl.endTransformFeedback();
      const out = new Float32Array(6 * s.nv);
      gl.getBufferSubData(gl.TRANSFORM_FEEDBACK_BUFFER, 0, out);
      // Directly from the eight nodes.
      let worst = 0,
        moved = 0;
      const now = new Float64Array(3 * s.nv);
      for (let v = 0; v < s.nv; v++) {
        const c = s.copy[v];
        // A frame, in 16 numbers: origin x3, 0, axes x9 as columns, cell size x3.
        const frame = s.frames.subarray(16 * s.cells[4 * c + 3], 16 * s.cells[4 * c + 3] + 16);
        const q = [0, 1, 2].map(
          (a) =>
            [0, 1, 2].reduce((x, k) => x + frame[4 + 3 * a + k] * (s.rest[3 * v + k] - frame[k]), 0) / frame[13 + a] -
            s.cells[4 * c + a],
        );
        for (let k = 0; k < 8; k++) {
          const w = [0, 1, 2].reduce((x, a) => x * ((k >> a) & 1 ? q[a] : 1 - q[a]), 1);
          for (let d = 0; d < 3; d++) now[3 * v + d] += w * s.nodes[3 * s.copies[8 * c + k] + d];
        }
        for (let d = 0; d < 3; d++) {
          worst = Math.max(worst, Math.abs(now[3 * v + d] - out[6 * v + d]));
          moved = Math.max(moved, Math.abs(now[3 * v + d] - s.rest[3 * v + d]));
        }
      }
      // Normals against those of the deformed triangles.
      const angles = [];
      for (let t = 0; t < 3 * s.ns; t += 3) {
        const [a, b, c] = [0, 1, 2].map((k) => now.subarray(3 * s.skin[t + k], 3 * s.skin[t + k] + 3));
        const e = [0, 1, 2].map((d) => b[d] - a[d]),
          f = [0, 1, 2].map((d) => c[d] - a[d]);
        const n = [e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]],
          l = Math.hypot(...n);
        const m = [0, 1, 2].map((d) => [0, 1, 2].reduce((x, k) => x + out[6 * s.skin[t + k] + 3 + d], 0));
        angles.push(
          (180 / Math.PI) * Math.acos(Math.min(1, (n[0] * m[0] + n[1] * m[1] + n[2] * m[2]) / (l * Math.hypot(...m)))),
        );
      }
      angles.sort((x, y) => x - y);
      return { worst, moved, median: angles[angles.length >> 1], high: angles[Math.floor(0.98 * angles.length)] };
    });
    assert.ok(result.moved > 1e-3, JSON.stringify(result));
    assert.ok(result.worst < 1e-6, JSON.stringify(result));
    assert.ok(result.median < 4 && result.high < 25, JSON.stringify(result));
  },
);

await check('the straight cut goes from A to B, a click with the closed tool does nothing', {}, async (page, url) => {
  await open(page, url);
  await page.keyboard.press('2');
  await drag(page, [await at(page, -0.02, -0.1), await at(page, -0.02, 0.02)], 4);
  await until(page, () => window.kerf.state().cut?.outcome === 0);
  const one = await state(page);
  assert.equal(one.pieces, 1);
  await page.keyboard.press('3');
  await page.mouse.click(...(await at(page, 0.03, 0)));
  await page.waitForTimeout(300);
  assert.equal((await state(page)).version, one.version);
});

await check('the camera: right button and Alt turn it, the left button does not', {}, async (page, url) => {
  await open(page, url);
  const first = await state(page),
    [x, y] = await at(page, 0, 0);
  await page.mouse.move(x, y);
  await page.mouse.down({ button: 'right' });
  await page.mouse.move(x + 80, y, { steps: 4 });
  await page.mouse.up({ button: 'right' });
  await until(
    page,
    (c) => Math.hypot(...window.kerf.state().camera.position.map((v, i) => v - c[i])) > 0.02,
    first.camera.position,
  );
  await page.waitForTimeout(1200);
  const second = await state(page);
  assert.equal(second.version, first.version);
  await page.keyboard.down('Alt');
  await drag(
    page,
    [
      [x, y],
      [x - 80, y],
    ],
    4,
  );
  await page.keyboard.up('Alt');
  await until(
    page,
    (c) => Math.hypot(...window.kerf.state().camera.position.map((v, i) => v - c[i])) > 0.02,
    second.camera.position,
  );
  await page.waitForTimeout(1200);
  const third = await state(page);
  assert.equal(third.version, first.version);
  await drag(page, [await at(page, 0, -0.1), await at(page, 0, 0)], 4);
  await until(page, () => window.kerf.state().cut !== null);
  await page.waitForTimeout(800);
  const fourth = await state(page);
  assert.ok(away(fourth.camera.position, third.camera.position) < 1e-6);
});

await check(
  'one finger cuts, a second finger takes the stroke back and turns the view',
  { touch: true },
  async (page, url) => {
    await open(page, url);
    const cdp = await page.context().newCDPSession(page);
    const touch = (type, ...points) =>
      cdp.send('Input.dispatchTouchEvent', { type, touchPoints: points.map(([x, y], id) => ({ x, y, id })) });
    const before = await state(page),
      a = await at(page, 0.012, -0.09),
      b = await at(page, 0.012, 0.09);
    const mid = [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];
    await touch('touchStart', a);
    await touch('touchMove', mid);
    await touch('touchMove', b);
    await until(page, (v) => window.kerf.state().version > v, before.version);
    await touch('touchStart', b, [b[0] + 60, b[1] + 40]);
    await until(
      page,
      (n) => window.kerf.state().drawn.vertices === n && !window.kerf.state().stroke,
      before.drawn.vertices,
    );
    await touch('touchMove', [b[0] + 40, b[1]], [b[0] + 100, b[1] + 40]);
    await touch('touchMove', [b[0] + 70, b[1]], [b[0] + 130, b[1] + 40]);
    await touch('touchEnd');
    await until(
      page,
      (c) => Math.hypot(...window.kerf.state().camera.position.map((v, i) => v - c[i])) > 1e-3,
      before.camera.position,
    );
    assert.equal((await state(page)).undoDepth, 0);
    await page.waitForTimeout(800); // the last moves have turned the view
    await page.evaluate(() => window.kerf.app.resetCamera());
    await page.waitForTimeout(1000);
    const c = await at(page, 0.012, -0.09),
      d = await at(page, 0.012, 0.09);
    await touch('touchStart', c);
    for (let i = 1; i <= 6; i++)
      await touch('touchMove', [c[0] + (i / 6) * (d[0] - c[0]), c[1] + (i / 6) * (d[1] - c[1])]);
    await touch('touchEnd');
    await until(page, () => window.kerf.state().cut?.pieces === 2);
  },
);

await check('a paused page that nothing changes draws nothing', {}, async (page, url) => {
  await open(page, url);
  await page.keyboard.press('Space');
  await until(page, () => !window.kerf.state().playing);
  await page.waitForTimeout(3500);
  await until(page, () => window.kerf.state().fps === 0);
  assert.ok((await state(page)).frames > 5); // frames still come and are acknowledged
  const t = (await state(page)).time;
  await page.keyboard.press('.');
  await until(page, (x) => window.kerf.state().time > x, t);
});

await check('grasping pulls', {}, async (page, url) => {
  await open(page, url);
  await page.keyboard.press('4');
  const a = await at(page, 0.02, -0.05),
    before = await state(page);
  await page.mouse.move(...a);
  await page.mouse.down();
  await page.mouse.move(a[0], a[1] - 120, { steps: 6 });
  await until(page, (z) => window.kerf.state().bounds.center[2] > z + 0.004, before.bounds.center[2]);
  await page.mouse.up();
});

await check('views, panel, themes, help and tools by key', {}, async (page, url) => {
  await open(page, url);
  await page.keyboard.press('7');
  assert.equal((await state(page)).tool, 'hand');
  for (const k of ['s', 'w', 'o', 'x', 'b', 'l', 'n']) await page.keyboard.press(k);
  await page.waitForTimeout(500);
  assert.deepEqual((await state(page)).views, {
    shaded: false,
    wireframe: true,
    collision: true,
    hexahedra: true,
    bound: true,
    links: true,
    feet: true,
  });
  await page.keyboard.press('1');
  await drag(page, [await at(page, 0.012, -0.1), await at(page, 0.012, 0.1)], 4);
  await until(page, () => window.kerf.state().cut?.pieces === 2);
  await page.keyboard.press('m');
  assert.equal(await page.isVisible('#panel'), true);
  await page.locator('#panel summary', { hasText: 'Plots' }).click();
  await page.waitForSelector('.uplot canvas', { timeout: 20000 });
  await page.keyboard.press('Escape');
  assert.equal(await page.isVisible('#panel'), false);
  const theme = await page.evaluate(() => document.documentElement.dataset.theme);
  await page.keyboard.press('t');
  assert.notEqual(await page.evaluate(() => document.documentElement.dataset.theme), theme);
  await page.keyboard.press('?');
  assert.equal(await page.evaluate(() => document.getElementById('help').open), true);
  await page.keyboard.press('r'); // no shortcut works behind a dialog
  await page.keyboard.press('Escape');
  assert.equal((await state(page)).bodies, 1);
  const nameless = await page.evaluate(() =>
    [...document.querySelectorAll('button, select, input, a')]
      .filter((e) => {
        const label =
          e.getAttribute('aria-label') ||
          e.textContent?.trim() ||
          e.title ||
          [...(e.labels ?? [])]
            .map((l) => l.textContent)
            .join('')
            .trim();
        return !label && !e.hidden;
      })
      .map((e) => e.outerHTML),
  );
  assert.deepEqual(nameless, []);
});

await check('every view of the body changes the picture where it should', {}, async (page, url) => {
  await open(page, url);
  await page.keyboard.press('Space');
  await until(page, () => !window.kerf.state().playing);
  await page.mouse.move(5, 200);
  await page.waitForTimeout(1000);
  const clip = { x: 220, y: 150, width: 380, height: 230 };
  const shot = async () => (await page.screenshot({ clip })).toString('base64');
  let last = await shot();
  for (const k of ['w', 'o', 'x', 'b', 'l', 'n', 's']) {
    await page.keyboard.press(k);
    await page.waitForTimeout(700);
    const now = await shot();
    assert.notEqual(now, last, `view ${k} shows`);
    last = now;
  }
});

await check('files: picture, recording, export, meshes to open', {}, async (page, url) => {
  await open(page, url);
  const [picture] = await Promise.all([page.waitForEvent('download'), page.keyboard.press('p')]);
  assert.match(picture.suggestedFilename(), /steak\.png$/);
  const [exported] = await Promise.all([page.waitForEvent('download'), page.keyboard.press('e')]);
  assert.match(exported.suggestedFilename(), /\.obj$/);
  await page.keyboard.press('Shift+R');
  await page.waitForTimeout(200);
  const [recording] = await Promise.all([page.waitForEvent('download'), page.keyboard.press('Shift+R')]);
  assert.match(recording.suggestedFilename(), /\.kerf$/);
  const folder = mkdtempSync(join(tmpdir(), 'kerf-files-'));
  const files = [join(folder, 'body.obj'), join(folder, 'body-collision.obj')];
  writeFileSync(files[0], 'v 0 0 0\n'.repeat(20000));
  writeFileSync(files[1], 'v 0 0 0\n');
  await page.setInputFiles('#files', files);
  assert.equal(await page.evaluate(() => document.getElementById('upload').open), true);
  assert.equal(await page.evaluate(() => document.getElementById('upload-visual').selectedOptions[0].text), 'body.obj');
  assert.equal(
    await page.evaluate(() => document.getElementById('upload-collision').selectedOptions[0].text),
    'body-collision.obj',
  );
  await page.click('#upload-go');
  await until(page, () => window.kerf.state().errors === 1); // this engine cannot load files, and says so
  rmSync(folder, { recursive: true, force: true });
});

await check('scenes change look and keep working', {}, async (page, url) => {
  await open(page, url);
  await page.evaluate((name) => window.kerf.app.command(8, [], name), 'meniscus');
  await until(page, () => window.kerf.state().scene === 'meniscus' && window.kerf.state().bodies === 2);
  await drag(page, [await at(page, 0.012, -0.1), await at(page, 0.012, 0.1)], 4);
  await until(page, () => window.kerf.state().cut?.pieces === 2);
});

await check('without an engine the page says so and pauses the tools', {}, async (page, url) => {
  await page.goto(`${url}?quality=lite`);
  await page.waitForFunction(() => window.kerf && ['lost', 'connecting'].includes(window.kerf.state().connection));
  await until(page, () => window.kerf.state().connection === 'lost');
  assert.equal(await page.isVisible('#banner'), true);
  assert.equal((await state(page)).toolAllowed, false);
});

process.exitCode = failed > 0 ? 1 : 0;
