import { makeFrame } from '../src/engine/frames';
import { Vector3 } from 'three';
import { describe, expect, it } from 'vitest';
import { BodyState } from '../src/scene/body_state';
import { Flight } from '../src/scene/flight';
import { ballOf, Pieces, within } from '../src/scene/pieces';
import { fillPose, poseRows, kTextureWidth } from '../src/scene/skinning';
import { Away, awayWords } from '../src/ui/out_of_view';

/** Unit cubes of four nodes' distance, each moved; `shared`: the second and the first have a face in common. */
function cubes(moves: [number, number, number][], drawn: number): BodyState {
  const n = moves.length,
    nodes: number[] = [],
    rest: number[] = [];
  moves.forEach(([x, y, z], c) => {
    for (let k = 0; k < 8; k++) nodes.push(c + (k & 1) + x, ((k >> 1) & 1) + y, ((k >> 2) & 1) + z);
    for (const [u, v] of [
      [0, 0],
      [1, 0],
      [0, 1],
    ])
      rest.push(c + u!, v!, 0.5);
  });
  return new BodyState({
    type: 'body',
    body: 1,
    version: 1,
    frames: makeFrame([0, 0, 0], [1, 0, 0, 0, 1, 0, 0, 0, 1], [1, 1, 1]),
    rest: new Float32Array(rest),
    normal: new Int16Array(12 * n),
    copy: Uint32Array.from({ length: 3 * n }, (_, i) => Math.floor(i / 3)),
    skin: Uint32Array.from({ length: 3 * drawn }, (_, i) => i),
    wall: new Uint32Array(0),
    copies: Uint32Array.from({ length: 8 * n }, (_, i) => i),
    cells: Int16Array.from({ length: 4 * n }, (_, i) => (i % 4 === 0 ? i / 4 : 0)),
    nodes: new Float32Array(nodes),
    fading: { ids: new Uint32Array(0), offsets: new Float32Array(0) },
  });
}
function places(s: BodyState): Vector3[][] {
  const pose = new Float32Array(4 * kTextureWidth * poseRows(s.nc)),
    p = new Pieces();
  fillPose(s, pose);
  p.update(s);
  return p.places(s, pose);
}

describe('pieces', () => {
  it('are where their hexahedra are', () => {
    const found = places(
      cubes(
        [
          [0, 0, 0],
          [0, 0, -7],
        ],
        2,
      ),
    );
    expect(found).toHaveLength(2);
    expect(found[0]!.every((p) => Math.abs(p.z - 0.5) < 1e-6)).toBe(true);
    expect(found[1]!.every((p) => Math.abs(p.z + 6.5) < 1e-6)).toBe(true);
    const ball = ballOf(found);
    expect(ball.center.z).toBeCloseTo(-3);
  });
  it('hang together by common nodes, and what is not drawn is none', () => {
    const s = cubes(
      [
        [0, 0, 0],
        [0, 0, 0],
        [0, 0, 0],
      ],
      2,
    );
    expect(places(s)).toHaveLength(2);
    s.copies[8] = 1;
    s.version++;
    expect(places(s)).toHaveLength(1);
  });
  it('that have fallen far away are left out, unless all have', () => {
    const at = (z: number): Vector3[] => [new Vector3(0, 0, z)];
    const o = new Vector3();
    expect(within([at(0), at(-3), at(-90)], o, 10)).toHaveLength(2);
    expect(within([at(-80), at(-90)], o, 10)).toHaveLength(2);
  });
});

describe('what is out of view', () => {
  it('is said after half a second, and no longer than it is so', () => {
    const a = new Away();
    expect([0, 250, 499].map((t) => a.at(t, 2))).toEqual([0, 0, 0]);
    expect(a.at(500, 2)).toBe(2);
    expect(a.at(750, 1)).toBe(1);
    expect(a.at(1000, 0)).toBe(0);
    expect(a.at(1250, 1)).toBe(0);
  });
  it('is said in words that fit the number', () => {
    expect(awayWords(1, 1)).toMatch(/^The body/);
    expect(awayWords(1, 3)).toBe('1 piece is out of view. Show it');
    expect(awayWords(2, 3)).toBe('2 pieces are out of view. Show them');
  });
});

describe('flight', () => {
  it('begins where the camera is, ends at the goal, and does not jump', () => {
    const v = (x: number): Vector3 => new Vector3(x, 0, 0);
    const f = new Flight({ position: v(0), target: v(1) }, 100),
      goal = { position: v(10), target: v(5) };
    let last = f.at(100, goal).position.x;
    expect(last).toBe(0);
    for (let now = 116; !f.over(now); now += 16) {
      const x = f.at(now, goal).position.x;
      expect(x - last).toBeGreaterThanOrEqual(0);
      expect(x - last).toBeLessThan(0.5);
      last = x;
    }
    expect(f.at(5000, goal)).toEqual(goal);
  });
});
