import { describe, expect, it } from 'vitest';
import { BodyState } from '../src/scene/body_state';
import { CellTextures } from '../src/scene/cell_textures';
import { facing, placeVertices, turnNormals, type Viewpoint } from '../src/scene/placed';
import { fillMarks, skinPoint } from '../src/scene/skinning';
import { between, direct, lattice, next, smoothNormal } from './lattice';

/** A body whose vertices lie anywhere in the cells of a bent lattice; `local`: their coordinates in cells. */
function scattered(count: number): { state: BodyState; cells: CellTextures; local: number[][]; normals: number[][] } {
  const d = lattice(9, 8, 1, (p) => [p[0]!, p[1]! + 0.1 * p[0]! * p[0]!, p[2]! + 0.2 * p[0]! * p[1]!]);
  const rest: number[] = [],
    normal: number[] = [],
    copy: number[] = [],
    local: number[][] = [],
    normals: number[][] = [];
  for (let i = 0; i < count; i++) {
    const c = Math.floor(next() * d.nc),
      q = [next(), next(), next()],
      n = [between(-1, 1), between(-1, 1), between(-1, 1)],
      size = Math.hypot(...n);
    rest.push(...direct(d, c, q).rest);
    normal.push(...n.map((x) => Math.round((32767 * x) / size)), 0);
    copy.push(c);
    local.push(q);
    normals.push(n);
  }
  const state = new BodyState({
    body: 1,
    version: 1,
    frames: d.frames,
    rest: new Float32Array(rest),
    normal: new Int16Array(normal),
    copy: new Uint32Array(copy),
    skin: new Uint32Array(0),
    wall: new Uint32Array(0),
    copies: d.copies,
    cells: d.cells,
    nodes: d.nodes,
    fading: { ids: new Uint32Array([1, 4]), offsets: new Float32Array([0.1, 0.2, 0.3, -1, -2, -3]) },
  } as never);
  const cells = new CellTextures();
  cells.setBody(state);
  return { state, cells, local, normals };
}

describe('places', () => {
  it('are those that skinning gives, with what fades', () => {
    const { state, cells } = scattered(400),
      place = new Float32Array(4 * state.nv);
    placeVertices(state, cells.texels, place);
    for (let v = 0; v < state.nv; v++) {
      const [x, y, z] = state.rest.subarray(3 * v, 3 * v + 3) as unknown as [number, number, number];
      const want = skinPoint(state, cells.pose, state.copy[v]!, x, y, z);
      for (let k = 0; k < 3; k++) expect(place[4 * v + k]).toBeCloseTo(want[k]! + state.offset[3 * v + k]!, 5);
      expect(place[4 * v + 3]).toBe(0);
    }
    expect(state.offset[12]).toBe(-1);
  });
  it('say how much of a place marked nodes hold', () => {
    const { state, cells, local } = scattered(200),
      place = new Float32Array(4 * state.nv);
    const marked = new Set([0, 3, 17, 40, 41, 60, 77]);
    fillMarks(state, marked, cells.pose);
    placeVertices(state, cells.texels, place);
    let some = 0;
    for (let v = 0; v < state.nv; v++) {
      let want = 0;
      for (let k = 0; k < 8; k++) {
        const w = [0, 1, 2].reduce((p, a) => p * ((k >> a) & 1 ? local[v]![a]! : 1 - local[v]![a]!), 1);
        if (marked.has(state.copies[8 * state.copy[v]! + k]!)) want += w;
      }
      expect(place[4 * v + 3]).toBeCloseTo(want, 4);
      if (want > 0) some++;
    }
    expect(some).toBeGreaterThan(20);
  });
  it('turn the normals that are wanted, and no others', () => {
    const { state, cells, local, normals } = scattered(300),
      turned = new Int16Array(4 * state.nv).fill(7),
      wanted = new Uint8Array(state.nv);
    for (let v = 0; v < state.nv; v += 2) wanted[v] = 1;
    turnNormals(state, cells.texels, wanted, turned);
    for (let v = 0; v < state.nv; v++) {
      if (v % 2) {
        expect(turned[4 * v]).toBe(7);
        continue;
      }
      const n = normals[v]!,
        want = smoothNormal(state, cells.texels.normals, state.copy[v]!, local[v]!, n);
      for (let k = 0; k < 3; k++) expect(turned[4 * v + k]! / 32767).toBeCloseTo(want[k]!, 3);
    }
  });
  it('are marked whole where a vertex is held and nodes of its cell are not', () => {
    const { state, cells } = scattered(50),
      place = new Float32Array(4 * state.nv);
    state.setMarked(new Uint32Array([3, 17, state.nv]));
    placeVertices(state, cells.texels, place);
    const marked = (): number[] => [...Array(state.nv).keys()].filter((v) => place[4 * v + 3] !== 0);
    expect(marked()).toEqual([3, 17]);
    expect(place[4 * 3 + 3]).toBe(1);
    state.setMarked(new Uint32Array([4]));
    placeVertices(state, cells.texels, place);
    expect(marked()).toEqual([4]);
  });
  it('of a dead copy are a point', () => {
    const { state, cells } = scattered(50),
      place = new Float32Array(4 * state.nv);
    state.copies.fill(0xffffffff);
    state.setFading({ ids: new Uint32Array(0), offsets: new Float32Array(0) });
    cells.update(state);
    placeVertices(state, cells.texels, place);
    const turned = new Int16Array(4 * state.nv);
    turnNormals(state, cells.texels, new Uint8Array(state.nv).fill(1), turned);
    expect(place.every((x) => x === 0)).toBe(true);
    expect(turned.every((x) => x === 0)).toBe(true);
  });
});

/** A ball of triangles, wound outwards. */
function ball(rings: number, around: number): { triangles: Uint32Array; place: Float32Array } {
  const place: number[] = [],
    triangles: number[] = [];
  for (let i = 0; i <= rings; i++)
    for (let j = 0; j < around; j++) {
      const a = (Math.PI * i) / rings,
        b = (2 * Math.PI * j) / around;
      place.push(Math.sin(a) * Math.cos(b), Math.sin(a) * Math.sin(b), Math.cos(a), 0);
    }
  for (let i = 0; i < rings; i++)
    for (let j = 0; j < around; j++) {
      const p = i * around + j,
        q = i * around + ((j + 1) % around);
      triangles.push(p, p + around, q, q, p + around, q + around);
    }
  return { triangles: new Uint32Array(triangles), place: new Float32Array(place) };
}

describe('triangles that face', () => {
  const { triangles, place } = ball(40, 60),
    count = triangles.length / 3,
    out = new Uint32Array(triangles.length);
  it('the eye of a ball are those nearer than its horizon', () => {
    const eye: Viewpoint = { x: 0, y: 0, z: 2, w: 1 };
    const n = facing(triangles, count, place, eye, 1, out);
    // From two radii one sees down to half a radius; a triangle is a twentieth high there.
    const lowest = Math.min(...Array.from(out.subarray(0, 3 * n), (v) => place[4 * v + 2]!));
    expect(lowest).toBeGreaterThan(0.4);
    expect(lowest).toBeLessThan(0.55);
    let all = 0;
    for (let t = 0; t < triangles.length; t += 3)
      if ([0, 1, 2].every((k) => place[4 * triangles[t + k]! + 2]! > 0.56)) all++;
    expect(n).toBeGreaterThanOrEqual(all);
  });
  it('a far sun and those that do not make up the whole', () => {
    const sun: Viewpoint = { x: 0.3, y: -0.2, z: 0.7, w: 0 };
    const front = facing(triangles, count, place, sun, 1, out),
      back = facing(triangles, count, place, sun, -1, out);
    expect(facing(triangles, count, place, sun, 0, out)).toBe(count);
    expect(front + back).toBeGreaterThanOrEqual(count);
    expect(front + back).toBeLessThan(count + 2 * 60 + 20); // those without area, at the poles, are on both sides
    expect(Math.abs(front - back)).toBeLessThan(0.05 * count);
  });
  it('come in their order, whole', () => {
    const n = facing(triangles, count, place, { x: 3, y: 1, z: 0, w: 1 }, 1, out);
    let at = -1;
    for (let t = 0; t < n; t++) {
      let next = at + 1;
      while (next < count && ![0, 1, 2].every((k) => triangles[3 * next + k] === out[3 * t + k])) next++;
      expect(next).toBeLessThan(count);
      at = next;
    }
  });
});
