// How much of the sky a place sees: the body's surface, blurred, in a coarse grid of space. A fragment looks one step along its
// normal: what is there shuts out light. Slits, holes and folds get depth so, and what the body lies on its contact shadow.
import {
  ClampToEdgeWrapping,
  Data3DTexture,
  LinearFilter,
  RedFormat,
  UnsignedByteType,
  Vector3,
  type Material,
} from 'three';
import type { BodyState } from './body_state';
import { latticeCoordinates } from './skinning';
import type { Uniforms } from './materials';

const kAcross = 36; // voxels along the body's longest side; half: slits blur into shade, double: eight times the work
const kMargin = 4; // voxels kept free around it: what is blurred must end within the grid
const kMostTriangles = 6000; // that are looked at; of finer bodies every so many-th
const kFull = 0.45; // of a voxel's face that is covered and counts as all: even meshing shows no pattern
const kMostParts = 2 * kAcross; // that an edge is divided into: the longest that a triangle needs, over the diagonal
const kPatience = 12; // times as long as it took to fill the grid nobody fills it again: 8 % of the time at most

/** Blurs once along one axis by (1 2 1) / 4, in place; `stride` floats between neighbours. */
export function blurAlong(
  grid: Float32Array,
  stride: number,
  count: number,
  starts: (line: number) => number,
  lines: number,
): void {
  for (let l = 0; l < lines; l++) {
    let o = starts(l),
      before = 0;
    for (let i = 0; i < count; i++, o += stride) {
      const here = grid[o]!,
        after = i + 1 < count ? grid[o + stride]! : 0;
      grid[o] = 0.25 * before + 0.5 * here + 0.25 * after;
      before = here;
    }
  }
}

export class Occlusion {
  readonly uniforms: Uniforms = {
    uBulk: { value: makeTexture(1, 1, 1) },
    uBulkFrom: { value: new Vector3() },
    uBulkPerMetre: { value: new Vector3() },
    uBulkStep: { value: 0 },
    uBulkLowest: { value: 0 },
    uBulkSize: { value: 1 },
  };
  private grid = new Float32Array(0);
  private stale = false;
  private notBefore = 0;

  moved(): void {
    this.stale = true;
  }

  /** Fills the grid again if the body moved and there is time for it; true when it did. */
  update(state: BodyState, pose: Float32Array, now: number): boolean {
    if (!this.stale || now < this.notBefore) return false;
    const started = performance.now();
    this.stale = false;
    this.fill(state, pose);
    this.notBefore = now + kPatience * (performance.now() - started);
    return true;
  }

  fill(state: BodyState, pose: Float32Array): void {
    if (state.nn === 0 || state.ns + state.nw === 0) return;
    const lo = new Vector3(Infinity, Infinity, Infinity),
      hi = lo.clone().negate();
    const every = Math.max(1, Math.ceil((state.ns + state.nw) / kMostTriangles));
    const corners = cornersNow(state, pose, every, lo, hi);
    const size = hi.clone().sub(lo);
    const h = Math.max(size.x, size.y, size.z, 1e-9) / kAcross;
    const [nx, ny, nz] = [size.x, size.y, size.z].map((s) => Math.ceil(s / h) + 2 * kMargin + 1) as [
      number,
      number,
      number,
    ];
    const total = nx * ny * nz;
    if (this.grid.length < total) this.grid = new Float32Array(total);
    const grid = this.grid;
    grid.fill(0, 0, total);
    // From the grid of all space, so that it does not wander with the body.
    const from = [lo.x, lo.y, lo.z].map((x) => (Math.floor(x / h) - kMargin) * h);
    splat(grid, nx, ny, corners, from, h, every);
    for (let i = 0; i < total; i++) grid[i] = Math.min(1, grid[i]! / kFull);
    blurAlong(grid, 1, nx, (l) => l * nx, ny * nz);
    blurAlong(grid, nx, ny, (l) => Math.floor(l / nx) * nx * ny + (l % nx), nx * nz);
    blurAlong(grid, nx * ny, nz, (l) => l, nx * ny);
    const u = this.uniforms;
    let texture = u.uBulk!.value as Data3DTexture;
    if (texture.image.width !== nx || texture.image.height !== ny || texture.image.depth !== nz) {
      texture.dispose();
      texture = u.uBulk!.value = makeTexture(nx, ny, nz);
    }
    const bytes = texture.image.data as Uint8Array;
    for (let i = 0; i < total; i++) bytes[i] = Math.round(255 * grid[i]!);
    texture.needsUpdate = true;
    (u.uBulkFrom!.value as Vector3).set(from[0]!, from[1]!, from[2]!);
    (u.uBulkPerMetre!.value as Vector3).set(1 / (nx * h), 1 / (ny * h), 1 / (nz * h));
    u.uBulkStep!.value = h;
    u.uBulkLowest!.value = lo.z;
    u.uBulkSize!.value = kAcross * h;
  }
}

function makeTexture(nx: number, ny: number, nz: number): Data3DTexture {
  const t = new Data3DTexture(new Uint8Array(nx * ny * nz), nx, ny, nz);
  t.format = RedFormat;
  t.type = UnsignedByteType;
  t.minFilter = t.magFilter = LinearFilter;
  t.wrapS = t.wrapT = t.wrapR = ClampToEdgeWrapping;
  t.unpackAlignment = 1;
  t.needsUpdate = true;
  return t;
}

/** Where the corners of every `every`-th triangle are, nine numbers each; widens the box lo to hi. */
function cornersNow(s: BodyState, pose: Float32Array, every: number, lo: Vector3, hi: Vector3): Float32Array {
  const of = [
    [s.skin, s.ns],
    [s.wall, s.nw],
  ] as const;
  const out = new Float32Array(9 * (Math.ceil(s.ns / every) + Math.ceil(s.nw / every)));
  let o = 0;
  for (const [index, count] of of) {
    for (let t = 0; t < count; t += every) {
      for (let c = 0; c < 3; c++, o += 3) {
        const v = index[3 * t + c]!,
          p = 32 * s.copy[v]!;
        const q = latticeCoordinates(s, pose[p + 19]!, s.rest[3 * v]!, s.rest[3 * v + 1]!, s.rest[3 * v + 2]!);
        const x = q[0] - pose[p + 3]!,
          y = q[1] - pose[p + 7]!,
          z = q[2] - pose[p + 11]!;
        for (let k = 0; k < 3; k++) {
          out[o + k] =
            pose[p + k]! +
            pose[p + 4 + k]! * x +
            pose[p + 8 + k]! * y +
            pose[p + 12 + k]! * z +
            pose[p + 16 + k]! * x * y +
            pose[p + 20 + k]! * y * z +
            pose[p + 24 + k]! * x * z +
            pose[p + 28 + k]! * x * y * z;
        }
        lo.set(Math.min(lo.x, out[o]!), Math.min(lo.y, out[o + 1]!), Math.min(lo.z, out[o + 2]!));
        hi.set(Math.max(hi.x, out[o]!), Math.max(hi.y, out[o + 1]!), Math.max(hi.z, out[o + 2]!));
      }
    }
  }
  return out.subarray(0, o);
}

/** Spreads the triangles' areas, in faces of a voxel, over the voxels that they pass through. */
function splat(
  grid: Float32Array,
  nx: number,
  ny: number,
  corners: Float32Array,
  from: number[],
  h: number,
  every: number,
): void {
  const at = (x: number, y: number, z: number, area: number): void => {
    // Values stand in the middles of voxels.
    const u = (x - from[0]!) / h - 0.5,
      v = (y - from[1]!) / h - 0.5,
      w = (z - from[2]!) / h - 0.5;
    const i = Math.floor(u),
      j = Math.floor(v),
      k = Math.floor(w);
    const a = u - i,
      b = v - j,
      c = w - k;
    const o = (k * ny + j) * nx + i,
      up = nx * ny;
    grid[o]! += area * (1 - a) * (1 - b) * (1 - c);
    grid[o + 1]! += area * a * (1 - b) * (1 - c);
    grid[o + nx]! += area * (1 - a) * b * (1 - c);
    grid[o + nx + 1]! += area * a * b * (1 - c);
    grid[o + up]! += area * (1 - a) * (1 - b) * c;
    grid[o + up + 1]! += area * a * (1 - b) * c;
    grid[o + up + nx]! += area * (1 - a) * b * c;
    grid[o + up + nx + 1]! += area * a * b * c;
  };
  for (let t = 0; t < corners.length; t += 9) {
    const ax = corners[t]!,
      ay = corners[t + 1]!,
      az = corners[t + 2]!;
    const ux = corners[t + 3]! - ax,
      uy = corners[t + 4]! - ay,
      uz = corners[t + 5]! - az,
      vx = corners[t + 6]! - ax,
      vy = corners[t + 7]! - ay,
      vz = corners[t + 8]! - az;
    const area = (0.5 * every * Math.hypot(uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx)) / (h * h);
    const longest = Math.sqrt(Math.max(ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz));
    const n = Math.min(kMostParts, Math.max(1, Math.ceil(longest / h)));
    // Middles of the n * n triangles that it is divided into, nearly.
    for (let i = 0; i < n; i++) {
      for (let j = 0; j < n - i; j++) {
        const f = (i + 1 / 3) / n,
          g = (j + 1 / 3) / n,
          share = (area * (j < n - i - 1 ? 2 : 1)) / (n * n);
        at(ax + f * ux + g * vx, ay + f * uy + g * vy, az + f * uz + g * vz, share);
      }
    }
  }
}

/** kOpen(place and unit normal in space): 1 where the sky is free. */
export const kOcclusionSource = /* glsl */ `
uniform highp sampler3D uBulk;
uniform vec3 uBulkFrom, uBulkPerMetre;
uniform float uBulkStep, uBulkLowest, uBulkSize;
varying vec3 vInSpace;
const float kLook = 2.2;     // voxels along the normal; below 2 a surface sees itself
const float kShutFrom = 0.08, kShutTo = 0.90; // of the grid: from no to full shade
const float kShut = 0.60;    // of the light that full shade takes; 1 makes slits black
// Whether a step from there may lie in the grid: most of a ground does not, and asking is cheap.
bool kNearBulk(vec3 p) {
  vec3 q = abs((p - uBulkFrom) * uBulkPerMetre - 0.5);
  return max(q.x, max(q.y, q.z)) < 0.6;
}
float kOpen(vec3 p, vec3 n) {
  vec3 q = (p + kLook * uBulkStep * n - uBulkFrom) * uBulkPerMetre;
  float near = textureLod(uBulk, q, 0.0).r;
#ifndef KERF_LITE
  near = max(near, 0.8 * textureLod(uBulk, q + 1.7 * uBulkStep * n * uBulkPerMetre, 0.0).r);
#endif
  return 1.0 - kShut * smoothstep(kShutFrom, kShutTo, near);
}
`;

/** What the body stands on or near takes its contact shadow; `level`: it is a ground, whose normal needs no telling. */
export function receiveContact<M extends Material>(material: M, uniforms: Uniforms, level = false): M {
  const before = material.onBeforeCompile.bind(material),
    key = material.customProgramCacheKey.bind(material),
    upright = level ? '' : '\nvarying vec3 vUpright;';
  material.onBeforeCompile = (shader, renderer) => {
    before(shader, renderer);
    Object.assign(shader.uniforms, uniforms);
    shader.vertexShader = shader.vertexShader
      .replace('#include <common>', `#include <common>\nvarying vec3 vInSpace;${upright}`)
      .replace(
        '#include <begin_vertex>',
        `#include <begin_vertex>\n\tvInSpace = (modelMatrix * vec4(transformed, 1.0)).xyz;${level ? '' : '\n\tvUpright = mat3(modelMatrix) * objectNormal;'}`,
      );
    shader.fragmentShader = shader.fragmentShader
      .replace('#include <common>', `#include <common>\n#define KERF_LITE\n${kOcclusionSource}${upright}`)
      .replace(
        '#include <aomap_fragment>',
        `if (kNearBulk(vInSpace)) {
  float open = kOpen(vInSpace, ${level ? 'vec3(0.0, 0.0, 1.0)' : 'normalize(vUpright)'});
  reflectedLight.indirectDiffuse *= open;
  reflectedLight.indirectSpecular *= open;
  reflectedLight.directDiffuse *= mix(1.0, open, 0.6);
}`,
      );
  };
  material.customProgramCacheKey = () => `${key()}-contact-${level}`;
  return material;
}
