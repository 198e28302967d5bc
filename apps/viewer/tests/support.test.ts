import { Quaternion, Vector3 } from 'three';
import { describe, expect, it } from 'vitest';
import { heldShare, type Surface } from '../src/scene/support';

/** A sheet of a metre about the origin. */
const n = 40,
  sheet = new Float32Array(
    Array.from({ length: (n + 1) ** 2 }, (_, i) => [
      (i % (n + 1)) / n - 0.5,
      Math.floor(i / (n + 1)) / n - 0.5,
      0,
    ]).flat(),
  );
const up = [0, 0, 1] as const;
/** A level rectangle, two triangles that turn either way. */
function plate(width: number, height: number, place: [number, number, number], turn = new Quaternion()): Surface {
  const x = width / 2,
    y = height / 2;
  return {
    positions: new Float32Array([-x, -y, 0, x, -y, 0, x, y, 0, -x, y, 0]),
    triangles: new Uint32Array([0, 1, 2, 0, 3, 2]),
    position: new Vector3(...place),
    turn,
  };
}
const share = (surfaces: Surface[], towards: readonly [number, number, number] = up): number =>
  heldShare(sheet, sheet.length / 3, towards, surfaces);
const about = (axis: [number, number, number], degrees: number): Quaternion =>
  new Quaternion().setFromAxisAngle(new Vector3(...axis), (degrees * Math.PI) / 180);

describe('what holds a body that comes apart', () => {
  it('is what lies below it, by its part of the outline', () => {
    expect(share([])).toBe(0);
    expect(share([plate(2, 2, [0, 0, -0.3])])).toBe(1);
    expect(share([plate(2, 2, [0, 0, 0.3])])).toBe(0);
    expect(share([plate(2, 2, [5, 0, -0.3])])).toBe(0);
    expect(share([plate(1, 2, [-0.5, 0, -0.3])])).toBeCloseTo(0.5, 1);
    expect(share([plate(1, 2, [-0.5, 0, -0.3]), plate(1, 2, [0.5, 0, -5])])).toBe(1);
  });
  it('is not steep', () => {
    expect(share([plate(4, 4, [0, 0, -1], about([1, 0, 0], 30))])).toBe(1);
    expect(share([plate(9, 9, [0, 0, -1], about([1, 0, 0], 60))])).toBe(0);
  });
  it('lies where gravity points to', () => {
    const wall = plate(2, 2, [-1, 0, 0], about([0, 1, 0], 90));
    expect(share([wall])).toBe(0);
    expect(share([wall], [3, 0, 0])).toBe(1);
    expect(share([wall], [-3, 0, 0])).toBe(0);
  });
});
