// Clients without manners against `kerf view`, while one page that behaves looks on:
//   node tests/end_to_end/rude_clients.mjs PROGRAM [SECONDS] [SEED]
// Half-open sockets, floods of garbage, good frames with bad messages, random messages that decode, connections by the thousand,
// reconnect storms, readers that never read, sockets reset in the middle. The server must go on answering the good
// page in time, use bounded memory, and end cleanly on SIGTERM. Exit status 0 if it does. With a program built with sanitizers their
// findings end it, which is seen here too.
import assert from 'node:assert/strict';
import { randomBytes } from 'node:crypto';
import { Connections, claim, command, end, frame, hello, hover, message, quantiles, seeded, serve, toolMessage, u32s, f32s, f64s, upgrade, upload, usage } from './page_client.mjs';

const program = process.argv[2], seconds = Number(process.argv[3] ?? 5);
const { random, below } = seeded(Number(process.argv[4] ?? 1));
const server = await serve(program, ['trainer']);
const port = server.port, connections = new Connections(port), open = connections.open, done = {};
const connect = (use) => connections.connect(use), socket = (then, heard) => connections.socket(then, heard);

// --- Messages
const ray = () => {
  const o = [0.06 * (random() - 0.5), 0.06 * (random() - 0.5), 0.05 + 0.1 * random()], to = [0.05 * (random() - 0.5), 0.035 * random(), 0];
  const d = to.map((x, i) => x - o[i]);
  return [...o, ...d];
};
const tool = (input, code, phase, size) => toolMessage(input, code, phase, [ray()], { modifiers: below(16), size, pressure: random() });
function anyMessage(input) {
  switch (below(9)) {
    case 0: return tool(input, below(12), below(5), random() < 0.2 ? 0 : 0.005 * random());
    case 1: return tool(input, below(11), below(3), 0.002);
    case 2: return hover(input, 0.01 * random(), ray());
    case 3: return command(input, 1 + below(19), [below(3), random(), 0.4 * random(), 1000 * random()], ['obj', 'vtu', 'abcd', 'scen'][below(4)]);
    case 4: return claim(below(3));
    case 5: return upload(below(3), below(4), 'a.ob', below(2) * 100, below(2000), randomBytes(4 * below(200)));
    case 6: return message(71, Buffer.concat([u32s(input, below(2)), f64s(0.02 * random(), 0.03 * random(), 0.01 * random(), random(), 3 * random(), 0, below(2))]));
    case 7: return message(65, u32s(below(10000), 0));
    default: return randomBytes(below(300));
  }
}

// --- The rude ones, each a short scene
const scenes = {
  halfOpen() { const s = connect(() => { if (below(2)) s.write('GET / HTT'); }); },
  halfHandshake() { const s = connect(() => { s.write(upgrade(port, 'dGhlIHNhbXBsZSBub25jZQ==').slice(0, below(150))); if (below(2)) s.resetAndDestroy(); }); },
  noise() { const s = connect(() => { s.write(randomBytes(below(200000))); setTimeout(() => s.destroy(), below(200)); }); },
  bigHeader() { const s = connect(() => { s.write(`GET / HTTP/1.1\r\nHost: 127.0.0.1:${port}\r\nX: ${'x'.repeat(100000)}`); }); },
  pipeline() { const s = connect(() => { s.write(`GET / HTTP/1.1\r\nHost: 127.0.0.1:${port}\r\n\r\n`.repeat(200)); setTimeout(() => s.destroy(), below(100)); }); },
  crowd() { for (let i = 0; i < 200; i++) connect((s) => { if (below(3) === 0) s.resetAndDestroy(); }); },
  storm() { for (let i = 0; i < 40; i++) socket((send, s) => { send(hello()); if (below(2)) s.resetAndDestroy(); else s.end(); }); },
  badFrames() { socket((send, s) => { s.write(randomBytes(1 + below(5000))); }); },
  hugeFrame() { socket((send, s) => { s.write(Buffer.from([0x82, 0xff, 0x7f, 255, 255, 255, 255, 255, 255, 255, 0, 0, 0, 0])); s.write(randomBytes(1000)); }); },
  texts() { socket((send) => { send(hello()); for (let i = 0; i < 120; i++) send(Buffer.from('hello'), 1 + below(15)); }); },
  garbage() { socket((send) => { send(hello()); for (let i = 0; i < 150; i++) send(randomBytes(below(400))); }); },
  chatter() { socket((send, s) => { send(hello()); send(claim(1)); for (let i = 0; i < 300; i++) send(anyMessage(i)); if (below(2)) setTimeout(() => s.resetAndDestroy(), below(50)); }); },
  neverReads() { const s = socket((send) => { send(hello()); s.pause(); for (let i = 0; i < 100; i++) send(command(i, 11, [0, 0, 0, 0], 'obj')); }); },
  mutesMidway() { socket((send, s) => { send(hello()); const f = frame(anyMessage(1)); s.write(f.subarray(0, below(f.length))); }); },
};
for (const name of Object.keys(scenes)) done[name] = 0;

// --- The good page: asks what its ray meets, every 50 ms
const waits = [];
let good = null, ending = false;
let asked = 0, answered = 0, since = 0, lost = 0;
function behave() {
  const s = good = connections.page((send) => {
    const timer = setInterval(() => {
      if (s.destroyed) return clearInterval(timer);
      if (asked > answered) return;
      asked++;
      since = performance.now();
      send(hover(asked, 0, [0, 0.02, 0.1, 0, 0, -1]));
    }, 50);
  }, (type, m) => { if (type === 5 && m.readUInt32LE(8) === asked) { answered = asked; waits.push(performance.now() - since); } });
  s.on('close', () => { if (!server.over && !ending) { lost++; answered = asked; setTimeout(behave, 100); } });
}
behave();
await new Promise((r) => setTimeout(r, 500));
const names = Object.keys(scenes), until = Date.now() + 1000 * seconds;
let most = 0, turn = 0;
while (Date.now() < until && !server.over) {
  const name = turn < names.length ? names[turn] : names[below(names.length)];
  turn++;
  scenes[name]();
  done[name]++;
  most = Math.max(most, usage(server.child.pid).megabytes);
  await new Promise((r) => setTimeout(r, below(30)));
  for (const s of open) {
    if (open.size <= 600) break;
    if (s !== good) { s.destroy(); open.delete(s); }
  }
}
assert.equal(server.over, null, `the server ended: ${JSON.stringify(server.over)}\n${server.said}`);
const before = waits.length;
await new Promise((r) => setTimeout(r, 3000));
for (const s of open) if (s !== good && below(2)) s.destroy();
const page = await fetch(`http://127.0.0.1:${port}/`);
assert.equal(page.status, 200);
await page.text();
assert.ok(waits.length > before, 'the good page hears nothing any more');
ending = true;
const memory = usage(server.child.pid).megabytes;
const last = await end(server);
assert.deepEqual(last, { code: 0, signal: null }, `${JSON.stringify(last)}\n${server.said}`);
const { median, p99 } = quantiles(waits);
console.log(`${turn} scenes (${names.map((n) => `${n} ${done[n]}`).join(', ')}); the good page was answered ${waits.length} times, median ${median.toFixed(1)} ms, 99 % ${p99.toFixed(1)} ms, lost ${lost} times; memory ${most.toFixed(0)} MiB at most, ${memory.toFixed(0)} at the end`);
process.exit(0);
