import { makeFrame } from '../src/engine/frames';
import { describe, expect, it } from 'vitest';
import { BodyState, roomFor } from '../src/scene/body_state';
import { changedRanges } from '../src/scene/ranges';
import { random } from '../src/scene/noise';
import type { Body, Patch } from '../src/engine/protocol';

function body(nv: number, ns: number, nw: number, nc: number): Body {
  return {
    type: 'body',
    body: 1,
    version: 1,
    frames: makeFrame([0, 0, 0], [1, 0, 0, 0, 1, 0, 0, 0, 1], [1, 1, 1]),
    rest: new Float32Array(3 * nv).map((_, i) => i),
    normal: new Int16Array(4 * nv).map((_, i) => i % 100),
    copy: new Uint32Array(nv),
    skin: new Uint32Array(3 * ns).map((_, i) => i % nv),
    wall: new Uint32Array(3 * nw),
    copies: new Uint32Array(8 * nc).map((_, i) => i % 8),
    cells: new Int16Array(4 * nc),
    nodes: new Float32Array(24),
    fading: { ids: new Uint32Array(0), offsets: new Float32Array(0) },
  };
}
const empty = (s: BodyState): Patch => ({
  type: 'patch',
  body: 1,
  from: s.version,
  to: s.version + 1,
  input: 0,
  totals: { nv: s.nv, ns: s.ns, nw: s.nw, nc: s.nc, nn: s.nn },
  vertices: { ids: new Uint32Array(0), rest: new Float32Array(0), normal: new Int16Array(0), copy: new Uint32Array(0) },
  skin: { ids: new Uint32Array(0), triangles: new Uint32Array(0) },
  wall: { ids: new Uint32Array(0), triangles: new Uint32Array(0) },
  copies: { ids: new Uint32Array(0), copies: new Uint32Array(0), cells: new Int16Array(0) },
  nodes: new Float32Array(3 * s.nn),
  fading: { ids: new Uint32Array(0), offsets: new Float32Array(0) },
});

describe('patches', () => {
  it('changes and appends, then truncates', () => {
    const s = new BodyState(body(6, 4, 0, 2)),
      before = s.rest.slice(0, 18);
    const p = empty(s);
    p.totals = { ...p.totals, nv: 7, nw: 2 };
    p.vertices = {
      ids: new Uint32Array([1, 4]),
      rest: new Float32Array([-1, -2, -3, -4, -5, -6, -7, -8, -9]),
      normal: new Int16Array(12).fill(7),
      copy: new Uint32Array([1, 0, 1]),
    };
    p.skin = { ids: new Uint32Array([3]), triangles: new Uint32Array([6, 5, 4]) };
    p.wall = { ids: new Uint32Array(0), triangles: new Uint32Array([0, 1, 2, 2, 1, 6]) };
    const e = s.apply(p);
    expect(s.version).toBe(2);
    expect([s.nv, s.ns, s.nw, s.nc]).toEqual([7, 4, 2, 2]);
    expect(Array.from(s.rest.subarray(3, 6))).toEqual([-1, -2, -3]);
    expect(Array.from(s.rest.subarray(12, 15))).toEqual([-4, -5, -6]);
    expect(Array.from(s.rest.subarray(18, 21))).toEqual([-7, -8, -9]);
    expect(Array.from(s.rest.subarray(0, 3))).toEqual(Array.from(before.subarray(0, 3)));
    expect(Array.from(s.copy.subarray(0, 7))).toEqual([0, 1, 0, 0, 0, 0, 1]);
    expect(Array.from(s.skin.subarray(9, 12))).toEqual([6, 5, 4]);
    expect(Array.from(s.wall.subarray(0, 6))).toEqual([0, 1, 2, 2, 1, 6]);
    expect(e.vertices).toEqual([{ start: 1, end: 7 }]);
    expect(e.skin).toEqual([{ start: 3, end: 4 }]);
    expect(e.wall).toEqual([{ start: 0, end: 2 }]);
    expect(e.regrown).toBe(false);

    const back = empty(s);
    back.totals = { ...back.totals, nv: 6, nw: 0 };
    back.vertices = {
      ids: new Uint32Array([1, 4]),
      rest: new Float32Array([...before.subarray(3, 6), ...before.subarray(12, 15)]),
      normal: new Int16Array(8),
      copy: new Uint32Array([0, 0]),
    };
    back.skin = { ids: new Uint32Array([3]), triangles: new Uint32Array([0, 1, 2]) };
    const f = s.apply(back);
    expect([s.nv, s.nw]).toEqual([6, 0]);
    expect(Array.from(s.rest.subarray(0, 18))).toEqual(Array.from(before));
    expect(f.wall).toEqual([]);
  });
  it('grows when the spare room is used up, and says so', () => {
    const s = new BodyState(body(6, 4, 0, 2)),
      room = roomFor(6),
      extra = room;
    const p = empty(s);
    p.totals = { ...p.totals, nv: 6 + extra };
    p.vertices = {
      ids: new Uint32Array(0),
      rest: new Float32Array(3 * extra).fill(5),
      normal: new Int16Array(4 * extra),
      copy: new Uint32Array(extra),
    };
    expect(s.apply(p).regrown).toBe(true);
    expect(s.rest[3 * 5]).toBe(15);
    expect(s.rest[3 * (5 + extra)]).toBe(5);
  });
  it('refuses other versions and sums that do not add up', () => {
    const s = new BodyState(body(6, 4, 0, 2));
    expect(() => s.apply({ ...empty(s), from: 5 })).toThrow(/version/);
    const p = empty(s);
    p.totals = { ...p.totals, nv: 9 };
    expect(() => s.apply(p)).toThrow(/appends/);
    expect(s.version).toBe(1);
  });
});

describe('changed ranges', () => {
  it('cover exactly what changed, closing small gaps only, never empty', () => {
    const next = random(8);
    for (let round = 0; round < 100; round++) {
      const total = Math.floor(2000 * next()),
        appended = Math.floor((total + 1) * next()),
        gap = 1 + Math.floor(300 * next());
      const ids = Array.from({ length: Math.floor(20 * next()) }, () => Math.floor(Math.max(1, appended) * next()))
        .filter((x, i, a) => x < appended && a.indexOf(x) === i)
        .sort((a, b) => a - b);
      const ranges = changedRanges(ids, appended, total, gap),
        changed = new Set(ids);
      for (let i = appended; i < total; i++) changed.add(i);
      let end = -Infinity;
      for (const r of ranges) {
        // Not empty, and far enough from the one before: otherwise they would be one.
        expect(r.end > r.start && r.start - end >= gap && changed.has(r.start) && changed.has(r.end - 1)).toBe(true);
        end = r.end;
      }
      expect([...changed].every((x) => ranges.some((r) => r.start <= x && x < r.end))).toBe(true);
      if (ranges.length > 0) expect(end).toBeLessThanOrEqual(total);
    }
  });
});

describe('the age of vertices', () => {
  const moved = (s: BodyState): Patch => ({
    ...empty(s),
    totals: { nv: 7, ns: s.ns, nw: s.nw, nc: s.nc, nn: s.nn },
    vertices: {
      ids: new Uint32Array([1, 4]),
      rest: new Float32Array([3, 4, 5, 0, 0, 0, 7, 7, 7]), // the first where it was, the second elsewhere, and a new one
      normal: new Int16Array(12),
      copy: new Uint32Array(3),
    },
  });
  it('is that of the patch that brought or moved them within the body', () => {
    const s = new BodyState(body(6, 4, 0, 2));
    s.apply(moved(s), 2.5);
    expect([...s.birth.slice(0, 7)].map((t) => (t < 0 ? 'body' : t))).toEqual([
      'body',
      'body',
      'body',
      'body',
      2.5,
      'body',
      2.5,
    ]);
  });
  it('survives growth', () => {
    const s = new BodyState(body(6, 4, 0, 2));
    s.apply(moved(s), 2.5);
    const n = 2 * roomFor(7);
    const rest = new Float32Array(3 * (n - 7));
    s.apply(
      {
        ...empty(s),
        totals: { nv: n, ns: s.ns, nw: s.nw, nc: s.nc, nn: s.nn },
        vertices: { ids: new Uint32Array(0), rest, normal: new Int16Array(4 * (n - 7)), copy: new Uint32Array(n - 7) },
      },
      4,
    );
    expect([s.birth[0]! < 0, s.birth[6], s.birth[7], s.birth[n - 1]]).toEqual([true, 2.5, 4, 4]);
  });
});
