// What a Things message says: obstacles and tools of the scene, taken apart and checked.
import { ProtocolError, type Things } from './protocol';

export interface ThingPart {
  positions: Float32Array;
  triangles: Uint32Array;
  side: number;
}
export interface Thing {
  tool: boolean;
  shape: string; // plane, sphere, capsule, box, mesh; probe, grasper, scalpel, scissors
  name: string;
  jaws: boolean;
  opening: number;
  hinge: number;
  parts: ThingPart[];
}

const record = (x: unknown): Record<string, unknown> =>
  x && typeof x === 'object' ? (x as Record<string, unknown>) : {};
const list = (x: unknown): unknown[] => (Array.isArray(x) ? (x as unknown[]) : []);
const num = (x: unknown): number => (typeof x === 'number' && Number.isFinite(x) ? x : 0);
const text = (x: unknown): string => (typeof x === 'string' ? x : '');
const count = (x: unknown): number => {
  const n = num(x);
  if (!Number.isInteger(n) || n < 0) throw new ProtocolError(`a thing has ${String(x)} elements`);
  return n;
};

/** Copies everything. Throws ProtocolError when counts or corners do not fit. */
export function readThings(m: Things): Thing[] {
  let root: unknown;
  try {
    root = JSON.parse(m.json);
  } catch {
    throw new ProtocolError('the description of things is no JSON');
  }
  let v = 0,
    t = 0;
  const things = list(record(root).things).map((x): Thing => {
    const o = record(x);
    const parts = list(o.parts).map((y): ThingPart => {
      const p = record(y),
        nv = count(p.vertices),
        nt = count(p.triangles);
      if (3 * (v + nv) > m.positions.length || 3 * (t + nt) > m.triangles.length)
        throw new ProtocolError('a thing reaches past its arrays');
      const part = {
        positions: m.positions.slice(3 * v, 3 * (v + nv)),
        triangles: m.triangles.slice(3 * t, 3 * (t + nt)),
        side: Math.sign(num(p.side)),
      };
      if (part.triangles.some((corner) => corner >= nv))
        throw new ProtocolError('a corner of a thing is not in its part');
      v += nv;
      t += nt;
      return part;
    });
    return {
      tool: o.kind === 'tool',
      shape: text(o.shape),
      name: text(o.name),
      jaws: o.jaws === true,
      opening: num(o.opening),
      hinge: num(o.hinge),
      parts,
    };
  });
  if (3 * v !== m.positions.length || 3 * t !== m.triangles.length)
    throw new ProtocolError('things leave over elements');
  return things;
}
