// Where a rest position is now: each cell copy moves what it holds by trilinear interpolation of its eight nodes.
//
// Node order of a copy: bit 0 = x, bit 1 = y, bit 2 = z (7 is the far corner on all three axes).
// In a cell with local coordinates (x, y, z) in [0, 1] the position is a polynomial
//   p = T0 + T1 x + T2 y + T3 z + T4 xy + T5 yz + T6 xz + T7 xyz,
// whose coefficients are computed once per copy and frame and lie in a texture; vertices carry only their rest position
// and their copy's number.
//
// Normals follow cof(F). Taken cell by cell, cof(F) jumps where cells meet and draws an edge into the shading, so it is
// averaged at the nodes over the copies that share them and interpolated; twin nodes of a cut keep it sharp there.

import { cellSize, frameAxes, frameOrigin } from '../engine/frames';

export const kTextureWidth = 512; // texels
export const kPoseTexels = 8; // per copy
export const kNormalTexels = 24; // per copy
export const kPosePerRow = 64; // copies: 64 x 8 = 512 texels
export const kNormalPerRow = 21; // copies: 21 x 24 = 504 texels

/** The bodies' cells and their copies, as BodyState has them. */
export interface CellData {
  frames: Float32Array;
  nc: number;
  nn: number;
  copies: Uint32Array;
  cells: Int16Array;
  nodes: Float32Array;
}

export const poseRows = (copies: number): number => Math.max(1, Math.ceil(copies / kPosePerRow));
export const normalRows = (copies: number): number => Math.max(1, Math.ceil(copies / kNormalPerRow));

/** Writes the polynomial of copy c to out[at .. at+32); false for a dead copy, which becomes a point. */
function writePose(d: CellData, c: number, out: Float32Array, at: number): boolean {
  const { copies, nodes } = d,
    base = 8 * c,
    limit = d.nn;
  for (let k = 0; k < 8; k++) {
    if (copies[base + k]! >= limit) {
      out.fill(0, at, at + 32);
      return false;
    }
  }
  const n0 = 3 * copies[base]!,
    n1 = 3 * copies[base + 1]!,
    n2 = 3 * copies[base + 2]!,
    n3 = 3 * copies[base + 3]!;
  const n4 = 3 * copies[base + 4]!,
    n5 = 3 * copies[base + 5]!,
    n6 = 3 * copies[base + 6]!,
    n7 = 3 * copies[base + 7]!;
  for (let i = 0; i < 3; i++) {
    const a = nodes[n0 + i]!,
      e = nodes[n1 + i]! - a,
      f = nodes[n2 + i]! - a,
      g = nodes[n4 + i]! - a;
    const xy = nodes[n3 + i]! - a - e - f,
      yz = nodes[n6 + i]! - a - f - g,
      xz = nodes[n5 + i]! - a - e - g;
    const o = at + i;
    out[o] = a;
    out[o + 4] = e;
    out[o + 8] = f;
    out[o + 12] = g;
    out[o + 16] = xy;
    out[o + 20] = yz;
    out[o + 24] = xz;
    out[o + 28] = nodes[n7 + i]! - a - e - f - g - xy - yz - xz;
  }
  for (let k = 0; k < 3; k++) out[at + 4 * k + 3] = d.cells[4 * c + k]!;
  out[at + 19] = d.cells[4 * c + 3]!;
  return true;
}

/** Fills the pose texture: copy c at texels (c % 64) * 8 .. + 7 of row c / 64; w of T0..T2 is the cell's (i, j, k), of T4 its frame. */
export function fillPose(d: CellData, out: Float32Array): void {
  for (let c = 0; c < d.nc; c++) writePose(d, c, out, 32 * c);
}

/** Writes which of a copy's eight nodes are marked, one bit each, to w of T3. */
export function fillMarks(d: CellData, marked: ReadonlySet<number> | null, out: Float32Array): void {
  for (let c = 0; c < d.nc; c++) {
    let bits = 0;
    for (let k = 0; marked && k < 8; k++) if (marked.has(d.copies[8 * c + k]!)) bits |= 1 << k;
    out[32 * c + 15] = bits;
  }
}

/** Memory of fillNormals that is kept between frames. */
export class NormalScratch {
  sum = new Float64Array(0);
  live = new Uint8Array(0);
}

/**
 * Fills the normal texture: 24 texels per copy, columns of cof(F) at the copy's eight nodes (k, column) -> 3 k + column,
 * averaged over all copies that share the node. `pose` is what fillPose wrote.
 */
export function fillNormals(d: CellData, pose: Float32Array, out: Float32Array, scratch: NormalScratch): void {
  if (scratch.sum.length < 9 * d.nn) scratch.sum = new Float64Array(9 * d.nn * 2);
  const sum = scratch.sum;
  sum.fill(0, 0, 9 * d.nn);
  let whose = -1,
    sx = 1,
    sy = 1,
    sz = 1;
  for (let c = 0; c < d.nc; c++) {
    if (d.copies[8 * c]! >= d.nn) continue;
    if (d.cells[4 * c + 3] !== whose) {
      whose = d.cells[4 * c + 3]!;
      const s = cellSize(d.frames, whose);
      sx = 1 / s[0]!;
      sy = 1 / s[1]!;
      sz = 1 / s[2]!;
    }
    const o = 32 * c;
    for (let k = 0; k < 8; k++) {
      const x = k & 1,
        y = (k >> 1) & 1,
        z = k >> 2;
      const node = d.copies[8 * c + k]!;
      if (node >= d.nn) break;
      const ax = sx * (pose[o + 4]! + pose[o + 16]! * y + pose[o + 24]! * z + pose[o + 28]! * y * z);
      const ay = sx * (pose[o + 5]! + pose[o + 17]! * y + pose[o + 25]! * z + pose[o + 29]! * y * z);
      const az = sx * (pose[o + 6]! + pose[o + 18]! * y + pose[o + 26]! * z + pose[o + 30]! * y * z);
      const bx = sy * (pose[o + 8]! + pose[o + 16]! * x + pose[o + 20]! * z + pose[o + 28]! * x * z);
      const by = sy * (pose[o + 9]! + pose[o + 17]! * x + pose[o + 21]! * z + pose[o + 29]! * x * z);
      const bz = sy * (pose[o + 10]! + pose[o + 18]! * x + pose[o + 22]! * z + pose[o + 30]! * x * z);
      const cx = sz * (pose[o + 12]! + pose[o + 20]! * y + pose[o + 24]! * x + pose[o + 28]! * x * y);
      const cy = sz * (pose[o + 13]! + pose[o + 21]! * y + pose[o + 25]! * x + pose[o + 29]! * x * y);
      const cz = sz * (pose[o + 14]! + pose[o + 22]! * y + pose[o + 26]! * x + pose[o + 30]! * x * y);
      const s = 9 * node;
      sum[s]! += by * cz - bz * cy;
      sum[s + 1]! += bz * cx - bx * cz;
      sum[s + 2]! += bx * cy - by * cx;
      sum[s + 3]! += cy * az - cz * ay;
      sum[s + 4]! += cz * ax - cx * az;
      sum[s + 5]! += cx * ay - cy * ax;
      sum[s + 6]! += ay * bz - az * by;
      sum[s + 7]! += az * bx - ax * bz;
      sum[s + 8]! += ax * by - ay * bx;
    }
  }
  // Scale every node's matrix to the same size: an average over fewer copies must not weigh less.
  for (let n = 0; n < d.nn; n++) {
    let q = 0;
    for (let i = 9 * n; i < 9 * n + 9; i++) q += sum[i]! * sum[i]!;
    const f = q > 0 ? 1 / Math.sqrt(q) : 0;
    for (let i = 9 * n; i < 9 * n + 9; i++) sum[i]! *= f;
  }
  for (let c = 0; c < d.nc; c++) {
    const row = Math.floor(c / kNormalPerRow);
    let o = 4 * (row * kTextureWidth + (c - row * kNormalPerRow) * kNormalTexels);
    for (let k = 0; k < 8; k++) {
      const node = d.copies[8 * c + k]!;
      for (let column = 0; column < 3; column++, o += 4) {
        if (node >= d.nn) {
          out[o] = out[o + 1] = out[o + 2] = 0;
          continue;
        }
        const s = 9 * node + 3 * column;
        out[o] = sum[s]!;
        out[o + 1] = sum[s + 1]!;
        out[o + 2] = sum[s + 2]!;
      }
    }
  }
}

/** Position now of a rest position in copy c, computed as the shader does; for picking, overlays and tests. */
export function skinPoint(
  d: CellData,
  pose: Float32Array,
  c: number,
  x: number,
  y: number,
  z: number,
): [number, number, number] {
  const q = latticeCoordinates(d, d.cells[4 * c + 3]!, x, y, z),
    o = 32 * c;
  const u = q[0] - pose[o + 3]!,
    v = q[1] - pose[o + 7]!,
    w = q[2] - pose[o + 11]!;
  const at = (i: number): number =>
    pose[o + i]! +
    pose[o + 4 + i]! * u +
    pose[o + 8 + i]! * v +
    pose[o + 12 + i]! * w +
    pose[o + 16 + i]! * u * v +
    pose[o + 20 + i]! * v * w +
    pose[o + 24 + i]! * u * w +
    pose[o + 28 + i]! * u * v * w;
  return [at(0), at(1), at(2)];
}

/** Rest position in units of a frame's cells along its axes. */
export function latticeCoordinates(
  d: CellData,
  frame: number,
  x: number,
  y: number,
  z: number,
): [number, number, number] {
  const o = frameOrigin(d.frames, frame),
    rx = x - o[0]!,
    ry = y - o[1]!,
    rz = z - o[2]!,
    a = frameAxes(d.frames, frame),
    s = cellSize(d.frames, frame);
  return [
    (a[0]! * rx + a[1]! * ry + a[2]! * rz) / s[0]!,
    (a[3]! * rx + a[4]! * ry + a[5]! * rz) / s[1]!,
    (a[6]! * rx + a[7]! * ry + a[8]! * rz) / s[2]!,
  ];
}

/** Declarations for the vertex shader where places and normals come as attributes: see placed_mesh.ts. */
export const kPlacedDeclarations = /* glsl */ `
in vec4 kPlace;
in vec3 kTurned;
vec3 kPos, kNrm;
float kMarked;
void kSkin(vec3 r, vec3 n) {
  kPos = kPlace.xyz;
  kMarked = kPlace.w;
  kNrm = kTurned;
}
`;

/** Declarations for the vertex shader: attributes copyId, kOffset and kMark (0 in geometries without them), uniforms, kSkin(rest, normal) -> kPos, kNrm and kMarked (0 to 1, by the copy's nodes or the vertex's own mark); kSkinAs(copy, rest, normal) by the copy alone. */
export const kSkinningDeclarations = /* glsl */ `
uniform highp sampler2D uPose;
#ifdef KERF_SMOOTH
uniform highp sampler2D uNormals;
#endif
uniform highp sampler2D uFrames;
in uint copyId;
in vec3 kOffset;
in float kMark;
vec3 kPos, kNrm;
float kMarked;
void kSkinAs(uint copy, vec3 r, vec3 n) {
  ivec2 p = ivec2(int(copy & 63u) << 3, int(copy >> 6));
  vec4 t0 = texelFetch(uPose, p, 0), t1 = texelFetch(uPose, p + ivec2(1, 0), 0), t2 = texelFetch(uPose, p + ivec2(2, 0), 0);
  vec4 t3 = texelFetch(uPose, p + ivec2(3, 0), 0), t4 = texelFetch(uPose, p + ivec2(4, 0), 0);
  vec4 t5 = texelFetch(uPose, p + ivec2(5, 0), 0), t6 = texelFetch(uPose, p + ivec2(6, 0), 0);
  vec4 t7 = texelFetch(uPose, p + ivec2(7, 0), 0);
  int frame = int(t4.w);
  vec4 f0 = texelFetch(uFrames, ivec2(0, frame), 0), f1 = texelFetch(uFrames, ivec2(1, frame), 0), f2 = texelFetch(uFrames, ivec2(2, frame), 0);
  vec3 q = vec3(dot(f0.xyz, r) + f0.w, dot(f1.xyz, r) + f1.w, dot(f2.xyz, r) + f2.w) - vec3(t0.w, t1.w, t2.w);
  kPos = t0.xyz + t1.xyz * q.x + t2.xyz * q.y + t3.xyz * q.z + t4.xyz * (q.x * q.y) + t5.xyz * (q.y * q.z)
       + t6.xyz * (q.x * q.z) + t7.xyz * (q.x * q.y * q.z);
  int marks = int(t3.w);
  kMarked = 0.0;
  for (int k = 0; k < 8 && marks != 0; k++, marks >>= 1) {
    vec3 f = clamp(q, 0.0, 1.0);
    if ((marks & 1) != 0) kMarked += ((k & 1) == 0 ? 1.0 - f.x : f.x) * ((k & 2) == 0 ? 1.0 - f.y : f.y) * ((k & 4) == 0 ? 1.0 - f.z : f.z);
  }
  vec3 inverseSize = vec3(length(f0.xyz), length(f1.xyz), length(f2.xyz));
  vec3 m = vec3(dot(f0.xyz, n), dot(f1.xyz, n), dot(f2.xyz, n)) / inverseSize;
#ifdef KERF_SMOOTH
  int row = int(copy) / ${kNormalPerRow};
  ivec2 g = ivec2((int(copy) - row * ${kNormalPerRow}) * ${kNormalTexels}, row);
  vec3 s = clamp(q, 0.0, 1.0);
  kNrm = vec3(0.0);
  for (int k = 0; k < 8; k++) {
    float w = ((k & 1) == 0 ? 1.0 - s.x : s.x) * ((k & 2) == 0 ? 1.0 - s.y : s.y) * ((k & 4) == 0 ? 1.0 - s.z : s.z);
    ivec2 h = g + ivec2(3 * k, 0);
    kNrm += w * (texelFetch(uNormals, h, 0).xyz * m.x + texelFetch(uNormals, h + ivec2(1, 0), 0).xyz * m.y
               + texelFetch(uNormals, h + ivec2(2, 0), 0).xyz * m.z);
  }
#else
  vec3 a = (t1.xyz + t4.xyz * q.y + t6.xyz * q.z + t7.xyz * (q.y * q.z)) * inverseSize.x;
  vec3 b = (t2.xyz + t4.xyz * q.x + t5.xyz * q.z + t7.xyz * (q.x * q.z)) * inverseSize.y;
  vec3 c = (t3.xyz + t5.xyz * q.y + t6.xyz * q.x + t7.xyz * (q.x * q.y)) * inverseSize.z;
  kNrm = cross(b, c) * m.x + cross(c, a) * m.y + cross(a, b) * m.z;
#endif
}
void kSkin(vec3 r, vec3 n) {
  kSkinAs(copyId, r, n);
  kPos += kOffset;
  kMarked = max(kMarked, kMark);
}
`;
