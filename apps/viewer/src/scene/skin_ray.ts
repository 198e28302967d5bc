// Where a ray meets what is drawn of the body, and where that place is later.
import { Ray, Vector3 } from 'three';
import type { Vec3 } from '../engine/protocol';
import type { BodyState } from './body_state';
import { skinPoint } from './skinning';

/** A place of the drawn surface: parts of a triangle's corners. */
export interface SkinPlace {
  corners: [number, number, number];
  parts: Vec3;
  /** When it was found: a unit vector towards where the ray came from. */
  normal: Vector3;
}

/** Where a drawn vertex is; `pose`: of the copies, as the mesh is drawn. */
export function placeOf(s: BodyState, pose: Float32Array, v: number): Vector3 {
  return new Vector3(...skinPoint(s, pose, s.copy[v]!, s.rest[3 * v]!, s.rest[3 * v + 1]!, s.rest[3 * v + 2]!));
}

/** The first place along a ray; null: it meets nothing. */
export function skinUnder(s: BodyState, pose: Float32Array, origin: Vec3, direction: Vec3): SkinPlace | null {
  const ray = new Ray(new Vector3(...origin), new Vector3(...direction)),
    places = Array.from({ length: s.nv }, (_, v) => placeOf(s, pose, v)),
    at = new Vector3();
  let nearest = Infinity,
    found: SkinPlace['corners'] | null = null;
  const met = new Vector3();
  for (const [index, count] of [
    [s.skin, s.ns],
    [s.wall, s.nw],
  ] as const) {
    for (let i = 0; i < 3 * count; i += 3) {
      const [a, b, c] = [index[i]!, index[i + 1]!, index[i + 2]!];
      if (!ray.intersectTriangle(places[a]!, places[b]!, places[c]!, false, at)) continue;
      const t = at.distanceToSquared(ray.origin);
      if (t >= nearest) continue;
      nearest = t;
      met.copy(at);
      found = [a, b, c];
    }
  }
  if (!found) return null;
  const [a, b, c] = found.map((v) => places[v]!) as [Vector3, Vector3, Vector3],
    ab = b.clone().sub(a),
    ac = c.clone().sub(a),
    am = met.sub(a),
    normal = ab.clone().cross(ac),
    whole = normal.lengthSq();
  const v = am.clone().cross(ac).dot(normal) / whole,
    w = ab.clone().cross(am).dot(normal) / whole;
  normal.multiplyScalar(-Math.sign(normal.dot(ray.direction)) / Math.sqrt(whole));
  return { corners: found, parts: [1 - v - w, v, w], normal };
}

/** Where it is. */
export function skinPlace(s: BodyState, pose: Float32Array, { corners, parts }: SkinPlace): Vector3 {
  return corners.reduce((sum, v, k) => sum.addScaledVector(placeOf(s, pose, v), parts[k]!), new Vector3());
}
