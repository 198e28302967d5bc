// What the tests that speak to `kerf view` without a browser share: the server as a child, messages and frames by hand (docs/protocol.md).
import { spawn } from 'node:child_process';
import { randomBytes } from 'node:crypto';
import { readFileSync, readdirSync } from 'node:fs';
import net from 'node:net';

export const kProtocol = 7;
const kToken = 'token-of-this-test';

/** Numbers that a seed repeats: random() in [0, 1), below(n) in 0 .. n - 1. */
export function seeded(seed) {
  let state = seed >>> 0;
  const random = () => { state = (Math.imul(state, 1664525) + 1013904223) >>> 0; return state / 2 ** 32; };
  return { random, below: (n) => Math.floor(random() * n) };
}

/** Starts the server and waits until it listens. Where the page is not built, the test ends as skipped. */
export async function serve(program, args, env = process.env) {
  const child = spawn(program, ['view', ...args, '--port', '0', '--no-browser', '--token', kToken], { stdio: ['ignore', 'pipe', 'pipe'], env });
  process.on('exit', () => child.kill('SIGKILL'));  // a test that fails leaves none running
  const server = { child, port: 0, said: '', over: null };
  server.exited = new Promise((done) => child.on('exit', (code, signal) => { server.over = { code, signal }; done(server.over); }));
  child.stderr.on('data', (b) => { server.said += b; });
  server.port = await new Promise((found, failed) => {
    child.stdout.on('data', (b) => { server.said += b; const m = /http:\/\/127.0.0.1:(\d+)/.exec(server.said); if (m) found(Number(m[1])); });
    void server.exited.then(() => (/the page is not built/.test(server.said) ? process.exit(77) : failed(new Error(`kerf view ended: ${server.said}`))));
  });
  return server;
}
/** SIGTERM, and how it ended: { code: 0, signal: null } as it should. */
export function end(server) {
  server.child.kill('SIGTERM');
  return Promise.race([server.exited, new Promise((r) => setTimeout(() => r('it does not end'), 20000))]);
}
/** What the system says of a process: MiB in memory, threads, open descriptors. */
export function usage(pid) {
  const status = readFileSync(`/proc/${pid}/status`, 'utf8'), number = (key) => Number(new RegExp(`${key}:\\s+(\\d+)`).exec(status)[1]);
  return { megabytes: number('VmRSS') / 1024, threads: number('Threads'), descriptors: readdirSync(`/proc/${pid}/fd`).length };
}

// --- Messages and frames
export function message(type, body) {
  const b = Buffer.alloc(8 + body.length);
  b.writeUInt16LE(type, 0); b.writeUInt16LE(kProtocol, 2); b.writeUInt32LE(b.length, 4);
  body.copy(b, 8);
  return b;
}
export const u32s = (...v) => { const b = Buffer.alloc(4 * v.length); v.forEach((x, i) => b.writeUInt32LE(x >>> 0, 4 * i)); return b; };
export const f64s = (...v) => { const b = Buffer.alloc(8 * v.length); v.forEach((x, i) => b.writeDoubleLE(x, 8 * i)); return b; };
export const f32s = (...v) => { const b = Buffer.alloc(4 * v.length); v.forEach((x, i) => b.writeFloatLE(x, 4 * i)); return b; };
const text = (s) => { const b = Buffer.alloc(Math.ceil(s.length / 4) * 4); b.write(s); return b; };
export const hello = () => message(64, u32s(kProtocol, 0, 0, 0, 0, 0));
export const ack = (seq) => message(65, u32s(seq, 0));
/** `samples`: each [origin x y z, direction x y z]. */
export const toolMessage = (input, tool, phase, samples, { modifiers = 0, size = 0, pressure = 0 } = {}) =>
  message(66, Buffer.concat([u32s(input, tool, phase, modifiers, samples.length), f32s(size), ...samples.flatMap((ray) => [f64s(0, ...ray), f32s(pressure, 0)])]));
export const hover = (input, near, ray) => message(67, Buffer.concat([u32s(input), f32s(near), f64s(...ray)]));
export const command = (input, code, values = [0, 0, 0, 0], words = '') => message(68, Buffer.concat([u32s(input, code, words.length, 0), f64s(...values), text(words)]));
export const claim = (take) => message(69, u32s(take, 0));
export const upload = (number, part, name, offset, total, bytes) => message(70, Buffer.concat([u32s(number, part, name.length, offset, total, bytes.length), text(name), bytes]));

/** `claims`: the length that its head says, where that is a lie. */
export function frame(payload, opcode = 2, claims = payload.length) {
  const mask = randomBytes(4);
  const head = claims < 126 ? Buffer.from([0x80 | opcode, 0x80 | claims]) : claims < 65536 ? Buffer.from([0x80 | opcode, 0xfe, claims >> 8, claims & 255])
    : Buffer.from([0x80 | opcode, 0xff, 0, 0, 0, 0, claims >>> 24, (claims >> 16) & 255, (claims >> 8) & 255, claims & 255]);
  const body = Buffer.from(payload);
  for (let i = 0; i < body.length; i++) body[i] ^= mask[i & 3];
  return Buffer.concat([head, mask, body]);
}
export const upgrade = (port, key = randomBytes(16).toString('base64')) => `GET /engine?token=${kToken} HTTP/1.1\r\nHost: 127.0.0.1:${port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: ${key}\r\n\r\n`;

/** Sockets to one server; `open` has those that are. */
export class Connections {
  constructor(port) { this.port = port; this.open = new Set(); }
  connect(use) {
    const s = net.connect(this.port, '127.0.0.1', () => use?.(s));
    this.open.add(s);
    s.on('error', () => {});
    s.on('close', () => this.open.delete(s));
    return s;
  }
  /** A WebSocket; `then` gets a function that sends a message, and the socket. */
  socket(then, heard) {
    return this.connect((s) => {
      let begun = false, rest = Buffer.alloc(0);
      s.write(upgrade(this.port));
      s.on('data', (b) => {
        if (!begun) {
          rest = Buffer.concat([rest, b]);
          const last = rest.indexOf('\r\n\r\n');
          if (last < 0) return;
          begun = true;
          b = rest.subarray(last + 4);
          then((m, opcode) => { if (!s.destroyed) s.write(frame(m, opcode)); }, s);
        }
        heard?.(b, s);
      });
    });
  }
  /** A page that behaves: says Hello, answers pings, acknowledges frames. `then` gets a function that sends a message, `heard` type and bytes of each one. */
  page(then, heard) {
    let parts = [], length = 0, wanted = 2;
    return this.socket((send, s) => { send(hello()); then(send, s); }, (b, s) => {
      parts.push(b);
      length += b.length;
      if (length < wanted) return;  // a body comes in many pieces
      let buffer = Buffer.concat(parts);
      const keep = (more) => { parts = [buffer]; length = buffer.length; wanted = more; };
      for (;;) {
        if (buffer.length < 2) return keep(2);
        let n = buffer[1] & 127, at = 2;
        if (n === 126) { if (buffer.length < 4) return keep(4); n = buffer.readUInt16BE(2); at = 4; } else if (n === 127) { if (buffer.length < 10) return keep(10); n = Number(buffer.readBigUInt64BE(2)); at = 10; }
        if (buffer.length < at + n) return keep(at + n);
        const opcode = buffer[0] & 15, m = buffer.subarray(at, at + n);
        buffer = buffer.subarray(at + n);
        if (opcode === 9 && !s.destroyed) s.write(frame(m, 10));
        if (opcode !== 2 || m.length < 12) continue;
        const type = m.readUInt16LE(0);
        if (type === 4 && !s.destroyed) s.write(frame(ack(m.readUInt32LE(12))));
        heard(type, m);
      }
    });
  }
}

/** Of a list of milliseconds, in words. */
export function quantiles(list) {
  const sorted = [...list].sort((a, b) => a - b), at = (q) => sorted[Math.min(sorted.length - 1, Math.floor(q * sorted.length))] ?? NaN;
  return { median: at(0.5), p99: at(0.99), worst: sorted.at(-1) ?? NaN };
}
