// Clients that hang on to `kerf view`, all together, beside one page that cuts:
//   node tests/end_to_end/hanging_clients.mjs PROGRAM [SECONDS] [SEED]
// Slow ones read or write a byte a second, silent ones say nothing, lying ones announce more than they send, vanishing ones go in the middle of a
// frame, of an upload, of a stroke. The page measures stroke to patch. A second server has the same page and, for each of them, a client that asks
// for the same with manners. The two pages take turns, so what the machine does besides, and what work costs that others asked for, slows both.
// The page beside those without manners is never disconnected, and is answered as soon as the other. Memory, threads and descriptors of the server
// are bounded, and fall back when they have gone. In longer runs the server itself ends those that say nothing. Exit status 0 if all that holds.
import assert from 'node:assert/strict';
import { randomBytes } from 'node:crypto';
import { Connections, claim, command, end, frame, hello, quantiles, seeded, serve, toolMessage, upgrade, upload, usage } from './page_client.mjs';

const program = process.argv[2], seconds = Number(process.argv[3] ?? 5), seed = Number(process.argv[4] ?? 1);
const { random, below } = seeded(seed);
const pause = (milliseconds) => new Promise((r) => setTimeout(r, milliseconds));
const server = await serve(program, ['trainer']), civil = await serve(program, ['trainer']);
const good = new Connections(server.port), mild = new Connections(civil.port), rude = new Connections(server.port);

// --- The pages that behave: cut across the body, take the cut back, and so on
/** Times what the other page takes, and milliseconds beyond: of the median, and of nine tenths of all. From so many strokes. */
const kMedianTimes = 2, kTailTimes = 4, kSlack = 10, kStrokes = 40;
let phase = 'alone', ending = false;
/** Whose turn it is to cut. Who takes longer than kTurn does so beside the other. */
const kTurn = 1000;
let turns = Promise.resolve();
async function take() {
  const before = turns;
  let give;
  turns = new Promise((given) => { give = given; });
  await before;
  setTimeout(give, kTurn);
  return give;
}
/** Cuts until the end, again when it is lost. Waits for the answer to each input. Places of cuts are the same for all pages. */
function behave(host, connections, page = { lost: 0, stolen: 0, missed: 0, strokes: {}, undos: {}, draw: seeded(seed).random }) {
  const note = (lists, list, since) => (lists[list] ??= []).push(performance.now() - since);
  let input = 1000, awaited = null;
  const told = (answer) => { const waiting = awaited; awaited = null; waiting?.answered(answer); };
  const s = connections.page(async (send) => {
    /** What came back: 'patch', 'nothing' or 'stolen'. */
    const ask = (make, types) => new Promise((answered) => { awaited = { input: ++input, types, answered }; for (const m of make(input)) send(m); });
    const ray = (x, y) => [x, y, 0.1, 0, 0, -1];  // into the thin rim from inside
    while (!s.destroyed && !ending) {
      const give = await take();
      let since = performance.now();
      const list = phase, x = 0.004 * (page.draw() - 0.5);
      const cut = await ask((n) => [toolMessage(n, 0, 0, [ray(x, 0.011)]), toolMessage(n, 0, 1, [ray(x, 0.015)]), toolMessage(n, 0, 2, [ray(x, 0.018)])], [3, 7]);
      if (cut === 'patch') note(page.strokes, list, since);
      else if (cut === 'stolen') { page.stolen++; send(claim(1)); }
      else { page.missed++; send(command(++input, 5)); }  // strokes of those that vanished have moved or cut what lay there: from the start again
      since = performance.now();
      if (cut === 'patch' && await ask((n) => [command(n, 6)], [3]) === 'patch') note(page.undos, list, since);
      give();
      await pause(20);
    }
  }, (type, m) => {
    if (!awaited) return;
    if (type === 9 && m.readUInt32LE(8) === awaited.input) told(m.readUInt32LE(12) === 3 ? 'stolen' : 'nothing');
    else if (type === 3 && awaited.types.includes(3) && m.readUInt32LE(20) === awaited.input) told('patch');
    else if (type === 7 && awaited.types.includes(7) && m.readUInt32LE(8) === awaited.input) told('nothing');
    else if (type === 8 && m.readUInt32LE(12) === 0) told('stolen');
  });
  s.on('close', () => { if (!host.over && !ending) { page.lost++; setTimeout(() => behave(host, connections, page), 100); } });
  return page;
}

// --- The others. Each says how many milliseconds it stays; what is silent stays until the server ends it.
const kForever = Infinity;
const drip = (s, bytes) => { let at = 0; const timer = setInterval(() => { if (s.destroyed || at >= bytes.length) return clearInterval(timer); s.write(bytes.subarray(at, ++at)); }, 1000); };
const sip = (s) => { s.pause(); const timer = setInterval(() => { if (s.destroyed) return clearInterval(timer); s.read(1); }, 1000); };
const line = (words, port = server.port) => Buffer.from(`${words}\r\nHost: 127.0.0.1:${port}\r\n`);
const stroke = (n) => toolMessage(n, 0, 0, [[0.02 * (random() - 0.5), 0.016, 0.1, 0, 0, -1]]);
const vanish = (s) => { if (below(2)) s.resetAndDestroy(); else s.destroy(); };
const askForFiles = (send) => { for (let i = 0; i < 20; i++) send(command(i, 11, [0, 0, 0, 0], 'obj')); };
const scenes = {
  slowReader: () => rude.socket((send, s) => { send(hello()); askForFiles(send); sip(s); }),
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
/** The same with manners: reads what comes, sends what it has announced, says when it ends. */
const get = () => mild.connect((s) => { s.write(Buffer.concat([line('GET / HTTP/1.1', civil.port), Buffer.from('\r\n')])); s.resume(); });
const visitor = (then = () => {}) => mild.page(then, () => {});
const civilly = {
  slowReader: () => visitor(askForFiles), slowPage: get, slowRequest: get, lyingLength: get, silent: () => mild.connect(), silentSocket: () => visitor(),
  vanishingUpload: () => visitor((send) => { for (let i = 0; i < 20; i++) send(upload(7, 0, 'a.obj', 48000 * i, 960000, randomBytes(48000))); }),
  vanishingStroke: () => visitor((send) => { send(claim(1)); send(stroke(1)); send(toolMessage(2, 0, 3, [])); }),
};
const names = Object.keys(scenes), done = Object.fromEntries(names.map((name) => [name, 0])), guests = [];
/** As many as are there at a time: fewer than the server takes as pages, so that a page can still come. */
const kMostGuests = 40;
function visit(name) {
  const s = scenes[name]();
  done[name]++;
  const stays = name.startsWith('silent') ? kForever : name.startsWith('slow') ? 10000 + below(20000) : below(3000);
  const twin = (civilly[name] ?? visitor)();
  s.on('close', () => twin.destroy());
  const guest = { name, s, since: performance.now(), until: performance.now() + stays };
  guests.push(guest);
  s.on('close', () => { guest.gone = performance.now(); guests.splice(guests.indexOf(guest), 1); if (stays === kForever && !guest.sent) endedByServer.push((guest.gone - guest.since) / 1000); });
}
const endedByServer = [];

/** For that many seconds, and until there is enough. What the server used, the largest of four looks a second. */
async function watchFor(duration, each, enough = () => true) {
  const most = { megabytes: 0, threads: 0, descriptors: 0 }, until = performance.now() + 1000 * duration;
  for (let i = 0; (performance.now() < until || !enough()) && !server.over; i++) {
    if (i % 10 === 0) for (const [key, value] of Object.entries(usage(server.child.pid))) most[key] = Math.max(most[key], value);
    each?.(i);
    await pause(25);
  }
  assert.equal(server.over, null, `the server ended: ${JSON.stringify(server.over)}\n${server.said}`);
  return most;
}
const page = behave(server, good), other = behave(civil, mild);
await pause(500);
const before = await watchFor(Math.max(1.5, Math.min(20, 0.3 * seconds)));
phase = 'beside';
let turn = 0;
const beside = await watchFor(seconds, () => {
  const silent = guests.filter((g) => g.until === kForever).length;
  const name = turn < names.length ? names[turn] : names[below(names.length)];
  if (guests.length < kMostGuests && !(name.startsWith('silent') && silent > 15)) { turn++; visit(name); }
  for (const g of guests) if (performance.now() > g.until) vanish(g.s);
}, () => (other.undos.beside ?? []).length >= kStrokes);
// The server ends requests that say nothing after half a minute, pages that do not answer its pings after one. Half a minute more for a busy machine.
for (const g of guests) if (g.until === kForever) assert.ok(performance.now() - g.since < 90000, `a ${g.name} client is there for ${((performance.now() - g.since) / 1000).toFixed(0)} s`);
if (seconds > 100) assert.ok(endedByServer.length > 0, 'the server ends no silent client');
for (const g of guests) { g.sent = true; vanish(g.s); }
phase = 'after';
await pause(1500);  // memory is given back once a second
const after = await watchFor(1);
ending = true;
const text = (list) => { const q = quantiles(list); return `${list.length} times, median ${q.median.toFixed(1)} ms, 99 % ${q.p99.toFixed(1)} ms, worst ${q.worst.toFixed(1)} ms`; };
const used = (u) => `${u.megabytes.toFixed(0)} MiB, ${u.threads} threads, ${u.descriptors} descriptors`;
console.log(`${turn} clients (${names.map((n) => `${n} ${done[n]}`).join(', ')}), seed ${seed}; the server ended ${endedByServer.length} silent ones${endedByServer.length ? `, after ${Math.min(...endedByServer).toFixed(0)} to ${Math.max(...endedByServer).toFixed(0)} s` : ''}`);
for (const list of ['alone', 'beside', 'after']) {
  console.log(`${list}: stroke to patch ${text(page.strokes[list] ?? [])}; undo ${text(page.undos[list] ?? [])}; ${used({ alone: before, beside, after }[list])}`);
  console.log(`  page of the other server: stroke to patch ${text(other.strokes[list] ?? [])}; undo ${text(other.undos[list] ?? [])}`);
}
console.log(`the page was lost ${page.lost} times; its tools were taken in ${page.stolen} strokes, ${page.missed} met nothing`);
// Bounds, not figures, all beside what the other page met in the same turns.
assert.equal(page.lost, 0, 'the page was disconnected');
for (const [what, mine, theirs] of [['strokes', page.strokes.beside, other.strokes.beside], ['undos', page.undos.beside, other.undos.beside]]) {
  const sorted = [mine, theirs].map((list) => [...(list ?? [])].sort((x, y) => x - y));
  const at = (share) => sorted.map((list) => list[Math.floor(share * list.length)]);
  assert.ok(sorted[0].length > sorted[1].length / 2, `the page hardly cuts: ${sorted[0].length} ${what}, the other ${sorted[1].length}`);
  for (const [share, times] of [[0.5, kMedianTimes], [0.9, kTailTimes]]) {
    const [here, there] = at(share);
    assert.ok(here < times * there + kSlack, `the page waits for others: of its ${what} ${100 * share} % take ${here.toFixed(1)} ms, of the other's ${there.toFixed(1)} ms`);
  }
}
assert.ok(beside.megabytes < before.megabytes + 250, 'memory');
assert.ok(after.megabytes < before.megabytes + 60, 'memory that does not come back');
assert.ok(beside.threads <= before.threads && after.threads <= before.threads, 'threads');
assert.ok(beside.descriptors <= before.descriptors + 2 * kMostGuests && after.descriptors <= before.descriptors + 1, 'descriptors');
for (const host of [server, civil]) assert.deepEqual(await end(host), { code: 0, signal: null }, host.said);
process.exit(0);
