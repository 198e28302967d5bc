// A made-up body for the mock engine: a slab of shape-matched cells that can be cut along straight lines. It only has to
// send what a real engine sends; the real methods are in the library.
import { ShapeUtils, Vector2 } from 'three';
import { makeFrame } from './frames';
import { kNoNode, type Body, type Overlay, type Patch, type TriangleChange, type Vec3 } from './protocol';

export interface MockOptions {
  segments: number;
  rings: number;
}

interface Surface {
  rest: number[];
  normal: number[];
  copy: number[];
  skin: number[];
  wall: number[];
}
interface Topology {
  visual: Surface;
  collision: Surface;
  copies: number[];
  cells: number[];
  version: number;
}

const cloneSurface = (s: Surface): Surface => ({
  rest: s.rest.slice(),
  normal: s.normal.slice(),
  copy: s.copy.slice(),
  skin: s.skin.slice(),
  wall: s.wall.slice(),
});
const cloneTopology = (t: Topology): Topology => ({
  visual: cloneSurface(t.visual),
  collision: cloneSurface(t.collision),
  copies: t.copies.slice(),
  cells: t.cells.slice(),
  version: t.version,
});

export interface SurfaceHit {
  triangle: number;
  t: number;
  point: Vec3;
  normal: Vec3;
  rest: Vec3;
  copy: number;
}
interface Hold {
  copy: number;
  weights: number[];
  target: number[];
  kept: boolean;
}

const kThickness = 0.022;

/** Radius of the outline in a direction. */
function outline(a: number): number {
  const c = Math.cos(a),
    s = Math.sin(a),
    e = 2.5;
  const r = (Math.abs(c / 0.1) ** e + Math.abs(s / 0.066) ** e) ** (-1 / e);
  return r * (1 + 0.05 * Math.cos(2 * a + 0.7) + 0.04 * Math.sin(3 * a + 0.4));
}

/** Radius (0 to 1) and height of the profile, from the middle of the top (0) over the rim (1) to the bottom (2). */
function profile(u: number): [number, number] {
  const half = kThickness / 2,
    v = u <= 1 ? u : 2 - u,
    flat = 0.78;
  const sign = u <= 1 ? 1 : -1;
  if (v <= flat) return [(v / flat) * 0.9, sign * half * (1 - 0.06 * (v / flat) ** 2)];
  const a = ((v - flat) / (1 - flat)) * (Math.PI / 2);
  return [0.9 + 0.1 * Math.sin(a), sign * half * 0.94 * Math.cos(a)];
}

export class MockBody {
  readonly cellSize = 0.0215;
  readonly origin: Vec3;
  private readonly cellCount: [number, number];
  topology: Topology;
  positions: number[] = [];
  private velocities: number[] = [];
  private restNodes: number[] = [];
  private pinned: boolean[] = [];
  holds: Hold[] = [];
  gravity: [number, number, number] = [0, 0, -1];
  stiffness = 0.95;

  constructor(options: MockOptions) {
    const h = this.cellSize;
    this.cellCount = [11, 8];
    this.origin = [-5.5 * h, -4 * h, (-h / 2) * 1.1];
    const visual = this.slab(options.segments, options.rings);
    const collision = this.disc(18, 4);
    const cells: number[] = [],
      copies: number[] = [],
      index = new Map<string, number>(),
      nodes = new Map<string, number>();
    const use = (x: number, y: number): number => {
      const i = Math.max(0, Math.min(this.cellCount[0] - 1, Math.floor((x - this.origin[0]) / h)));
      const j = Math.max(0, Math.min(this.cellCount[1] - 1, Math.floor((y - this.origin[1]) / h)));
      const key = `${i} ${j}`;
      let c = index.get(key);
      if (c === undefined) {
        c = cells.length / 4;
        index.set(key, c);
        cells.push(i, j, 0, 0);
        for (let k = 0; k < 8; k++) {
          const p = [i + (k & 1), j + ((k >> 1) & 1), k >> 2],
            nk = p.join(' ');
          let n = nodes.get(nk);
          if (n === undefined) {
            n = this.positions.length / 3;
            nodes.set(nk, n);
            this.positions.push(
              this.origin[0] + h * p[0]!,
              this.origin[1] + h * p[1]!,
              this.origin[2] + 1.1 * h * p[2]!,
            );
          }
          copies.push(n);
        }
      }
      return c;
    };
    for (const s of [visual, collision]) {
      for (let v = 0; v < s.rest.length; v += 3) s.copy.push(use(s.rest[v]!, s.rest[v + 1]!));
    }
    this.restNodes = this.positions.slice();
    this.velocities = this.positions.map(() => 0);
    this.pinned = [];
    for (let n = 0; n < this.positions.length; n += 3) this.pinned.push(this.positions[n + 1]! > 0.03);
    this.topology = { visual, collision, copies, cells, version: 1 };
  }

  private slab(segments: number, rings: number): Surface {
    const rest: number[] = [],
      skin: number[] = [];
    const ring = (u: number): void => {
      const [r, z] = profile(u);
      for (let i = 0; i < segments; i++) {
        const a = (2 * Math.PI * i) / segments,
          b = outline(a) * r;
        const bump = 0.0007 * Math.sin(61 * b * Math.cos(a) + 1) * Math.cos(83 * b * Math.sin(a));
        rest.push(b * Math.cos(a), b * Math.sin(a), z + (z > 0 ? bump : 0));
      }
    };
    rest.push(0, 0, profile(0)[1]);
    const count = 2 * rings - 1;
    for (let k = 1; k <= count; k++) ring(k / rings);
    rest.push(0, 0, profile(2)[1]);
    const at = (k: number, i: number): number => 1 + (k - 1) * segments + (i % segments),
      end = 1 + count * segments;
    for (let i = 0; i < segments; i++) {
      skin.push(0, at(1, i), at(1, i + 1));
      for (let k = 1; k < count; k++) {
        skin.push(at(k, i), at(k + 1, i), at(k + 1, i + 1), at(k, i), at(k + 1, i + 1), at(k, i + 1));
      }
      skin.push(at(count, i), end, at(count, i + 1));
    }
    return { rest, normal: vertexNormals(rest, skin), copy: [], skin, wall: [] };
  }

  private disc(segments: number, rings: number): Surface {
    const rest: number[] = [0, 0, 0],
      skin: number[] = [];
    for (let k = 1; k <= rings; k++) {
      for (let i = 0; i < segments; i++) {
        const a = (2 * Math.PI * i) / segments,
          b = (0.98 * outline(a) * k) / rings;
        rest.push(b * Math.cos(a), b * Math.sin(a), 0);
      }
    }
    const at = (k: number, i: number): number => 1 + (k - 1) * segments + (i % segments);
    for (let i = 0; i < segments; i++) {
      skin.push(0, at(1, i), at(1, i + 1));
      for (let k = 1; k < rings; k++) {
        skin.push(at(k, i), at(k + 1, i), at(k + 1, i + 1), at(k, i), at(k + 1, i + 1), at(k, i + 1));
      }
    }
    return { rest, normal: vertexNormals(rest, skin), copy: [], skin, wall: [] };
  }

  // -------------------------------------------------------------------------------------------------------------------
  // Motion

  /** One step: every cell pulls its nodes towards the rigid placement that fits them best. */
  step(dt: number): void {
    const p = this.positions,
      v = this.velocities,
      { copies } = this.topology;
    const before = p.slice();
    for (let n = 0; n < p.length / 3; n++) {
      for (let k = 0; k < 3; k++) {
        const i = 3 * n + k;
        if (this.pinned[n]) continue;
        v[i] = (v[i]! + dt * this.gravity[k]!) * 0.994;
        p[i]! += dt * v[i]!;
      }
    }
    for (let round = 0; round < 12; round++) {
      const goal = new Float64Array(p.length),
        count = new Float64Array(p.length / 3);
      for (let c = 0; c < copies.length; c += 8) this.matchCell(c, goal, count);
      for (let n = 0; n < count.length; n++) {
        if (this.pinned[n] || count[n] === 0) continue;
        for (let k = 0; k < 3; k++) p[3 * n + k]! += this.stiffness * (goal[3 * n + k]! / count[n]! - p[3 * n + k]!);
      }
      for (const hold of this.holds) {
        const at = this.holdPoint(hold);
        for (let k = 0; k < 8; k++) {
          const n = copies[8 * hold.copy + k]!;
          if (this.pinned[n]) continue;
          for (let d = 0; d < 3; d++)
            p[3 * n + d]! += 0.4 * Math.min(1, 3 * hold.weights[k]!) * (hold.target[d]! - at[d]!);
        }
      }
    }
    for (let i = 0; i < p.length; i++) v[i] = (p[i]! - before[i]!) / dt;
  }

  private matchCell(c: number, goal: Float64Array, count: Float64Array): void {
    const p = this.positions,
      q = this.restNodes,
      { copies } = this.topology;
    const m = [0, 0, 0],
      r = [0, 0, 0];
    for (let k = 0; k < 8; k++) {
      const n = 3 * copies[c + k]!;
      for (let d = 0; d < 3; d++) {
        m[d]! += p[n + d]! / 8;
        r[d]! += q[n + d]! / 8;
      }
    }
    const a = [0, 0, 0, 0, 0, 0, 0, 0, 0];
    for (let k = 0; k < 8; k++) {
      const n = 3 * copies[c + k]!;
      for (let i = 0; i < 3; i++)
        for (let j = 0; j < 3; j++) a[3 * i + j]! += (p[n + i]! - m[i]!) * (q[n + j]! - r[j]!);
    }
    const R = rotationOf(a);
    for (let k = 0; k < 8; k++) {
      const node = copies[c + k]!,
        n = 3 * node;
      for (let i = 0; i < 3; i++) {
        let x = m[i]!;
        for (let j = 0; j < 3; j++) x += R[3 * i + j]! * (q[n + j]! - r[j]!);
        goal[n + i]! += x;
      }
      count[node]!++;
    }
  }

  holdPoint(hold: Hold): [number, number, number] {
    const out: [number, number, number] = [0, 0, 0];
    for (let k = 0; k < 8; k++) {
      const n = 3 * this.topology.copies[8 * hold.copy + k]!;
      for (let d = 0; d < 3; d++) out[d]! += hold.weights[k]! * this.positions[n + d]!;
    }
    return out;
  }

  private weights(copy: number, rest: Vec3): number[] {
    const h = [this.cellSize, this.cellSize, 1.1 * this.cellSize],
      q = [0, 1, 2].map((d) => (rest[d]! - this.origin[d]!) / h[d]! - this.topology.cells[4 * copy + d]!);
    return [0, 1, 2, 3, 4, 5, 6, 7].map((k) => [0, 1, 2].reduce((w, d) => w * ((k >> d) & 1 ? q[d]! : 1 - q[d]!), 1));
  }

  /** Takes hold of the body at a hit. */
  grasp(hit: SurfaceHit): Hold {
    const hold: Hold = {
      copy: hit.copy,
      weights: this.weights(hit.copy, hit.rest),
      target: [...hit.point],
      kept: false,
    };
    this.holds.push(hold);
    return hold;
  }

  pin(copy: number, on: boolean): void {
    for (let k = 0; k < 8; k++) this.pinned[this.topology.copies[8 * copy + k]!] = on;
  }
  pinWhere(test: (x: number, y: number, z: number) => boolean): void {
    const q = this.restNodes;
    for (let n = 0; n < this.pinned.length; n++) this.pinned[n] = test(q[3 * n]!, q[3 * n + 1]!, q[3 * n + 2]!);
  }

  private current(s: Surface): Float64Array {
    const out = new Float64Array(s.rest.length),
      h = this.cellSize,
      { copies, cells } = this.topology,
      p = this.positions;
    for (let v = 0; v < s.copy.length; v++) {
      const c = s.copy[v]!;
      const x = (s.rest[3 * v]! - this.origin[0]) / h - cells[4 * c]!,
        y = (s.rest[3 * v + 1]! - this.origin[1]) / h - cells[4 * c + 1]!;
      const z = (s.rest[3 * v + 2]! - this.origin[2]) / (1.1 * h) - cells[4 * c + 2]!;
      for (let k = 0; k < 8; k++) {
        const w = (k & 1 ? x : 1 - x) * (k & 2 ? y : 1 - y) * (k & 4 ? z : 1 - z),
          n = 3 * copies[8 * c + k]!;
        for (let d = 0; d < 3; d++) out[3 * v + d]! += w * p[n + d]!;
      }
    }
    return out;
  }

  /** First skin or wall triangle that a ray meets. */
  intersect(origin: Vec3, direction: Vec3): SurfaceHit | null {
    const s = this.topology.visual,
      x = this.current(s);
    let best: SurfaceHit | null = null;
    for (const list of [s.skin, s.wall]) {
      for (let t = 0; t < list.length; t += 3) {
        const a = 3 * list[t]!,
          b = 3 * list[t + 1]!,
          c = 3 * list[t + 2]!;
        const e1 = [x[b]! - x[a]!, x[b + 1]! - x[a + 1]!, x[b + 2]! - x[a + 2]!];
        const e2 = [x[c]! - x[a]!, x[c + 1]! - x[a + 1]!, x[c + 2]! - x[a + 2]!];
        const n = cross(e1, e2),
          det = -dot(direction, n);
        if (Math.abs(det) < 1e-20) continue;
        const o = [origin[0] - x[a]!, origin[1] - x[a + 1]!, origin[2] - x[a + 2]!];
        const distance = dot(o, n) / det;
        if (distance <= 0 || (best && distance >= best.t)) continue;
        const m = cross(o, direction as unknown as number[]);
        const u = dot(e2, m) / det,
          v = -dot(e1, m) / det;
        if (u < 0 || v < 0 || u + v > 1) continue;
        const w = 1 - u - v,
          length = Math.hypot(...n);
        const at = (d: number): number => w * s.rest[a + d]! + u * s.rest[b + d]! + v * s.rest[c + d]!;
        best = {
          triangle: t / 3,
          t: distance,
          point: [
            origin[0] + distance * direction[0],
            origin[1] + distance * direction[1],
            origin[2] + distance * direction[2],
          ],
          normal: [n[0]! / length, n[1]! / length, n[2]! / length],
          rest: [at(0), at(1), at(2)],
          copy: s.copy[a / 3]!,
        };
      }
    }
    return best;
  }

  // -------------------------------------------------------------------------------------------------------------------
  // Cutting

  snapshot(): Topology {
    return cloneTopology(this.topology);
  }

  /** Makes another topology the current one; nodes that it does not have are forgotten. */
  restore(t: Topology): void {
    this.topology = cloneTopology(t);
    let nodes = 0;
    for (const n of t.copies) if (n !== kNoNode) nodes = Math.max(nodes, n + 1);
    // A redo brings nodes back: they start where they were at rest, moved like their cell's other nodes on average.
    while (this.pinned.length < nodes) this.recallNode(this.pinned.length);
    this.positions.length = this.velocities.length = this.restNodes.length = 3 * nodes;
    this.pinned.length = nodes;
  }

  /** Gives node n (the next one) a position again: that of the twin with the same rest position. */
  private recallNode(n: number): void {
    const { copies, cells } = this.topology;
    const c = Math.floor(copies.indexOf(n) / 8),
      k = copies.indexOf(n) % 8,
      h = this.cellSize;
    const rest = [0, 1, 2].map((d) => this.origin[d]! + (d === 2 ? 1.1 : 1) * h * (cells[4 * c + d]! + ((k >> d) & 1)));
    let like = 0,
      near = Infinity;
    for (let i = 0; i < n; i++) {
      const d = Math.hypot(...rest.map((x, j) => x - this.restNodes[3 * i + j]!));
      if (d < near) {
        near = d;
        like = i;
      }
    }
    this.restNodes.push(...rest);
    for (const list of [this.positions, this.velocities])
      list.push(list[3 * like]!, list[3 * like + 1]!, list[3 * like + 2]!);
    this.pinned.push(this.pinned[like]!);
  }

  /** Cuts straight from a to b (rest coordinates, x and y); ends inside the body snap to cell borders. Triangles cut. */
  cut(a: readonly [number, number], b: readonly [number, number]): number {
    const length = Math.hypot(b[0] - a[0], b[1] - a[1]);
    if (length < 1e-6) return 0;
    const dx = (b[0] - a[0]) / length,
      dy = (b[1] - a[1]) / length,
      { copies, cells, visual } = this.topology;
    const along = (x: number, y: number): number => (x - a[0]) * dx + (y - a[1]) * dy;
    const side = (x: number, y: number): number => (y - a[1]) * dx - (x - a[0]) * dy || 1e-12;

    // Copies that the line crosses, where they hold material on both sides.
    const left = new Set<number>(),
      right = new Set<number>();
    for (const s of [visual, this.topology.collision]) {
      s.copy.forEach((c, v) => (side(s.rest[3 * v]!, s.rest[3 * v + 1]!) < 0 ? left : right).add(c));
    }
    const crossed: { copy: number; enter: number; exit: number }[] = [];
    const oneSided: { copy: number; enter: number; exit: number }[] = [];
    for (const c of new Set([...left, ...right])) {
      const x0 = this.origin[0] + this.cellSize * cells[4 * c]!,
        y0 = this.origin[1] + this.cellSize * cells[4 * c + 1]!;
      let enter = -Infinity,
        exit = Infinity;
      for (const [lo, o, d] of [
        [x0, a[0], dx],
        [y0, a[1], dy],
      ] as const) {
        if (Math.abs(d) < 1e-12) {
          if (o < lo || o > lo + this.cellSize) exit = -Infinity;
          continue;
        }
        const t0 = (lo - o) / d,
          t1 = (lo + this.cellSize - o) / d;
        enter = Math.max(enter, Math.min(t0, t1));
        exit = Math.min(exit, Math.max(t0, t1));
      }
      if (exit - enter > 1e-9) (left.has(c) && right.has(c) ? crossed : oneSided).push({ copy: c, enter, exit });
    }
    const inside = crossed.filter((c) => c.enter > -0.5 * this.cellSize && c.exit < length + 0.5 * this.cellSize);
    if (inside.length === 0) return 0;
    // Beyond the body's border nothing stops the blade.
    const first = Math.min(...crossed.map((c) => c.enter)),
      last = Math.max(...crossed.map((c) => c.exit));
    let from = Math.min(...inside.map((c) => c.enter)),
      to = Math.max(...inside.map((c) => c.exit));
    if (from <= first + 1e-9) from = -Infinity;
    if (to >= last - 1e-9) to = Infinity;

    // Twin nodes: the left copy of a cell has its own nodes on the right, and the other way round.
    const shared = new Set<number>(),
      isCut = new Set(inside.map((c) => c.copy));
    for (const c of crossed) if (!isCut.has(c.copy)) for (let k = 0; k < 8; k++) shared.add(copies[8 * c.copy + k]!);
    const twins = new Map<number, number>();
    const twin = (n: number): number => {
      if (shared.has(n)) return n;
      let t = twins.get(n);
      if (t === undefined) {
        t = this.pinned.length;
        twins.set(n, t);
        for (const list of [this.positions, this.velocities, this.restNodes])
          list.push(list[3 * n]!, list[3 * n + 1]!, list[3 * n + 2]!);
        this.pinned.push(this.pinned[n]!);
      }
      return t;
    };
    const other = new Map<number, number>();
    for (const { copy: c } of inside) {
      const fresh = copies.length / 8;
      other.set(c, fresh);
      for (let d = 0; d < 4; d++) cells.push(cells[4 * c + d]!);
      for (let k = 0; k < 8; k++) {
        const n = copies[8 * c + k]!,
          onLeft = side(this.restNodes[3 * n]!, this.restNodes[3 * n + 1]!) < 0;
        copies.push(onLeft ? twin(n) : n);
        if (!onLeft) copies[8 * c + k] = twin(n);
      }
    }
    // A cell that the line passes beside its material keeps one copy, but lets go of the other side.
    for (const { copy: c, enter, exit } of oneSided) {
      if (enter < from - 1e-9 || exit > to + 1e-9) continue;
      for (let k = 0; k < 8; k++) {
        const n = copies[8 * c + k]!;
        if (side(this.restNodes[3 * n]!, this.restNodes[3 * n + 1]!) < 0 !== left.has(c)) copies[8 * c + k] = twin(n);
      }
    }
    const locate = (s: number): number => {
      let best = inside[0]!.copy,
        gap = Infinity;
      for (const c of inside) {
        const g = Math.max(c.enter - s, s - c.exit);
        if (g < gap) {
          gap = g;
          best = c.copy;
        }
      }
      return best;
    };
    const line = { along, side, from, to, locate, other, normal: [-dy, dx, 0] };
    splitSurface(this.topology.collision, line, false);
    const count = splitSurface(visual, line, true);
    this.topology.version++;
    return count;
  }

  pieces(): number {
    const { copies } = this.topology,
      parent = new Map<number, number>();
    const find = (n: number): number => {
      let r = n;
      while (parent.get(r) !== r) r = parent.get(r)!;
      while (parent.get(n) !== r) {
        const next = parent.get(n)!;
        parent.set(n, r);
        n = next;
      }
      return r;
    };
    for (let c = 0; c < copies.length; c += 8) {
      for (let k = 0; k < 8; k++) if (!parent.has(copies[c + k]!)) parent.set(copies[c + k]!, copies[c + k]!);
      for (let k = 1; k < 8; k++) parent.set(find(copies[c + k]!), find(copies[c]!));
    }
    return new Set([...parent.keys()].map(find)).size;
  }

  // -------------------------------------------------------------------------------------------------------------------
  // Messages

  bodyMessage(): Body {
    const t = this.topology,
      s = t.visual,
      h = this.cellSize;
    return {
      type: 'body',
      body: 1,
      version: t.version,
      frames: makeFrame(this.origin, [1, 0, 0, 0, 1, 0, 0, 0, 1], [h, h, 1.1 * h]),
      rest: new Float32Array(s.rest),
      normal: packNormals(s.normal),
      copy: new Uint32Array(s.copy),
      skin: new Uint32Array(s.skin),
      wall: new Uint32Array(s.wall),
      copies: new Uint32Array(t.copies),
      cells: new Int16Array(t.cells),
      nodes: new Float32Array(this.positions),
      fading: { ids: new Uint32Array(0), offsets: new Float32Array(0) },
    };
  }

  /** What changed since an older (or, after an undo, newer) topology. */
  patchMessage(old: Topology, input: number): Patch {
    const now = this.topology,
      o = old.visual,
      s = now.visual;
    const v = difference([
      [o.rest, s.rest, 3],
      [o.normal, s.normal, 3],
      [o.copy, s.copy, 1],
    ]);
    const triangles = (a: number[], b: number[]): TriangleChange => {
      const d = difference([[a, b, 3]]);
      return { ids: new Uint32Array(d.ids), triangles: new Uint32Array(d.values[0]!) };
    };
    const c = difference([
      [old.copies, now.copies, 8],
      [old.cells, now.cells, 4],
    ]);
    return {
      type: 'patch',
      body: 1,
      from: old.version,
      to: now.version,
      input,
      totals: {
        nv: s.copy.length,
        ns: s.skin.length / 3,
        nw: s.wall.length / 3,
        nc: now.copies.length / 8,
        nn: this.positions.length / 3,
      },
      vertices: {
        ids: new Uint32Array(v.ids),
        rest: new Float32Array(v.values[0]!),
        normal: packNormals(v.values[1]!),
        copy: new Uint32Array(v.values[2]!),
      },
      skin: triangles(o.skin, s.skin),
      wall: triangles(o.wall, s.wall),
      copies: {
        ids: new Uint32Array(c.ids),
        copies: new Uint32Array(c.values[0]!),
        cells: new Int16Array(c.values[1]!),
      },
      nodes: new Float32Array(this.positions),
      fading: { ids: new Uint32Array(0), offsets: new Float32Array(0) },
    };
  }

  overlayMessage(): Overlay {
    const t = this.topology,
      c = t.collision,
      v = t.visual,
      links: number[] = [],
      bound: number[] = [];
    const feet: number[] = [],
      footRest: number[] = [];
    for (let i = 0; i < v.copy.length; i += Math.max(1, Math.floor(v.copy.length / 900))) {
      let best = -1,
        near = Infinity;
      for (let j = 0; j < c.copy.length; j++) {
        const d = (v.rest[3 * i]! - c.rest[3 * j]!) ** 2 + (v.rest[3 * i + 1]! - c.rest[3 * j + 1]!) ** 2;
        if (d < near && (c.copy[j] === v.copy[i] || near === Infinity)) {
          near = d;
          best = j;
        }
      }
      if (best >= 0 && near < this.cellSize ** 2) links.push(best, i);
    }
    for (let i = 0; i < v.copy.length; i += 5) {
      feet.push(i, i % 3);
      footRest.push(v.rest[3 * i]!, v.rest[3 * i + 1]!, 0);
    }
    for (let i = 0; i + 2 < v.skin.length; i += 3 * 11) bound.push(v.skin[i]!, v.skin[i + 1]!);
    return {
      type: 'overlay',
      body: 1,
      version: t.version,
      rest: new Float32Array(c.rest),
      copy: new Uint32Array(c.copy),
      triangles: new Uint32Array(c.skin),
      bound: new Uint32Array(bound),
      links: new Uint32Array(links),
      feet: new Uint32Array(feet),
      footRest: new Float32Array(footRest),
    };
  }

  counts(): {
    visualVertices: number;
    visualTriangles: number;
    collisionVertices: number;
    collisionTriangles: number;
    nodes: number;
    hexahedra: number;
  } {
    const t = this.topology;
    return {
      visualVertices: t.visual.copy.length,
      visualTriangles: (t.visual.skin.length + t.visual.wall.length) / 3,
      collisionVertices: t.collision.copy.length,
      collisionTriangles: t.collision.skin.length / 3,
      nodes: this.positions.length / 3,
      hexahedra: t.copies.length / 8,
    };
  }
}

interface CutLine {
  along(x: number, y: number): number;
  side(x: number, y: number): number;
  from: number;
  to: number;
  locate(s: number): number;
  other: Map<number, number>;
  normal: number[];
}

/** Splits the triangles of a surface along a line and (for the visual one) adds the two walls. Triangles cut. */
function splitSurface(s: Surface, line: CutLine, walls: boolean): number {
  const sides = s.copy.map((_, v) => line.side(s.rest[3 * v]!, s.rest[3 * v + 1]!));
  for (let v = 0; v < sides.length; v++) {
    const fresh = sides[v]! > 0 ? line.other.get(s.copy[v]!) : undefined;
    if (fresh !== undefined) s.copy[v] = fresh;
  }
  const add = (x: number, y: number, z: number, n: number[], copy: number): number => {
    s.rest.push(x, y, z);
    s.normal.push(n[0]!, n[1]!, n[2]!);
    s.copy.push(copy);
    return s.copy.length - 1;
  };
  interface Cross {
    left: number;
    right: number;
    x: number;
    y: number;
    z: number;
    s: number;
  }
  const crossings = new Map<string, Cross>();
  const place = (a: number, b: number): { x: number; y: number; z: number; s: number; t: number } => {
    const t = sides[a]! / (sides[a]! - sides[b]!),
      at = (d: number): number => s.rest[3 * a + d]! + t * (s.rest[3 * b + d]! - s.rest[3 * a + d]!);
    return { x: at(0), y: at(1), z: at(2), s: line.along(at(0), at(1)), t };
  };
  const crossing = (a: number, b: number): Cross => {
    if (a > b) [a, b] = [b, a];
    const key = `${a} ${b}`;
    let c = crossings.get(key);
    if (!c) {
      const p = place(a, b),
        n = [0, 1, 2].map((d) => s.normal[3 * a + d]! + p.t * (s.normal[3 * b + d]! - s.normal[3 * a + d]!));
      const copy = line.locate(p.s);
      c = { ...p, left: add(p.x, p.y, p.z, n, copy), right: add(p.x, p.y, p.z, n, line.other.get(copy)!) };
      crossings.set(key, c);
    }
    return c;
  };
  const segments: [Cross, Cross][] = [];
  let count = 0;
  for (const list of [s.skin, s.wall]) {
    const end = list.length;
    for (let t = 0; t < end; t += 3) {
      for (let k = 0; k < 3; k++) {
        const a = list[t + k]!,
          b = list[t + ((k + 1) % 3)]!,
          c = list[t + ((k + 2) % 3)]!;
        if (sides[a]! < 0 === sides[b]! < 0 || sides[a]! < 0 === sides[c]! < 0) continue; // a is alone on its side
        const p = place(a, b).s,
          q = place(a, c).s;
        if (Math.min(p, q) < line.from || Math.max(p, q) > line.to) break;
        const ab = crossing(a, b),
          ac = crossing(a, c),
          own = sides[a]! < 0 ? 'left' : 'right',
          far = own === 'left' ? 'right' : 'left';
        list.splice(t, 3, a, ab[own], ac[own]);
        list.push(ab[far], b, c, ab[far], c, ac[far]);
        segments.push([ab, ac]);
        count++;
        break;
      }
    }
  }
  if (!walls || segments.length === 0) return count;

  // Chain the segments to loops; a cut that ends in the body leaves open chains, which are joined at the tip.
  const next = new Map<Cross, Cross[]>();
  for (const [a, b] of segments) {
    next.set(a, [...(next.get(a) ?? []), b]);
    next.set(b, [...(next.get(b) ?? []), a]);
  }
  const chains: Cross[][] = [],
    seen = new Set<Cross>();
  const walk = (start: Cross): void => {
    const chain: Cross[] = [];
    for (let at: Cross | undefined = start; at; at = next.get(at)!.find((c) => !seen.has(c))) {
      seen.add(at);
      chain.push(at);
    }
    chains.push(chain);
  };
  const starts = [...next.keys()];
  const open: Cross[][] = [];
  for (const c of starts)
    if (!seen.has(c) && next.get(c)!.length === 1) {
      walk(c);
      open.push(chains.pop()!);
    }
  for (const c of starts) if (!seen.has(c)) walk(c);
  if (open.length === 2) {
    const [p, q] = open as [Cross[], Cross[]],
      e = p[p.length - 1]!;
    const near = (c: Cross): number => Math.hypot(c.s - e.s, c.z - e.z);
    if (near(q[0]!) > near(q[q.length - 1]!)) q.reverse();
    chains.push([...p, ...q]);
  } else {
    chains.push(...open);
  }
  for (const loop of chains) {
    if (loop.length < 3) continue;
    const points = loop.map((c) => new Vector2(c.s, c.z));
    const faces = ShapeUtils.triangulateShape(points, []);
    const n = line.normal,
      back = n.map((x) => -x);
    const leftIds = loop.map((c) => add(c.x, c.y, c.z, n, s.copy[c.left]!));
    const rightIds = loop.map((c) => add(c.x, c.y, c.z, back, s.copy[c.right]!));
    for (const [i, j, k] of faces as [number, number, number][]) {
      const a = points[i]!,
        b = points[j]!,
        c = points[k]!;
      const area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
      // (along, z) is a right-handed pair seen from -normal.
      if (area < 0) s.wall.push(leftIds[i]!, leftIds[j]!, leftIds[k]!, rightIds[i]!, rightIds[k]!, rightIds[j]!);
      else s.wall.push(leftIds[i]!, leftIds[k]!, leftIds[j]!, rightIds[i]!, rightIds[j]!, rightIds[k]!);
    }
  }
  return count;
}

/** Ids of records that differ, and their values followed by the appended ones. */
function difference(columns: [number[], number[], number][]): { ids: number[]; values: number[][] } {
  const [a0, b0, n0] = columns[0]!,
    old = a0.length / n0,
    now = b0.length / n0,
    shared = Math.min(old, now);
  const ids: number[] = [];
  for (let i = 0; i < shared; i++) {
    if (
      columns.some(([a, b, n]) => {
        for (let k = n * i; k < n * i + n; k++) if (a[k] !== b[k]) return true;
        return false;
      })
    )
      ids.push(i);
  }
  const values = columns.map(([, b, n]) => {
    const out: number[] = [];
    for (const i of ids) for (let k = 0; k < n; k++) out.push(b[n * i + k]!);
    for (let k = n * shared; k < n * now; k++) out.push(b[k]!);
    return out;
  });
  return { ids, values };
}

const dot = (a: readonly number[], b: readonly number[]): number => a[0]! * b[0]! + a[1]! * b[1]! + a[2]! * b[2]!;
const cross = (a: readonly number[], b: readonly number[]): number[] => [
  a[1]! * b[2]! - a[2]! * b[1]!,
  a[2]! * b[0]! - a[0]! * b[2]!,
  a[0]! * b[1]! - a[1]! * b[0]!,
];

function vertexNormals(rest: number[], triangles: number[]): number[] {
  const out = rest.map(() => 0);
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = [3 * triangles[t]!, 3 * triangles[t + 1]!, 3 * triangles[t + 2]!];
    const n = cross(
      [0, 1, 2].map((d) => rest[b + d]! - rest[a + d]!),
      [0, 1, 2].map((d) => rest[c + d]! - rest[a + d]!),
    );
    for (const v of [a, b, c]) for (let d = 0; d < 3; d++) out[v + d]! += n[d]!;
  }
  for (let v = 0; v < out.length; v += 3) {
    const l = Math.hypot(out[v]!, out[v + 1]!, out[v + 2]!) || 1;
    for (let d = 0; d < 3; d++) out[v + d]! /= l;
  }
  return out;
}

export function packNormals(n: number[]): Int16Array {
  const out = new Int16Array((n.length / 3) * 4);
  for (let v = 0; v < n.length / 3; v++) {
    const l = Math.hypot(n[3 * v]!, n[3 * v + 1]!, n[3 * v + 2]!) || 1;
    for (let d = 0; d < 3; d++) out[4 * v + d] = Math.round((32767 * n[3 * v + d]!) / l);
  }
  return out;
}

/** Rotation nearest to a 3 x 3 matrix (rows), by Newton's iteration for the polar factor. */
export function rotationOf(a: number[]): number[] {
  const size = Math.hypot(...a);
  if (size < 1e-30) return [1, 0, 0, 0, 1, 0, 0, 0, 1];
  let m = a.map((x) => x / size);
  for (let i = 0; i < 12; i++) {
    const r0 = m.slice(0, 3),
      r1 = m.slice(3, 6),
      r2 = m.slice(6, 9);
    const c = [...cross(r1, r2), ...cross(r2, r0), ...cross(r0, r1)];
    const det = dot(r0, c.slice(0, 3));
    if (Math.abs(det) < 1e-12) break;
    let change = 0;
    const next = m.map((x, k) => {
      const y = 0.5 * (x + c[k]! / det);
      change = Math.max(change, Math.abs(y - x));
      return y;
    });
    m = next;
    if (change < 1e-9) break;
  }
  return m;
}
