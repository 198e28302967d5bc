import { makeFrame } from '../src/engine/frames';
import { describe, expect, it } from 'vitest';
import { DataUtils, MeshLambertMaterial, ShaderChunk } from 'three';
import { makeNoiseTexture } from '../src/scene/noise';
import { Occlusion } from '../src/scene/occlusion';
import { BodyState } from '../src/scene/body_state';
import { installSoftShadows, shadowFromBelow } from '../src/scene/soft_shadow';

describe('shadows of lite', () => {
  it('find the text of three.js that they stand beside', () => {
    expect(installSoftShadows()).toBe(true);
    expect(installSoftShadows()).toBe(true);
    expect(ShaderChunk.shadowmap_pars_fragment.split('KERF_ONE_READ').length).toBe(2);
  });
  it('are asked for from below the surface, by one change of its text', () => {
    const shader = { vertexShader: '#include <shadowmap_vertex>', fragmentShader: '', uniforms: {} };
    shadowFromBelow(new MeshLambertMaterial()).onBeforeCompile(shader as never, null as never);
    expect(shader.vertexShader.split('- shadowWorldNormal * directionalLightShadows').length).toBe(2);
  });
});

describe('noise', () => {
  it('has finer steps than bytes have, and the same values in bytes', () => {
    const fine = makeNoiseTexture(16).image.data as Uint16Array,
      coarse = makeNoiseTexture(16, true).image.data as Uint8Array;
    const values = [...fine].map((h) => DataUtils.fromHalfFloat(h));
    expect(new Set(values).size).toBeGreaterThan(600);
    values.forEach((v, i) => expect(Math.abs(255 * v - coarse[i]!)).toBeLessThan(0.7));
  });
});

/** Two unit squares face to face, z = 0 and z = gap, each of two triangles, in one lattice cell that does not move. */
function twoSquares(gap: number): { state: BodyState; pose: Float32Array } {
  const corners = [
    [0, 0],
    [1, 0],
    [1, 1],
    [0, 1],
  ];
  const state = new BodyState({
    type: 'body',
    body: 1,
    version: 1,
    frames: makeFrame([0, 0, 0], [1, 0, 0, 0, 1, 0, 0, 0, 1], [1, 1, 1]),
    rest: new Float32Array([0, gap].flatMap((z) => corners.flatMap(([x, y]) => [x!, y!, z]))),
    normal: new Int16Array(32),
    copy: new Uint32Array(8),
    skin: new Uint32Array([0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7]),
    wall: new Uint32Array(0),
    copies: new Uint32Array([0, 1, 2, 3, 4, 5, 6, 7]),
    cells: new Int16Array(4),
    nodes: new Float32Array(24),
    fading: { ids: new Uint32Array(0), offsets: new Float32Array(0) },
  });
  const pose = new Float32Array(32);
  pose[4] = pose[9] = pose[14] = 1; // T1 = x, T2 = y, T3 = z
  return { state, pose };
}

describe('shade of the body', () => {
  /** The grid at a place, 0 to 1. */
  const at = (o: Occlusion, x: number, y: number, z: number): number => {
    const { uBulk, uBulkFrom, uBulkPerMetre } = o.uniforms,
      t = uBulk!.value.image as { data: Uint8Array; width: number; height: number; depth: number };
    const n = [t.width, t.height, t.depth];
    const [i, j, k] = [x, y, z].map((p, a) =>
      Math.floor((p - uBulkFrom!.value.getComponent(a)) * uBulkPerMetre!.value.getComponent(a) * n[a]!),
    );
    return t.data[(k! * n[1]! + j!) * n[0]! + i!]! / 255;
  };
  it('is where the surface is, and nowhere a few voxels off', () => {
    const { state, pose } = twoSquares(0.5),
      o = new Occlusion();
    o.fill(state, pose);
    expect(at(o, 0.5, 0.5, 0.005)).toBeGreaterThan(0.4);
    expect(at(o, 0.5, 0.5, 0.25)).toBe(0);
    expect(at(o, 0.5, 0.5, 0.495)).toBeGreaterThan(0.4);
  });
  it('is even over triangles larger than a voxel', () => {
    const { state, pose } = twoSquares(0.5),
      o = new Occlusion();
    o.fill(state, pose);
    const row = [...Array(20)].map((_, i) => at(o, 0.2 + 0.03 * i, 0.43, 0.005));
    expect(Math.max(...row) - Math.min(...row)).toBeLessThan(0.15);
  });
  it('fills a slit: a step off one wall lies the other', () => {
    const { state, pose } = twoSquares(0.06),
      o = new Occlusion();
    o.fill(state, pose);
    expect(at(o, 0.5, 0.5, 2.2 * o.uniforms.uBulkStep!.value)).toBeGreaterThan(0.4);
  });
});
