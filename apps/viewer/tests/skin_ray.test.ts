import { describe, expect, it } from 'vitest';
import { makeFrame } from '../src/engine/frames';
import { BodyState } from '../src/scene/body_state';
import { skinPlace, skinUnder } from '../src/scene/skin_ray';
import { fillPose, kTextureWidth, poseRows } from '../src/scene/skinning';

/** Two triangles in a unit cube, at z = 0.25 and as a wall at z = 0.75. */
function body(): { state: BodyState; pose: () => Float32Array } {
  const corners = (z: number): number[] => [0, 0, z, 1, 0, z, 0, 1, z];
  const state = new BodyState({
    type: 'body',
    body: 1,
    version: 1,
    frames: makeFrame([0, 0, 0], [1, 0, 0, 0, 1, 0, 0, 0, 1], [1, 1, 1]),
    rest: new Float32Array([...corners(0.25), ...corners(0.75)]),
    normal: new Int16Array(24),
    copy: new Uint32Array(6),
    skin: new Uint32Array([0, 1, 2]),
    wall: new Uint32Array([3, 4, 5]),
    copies: Uint32Array.from({ length: 8 }, (_, i) => i),
    cells: new Int16Array(4),
    nodes: Float32Array.from({ length: 24 }, (_, i) => (Math.floor(i / 3) >> (i % 3)) & 1),
    fading: { ids: new Uint32Array(0), offsets: new Float32Array(0) },
  });
  return {
    state,
    pose: () => {
      const pose = new Float32Array(4 * kTextureWidth * poseRows(1));
      fillPose(state, pose);
      return pose;
    },
  };
}

describe('a ray at what is drawn', () => {
  it('meets what comes first, skin or wall, and the side that it comes from', () => {
    const { state, pose } = body();
    const down = skinUnder(state, pose(), [0.2, 0.3, 2], [0, 0, -1])!,
      up = skinUnder(state, pose(), [0.2, 0.3, -2], [0, 0, 1])!;
    expect(down.corners).toEqual([3, 4, 5]);
    expect(down.normal.z).toBeCloseTo(1);
    expect(up.corners).toEqual([0, 1, 2]);
    expect(up.normal.z).toBeCloseTo(-1);
    expect(skinUnder(state, pose(), [0.9, 0.9, 2], [0, 0, -1])).toBeNull();
    expect(skinUnder(state, pose(), [0.2, 0.3, 0.8], [0, 0, 1])).toBeNull(); // it lies behind
  });
  it('finds a place that goes with the body', () => {
    const { state, pose } = body(),
      place = skinUnder(state, pose(), [0.2, 0.3, 2], [0, 0, -1])!;
    skinPlace(state, pose(), place)
      .toArray()
      .forEach((x, k) => expect(x).toBeCloseTo([0.2, 0.3, 0.75][k]!));
    // A quarter turn about x, and 5 up.
    state.nodes.set(
      Float32Array.from({ length: 24 }, (_, i) => {
        const n = Math.floor(i / 3);
        return [n & 1, -(n >> 2), ((n >> 1) & 1) + 5][i % 3]!;
      }),
    );
    skinPlace(state, pose(), place)
      .toArray()
      .forEach((x, k) => expect(x).toBeCloseTo([0.2, -0.75, 5.3][k]!));
  });
});
