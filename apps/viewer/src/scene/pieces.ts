// The pieces of a body, and where they are: what hangs together by the nodes of its hexahedra.
import { Box3, Sphere, Vector3 } from 'three';
import type { BodyState } from './body_state';
import { placeOf } from './skin_ray';

const kSamples = 200; // drawn vertices of a piece that stand for it

// Along the axes, the diagonals of their planes and of space: corners of boxes, and what is round to within 3 %.
const kWays = [-1, 0, 1].flatMap((x) => [-1, 0, 1].flatMap((y) => [-1, 0, 1].map((z) => [x, y, z] as const)));

/** The vertices that lie farthest out along each way, at rest. */
function farthest(rest: Float32Array, vertices: number[]): number[] {
  return kWays.map(([x, y, z]) => {
    let most = -Infinity,
      found = vertices[0]!;
    for (const v of vertices) {
      const out = x * rest[3 * v]! + y * rest[3 * v + 1]! + z * rest[3 * v + 2]!;
      if (out <= most) continue;
      most = out;
      found = v;
    }
    return found;
  });
}

export class Pieces {
  private body = -1;
  private version = -1;
  /** Of each piece: some of its vertices. */
  private samples: number[][] = [];
  /** Of each piece: vertices that lie farthest out. */
  private rims: number[][] = [];
  /** Of each node that hexahedra have: the piece. */
  private ofNode = new Int32Array(0);

  /** Finds the pieces anew where the body has changed. */
  update(s: BodyState): void {
    if (s.body === this.body && s.version === this.version) return;
    this.body = s.body;
    this.version = s.version;
    const parent = Uint32Array.from({ length: s.nn }, (_, i) => i);
    const root = (i: number): number => {
      while (parent[i] !== i) i = parent[i] = parent[parent[i]!]!;
      return i;
    };
    for (let c = 0; c < s.nc; c++) {
      const to = root(s.copies[8 * c]!);
      for (let k = 1; k < 8; k++) parent[root(s.copies[8 * c + k]!)] = to;
    }
    // Only what is drawn counts: hexahedra of pieces that were taken away stay for undo.
    const drawn = new Uint8Array(s.nv);
    for (let i = 0; i < 3 * s.ns; i++) drawn[s.skin[i]!] = 1;
    for (let i = 0; i < 3 * s.nw; i++) drawn[s.wall[i]!] = 1;
    const all = new Map<number, number[]>();
    for (let v = 0; v < s.nv; v++) {
      if (!drawn[v]) continue;
      const r = root(s.copies[8 * s.copy[v]!]!),
        list = all.get(r);
      if (list) list.push(v);
      else all.set(r, [v]);
    }
    const number = new Map([...all.keys()].map((r, i) => [r, i]));
    this.ofNode = Int32Array.from({ length: s.nn }, (_, i) => number.get(root(i)) ?? -1);
    this.samples = [...all.values()].map((vertices) => {
      const n = Math.min(kSamples, vertices.length);
      return Array.from({ length: n }, (_, i) => vertices[Math.floor((i * vertices.length) / n)]!);
    });
    this.rims = [...all.values()].map((vertices) => farthest(s.rest, vertices));
  }

  get count(): number {
    return this.samples.length;
  }

  /** The piece that a copy belongs to; -1: none that is drawn. */
  of(s: BodyState, copy: number): number {
    return this.ofNode[s.copies[8 * copy]!] ?? -1;
  }

  /** The places of each piece's samples; `pose`: of the copies, as the mesh is drawn. */
  places(s: BodyState, pose: Float32Array): Vector3[][] {
    return this.placesOf(this.samples, s, pose);
  }
  /** With those of its corners and rims. */
  outlines(s: BodyState, pose: Float32Array): Vector3[][] {
    const rims = this.placesOf(this.rims, s, pose);
    return this.places(s, pose).map((p, i) => p.concat(rims[i]!));
  }
  private placesOf(all: number[][], s: BodyState, pose: Float32Array): Vector3[][] {
    return all.map((vertices) => vertices.map((v) => placeOf(s, pose, v)));
  }
}

/** Pieces that have something within this distance of a place; all, when none has. */
export function within(pieces: Vector3[][], centre: Vector3, distance: number): Vector3[][] {
  const near = pieces.filter((p) => p.some((x) => x.distanceTo(centre) < distance));
  return near.length > 0 ? near : pieces;
}

/** A ball round all of them. */
export function ballOf(pieces: Vector3[][]): Sphere {
  return new Box3().setFromPoints(pieces.flat()).getBoundingSphere(new Sphere());
}
