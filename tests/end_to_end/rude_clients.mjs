// Clients without manners against `kerf view`, while one page that behaves looks on:
//   node tests/end_to_end/rude_clients.mjs PROGRAM [SECONDS] [SEED]
// Half-open sockets, floods of garbage, good frames with bad messages, random messages that decode, connections by the thousand,
// reconnect storms, readers that never read, sockets reset in the middle. The server must go on answering the good
// page in time, use bounded memory, and end cleanly on SIGTERM. Exit status 0 if it does. With a program built with sanitizers their
// findings end it, which is seen here too.
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { randomBytes } from 'node:crypto';
import { readFileSync } from 'node:fs';
import net from 'node:net';

const program = process.argv[2], seconds = Number(process.argv[3] ?? 5);
let seed = Number(process.argv[4] ?? 1) >>> 0;
const random = () => { seed = (Math.imul(seed, 1664525) + 1013904223) >>> 0; return seed / 2 ** 32; };
const below = (n) => Math.floor(random() * n);
const kProtocol = 5;

// --- The server
const child = spawn(program, ['view', 'trainer', '--port', '0', '--no-browser', '--token', 'token-of-this-test'], { stdio: ['ignore', 'pipe', 'pipe'] });
let said = '', over = null;
const exited = new Promise((done) => child.on('exit', (code, signal) => { over = { code, signal }; done(over); }));
child.stderr.on('data', (b) => { said += b; });
const port = await new Promise((found, failed) => {
  child.stdout.on('data', (b) => { said += b; const m = /http:\/\/127.0.0.1:(\d+)/.exec(said); if (m) found(Number(m[1])); });
  void exited.then(() => (/the page is not built/.test(said) ? process.exit(77) : failed(new Error(`kerf view ended: ${said}`))));
});
const megabytes = () => Number(/VmRSS:\s+(\d+)/.exec(readFileSync(`/proc/${child.pid}/status`, 'utf8'))[1]) / 1024;

// --- Messages and frames, by hand
function message(type, body) {
  const b = Buffer.alloc(8 + body.length);
  b.writeUInt16LE(type, 0); b.writeUInt16LE(kProtocol, 2); b.writeUInt32LE(b.length, 4);
  body.copy(b, 8);
  return b;
}
const u32s = (...v) => { const b = Buffer.alloc(4 * v.length); v.forEach((x, i) => b.writeUInt32LE(x >>> 0, 4 * i)); return b; };
const f64s = (...v) => { const b = Buffer.alloc(8 * v.length); v.forEach((x, i) => b.writeDoubleLE(x, 8 * i)); return b; };
const f32s = (...v) => { const b = Buffer.alloc(4 * v.length); v.forEach((x, i) => b.writeFloatLE(x, 4 * i)); return b; };
const hello = () => message(64, u32s(kProtocol, 0, 0, 0, 0, 0));
const ray = () => {
  const o = [0.06 * (random() - 0.5), 0.06 * (random() - 0.5), 0.05 + 0.1 * random()], to = [0.05 * (random() - 0.5), 0.035 * random(), 0];
  const d = to.map((x, i) => x - o[i]);
  return f64s(...o, ...d);
};
const tool = (input, code, phase, size) => message(66, Buffer.concat([u32s(input, code, phase, below(16), 1), f32s(size), f64s(0), ray(), f32s(random(), 0)]));
function anyMessage(input) {
  switch (below(9)) {
    case 0: return tool(input, below(12), below(5), random() < 0.2 ? 0 : 0.005 * random());
    case 1: return tool(input, below(11), below(3), 0.002);
    case 2: return message(67, Buffer.concat([u32s(input), f32s(0.01 * random()), ray()]));
    case 3: return message(68, Buffer.concat([u32s(input, 1 + below(19), 4, 0), f64s(below(3), random(), 0.4 * random(), 1000 * random()), Buffer.from(['obj\0', 'vtu\0', 'abcd', 'scen'][below(4)])]));
    case 4: return message(69, u32s(below(3), 0));
    case 5: { const bytes = randomBytes(4 * below(200)); return message(70, Buffer.concat([u32s(below(3), below(4), 4, below(2) * 100, below(2000), bytes.length), Buffer.from('a.ob'), bytes])); }
    case 6: return message(71, Buffer.concat([u32s(input, below(2)), f64s(0.02 * random(), 0.03 * random(), 0.01 * random(), random(), 3 * random(), 0, below(2))]));
    case 7: return message(65, u32s(below(10000), 0));
    default: return randomBytes(below(300));
  }
}
function frame(payload, opcode = 2) {
  const mask = randomBytes(4), n = payload.length;
  const head = n < 126 ? Buffer.from([0x80 | opcode, 0x80 | n]) : n < 65536 ? Buffer.from([0x80 | opcode, 0xfe, n >> 8, n & 255])
    : Buffer.from([0x80 | opcode, 0xff, 0, 0, 0, 0, n >>> 24, (n >> 16) & 255, (n >> 8) & 255, n & 255]);
  const body = Buffer.from(payload);
  for (let i = 0; i < n; i++) body[i] ^= mask[i & 3];
  return Buffer.concat([head, mask, body]);
}
const upgrade = (key) => `GET /engine?token=token-of-this-test HTTP/1.1\r\nHost: 127.0.0.1:${port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: ${key}\r\n\r\n`;

const open = new Set(), done = {};
function connect(use) {
  const s = net.connect(port, '127.0.0.1', () => use(s));
  open.add(s);
  s.on('error', () => {});
  s.on('close', () => open.delete(s));
  return s;
}
/** A WebSocket; `then` gets a function that sends a message. */
function socket(then, heard) {
  return connect((s) => {
    let begun = false, rest = Buffer.alloc(0);
    s.write(upgrade(randomBytes(16).toString('base64')));
    s.on('data', (b) => {
      if (!begun) {
        rest = Buffer.concat([rest, b]);
        const end = rest.indexOf('\r\n\r\n');
        if (end < 0) return;
        begun = true;
        b = rest.subarray(end + 4);
        then((m, opcode) => { if (!s.destroyed) s.write(frame(m, opcode)); }, s);
      }
      heard?.(b);
    });
  });
}

// --- The rude ones, each a short scene
const scenes = {
  halfOpen() { const s = connect(() => { if (below(2)) s.write('GET / HTT'); }); },
  halfHandshake() { const s = connect(() => { s.write(upgrade('dGhlIHNhbXBsZSBub25jZQ==').slice(0, below(150))); if (below(2)) s.resetAndDestroy(); }); },
  noise() { const s = connect(() => { s.write(randomBytes(below(200000))); setTimeout(() => s.destroy(), below(200)); }); },
  bigHeader() { const s = connect(() => { s.write(`GET / HTTP/1.1\r\nHost: 127.0.0.1:${port}\r\nX: ${'x'.repeat(100000)}`); }); },
  pipeline() { const s = connect(() => { s.write(`GET / HTTP/1.1\r\nHost: 127.0.0.1:${port}\r\n\r\n`.repeat(200)); setTimeout(() => s.destroy(), below(100)); }); },
  crowd() { for (let i = 0; i < 200; i++) connect((s) => { if (below(3) === 0) s.resetAndDestroy(); }); },
  storm() { for (let i = 0; i < 40; i++) socket((send, s) => { send(hello()); if (below(2)) s.resetAndDestroy(); else s.end(); }); },
  badFrames() { socket((send, s) => { s.write(randomBytes(1 + below(5000))); }); },
  hugeFrame() { socket((send, s) => { s.write(Buffer.from([0x82, 0xff, 0x7f, 255, 255, 255, 255, 255, 255, 255, 0, 0, 0, 0])); s.write(randomBytes(1000)); }); },
  texts() { socket((send) => { send(hello()); for (let i = 0; i < 120; i++) send(Buffer.from('hello'), 1 + below(15)); }); },
  garbage() { socket((send) => { send(hello()); for (let i = 0; i < 150; i++) send(randomBytes(below(400))); }); },
  chatter() { socket((send, s) => { send(hello()); send(message(69, u32s(1, 0))); for (let i = 0; i < 300; i++) send(anyMessage(i)); if (below(2)) setTimeout(() => s.resetAndDestroy(), below(50)); }); },
  neverReads() { const s = socket((send) => { send(hello()); s.pause(); for (let i = 0; i < 100; i++) send(message(68, Buffer.concat([u32s(i, 11, 4, 0), f64s(0, 0, 0, 0), Buffer.from('obj\0')]))); }); },
  mutesMidway() { socket((send, s) => { send(hello()); const f = frame(anyMessage(1)); s.write(f.subarray(0, below(f.length))); }); },
};
for (const name of Object.keys(scenes)) done[name] = 0;

// --- The good page: asks what its ray meets, every 50 ms
const waits = [];
let good = null, ending = false;
let asked = 0, answered = 0, since = 0, lost = 0;
function behave() {
  let buffer = Buffer.alloc(0);
  const s = good = socket((send) => {
    send(hello());
    const timer = setInterval(() => {
      if (s.destroyed) return clearInterval(timer);
      if (asked > answered) return;
      asked++;
      since = performance.now();
      send(message(67, Buffer.concat([u32s(asked, 0), f64s(0, 0.02, 0.1, 0, 0, -1)])));
    }, 50);
  }, (b) => {
    buffer = Buffer.concat([buffer, b]);
    for (;;) {
      if (buffer.length < 2) return;
      let n = buffer[1] & 127, at = 2;
      if (n === 126) { if (buffer.length < 4) return; n = buffer.readUInt16BE(2); at = 4; } else if (n === 127) { if (buffer.length < 10) return; n = Number(buffer.readBigUInt64BE(2)); at = 10; }
      if (buffer.length < at + n) return;
      const opcode = buffer[0] & 15, m = buffer.subarray(at, at + n);
      buffer = buffer.subarray(at + n);
      if (opcode === 9) s.write(frame(m, 10));
      if (opcode !== 2 || m.length < 12) continue;
      if (m.readUInt16LE(0) === 4) s.write(frame(message(65, u32s(m.readUInt32LE(12), 0))));
      if (m.readUInt16LE(0) === 5 && m.readUInt32LE(8) === asked) { answered = asked; waits.push(performance.now() - since); }
    }
  });
  s.on('close', () => { if (!over && !ending) { lost++; answered = asked; setTimeout(behave, 100); } });
}
behave();
await new Promise((r) => setTimeout(r, 500));
const names = Object.keys(scenes), until = Date.now() + 1000 * seconds;
let most = 0, turn = 0;
while (Date.now() < until && !over) {
  const name = turn < names.length ? names[turn] : names[below(names.length)];
  turn++;
  scenes[name]();
  done[name]++;
  most = Math.max(most, megabytes());
  await new Promise((r) => setTimeout(r, below(30)));
  for (const s of open) {
    if (open.size <= 600) break;
    if (s !== good) { s.destroy(); open.delete(s); }
  }
}
assert.equal(over, null, `the server ended: ${JSON.stringify(over)}\n${said}`);
const before = waits.length;
await new Promise((r) => setTimeout(r, 3000));
for (const s of open) if (s !== good && below(2)) s.destroy();
const page = await fetch(`http://127.0.0.1:${port}/`);
assert.equal(page.status, 200);
await page.text();
assert.ok(waits.length > before, 'the good page hears nothing any more');
ending = true;
const memory = megabytes();
child.kill('SIGTERM');
const last = await Promise.race([exited, new Promise((r) => setTimeout(() => r('it does not end'), 20000))]);
assert.deepEqual(last, { code: 0, signal: null }, `${JSON.stringify(last)}\n${said}`);
waits.sort((a, b) => a - b);
const at = (q) => waits[Math.min(waits.length - 1, Math.floor(q * waits.length))].toFixed(1);
console.log(`${turn} scenes (${names.map((n) => `${n} ${done[n]}`).join(', ')}); the good page was answered ${waits.length} times, median ${at(0.5)} ms, 99 % ${at(0.99)} ms, lost ${lost} times; memory ${most.toFixed(0)} MiB at most, ${memory.toFixed(0)} at the end`);
process.exit(0);
