// Where a body's vertices are now, found outside the shaders, and the triangles of it that a picture needs. Where the CPU is the
// GPU too, what shaders do for every vertex and corner takes most of a picture; half of a closed body's triangles face away.
import type { BodyState } from './body_state';
import { kNormalPerRow, kNormalTexels, kTextureWidth } from './skinning';

/** Poses, normals and frames as the textures hold them: see skinning.ts. */
export interface CellTexels {
  pose: Float32Array;
  normals: Float32Array;
  frames: Float32Array;
}

const kFrameFloats = 12; // three rows (x, y, z, 1) from metres to cells
const kOne = 32767; // of a normal's coordinates, in 16 bits

/** Writes the places of vertices to place (4 each: x, y, z in metres, share of marked nodes or 1 for a marked vertex), as kSkin does in shaders. */
export function placeVertices(s: BodyState, t: CellTexels, place: Float32Array): void {
  const { pose, frames } = t,
    { rest, copy, offset, mark } = s;
  for (let v = 0; v < s.nv; v++) {
    const c = 32 * copy[v]!,
      f = kFrameFloats * pose[c + 19]!,
      i = 3 * v;
    const x = rest[i]!,
      y = rest[i + 1]!,
      z = rest[i + 2]!;
    const q = frames[f]! * x + frames[f + 1]! * y + frames[f + 2]! * z + frames[f + 3]! - pose[c + 3]!;
    const r = frames[f + 4]! * x + frames[f + 5]! * y + frames[f + 6]! * z + frames[f + 7]! - pose[c + 7]!;
    const w = frames[f + 8]! * x + frames[f + 9]! * y + frames[f + 10]! * z + frames[f + 11]! - pose[c + 11]!;
    const qr = q * r,
      rw = r * w,
      qw = q * w,
      qrw = qr * w,
      o = 4 * v;
    for (let k = 0; k < 3; k++) {
      const p = c + k;
      place[o + k] =
        pose[p]! +
        pose[p + 4]! * q +
        pose[p + 8]! * r +
        pose[p + 12]! * w +
        pose[p + 16]! * qr +
        pose[p + 20]! * rw +
        pose[p + 24]! * qw +
        pose[p + 28]! * qrw +
        offset[i + k]!;
    }
    place[o + 3] = pose[c + 15] === 0 ? mark[v]! : Math.max(mark[v]!, markedShare(pose[c + 15]!, q, r, w));
  }
}

const clamp = (x: number): number => (x < 0 ? 0 : x > 1 ? 1 : x);

/** Weight of a cell's marked corners, one bit each. */
function markedShare(bits: number, q: number, r: number, w: number): number {
  const x = clamp(q),
    y = clamp(r),
    z = clamp(w);
  let share = 0;
  for (let k = 0; k < 8; k++)
    if (bits & (1 << k)) share += (k & 1 ? x : 1 - x) * (k & 2 ? y : 1 - y) * (k & 4 ? z : 1 - z);
  return share;
}

/** Writes unit normals to turned (4 each, 16 bits, the last 0) of vertices whose `wanted` is not 0, as kSkin does. */
export function turnNormals(s: BodyState, t: CellTexels, wanted: Uint8Array, turned: Int16Array): void {
  const { pose, normals, frames } = t,
    { rest, normal, copy } = s;
  for (let v = 0; v < s.nv; v++) {
    if (wanted[v] === 0) continue;
    const copyNow = copy[v]!,
      c = 32 * copyNow,
      f = kFrameFloats * pose[c + 19]!,
      i = 3 * v;
    const x = rest[i]!,
      y = rest[i + 1]!,
      z = rest[i + 2]!;
    const ax = frames[f]!,
      ay = frames[f + 1]!,
      az = frames[f + 2]!;
    const bx = frames[f + 4]!,
      by = frames[f + 5]!,
      bz = frames[f + 6]!;
    const cx = frames[f + 8]!,
      cy = frames[f + 9]!,
      cz = frames[f + 10]!;
    const q = clamp(ax * x + ay * y + az * z + frames[f + 3]! - pose[c + 3]!);
    const r = clamp(bx * x + by * y + bz * z + frames[f + 7]! - pose[c + 7]!);
    const w = clamp(cx * x + cy * y + cz * z + frames[f + 11]! - pose[c + 11]!);
    const nx = normal[4 * v]!,
      ny = normal[4 * v + 1]!,
      nz = normal[4 * v + 2]!;
    const mx = (ax * nx + ay * ny + az * nz) / Math.sqrt(ax * ax + ay * ay + az * az);
    const my = (bx * nx + by * ny + bz * nz) / Math.sqrt(bx * bx + by * by + bz * bz);
    const mz = (cx * nx + cy * ny + cz * nz) / Math.sqrt(cx * cx + cy * cy + cz * cz);
    const row = Math.floor(copyNow / kNormalPerRow);
    let g = 4 * (row * kTextureWidth + (copyNow - row * kNormalPerRow) * kNormalTexels);
    let sx = 0,
      sy = 0,
      sz = 0;
    for (let k = 0; k < 8; k++, g += 12) {
      const share = (k & 1 ? q : 1 - q) * (k & 2 ? r : 1 - r) * (k & 4 ? w : 1 - w);
      const ux = share * mx,
        uy = share * my,
        uz = share * mz;
      sx += normals[g]! * ux + normals[g + 4]! * uy + normals[g + 8]! * uz;
      sy += normals[g + 1]! * ux + normals[g + 5]! * uy + normals[g + 9]! * uz;
      sz += normals[g + 2]! * ux + normals[g + 6]! * uy + normals[g + 10]! * uz;
    }
    const length = Math.sqrt(sx * sx + sy * sy + sz * sz),
      scale = length > 0 ? kOne / length : 0;
    turned[4 * v] = scale * sx;
    turned[4 * v + 1] = scale * sy;
    turned[4 * v + 2] = scale * sz;
  }
}

/** A point (w = 1) or, infinitely far, a direction (w = 0). */
export interface Viewpoint {
  x: number;
  y: number;
  z: number;
  w: 0 | 1;
}

// Sine of the angle to a triangle's plane below which both of its sides count as seen: what rounding decides is the rasteriser's.
const kEdgeOn = 1e-3;

/**
 * Collects the triangles that show their front (side 1) or back (side -1) to a viewpoint, and those that it sees from nearly edge on;
 * side 0: all. `place`: 4 floats a vertex. `out` has room for all. The result: how many.
 */
export function facing(
  triangles: Uint32Array,
  count: number,
  place: Float32Array,
  from: Viewpoint,
  side: 1 | -1 | 0,
  out: Uint32Array,
): number {
  const { x, y, z, w } = from;
  let n = 0;
  for (let t = 0; t < 3 * count; t += 3) {
    const i = triangles[t]!,
      j = triangles[t + 1]!,
      k = triangles[t + 2]!;
    const a = 4 * i,
      b = 4 * j,
      c = 4 * k;
    const px = place[a]!,
      py = place[a + 1]!,
      pz = place[a + 2]!;
    const ux = place[b]! - px,
      uy = place[b + 1]! - py,
      uz = place[b + 2]! - pz;
    const vx = place[c]! - px,
      vy = place[c + 1]! - py,
      vz = place[c + 2]! - pz;
    const nx = uy * vz - uz * vy,
      ny = uz * vx - ux * vz,
      nz = ux * vy - uy * vx;
    const ex = x - w * px,
      ey = y - w * py,
      ez = z - w * pz;
    const d = side * (nx * ex + ny * ey + nz * ez);
    if (d <= 0) {
      const limit = kEdgeOn * kEdgeOn * (nx * nx + ny * ny + nz * nz) * (ex * ex + ey * ey + ez * ez);
      if (!(d * d <= limit)) continue;
    }
    out[n] = i;
    out[n + 1] = j;
    out[n + 2] = k;
    n += 3;
  }
  return n / 3;
}
