import { describe, expect, it } from 'vitest';
import { findLips, type Skin } from '../src/scene/lips';

/** A flat grid of n x n squares with unit sides in the plane z = 0, seen from above; `cut`: vertices that are doubled, for triangles on the far side of y = `at`. */
function grid(n: number, at: number, cut: (x: number) => boolean): Skin & { over: Map<number, number> } {
  const rest: number[] = [],
    skin: number[] = [],
    over = new Map<number, number>();
  for (let y = 0; y <= n; y++) for (let x = 0; x <= n; x++) rest.push(x, y, 0);
  for (let x = 0; x <= n; x++) {
    if (!cut(x)) continue;
    over.set(at * (n + 1) + x, rest.length / 3);
    rest.push(x, at, 0);
  }
  for (let y = 0; y < n; y++) {
    for (let x = 0; x < n; x++) {
      const v = [y * (n + 1) + x, y * (n + 1) + x + 1, (y + 1) * (n + 1) + x + 1, (y + 1) * (n + 1) + x].map((i) =>
        y >= at ? (over.get(i) ?? i) : i,
      );
      skin.push(v[0]!, v[1]!, v[2]!, v[0]!, v[2]!, v[3]!);
    }
  }
  return {
    rest: Float32Array.from(rest),
    skin: Uint32Array.from(skin),
    nv: rest.length / 3,
    ns: skin.length / 3,
    over,
  };
}

describe('lips', () => {
  it('of an uncut skin there are none, whatever its border', () => {
    expect(findLips(grid(4, 2, () => false)).count).toBe(0);
    expect(findLips({ rest: new Float32Array(0), skin: new Uint32Array(0), nv: 0, ns: 0 }).count).toBe(0);
  });

  it('of a slit that ends inside are both sides, and point away from it', () => {
    const n = 6,
      s = grid(n, 3, (x) => x < 4),
      lips = findLips(s);
    const sorted = (l: typeof lips): string[] =>
      Array.from(
        { length: 2 * l.count },
        (_, i) => `${l.ends[i]} ${l.others[i]} ${l.inward.subarray(3 * i, 3 * i + 3).join(' ')}`,
      ).sort();
    expect(sorted(findLips(s, (n + 1) ** 2))).toEqual(sorted(lips)); // told what was there before the cut
    expect(lips.count).toBe(2 * 4); // edges 0-1, 1-2, 2-3, 3-4 on two sides
    for (let i = 0; i < 2 * lips.count; i++) {
      const v = lips.ends[i]!,
        w = lips.others[i]!,
        x = s.rest[3 * v]!;
      expect([s.rest[3 * w], s.rest[3 * w + 1]]).toEqual([x, 3]);
      expect(w === v).toBe(x === 4); // the tip
      const side = v >= (n + 1) ** 2 ? 1 : -1;
      expect([...lips.inward.subarray(3 * i, 3 * i + 3)].map((k) => Math.round(1e6 * k) / 1e6 + 0)).toEqual(
        x === 4 ? [0, 0, 0] : [0, side, 0],
      );
    }
  });

  it('are found where another cut has divided one side only', () => {
    const s = grid(4, 2, () => true),
      rest = [...s.rest, 1.5, 2, 0, 1.5, 2, 0],
      skin = [...s.skin];
    // The near side's triangle at the edge 1-2 falls into two along x = 1.5, whose vertices at the lip are apart.
    const a = 2 * 5 + 1,
      b = a + 1,
      t = s.skin.findIndex(
        (_, i) =>
          i % 3 === 0 &&
          [0, 1, 2].every((k) => s.skin[i + k]! < 25) &&
          [0, 1, 2].some((k) => s.skin[i + k] === b && s.skin[i + ((k + 1) % 3)] === a),
      );
    const third = [0, 1, 2].map((k) => s.skin[t + k]!).find((v) => v !== a && v !== b)!;
    skin.splice(t, 3, b, s.nv, third, s.nv + 1, a, third);
    const lips = findLips({
      rest: Float32Array.from(rest),
      skin: Uint32Array.from(skin),
      nv: s.nv + 2,
      ns: skin.length / 3,
    });
    const edges = Array.from({ length: lips.count }, (_, e) => [lips.ends[2 * e], lips.ends[2 * e + 1]]);
    for (const wanted of [
      [b, s.nv],
      [s.nv + 1, a],
      [s.over.get(a), s.over.get(b)],
    ])
      expect(edges).toContainEqual(wanted);
    expect([...lips.inward].every((x) => Number.isFinite(x) && Math.abs(x) <= 2)).toBe(true);
  });

  it('take the sign of zero for nothing', () => {
    const s = grid(4, 2, () => true),
      v = s.over.get(2 * 5)!;
    s.rest[3 * v] = -0;
    expect(findLips(s).count).toBe(2 * 4);
  });
});
