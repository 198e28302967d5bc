// Messages between page and engine, protocol version 7: docs/protocol.md.
// Decoded messages hold views on the received buffer: copy what is kept.

import { cellSize, kFrameFloats } from './frames';

export const kProtocolVersion = 7;
export const kHeaderBytes = 8;
export const kMaxToolSamples = 1000; // 64 bytes each: stays below 64 KiB
export const kUploadChunkBytes = 48 * 1024;
export const kNoNode = 0xffffffff;

export const MessageType = {
  Hello: 1,
  Body: 2,
  Patch: 3,
  Frame: 4,
  Hit: 5,
  Stats: 6,
  CutReport: 7,
  Role: 8,
  Error: 9,
  Overlay: 10,
  File: 11,
  Loading: 12,
  Things: 13,
  Score: 14,
  Fixed: 15,
  Masses: 16,
  Packed: 32,
  PageHello: 64,
  Ack: 65,
  Tool: 66,
  Ray: 67,
  Command: 68,
  Claim: 69,
  Upload: 70,
  Device: 71,
} as const;

export const ToolCode = {
  Scalpel: 0,
  Grasp: 1,
  Fix: 2,
  Release: 3,
  Line: 4,
  Punch: 5,
  Scissors: 6,
  Shaver: 7,
  Suction: 8,
  Take: 9,
  Probe: 10,
} as const;
export const Phase = { Down: 0, Move: 1, Up: 2, Cancel: 3 } as const;
export const Modifier = { Shift: 1, Control: 2, Alt: 4, Meta: 8 } as const;
export const CommandCode = {
  Play: 1,
  Pause: 2,
  Step: 3,
  Speed: 4,
  Reset: 5,
  Undo: 6,
  Redo: 7,
  Scene: 8,
  Gravity: 9,
  Material: 10,
  Export: 11,
  Recording: 12,
  Overlay: 13,
  LoadUpload: 14,
  FixAll: 15,
  StopLoading: 16,
  Unit: 17,
  Contacts: 18,
} as const;
export const Outcome = { Cut: 0, NothingMet: 1, Refused: 2, Undone: 3, Redone: 4 } as const;
export const ContactWith = { Obstacle: 0, Tool: 1, Body: 2, Sliding: 16 } as const;
export const kPlaceFloats = 8; // x y z, quaternion x y z w, jaws
export const kToolFloats = 14; // pose followed: x y z, quaternion x y z w; force, torque, 0
export const kContactFloats = 10; // point, normal, force, gap
export const LoadState = { UnderWay: 0, Shown: 1, Failed: 2, Stopped: 3 } as const;
export const UploadPart = { Visual: 0, Collision: 1, Scene: 2 } as const;
export const FrameFlag = { Playing: 1, Stroke: 2 } as const;

export type Vec3 = readonly [number, number, number];

export interface Hello {
  type: 'hello';
  session: bigint;
  client: number;
  readOnly: boolean;
  tick: number;
  name: string;
  json: string;
}
export interface Body {
  type: 'body';
  body: number;
  version: number;
  /** Per body the place of its cells: kFrameFloats numbers, see frames.ts. */
  frames: Float32Array;
  rest: Float32Array;
  normal: Int16Array;
  copy: Uint32Array;
  skin: Uint32Array;
  wall: Uint32Array;
  copies: Uint32Array;
  cells: Int16Array;
  nodes: Float32Array;
  fading: Fading;
}
export interface VertexChange {
  ids: Uint32Array;
  rest: Float32Array;
  normal: Int16Array;
  copy: Uint32Array;
}
export interface TriangleChange {
  ids: Uint32Array;
  triangles: Uint32Array;
}
export interface CopyChange {
  ids: Uint32Array;
  copies: Uint32Array;
  cells: Int16Array;
}
/** Render vertices that are drawn beside where their copies put them, ascending, and by how much (metres): all there are. */
export interface Fading {
  ids: Uint32Array;
  offsets: Float32Array;
}
export interface Totals {
  nv: number;
  ns: number;
  nw: number;
  nc: number;
  nn: number;
}
export interface Patch {
  type: 'patch';
  body: number;
  from: number;
  to: number;
  input: number;
  totals: Totals;
  vertices: VertexChange;
  skin: TriangleChange;
  wall: TriangleChange;
  copies: CopyChange;
  nodes: Float32Array;
  fading: Fading;
}
export interface Frame {
  type: 'frame';
  body: number;
  seq: number;
  version: number;
  input: number;
  time: number;
  stepMs: number;
  speed: number;
  flags: number;
  undoDepth: number;
  redoDepth: number;
  nodes: Float32Array;
  grasps: Float32Array;
  /** Of each grasp: a copy of what is held; kNoNode: nothing. */
  held: Uint32Array;
  places: Float32Array;
  tools: Float32Array;
  contacts: Float32Array;
  partners: Uint32Array;
  touching: number;
  press: number;
  fading: Fading;
}
export interface Hit {
  type: 'hit';
  input: number;
  triangle: number;
  t: number;
  point: Vec3;
  normal: Vec3;
  beside: number;
  /** A copy of what was hit; kNoNode: nothing. */
  copy: number;
}
/** What the pieces weigh, kg, with a copy of each; and all of it, as it was uncut. */
export interface Masses {
  type: 'masses';
  body: number;
  version: number;
  uncut: number;
  mass: Float32Array;
  copy: Uint32Array;
}
/** What supports hold: nodes, and render vertices where nodes of the hexahedron move; ascending. */
export interface Fixed {
  type: 'fixed';
  body: number;
  nodes: Uint32Array;
  vertices: Uint32Array;
}
/** How the operation stands, in scenes with a lesion: m³, shares, metres, N, s. */
export interface Score {
  type: 'score';
  lesionVolume: number;
  lesionRemoved: number;
  healthyRemoved: number;
  healthyShare: number;
  roughness: number;
  largestForce: number;
  time: number;
  loosePieces: number;
}
export interface Stats {
  type: 'stats';
  stepMs: number;
  stepMs99: number;
  mechanicsMs: number;
  stepsPerSecond: number;
  iterations: number;
  residual: number;
  counts: Counts;
  pieces: number;
  dropped: number;
  bad: number;
  clients: number;
}
export interface Counts {
  visualVertices: number;
  visualTriangles: number;
  collisionVertices: number;
  collisionTriangles: number;
  nodes: number;
  hexahedra: number;
}
export interface CutReport {
  type: 'cut';
  input: number;
  outcome: number;
  pieces: number;
  trianglesCut: number;
  bindingMs: number;
  embeddingMs: number;
  surfaceMs: number;
  totalMs: number;
  counts: Counts;
  invariants: number;
  text: string;
}
export interface Role {
  type: 'role';
  holder: number;
  held: boolean;
  clients: number;
}
export interface EngineError {
  type: 'error';
  input: number;
  code: number;
  text: string;
}
export interface Overlay {
  type: 'overlay';
  body: number;
  version: number;
  rest: Float32Array;
  copy: Uint32Array;
  triangles: Uint32Array;
  bound: Uint32Array;
  links: Uint32Array;
  feet: Uint32Array;
  footRest: Float32Array;
}
/** Parts of obstacles and tools, in the axes of their thing; `json` says what belongs to what. */
export interface Things {
  type: 'things';
  body: number;
  json: string;
  positions: Float32Array;
  triangles: Uint32Array;
}
export interface Loading {
  type: 'loading';
  input: number;
  state: number;
  fraction: number;
  stage: string;
}
export interface FileMessage {
  type: 'file';
  request: number;
  name: string;
  bytes: Uint8Array;
}
export type EngineMessage =
  | Hello
  | Body
  | Patch
  | Frame
  | Hit
  | Stats
  | CutReport
  | Role
  | EngineError
  | Overlay
  | FileMessage
  | Loading
  | Things
  | Score
  | Fixed
  | Masses;

export interface PageHello {
  type: 'pageHello';
  protocol: number;
  session: bigint;
  body: number;
  version: number;
}
export interface Ack {
  type: 'ack';
  seq: number;
}
export interface ToolSample {
  time: number;
  origin: Vec3;
  direction: Vec3;
  pressure: number;
}
export interface ToolMessage {
  type: 'tool';
  input: number;
  tool: number;
  phase: number;
  modifiers: number;
  size: number;
  samples: ToolSample[];
}
export interface RayMessage {
  type: 'ray';
  input: number;
  near: number;
  origin: Vec3;
  direction: Vec3;
}
export interface CommandMessage {
  type: 'command';
  input: number;
  code: number;
  text: string;
  value: readonly [number, number, number, number];
}
export interface Claim {
  type: 'claim';
  take: boolean;
}
export interface UploadMessage {
  type: 'upload';
  upload: number;
  part: number;
  name: string;
  offset: number;
  total: number;
  bytes: Uint8Array;
}
export interface DeviceMessage {
  type: 'device';
  input: number;
  tool: number;
  position: Vec3;
  rotation: Vec3;
  jaws: number;
}
export type PageMessage =
  PageHello | Ack | ToolMessage | RayMessage | CommandMessage | Claim | UploadMessage | DeviceMessage;

/** A message that does not follow the protocol. */
export class ProtocolError extends Error {}

const utf8Encoder = new TextEncoder();
const utf8Decoder = new TextDecoder('utf-8');

const padded = (bytes: number): number => (bytes + 3) & ~3;

// ---------------------------------------------------------------------------------------------------------------------
// Reading

/** Walks over one message; every access is checked against its length. */
class Reader {
  readonly view: DataView;
  offset = kHeaderBytes;
  constructor(readonly buffer: ArrayBuffer) {
    this.view = new DataView(buffer);
  }

  private take(bytes: number): number {
    const at = this.offset;
    if (bytes < 0 || at + bytes > this.buffer.byteLength) {
      throw new ProtocolError(`message of ${this.buffer.byteLength} bytes ends before byte ${at + bytes}`);
    }
    this.offset = at + bytes;
    return at;
  }
  u32(): number {
    return this.view.getUint32(this.take(4), true);
  }
  i32(): number {
    return this.view.getInt32(this.take(4), true);
  }
  u64(): bigint {
    return this.view.getBigUint64(this.take(8), true);
  }
  f32(): number {
    return this.finite(this.view.getFloat32(this.take(4), true));
  }
  f64(): number {
    return this.finite(this.view.getFloat64(this.take(8), true));
  }
  vec3f(): Vec3 {
    return [this.f32(), this.f32(), this.f32()];
  }
  vec3d(): Vec3 {
    return [this.f64(), this.f64(), this.f64()];
  }
  private finite(x: number): number {
    if (!Number.isFinite(x)) throw new ProtocolError(`a number at byte ${this.offset} is not finite`);
    return x;
  }
  f32s(n: number): Float32Array {
    const a = new Float32Array(this.buffer, this.take(4 * n), n);
    for (let i = 0; i < n; i++) {
      if (!Number.isFinite(a[i]!)) throw new ProtocolError(`array value ${i} is not finite`);
    }
    return a;
  }
  u32s(n: number): Uint32Array {
    return new Uint32Array(this.buffer, this.take(4 * n), n);
  }
  i16s(n: number): Int16Array {
    const at = this.take(padded(2 * n));
    return new Int16Array(this.buffer, at, n);
  }
  bytes(n: number): Uint8Array {
    const at = this.take(padded(n));
    return new Uint8Array(this.buffer, at, n);
  }
  text(n: number): string {
    return utf8Decoder.decode(this.bytes(n));
  }
  end(): void {
    if (this.offset !== this.buffer.byteLength) {
      throw new ProtocolError(`message has ${this.buffer.byteLength - this.offset} bytes too many`);
    }
  }
}

function checkBelow(ids: Uint32Array, limit: number, what: string): void {
  for (let i = 0; i < ids.length; i++) {
    if (ids[i]! >= limit) throw new ProtocolError(`${what} ${ids[i]} at ${i} is not below ${limit}`);
  }
}

function checkAscending(ids: Uint32Array, what: string): void {
  for (let i = 1; i < ids.length; i++) {
    if (ids[i]! <= ids[i - 1]!) throw new ProtocolError(`${what} are not in ascending order at ${i}`);
  }
}

function checkCopies(copies: Uint32Array, nn: number): void {
  for (let c = 0; c < copies.length; c += 8) {
    const dead = copies[c] === kNoNode;
    for (let k = 0; k < 8; k++) {
      const node = copies[c + k]!;
      if (dead ? node !== kNoNode : node >= nn) throw new ProtocolError(`copy ${c / 8} has node ${node} of ${nn}`);
    }
  }
}

function readCounts(r: Reader): Counts {
  return {
    visualVertices: r.u32(),
    visualTriangles: r.u32(),
    collisionVertices: r.u32(),
    collisionTriangles: r.u32(),
    nodes: r.u32(),
    hexahedra: r.u32(),
  };
}

function readBody(r: Reader): Body {
  const body = r.u32(),
    version = r.u32(),
    nv = r.u32(),
    ns = r.u32(),
    nw = r.u32(),
    nc = r.u32(),
    nn = r.u32();
  const nfade = r.u32(),
    nb = r.u32();
  r.u32();
  const frames = r.f32s(kFrameFloats * nb);
  for (let b = 0; b < nb; b++)
    if (cellSize(frames, b).some((s) => !(s > 0))) throw new ProtocolError('cell size is not positive');
  const m: Body = {
    type: 'body',
    body,
    version,
    frames,
    rest: r.f32s(3 * nv),
    normal: r.i16s(4 * nv),
    copy: r.u32s(nv),
    skin: r.u32s(3 * ns),
    wall: r.u32s(3 * nw),
    copies: r.u32s(8 * nc),
    cells: r.i16s(4 * nc),
    nodes: r.f32s(3 * nn),
    fading: readFading(r, nfade),
  };
  checkBelow(m.fading.ids, nv, 'fading vertex');
  checkBelow(m.copy, nc, 'copy of vertex');
  checkBelow(m.skin, nv, 'vertex of skin triangle');
  checkBelow(m.wall, nv, 'vertex of wall triangle');
  checkCopies(m.copies, nn);
  checkFrames(m.cells, nb);
  return m;
}

function checkFrames(cells: Int16Array, frames: number): void {
  for (let i = 3; i < cells.length; i += 4)
    if (cells[i]! < 0 || cells[i]! >= frames) throw new ProtocolError(`frame of cell ${(i - 3) / 4} is ${cells[i]}`);
}

function readFading(r: Reader, n: number): Fading {
  const fading = { ids: r.u32s(n), offsets: r.f32s(3 * n) };
  checkAscending(fading.ids, 'fading vertices');
  return fading;
}

function readPatch(r: Reader): Patch {
  const body = r.u32(),
    from = r.u32(),
    to = r.u32(),
    input = r.u32();
  const totals: Totals = { nv: r.u32(), ns: r.u32(), nw: r.u32(), nc: r.u32(), nn: r.u32() };
  const mv = r.u32(),
    ms = r.u32(),
    mw = r.u32(),
    mc = r.u32();
  const av = r.u32(),
    as = r.u32(),
    aw = r.u32(),
    ac = r.u32();
  const nfade = r.u32();
  r.u32();
  const triangles = (m: number, a: number): TriangleChange => ({ ids: r.u32s(m), triangles: r.u32s(3 * (m + a)) });
  const vertices: VertexChange = {
    ids: r.u32s(mv),
    rest: r.f32s(3 * (mv + av)),
    normal: r.i16s(4 * (mv + av)),
    copy: r.u32s(mv + av),
  };
  const skin = triangles(ms, as),
    wall = triangles(mw, aw);
  const copies: CopyChange = { ids: r.u32s(mc), copies: r.u32s(8 * (mc + ac)), cells: r.i16s(4 * (mc + ac)) };
  const nodes = r.f32s(3 * totals.nn),
    fading = readFading(r, nfade);
  checkBelow(fading.ids, totals.nv, 'fading vertex');
  const changes: [Uint32Array, number, number, string][] = [
    [vertices.ids, totals.nv, av, 'vertices'],
    [skin.ids, totals.ns, as, 'skin triangles'],
    [wall.ids, totals.nw, aw, 'wall triangles'],
    [copies.ids, totals.nc, ac, 'copies'],
  ];
  for (const [ids, total, appended, what] of changes) {
    if (appended > total) throw new ProtocolError(`${appended} appended ${what} of ${total}`);
    checkBelow(ids, total - appended, `changed ${what}:`);
    checkAscending(ids, `changed ${what}`);
  }
  checkBelow(vertices.copy, totals.nc, 'copy of vertex');
  checkBelow(skin.triangles, totals.nv, 'vertex of skin triangle');
  checkBelow(wall.triangles, totals.nv, 'vertex of wall triangle');
  checkCopies(copies.copies, totals.nn);
  return { type: 'patch', body, from, to, input, totals, vertices, skin, wall, copies, nodes, fading };
}

function readFrame(r: Reader): Frame {
  const body = r.u32(),
    seq = r.u32(),
    version = r.u32(),
    input = r.u32(),
    time = r.f64(),
    stepMs = r.f32();
  const speed = r.f32(),
    nn = r.u32(),
    flags = r.u32(),
    undoDepth = r.u32(),
    redoDepth = r.u32(),
    ng = r.u32();
  const np = r.u32(),
    nt = r.u32(),
    nk = r.u32(),
    touching = r.u32(),
    press = r.f32(),
    nfade = r.u32();
  if (nt > np) throw new ProtocolError(`${nt} tools among ${np} things`);
  return {
    type: 'frame',
    body,
    seq,
    version,
    input,
    time,
    stepMs,
    speed,
    flags,
    undoDepth,
    redoDepth,
    nodes: r.f32s(3 * nn),
    grasps: r.f32s(6 * ng),
    held: r.u32s(ng),
    places: r.f32s(kPlaceFloats * np),
    tools: r.f32s(kToolFloats * nt),
    contacts: r.f32s(kContactFloats * nk),
    partners: r.u32s(nk),
    touching,
    press,
    fading: readFading(r, nfade),
  };
}

function readOverlay(r: Reader): Overlay {
  const body = r.u32(),
    version = r.u32(),
    ncv = r.u32(),
    nct = r.u32(),
    nb = r.u32(),
    nl = r.u32(),
    nf = r.u32();
  r.u32();
  const m: Overlay = {
    type: 'overlay',
    body,
    version,
    rest: r.f32s(3 * ncv),
    copy: r.u32s(ncv),
    triangles: r.u32s(3 * nct),
    bound: r.u32s(2 * nb),
    links: r.u32s(2 * nl),
    feet: r.u32s(2 * nf),
    footRest: r.f32s(3 * nf),
  };
  for (let i = 1; i < m.feet.length; i += 2) {
    if (m.feet[i]! > 2) throw new ProtocolError(`foot ${(i - 1) / 2} is bound to an element of kind ${m.feet[i]}`);
  }
  checkBelow(m.triangles, ncv, 'vertex of collision triangle');
  for (let i = 0; i < m.links.length; i += 2) {
    if (m.links[i]! >= ncv) throw new ProtocolError(`link ${i / 2} starts at collision vertex ${m.links[i]} of ${ncv}`);
  }
  return m;
}

function readMasses(r: Reader): Masses {
  const body = r.u32(),
    version = r.u32(),
    uncut = r.f32(),
    n = r.u32();
  const m: Masses = { type: 'masses', body, version, uncut, mass: r.f32s(n), copy: r.u32s(n) };
  for (const x of [uncut, ...m.mass]) if (x < 0) throw new ProtocolError(`a piece weighs ${x} kg`);
  return m;
}

function readCutReport(r: Reader): CutReport {
  const input = r.u32(),
    outcome = r.u32(),
    pieces = r.u32(),
    trianglesCut = r.u32();
  const bindingMs = r.f32(),
    embeddingMs = r.f32(),
    surfaceMs = r.f32(),
    totalMs = r.f32();
  const counts = readCounts(r),
    invariants = r.u32(),
    bytes = r.u32();
  return {
    type: 'cut',
    input,
    outcome,
    pieces,
    trianglesCut,
    bindingMs,
    embeddingMs,
    surfaceMs,
    totalMs,
    counts,
    invariants,
    text: r.text(bytes),
  };
}

function readHello(r: Reader): Hello {
  const session = r.u64(),
    client = r.u32(),
    flags = r.u32(),
    tick = r.f32(),
    nameBytes = r.u32(),
    jsonBytes = r.u32();
  r.u32();
  return {
    type: 'hello',
    session,
    client,
    readOnly: (flags & 1) !== 0,
    tick,
    name: r.text(nameBytes),
    json: r.text(jsonBytes),
  };
}

function openMessage(buffer: ArrayBuffer): { type: number; reader: Reader } {
  if (buffer.byteLength < kHeaderBytes) throw new ProtocolError(`message of ${buffer.byteLength} bytes has no header`);
  const reader = new Reader(buffer);
  const type = reader.view.getUint16(0, true),
    version = reader.view.getUint16(2, true);
  const length = reader.view.getUint32(4, true);
  if (version !== kProtocolVersion) throw new ProtocolError(`protocol version ${version}, not ${kProtocolVersion}`);
  if (length !== buffer.byteLength) throw new ProtocolError(`length ${length}, but ${buffer.byteLength} bytes came`);
  if (length % 4 !== 0) throw new ProtocolError(`length ${length} is not a multiple of 4`);
  return { type, reader };
}

/** Decodes a message of the engine; throws ProtocolError for anything that docs/protocol.md does not allow. */
export function decodeEngineMessage(buffer: ArrayBuffer): EngineMessage {
  const { type, reader: r } = openMessage(buffer);
  let m: EngineMessage;
  switch (type) {
    case MessageType.Hello:
      m = readHello(r);
      break;
    case MessageType.Body:
      m = readBody(r);
      break;
    case MessageType.Patch:
      m = readPatch(r);
      break;
    case MessageType.Frame:
      m = readFrame(r);
      break;
    case MessageType.Hit: {
      m = {
        type: 'hit',
        input: r.u32(),
        triangle: r.i32(),
        t: r.f64(),
        point: r.vec3d(),
        normal: r.vec3f(),
        beside: r.f32(),
        copy: r.u32(),
      };
      break;
    }
    case MessageType.Stats: {
      const stepMs = r.f32(),
        stepMs99 = r.f32(),
        mechanicsMs = r.f32(),
        stepsPerSecond = r.f32();
      const iterations = r.u32(),
        residual = r.f32(),
        counts = readCounts(r);
      m = {
        type: 'stats',
        stepMs,
        stepMs99,
        mechanicsMs,
        stepsPerSecond,
        iterations,
        residual,
        counts,
        pieces: r.u32(),
        dropped: r.u32(),
        bad: r.u32(),
        clients: r.u32(),
      };
      break;
    }
    case MessageType.CutReport:
      m = readCutReport(r);
      break;
    case MessageType.Role: {
      const holder = r.u32(),
        held = r.u32() !== 0,
        clients = r.u32();
      r.u32();
      m = { type: 'role', holder, held, clients };
      break;
    }
    case MessageType.Error: {
      const input = r.u32(),
        code = r.u32(),
        bytes = r.u32();
      r.u32();
      m = { type: 'error', input, code, text: r.text(bytes) };
      break;
    }
    case MessageType.Overlay:
      m = readOverlay(r);
      break;
    case MessageType.File: {
      const request = r.u32(),
        nameBytes = r.u32(),
        bytes = r.u32();
      r.u32();
      m = { type: 'file', request, name: r.text(nameBytes), bytes: r.bytes(bytes) };
      break;
    }
    case MessageType.Things: {
      const body = r.u32(),
        jsonBytes = r.u32(),
        np = r.u32(),
        nt = r.u32();
      m = { type: 'things', body, json: r.text(jsonBytes), positions: r.f32s(3 * np), triangles: r.u32s(3 * nt) };
      checkBelow(m.triangles, np, 'corner of a thing');
      break;
    }
    case MessageType.Score:
      m = {
        type: 'score',
        lesionVolume: r.f32(),
        lesionRemoved: r.f32(),
        healthyRemoved: r.f32(),
        healthyShare: r.f32(),
        roughness: r.f32(),
        largestForce: r.f32(),
        time: r.f32(),
        loosePieces: r.u32(),
      };
      break;
    case MessageType.Fixed: {
      const body = r.u32(),
        n = r.u32(),
        h = r.u32();
      r.u32();
      m = { type: 'fixed', body, nodes: r.u32s(n), vertices: r.u32s(h) };
      break;
    }
    case MessageType.Masses:
      m = readMasses(r);
      break;
    case MessageType.Loading: {
      const input = r.u32(),
        state = r.u32(),
        fraction = r.f32(),
        bytes = r.u32();
      if (state > LoadState.Stopped || fraction < 0 || fraction > 1)
        throw new ProtocolError(`loading in state ${state} at ${fraction}`);
      m = { type: 'loading', input, state, fraction, stage: r.text(bytes) };
      break;
    }
    default:
      throw new ProtocolError(`unknown message type ${type}`);
  }
  r.end();
  return m;
}

/** Decodes a message of the page (engines written in TypeScript, tests). */
export function decodePageMessage(buffer: ArrayBuffer): PageMessage {
  const { type, reader: r } = openMessage(buffer);
  let m: PageMessage;
  switch (type) {
    case MessageType.PageHello: {
      const protocol = r.u32();
      r.u32();
      m = { type: 'pageHello', protocol, session: r.u64(), body: r.u32(), version: r.u32() };
      break;
    }
    case MessageType.Ack: {
      m = { type: 'ack', seq: r.u32() };
      r.u32();
      break;
    }
    case MessageType.Tool: {
      const input = r.u32(),
        tool = r.u32(),
        phase = r.u32(),
        modifiers = r.u32(),
        n = r.u32(),
        size = r.f32();
      if (tool > ToolCode.Probe || size < 0 || phase > Phase.Cancel)
        throw new ProtocolError(`tool ${tool} in phase ${phase}`);
      if (n * 64 !== r.buffer.byteLength - r.offset) throw new ProtocolError(`${n} samples do not fit the length`);
      const samples: ToolSample[] = [];
      for (let i = 0; i < n; i++) {
        const time = r.f64(),
          origin = r.vec3d(),
          direction = r.vec3d(),
          pressure = r.f32();
        r.u32();
        samples.push({ time, origin, direction, pressure });
      }
      m = { type: 'tool', input, tool, phase, modifiers, size, samples };
      break;
    }
    case MessageType.Ray: {
      m = { type: 'ray', input: r.u32(), near: r.f32(), origin: r.vec3d(), direction: r.vec3d() };
      break;
    }
    case MessageType.Command: {
      const input = r.u32(),
        code = r.u32(),
        bytes = r.u32();
      r.u32();
      const value = [r.f64(), r.f64(), r.f64(), r.f64()] as const;
      m = { type: 'command', input, code, value, text: r.text(bytes) };
      break;
    }
    case MessageType.Claim: {
      m = { type: 'claim', take: r.u32() !== 0 };
      r.u32();
      break;
    }
    case MessageType.Upload: {
      const upload = r.u32(),
        part = r.u32(),
        nameBytes = r.u32(),
        offset = r.u32(),
        total = r.u32(),
        bytes = r.u32();
      if (part > UploadPart.Scene || offset + bytes > total) throw new ProtocolError('chunk outside of the upload');
      m = { type: 'upload', upload, part, offset, total, name: r.text(nameBytes), bytes: r.bytes(bytes) };
      break;
    }
    case MessageType.Device: {
      m = { type: 'device', input: r.u32(), tool: r.u32(), position: r.vec3d(), rotation: r.vec3d(), jaws: r.f64() };
      if (m.jaws < 0 || m.jaws > 1) throw new ProtocolError(`jaws open by ${m.jaws}`);
      break;
    }
    default:
      throw new ProtocolError(`unknown message type ${type}`);
  }
  r.end();
  return m;
}

// ---------------------------------------------------------------------------------------------------------------------
// Writing

/** Fills one message of known length from front to back. */
class Writer {
  readonly buffer: ArrayBuffer;
  private readonly view: DataView;
  private offset = kHeaderBytes;
  constructor(type: number, bodyBytes: number) {
    const length = kHeaderBytes + bodyBytes;
    this.buffer = new ArrayBuffer(length);
    this.view = new DataView(this.buffer);
    this.view.setUint16(0, type, true);
    this.view.setUint16(2, kProtocolVersion, true);
    this.view.setUint32(4, length, true);
  }
  u32(...values: number[]): this {
    for (const x of values) {
      this.view.setUint32(this.offset, x >>> 0, true);
      this.offset += 4;
    }
    return this;
  }
  i32(x: number): this {
    this.view.setInt32(this.offset, x, true);
    this.offset += 4;
    return this;
  }
  u64(x: bigint): this {
    this.view.setBigUint64(this.offset, x, true);
    this.offset += 8;
    return this;
  }
  f32(...values: number[]): this {
    for (const x of values) {
      this.view.setFloat32(this.offset, x, true);
      this.offset += 4;
    }
    return this;
  }
  f64(...values: number[]): this {
    for (const x of values) {
      this.view.setFloat64(this.offset, x, true);
      this.offset += 8;
    }
    return this;
  }
  array(a: Float32Array | Uint32Array | Int16Array | Uint8Array): this {
    new Uint8Array(this.buffer).set(new Uint8Array(a.buffer, a.byteOffset, a.byteLength), this.offset);
    this.offset += padded(a.byteLength);
    return this;
  }
  finish(): ArrayBuffer {
    if (this.offset !== this.buffer.byteLength)
      throw new Error(`wrote ${this.offset} of ${this.buffer.byteLength} bytes`);
    return this.buffer;
  }
}

const sizeOf = (arrays: ArrayBufferView[]): number => arrays.reduce((n, a) => n + padded(a.byteLength), 0);

function writeCounts(w: Writer, c: Counts): Writer {
  return w.u32(c.visualVertices, c.visualTriangles, c.collisionVertices, c.collisionTriangles, c.nodes, c.hexahedra);
}

/** Encodes a message as an engine does. */
export function encodeEngineMessage(m: EngineMessage): ArrayBuffer {
  switch (m.type) {
    case 'hello': {
      const name = utf8Encoder.encode(m.name),
        json = utf8Encoder.encode(m.json);
      return new Writer(MessageType.Hello, 32 + sizeOf([name, json]))
        .u64(m.session)
        .u32(m.client, m.readOnly ? 1 : 0)
        .f32(m.tick)
        .u32(name.length, json.length, 0)
        .array(name)
        .array(json)
        .finish();
    }
    case 'body': {
      const arrays = [
        m.frames,
        m.rest,
        m.normal,
        m.copy,
        m.skin,
        m.wall,
        m.copies,
        m.cells,
        m.nodes,
        m.fading.ids,
        m.fading.offsets,
      ];
      const w = new Writer(MessageType.Body, 40 + sizeOf(arrays)).u32(
        m.body,
        m.version,
        m.copy.length,
        m.skin.length / 3,
        m.wall.length / 3,
        m.copies.length / 8,
        m.nodes.length / 3,
        m.fading.ids.length,
        m.frames.length / kFrameFloats,
        0,
      );
      for (const a of arrays) w.array(a);
      return w.finish();
    }
    case 'patch': {
      const v = m.vertices,
        s = m.skin,
        wl = m.wall,
        c = m.copies,
        t = m.totals;
      const arrays = [
        v.ids,
        v.rest,
        v.normal,
        v.copy,
        s.ids,
        s.triangles,
        wl.ids,
        wl.triangles,
        c.ids,
        c.copies,
        c.cells,
        m.nodes,
        m.fading.ids,
        m.fading.offsets,
      ];
      const w = new Writer(MessageType.Patch, 76 + sizeOf(arrays))
        .u32(m.body, m.from, m.to, m.input)
        .u32(t.nv, t.ns, t.nw, t.nc, t.nn)
        .u32(v.ids.length, s.ids.length, wl.ids.length, c.ids.length)
        .u32(
          v.copy.length - v.ids.length,
          s.triangles.length / 3 - s.ids.length,
          wl.triangles.length / 3 - wl.ids.length,
          c.copies.length / 8 - c.ids.length,
        )
        .u32(m.fading.ids.length, 0);
      for (const a of arrays) w.array(a);
      return w.finish();
    }
    case 'frame':
      return new Writer(
        MessageType.Frame,
        76 +
          sizeOf([
            m.nodes,
            m.grasps,
            m.held,
            m.places,
            m.tools,
            m.contacts,
            m.partners,
            m.fading.ids,
            m.fading.offsets,
          ]),
      )
        .u32(m.body, m.seq, m.version, m.input)
        .f64(m.time)
        .f32(m.stepMs, m.speed)
        .u32(
          m.nodes.length / 3,
          m.flags,
          m.undoDepth,
          m.redoDepth,
          m.grasps.length / 6,
          m.places.length / kPlaceFloats,
          m.tools.length / kToolFloats,
          m.partners.length,
          m.touching,
        )
        .f32(m.press)
        .u32(m.fading.ids.length)
        .array(m.nodes)
        .array(m.grasps)
        .array(m.held)
        .array(m.places)
        .array(m.tools)
        .array(m.contacts)
        .array(m.partners)
        .array(m.fading.ids)
        .array(m.fading.offsets)
        .finish();
    case 'hit':
      return new Writer(MessageType.Hit, 60)
        .u32(m.input)
        .i32(m.triangle)
        .f64(m.t, ...m.point)
        .f32(...m.normal, m.beside)
        .u32(m.copy)
        .finish();
    case 'stats':
      return writeCounts(
        new Writer(MessageType.Stats, 64)
          .f32(m.stepMs, m.stepMs99, m.mechanicsMs, m.stepsPerSecond)
          .u32(m.iterations)
          .f32(m.residual),
        m.counts,
      )
        .u32(m.pieces, m.dropped, m.bad, m.clients)
        .finish();
    case 'cut': {
      const text = utf8Encoder.encode(m.text);
      return writeCounts(
        new Writer(MessageType.CutReport, 64 + sizeOf([text]))
          .u32(m.input, m.outcome, m.pieces, m.trianglesCut)
          .f32(m.bindingMs, m.embeddingMs, m.surfaceMs, m.totalMs),
        m.counts,
      )
        .u32(m.invariants, text.length)
        .array(text)
        .finish();
    }
    case 'role':
      return new Writer(MessageType.Role, 16).u32(m.holder, m.held ? 1 : 0, m.clients, 0).finish();
    case 'error': {
      const text = utf8Encoder.encode(m.text);
      return new Writer(MessageType.Error, 16 + sizeOf([text]))
        .u32(m.input, m.code, text.length, 0)
        .array(text)
        .finish();
    }
    case 'overlay': {
      const arrays = [m.rest, m.copy, m.triangles, m.bound, m.links, m.feet, m.footRest];
      const w = new Writer(MessageType.Overlay, 32 + sizeOf(arrays)).u32(
        m.body,
        m.version,
        m.copy.length,
        m.triangles.length / 3,
        m.bound.length / 2,
        m.links.length / 2,
        m.feet.length / 2,
        0,
      );
      for (const a of arrays) w.array(a);
      return w.finish();
    }
    case 'file': {
      const name = utf8Encoder.encode(m.name);
      return new Writer(MessageType.File, 16 + sizeOf([name, m.bytes]))
        .u32(m.request, name.length, m.bytes.length, 0)
        .array(name)
        .array(m.bytes)
        .finish();
    }
    case 'things': {
      const json = utf8Encoder.encode(m.json);
      return new Writer(MessageType.Things, 16 + sizeOf([json, m.positions, m.triangles]))
        .u32(m.body, json.length, m.positions.length / 3, m.triangles.length / 3)
        .array(json)
        .array(m.positions)
        .array(m.triangles)
        .finish();
    }
    case 'score':
      return new Writer(MessageType.Score, 32)
        .f32(m.lesionVolume, m.lesionRemoved, m.healthyRemoved, m.healthyShare, m.roughness, m.largestForce, m.time)
        .u32(m.loosePieces)
        .finish();
    case 'fixed':
      return new Writer(MessageType.Fixed, 16 + sizeOf([m.nodes, m.vertices]))
        .u32(m.body, m.nodes.length, m.vertices.length, 0)
        .array(m.nodes)
        .array(m.vertices)
        .finish();
    case 'masses':
      return new Writer(MessageType.Masses, 16 + sizeOf([m.mass, m.copy]))
        .u32(m.body, m.version)
        .f32(m.uncut)
        .u32(m.mass.length)
        .array(m.mass)
        .array(m.copy)
        .finish();
    case 'loading': {
      const stage = utf8Encoder.encode(m.stage);
      return new Writer(MessageType.Loading, 16 + sizeOf([stage]))
        .u32(m.input, m.state)
        .f32(m.fraction)
        .u32(stage.length)
        .array(stage)
        .finish();
    }
  }
}

/** Encodes a message of the page. */
export function encodePageMessage(m: PageMessage): ArrayBuffer {
  switch (m.type) {
    case 'pageHello':
      return new Writer(MessageType.PageHello, 24).u32(m.protocol, 0).u64(m.session).u32(m.body, m.version).finish();
    case 'ack':
      return new Writer(MessageType.Ack, 8).u32(m.seq, 0).finish();
    case 'tool': {
      const w = new Writer(MessageType.Tool, 24 + 64 * m.samples.length)
        .u32(m.input, m.tool, m.phase, m.modifiers, m.samples.length)
        .f32(m.size);
      for (const s of m.samples) w.f64(s.time, ...s.origin, ...s.direction).f32(s.pressure, 0);
      return w.finish();
    }
    case 'ray':
      return new Writer(MessageType.Ray, 56)
        .u32(m.input)
        .f32(m.near)
        .f64(...m.origin, ...m.direction)
        .finish();
    case 'command': {
      const text = utf8Encoder.encode(m.text);
      return new Writer(MessageType.Command, 48 + sizeOf([text]))
        .u32(m.input, m.code, text.length, 0)
        .f64(...m.value)
        .array(text)
        .finish();
    }
    case 'device':
      return new Writer(MessageType.Device, 64)
        .u32(m.input, m.tool)
        .f64(...m.position, ...m.rotation, m.jaws)
        .finish();
    case 'claim':
      return new Writer(MessageType.Claim, 8).u32(m.take ? 1 : 0, 0).finish();
    case 'upload': {
      const name = utf8Encoder.encode(m.name);
      return new Writer(MessageType.Upload, 24 + sizeOf([name, m.bytes]))
        .u32(m.upload, m.part, name.length, m.offset, m.total, m.bytes.length)
        .array(name)
        .array(m.bytes)
        .finish();
    }
  }
}
