import { afterEach, describe, expect, it, vi } from 'vitest';
import type { Engine, EngineEvents } from '../src/engine/engine';
import { MockBody, rotationOf } from '../src/engine/mock_body';
import { MockEngine } from '../src/engine/mock_engine';
import {
  CommandCode,
  Outcome,
  Phase,
  ToolCode,
  type CutReport,
  type Frame,
  type Hit,
  type Overlay,
  type Patch,
  type ToolSample,
} from '../src/engine/protocol';
import { BodyState } from '../src/scene/body_state';
import { fillPose, kTextureWidth, poseRows, skinPoint } from '../src/scene/skinning';

/** Six times the volume that the skin and walls enclose, and the sum of their directed areas. */
function enclosed(s: BodyState): { volume: number; area: number[] } {
  let volume = 0;
  const area = [0, 0, 0];
  for (const [list, n] of [
    [s.skin, s.ns],
    [s.wall, s.nw],
  ] as const) {
    for (let t = 0; t < 3 * n; t += 3) {
      const p = [0, 1, 2].map((k) => Array.from(s.rest.subarray(3 * list[t + k]!, 3 * list[t + k]! + 3)));
      const [a, b, c] = p as [number[], number[], number[]];
      const u = b.map((x, i) => x - a[i]!),
        v = c.map((x, i) => x - a[i]!);
      const n3 = [u[1]! * v[2]! - u[2]! * v[1]!, u[2]! * v[0]! - u[0]! * v[2]!, u[0]! * v[1]! - u[1]! * v[0]!];
      for (let i = 0; i < 3; i++) area[i]! += n3[i]!;
      volume += a[0]! * n3[0]! + a[1]! * n3[1]! + a[2]! * n3[2]!;
    }
  }
  return { volume, area };
}

class Recorder implements EngineEvents {
  state_: BodyState | null = null;
  patches: Patch[] = [];
  frames: Frame[] = [];
  hits: Hit[] = [];
  cuts: CutReport[] = [];
  overlays: Overlay[] = [];
  errors: string[] = [];
  states: string[] = [];
  engine: Engine | null = null;
  ack = true;
  hello(): void {}
  body(b: Parameters<EngineEvents['body']>[0]): void {
    this.state_ = new BodyState(b);
  }
  patch(p: Patch): void {
    this.patches.push(p);
    this.state_!.apply(p);
  }
  frame(f: Frame): void {
    this.frames.push(f);
    if (this.ack) this.engine!.ack(f.seq);
  }
  hit(h: Hit): void {
    this.hits.push(h);
  }
  stats(): void {}
  cut(c: CutReport): void {
    this.cuts.push(c);
  }
  role(): void {}
  error(e: { text: string }): void {
    this.errors.push(e.text);
  }
  overlay(o: Overlay): void {
    this.overlays.push(o);
  }
  file(): void {}
  loading(): void {}
  thingsCame(): void {}
  score(): void {
    /* not of this engine */
  }
  fixed(): void {
    /* not of this engine */
  }
  masses(): void {
    /* not of this engine */
  }
  state(s: string): void {
    this.states.push(s);
  }
}

const ray = (x: number, y: number): ToolSample => ({ time: 0, origin: [x, y, 1], direction: [0, 0, -1], pressure: 0 });

async function begin(): Promise<{ engine: MockEngine; page: Recorder }> {
  vi.useFakeTimers();
  const engine = new MockEngine({ segments: 40, rings: 12 }),
    page = new Recorder();
  page.engine = engine;
  engine.mock.gravity = [0, 0, 0];
  engine.start(page);
  await vi.advanceTimersByTimeAsync(1);
  return { engine, page };
}
async function cut(engine: MockEngine, tool: number, ...points: [number, number][]): Promise<void> {
  engine.tool({ tool, phase: Phase.Down, modifiers: 0, samples: [ray(...points[0]!)] });
  for (const p of points.slice(1)) engine.tool({ tool, phase: Phase.Move, modifiers: 0, samples: [ray(...p)] });
  engine.tool({ tool, phase: Phase.Up, modifiers: 0, samples: [ray(...points[points.length - 1]!)] });
  await vi.advanceTimersByTimeAsync(1);
}

afterEach(() => {
  vi.useRealTimers();
});

describe('the mock engine', () => {
  it('sends a closed body at once and frames afterwards', async () => {
    const { page, engine } = await begin();
    expect(page.states).toEqual(['connecting', 'live']);
    const { volume, area } = enclosed(page.state_!);
    expect(volume / 6).toBeGreaterThan(1e-4);
    expect(Math.hypot(...area)).toBeLessThan(1e-6);
    await vi.advanceTimersByTimeAsync(200);
    expect(page.frames.length).toBeGreaterThan(8);
    engine.stop();
  });
  it('cuts the body in two, with walls that close both pieces', async () => {
    const { page, engine } = await begin(),
      before = enclosed(page.state_!).volume;
    await cut(engine, ToolCode.Scalpel, [0.013, -0.2], [0.013, -0.05], [0.013, 0.2]);
    const s = page.state_!;
    expect(page.cuts.map((c) => [c.outcome, c.pieces])).toEqual([[Outcome.Cut, 2]]);
    expect(s.nw).toBeGreaterThan(0);
    const after = enclosed(s);
    expect(Math.hypot(...after.area)).toBeLessThan(1e-6);
    expect(after.volume).toBeCloseTo(before, 7);
    // Every vertex lies in or beside the cell of its copy, and copies exist.
    for (let v = 0; v < s.nv; v++) expect(s.copy[v]).toBeLessThan(s.nc);
    // The patches' sum is the body that a fresh page would get.
    const fresh = new BodyState(engine.mock.bodyMessage());
    expect([s.nv, s.ns, s.nw, s.nc, s.nn]).toEqual([fresh.nv, fresh.ns, fresh.nw, fresh.nc, fresh.nn]);
    expect(s.rest.subarray(0, 3 * s.nv)).toEqual(fresh.rest.subarray(0, 3 * s.nv));
    expect(s.skin.subarray(0, 3 * s.ns)).toEqual(fresh.skin.subarray(0, 3 * s.ns));
    expect(s.copies.subarray(0, 8 * s.nc)).toEqual(fresh.copies.subarray(0, 8 * s.nc));
    engine.stop();
  });
  it('undoes by truncation and redoes the same', async () => {
    const { page, engine } = await begin();
    const old = page.state_!,
      first = {
        nv: old.nv,
        ns: old.ns,
        nc: old.nc,
        rest: old.rest.slice(0, 3 * old.nv),
        skin: old.skin.slice(0, 3 * old.ns),
      };
    await cut(engine, ToolCode.Scalpel, [0.013, -0.2], [0.013, 0.2]);
    const second = { nv: old.nv, wall: old.wall.slice(0, 3 * old.nw) };
    engine.command({ code: CommandCode.Undo });
    await vi.advanceTimersByTimeAsync(1);
    expect([old.nv, old.ns, old.nw, old.nc]).toEqual([first.nv, first.ns, 0, first.nc]);
    expect(old.rest.subarray(0, 3 * old.nv)).toEqual(first.rest);
    expect(old.skin.subarray(0, 3 * old.ns)).toEqual(first.skin);
    engine.command({ code: CommandCode.Redo });
    await vi.advanceTimersByTimeAsync(1);
    expect(old.nv).toBe(second.nv);
    expect(old.wall.subarray(0, 3 * old.nw)).toEqual(second.wall);
    expect(page.cuts.map((c) => c.outcome)).toEqual([Outcome.Cut, Outcome.Undone, Outcome.Redone]);
    engine.command({ code: CommandCode.Redo });
    await vi.advanceTimersByTimeAsync(1);
    expect(page.errors).toEqual(['There is nothing to redo.']);
    engine.stop();
  });
  it('takes a cancelled stroke back', async () => {
    const { page, engine } = await begin(),
      s = page.state_!,
      nv = s.nv;
    engine.tool({ tool: 0, phase: Phase.Down, modifiers: 0, samples: [ray(0.013, -0.2)] });
    engine.tool({ tool: 0, phase: Phase.Move, modifiers: 0, samples: [ray(0.013, 0.2)] });
    await vi.advanceTimersByTimeAsync(1);
    expect(s.nv).toBeGreaterThan(nv);
    engine.tool({ tool: 0, phase: Phase.Cancel, modifiers: 0, samples: [] });
    await vi.advanceTimersByTimeAsync(1);
    expect(s.nv).toBe(nv);
    engine.stop();
  });
  it('opens a cut that ends inside, and keeps the body in one piece', async () => {
    const { page, engine } = await begin();
    await cut(engine, ToolCode.Line, [0.013, -0.2], [0.013, 0.005]);
    expect(page.cuts[0]!.pieces).toBe(1);
    expect(page.state_!.nw).toBeGreaterThan(0);
    expect(Math.hypot(...enclosed(page.state_!).area)).toBeLessThan(1e-5);
    engine.stop();
  });
  it('drops frames for a page that does not acknowledge them', async () => {
    const { page, engine } = await begin();
    page.ack = false;
    const n = page.frames.length;
    await vi.advanceTimersByTimeAsync(1000);
    expect(page.frames.length - n).toBeLessThanOrEqual(2);
    engine.stop();
  });
  it('answers rays with the point on the deformed surface', async () => {
    const { page, engine } = await begin();
    engine.ray([0.02, 0.01, 1], [0, 0, -1]);
    engine.ray([0.5, 0.5, 1], [0, 0, -1]);
    await vi.advanceTimersByTimeAsync(1);
    expect(page.hits[0]!.point[2]).toBeCloseTo(0.0105, 2);
    expect(page.hits[0]!.point.slice(0, 2)).toEqual([0.02, 0.01]);
    expect(page.hits[0]!.normal[2]).toBeGreaterThan(0.9);
    expect(page.hits[1]!.triangle).toBe(-1);
    engine.stop();
  });
  it('sends the overlay while it is wanted, after each change', async () => {
    const { page, engine } = await begin();
    engine.command({ code: CommandCode.Overlay, value: [1] });
    await vi.advanceTimersByTimeAsync(1);
    await cut(engine, ToolCode.Line, [0.013, -0.2], [0.013, 0.2]);
    const last = page.overlays[page.overlays.length - 1]!;
    expect(page.overlays.length).toBe(1 + page.patches.length);
    expect(last.version).toBe(page.state_!.version);
    expect(last.triangles.length).toBeGreaterThan(page.overlays[0]!.triangles.length);
    engine.stop();
  });
});

describe('the mock body', () => {
  it('keeps its shape without forces and follows a grasp', () => {
    const b = new MockBody({ segments: 30, rings: 8 });
    b.gravity = [0, 0, 0];
    const rest = b.positions.slice();
    for (let i = 0; i < 30; i++) b.step(1 / 60);
    expect(Math.max(...b.positions.map((x, i) => Math.abs(x - rest[i]!)))).toBeLessThan(1e-6);
    const hit = b.intersect([0.03, -0.03, 1], [0, 0, -1])!,
      hold = b.grasp(hit);
    hold.target[2]! += 0.02;
    for (let i = 0; i < 200; i++) b.step(1 / 60);
    expect(b.holdPoint(hold)[2] - hit.point[2]).toBeGreaterThan(0.008);
    expect(b.positions.every(Number.isFinite)).toBe(true);
  });
  it('moves apart after a cut through it, each vertex with its own copy', () => {
    const b = new MockBody({ segments: 30, rings: 8 });
    b.gravity = [0, 0, 0];
    expect(b.cut([0.013, -0.2], [0.013, 0.2])).toBeGreaterThan(0);
    const s = new BodyState(b.bodyMessage()),
      shifted = new Set<number>();
    for (let v = 0; v < s.nv; v++) {
      if (s.rest[3 * v]! > 0.0131) for (let k = 0; k < 8; k++) shifted.add(s.copies[8 * s.copy[v]! + k]!);
    }
    for (const n of shifted) s.nodes[3 * n]! += 0.05;
    const pose = new Float32Array(4 * kTextureWidth * poseRows(s.nc));
    fillPose(s, pose);
    for (let v = 0; v < s.nv; v++) {
      const r = [s.rest[3 * v]!, s.rest[3 * v + 1]!, s.rest[3 * v + 2]!] as const,
        x = skinPoint(s, pose, s.copy[v]!, ...r)[0] - r[0];
      if (r[0] > 0.0131) expect(x).toBeCloseTo(0.05, 5);
      if (r[0] < 0.0129) expect(x).toBeCloseTo(0, 5);
    }
  });
  it('finds rotations', () => {
    const c = Math.cos(0.8),
      s = Math.sin(0.8),
      R = [c, -s, 0, s, c, 0, 0, 0, 1];
    const scaled = R.map((x, i) => x * [2, 0.7, 1.3][i % 3]!);
    rotationOf(scaled).forEach((x, i) => expect(x).toBeCloseTo(R[i]!, 6));
  });
});
