import { describe, expect, it } from 'vitest';
import { fillMarks, fillPose, skinPoint } from '../src/scene/skinning';
import { between, direct, lattice, next, normalsOf, poseOf, smoothNormal } from './lattice';

describe('skinning', () => {
  it('equals trilinear interpolation, in cells and beyond their faces', () => {
    const d = lattice(9, 8, 1, (p) => p.map((x) => x + between(-0.1, 0.1)));
    const pose = poseOf(d);
    expect(d.nc).toBeGreaterThan(64); // more than one row of the texture
    for (let i = 0; i < 500; i++) {
      const c = Math.floor(next() * d.nc),
        q = [between(-0.2, 1.2), between(-0.2, 1.2), between(-0.2, 1.2)];
      const { rest, now } = direct(d, c, q);
      const p = skinPoint(d, pose, c, rest[0]!, rest[1]!, rest[2]!);
      for (let k = 0; k < 3; k++) expect(p[k]).toBeCloseTo(now[k]!, 5);
    }
  });
  it('leaves the rest shape alone', () => {
    const d = lattice(3, 2, 2, (p) => p),
      pose = poseOf(d);
    for (let i = 0; i < 100; i++) {
      const c = Math.floor(next() * d.nc),
        { rest } = direct(d, c, [next(), next(), next()]);
      const p = skinPoint(d, pose, c, rest[0]!, rest[1]!, rest[2]!);
      for (let k = 0; k < 3; k++) expect(p[k]).toBeCloseTo(rest[k]!, 5);
    }
  });
  it('makes a dead copy, or one whose nodes are gone, a point', () => {
    const d = lattice(2, 1, 1, (p) => p);
    d.copies.fill(0xffffffff, 8, 16);
    const pose = poseOf(d);
    expect(Array.from(pose.subarray(32, 64)).every((x) => x === 0)).toBe(true);
    expect(pose.some((x) => Number.isNaN(x))).toBe(false);
    d.nn = 3;
    fillPose(d, pose);
    expect(Array.from(pose.subarray(0, 32)).every((x) => x === 0)).toBe(true);
  });
});

describe('normals', () => {
  it('follow the inverse transpose of an affine map', () => {
    // F = diag(2, 0.5, 1.5) after a shear: F^-T is known in closed form.
    const F = [
      [2, 0.3, 0],
      [0, 0.5, 0],
      [0, 0, 1.5],
    ];
    const d = lattice(8, 4, 1, (p) => F.map((r) => r[0]! * p[0]! + r[1]! * p[1]! + r[2]! * p[2]!));
    const normals = normalsOf(d);
    for (let i = 0; i < 50; i++) {
      const n = [between(-1, 1), between(-1, 1), between(-1, 1)];
      const want = [n[0]! / 2, n[1]! / 0.5 - (0.3 / (2 * 0.5)) * n[0]!, n[2]! / 1.5],
        l = Math.hypot(...want);
      const got = smoothNormal(d, normals, Math.floor(next() * d.nc), [next(), next(), next()], n);
      for (let k = 0; k < 3; k++) expect(got[k]).toBeCloseTo(want[k]! / l, 4);
    }
  });
  it('are continuous across the faces of cells that share nodes', () => {
    const d = lattice(3, 1, 1, (p) => [p[0]!, p[1]!, p[2]! + 0.4 * p[0]! * p[0]!]);
    const normals = normalsOf(d);
    for (let i = 0; i < 20; i++) {
      const v = next(),
        w = next(),
        n = [0.2, -0.4, 1];
      const a = smoothNormal(d, normals, 0, [1, v, w], n),
        b = smoothNormal(d, normals, 1, [0, v, w], n);
      for (let k = 0; k < 3; k++) expect(a[k]).toBeCloseTo(b[k]!, 6);
    }
  });
  it('are not averaged over a cut, where nodes are twins', () => {
    const d = lattice(2, 1, 1, (p) => p);
    // The second cell gets nodes of its own, turned by a quarter about z.
    const twin = [...d.copies.subarray(8, 16)].flatMap((n) => {
      const p = d.restNodes[n]!;
      return [-p[1]!, p[0]!, p[2]!];
    });
    const nodes = new Float32Array([...d.nodes, ...twin]);
    const copies = d.copies.slice();
    for (let k = 0; k < 8; k++) copies[8 + k] = d.nn + k;
    const cut = { ...d, nodes, copies, nn: d.nn + 8 },
      normals = normalsOf(cut);
    const n = [1, 0, 0];
    const left = smoothNormal(cut, normals, 0, [1, 0.5, 0.5], n),
      right = smoothNormal(cut, normals, 1, [0, 0.5, 0.5], n);
    expect(left[0]).toBeCloseTo(1, 5);
    expect(right[1]).toBeCloseTo(1, 5);
  });
  it('survive dead copies', () => {
    const d = lattice(2, 1, 1, (p) => p);
    d.copies.fill(0xffffffff, 8, 16);
    expect(normalsOf(d).some((x) => !Number.isFinite(x))).toBe(false);
  });
});

describe('marks', () => {
  it("are a bit for each of a copy's nodes, and leave the pose alone", () => {
    const d = lattice(2, 2, 1, (p) => p),
      pose = poseOf(d),
      plain = pose.slice();
    const marked = new Set([d.copies[3]!, d.copies[7]!, d.copies[8]!]);
    fillMarks(d, marked, pose);
    for (let c = 0; c < d.nc; c++) {
      for (let k = 0; k < 8; k++) expect(((pose[32 * c + 15]! >> k) & 1) === 1).toBe(marked.has(d.copies[8 * c + k]!));
    }
    expect(pose.filter((x, i) => i % 32 !== 15 && x !== plain[i])).toHaveLength(0);
    fillMarks(d, null, pose);
    expect(pose).toEqual(plain);
  });
});
