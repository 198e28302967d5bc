// Vertices beside their copies: what a page draws is where the library has the vertices. The sample is written by the library's test
// Engine.APageDrawsTheSurfaceThatDoesNotJump (KERF_PAGE_SAMPLE=tests/samples/fading.json).
import { readFileSync } from 'node:fs';
import { describe, expect, it } from 'vitest';
import { decodeEngineMessage } from '../src/engine/protocol';
import { BodyState } from '../src/scene/body_state';
import { kTextureWidth, fillPose, poseRows, skinPoint } from '../src/scene/skinning';

const sample = JSON.parse(readFileSync(new URL('samples/fading.json', import.meta.url), 'utf8')) as {
  messages: string[];
  positions: string[];
};
const bytes = (hex: string): ArrayBuffer => {
  const out = new Uint8Array(hex.length / 2);
  for (let i = 0; i < out.length; i++) out[i] = parseInt(hex.slice(2 * i, 2 * i + 2), 16);
  return out.buffer;
};

describe('fading offsets', () => {
  it('put vertices where the library has them', () => {
    let state: BodyState | null = null,
      beside = 0,
      without = 0,
      worst = 0;
    sample.messages.forEach((hex, k) => {
      const m = decodeEngineMessage(bytes(hex));
      if (m.type === 'body') {
        state = new BodyState(m);
        expect(state.fading.length).toBeGreaterThan(10); // it comes in the middle
      }
      const s = state!;
      if (m.type === 'patch') s.apply(m);
      if (m.type === 'frame') {
        expect([m.body, m.version]).toEqual([s.body, s.version]);
        s.nodes.set(m.nodes);
        s.setFading(m.fading);
      }
      beside = Math.max(beside, s.fading.length);
      const pose = new Float32Array(4 * kTextureWidth * poseRows(s.nc)),
        wanted = new Float32Array(bytes(sample.positions[k]!));
      fillPose(s, pose);
      expect(wanted.length).toBe(3 * s.nv);
      for (let v = 0; v < s.nv; v++) {
        const p = skinPoint(s, pose, s.copy[v]!, s.rest[3 * v]!, s.rest[3 * v + 1]!, s.rest[3 * v + 2]!);
        const distance = (by: (i: number) => number): number =>
          Math.hypot(...p.map((x, i) => x + by(3 * v + i) - wanted[3 * v + i]!));
        worst = Math.max(
          worst,
          distance((i) => s.offset[i]!),
        ); // as the shader adds it
        without = Math.max(
          without,
          distance(() => 0),
        );
      }
    });
    expect(beside).toBeGreaterThan(10);
    expect(without).toBeGreaterThan(1e-4);
    expect(worst).toBeLessThan(2e-6);
  });

  it('end for vertices that are not named any more, and say what changed', () => {
    const body = decodeEngineMessage(
      bytes(sample.messages.find((hex) => new DataView(bytes(hex)).getUint16(0, true) === 2)!),
    );
    if (body.type !== 'body') throw new Error('no body');
    body.fading = { ids: new Uint32Array(0), offsets: new Float32Array(0) };
    const s = new BodyState(body),
      of = (ids: number[]) => ({
        ids: new Uint32Array(ids),
        offsets: new Float32Array(3 * ids.length).fill(ids.length),
      });
    expect(s.setFading(of([]))).toEqual([]);
    expect(s.setFading(of([2, 5]))).toEqual([{ start: 2, end: 6 }]);
    expect(Array.from(s.offset.subarray(15, 18))).toEqual([2, 2, 2]);
    // Material that is held has offsets for as long as it is held: the picture stands still all the same.
    expect(s.setFading(of([2, 5]))).toEqual([]);
    const other = of([2, 5]);
    other.offsets[5] = 7;
    expect(s.setFading(other)).toEqual([{ start: 2, end: 6 }]);
    expect(s.offset[17]).toBe(7);
    expect(s.setFading(of([2, 6]))).toEqual([{ start: 2, end: 7 }]);
    expect(s.setFading(of([2, 5]))).toEqual([{ start: 2, end: 7 }]);
    expect(s.setFading(of([3]))).toEqual([{ start: 2, end: 6 }]);
    expect(Array.from(s.offset.subarray(6, 18))).toEqual([0, 0, 0, 1, 1, 1, 0, 0, 0, 0, 0, 0]);
    expect(s.setFading(of([]))).toEqual([{ start: 3, end: 4 }]);
    expect(s.offset.some((x) => x !== 0)).toBe(false);
    expect(() => s.setFading(of([s.nv]))).toThrow(/offset of vertex/);
  });

  it('of vertices that a patch takes away are gone when others take their numbers', () => {
    const body = decodeEngineMessage(bytes(sample.messages[0]!));
    if (body.type !== 'body') throw new Error('no body');
    body.fading = { ids: new Uint32Array(0), offsets: new Float32Array(0) };
    const s = new BodyState(body),
      none = { ids: new Uint32Array(0), offsets: new Float32Array(0) },
      last = s.nv - 1;
    s.setFading({ ids: new Uint32Array([last]), offsets: new Float32Array([1, 2, 3]) });
    const empty = new Uint32Array(0),
      triangles = { ids: empty, triangles: empty };
    const patch = (nv: number, appended: number) => ({
      type: 'patch' as const,
      body: s.body,
      from: s.version,
      to: s.version + 1,
      input: 0,
      totals: { nv, ns: s.ns, nw: s.nw, nc: s.nc, nn: s.nn },
      vertices: {
        ids: empty,
        rest: new Float32Array(3 * appended),
        normal: new Int16Array(4 * appended),
        copy: new Uint32Array(appended),
      },
      skin: triangles,
      wall: triangles,
      copies: { ids: empty, copies: empty, cells: new Int16Array(0) },
      nodes: s.nodes.slice(0, 3 * s.nn),
      fading: none,
    });
    expect(s.apply(patch(last, 0)).offsets).toEqual([{ start: last, end: last + 1 }]);
    expect(s.apply(patch(last + 1, 1)).offsets).toEqual([]);
    expect(Array.from(s.offset.subarray(3 * last, 3 * last + 3))).toEqual([0, 0, 0]);
  });
});
