// Clients that hang on to `kerf view`, all together, beside one page that cuts:
//   node tests/end_to_end/hanging_clients.mjs PROGRAM [SECONDS] [SEED]
// Slow ones read or write a byte a second, silent ones say nothing, lying ones announce more than they send, vanishing ones go in the middle of a
// frame, of an upload, of a stroke. The page measures stroke to patch, first alone, then beside them: it is never disconnected, and is answered in
// time. Memory, threads and descriptors of the server are bounded, and fall back when they have gone. In longer runs the server itself ends those
// that say nothing. Exit status 0 if all that holds.
import assert from 'node:assert/strict';
import { randomBytes } from 'node:crypto';
import { Connections, claim, command, end, frame, hello, quantiles, seeded, serve, toolMessage, upgrade, upload, usage } from './page_client.mjs';

const program = process.argv[2], seconds = Number(process.argv[3] ?? 5), seed = Number(process.argv[4] ?? 1);
const { random, below } = seeded(seed);
const pause = (milliseconds) => new Promise((r) => setTimeout(r, milliseconds));
const server = await serve(program, ['trainer']);
const good = new Connections(server.port), rude = new Connections(server.port);

// --- The page that behaves: cuts across the body, takes the cut back, and so on
let phase = 'alone', ending = false, lost = 0, stolen = 0, missed = 0;
const strokes = { alone: [], beside: [] }, undos = { alone: [], beside: [] };
/** Cuts until it is lost. Waits for the answer to each input. */
function behave() {
  let input = 1000, awaited = null;
  const told = (answer) => { const waiting = awaited; awaited = null; waiting?.answered(answer); };
  const s = good.page(async (send) => {
    /** What came back: 'patch', 'nothing' or 'stolen'. */
    const ask = (make, types) => new Promise((answered) => { awaited = { input: ++input, types, answered }; for (const m of make(input)) send(m); });
    const ray = (x, y) => [x, y, 0.1, 0, 0, -1];  // into the thin rim from inside
    while (!s.destroyed && !ending) {
      let since = performance.now();
      const list = phase, x = 0.004 * (random() - 0.5);
      const cut = await ask((n) => [toolMessage(n, 0, 0, [ray(x, 0.011)]), toolMessage(n, 0, 1, [ray(x, 0.015)]), toolMessage(n, 0, 2, [ray(x, 0.018)])], [3, 7]);
      if (cut === 'patch') strokes[list].push(performance.now() - since);
      else if (cut === 'stolen') { stolen++; send(claim(1)); }
      else { missed++; send(command(++input, 5)); }  // strokes of those that vanished have moved or cut what lay there: from the start again
      since = performance.now();
      if (cut === 'patch' && await ask((n) => [command(n, 6)], [3]) === 'patch') undos[list].push(performance.now() - since);
      await pause(20);
    }
  }, (type, m) => {
    if (!awaited) return;
    if (type === 9 && m.readUInt32LE(8) === awaited.input) told(m.readUInt32LE(12) === 3 ? 'stolen' : 'nothing');
    else if (type === 3 && awaited.types.includes(3) && m.readUInt32LE(20) === awaited.input) told('patch');
    else if (type === 7 && awaited.types.includes(7) && m.readUInt32LE(8) === awaited.input) told('nothing');
    else if (type === 8 && m.readUInt32LE(12) === 0) told('stolen');
  });
  s.on('close', () => { if (!server.over && !ending) { lost++; setTimeout(behave, 100); } });
}

// --- The others. Each says how many milliseconds it stays; what is silent stays until the server ends it.
const kForever = Infinity;
const drip = (s, bytes) => { let at = 0; const timer = setInterval(() => { if (s.destroyed || at >= bytes.length) return clearInterval(timer); s.write(bytes.subarray(at, ++at)); }, 1000); };
const sip = (s) => { s.pause(); const timer = setInterval(() => { if (s.destroyed) return clearInterval(timer); s.read(1); }, 1000); };
const line = (words) => Buffer.from(`${words}\r\nHost: 127.0.0.1:${server.port}\r\n`);
const stroke = (n) => toolMessage(n, 0, 0, [[0.02 * (random() - 0.5), 0.016, 0.1, 0, 0, -1]]);
const vanish = (s) => { if (below(2)) s.resetAndDestroy(); else s.destroy(); };
const scenes = {
  slowReader: () => rude.socket((send, s) => { send(hello()); for (let i = 0; i < 20; i++) send(command(i, 11, [0, 0, 0, 0], 'obj')); sip(s); }),
  slowPage: () => rude.connect((s) => { s.write(Buffer.concat([line('GET / HTTP/1.1'), Buffer.from('\r\n')])); sip(s); }),
  slowRequest: () => rude.connect((s) => drip(s, line('GET / HTTP/1.1'))),
  slowFrame: () => rude.socket((send, s) => { send(hello()); drip(s, frame(randomBytes(300))); }),
  silent: () => rude.connect(),
  silentSocket: () => rude.connect((s) => { s.write(upgrade(server.port)); s.resume(); }),
  silentPage: () => rude.socket((send) => send(hello())),
  lyingFrame: () => rude.socket((send, s) => { send(hello()); s.write(frame(randomBytes(10), 2, 70000 + below(900000))); }),
  lyingLength: () => rude.connect((s) => s.write(Buffer.concat([line(below(2) ? 'POST / HTTP/1.1' : 'GET / HTTP/1.1'), Buffer.from(`Content-Length: ${below(2) ? 1000000000 : -1}\r\n\r\n0123456789`)]))),
  lyingMessage: () => rude.socket((send) => { send(hello()); const m = command(1, 2); m.writeUInt32LE(1 << 30, 4); send(m); }),
  lyingUpload: () => rude.socket((send) => { send(hello()); send(upload(1, 0, 'a.obj', 0, 1e9, randomBytes(10))); send(command(2, 14)); }),
  lyingChunk: () => rude.socket((send) => { send(hello()); const m = upload(1, 0, 'a.obj', 0, 1e6, randomBytes(12)); m.writeUInt32LE(1e6, 28); send(m); }),
  vanishingUpload: () => rude.socket((send, s) => { send(hello()); for (let i = 0; i < 20; i++) send(upload(7, 0, 'a.obj', 48000 * i, 2e6, randomBytes(48000))); setTimeout(() => vanish(s), below(100)); }),
  vanishingFrame: () => rude.socket((send, s) => { send(hello()); const f = frame(upload(7, 0, 'a.obj', 0, 2e6, randomBytes(48000))); s.write(f.subarray(0, below(f.length))); setTimeout(() => vanish(s), below(100)); }),
  vanishingStroke: () => rude.socket((send, s) => { send(hello()); send(claim(1)); send(stroke(1)); setTimeout(() => vanish(s), below(100)); }),
};
const names = Object.keys(scenes), done = Object.fromEntries(names.map((name) => [name, 0])), guests = [];
/** As many as are there at a time: fewer than the server takes as pages, so that a page can still come. */
const kMostGuests = 40;
function visit(name) {
  const s = scenes[name]();
  done[name]++;
  const stays = name.startsWith('silent') ? kForever : name.startsWith('slow') ? 10000 + below(20000) : below(3000);
  const guest = { name, s, since: performance.now(), until: performance.now() + stays };
  guests.push(guest);
  s.on('close', () => { guest.gone = performance.now(); guests.splice(guests.indexOf(guest), 1); if (stays === kForever && !guest.sent) endedByServer.push((guest.gone - guest.since) / 1000); });
}
const endedByServer = [];

/** For that many seconds. What the server used, the largest of four looks a second. */
async function watchFor(duration, each) {
  const most = { megabytes: 0, threads: 0, descriptors: 0 }, until = performance.now() + 1000 * duration;
  for (let i = 0; performance.now() < until && !server.over; i++) {
    if (i % 10 === 0) for (const [key, value] of Object.entries(usage(server.child.pid))) most[key] = Math.max(most[key], value);
    each?.(i);
    await pause(25);
  }
  assert.equal(server.over, null, `the server ended: ${JSON.stringify(server.over)}\n${server.said}`);
  return most;
}
behave();
await pause(500);
const alone = await watchFor(Math.max(1.5, Math.min(20, 0.3 * seconds)));
assert.ok(strokes.alone.length > 5, `the page alone cuts ${strokes.alone.length} times`);
phase = 'beside';
let turn = 0;
const beside = await watchFor(seconds, () => {
  const silent = guests.filter((g) => g.until === kForever).length;
  const name = turn < names.length ? names[turn] : names[below(names.length)];
  if (guests.length < kMostGuests && !(name.startsWith('silent') && silent > 15)) { turn++; visit(name); }
  for (const g of guests) if (performance.now() > g.until) vanish(g.s);
});
// The server ends requests that say nothing after half a minute, pages that do not answer its pings after one. Half a minute more for a busy machine.
for (const g of guests) if (g.until === kForever) assert.ok(performance.now() - g.since < 90000, `a ${g.name} client is there for ${((performance.now() - g.since) / 1000).toFixed(0)} s`);
if (seconds > 100) assert.ok(endedByServer.length > 0, 'the server ends no silent client');
for (const g of guests) { g.sent = true; vanish(g.s); }
phase = 'after';
strokes.after = []; undos.after = [];
await pause(1500);  // memory is given back once a second
const after = await watchFor(1);
ending = true;
const text = (list) => { const q = quantiles(list); return `${list.length} times, median ${q.median.toFixed(1)} ms, 99 % ${q.p99.toFixed(1)} ms, worst ${q.worst.toFixed(1)} ms`; };
const used = (u) => `${u.megabytes.toFixed(0)} MiB, ${u.threads} threads, ${u.descriptors} descriptors`;
console.log(`${turn} clients (${names.map((n) => `${n} ${done[n]}`).join(', ')}), seed ${seed}; the server ended ${endedByServer.length} silent ones${endedByServer.length ? `, after ${Math.min(...endedByServer).toFixed(0)} to ${Math.max(...endedByServer).toFixed(0)} s` : ''}`);
for (const list of ['alone', 'beside', 'after']) console.log(`${list}: stroke to patch ${text(strokes[list])}; undo ${text(undos[list])}; ${used({ alone, beside, after }[list])}`);
console.log(`the page was lost ${lost} times; its tools were taken in ${stolen} strokes, ${missed} met nothing`);
// Bounds, not figures: at half a busy machine breaks them, at double a page that waits for others would pass.
assert.equal(lost, 0, 'the page was disconnected');
assert.ok(strokes.beside.length > seconds / 2, 'the page hardly cuts');
const q = quantiles(strokes.beside);
assert.ok(q.median < 150 && q.p99 < 3000, 'the page waits for others');
assert.ok(beside.megabytes < alone.megabytes + 250, 'memory');
assert.ok(after.megabytes < alone.megabytes + 60, 'memory that does not come back');
assert.ok(beside.threads <= alone.threads && after.threads <= alone.threads, 'threads');
assert.ok(beside.descriptors <= alone.descriptors + 2 * kMostGuests && after.descriptors <= alone.descriptors + 1, 'descriptors');
assert.deepEqual(await end(server), { code: 0, signal: null }, server.said);
process.exit(0);
