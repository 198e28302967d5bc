import { makeFrame } from '../src/engine/frames';
import { describe, expect, it } from 'vitest';
import {
  ProtocolError,
  decodeEngineMessage,
  decodePageMessage,
  encodeEngineMessage,
  encodePageMessage,
  kNoNode,
  type EngineMessage,
  type PageMessage,
} from '../src/engine/protocol';
import { random } from '../src/scene/noise';

const counts = {
  visualVertices: 1,
  visualTriangles: 2,
  collisionVertices: 3,
  collisionTriangles: 4,
  nodes: 5,
  hexahedra: 6,
};
const eight = (a: number): number[] => Array.from({ length: 8 }, (_, k) => (a + k) % 9);

const engineMessages: EngineMessage[] = [
  {
    type: 'hello',
    session: 0xfedcba9876543210n,
    client: 7,
    readOnly: true,
    tick: 60,
    name: 'steak',
    json: '{"title":"Größe"}',
  },
  {
    type: 'body',
    body: 3,
    version: 9,
    frames: new Float32Array([
      ...makeFrame([1, 2, 3], [1, 0, 0, 0, 1, 0, 0, 0, 1], [0.5, 0.25, 0.125]),
      ...makeFrame([0, 1, 0], [0, 1, 0, 0, 0, 1, 1, 0, 0], [2, 4, 8]),
    ]),
    rest: new Float32Array([0, 1, 2, 3, 4, 5, 6, 7, 8]),
    normal: new Int16Array([0, 0, 32767, 0, -32767, 0, 0, 0, 1, 2, 3, 0]),
    copy: new Uint32Array([0, 1, 1]),
    skin: new Uint32Array([0, 1, 2]),
    wall: new Uint32Array([2, 1, 0, 1, 1, 2]),
    copies: new Uint32Array([...eight(0), ...Array(8).fill(kNoNode)]),
    cells: new Int16Array([0, 1, 2, 1, 3, 4, 5, 0]),
    nodes: new Float32Array(27).map((_, i) => i / 3),
    fading: { ids: new Uint32Array([1]), offsets: new Float32Array([1, 2, 3]) },
  },
  {
    type: 'patch',
    body: 3,
    from: 9,
    to: 10,
    input: 77,
    totals: { nv: 5, ns: 2, nw: 3, nc: 3, nn: 9 },
    vertices: {
      ids: new Uint32Array([0, 2]),
      rest: new Float32Array(9).fill(2),
      normal: new Int16Array(12).fill(-5),
      copy: new Uint32Array([2, 1, 0]),
    },
    skin: { ids: new Uint32Array([1]), triangles: new Uint32Array([4, 3, 2]) },
    wall: { ids: new Uint32Array([]), triangles: new Uint32Array([0, 1, 2]) },
    copies: {
      ids: new Uint32Array([1]),
      copies: new Uint32Array([...eight(1), ...eight(2)]),
      cells: new Int16Array(8).fill(1),
    },
    nodes: new Float32Array(27).fill(0.5),
    fading: { ids: new Uint32Array([1, 4]), offsets: new Float32Array(6).fill(0.25) },
  },
  {
    type: 'frame',
    body: 1,
    seq: 2,
    version: 3,
    input: 4,
    time: 1.25,
    stepMs: 0.5,
    speed: 1,
    flags: 3,
    undoDepth: 5,
    redoDepth: 6,
    nodes: new Float32Array([1, 2, 3]),
    grasps: new Float32Array([1, 2, 3, 4, 5, 6]),
    held: new Uint32Array([3]),
    places: new Float32Array(16).map((_, i) => i),
    tools: new Float32Array(14).map((_, i) => i / 2),
    contacts: new Float32Array(10).fill(3),
    partners: new Uint32Array([17]),
    touching: 4,
    press: 2.5,
    fading: { ids: new Uint32Array([2, 7]), offsets: new Float32Array([1, 2, 3, 4, 5, 6]) },
  },
  { type: 'hit', input: 5, triangle: -1, t: 0.1, point: [1, 2, 3], normal: [0, 0, 1], beside: 0.5, copy: 9 },
  {
    type: 'stats',
    stepMs: 1,
    stepMs99: 2,
    mechanicsMs: 3,
    stepsPerSecond: 500,
    iterations: 12,
    residual: 0.25,
    counts,
    pieces: 2,
    dropped: 3,
    bad: 4,
    clients: 5,
  },
  {
    type: 'cut',
    input: 1,
    outcome: 2,
    pieces: 3,
    trianglesCut: 4,
    bindingMs: 1,
    embeddingMs: 2,
    surfaceMs: 3,
    totalMs: 6,
    counts,
    invariants: 1,
    text: 'odd',
  },
  { type: 'role', holder: 3, held: true, clients: 4 },
  { type: 'error', input: 3, code: 2, text: 'bad value' },
  {
    type: 'overlay',
    body: 1,
    version: 2,
    rest: new Float32Array(6).fill(1),
    copy: new Uint32Array([0, 1]),
    triangles: new Uint32Array([0, 1, 1]),
    bound: new Uint32Array([5, 6]),
    links: new Uint32Array([1, 99, 0, 3]),
    feet: new Uint32Array([5, 2]),
    footRest: new Float32Array([1, 2, 3]),
  },
  {
    type: 'things',
    body: 2,
    json: '{"things":[]}',
    positions: new Float32Array(9).fill(1),
    triangles: new Uint32Array([0, 1, 2]),
  },
  { type: 'loading', input: 3, state: 0, fraction: 0.25, stage: 'paths' },
  { type: 'file', request: 9, name: 'a.obj', bytes: new Uint8Array([1, 2, 3, 4, 5]) },
  {
    type: 'score',
    lesionVolume: 2 ** -30,
    lesionRemoved: 0.5,
    healthyRemoved: 2 ** -32,
    healthyShare: 0.25,
    roughness: 2 ** -12,
    largestForce: 1.5,
    time: 12,
    loosePieces: 3,
  },
  { type: 'fixed', body: 2, nodes: new Uint32Array([0, 4, 5]), vertices: new Uint32Array([7, 9]) },
  {
    type: 'masses',
    body: 2,
    version: 3,
    uncut: 0.5,
    mass: new Float32Array([0.25, 0.125]),
    copy: new Uint32Array([4, 0]),
  },
];

const pageMessages: PageMessage[] = [
  { type: 'pageHello', protocol: 7, session: 123456789012345678n, body: 1, version: 7 },
  { type: 'ack', seq: 42 },
  {
    type: 'tool',
    input: 1,
    tool: 10,
    phase: 2,
    modifiers: 5,
    size: 0.25,
    samples: [
      { time: 12.5, origin: [1, 2, 3], direction: [0, 0, -1], pressure: 0.5 },
      { time: 13, origin: [4, 5, 6], direction: [0, 1, 0], pressure: 0 },
    ],
  },
  { type: 'tool', input: 2, tool: 0, phase: 3, modifiers: 0, size: 0, samples: [] },
  { type: 'ray', input: 3, near: 0.125, origin: [1, 2, 3], direction: [0, 0, -1] },
  { type: 'command', input: 4, code: 8, text: 'meniscus', value: [1, 2, 3, 4] },
  { type: 'device', input: 6, tool: 1, position: [1, 2, 3], rotation: [0, 0.5, 0], jaws: 0.25 },
  { type: 'claim', take: true },
  { type: 'upload', upload: 1, part: 1, name: 'mesh.obj', offset: 0, total: 10, bytes: new Uint8Array([7, 8, 9]) },
];

describe('messages', () => {
  it.each(engineMessages.map((m) => [m.type, m] as const))('carries %s to the page', (_, m) => {
    const bytes = encodeEngineMessage(m);
    expect(bytes.byteLength % 4).toBe(0);
    expect(decodeEngineMessage(bytes)).toEqual(m);
  });
  it.each(pageMessages.map((m) => [m.type, m] as const))('carries %s to the engine', (_, m) => {
    expect(decodePageMessage(encodePageMessage(m))).toEqual(m);
  });

  it('lays a frame out as the protocol page says', () => {
    const v = new DataView(encodeEngineMessage(engineMessages[3]!));
    expect([v.getUint16(0, true), v.getUint16(2, true), v.getUint32(4, true)]).toEqual([
      4,
      7,
      84 + 12 + 24 + 4 + 64 + 56 + 40 + 4 + 8 + 24,
    ]);
    expect([8, 12, 16, 20].map((o) => v.getUint32(o, true))).toEqual([1, 2, 3, 4]);
    expect(v.getFloat64(24, true)).toBe(1.25);
    expect([v.getFloat32(32, true), v.getFloat32(36, true)]).toEqual([0.5, 1]);
    expect([40, 44, 48, 52, 56, 60, 64, 68, 72].map((o) => v.getUint32(o, true))).toEqual([1, 3, 5, 6, 1, 2, 1, 1, 4]);
    expect([76, 84, 88, 92].map((o) => v.getFloat32(o, true))).toEqual([2.5, 1, 2, 3]);
    const fades = v.byteLength - 32;
    expect([80, fades, fades + 4].map((o) => v.getUint32(o, true))).toEqual([2, 2, 7]);
    expect([8, 28].map((o) => v.getFloat32(fades + o, true))).toEqual([1, 6]);
  });
  it('lays bodies, patches, hits and tools out as the protocol page says', () => {
    const body = new DataView(encodeEngineMessage(engineMessages[1]!));
    expect([8, 12, 16, 20, 24, 28, 32, 36].map((o) => body.getUint32(o, true))).toEqual([3, 9, 3, 1, 2, 2, 9, 1]);
    expect(body.getUint32(40, true)).toBe(2);
    expect([48, 52, 56, 100, 104, 108].map((o) => body.getFloat32(o, true))).toEqual([1, 2, 3, 0.5, 0.25, 0.125]);
    expect([112, 116, 164, 168, 172].map((o) => body.getFloat32(o, true))).toEqual([0, 1, 2, 4, 8]);
    expect(body.getFloat32(176 + 4, true)).toBe(1);
    expect(body.getInt16(176 + 36 + 4, true)).toBe(32767);
    const patch = new DataView(encodeEngineMessage(engineMessages[2]!));
    expect(Array.from({ length: 19 }, (_, i) => patch.getUint32(8 + 4 * i, true))).toEqual([
      3, 9, 10, 77, 5, 2, 3, 3, 9, 2, 1, 0, 1, 1, 0, 1, 1, 2, 0,
    ]);
    expect(patch.getUint32(84 + 4, true)).toBe(2);
    const hit = new DataView(encodeEngineMessage(engineMessages[4]!));
    expect([
      hit.byteLength,
      hit.getInt32(12, true),
      hit.getFloat64(16, true),
      hit.getFloat64(40, true),
      hit.getFloat32(56, true),
    ]).toEqual([68, -1, 0.1, 3, 1]);
    expect(hit.getUint32(64, true)).toBe(9);
    const masses = new DataView(encodeEngineMessage(engineMessages[engineMessages.length - 1]!));
    expect([masses.byteLength, ...[8, 12, 20, 32, 36].map((o) => masses.getUint32(o, true))]).toEqual([
      40, 2, 3, 2, 4, 0,
    ]);
    expect([16, 24, 28].map((o) => masses.getFloat32(o, true))).toEqual([0.5, 0.25, 0.125]);
    const tool = new DataView(encodePageMessage(pageMessages[2]!));
    expect([
      tool.byteLength,
      tool.getUint32(24, true),
      tool.getFloat64(32, true),
      tool.getFloat64(40, true),
      tool.getFloat32(88, true),
    ]).toEqual([32 + 128, 2, 12.5, 1, 0.5]);
  });
});

describe('bad messages', () => {
  const both: [ArrayBuffer, (b: ArrayBuffer) => unknown][] = [
    ...engineMessages.map(
      (m) => [encodeEngineMessage(m), decodeEngineMessage] as [ArrayBuffer, (b: ArrayBuffer) => unknown],
    ),
    ...pageMessages.map((m) => [encodePageMessage(m), decodePageMessage] as [ArrayBuffer, (b: ArrayBuffer) => unknown]),
  ];
  it('refuses every truncation, with or without an honest length', () => {
    for (const [bytes, decode] of both) {
      for (let n = 0; n < bytes.byteLength; n++) {
        const cut = bytes.slice(0, n);
        expect(() => decode(cut)).toThrow(ProtocolError);
        if (n >= 8) {
          new DataView(cut).setUint32(4, n, true);
          expect(() => decode(cut)).toThrow(ProtocolError);
        }
      }
    }
  });
  it('refuses bytes too many', () => {
    for (const [bytes, decode] of both) {
      const longer = new Uint8Array(bytes.byteLength + 4);
      longer.set(new Uint8Array(bytes));
      new DataView(longer.buffer).setUint32(4, longer.length, true);
      expect(() => decode(longer.buffer)).toThrow(ProtocolError);
    }
  });
  it('never throws anything else, whatever the bytes', () => {
    const next = random(5);
    for (const [bytes, decode] of both) {
      for (let i = 0; i < 400; i++) {
        const bad = new Uint8Array(bytes.slice(0));
        for (let k = 0; k < 1 + 3 * next(); k++) {
          const at = Math.floor(next() * bad.length);
          bad[at] = next() < 0.3 ? 255 : Math.floor(next() * 256);
        }
        try {
          decode(bad.buffer);
        } catch (e) {
          expect(e).toBeInstanceOf(ProtocolError);
        }
      }
    }
  });
  it('refuses huge counts without allocating', () => {
    for (const [bytes, decode] of both) {
      for (let at = 8; at + 4 <= Math.min(84, bytes.byteLength); at += 4) {
        const bad = bytes.slice(0);
        new DataView(bad).setUint32(at, 0x7ffffff0, true);
        try {
          decode(bad);
        } catch (e) {
          expect(e).toBeInstanceOf(ProtocolError);
        }
      }
    }
  });
  const changed = (m: EngineMessage, change: (v: DataView) => void): ArrayBuffer => {
    const b = encodeEngineMessage(m);
    change(new DataView(b));
    return b;
  };
  it('refuses other versions and unknown types', () => {
    expect(() => decodeEngineMessage(changed(engineMessages[7]!, (v) => v.setUint16(2, 1, true)))).toThrow(/version 1/);
    expect(() => decodeEngineMessage(changed(engineMessages[7]!, (v) => v.setUint16(0, 64, true)))).toThrow(/type 64/);
  });
  it('refuses numbers that are not finite', () => {
    expect(() => decodeEngineMessage(changed(engineMessages[3]!, (v) => v.setFloat32(88, NaN, true)))).toThrow(
      /finite/,
    );
    expect(() => decodeEngineMessage(changed(engineMessages[4]!, (v) => v.setFloat64(24, Infinity, true)))).toThrow(
      /finite/,
    );
  });
  it('refuses pieces that weigh less than nothing', () => {
    const masses = engineMessages[engineMessages.length - 1]!;
    for (const at of [16, 24, 28])
      expect(() => decodeEngineMessage(changed(masses, (v) => v.setFloat32(at, -1, true)))).toThrow(/weighs -1 kg/);
    expect(() => decodeEngineMessage(changed(masses, (v) => v.setFloat32(24, Infinity, true)))).toThrow(/finite/);
    expect(() => decodeEngineMessage(changed(masses, (v) => v.setUint32(20, 3, true)))).toThrow(ProtocolError);
  });
  it('refuses ids out of range and unsorted', () => {
    const body = engineMessages[1]! as Extract<EngineMessage, { type: 'body' }>;
    const patch = engineMessages[2]! as Extract<EngineMessage, { type: 'patch' }>;
    expect(() => decodeEngineMessage(encodeEngineMessage({ ...body, copy: new Uint32Array([0, 1, 2]) }))).toThrow(
      /copy of vertex/,
    );
    expect(() => decodeEngineMessage(encodeEngineMessage({ ...body, skin: new Uint32Array([0, 1, 3]) }))).toThrow(
      /skin/,
    );
    expect(() =>
      decodeEngineMessage(encodeEngineMessage({ ...body, copies: body.copies.slice().fill(9, 3, 4) })),
    ).toThrow(/node 9/);
    expect(() =>
      decodeEngineMessage(encodeEngineMessage({ ...body, copies: body.copies.slice().fill(0, 15, 16) })),
    ).toThrow(/node 0/);
    expect(() =>
      decodeEngineMessage(
        encodeEngineMessage({ ...patch, vertices: { ...patch.vertices, ids: new Uint32Array([2, 0]) } }),
      ),
    ).toThrow(/ascending/);
    expect(() =>
      decodeEngineMessage(
        encodeEngineMessage({ ...patch, vertices: { ...patch.vertices, ids: new Uint32Array([0, 4]) } }),
      ),
    ).toThrow(/not below 4/);
    expect(() => decodeEngineMessage(encodeEngineMessage({ ...patch, totals: { ...patch.totals, nw: 0 } }))).toThrow(
      /appended/,
    );
    const fading = { ids: new Uint32Array([3, 5]), offsets: new Float32Array(6) };
    expect(() => decodeEngineMessage(encodeEngineMessage({ ...patch, fading }))).toThrow(/fading vertex 5/);
    expect(() =>
      decodeEngineMessage(encodeEngineMessage({ ...patch, fading: { ...fading, ids: new Uint32Array([3, 3]) } })),
    ).toThrow(/ascending/);
    const overlay = engineMessages[9]! as Extract<EngineMessage, { type: 'overlay' }>;
    expect(() => decodeEngineMessage(encodeEngineMessage({ ...overlay, links: new Uint32Array([2, 0]) }))).toThrow(
      /link/,
    );
    expect(() => decodeEngineMessage(encodeEngineMessage({ ...overlay, feet: new Uint32Array([5, 3]) }))).toThrow(
      /foot/,
    );
  });
});
