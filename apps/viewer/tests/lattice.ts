// Deformed lattices for tests of places and normals.
import { cellSize, frameAxes, frameOrigin, makeFrame } from '../src/engine/frames';
import { random } from '../src/scene/noise';
import {
  NormalScratch,
  fillNormals,
  fillPose,
  kNormalPerRow,
  kNormalTexels,
  kTextureWidth,
  normalRows,
  poseRows,
  type CellData,
} from '../src/scene/skinning';

export const next = random(3);
export const between = (a: number, b: number): number => a + (b - a) * next();

/** nx x ny x nz cells about a turned lattice; nodes moved by `move`. */
export function lattice(
  nx: number,
  ny: number,
  nz: number,
  move: (p: number[]) => number[],
): CellData & { restNodes: number[][] } {
  const a = 0.7,
    b = 0.4;
  const x = [Math.cos(a), Math.sin(a), 0],
    y = [-Math.sin(a) * Math.cos(b), Math.cos(a) * Math.cos(b), Math.sin(b)];
  const z = [x[1]! * y[2]! - x[2]! * y[1]!, x[2]! * y[0]! - x[0]! * y[2]!, x[0]! * y[1]! - x[1]! * y[0]!];
  const size = [0.3, 0.2, 0.5],
    origin = [1, -2, 0.5];
  const place = (i: number, j: number, k: number): number[] =>
    [0, 1, 2].map((d) => origin[d]! + i * size[0]! * x[d]! + j * size[1]! * y[d]! + k * size[2]! * z[d]!);
  const id = (i: number, j: number, k: number): number => (k * (ny + 1) + j) * (nx + 1) + i;
  const restNodes: number[][] = [],
    copies: number[] = [],
    cells: number[] = [];
  for (let k = 0; k <= nz; k++)
    for (let j = 0; j <= ny; j++) for (let i = 0; i <= nx; i++) restNodes.push(place(i, j, k));
  for (let k = 0; k < nz; k++) {
    for (let j = 0; j < ny; j++) {
      for (let i = 0; i < nx; i++) {
        cells.push(i, j, k, 1);
        for (let c = 0; c < 8; c++) copies.push(id(i + (c & 1), j + ((c >> 1) & 1), k + (c >> 2)));
      }
    }
  }
  return {
    // The cells are of the second body.
    frames: new Float32Array([
      ...makeFrame([9, 9, 9], [0, 1, 0, 0, 0, 1, 1, 0, 0], [7, 7, 7]),
      ...makeFrame(origin, [...x, ...y, ...z], size),
    ]),
    nc: copies.length / 8,
    nn: restNodes.length,
    copies: new Uint32Array(copies),
    cells: new Int16Array(cells),
    nodes: new Float32Array(restNodes.flatMap(move)),
    restNodes,
  };
}

export const poseOf = (d: CellData): Float32Array => {
  const out = new Float32Array(4 * kTextureWidth * poseRows(d.nc));
  fillPose(d, out);
  return out;
};

/** Rest position at local coordinates of a copy, and the position by summing the eight weights. */
export function direct(d: CellData, c: number, q: number[]): { rest: number[]; now: number[] } {
  const origin = frameOrigin(d.frames, 1),
    axes = frameAxes(d.frames, 1),
    size = cellSize(d.frames, 1);
  const rest = [0, 1, 2].map(
    (k) => origin[k]! + [0, 1, 2].reduce((s, a) => s + (d.cells[4 * c + a]! + q[a]!) * size[a]! * axes[3 * a + k]!, 0),
  );
  const now = [0, 0, 0];
  for (let n = 0; n < 8; n++) {
    const w = (n & 1 ? q[0]! : 1 - q[0]!) * (n & 2 ? q[1]! : 1 - q[1]!) * (n & 4 ? q[2]! : 1 - q[2]!);
    for (let k = 0; k < 3; k++) now[k]! += w * d.nodes[3 * d.copies[8 * c + n]! + k]!;
  }
  return { rest, now };
}

/** Normal as the shader computes it from the normal texture. */
export function smoothNormal(d: CellData, normals: Float32Array, c: number, q: number[], n: number[]): number[] {
  const axes = frameAxes(d.frames, 1);
  const m = [0, 1, 2].map((a) => [0, 1, 2].reduce((s, k) => s + axes[3 * a + k]! * n[k]!, 0));
  const row = Math.floor(c / kNormalPerRow),
    o = 4 * (row * kTextureWidth + (c - row * kNormalPerRow) * kNormalTexels);
  const out = [0, 0, 0];
  for (let k = 0; k < 8; k++) {
    const w = (k & 1 ? q[0]! : 1 - q[0]!) * (k & 2 ? q[1]! : 1 - q[1]!) * (k & 4 ? q[2]! : 1 - q[2]!);
    for (let column = 0; column < 3; column++) {
      for (let i = 0; i < 3; i++) out[i]! += w * normals[o + 4 * (3 * k + column) + i]! * m[column]!;
    }
  }
  const l = Math.hypot(...out);
  return out.map((x) => x / l);
}

export const normalsOf = (d: CellData): Float32Array => {
  const out = new Float32Array(4 * kTextureWidth * normalRows(d.nc));
  fillNormals(d, poseOf(d), out, new NormalScratch());
  return out;
};
