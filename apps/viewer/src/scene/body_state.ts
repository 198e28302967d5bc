// The page's copy of a body: flat arrays with spare capacity, to which patches are applied.
import { type Range, changedRanges } from './ranges';
import type { Body, Fading, Patch, TriangleChange } from '../engine/protocol';

/** Birth of what was there before the first patch: as dry as can be. */
export const kAlways = -1e9;

type Numbers = Float32Array | Uint32Array | Int16Array;

/** Room for growth: half as much again, in whole thousands. */
export const roomFor = (records: number): number => Math.ceil(Math.max(1, 1.5 * records) / 1024) * 1024;

function grown<T extends Numbers>(old: T, items: number): T {
  const make = old.constructor as new (n: number) => T;
  const bigger = new make(items);
  bigger.set(old as never);
  return bigger;
}

/** What a patch changed, in records, and whether arrays were replaced by larger ones. */
export interface PatchEffect {
  vertices: Range[];
  skin: Range[];
  wall: Range[];
  copies: Range[];
  offsets: Range[];
  regrown: boolean;
}

export class BodyState {
  readonly body: number;
  version: number;
  readonly frames: Float32Array;
  nv = 0;
  ns = 0;
  nw = 0;
  nc = 0;
  nn = 0;
  rest: Float32Array;
  normal: Int16Array;
  copy: Uint32Array;
  offset: Float32Array; // metres beside where the copy puts a vertex: zero but for those in `fading`
  mark: Float32Array; // 1 for vertices to be hatched
  birth: Float32Array; // seconds of the body's time when a vertex came here by a patch; kAlways: it came with the body
  fading: Uint32Array = new Uint32Array(0);
  skin: Uint32Array;
  wall: Uint32Array;
  copies: Uint32Array;
  cells: Int16Array;
  nodes: Float32Array;

  constructor(b: Body) {
    this.body = b.body;
    this.version = b.version;
    this.frames = b.frames.slice();
    this.nv = b.copy.length;
    this.ns = b.skin.length / 3;
    this.nw = b.wall.length / 3;
    this.nc = b.copies.length / 8;
    this.nn = b.nodes.length / 3;
    const v = roomFor(this.nv),
      s = roomFor(this.ns),
      w = roomFor(Math.max(this.nw, this.ns / 8)),
      c = roomFor(this.nc);
    this.rest = grown(b.rest, 3 * v);
    this.normal = grown(b.normal, 4 * v);
    this.copy = grown(b.copy, v);
    this.offset = new Float32Array(3 * v);
    this.birth = new Float32Array(v).fill(kAlways);
    this.mark = new Float32Array(v);
    this.skin = grown(b.skin, 3 * s);
    this.wall = grown(b.wall, 3 * w);
    this.copies = grown(b.copies, 8 * c);
    this.cells = grown(b.cells, 4 * c);
    this.nodes = grown(b.nodes, 3 * roomFor(this.nn));
    this.setFading(b.fading);
  }

  /** Applies the change to the next version. The patch must be for this body and version. `time`: of the body, seconds. */
  apply(p: Patch, time = 0): PatchEffect {
    if (p.body !== this.body || p.from !== this.version) throw new Error('patch for another version');
    const t = p.totals;
    const starts: [number, number, number, string][] = [
      [this.nv, t.nv, p.vertices.copy.length - p.vertices.ids.length, 'vertices'],
      [this.ns, t.ns, p.skin.triangles.length / 3 - p.skin.ids.length, 'skin triangles'],
      [this.nw, t.nw, p.wall.triangles.length / 3 - p.wall.ids.length, 'wall triangles'],
      [this.nc, t.nc, p.copies.copies.length / 8 - p.copies.ids.length, 'copies'],
    ];
    for (const [old, total, appended, what] of starts) {
      if (Math.min(old, total) + appended !== total) {
        throw new Error(`patch appends ${appended} ${what} to ${old} and calls that ${total}`);
      }
    }
    const regrown = this.reserve(t.nv, t.ns, t.nw, t.nc, t.nn);
    const v0 = Math.min(this.nv, t.nv),
      s0 = Math.min(this.ns, t.ns),
      w0 = Math.min(this.nw, t.nw);
    const c0 = Math.min(this.nc, t.nc);

    const v = p.vertices;
    this.born(v.ids, v.rest, v0, t.nv, time);
    scatter(this.rest, 3, v.ids, v.rest, v0);
    scatter(this.normal, 4, v.ids, v.normal, v0);
    scatter(this.copy, 1, v.ids, v.copy, v0);
    const triangles = (target: Uint32Array, change: TriangleChange, start: number): void =>
      scatter(target, 3, change.ids, change.triangles, start);
    triangles(this.skin, p.skin, s0);
    triangles(this.wall, p.wall, w0);
    scatter(this.copies, 8, p.copies.ids, p.copies.copies, c0);
    scatter(this.cells, 4, p.copies.ids, p.copies.cells, c0);
    this.nodes.set(p.nodes);

    this.nv = t.nv;
    this.ns = t.ns;
    this.nw = t.nw;
    this.nc = t.nc;
    this.nn = t.nn;
    this.version = p.to;
    const offsets = this.setFading(p.fading);
    return {
      vertices: changedRanges(v.ids, v0, t.nv),
      skin: changedRanges(p.skin.ids, s0, t.ns),
      wall: changedRanges(p.wall.ids, w0, t.nw),
      copies: changedRanges(p.copies.ids, c0, t.nc),
      offsets,
      regrown,
    };
  }

  /** Vertices that are new or come to another place of the body are as old as the patch. Before their places are set. */
  private born(ids: Uint32Array, rest: Float32Array, from: number, to: number, time: number): void {
    for (let i = 0; i < ids.length; i++) {
      const o = 3 * ids[i]!;
      const stays =
        this.rest[o] === rest[3 * i] && this.rest[o + 1] === rest[3 * i + 1] && this.rest[o + 2] === rest[3 * i + 2];
      if (!stays) this.birth[ids[i]!] = time;
    }
    this.birth.fill(time, from, to);
  }

  /** Takes over all offsets; those of other vertices end. The vertices that this may change, those that are gone included; none where all are as before. */
  setFading(f: Fading): Range[] {
    if (f.ids.length > 0 && f.ids[f.ids.length - 1]! >= this.nv)
      throw new Error(`offset of vertex ${f.ids[f.ids.length - 1]} of ${this.nv}`);
    if (this.hasFading(f)) return [];
    for (const i of this.fading) this.offset.fill(0, 3 * i, 3 * i + 3);
    scatter(this.offset, 3, f.ids, f.offsets, 0);
    const changed = new Uint32Array(this.fading.length + f.ids.length);
    changed.set(this.fading);
    changed.set(f.ids, this.fading.length);
    this.fading = f.ids.slice();
    return changedRanges(changed.sort(), this.nv, this.nv);
  }

  /** Vertices to be hatched, in place of those that were. */
  setMarked(vertices: Uint32Array): void {
    this.mark.fill(0);
    for (const v of vertices) if (v < this.nv) this.mark[v] = 1;
  }

  /** Are these the offsets that are there? */
  private hasFading(f: Fading): boolean {
    return (
      f.ids.length === this.fading.length &&
      f.ids.every((id, i) => {
        const [o, n] = [3 * id, 3 * i];
        return (
          id === this.fading[i] &&
          this.offset[o] === f.offsets[n] &&
          this.offset[o + 1] === f.offsets[n + 1] &&
          this.offset[o + 2] === f.offsets[n + 2]
        );
      })
    );
  }

  private reserve(nv: number, ns: number, nw: number, nc: number, nn: number): boolean {
    let regrown = false;
    if (nv > this.copy.length) {
      const v = roomFor(nv);
      this.rest = grown(this.rest, 3 * v);
      this.normal = grown(this.normal, 4 * v);
      this.copy = grown(this.copy, v);
      this.offset = grown(this.offset, 3 * v);
      this.mark = grown(this.mark, v);
      this.birth = grown(this.birth, v);
      regrown = true;
    }
    if (3 * ns > this.skin.length) {
      this.skin = grown(this.skin, 3 * roomFor(ns));
      regrown = true;
    }
    if (3 * nw > this.wall.length) {
      this.wall = grown(this.wall, 3 * roomFor(nw));
      regrown = true;
    }
    if (8 * nc > this.copies.length) {
      const c = roomFor(nc);
      this.copies = grown(this.copies, 8 * c);
      this.cells = grown(this.cells, 4 * c);
    }
    if (3 * nn > this.nodes.length) this.nodes = grown(this.nodes, 3 * roomFor(nn));
    return regrown;
  }
}

/** Writes values[0..|ids|) to the records named by ids, and the rest from record `start` on. */
function scatter<T extends Numbers>(target: T, size: number, ids: Uint32Array, values: T, start: number): void {
  for (let i = 0; i < ids.length; i++) {
    const to = size * ids[i]!,
      from = size * i;
    for (let k = 0; k < size; k++) target[to + k] = values[from + k]!;
  }
  target.set(values.subarray(size * ids.length) as never, size * start);
}
