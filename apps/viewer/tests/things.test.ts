import { describe, expect, it } from 'vitest';
import { readThings } from '../src/engine/things';
import { ProtocolError, type Things } from '../src/engine/protocol';

const part = (vertices: number, triangles: number, side = 0) => ({ vertices, triangles, side });
const message = (parts: object[], np: number, corners: number[]): Things => ({
  type: 'things',
  body: 1,
  positions: new Float32Array(3 * np).map((_, i) => i),
  triangles: new Uint32Array(corners),
  json: JSON.stringify({
    things: [{ kind: 'tool', shape: 'grasper', name: 'g', jaws: true, opening: 0.6, hinge: 0.012, parts }],
  }),
});

describe('things', () => {
  it('are taken apart', () => {
    const [thing] = readThings(message([part(3, 1, 1), part(3, 1, -1)], 6, [0, 1, 2, 2, 1, 0]));
    expect([thing!.tool, thing!.shape, thing!.jaws, thing!.hinge]).toEqual([true, 'grasper', true, 0.012]);
    expect(thing!.parts.map((p) => [p.side, p.positions[0], [...p.triangles]])).toEqual([
      [1, 0, [0, 1, 2]],
      [-1, 9, [2, 1, 0]],
    ]);
  });
  it('are refused when they do not fit', () => {
    expect(() => readThings(message([part(3, 1)], 6, [0, 1, 2]))).toThrow(ProtocolError); // left over
    expect(() => readThings(message([part(7, 1)], 6, [0, 1, 2]))).toThrow(ProtocolError); // past the end
    expect(() => readThings(message([part(3, 1), part(3, 1)], 6, [0, 1, 2, 3, 4, 5]))).toThrow(ProtocolError); // another part's corner
    expect(() => readThings(message([part(-3, 1)], 6, [0, 1, 2]))).toThrow(ProtocolError);
    expect(() => readThings({ ...message([], 0, []), json: '{' })).toThrow(ProtocolError);
    expect(readThings({ ...message([], 0, []), json: '[]' })).toEqual([]);
  });
});
