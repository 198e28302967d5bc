// The figures of docs/figures.md, small and quick: does each still come about?
//   node tests/end_to_end/figures.mjs PROGRAM OUT
// Status 77: node_modules, the built page or Chromium is missing.
import { spawn } from 'node:child_process';
import { existsSync, readdirSync, rmSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';

const viewer = fileURLToPath(new URL('../../apps/viewer/', import.meta.url));
const skip = (why) => { console.log(`skipped: ${why}`); process.exit(77); };
if (!existsSync(join(viewer, 'node_modules/playwright-core'))) skip('no node_modules in apps/viewer (npm ci)');
if (!existsSync(process.env.CHROMIUM ?? '/usr/bin/chromium')) skip('no Chromium');
const out = resolve(process.argv[3] ?? 'out/figures-test');
rmSync(out, { recursive: true, force: true });
const run = spawn(process.execPath, [join(viewer, 'scripts/figures.mjs'), '--quick', '--kerf', resolve(process.argv[2]), '--out', out], { stdio: 'inherit' });
const code = await new Promise((r) => { run.on('exit', (c, signal) => r(c ?? signal)); });
if (code !== 0) process.exit(code === 77 ? 77 : 1);
const made = readdirSync(out).sort(), wanted = [1, 5, 7, 14, 18, 19, 22, 23].map((n) => `figure-${String(n).padStart(2, '0')}.png`);
if (made.join() !== wanted.join()) { console.log(`made ${made.join(' ')} instead of ${wanted.join(' ')}`); process.exit(1); }
