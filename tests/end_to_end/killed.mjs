// `kill -9` at any moment of what writes files: `kerf run`, `bind`, `cut`, `make`, and `kerf view` while a page saves.
//   node tests/end_to_end/killed.mjs PROGRAM [KILLS] [SEED]
// Two variants of each command take turns in one folder and are killed: after a random time, or as a file there changes. What is there
// afterwards is compared with the files of runs that nobody killed: each is the old one or a new one, to the byte, or not there yet. A report says
// "running", or "complete" beside every file of its run and no other. What a page got is whole. The next command in the folder works and
// leaves nothing beside its files, and the next server none of the temporary folders. Exit status 0 if all that holds.
import assert from 'node:assert/strict';
import { spawn, spawnSync } from 'node:child_process';
import { existsSync, mkdirSync, mkdtempSync, readFileSync, readdirSync, rmSync, watch, writeFileSync } from 'node:fs';
import os from 'node:os';
import path from 'node:path';
import { Connections, command, end, seeded, serve } from './page_client.mjs';

const program = path.resolve(process.argv[2]), kills = Number(process.argv[3] ?? 60), seed = Number(process.argv[4] ?? 1);
const { random, below } = seeded(seed);
const root = mkdtempSync(path.join(os.tmpdir(), 'kerf_killed_'));
const inside = (...names) => path.join(root, ...names);
const pause = (milliseconds) => new Promise((r) => setTimeout(r, milliseconds));
process.on('exit', () => rmSync(root, { recursive: true, force: true }));

// --- What is written
const strip = (y, seconds, frames) => `[body]
model = "strip"
[simulation]
duration = ${seconds}
gravity = [0, 0, 0]
threads = 1
[output]
picture = false
positions = true
frames_per_second = ${frames}
[[command]]
at = 0.01
type = "blade"
frame = "rest"
poses = [{ time = 0.0, base = [${y}, -0.1, 0.1], tip = [${y}, -0.1, -0.1] }, { time = 0.02, base = [${y}, 0.1, 0.1], tip = [${y}, 0.1, -0.1] }]
`;
writeFileSync(inside('one.toml'), strip(0, 0.05, 200));
writeFileSync(inside('two.toml'), strip(0.03, 0.04, 100));
writeFileSync(inside('few.toml'), `${strip(0.03, 0.03, 100)}`.replace('positions = true', 'animation = false\nmeshes = ["visual"]'));
const tell = (...words) => {
  const { status, stdout, stderr } = spawnSync(program, words, { encoding: 'utf8' });
  assert.equal(status, 0, `kerf ${words.join(' ')}: ${stdout}${stderr}`);
  return stdout;
};
tell('make', 'steak', '-o', inside('steak'));
/** Variants of each command; they get the folder that they write into. Times of steps are in what is not the same twice. */
const kinds = {
  run: { variants: ['one', 'two', 'few'].map((scene) => (out) => ['run', inside(`${scene}.toml`), '-q', '-o', out, '--record', path.join(out, 'made.kerfrec')]), load: { 'made.kerfrec': 'replay' } },
  bind: { variants: [[], ['--exact']].map((more) => (out) => ['bind', 'sheet', '-q', '-o', path.join(out, 'body.kerf'), '--young', more.length ? '6000' : '5000', ...more]), load: { 'body.kerf': 'info' } },
  bindFiles: { variants: ['1', '0.5'].map((scale) => (out) => ['bind', inside('steak', 'visual.obj'), '-q', '--scale', scale, '-o', path.join(out, 'body.kerf'), '--write-collision', path.join(out, 'middle.obj'), '--diagnose', path.join(out, 'judged.ply')]),
    load: { 'body.kerf': 'info', 'middle.obj': 'info', 'judged.ply': 'info' } },
  cut: { variants: ['0', '0.03'].map((x) => (out) => ['cut', 'strip', '--from', `${x},-0.1,0`, '--to', `${x},0.1,0`, '-o', out]), load: { 'visual.obj': 'info' } },
  make: { variants: ['0', '0.001'].map((noise) => (out) => ['make', 'closed-sheet', '--visual-triangles', '30000', '--noise', noise, '--replace', '-o', out]), load: { 'visual.obj': 'info', 'scene.toml': 'info' } },
};
const timed = new Set(['report.json', 'steps.svg']), temporary = /\.kerf\.part-/;
const filesIn = (folder) => Object.fromEntries(readdirSync(folder).map((name) => [name, readFileSync(path.join(folder, name))]));
/** Of a variant that nobody kills: its files, how long it takes. */
function whole(variant, folder) {
  mkdirSync(folder);
  const words = variant(folder), start = performance.now();
  tell(...words);
  return { words, milliseconds: performance.now() - start, files: filesIn(folder) };
}
for (const [name, kind] of Object.entries(kinds)) {
  kind.whole = kind.variants.map((variant, i) => whole(variant, inside(`${name}-${i}`)));
  kind.folder = inside(name);
  mkdirSync(kind.folder);
  kind.whole.forEach((_, i) => { for (const [file, how] of Object.entries(kind.load)) if (existsSync(inside(`${name}-${i}`, file))) tell(how, inside(`${name}-${i}`, file)); });
  const [a, b] = kind.whole.map((w) => w.files);
  assert.ok(Object.keys(kind.load).some((file) => !a[file].equals(b[file])), `${name}: both variants write the same files`);
}

/** Is that a file as this run writes it? A series of frames is whole after each of them. */
function isOf(file, bytes, mine) {
  if (!file.endsWith('.pvd')) return mine.equals(bytes);
  const tail = '</Collection>\n</VTKFile>\n', text = bytes.toString();
  return text.endsWith(`/>\n${tail}`) && mine.toString().startsWith(text.slice(0, -tail.length));
}
/** Every file is of one variant; a report tells the truth. */
function look(name, kind) {
  const files = filesIn(kind.folder);
  for (const [file, bytes] of Object.entries(files)) {
    if (temporary.test(file)) continue;
    const among = kind.whole.filter((w) => w.files[file]);
    assert.ok(among.length > 0, `${name}: ${file} is nobody's`);
    if (file === 'steps.svg') assert.match(bytes.toString(), /^<svg[^]*<\/svg>\s*$/);
    else if (file !== 'report.json') assert.ok(among.some((w) => isOf(file, bytes, w.files[file])), `${name}: ${file} is neither the old one nor the new one, ${bytes.length} bytes`);
  }
  if (!files['report.json']) return 'none';
  const report = JSON.parse(files['report.json']);
  assert.ok(['running', 'complete'].includes(report.status), report.status);
  if (report.status === 'complete') {
    const mine = kind.whole.find((w) => JSON.parse(w.files['report.json']).state_hash === report.state_hash);
    assert.ok(mine, `${name}: a report of no run`);
    isAll(name, files, mine, report.files);
  }
  return report.status;
}
/** These are the files of that variant, and no others. */
function isAll(name, files, mine, listed = []) {
  for (const file of listed) assert.ok(files[file], `${name}: the report is complete and names ${file}, which is missing`);
  const names = (all) => Object.keys(all).filter((file) => !temporary.test(file) && file !== 'made.kerfrec').sort();
  assert.deepEqual(names(files), names(mine.files), name);
  for (const file of names(files)) if (!timed.has(file)) assert.ok(files[file].equals(mine.files[file]), `${name}: complete, and ${file} is of another run`);
}

/** Kills after a random time of `most` ms, or at the n-th change of a file in the folder. Returns a function that calls it off. */
function killer(child, folder, most, changes) {
  const kill = () => { child.kill('SIGKILL'); };
  if (below(2)) { const timer = setTimeout(kill, random() * most); return () => clearTimeout(timer); }
  let left = below(changes);
  const seen = watch(folder, () => { if (left-- === 0) kill(); });
  return () => seen.close();
}
const count = {}, reports = {};
/** One kill, of a variant at random. */
async function strike(name, kind) {
  const mine = kind.variants[below(kind.variants.length)](kind.folder), w = kind.whole[0];
  const child = spawn(program, mine, { stdio: ['ignore', 'ignore', 'pipe'] });
  let said = '';
  child.stderr.on('data', (b) => { said += b; });
  const off = killer(child, kind.folder, 1.1 * w.milliseconds, 8 * Object.keys(w.files).length);
  const [code, signal] = await new Promise((r) => child.on('exit', (...how) => r(how)));
  off();
  assert.ok(signal === 'SIGKILL' || code === 0, `${name} ended by itself with ${code}: ${said}`);
  if (signal) count[name] = (count[name] ?? 0) + 1;
  const status = look(name, kind);
  if (!signal && status !== 'none') assert.equal(status, 'complete', `${name} came to its end`);
  reports[status] = (reports[status] ?? 0) + 1;
  if (below(6) === 0) finish(name, kind);
  if (below(6) === 0) for (const file of readdirSync(kind.folder)) rmSync(path.join(kind.folder, file));
}
/** The next command works, whatever lies there. */
function finish(name, kind) {
  const i = below(kind.variants.length);
  tell(...kind.variants[i](kind.folder));
  const files = filesIn(kind.folder), last = kind.whole[i];
  for (const file of Object.keys(files)) assert.ok(!temporary.test(file), `${name}: ${file} is left over`);
  if (files['report.json']) isAll(name, files, last);
  for (const file of Object.keys(last.files)) if (!timed.has(file)) assert.ok(files[file].equals(last.files[file]), `${name}: ${file} after a run that nobody killed`);
}

// --- Saves from a page
writeFileSync(inside('still.toml'), '[body]\nmodel = "strip"\n[simulation]\ngravity = [0, 0, 0]\n[[fix]]\nsphere = { center = [0, 0, 0], radius = 10 }\n');
mkdirSync(inside('page'));
writeFileSync(inside('page', 'index.html'), '<!doctype html>');
mkdirSync(inside('tmp'));
const environment = { ...process.env, TMPDIR: inside('tmp') };
const wishes = [[11, 'obj', 2], [11, 'vtu', 1], [11, 'scene', 1], [12, '', 1]];
/** A page asks for every kind of file again and again, and is told `got(name, bytes)`. Resolves as the first comes. */
function savingPage(server, got) {
  return new Promise((first) => {
    let input = 0, send = null, asked = 0, due = 0;
    const ask = () => { const [code, words, answers] = wishes[asked++ % wishes.length]; due += answers; if (code === 12) send(command(++input, code, [1, 0, 0, 0])); send(command(++input, code, [0, 0, 0, 0], words)); };
    new Connections(server.port).page((s) => { send = s; ask(); }, (type, m) => {
      if (type !== 11) return;
      const nameBytes = m.readUInt32LE(12), bytes = m.readUInt32LE(16), at = 24 + Math.ceil(nameBytes / 4) * 4;
      got(m.toString('utf8', 24, 24 + nameBytes), Buffer.from(m.subarray(at, at + bytes)));
      first();
      if (--due === 0) ask();
    });
  });
}
const isRecording = (name) => name.endsWith('.kerfrec');
const serveStill = () => serve(program, [inside('still.toml'), '--page', inside('page')], environment);
const saved = {};
async function firstSaves() {
  const server = await serveStill();
  await savingPage(server, (name, bytes) => { saved[name] = bytes; });
  for (let i = 0; i < 200 && Object.keys(saved).length < 5; i++) await pause(10);
  assert.equal(Object.keys(saved).length, 5, `the page got ${Object.keys(saved)}`);
  assert.deepEqual(await end(server), { code: 0, signal: null });
  assert.deepEqual(readdirSync(inside('tmp')), [], 'a server that ends leaves nothing');
}
let pageFiles = 0, lastRecording = null;
async function strikeSave() {
  const server = await serveStill();
  const arrive = savingPage(server, (name, bytes) => {
    pageFiles++;
    if (isRecording(name)) lastRecording = bytes;
    else assert.ok(saved[name]?.equals(bytes), `the page's ${name} is another, ${bytes.length} bytes`);
  });
  if (below(2)) await arrive;
  const off = killer(server.child, inside('tmp'), 40, 6);
  const late = setTimeout(() => server.child.kill('SIGKILL'), 2000);
  const how = await server.exited;
  off();
  clearTimeout(late);
  assert.equal(how.signal, 'SIGKILL', `${JSON.stringify(how)} ${server.said}`);
  count.view = (count.view ?? 0) + 1;
}

await firstSaves();
const names = [...Object.keys(kinds), 'view'];
const total = () => Object.values(count).reduce((a, b) => a + b, 0);
for (let turn = 0; total() < kills; turn++) {
  const name = turn < names.length ? names[turn] : names[below(names.length)];
  if (name === 'view') await strikeSave();
  else await strike(name, kinds[name]);
}
for (const [name, kind] of Object.entries(kinds)) finish(name, kind);
await firstSaves();
if (lastRecording) {
  writeFileSync(inside('last.kerfrec'), lastRecording);
  tell('replay', inside('last.kerfrec'));
}
console.log(`${total()} kills (${Object.entries(count).map(([name, n]) => `${name} ${n}`).join(', ')}), seed ${seed}; reports after them: ${Object.entries(reports).map(([s, n]) => `${s} ${n}`).join(', ')}; a page got ${pageFiles} whole files`);
process.exit(0);
