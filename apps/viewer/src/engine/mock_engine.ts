// An engine in the page, for development and tests without a server: the same bytes as a server would send.
import { MessageEngine } from './message_engine';
import type { EngineEvents } from './engine';
import { MockBody, type MockOptions } from './mock_body';
import {
  CommandCode,
  FrameFlag,
  Outcome,
  Phase,
  ToolCode,
  decodePageMessage,
  encodeEngineMessage,
  kNoNode,
  kProtocolVersion,
  type CommandMessage,
  type EngineMessage,
  type ToolMessage,
  type Vec3,
} from './protocol';

type Topology = MockBody['topology'];
const kTickMs = 1000 / 60;
const kUnacknowledged = 2;

export class MockEngine extends MessageEngine {
  mock: MockBody;
  private undo: Topology[] = [];
  private redo: Topology[] = [];
  private strokeStart: { topology: Topology; point: [number, number] } | null = null;
  private hold: ReturnType<MockBody['grasp']> | null = null;
  private holdPlane: { point: Vec3; normal: Vec3 } = { point: [0, 0, 0], normal: [0, 0, 1] };
  private playing = true;
  private speed = 1;
  private time = 0;
  private seq = 0;
  private acked = 0;
  private lastInput = 0;
  private lastStats = 0;
  private overlayWanted = false;
  private timer: ReturnType<typeof setInterval> | undefined;
  private stepMs: number[] = [];
  private dropped = 0;
  private readonly sessionId = BigInt(Math.floor(Math.random() * 2 ** 48)) + 1n;
  private scene = 'steak';
  private look = 'steak';
  private recording = false;

  constructor(private readonly options: MockOptions = { segments: 96, rings: 28 }) {
    super();
    this.mock = new MockBody(options);
  }

  start(events: EngineEvents): void {
    this.events = events;
    events.state('connecting');
    queueMicrotask(() => {
      this.events?.state('live');
      this.sayHello();
      this.reply(this.mock.bodyMessage());
      this.reply({ type: 'role', holder: 1, held: true, clients: 1 });
    });
    this.timer = setInterval(() => this.tick(), kTickMs);
  }

  stop(): void {
    clearInterval(this.timer);
  }

  resync(): void {
    this.reply(this.mock.bodyMessage());
  }

  private sayHello(): void {
    const s = [
      { name: 'steak', title: 'Steak (mock)' },
      { name: 'meniscus', title: 'Cartilage look (mock)' },
      { name: 'sheet', title: 'Silicone look (mock)' },
    ];
    const json = JSON.stringify({
      scenes: s,
      title: s.find((x) => x.name === this.scene)?.title,
      material: { young: 20000, poisson: 0.45, density: 1060 },
      gravity: this.mock.gravity,
      time_step: 1 / 60,
      look: this.look,
      box: [-0.105, -0.072, -0.012, 0.105, 0.072, 0.012],
      limits: {},
    });
    this.reply({
      type: 'hello',
      session: this.sessionId,
      client: 1,
      readOnly: false,
      tick: 60,
      name: this.scene,
      json,
    });
  }

  private reply(message: EngineMessage): void {
    this.receive(encodeEngineMessage(message));
  }

  protected post(bytes: ArrayBuffer): boolean {
    const m = decodePageMessage(bytes);
    switch (m.type) {
      case 'pageHello':
        if (m.protocol !== kProtocolVersion) this.fail(0, 1, 'another protocol');
        break;
      case 'ack':
        this.acked = Math.max(this.acked, m.seq);
        break;
      case 'ray':
        setTimeout(() => this.answerRay(m.input, m.origin, m.direction), 0);
        break;
      case 'tool':
        setTimeout(() => this.useTool(m), 0);
        break;
      case 'command':
        setTimeout(() => this.obey(m), 0);
        break;
      case 'claim':
        this.reply({ type: 'role', holder: m.take ? 1 : 0, held: m.take, clients: 1 });
        break;
      case 'upload':
        break;
      case 'device':
        break;
    }
    return true;
  }

  private fail(input: number, code: number, text: string): void {
    this.reply({ type: 'error', input, code, text });
  }

  private answerRay(input: number, origin: Vec3, direction: Vec3): void {
    const h = this.mock.intersect(origin, direction);
    this.reply(
      h
        ? {
            type: 'hit',
            input,
            triangle: h.triangle,
            t: h.t,
            point: h.point,
            normal: h.normal,
            beside: 0,
            copy: h.copy,
          }
        : { type: 'hit', input, triangle: -1, t: 0, point: [0, 0, 0], normal: [0, 0, 0], beside: 0, copy: kNoNode },
    );
  }

  /** Where a view ray meets the body, or the plane of the body at rest beside it. */
  private restPoint(origin: Vec3, direction: Vec3): [number, number] | null {
    const h = this.mock.intersect(origin, direction);
    if (h) return [h.rest[0], h.rest[1]];
    const t = -origin[2] / direction[2];
    return t > 0 ? [origin[0] + t * direction[0], origin[1] + t * direction[1]] : null;
  }

  private useTool(m: ToolMessage): void {
    this.lastInput = m.input;
    const sample = m.samples[m.samples.length - 1];
    if (m.tool === ToolCode.Scalpel || m.tool === ToolCode.Line) this.stroke(m);
    else if (m.tool === ToolCode.Grasp && sample) this.pull(m, sample.origin, sample.direction);
    else if (m.tool === ToolCode.Grasp) this.letGo(false);
    else if (m.phase === Phase.Down && sample) {
      const h = this.mock.intersect(sample.origin, sample.direction);
      if (!h) return;
      this.mock.pin(h.copy, m.tool === ToolCode.Fix);
      if (m.tool === ToolCode.Release) {
        this.mock.holds = this.mock.holds.filter(
          (g) => Math.hypot(...this.mock.holdPoint(g).map((x, d) => x - h.point[d]!)) > 0.03,
        );
      }
    }
  }

  private stroke(m: ToolMessage): void {
    const sample = m.samples[m.samples.length - 1],
      first = m.samples[0];
    if (m.phase === Phase.Down && first) {
      const point = this.restPoint(first.origin, first.direction);
      if (point) this.strokeStart = { topology: this.mock.snapshot(), point };
    }
    const start = this.strokeStart;
    if (!start) return;
    if (m.phase === Phase.Cancel) {
      this.change(m.input, start.topology);
      this.strokeStart = null;
      return;
    }
    const end = sample ? this.restPoint(sample.origin, sample.direction) : null;
    const t0 = performance.now();
    let cut = 0;
    if (end && (m.phase !== Phase.Down || m.samples.length > 1)) {
      const before = this.mock.snapshot();
      this.mock.restore({ ...start.topology, version: before.version });
      cut = this.mock.cut(start.point, end);
      // Every try is a new version, even one that cuts nothing.
      this.mock.topology.version = before.version + 1;
      this.sendPatch(before, m.input);
    }
    if (m.phase !== Phase.Up) return;
    this.strokeStart = null;
    const changed = this.mock.topology.copies.length !== start.topology.copies.length;
    if (changed) {
      this.undo.push(start.topology);
      this.redo = [];
    }
    const ms = performance.now() - t0;
    this.report(m.input, changed ? Outcome.Cut : Outcome.NothingMet, cut, ms, changed ? '' : 'The blade met nothing.');
  }

  private report(input: number, outcome: number, trianglesCut: number, ms: number, text: string): void {
    this.reply({
      type: 'cut',
      input,
      outcome,
      pieces: this.mock.pieces(),
      trianglesCut,
      bindingMs: 0.4 * ms,
      embeddingMs: 0.35 * ms,
      surfaceMs: 0.25 * ms,
      totalMs: ms,
      counts: this.mock.counts(),
      invariants: 0,
      text,
    });
  }

  private sendPatch(before: Topology, input: number): void {
    this.reply(this.mock.patchMessage(before, input));
    if (this.overlayWanted) this.reply(this.mock.overlayMessage());
  }

  private change(input: number, to: Topology): void {
    const before = this.mock.snapshot();
    this.mock.restore(to);
    this.mock.topology.version = before.version + 1;
    this.sendPatch(before, input);
  }

  private pull(m: ToolMessage, origin: Vec3, direction: Vec3): void {
    if (m.phase === Phase.Down) {
      const h = this.mock.intersect(origin, direction);
      if (!h) return;
      this.hold = this.mock.grasp(h);
      this.holdPlane = { point: h.point, normal: direction };
      return;
    }
    if (!this.hold) return;
    const { point, normal } = this.holdPlane,
      d = direction;
    const t =
      ((point[0] - origin[0]) * normal[0] + (point[1] - origin[1]) * normal[1] + (point[2] - origin[2]) * normal[2]) /
      (d[0] * normal[0] + d[1] * normal[1] + d[2] * normal[2]);
    if (Number.isFinite(t)) for (let k = 0; k < 3; k++) this.hold.target[k] = origin[k]! + t * d[k]!;
    if (m.phase === Phase.Up || m.phase === Phase.Cancel) this.letGo((m.modifiers & 1) !== 0);
  }

  private letGo(keep: boolean): void {
    if (!keep) this.mock.holds = this.mock.holds.filter((h) => h !== this.hold);
    this.hold = null;
  }

  private obey(m: CommandMessage): void {
    this.lastInput = m.input;
    const [x, y, z] = m.value;
    switch (m.code) {
      case CommandCode.Play:
        this.playing = true;
        break;
      case CommandCode.Pause:
        this.playing = false;
        break;
      case CommandCode.Step:
        for (let i = 0; i < Math.min(1000, Math.max(1, x)); i++) this.advance();
        break;
      case CommandCode.Speed:
        this.speed = Math.max(0.05, Math.min(4, x));
        break;
      case CommandCode.Reset:
        this.reset();
        break;
      case CommandCode.Undo:
      case CommandCode.Redo: {
        const back = m.code === CommandCode.Undo,
          from = back ? this.undo : this.redo,
          to = back ? this.redo : this.undo;
        const target = from.pop();
        if (!target) {
          this.fail(m.input, 2, back ? 'There is nothing to undo.' : 'There is nothing to redo.');
          return;
        }
        to.push(this.mock.snapshot());
        this.change(m.input, target);
        this.report(m.input, back ? Outcome.Undone : Outcome.Redone, 0, 0, '');
        break;
      }
      case CommandCode.Scene:
        this.scene = m.text;
        this.look = m.text;
        this.sayHello();
        this.reset();
        break;
      case CommandCode.Gravity:
        this.mock.gravity = [x, y, z];
        break;
      case CommandCode.Material:
        this.mock.stiffness = Math.max(0.08, Math.min(0.95, Math.log10(Math.max(10, x)) / 8));
        break;
      case CommandCode.Export:
        this.reply({
          type: 'file',
          request: m.input,
          name: `kerf.${m.text}`,
          bytes: new TextEncoder().encode('# a file of the mock engine\n'),
        });
        break;
      case CommandCode.Recording:
        if (this.recording && x === 0) {
          this.reply({
            type: 'file',
            request: m.input,
            name: 'session.kerf',
            bytes: new TextEncoder().encode('# a recording of the mock engine\n'),
          });
        }
        this.recording = x !== 0;
        break;
      case CommandCode.Overlay:
        this.overlayWanted = x !== 0;
        if (this.overlayWanted) this.reply(this.mock.overlayMessage());
        break;
      case CommandCode.LoadUpload:
        this.fail(m.input, 4, 'The mock engine cannot load files.');
        break;
      case CommandCode.FixAll:
        this.mock.pinWhere((_, py) => x === 1 && py > 0.03);
        break;
      default:
        this.fail(m.input, 2, `unknown command ${m.code}`);
    }
  }

  private reset(): void {
    const version = this.mock.topology.version + 1,
      gravity = this.mock.gravity;
    this.mock = new MockBody(this.options);
    this.mock.topology.version = version;
    this.mock.gravity = gravity;
    this.undo = [];
    this.redo = [];
    this.strokeStart = null;
    this.hold = null;
    this.time = 0;
    this.reply(this.mock.bodyMessage());
    if (this.overlayWanted) this.reply(this.mock.overlayMessage());
  }

  private advance(): void {
    const t0 = performance.now();
    this.mock.step(this.speed / 60);
    this.time += this.speed / 60;
    this.stepMs.push(performance.now() - t0);
    if (this.stepMs.length > 240) this.stepMs.shift();
  }

  /** One tick of the clock: a step and a frame. */
  tick(): void {
    if (this.playing) this.advance();
    const now = performance.now();
    if (now - this.lastStats > 250) {
      this.lastStats = now;
      const sorted = this.stepMs.slice().sort((a, b) => a - b),
        at = (q: number): number => sorted[Math.floor(q * (sorted.length - 1))] ?? 0;
      this.reply({
        type: 'stats',
        stepMs: at(0.5),
        stepMs99: at(0.99),
        mechanicsMs: at(0.5),
        stepsPerSecond: this.playing ? 60 : 0,
        iterations: 6,
        residual: 1e-3,
        counts: this.mock.counts(),
        pieces: this.mock.pieces(),
        dropped: this.dropped,
        bad: 0,
        clients: 1,
      });
    }
    if (this.seq - this.acked >= kUnacknowledged) {
      this.dropped++;
      return;
    }
    const grasps = new Float32Array(this.mock.holds.flatMap((h) => [...this.mock.holdPoint(h), ...h.target]));
    this.reply({
      type: 'frame',
      body: 1,
      seq: ++this.seq,
      version: this.mock.topology.version,
      input: this.lastInput,
      time: this.time,
      stepMs: this.stepMs[this.stepMs.length - 1] ?? 0,
      speed: this.playing ? this.speed : 0,
      flags: (this.playing ? FrameFlag.Playing : 0) | (this.strokeStart ? FrameFlag.Stroke : 0),
      undoDepth: this.undo.length,
      redoDepth: this.redo.length,
      nodes: new Float32Array(this.mock.positions),
      grasps,
      held: new Uint32Array(this.mock.holds.length).fill(kNoNode),
      places: new Float32Array(0),
      tools: new Float32Array(0),
      contacts: new Float32Array(0),
      partners: new Uint32Array(0),
      touching: 0,
      press: 0,
      fading: { ids: new Uint32Array(0), offsets: new Float32Array(0) },
    });
  }
}
