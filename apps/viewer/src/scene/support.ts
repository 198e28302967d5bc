// What lies below a body, and would hold what comes loose from it.
import { Quaternion, Vector3 } from 'three';

/** Triangles with where they are. */
export interface Surface {
  positions: Float32Array;
  triangles: Uint32Array;
  position: Vector3;
  turn: Quaternion;
}

// Fields across the longer side of the body's outline. Half as many: a gap as wide as a fifteenth of the body is overlooked; double: of coarse
// bodies, fields lie between their vertices.
const kFields = 32;
const kSteep = Math.SQRT1_2; // cosine of the slope at which tissue slides off: 45 degrees

/** The part of a body's outline, seen from above, under which a surface lies that is not steep: 0 to 1. `points`: of the body, three numbers each. */
export function heldShare(
  points: Float32Array,
  count: number,
  up: readonly [number, number, number],
  surfaces: Surface[],
): number {
  const z = new Vector3(...up).normalize(),
    x = new Vector3(1, 0, 0);
  if (Math.abs(z.x) > 0.9) x.set(0, 1, 0);
  x.addScaledVector(z, -x.dot(z)).normalize();
  const y = z.clone().cross(x);
  const along = (a: Vector3, i: number): number =>
    a.x * points[3 * i]! + a.y * points[3 * i + 1]! + a.z * points[3 * i + 2]!;
  const lo = [Infinity, Infinity],
    hi = [-Infinity, -Infinity];
  for (let i = 0; i < count; i++)
    [x, y].forEach((a, k) => {
      const v = along(a, i);
      if (v < lo[k]!) lo[k] = v;
      if (v > hi[k]!) hi[k] = v;
    });
  const field = Math.max(hi[0]! - lo[0]!, hi[1]! - lo[1]!) / kFields;
  if (!(field > 0)) return 0;
  const [nx, ny] = [0, 1].map((k) => Math.floor((hi[k]! - lo[k]!) / field) + 1) as [number, number];
  const top = new Float64Array(nx * ny).fill(-Infinity),
    held = new Uint8Array(nx * ny);
  for (let i = 0; i < count; i++) {
    const at = Math.floor((along(x, i) - lo[0]!) / field) + nx * Math.floor((along(y, i) - lo[1]!) / field);
    top[at] = Math.max(top[at]!, along(z, i));
  }
  const corners = [new Vector3(), new Vector3(), new Vector3()] as const,
    [a, b, c] = corners;
  for (const s of surfaces)
    for (let t = 0; t < s.triangles.length; t += 3) {
      corners.forEach((v, k) => {
        v.fromArray(s.positions, 3 * s.triangles[t + k]!)
          .applyQuaternion(s.turn)
          .add(s.position);
        v.set((v.dot(x) - lo[0]!) / field - 0.5, (v.dot(y) - lo[1]!) / field - 0.5, v.dot(z)); // middles of fields are whole
      });
      const area = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
      if (area === 0) continue;
      // Heights of the plane through the corners, as a + u x + v y.
      const u = ((b.z - a.z) * (c.y - a.y) - (c.z - a.z) * (b.y - a.y)) / area,
        v = ((b.x - a.x) * (c.z - a.z) - (c.x - a.x) * (b.z - a.z)) / area;
      if (1 / Math.hypot(1, u / field, v / field) < kSteep) continue;
      const from = (p: number, q: number, r: number): number => Math.max(0, Math.ceil(Math.min(p, q, r)));
      for (let j = from(a.y, b.y, c.y); j <= Math.min(ny - 1, Math.max(a.y, b.y, c.y)); j++)
        for (let i = from(a.x, b.x, c.x); i <= Math.min(nx - 1, Math.max(a.x, b.x, c.x)); i++) {
          const side = (p: Vector3, q: Vector3): number =>
            Math.sign(area) * ((q.x - p.x) * (j - p.y) - (q.y - p.y) * (i - p.x));
          if (side(a, b) < 0 || side(b, c) < 0 || side(c, a) < 0) continue;
          if (a.z + u * (i - a.x) + v * (j - a.y) < top[i + nx * j]!) held[i + nx * j] = 1;
        }
    }
  let all = 0,
    on = 0;
  top.forEach((h, at) => {
    if (h === -Infinity) return;
    all++;
    on += held[at]!;
  });
  return on / all;
}
