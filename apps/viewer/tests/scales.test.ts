import { makeFrame } from '../src/engine/frames';
import { Box3, Group, Quaternion, Vector3 } from 'three';
import { describe, expect, it } from 'vitest';
import { kNoNode } from '../src/engine/protocol';
import type { Thing } from '../src/engine/things';
import type { BodyMesh } from '../src/scene/body_mesh';
import { BodyState } from '../src/scene/body_state';
import { Pieces } from '../src/scene/pieces';
import { hides, isTray, liesOn, Scales, topOf, type Tray } from '../src/scene/scales';
import { fillPose, kTextureWidth, poseRows } from '../src/scene/skinning';
import type { ThingsView } from '../src/scene/things';
import { listRows, massWords, shareWords, trayWords, weightWords } from '../src/ui/weights';

const up = new Vector3(0, 0, 1);
/** A box of places, from a corner. */
function block(x: number, y: number, z: number, size: number): Vector3[] {
  return [0, 1].flatMap((i) =>
    [0, 1].flatMap((j) => [0, 1].map((k) => new Vector3(x + i * size, y + j * size, z + k * size))),
  );
}
/** 1 x 1 x 0.1, its top at height 1. */
const tray: Tray = {
  box: new Box3(new Vector3(-0.5, -0.5, -0.05), new Vector3(0.5, 0.5, 0.05)),
  position: new Vector3(2, 0, 0.95),
  turn: new Quaternion(),
};

describe('a tray', () => {
  it('bears what lies on it and what lies on that, not what is beside, under or held above it', () => {
    const lies = (...pieces: Vector3[][]): boolean[] => liesOn(tray, pieces, 0.02, up);
    expect(lies(block(1.9, 0, 1.01, 0.2))).toEqual([true]);
    expect(lies(block(1.9, 0, 1.3, 0.2))).toEqual([false]); // held
    expect(lies(block(1.9, 0, 1.21, 0.2), block(1.9, 0, 1, 0.2))).toEqual([true, true]); // a stack
    expect(lies(block(1.9, 0, 1.21, 0.2))).toEqual([false]); // a stack without its base
    expect(lies(block(2.45, 0, 1, 0.2))).toEqual([false]); // the centre hangs over
    expect(lies(block(2.35, 0, 1, 0.2))).toEqual([true]);
    expect(lies(block(1.9, 0, 0.5, 0.2))).toEqual([false]);
  });
  it('may stand turned', () => {
    const turned = { ...tray, turn: new Quaternion().setFromAxisAngle(new Vector3(1, 0, 0), Math.PI) };
    expect(liesOn(turned, [block(1.9, 0, 1.01, 0.2)], 0.02, up)).toEqual([true]);
    for (const t of [tray, turned]) {
      const top = topOf(t, up);
      expect(new Set(top.map((p) => `${p.x.toFixed(3)} ${p.y.toFixed(3)} ${p.z.toFixed(3)}`))).toEqual(
        new Set(['1.500 -0.500 1.000', '2.500 -0.500 1.000', '1.500 0.500 1.000', '2.500 0.500 1.000']),
      );
    }
  });
  it('is hidden behind a box, and from below', () => {
    const board: Tray = { ...tray, position: new Vector3(0.5, 0, 1.2) }; // between x = 0 and 1, up to height 1.25
    const far = new Vector3(2.5, 0, 1);
    const seen = (from: Vector3): boolean => ![tray, board].some((b) => hides(b, from, far));
    expect(seen(new Vector3(-1, 0, 3))).toBe(true); // over the board
    expect(seen(new Vector3(-1, 0, 1.35))).toBe(false);
    expect(seen(new Vector3(-1, 2, 1.35))).toBe(true); // beside it
    expect(seen(new Vector3(2, 0, 0.2))).toBe(false); // from below
    expect(seen(new Vector3(2, 0, 1.01))).toBe(true); // along the top
    const turned = { ...board, turn: new Quaternion().setFromAxisAngle(new Vector3(0, 0, 1), Math.PI / 4) };
    const corner = new Vector3(-1, 0.62, 1.2); // past a straight board, against the corner of a turned one
    expect(hides(board, corner, new Vector3(3, 0.62, 1.2))).toBe(false);
    expect(hides(turned, corner, new Vector3(3, 0.62, 1.2))).toBe(true);
  });
  const thing = (name: string, tool = false): Thing => ({
    tool,
    shape: 'box',
    name,
    jaws: false,
    opening: 0,
    hinge: 0,
    parts: [
      {
        positions: new Float32Array(block(-0.5, -0.5, -0.5, 1).flatMap((p) => p.toArray())),
        triangles: new Uint32Array([0, 1, 2]),
        side: 0,
      },
    ],
  });
  it('is an obstacle of that name, in any scene', () => {
    expect([thing('tray'), thing('board'), thing('tray', true)].map(isTray)).toEqual([true, false, false]);
  });

  /** Two cubes of 1, of which the second lies on a tray under it. */
  function scene(): { scales: Scales; s: BodyState } {
    const nodes: number[] = [],
      rest: number[] = [];
    for (const c of [0, 3])
      for (let k = 0; k < 8; k++) {
        nodes.push(c + (k & 1), (k >> 1) & 1, (k >> 2) & 1);
        rest.push(c + (k & 1), (k >> 1) & 1, (k >> 2) & 1);
      }
    const s = new BodyState({
      type: 'body',
      body: 1,
      version: 4,
      frames: makeFrame([0, 0, 0], [1, 0, 0, 0, 1, 0, 0, 0, 1], [1, 1, 1]),
      rest: new Float32Array(rest),
      normal: new Int16Array(64),
      copy: Uint32Array.from({ length: 16 }, (_, i) => Math.floor(i / 8)),
      skin: Uint32Array.from({ length: 15 }, (_, i) => i + 1),
      wall: new Uint32Array(0),
      copies: new Uint32Array([...Array.from({ length: 16 }, (_, i) => i), ...Array<number>(8).fill(kNoNode)]),
      cells: new Int16Array([0, 0, 0, 0, 3, 0, 0, 0, 0, 0, 0, 0]),
      nodes: new Float32Array(nodes),
      fading: { ids: new Uint32Array(0), offsets: new Float32Array(0) },
    });
    const pose = new Float32Array(4 * kTextureWidth * poseRows(s.nc));
    fillPose(s, pose);
    const group = new Group();
    group.position.set(3.5, 0.5, -0.5);
    const placed = [{ thing: thing('tray'), group }];
    const scales = new Scales({ state: s, cells: { pose } } as unknown as BodyMesh, new Pieces(), {
      placed,
    } as unknown as ThingsView);
    return { scales, s };
  }
  it('weighs by what the engine says of the pieces, and of no other version', () => {
    const { scales, s } = scene();
    expect(scales.list()).toBeNull();
    const message = {
      type: 'masses' as const,
      body: 1,
      version: 4,
      uncut: 0.5,
      mass: new Float32Array([0.125, 0.25]),
      copy: new Uint32Array([0, 1]),
    };
    scales.take(message);
    expect(scales.list()).toEqual([
      { mass: 0.25, share: 0.5 },
      { mass: 0.125, share: 0.25 },
    ]);
    expect(scales.of(0)).toEqual({ mass: 0.125, share: 0.25 });
    expect([2, 3, kNoNode].map((c) => scales.of(c))).toEqual([null, null, null]); // a dead one, and none
    const [on] = scales.trays(up, 2);
    expect(on!.on).toEqual({ mass: 0.25, share: 0.5 });
    expect(on!.top.map((p) => p.toArray())).toContainEqual([3, 0, 0]);
    s.version = 5; // in a cut
    expect([scales.list(), scales.of(0), scales.trays(up, 2)[0]!.on]).toEqual([null, null, null]);
    scales.take({ ...message, version: 5, uncut: 0 });
    expect(scales.list()).toBeNull();
  });
});

describe('weights', () => {
  it('are said in words that fit the size', () => {
    expect([0, 4e-7, 2e-6, 0.00031, 0.0042, 0.142, 0.9994, 1.236].map(massWords)).toEqual([
      '0 g',
      '<1 mg',
      '2 mg',
      '0.31 g',
      '4.2 g',
      '142 g',
      '999 g',
      '1.24 kg',
    ]);
    expect([0, 0.0001, 0.004, 0.0996, 0.311].map(shareWords)).toEqual(['0 %', '<0.1 %', '0.4 %', '10 %', '31 %']);
    expect(weightWords({ mass: 0.142, share: 0.311 })).toBe('142 g, 31 %');
    expect(weightWords({ mass: 0.456, share: 1 })).toBe('456 g');
    expect(trayWords({ mass: 0.142, share: 0.311 })).toBe('tray: 142 g, 31 %');
    expect(trayWords({ mass: 0, share: 0 })).toBe('tray: 0 g');
  });
  it('list the eight heaviest and count the others', () => {
    const list = Array.from({ length: 20 }, (_, i) => ({ mass: 0.02 - i * 1e-4, share: 0.05 }));
    const { rows, smaller } = listRows(list);
    expect([rows.length, smaller, rows[0]]).toEqual([8, 12, ['20 g', '5.0 %']]);
    expect(listRows(list.slice(0, 8)).smaller).toBe(0);
  });
});
