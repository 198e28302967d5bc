// Where the skin has been cut and its two sides lie at the same rest position: the lips of a slit, closed or not.

export interface Skin {
  rest: Float32Array;
  skin: Uint32Array;
  nv: number;
  ns: number;
}

/** Edges of the skin along cuts, each once for either side. */
export interface Lips {
  count: number;
  ends: Uint32Array; // 2 per edge: render vertices, in the order of the edge's triangle
  others: Uint32Array; // 2 per edge: those of the other side at the same places; the same vertex where the slit ends
  inward: Float32Array; // 6 per edge: away from the slit along the skin, at both ends, mitred; 0 where the slit ends
}

const kLongestMitre = 2;

/**
 * Vertices of the skin by place: `first` names one of them for all, `twin` another one at the same place or itself. Those
 * before `base` are all at places of their own.
 */
function samePlaces(
  { rest, skin, nv, ns }: Skin,
  base: number,
): { first: Uint32Array; twin: Uint32Array; any: boolean } {
  const first = new Uint32Array(nv),
    twin = new Uint32Array(nv),
    late = new Uint8Array(Math.max(0, nv - base));
  for (let v = 0; v < nv; v++) first[v] = twin[v] = v;
  for (let i = 0; i < 3 * ns; i++) if (skin[i]! >= base) late[skin[i]! - base] = 1;
  let slots = 64;
  while (slots < 2 * late.length) slots *= 2;
  const table = new Int32Array(slots).fill(-1),
    bits = new Int32Array(rest.buffer, rest.byteOffset, 3 * nv);
  let any = false;
  /** The slot of a place: that of a vertex that is there, or an empty one. */
  const slotOf = (v: number): number => {
    // Round numbers end in zeros, and so do their products: every bit is stirred down. The sign of zero counts for nothing.
    let h = Math.imul(bits[3 * v]! << 1, 0x9e3779b1);
    h = Math.imul(h ^ (h >>> 15) ^ (bits[3 * v + 1]! << 1), 0x9e3779b1);
    h = Math.imul(h ^ (h >>> 15) ^ (bits[3 * v + 2]! << 1), 0x9e3779b1);
    for (h = (h ^ (h >>> 15)) & (slots - 1); ; h = (h + 1) & (slots - 1)) {
      const w = table[h]!;
      if (
        w < 0 ||
        (rest[3 * w] === rest[3 * v] && rest[3 * w + 1] === rest[3 * v + 1] && rest[3 * w + 2] === rest[3 * v + 2])
      )
        return h;
    }
  };
  const join = (v: number, w: number): void => {
    first[v] = first[w]!;
    twin[v] = w;
    if (twin[w] === w) twin[w] = v;
    any = true;
  };
  for (let v = base; v < nv; v++) {
    if (late[v - base] === 0) continue;
    const h = slotOf(v);
    if (table[h]! < 0) table[h] = v;
    else join(v, table[h]!);
  }
  for (let v = 0; v < base && late.length > 0; v++) {
    const w = table[slotOf(v)]!;
    if (w >= 0) join(v, w);
  }
  return { first, twin, any };
}

/**
 * All lips of a skin. Looks at every vertex and triangle once; what it does beyond that grows with the length of the cuts.
 * `base`: so many vertices were there before the first cut; 0: not known.
 */
export function findLips(s: Skin, base = 0): Lips {
  const { rest, skin, nv, ns } = s,
    { first, twin, any } = samePlaces(s, Math.min(base, nv));
  const from: number[] = [],
    to: number[] = [],
    corner: number[] = [],
    at = new Map<number, number>();
  for (let t = 0; any && t < 3 * ns; t += 3) {
    const a = skin[t]!,
      b = skin[t + 1]!,
      c = skin[t + 2]!;
    if (twin[a] === a && twin[b] === b && twin[c] === c) continue;
    for (const [p, q, r] of [
      [a, b, c],
      [b, c, a],
      [c, a, b],
    ] as const) {
      if (twin[p] === p && twin[q] === q) continue;
      at.set(first[p]! * nv + first[q]!, from.length);
      from.push(p);
      to.push(q);
      corner.push(r);
    }
  }
  const edges: number[] = [],
    others: number[] = [];
  for (let e = 0; e < from.length; e++) {
    const a = from[e]!,
      b = to[e]!,
      o = at.get(first[b]! * nv + first[a]!);
    // Where another cut has divided one side only, the sides have no edge in common.
    if (o === undefined && (twin[a] === a || twin[b] === b)) continue;
    const x = o === undefined ? twin[a]! : to[o]!,
      y = o === undefined ? twin[b]! : from[o]!;
    if (x === a && y === b) continue;
    edges.push(e);
    others.push(x, y);
  }
  const n = edges.length,
    ends = new Uint32Array(2 * n),
    aside = new Float32Array(3 * n),
    inward = new Float32Array(6 * n);
  const sums = new Map<number, number[]>();
  edges.forEach((e, i) => {
    const a = from[e]!,
      b = to[e]!,
      d = inTriangle(rest, a, b, corner[e]!);
    ends[2 * i] = a;
    ends[2 * i + 1] = b;
    aside.set(d, 3 * i);
    for (const v of [a, b]) {
      const sum = sums.get(v);
      if (sum) {
        for (let k = 0; k < 3; k++) sum[k]! += d[k]!;
      } else sums.set(v, [...d]);
    }
  });
  for (let i = 0; i < 2 * n; i++) {
    const v = ends[i]!;
    if (others[i] === v) continue; // the slit ends here, and so does its width
    const own = aside.subarray(3 * (i >> 1), 3 * (i >> 1) + 3),
      sum = sums.get(v)!,
      square = sum[0]! ** 2 + sum[1]! ** 2 + sum[2]! ** 2;
    // The sum of two unit vectors has length 2 cos of half their angle, the mitre 1 / cos. One alone is its own mitre.
    const alone = Math.abs(square - 1) < 1e-6 && own.every((x, k) => Math.abs(x - sum[k]!) < 1e-6);
    const f = alone ? 1 : Math.min(2 / Math.max(square, 1e-9), kLongestMitre / Math.sqrt(Math.max(square, 1e-9)));
    const usable = square > 0.2;
    for (let k = 0; k < 3; k++) inward[3 * i + k] = usable ? f * sum[k]! : own[k]!;
  }
  return { count: n, ends, others: Uint32Array.from(others), inward };
}

/** Unit vector in the plane of a triangle, square to its edge a b and towards the third corner. */
function inTriangle(rest: Float32Array, a: number, b: number, c: number): [number, number, number] {
  const e = [0, 1, 2].map((k) => rest[3 * b + k]! - rest[3 * a + k]!),
    g = [0, 1, 2].map((k) => rest[3 * c + k]! - rest[3 * a + k]!);
  const along = (e[0]! * g[0]! + e[1]! * g[1]! + e[2]! * g[2]!) / Math.max(1e-30, e[0]! ** 2 + e[1]! ** 2 + e[2]! ** 2);
  const d = g.map((x, k) => x - along * e[k]!),
    l = Math.hypot(d[0]!, d[1]!, d[2]!);
  return l > 0 ? [d[0]! / l, d[1]! / l, d[2]! / l] : [0, 0, 0];
}
