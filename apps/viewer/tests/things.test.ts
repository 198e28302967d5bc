import { MeshBasicMaterial } from 'three';
import { describe, expect, it } from 'vitest';
import { readThings } from '../src/engine/things';
import { kPlaceFloats, kToolFloats, ProtocolError, type Things } from '../src/engine/protocol';
import { ThingsView } from '../src/scene/things';

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

describe('things that are drawn', () => {
  const thing = (shape: string, name: string, tool = false) => ({
    tool,
    shape,
    name,
    jaws: false,
    opening: 0,
    hinge: 0,
    parts: [{ side: 0, positions: new Float32Array(9), triangles: new Uint32Array([0, 1, 2]) }],
  });
  const view = new ThingsView(),
    wood = new MeshBasicMaterial();
  view.set(
    [thing('plane', 'floor'), thing('capsule', 'femur'), thing('probe', 'probe', true)],
    1,
    'meniscus',
    'lite',
    wood,
    (m) => m,
  );
  const places = new Float32Array(3 * kPlaceFloats),
    tools = new Float32Array(kToolFloats);
  for (let i = 0; i < 3; i++) places[kPlaceFloats * i + 6] = 1;
  tools[6] = 1;
  const seen = () => view.placed.map((s) => s.group.visible);

  it('move when they are placed and when their places change, and then only', () => {
    expect(view.place(places, tools)).toBe(true);
    expect(view.place(places, tools)).toBe(false);
    places[kPlaceFloats + 2] = 0.5;
    expect(view.place(places, tools)).toBe(true);
    expect(view.place(places, tools)).toBe(false);
    tools[0] = 0.3; // the hand is ahead of the tool: its ghost shows
    expect(view.place(places, tools)).toBe(true);
    expect(view.place(places, tools)).toBe(false);
  });
  it('show a femur from within the joint only, and a level plane never', () => {
    expect(seen()).toEqual([false, false, true]);
    view.inJoint = true;
    view.place(places, tools);
    expect(seen()).toEqual([false, true, true]);
    view.inJoint = false;
    expect(seen()).toEqual([false, false, true]);
  });
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
