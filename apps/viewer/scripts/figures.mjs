// Makes the figures of docs/figures.md in the page, as a person would: kerf view, the view's toggles, the tools.
//   npm run build && npm run figures -- --kerf ../../build/release/kerf --out ../../docs/figures [number...]
// --quick: small pictures of small bodies, for tests: does every figure still come about?
import { existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { parseArgs } from 'node:util';
import { drag, ready, withKerf, withPage, withQuery } from './page.mjs';
import { encodePng } from './palette_png.mjs';

const { values: options, positionals: only } = parseArgs({
  options: {
    kerf: { type: 'string', default: 'kerf' },
    out: { type: 'string', default: 'figures' },
    quick: { type: 'boolean', default: false },
  },
  allowPositionals: true,
});
const out = resolve(options.out),
  dist = fileURLToPath(new URL('../dist', import.meta.url));
if (!existsSync(join(dist, 'index.html'))) {
  console.log('skipped: the page is not built (npm run build)');
  process.exit(77);
}
const shipped = fileURLToPath(new URL('../../../scenes/', import.meta.url));
const scratch = mkdtempSync(join(tmpdir(), 'kerf-figures-'));
const kViews = ['shaded', 'wireframe', 'collision', 'hexahedra', 'bound', 'links', 'feet'];
const { quick } = options;
const kWidth = quick ? 500 : 1000,
  kGap = 8;

/** A shipped scene without its commands and obstacles, with other options of its model and another weight. */
function scene(name, modelOptions = '', gravity = 0) {
  const text = readFileSync(join(shipped, `${name}.toml`), 'utf8');
  const head = text
    .slice(0, text.indexOf('[[command]]'))
    .replace(/^\[\[obstacle\]\]\n(?:(?!\[).*\n)*/gm, '')
    .replace(/^(options|gravity) *=.*\n/gm, '')
    .replace(/^(model *=.*)$/m, `$1\n${modelOptions && `options = { ${modelOptions} }`}`)
    .replace(/^\[simulation\]$/m, `[simulation]\ngravity = [0, 0, ${gravity}]`);
  return head;
}

/** Starts kerf view with a scene on a free port and uses it in a window of the given size. */
async function view(name, text, width, height, use, scale = 2) {
  const file = join(scratch, `${name}.toml`);
  writeFileSync(file, text);
  const viewport = quick ? { width, height: Math.round(height / 2) } : { width, height };
  return withKerf(options.kerf, file, (url) =>
    withPage({ url, viewport, scale: quick ? 1 : scale }, async (page) => {
      await page.goto(withQuery(url, `ui=0&stage=plain&quality=${quick ? 'lite' : 'full'}`));
      await ready(page);
      return use(new Shown(page));
    }),
  );
}

class Shown {
  constructor(page) {
    this.page = page;
  }
  state() {
    return this.page.evaluate(() => window.kerf.state());
  }
  until(test, arg) {
    return this.page.waitForFunction(test, arg, { timeout: 120000 });
  }
  async pause() {
    if (!(await this.state()).playing) return;
    await this.page.keyboard.press('Space');
    await this.until(() => !window.kerf.state().playing);
  }
  /** As it lies at the start, paused. */
  async start() {
    await this.pause();
    await this.page.keyboard.press('r');
    await this.until(() => window.kerf.state().time === 0);
  }
  /** Lets so many seconds of the scene pass. */
  async play(seconds) {
    const { time } = await this.state();
    await this.page.keyboard.press('Space');
    await this.until((t) => window.kerf.state().time > t, time + seconds);
    await this.pause();
  }
  /** Exactly these of the view's toggles. */
  async show(...views) {
    await this.page.evaluate(
      ([all, on]) => {
        for (const v of all) window.kerf.app.setView(v, on.includes(v));
      },
      [kViews, views],
    );
    await this.until(() => {
      const { overlays, mesh } = window.kerf.app;
      return (
        overlays.wanted === 0 ||
        (overlays.message?.version === mesh.state.version && (overlays.wanted < 2 || overlays.message.feet.length > 0))
      );
    });
  }
  /** Leaves one collision triangle in the view, what is bound to it, and (side 1 or -1) only what lies above or below it. */
  async onlyTriangle(place, side = 0) {
    this.corners = await this.page.evaluate(
      ([[x, y], which]) => {
        const { overlays, mesh } = window.kerf.app,
          s = mesh.state;
        const whole = (window.kerf.whole ??= { overlay: overlays.message, skin: s.skin.slice(), ns: s.ns });
        const m = whole.overlay,
          cross = (a, b, c) => (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        const of = (t) =>
          [0, 1, 2].map((k) => [...m.rest.subarray(3 * m.triangles[3 * t + k], 3 * m.triangles[3 * t + k] + 3)]);
        const parts = (p, c) => [0, 1, 2].map((k) => cross(c[k], c[(k + 1) % 3], p) / cross(c[0], c[1], c[2]));
        let t = 0;
        while (parts([x, y], of(t)).some((w) => w < 0)) t++;
        const corners = of(t),
          kept = [],
          rest = [];
        const inside = new Set();
        for (let i = 0; i < m.feet.length / 2; i++) {
          const f = m.footRest.subarray(3 * i, 3 * i + 3),
            v = m.feet[2 * i];
          if (parts(f, corners).some((w) => w < -1e-4) || which * (s.rest[3 * v + 2] - f[2]) < 0) continue;
          kept.push(v, m.feet[2 * i + 1]);
          rest.push(...f);
          inside.add(v);
        }
        const ids = new Set([0, 1, 2].map((k) => m.triangles[3 * t + k])),
          pairs = (a, keep) => {
            const r = [];
            for (let i = 0; i < a.length; i += 2) if (keep(a[i], a[i + 1])) r.push(a[i], a[i + 1]);
            return new Uint32Array(r);
          };
        const skin = [];
        for (let i = 0; i < 3 * whole.ns; i += 3) {
          const f = [...whole.skin.subarray(i, i + 3)];
          if (f.every((v) => inside.has(v))) skin.push(...f);
        }
        s.skin.fill(0);
        s.skin.set(skin);
        s.ns = skin.length / 3;
        mesh.generation++;
        overlays.setMessage({
          ...m,
          triangles: m.triangles.slice(3 * t, 3 * t + 3),
          feet: new Uint32Array(kept),
          footRest: new Float32Array(rest),
          bound: pairs(m.bound, (a, b) => inside.has(a) && inside.has(b)),
          links: pairs(m.links, (a) => ids.has(a)),
        });
        window.kerf.app.overlay = () => {}; // what the engine sends from now on would bring all of it back
        return corners;
      },
      [place, side],
    );
  }
  triangle() {
    const c = this.corners,
      target = [0, 1, 2].map((k) => (c[0][k] + c[1][k] + c[2][k]) / 3);
    return { target, size: Math.max(...c.map((p, k) => Math.hypot(...p.map((v, i) => v - c[(k + 1) % 3][i])))) };
  }
  look(azimuth, elevation, distance, target) {
    return this.page.evaluate((v) => window.kerf.look(...v), [azimuth, elevation, distance, target]);
  }
  at([x, y, z]) {
    return this.page.evaluate((p) => window.kerf.pickPoint(...p), [x, y, z]);
  }
  /** Drags a tool through points of space, with the mouse. */
  async cut(key, ...points) {
    const before = await this.state(),
      path = [];
    for (const p of points) path.push(await this.at(p));
    await this.page.keyboard.press(key);
    await drag(this.page, path, 6);
    // The report may come later than the state.
    await this.until(
      ([depth, cuts]) => window.kerf.state().undoDepth > depth && window.kerf.state().cuts > cuts,
      [before.undoDepth, before.cuts],
    );
    const { cut } = await this.state();
    console.log(`  cut: ${cut.pieces} piece(s), ${cut.triangles ?? ''} triangles, ${cut.totalMs.toFixed(1)} ms`);
  }
  /** The page's own picture. */
  async picture() {
    const data = await this.page.evaluate(async () => {
      const bytes = new Uint8Array(await (await window.kerf.app.picture()).arrayBuffer());
      let text = '';
      for (const b of bytes) text += String.fromCharCode(b);
      return btoa(text);
    });
    return `data:image/png;base64,${data}`;
  }
}

const wide = (columns) => Math.floor((kWidth - (columns - 1) * kGap) / columns);

/** Puts pictures in rows of equal columns with labels below. */
async function compose(number, columns, panels) {
  const file = join(out, `figure-${String(number).padStart(2, '0')}.png`);
  await withPage({ viewport: { width: kWidth, height: 2000 } }, async (page) => {
    await page.setContent(`<style>
      body { margin: 0; width: ${kWidth}px; background: #fff; font: 15px/1.4 "DejaVu Sans", sans-serif; color: #1b2127; }
      #all { display: grid; gap: ${kGap}px; grid-template-columns: repeat(${columns}, ${wide(columns)}px); padding-bottom: 4px; }
      figure { margin: 0; } img { display: block; width: 100%; } figcaption { text-align: center; }
      </style><div id="all">${panels.map(([label, src]) => `<figure><img src="${src}"><figcaption>${label}</figcaption></figure>`).join('')}</div>`);
    await page.waitForFunction(() => [...document.images].every((i) => i.complete));
    const shot = (await page.locator('#all').screenshot()).toString('base64');
    const pixels = await page.evaluate(async (png) => {
      const image = await createImageBitmap(await (await fetch(`data:image/png;base64,${png}`)).blob());
      const canvas = new OffscreenCanvas(image.width, image.height),
        context = canvas.getContext('2d');
      context.drawImage(image, 0, 0);
      const { data } = context.getImageData(0, 0, image.width, image.height);
      let text = '';
      for (const b of data) text += String.fromCharCode(b);
      return { width: image.width, height: image.height, data: btoa(text) };
    }, shot);
    const raw = Buffer.from(pixels.data, 'base64'),
      colours = new Set();
    for (let i = 0; i < raw.length; i += 4) colours.add(raw.readUInt32LE(i));
    if (colours.size < 30) throw new Error(`figure ${number} is empty: ${colours.size} colours`);
    const bytes = encodePng(pixels.width, pixels.height, raw);
    writeFileSync(file, bytes);
    console.log(`${file}: ${Math.round(bytes.length / 1000)} kB`);
  });
}

const figures = {
  1: async () => {
    const picture = await view('steak', scene('steak'), kWidth, 560, async (v) => {
      await v.start();
      await v.look(-108, 42, 0.33, [0, -0.012, -0.002]);
      await v.show('wireframe', 'collision', 'hexahedra');
      return v.picture();
    });
    await compose(1, 1, [['visual mesh black, collision mesh orange, hexahedra in colours', picture]]);
  },
  5: async () => {
    const panels = [];
    await view('steak67', scene('steak', 'collision_triangles = 67'), wide(2), 420, async (v) => {
      await v.start();
      await v.show('feet');
      await v.onlyTriangle([-0.02, -0.02]);
      const { target, size } = await v.triangle();
      await v.show('wireframe', 'collision', 'feet');
      await v.look(-128, 14, 2.0 * size, target);
      panels.push(['(a) to vertices green, edges blue, the triangle red', await v.picture()]);
      await v.show('wireframe', 'collision', 'bound', 'links');
      await v.look(-128, 40, 2.3 * size, target);
      panels.push(['(b) what is bound to vertices and edges: red; links blue', await v.picture()]);
    });
    await compose(5, 2, panels);
  },
  7: async () => {
    const panels = [];
    await view('steak67', scene('steak', 'collision_triangles = 67'), wide(3), 320, async (v) => {
      await v.start();
      await v.show('feet');
      for (const [label, side, azimuth, elevation] of [
        ['(a) both sides', 0, -128, 14],
        ['(b) the + side, laid out', 1, -90, 89.9],
        ['(c) the − side, laid out', -1, -90, -89.9],
      ]) {
        await v.onlyTriangle([-0.02, -0.02], side);
        const { target, size } = await v.triangle();
        await v.show('collision', 'feet', ...(side === 0 ? ['wireframe'] : []));
        await v.look(azimuth, elevation, 2.4 * size, target);
        panels.push([label, await v.picture()]);
      }
    });
    await compose(7, 3, panels);
  },
  14: async () => {
    const whole = [],
      near = [];
    for (const n of [67, 137]) {
      await view(`steak${n}`, scene('steak', `collision_triangles = ${n}`), wide(2), 360, async (v) => {
        await v.start();
        await v.look(-90, 62, 0.345, [0, -0.004, 0]);
        await v.show('wireframe', 'collision', 'hexahedra');
        whole.push([`(a) ${n} collision triangles`, await v.picture()]);
        await v.look(-90, 55, 0.15, [-0.03, -0.01, 0.005]);
        await v.show('collision', 'bound', 'links');
        near.push([`(b) close-up, ${n} collision triangles`, await v.picture()]);
      });
    }
    await compose(14, 2, [...whole, ...near]);
  },
  18: async () => {
    const panels = [];
    await view('sheet', scene('sheet', 'visual_triangles = 1664', -9.81), wide(2), 360, async (v) => {
      await v.start();
      await v.look(-112, 40, 1.95, [0.01, -0.03, -0.03]);
      await v.show('wireframe', 'hexahedra');
      panels.push(['(a) visual mesh and hexahedra before cutting', await v.picture()]);
      await v.cut('1', [-0.27, -0.3, 0], [0.28, 0.29, 0]);
      await v.cut('1', [-0.29, 0.27, 0], [0.27, -0.28, 0]);
      await v.play(0.5);
      for (const [text, ...views] of [
        ['(b) visual mesh and hexahedra after cutting', 'wireframe', 'hexahedra'],
        ['(c) collision mesh and hexahedra after cutting', 'collision', 'hexahedra'],
        ['(d) all three after cutting', 'wireframe', 'collision', 'hexahedra'],
      ]) {
        await v.show(...views);
        panels.push([text, await v.picture()]);
      }
    });
    await compose(18, 2, panels);
  },
  19: async () => {
    const rows = [[], [], []];
    for (const [vertices, triangles] of [
      [881, 1664],
      [3425, 6656],
      [13505, 26624],
      [53633, 106496],
    ].slice(0, quick ? 2 : 4)) {
      await view(
        `sheet${vertices}`,
        scene('sheet', `visual_triangles = ${triangles}`, -9.81),
        wide(4),
        200,
        async (v) => {
          await v.start();
          await v.look(-90, 89.9, 0.36, [0.02, 0.02, 0]);
          await v.show('wireframe', 'collision', 'bound', 'links');
          rows[0].push([`(a) ${vertices} vertices`, await v.picture()]);
          await v.look(-112, 48, 1.25, [0, 0, -0.05]);
          await v.show('wireframe', 'collision');
          rows[1].push([`(b) before`, await v.picture()]);
          await v.cut('1', [-0.27, -0.3, 0], [0.28, 0.29, 0]);
          await v.cut('1', [-0.29, 0.27, 0], [0.27, -0.28, 0]);
          await v.play(0.5);
          await v.show('wireframe', 'collision');
          rows[2].push([`(c) after`, await v.picture()]);
        },
      );
    }
    await compose(19, 4, rows.flat());
  },
  22: async () => {
    const panels = [];
    await view('meniscus', scene('meniscus'), wide(2), 400, async (v) => {
      await v.start();
      await v.look(-90, 55, 0.078, [0, 0.017, 0]);
      await v.show('wireframe', 'collision', 'hexahedra');
      panels.push(['(a) visual mesh, collision mesh, hexahedra', await v.picture()]);
      await v.look(-75, 50, 0.03, [0.004, 0.0065, 0]);
      await v.show('collision', 'bound', 'links');
      panels.push(['(b) bound vertices and edges red, links blue', await v.picture()]);
    });
    await compose(22, 2, panels);
  },
  23: async () => {
    const skin = [],
      middle = [];
    await view('meniscus', scene('meniscus', '', -9.81), wide(3), 260, async (v) => {
      await v.start();
      await v.look(90, 58, 0.076, [0, 0.0175, 0]);
      let n = 0;
      for (const x of [-0.0035, 0.0, 0.0035]) {
        await v.cut(
          '1',
          [x + 0.0019, 0.0165, 0],
          [x + 0.0017, 0.0115, 0],
          [x + 0.001, 0.0098, 0],
          [x, 0.0093, 0],
          [x - 0.001, 0.0098, 0],
          [x - 0.0017, 0.0115, 0],
          [x - 0.0019, 0.0165, 0],
        );
        await v.play(0.4);
        await v.show('shaded');
        skin.push([`(a) after punch ${++n}`, await v.picture()]);
        await v.show('collision');
        middle.push([`(b) after punch ${n}`, await v.picture()]);
      }
    });
    await compose(23, 3, [...skin, ...middle]);
  },
};

mkdirSync(out, { recursive: true });
try {
  for (const [number, make] of Object.entries(figures)) {
    if (only.length > 0 && !only.includes(number)) continue;
    console.log(`figure ${number}`);
    await make();
  }
} finally {
  rmSync(scratch, { recursive: true, force: true });
}
