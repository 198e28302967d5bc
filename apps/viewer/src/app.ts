// The page without its controls: engine, scene, tools and measurements, tied together.
import { Vector3 } from 'three';
import type { Engine, EngineEvents, EngineState } from './engine/engine';
import {
  CommandCode,
  FrameFlag,
  LoadState,
  kNoNode,
  Modifier,
  Outcome,
  UploadPart,
  type Body,
  type Counts,
  type CutReport,
  type EngineError,
  type Fading,
  type FileMessage,
  type Fixed,
  type Frame,
  type Hello,
  type Hit,
  type Loading,
  type Masses,
  type Overlay,
  type Patch,
  type Role,
  type Score,
  type Stats,
  type Things,
  type ToolSample,
  type Vec3,
} from './engine/protocol';
import { Blade } from './scene/blade';
import { BodyMesh } from './scene/body_mesh';
import { BodyState } from './scene/body_state';
import { Ink } from './scene/ink';
import { type Look, type QualityLevel, toLook } from './scene/materials';
import { makeNoiseTexture } from './scene/noise';
import { receiveContact } from './scene/occlusion';
import { Overlays, type ViewName } from './scene/overlays';
import { readThings, type Thing } from './engine/things';
import { ThingsView } from './scene/things';
import { PieceView } from './scene/piece_view';
import { Scales } from './scene/scales';
import { skinPoint } from './scene/skinning';
import { kRound } from './scene/arthroscope';
import { type Box, Stage } from './scene/stage';
import { LatencyMeter } from './stats/latency';
import { QualityChooser, kQualitySteps } from './stats/quality';
import { Series } from './stats/series';
import { PointerMap, TwoFingers, type PointerKind } from './tools/mapping';
import { FreshSamples, Pacer } from './tools/pacing';
import { kTools, Stroke, type StrokeMessage, toolInfo, type ToolName } from './tools/tools';
import { ghostAt } from './tools/ghost';

export interface SceneInfo {
  /** `goal`: what to try there, or empty. */
  scenes: { name: string; title: string; goal: string }[];
  name: string;
  title: string;
  look: Look;
  box: Box | null;
  material: { young: number; poisson: number; density: number };
  gravity: [number, number, number];
  /** Of meshes that were opened in the page. */
  unit: { metres: number; guessed: boolean } | null;
  /** By the page, from files: its name may be that of a shipped scene too. */
  opened: boolean;
  /** What should be taken out. */
  lesion: Lesion | null;
  /** What the scene's own commands do, and whether they run now. */
  script: SceneScript | null;
  /** Of the arthroscope, where the scene says. */
  scope: { entry: Vec3; target: Vec3; angle: number } | null;
}

export interface SceneScript {
  /** s */
  ends: number;
  runs: boolean;
  /** Tool, and seven numbers a place: time, point, axis towards the hand. */
  hands: { tool: ToolName; places: number[][] }[];
}

export interface Lesion {
  shape: 'sphere' | 'box' | 'half_space';
  values: number[];
}

export interface AppOptions {
  quality: QualityLevel | 'auto';
  software: boolean;
  antialias: boolean;
  plain?: boolean;
}

/** What becomes of an upload: one of shown, stopped and failed ends it. */
export interface UploadWatch {
  under(stage: string, fraction: number): void;
  shown(): void;
  stopped(): void;
  failed(text: string): void;
}

/** What the controls want to hear. */
export interface AppListener {
  connection(state: EngineState): void;
  scene(info: SceneInfo): void;
  progress(): void; // readouts: at most a few times a second
  play(playing: boolean, speed: number, undo: number, redo: number): void;
  role(role: Role): void;
  cut(report: CutReport | null): void; // null: none of this scene
  stats(stats: Stats): void;
  toast(text: string, error: boolean): void;
  file(name: string, bytes: Uint8Array): void;
  loading(loading: Loading | null): void;
  used(tool: ToolName): void;
  things(tools: number): void;
  score(score: Score | null): void;
  scope(on: boolean): void;
  showing(): void;
  recording(since: number | null): void; // performance.now() of its start
  views(): void;
}

const kRayPatienceMs = 1000;
const kShownAfter = 0.6; // s for which what was done is looked at before hands come
// ms without a new picture after which lite draws one that is finer: it takes as long as four, and a hand must not wait for it
const kStillMs = 600;
const kFineness = 2; // pixels along each side of one; 3 takes twice as long again, and shows no more
const kPinch = 0.6; // of the body's size that fingers push the arthroscope in, for each height of the window that they come apart
const kManyTriangles = 300_000;
const kFingerPixels = 22; // half as wide as what a fingertip hits
const kPointerPixels = 8; // of a mouse or pen: as far as a hand in motion misses by
const kToTheRim: ReadonlySet<ToolName> = new Set(['scalpel', 'line'] as const);
const kToCut: ReadonlySet<ToolName> = new Set(['scalpel', 'line', 'closed', 'scissors'] as const);
const kMotions: ReadonlySet<ToolName> = new Set(['grasp', 'take', 'probe', 'suction'] as const);

const num = (x: unknown, fallback: number): number => (typeof x === 'number' && Number.isFinite(x) ? x : fallback);

/** Reads Hello's JSON; whatever is missing or odd gets a default. */
export function readSceneInfo(hello: Pick<Hello, 'name' | 'json'>): SceneInfo {
  let j: Record<string, unknown> = {};
  try {
    const parsed: unknown = JSON.parse(hello.json);
    if (parsed && typeof parsed === 'object') j = parsed as Record<string, unknown>;
  } catch {
    /* an engine without a description still works */
  }
  const scenes = (Array.isArray(j.scenes) ? j.scenes : []).flatMap((s: unknown) => {
    const o = s as { name?: unknown; title?: unknown; goal?: unknown } | null;
    const words = (x: unknown, otherwise: string): string => (typeof x === 'string' ? x : otherwise);
    return o && typeof o.name === 'string'
      ? [{ name: o.name, title: words(o.title, o.name), goal: words(o.goal, '') }]
      : [];
  });
  const m = (j.material ?? {}) as Record<string, unknown>,
    g = Array.isArray(j.gravity) ? j.gravity : [];
  const u = (j.unit ?? {}) as Record<string, unknown>;
  const b =
    Array.isArray(j.box) && j.box.length === 6 && j.box.every((x) => Number.isFinite(x)) ? (j.box as number[]) : null;
  const proper = b && b[0]! <= b[3]! && b[1]! <= b[4]! && b[2]! <= b[5]! && b.some((x) => x !== b[0]);
  return {
    scenes,
    name: hello.name,
    title: typeof j.title === 'string' ? j.title : hello.name,
    look: toLook(j.look),
    box: b && proper ? { min: [b[0]!, b[1]!, b[2]!], max: [b[3]!, b[4]!, b[5]!] } : null,
    material: { young: num(m.young, 20000), poisson: num(m.poisson, 0.45), density: num(m.density, 1000) },
    gravity: [num(g[0], 0), num(g[1], 0), num(g[2], -9.81)],
    opened: j.opened === true,
    lesion: readLesion(j.lesion),
    scope: readScope(j.arthroscope),
    script: readScript(j.script),
    unit: num(u.metres, 0) > 0 ? { metres: num(u.metres, 1), guessed: u.guessed === true } : null,
  };
}

function readScript(from: unknown): SceneScript | null {
  if (!from || typeof from !== 'object') return null;
  const o = from as { ends?: unknown; runs?: unknown; hands?: unknown };
  const ends = num(o.ends, 0);
  if (!(ends > 0)) return null;
  const hands = (Array.isArray(o.hands) ? o.hands : []).flatMap((h: unknown) => {
    const { tool, places } = (h ?? {}) as { tool?: unknown; places?: unknown };
    const known = kTools.find((t) => t.name === tool);
    const good = (Array.isArray(places) ? places : []).filter(
      (p): p is number[] => Array.isArray(p) && p.length === 7 && p.every((x) => Number.isFinite(x)),
    );
    return known && good.length > 0 ? [{ tool: known.name, places: good }] : [];
  });
  return { ends, runs: o.runs === true, hands };
}

function readScope(from: unknown): SceneInfo['scope'] {
  if (!from || typeof from !== 'object') return null;
  const o = from as Record<string, unknown>;
  const vec = (x: unknown): Vec3 | null =>
    Array.isArray(x) && x.length === 3 && x.every((y) => Number.isFinite(y)) ? (x as unknown as Vec3) : null;
  const entry = vec(o.entry),
    target = vec(o.target);
  return entry && target ? { entry, target, angle: Math.max(0, Math.min(1.3, num(o.angle, Math.PI / 6))) } : null;
}

function readLesion(from: unknown): Lesion | null {
  if (!from || typeof from !== 'object') return null;
  for (const [shape, n] of [
    ['sphere', 4],
    ['box', 6],
    ['half_space', 6],
  ] as const) {
    const v = (from as Record<string, unknown>)[shape];
    if (Array.isArray(v) && v.length === n && v.every((x) => Number.isFinite(x)))
      return { shape, values: v as number[] };
  }
  return null;
}

export class App implements EngineEvents {
  readonly stage: Stage;
  readonly mesh: BodyMesh;
  readonly overlays: Overlays;
  readonly pieceView: PieceView;
  readonly scales: Scales;
  readonly blade = new Blade();
  readonly things = new ThingsView();
  readonly ink: Ink;
  readonly latency = new LatencyMeter();
  readonly pointers = new PointerMap();
  readonly stepSeries = new Series(5); // seconds of the page's clock, step median, step 99 %, mechanics, fps
  readonly cutSeries = new Series(5); // number, binding, embedding, surface, total
  readonly contactSeries = new Series(4); // seconds of the page's clock, contacts, N pressed with, N on the tools
  readonly countSeries = new Series(7); // cut number, six counts
  listener: AppListener | null = null;

  connection: EngineState = 'connecting';
  info: SceneInfo | null = null;
  roleNow: Role = { type: 'role', holder: 0, held: false, clients: 0 };
  readOnly = false;
  tool: ToolName = 'scalpel';
  playing = true;
  speed = 1;
  undoDepth = 0;
  redoDepth = 0;
  time = 0;
  pieces = 1;
  counts: Counts | null = null;
  lastCut: CutReport | null = null;
  lastStats: Stats | null = null;
  scoreNow: Score | null = null;
  /** Sizes of instruments that a person has chosen, in parts of the body's diagonal. */
  readonly sizes = new Map<ToolName, number>();
  fps = 0;
  qualityMode: QualityLevel | 'auto';
  frames = 0;
  patches = 0;
  bodies = 0;
  errors = 0;
  lastError = '';
  recording = false;
  loadingNow: Loading | null = null;

  private engineSession: bigint | null = null;
  private playAsked = 0;
  private readonly chooser: QualityChooser;
  private readonly canvas: HTMLCanvasElement;
  private level: QualityLevel = 'full';
  private look: Look = 'steak';
  private shownScene = '';
  private ready = false;
  private dirty = true;
  private drewAt = 0;
  private fine = true; // nothing is to be drawn finer
  private moved = true;
  private pendingNodes = new Float32Array(0);
  private pending: { version: number; input: number; n: number; fading: Fading } | null = null;
  private lastSeq = 0;
  private ackedSeq = 0;
  private stroke: Stroke | null = null;
  private readonly pacer = new Pacer();
  private thingList: Thing[] = [];
  private toolIndex = 0;
  private jawsOpen: boolean[] = [];
  /** The scene's tool that is led: where pointer and tool were, and how far it has been pushed along the view. */
  private led: {
    from: Vector3;
    grab: Vector3;
    normal: Vector3;
    depth: number;
    turn: readonly [number, number, number, number];
    at: { x: number; y: number };
  } | null = null;
  private ledTo: { x: number; y: number; time: number } | null = null;
  /** Samples of the stroke that are not sent yet. */
  private held: ToolSample[] = [];
  private heldModifiers = 0;
  private lastSample: ToolSample | null = null;
  /** So near the rim the stroke begins and ends beside the body, in parts of the distance from the eye. */
  private rimReach = 0;
  private readonly fresh = new FreshSamples();
  private pointerAt: { x: number; y: number } | null = null;
  /** A copy of what the pointer is over; kNoNode: nothing. */
  under = kNoNode;
  /** A copy of what is held last, and where. */
  holds: { copy: number; point: Vec3 } | null = null;
  private hoverChanged = false;
  private rayOut = 0;
  private raySince = 0;
  private rayAt: { origin: Vec3; direction: Vec3 } | null = null;
  private lastFrameAt = 0;
  private drewLast = false;
  private fpsCount = 0;
  private fpsSince = 0;
  private cutNumber = 0;
  private lastProgress = 0;
  private width = 1;
  private height = 1;
  private uploads = 0;
  private uploadInput = 0;
  /** Hears what becomes of the last upload; without it trouble is a toast. */
  uploadWatch: UploadWatch | null = null;
  private liteTurn = 0;
  /** The camera follows a body that sinks or swings away, until a person moves it or uses a tool. */
  private follow = true;
  /** A person has turned the view: a window that changes leaves it. */
  private ownView = false;

  constructor(
    private readonly engine: Engine,
    canvas: HTMLCanvasElement,
    ink: HTMLCanvasElement,
    options: AppOptions,
  ) {
    this.canvas = canvas;
    const samples = options.quality === 'lite' || options.software ? 32 : 64;
    const noise = makeNoiseTexture(samples);
    this.stage = new Stage(canvas, makeNoiseTexture(samples, true), options.antialias, options.software);
    this.stage.plain = options.plain ?? false;
    this.mesh = new BodyMesh(noise);
    this.stage.contact = this.mesh.occlusion.uniforms;
    this.overlays = new Overlays(this.mesh);
    this.pieceView = new PieceView(this.mesh, this.stage);
    this.scales = new Scales(this.mesh, this.pieceView.pieces, this.things);
    this.ink = new Ink(ink);
    this.stage.scene.add(this.mesh.group, this.overlays.group, this.blade.group, this.things.group);
    this.qualityMode = options.quality;
    // The CPU as a GPU starts with the cheapest materials and stays there.
    const firstLite = kQualitySteps.findIndex((s) => s.level === 'lite');
    this.chooser = new QualityChooser(options.software ? firstLite : 0, options.software ? firstLite : 0);
    this.listen();
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.resize();
    this.applyQuality();
  }

  start(): void {
    this.engine.start(this);
    requestAnimationFrame(this.loop);
  }

  // -------------------------------------------------------------------------------------------------------------------
  // Engine events

  state(state: EngineState): void {
    this.connection = state;
    if (state !== 'live') {
      this.cancelStroke(false);
      this.latency.forget();
      this.pacer.forget();
      this.ink.clear();
      this.rayOut = 0;
      this.roleNow = { ...this.roleNow, held: false };
      this.ackedSeq = this.lastSeq = this.playAsked = 0;
      this.pending = null;
      this.loadingNow = null;
      this.listener?.loading(null);
      if (this.uploadInput !== 0)
        this.uploadWatch?.failed('The connection was lost; open the files again when it is back.');
      this.uploadInput = 0;
      if (this.recording) this.recordingLost();
    }
    this.updateAllowed();
    this.listener?.connection(state);
  }

  hello(hello: Hello): void {
    if (this.engineSession !== null && this.engineSession !== hello.session && this.undoDepth > 0)
      this.listener?.toast('kerf view was started again: what was cut before is gone.', true);
    this.engineSession = hello.session;
    this.readOnly = hello.readOnly;
    this.info = readSceneInfo(hello);
    this.listener?.scene(this.info);
    if (this.overlays.wanted > 0) this.engine.command({ code: CommandCode.Overlay, value: [this.overlays.wanted] });
    if (this.things.showContacts) this.engine.command({ code: CommandCode.Contacts, value: [1] });
    this.updateAllowed();
  }

  body(body: Body): void {
    this.cancelStroke(false);
    this.ink.clear();
    this.under = kNoNode;
    this.holds = null;
    this.bodies++;
    const state = new BodyState(body),
      info = this.info;
    this.mesh.setBody(state);
    this.mesh.setLesion(info?.lesion ?? null);
    if (!info?.lesion && this.scoreNow) {
      this.scoreNow = null;
      this.listener?.score(null);
    }
    this.overlays.clear();
    this.engine.have(state.body, state.version);
    this.pending = null;
    const look = info?.look ?? 'steak';
    // Opened files may have the name of those before.
    const shown = JSON.stringify([info?.name, info?.opened, info?.box]),
      same = this.shownScene === shown && this.ready;
    this.shownScene = shown;
    this.stage.setBox(info?.box ?? boxOf(state), look, same);
    this.blade.setSize(this.stage.size);
    const scope = info?.scope;
    if (!same)
      this.stage.setScopePlace(
        scope ? { entry: new Vector3(...scope.entry), target: new Vector3(...scope.target), angle: scope.angle } : null,
      );
    if (!same) {
      this.clearSeries();
      this.follow = true;
      this.ownView = false;
      this.lastCut = null;
      this.listener?.cut(null);
    }
    if (look !== this.look) {
      this.look = look;
      this.mesh.setLook(look, this.level);
    }
    this.counts = null;
    this.touch(true);
    this.compile();
  }

  patch(patch: Patch): void {
    const state = this.mesh.state;
    if (!state || patch.body !== state.body || patch.from !== state.version) {
      this.engine.resync();
      return;
    }
    try {
      this.mesh.applyPatch(patch);
    } catch (e) {
      console.error('kerf: the patch does not fit', e);
      this.engine.resync();
      return;
    }
    this.patches++;
    this.overlays.patched();
    this.engine.have(state.body, state.version);
    if (this.pending && this.pending.version !== state.version) this.pending = null;
    this.latency.echoed(patch.input, performance.now(), 'cut');
    this.answered(patch.input);
    this.touch(true);
  }

  frame(frame: Frame): void {
    this.lastSeq = frame.seq;
    this.answered(frame.input);
    this.frames++;
    const showed = this.showing;
    this.time = frame.time;
    if (this.mesh.setTime(frame.time)) this.touch(false);
    if (showed !== this.showing) {
      this.hoverChanged = true;
      if (showed && this.blade.leave()) this.touch(true);
      this.updateAllowed();
      this.listener?.showing();
    }
    // What was asked for holds until a frame knows of it: a second press meanwhile turns it back.
    if (frame.input >= this.playAsked || !this.roleNow.held) this.playAsked = 0;
    const playing = this.playAsked > 0 ? this.playing : (frame.flags & FrameFlag.Playing) !== 0;
    if (
      playing !== this.playing ||
      frame.undoDepth !== this.undoDepth ||
      frame.redoDepth !== this.redoDepth ||
      (frame.speed > 0 && Math.abs(frame.speed - this.speed) > 1e-6)
    ) {
      this.playing = playing;
      this.undoDepth = frame.undoDepth;
      this.redoDepth = frame.redoDepth;
      if (frame.speed > 0) this.speed = frame.speed;
      this.listener?.play(playing, this.speed, this.undoDepth, this.redoDepth);
    }
    const state = this.mesh.state;
    if (state && frame.body === state.body) {
      if (this.things.place(frame.places, frame.tools)) this.touch(true);
      if (this.things.setContacts(frame.contacts, frame.partners, frame.touching, frame.press)) this.touch(false);
      this.stage.setFloor(this.things.floor);
    }
    if (!state || frame.body !== state.body || frame.version !== state.version || frame.nodes.length !== 3 * state.nn)
      return;
    if (this.pendingNodes.length < frame.nodes.length) this.pendingNodes = new Float32Array(2 * frame.nodes.length);
    this.pendingNodes.set(frame.nodes);
    const { ids, offsets } = frame.fading;
    if (ids.length > 0 && ids[ids.length - 1]! >= state.nv) return;
    this.pending = {
      version: frame.version,
      input: frame.input,
      n: frame.nodes.length,
      fading: { ids: ids.slice(), offsets: offsets.slice() },
    };
    if (this.blade.setGrasps(frame.grasps)) this.touch(true);
    const last = frame.held.length - 1,
      [x, y, z] = frame.grasps.subarray(6 * last);
    this.holds = last < 0 ? null : { copy: frame.held[last]!, point: [x!, y!, z!] };
    if (this.showing) this.placeGhost(frame.grasps);
  }

  /** The hand of a scene's own commands; of what it pulls, where it pulls to. */
  private placeGhost(grasps: Float32Array): void {
    const hand = ghostAt(this.info!.script!, this.time);
    const eye = this.stage.camera.position;
    if (hand) {
      this.blade.setTool(hand.tool);
      this.blade.bites = this.instrumentSize(hand.tool);
      this.blade.place(new Vector3(...hand.point), new Vector3(...hand.axis), eye, true, true);
    } else if (grasps.length >= 6) {
      this.blade.setTool('grasp');
      this.blade.place(new Vector3(grasps[3], grasps[4], grasps[5]), new Vector3(0, 0, 1), eye, true, true);
    } else {
      this.blade.hide();
    }
    this.blade.setTool(this.tool);
    this.touch(true);
  }

  thingsCame(message: Things): void {
    const things = readThings(message);
    this.thingList = things;
    this.jawsOpen = [];
    this.furnish();
    const tools = things.filter((t) => t.tool).length;
    if ((tools === 0 && this.tool === 'rigid') || (!this.hasProbe && this.tool === 'probe')) this.setTool('scalpel');
    this.listener?.things(tools);
    this.compile();
    this.touch(true);
  }

  hit(hit: Hit): void {
    if (hit.input !== this.rayOut) return;
    this.rayOut = 0;
    if (!this.pointerAt || !this.rayAt) return;
    const eye = this.stage.camera.position,
      o = this.rayAt.origin,
      d = this.rayAt.direction;
    const point = new Vector3(...hit.point),
      normal = new Vector3(...hit.normal),
      touching = hit.triangle >= 0;
    this.under = hit.copy;
    if (!touching) {
      // Beside the body the tool hovers where the view ray meets the height of the body's middle.
      const c = this.mesh.bounds.center.z,
        t = Math.abs(d[2]) > 0.05 ? (c - o[2]) / d[2] : -1;
      if (!(t > 0)) {
        if (this.blade.leave()) this.touch(true);
        return;
      }
      point.set(o[0] + t * d[0], o[1] + t * d[1], c);
      normal.set(0, 0, d[2] < 0 ? 1 : -1);
      if (point.distanceTo(this.mesh.bounds.center) > 1.6 * this.stage.size) {
        if (this.blade.leave()) this.touch(true);
        return;
      }
    } else if (normal.dot(eye.clone().sub(point)) < 0) {
      normal.negate();
    }
    this.blade.bites = this.instrumentSize(this.tool);
    this.blade.place(
      point,
      normal,
      eye,
      touching,
      this.stroke !== null,
      !(this.stroke && this.tool === 'shaver' && this.hasTool('shaver')),
    );
    this.touch(true);
  }

  fixed(fixed: Fixed): void {
    if (fixed.body !== this.mesh.state?.body) return;
    this.mesh.setFixed(fixed.nodes.slice());
    this.touch(false);
  }

  masses(masses: Masses): void {
    this.scales.take(masses);
  }

  score(score: Score): void {
    this.scoreNow = score;
    this.listener?.score(score);
  }

  stats(stats: Stats): void {
    this.lastStats = stats;
    this.counts = stats.counts;
    this.pieces = stats.pieces;
    this.stepSeries.push(performance.now() / 1000, stats.stepMs, stats.stepMs99, stats.mechanicsMs, this.fps);
    const felt = Math.max(0, ...this.things.tools.map((t) => Math.hypot(...t.force)));
    this.contactSeries.push(performance.now() / 1000, this.things.touching, this.things.press, felt);
    if (this.countSeries.length === 0) this.pushCounts(stats.counts);
    this.listener?.stats(stats);
  }

  cut(report: CutReport): void {
    this.lastCut = report;
    this.counts = report.counts;
    this.pieces = report.pieces;
    if (report.outcome === Outcome.Cut) {
      this.cutNumber++;
      this.cutSeries.push(this.cutNumber, report.bindingMs, report.embeddingMs, report.surfaceMs, report.totalMs);
      this.pushCounts(report.counts);
    }
    this.answered(report.input);
    this.listener?.cut(report);
  }

  role(role: Role): void {
    this.roleNow = role;
    this.updateAllowed();
    this.listener?.role(role);
  }

  error(error: EngineError): void {
    this.errors++;
    this.answered(error.input);
    this.lastError = error.text;
    const text = error.text || `The engine reports error ${error.code}.`;
    if (error.input === this.uploadInput && error.input !== 0 && this.uploadWatch) this.uploadWatch.failed(text);
    else this.listener?.toast(text, true);
  }

  overlay(overlay: Overlay): void {
    this.overlays.setMessage(overlay);
    this.touch(false);
  }

  loading(loading: Loading): void {
    this.loadingNow = loading.state === LoadState.UnderWay ? loading : null;
    this.listener?.loading(this.loadingNow);
    if (loading.input !== this.uploadInput || loading.input === 0) return;
    if (loading.state === LoadState.UnderWay) this.uploadWatch?.under(loading.stage, loading.fraction);
    if (loading.state === LoadState.Shown) this.uploadWatch?.shown();
    if (loading.state === LoadState.Stopped) this.uploadWatch?.stopped();
  }

  file(file: FileMessage): void {
    this.listener?.file(file.name, file.bytes.slice());
  }

  // -------------------------------------------------------------------------------------------------------------------
  // Commands

  command(code: number, value: number[] = [], text = '', started = performance.now()): number {
    const input = this.engine.command({ code, value, text });
    this.latency.sent(input, started, 'cut');
    return input;
  }
  togglePlay(): void {
    if (!this.toolAllowed) return;
    this.playing = !this.playing;
    this.playAsked = this.command(this.playing ? CommandCode.Play : CommandCode.Pause);
    this.listener?.play(this.playing, this.speed, this.undoDepth, this.redoDepth);
  }
  setTool(tool: ToolName): void {
    this.cancelStroke(true);
    this.tool = tool;
    this.blade.setTool(tool);
    this.mesh.showFixed = tool === 'fix' || tool === 'release';
    this.pointers.handTool = tool === 'hand';
    this.updateAllowed();
    this.hoverChanged = true;
    if (tool === 'hand') this.blade.hide();
    this.touch(true);
  }
  private hasTool(shape: string): boolean {
    return this.thingList.some((t) => t.tool && t.shape === shape);
  }
  get hasProbe(): boolean {
    return this.hasTool('probe');
  }
  /** Metres; 0 for tools without a size. */
  instrumentSize(tool: ToolName): number {
    const size = toolInfo(tool).size;
    return size ? (this.sizes.get(tool) ?? size.own) * this.stage.size : 0;
  }
  setInstrumentSize(tool: ToolName, part: number): void {
    const size = toolInfo(tool).size;
    if (!size) return;
    this.sizes.set(tool, Math.max(size.least, Math.min(size.most, part)));
    this.hoverChanged = true;
  }
  setView(view: ViewName, on: boolean): void {
    const wanted = this.overlays.wanted;
    this.overlays.set(view, on);
    if (this.overlays.wanted !== wanted)
      this.engine.command({ code: CommandCode.Overlay, value: [this.overlays.wanted] });
    this.touch(true);
    this.listener?.views();
  }
  /** Shows what touches: points, normals, forces. */
  setContacts(on: boolean): void {
    this.things.showContacts = on;
    this.engine.command({ code: CommandCode.Contacts, value: [on ? 1 : 0] });
    this.touch(false);
    this.listener?.views();
  }
  /** Opens or closes the jaws of the tool that was held last. */
  toggleJaws(): void {
    const reading = this.things.tools[this.toolIndex];
    if (!reading || !this.toolAllowed) return;
    this.jawsOpen[this.toolIndex] = !(this.jawsOpen[this.toolIndex] ?? true);
    this.lead(this.toolIndex, reading.pose.position, reading.pose.quaternion, performance.now());
  }
  setQuality(mode: QualityLevel | 'auto'): void {
    this.qualityMode = mode;
    this.applyQuality();
  }
  setTheme(dark: boolean): void {
    this.stage.setTheme(dark);
    this.touch(false);
  }
  /** Where the pointer is over the view, pixels. */
  get pointer(): { x: number; y: number } | null {
    return this.pointerAt;
  }
  get strokeActive(): boolean {
    return this.stroke !== null || this.led !== null;
  }
  /** Turns the view by degrees and zooms. */
  turn(azimuth: number, elevation: number, zoom: number): void {
    this.follow = false;
    this.ownView = true;
    this.stage.turn(azimuth, elevation, zoom);
    this.touch(false);
  }
  /** Looks from a direction in degrees, on request from a distance and at a point (metres). */
  lookFrom(azimuth: number, elevation: number, distance?: number, target?: Vec3): void {
    this.follow = false;
    this.ownView = true;
    this.stage.lookFrom(azimuth, elevation, distance, target);
    this.touch(false);
  }
  /** The arthroscope's view, or the free one. */
  setScope(on: boolean): void {
    this.cancelStroke(true);
    this.stage.setScope(on);
    this.mesh.inJoint = this.things.inJoint = on;
    document.documentElement.toggleAttribute('data-scope', on);
    this.hoverChanged = true;
    this.touch(true);
    this.listener?.scope(on);
  }
  /** Turns the arthroscope about its shaft, degrees. */
  turnScope(by: number): void {
    if (!this.stage.scopeOn) return;
    this.stage.scope.turn((by * Math.PI) / 180);
    this.stage.placeScope();
    this.touch(false);
    this.listener?.scope(true);
  }
  claim(): void {
    this.engine.claim(!this.roleNow.held);
  }
  resetCamera(): void {
    this.lookAtAll(false);
  }
  /** Looks at all pieces that have not fallen away for good; `fly`: the camera takes its way there. */
  lookAtAll(fly: boolean): void {
    this.ownView = false;
    if (fly) this.follow = false;
    if (fly && !matchMedia('(prefers-reduced-motion: reduce)').matches)
      this.stage.flyTo(() => this.pieceView.ball(), performance.now());
    else this.stage.lookAt(this.pieceView.ball());
    this.touch(false);
  }
  setRecording(on: boolean): void {
    this.recording = on;
    this.command(CommandCode.Recording, [on ? 1 : 0]);
    this.listener?.recording(on ? performance.now() : null);
  }
  private recordingLost(): void {
    this.recording = false;
    this.listener?.recording(null);
    this.listener?.toast('The recording has ended with the connection.', true);
  }
  /** The picture as a PNG file. */
  async picture(): Promise<Blob> {
    const shown = this.blade.visible;
    if (shown) this.blade.group.visible = this.stroke !== null;
    this.stage.render(true);
    this.blade.group.visible = true;
    const source = this.stage.scopeOn ? this.roundPicture() : this.canvas;
    const blob = await new Promise<Blob | null>((resolve) => {
      source.toBlob(resolve, 'image/png');
    });
    this.touch(false);
    if (!blob) throw new Error('The browser made no picture.');
    return blob;
  }
  /** What the eye sees through an arthroscope. */
  private roundPicture(): HTMLCanvasElement {
    const round = document.createElement('canvas'),
      g = round.getContext('2d')!,
      { width: w, height: h } = this.canvas;
    round.width = w;
    round.height = h;
    g.fillRect(0, 0, w, h);
    g.beginPath();
    g.arc(w / 2, h / 2, (kRound * Math.min(w, h)) / 2, 0, 7);
    g.clip();
    g.drawImage(this.canvas, 0, 0);
    return round;
  }
  async upload(
    parts: { part: number; name: string; bytes: Uint8Array }[],
    thickness: string,
    unit: number,
    progress: (x: number) => void,
  ): Promise<void> {
    const id = ++this.uploads,
      total = parts.reduce((n, p) => n + p.bytes.length, 0) || 1;
    let done = 0;
    for (const p of parts) {
      await this.engine.upload(id, p.part, p.name, p.bytes);
      done += p.bytes.length;
      progress(done / total);
    }
    this.uploadInput = this.command(
      CommandCode.LoadUpload,
      [id, unit],
      parts.some((p) => p.part === UploadPart.Visual) ? thickness : '',
    );
  }

  // -------------------------------------------------------------------------------------------------------------------
  // Pointers

  get toolAllowed(): boolean {
    return this.connection === 'live' && this.roleNow.held && !this.readOnly;
  }
  /** The scene's own commands are under way: hands off until they have ended. */
  get showing(): boolean {
    return this.info?.script?.runs === true && this.time < this.info.script.ends + kShownAfter;
  }
  /** Plays what the scene was made for; again, or before it has ended: the scene anew, for a person's hands. */
  show(on: boolean): void {
    if (!this.info?.script) return;
    this.command(CommandCode.Scene, [on ? 1 : 0], this.info.name);
    if (on && !this.playing) this.togglePlay();
  }
  /** Starts again. A scene that was shown starts for a person's hands. */
  reset(): void {
    if (this.info?.script?.runs) this.show(false);
    else this.command(CommandCode.Reset);
  }

  private updateAllowed(): void {
    this.pointers.toolAllowed = this.toolAllowed && !this.showing;
    this.stage.setOrbitOnly(this.tool === 'hand' || !this.pointers.toolAllowed);
    this.canvas.dataset.tool = this.tool;
    this.canvas.dataset.paused = String(!this.toolAllowed && this.tool !== 'hand');
    document.documentElement.toggleAttribute('data-paused', !this.toolAllowed);
  }

  private sample(e: PointerEvent): ToolSample {
    const box = this.canvas.getBoundingClientRect();
    const { origin, direction } = this.stage.ray(e.clientX - box.left, e.clientY - box.top);
    return { time: e.timeStamp, origin, direction, pressure: e.pressure };
  }

  private modifiers(e: PointerEvent): number {
    return (
      (e.shiftKey ? Modifier.Shift : 0) |
      (e.ctrlKey ? Modifier.Control : 0) |
      (e.altKey ? Modifier.Alt : 0) |
      (e.metaKey ? Modifier.Meta : 0)
    );
  }

  /** Of pixels, in parts of the distance from the eye. */
  private partOfDistance(pixels: number): number {
    const [a, b] = [-0.5, 0.5].map((s) => this.stage.ray(0.5 * this.width + s * pixels, 0.5 * this.height).direction);
    return Math.hypot(a![0] - b![0], a![1] - b![1], a![2] - b![2]);
  }

  /** The engine has done all inputs up to this one. */
  private answered(input: number): void {
    this.pacer.answered(input);
    this.ink.done(input);
  }

  private send(messages: StrokeMessage[], e: { timeStamp: number }, modifiers: number): void {
    for (const m of messages) {
      const input = this.engine.tool({ ...m, modifiers, size: this.instrumentSize(this.tool) || this.rimReach });
      this.latency.sent(input, e.timeStamp, kMotions.has(this.tool) ? 'motion' : 'cut');
      this.pacer.sent(input, performance.now());
      this.ink.sent(input);
    }
  }

  /** Takes the samples of an event that did not come with an earlier one; sends them if the engine keeps up. */
  private gather(e: PointerEvent, raw: boolean): void {
    const events = e.getCoalescedEvents?.() ?? [];
    const box = this.canvas.getBoundingClientRect();
    for (const x of this.fresh.of(events.length > 0 ? events : [e], raw)) {
      this.ink.add(x.clientX - box.left, x.clientY - box.top);
      this.lastSample = this.sample(x);
      this.held.push(this.lastSample);
    }
    this.heldModifiers = this.modifiers(e);
    this.sendHeld(false);
  }

  private sendHeld(now: boolean): void {
    if (!this.stroke || this.held.length === 0 || !(now || this.pacer.ready(performance.now()))) return;
    const samples = this.held;
    this.held = [];
    this.send(this.stroke.move(samples), { timeStamp: samples[0]!.time }, this.heldModifiers);
  }

  private listen(): void {
    const c = this.canvas,
      capture = { capture: true };
    c.addEventListener('contextmenu', (e) => e.preventDefault());
    c.addEventListener(
      'pointerdown',
      (e) => {
        const kind: PointerKind = e.pointerType === 'touch' || e.pointerType === 'pen' ? e.pointerType : 'mouse';
        const decision = this.pointers.down({ id: e.pointerId, kind, button: e.button, alt: e.altKey });
        c.focus({ preventScroll: true });
        if (kind === 'touch') this.fingers.down(e.pointerId, e.clientX, e.clientY);
        if (decision === 'cancel-and-orbit') {
          this.abandon(e.timeStamp);
          if (this.stage.scopeOn) this.steering = { id: e.pointerId, x: e.clientX, y: e.clientY, turns: false };
          return;
        }
        if (decision === 'orbit') {
          if (this.stage.scopeOn) {
            this.steering = { id: e.pointerId, x: e.clientX, y: e.clientY, turns: e.shiftKey || e.button === 1 };
            c.setPointerCapture(e.pointerId);
            return;
          }
          this.turning = e.pointerId;
          this.leave();
          // Alt-drag turns the view with the first button too, and so does a finger beside a pen.
          this.stage.setOrbitOnly(this.tool === 'hand' || !this.toolAllowed || e.altKey || kind === 'touch');
          this.touch(false);
          return;
        }
        c.setPointerCapture(e.pointerId);
        this.place(e);
        this.follow = false;
        if (this.tool === 'rigid') {
          this.takeTool(e);
          return;
        }
        this.stroke = new Stroke(this.tool);
        this.rimReach = kToTheRim.has(this.tool)
          ? this.partOfDistance(kind === 'touch' ? kFingerPixels : kPointerPixels)
          : 0;
        this.held = [];
        this.fresh.begin();
        const at = this.pointerAt!;
        this.ink.begin(this.tool, at.x, at.y);
        this.heldModifiers = this.modifiers(e);
        this.lastSample = this.sample(e);
        this.send(this.stroke.down(this.lastSample), e, this.heldModifiers);
        this.listener?.used(this.tool);
      },
      capture,
    );
    c.addEventListener(
      'pointermove',
      (e) => {
        const two = this.fingers.move(e.pointerId, e.clientX, e.clientY);
        if (two && this.steering && this.stage.scopeOn) {
          this.stage.scope.push((kPinch * two.apart) / Math.max(1, this.height));
          this.leanScope(two.x, two.y);
        } else if (this.steering?.id === e.pointerId) {
          this.steer(e);
        } else if (this.led && this.pointers.owns(e.pointerId)) {
          this.leadTo(e);
        } else if (this.stroke && this.pointers.owns(e.pointerId)) {
          this.place(e);
          this.gather(e, false);
        } else if (
          this.pointers.active === null &&
          this.turning === null &&
          (e.buttons === 0 || e.pointerType === 'pen')
        ) {
          this.place(e);
        }
        if (e.buttons !== 0) this.touch(false);
      },
      capture,
    );
    // Moves come once a picture; raw ones, where the browser has them, as they happen: half a picture sooner.
    c.addEventListener(
      'pointerrawupdate',
      (e) => {
        const p = e as PointerEvent;
        if (!this.pointers.owns(p.pointerId)) return;
        if (this.led) this.leadTo(p);
        else if (this.stroke) this.gather(p, true);
      },
      capture,
    );
    const finish = (e: PointerEvent, good: boolean): void => {
      if (this.steering?.id === e.pointerId) this.steering = null;
      this.fingers.up(e.pointerId);
      const onView = document.elementFromPoint(e.clientX, e.clientY) === c;
      if (!this.pointers.up(e.pointerId)) {
        if (this.turning === e.pointerId) this.turning = null;
        if (onView && good && e.pointerType !== 'touch') this.place(e);
        this.updateAllowed();
        return;
      }
      this.led = this.ledTo = null;
      if (!this.stroke) return;
      if (good) {
        this.heldModifiers = this.modifiers(e);
        this.place(e);
        this.ink.add(this.pointerAt!.x, this.pointerAt!.y);
        this.liftStroke(this.sample(e));
      } else {
        this.send(this.stroke.cancel(), e, 0);
        this.stroke = null;
        this.ink.drop();
      }
      if (e.pointerType === 'touch' || !onView) this.leave();
      this.touch(true);
    };
    c.addEventListener('pointerup', (e) => finish(e, true), capture);
    c.addEventListener('pointercancel', (e) => finish(e, false), capture);
    c.addEventListener(
      'lostpointercapture',
      (e) => {
        if (!this.pointers.owns(e.pointerId)) return;
        // A second button that comes up takes the capture with it, while the first is still down.
        if ((e.buttons & 1) !== 0 && e.pointerType === 'mouse') c.setPointerCapture(e.pointerId);
        else this.leavePage();
      },
      capture,
    );
    c.addEventListener(
      'wheel',
      (e) => {
        if (!this.led && this.stage.scopeOn) {
          e.preventDefault();
          this.stage.scope.push(-4e-4 * e.deltaY * (e.deltaMode === 1 ? 30 : 1));
          this.stage.placeScope();
          this.hoverChanged = true;
          this.touch(false);
          return;
        }
        if (!this.led) return;
        e.preventDefault();
        e.stopImmediatePropagation(); // the view does not zoom meanwhile
        this.led.depth -= 3e-4 * e.deltaY * (e.deltaMode === 1 ? 30 : 1) * this.stage.size;
        this.ledTo = { x: this.led.at.x, y: this.led.at.y, time: e.timeStamp };
        this.sendLed();
      },
      { capture: true, passive: false },
    );
    c.addEventListener('pointerleave', () => {
      if (!this.stroke) this.leave();
    });
    window.addEventListener('blur', () => this.leavePage());
    window.addEventListener('pagehide', () => this.leavePage());
    document.addEventListener('visibilitychange', () => {
      if (document.hidden) this.leavePage();
    });
    this.stage.controls.addEventListener('start', () => {
      this.follow = false;
      this.ownView = true;
    });
    this.stage.controls.addEventListener('change', () => {
      this.hoverChanged = true; // under the pointer is another place
      this.touch(false);
    });
    c.addEventListener('webglcontextlost', (e) => e.preventDefault());
    c.addEventListener('webglcontextrestored', () => {
      if (this.mesh.state) this.stage.setBox(this.info?.box ?? boxOf(this.mesh.state), this.look, true);
      this.touch(true);
    });
  }

  private steering: { id: number; x: number; y: number; turns: boolean } | null = null;
  /** The arthroscope is led by its handle: the picture goes the way of the pointer. */
  private steer(e: PointerEvent): void {
    const s = this.steering!,
      dx = e.clientX - s.x,
      dy = e.clientY - s.y;
    s.x = e.clientX;
    s.y = e.clientY;
    if (!s.turns) return this.leanScope(dx, dy);
    this.turnScope((200 * dx) / Math.max(1, this.height));
    this.stage.placeScope();
    this.touch(false);
  }
  /** Pixels. */
  private leanScope(dx: number, dy: number): void {
    const h = Math.max(1, this.height);
    this.stage.scope.lean((-0.7 * dx) / h, (0.7 * dy) / h);
    this.stage.placeScope();
    this.touch(false);
  }
  private readonly fingers = new TwoFingers();

  /** The pointer that turns the view. */
  private turning: number | null = null;
  private place(e: PointerEvent): void {
    const box = this.canvas.getBoundingClientRect();
    this.pointerAt = { x: e.clientX - box.left, y: e.clientY - box.top };
    this.hoverChanged = true;
  }

  /** The pointer is not over the view, or turns it: the instrument fades. */
  private leave(): void {
    this.pointerAt = null;
    if (!this.showing && this.blade.leave()) this.touch(true);
  }

  /** Takes the stroke back, for a second finger came down. */
  private abandon(timeStamp: number): void {
    if (!this.stroke) return;
    this.send(this.stroke.cancel(), { timeStamp }, 0);
    this.stroke = null;
    this.ink.drop();
    this.touch(true);
  }

  // The scene's own tools: the pointer leads the nearest one in the plane that faces the eye.
  private takeTool(e: PointerEvent): void {
    const at = this.pointerAt!,
      tools = this.things.tools;
    let best = -1,
      near = Infinity;
    tools.forEach((t, i) => {
      const [x, y] = this.stage.project(t.place.position as Vec3),
        d = Math.hypot(x - at.x, y - at.y);
      if (d < near) {
        near = d;
        best = i;
      }
    });
    const reading = tools[best];
    if (!reading) return;
    this.toolIndex = best;
    const from = new Vector3(...reading.pose.position),
      normal = this.stage.camera.getWorldDirection(new Vector3());
    const grab = this.onPlane(e, from, normal);
    if (!grab) return;
    this.led = { from, grab, normal, depth: 0, turn: reading.pose.quaternion, at: { ...at } };
    this.listener?.used('rigid');
  }
  private onPlane(at: { clientX: number; clientY: number }, point: Vector3, normal: Vector3): Vector3 | null {
    const box = this.canvas.getBoundingClientRect();
    const { origin, direction } = this.stage.ray(at.clientX - box.left, at.clientY - box.top);
    const o = new Vector3(...origin),
      d = new Vector3(...direction),
      along = d.dot(normal);
    if (along < 1e-3) return null;
    return o.addScaledVector(d, point.clone().sub(o).dot(normal) / along);
  }
  private leadTo(e: PointerEvent): void {
    const led = this.led!;
    this.place(e);
    const at = this.pointerAt!;
    if (e.shiftKey) {
      // Up is away from the eye; sideways stays.
      led.depth += ((led.at.y - at.y) / Math.max(1, this.height)) * 1.5 * this.stage.size;
      const here = this.onPlane(e, led.from, led.normal),
        before = this.onPlane({ clientX: e.clientX, clientY: e.clientY + (led.at.y - at.y) }, led.from, led.normal);
      if (here && before) led.grab.add(here.sub(before));
    }
    led.at = { ...at };
    this.ledTo = { x: at.x, y: at.y, time: e.timeStamp };
    this.sendLed();
  }
  private sendLed(): void {
    const led = this.led,
      to = this.ledTo;
    if (!led || !to || !this.pacer.ready(performance.now())) return;
    this.ledTo = null;
    const box = this.canvas.getBoundingClientRect();
    const now = this.onPlane({ clientX: to.x + box.left, clientY: to.y + box.top }, led.from, led.normal);
    if (!now) return;
    const p = led.from.clone().add(now).sub(led.grab).addScaledVector(led.normal, led.depth);
    this.lead(this.toolIndex, [p.x, p.y, p.z], led.turn, to.time);
  }
  private lead(tool: number, position: Vec3, q: readonly [number, number, number, number], started: number): void {
    const s = Math.hypot(q[0], q[1], q[2]),
      angle = 2 * Math.atan2(s, q[3]),
      f = s > 1e-12 ? angle / s : 0;
    const input = this.engine.device(
      tool,
      position,
      [f * q[0], f * q[1], f * q[2]],
      this.jawsOpen[tool] === false ? 0 : 1,
    );
    this.latency.sent(input, started, 'motion');
    this.pacer.sent(input, performance.now());
  }

  private furnish(): void {
    this.things.set(this.thingList, this.stage.size, this.look, this.level, this.stage.makeWood(), (m) =>
      receiveContact(m, this.mesh.around),
    );
  }

  /** Ends the current stroke at a sample. */
  private liftStroke(last: ToolSample): void {
    this.sendHeld(true);
    this.send(this.stroke!.up(last), { timeStamp: last.time }, this.heldModifiers);
    this.stroke = null;
    this.ink.end();
  }

  /** Nothing is heard of the pointer any more: what was drawn for a cut is cut, other strokes end without. */
  private leavePage(): void {
    if (!this.stroke || !kToCut.has(this.tool) || !this.lastSample) {
      this.cancelStroke(true);
      return;
    }
    this.pointers.cancel();
    this.liftStroke({ ...this.lastSample, time: performance.now() });
    this.touch(true);
  }

  /** Ends the current stroke without a cut; `tell`: the engine is there to hear it. */
  cancelStroke(tell: boolean): void {
    this.pointers.cancel();
    this.led = this.ledTo = null;
    if (!this.stroke) return;
    if (tell) this.send(this.stroke.cancel(), { timeStamp: performance.now() }, 0);
    this.stroke = null;
    this.ink.drop();
    this.touch(true);
  }

  // -------------------------------------------------------------------------------------------------------------------
  // Drawing

  /** The next frame must be drawn; `shadows`: something that throws one moved. */
  private touch(shadows: boolean): void {
    this.dirty = true;
    if (shadows) this.moved = true;
  }

  private resize(): void {
    const w = this.canvas.clientWidth || 1,
      h = this.canvas.clientHeight || 1;
    if (w === this.width && h === this.height) return;
    this.width = w;
    this.height = h;
    this.stage.resize(w, h);
    this.overlays.setPixels(w, h);
    this.mesh.crease.setHeight(h);
    this.ink.resize(w, h, window.devicePixelRatio || 1);
    if (this.ready && !this.ownView) this.stage.resetCamera();
    this.touch(false);
  }

  get quality(): { level: QualityLevel; scale: number } {
    return this.qualityMode === 'auto' ? this.chooser.current : { level: this.qualityMode, scale: 1 };
  }

  private applyQuality(): void {
    const q = this.quality,
      ratio = Math.min(window.devicePixelRatio || 1, q.level === 'full' ? 2 : q.level === 'low' ? 1.5 : 1);
    const changed = q.level !== this.level || this.bodies === 0;
    this.level = q.level;
    this.blade.setLite(q.level === 'lite');
    this.stage.setQuality(q.level, ratio * q.scale);
    this.stage.resize(this.width, this.height);
    if (changed) {
      this.mesh.setLook(this.look, q.level);
      if (this.things.any) this.furnish();
      if (this.mesh.state) this.compile();
    }
    this.touch(true);
  }

  /** Pictures between two with new shadows where every triangle counts. */
  private get shadowEvery(): number {
    return (this.mesh.state?.ns ?? 0) > kManyTriangles ? 8 : 2;
  }

  private compile(): void {
    this.ready = true;
    // Programs of walls and tools too, or the first cut waits for the compiler.
    const group = this.blade.group;
    const hidden: { visible: boolean }[] = [];
    group.traverse((o) => {
      if (!o.visible) {
        hidden.push(o);
        o.visible = true;
      }
    });
    this.stage.renderer.compile(this.stage.scene, this.stage.camera);
    for (const o of hidden) o.visible = false;
  }

  private readonly loop = (now: number): void => {
    requestAnimationFrame(this.loop);
    if (this.drewLast) {
      // The last picture has been handed to the screen by now.
      this.latency.shown(performance.now());
      if (this.qualityMode === 'auto' && this.chooser.frame(now - this.lastFrameAt)) this.applyQuality();
    }
    this.lastFrameAt = now;
    const pending = this.pending,
      state = this.mesh.state;
    if (pending && state && pending.version === state.version) {
      this.pending = null;
      if (this.mesh.setNodes(this.pendingNodes.subarray(0, pending.n), pending.fading)) {
        this.touch(true);
        if (this.pointerAt) this.hoverChanged = true;
      }
      this.latency.echoed(pending.input, performance.now(), 'motion');
    }
    if (state && this.mesh.crease.update(state, now, this.strokeActive)) this.touch(false);
    if (state && this.mesh.occlusion.update(state, this.mesh.cells.pose, now)) this.touch(false);
    this.sendHeld(false);
    this.sendLed();
    this.sendHover(now);
    if (
      this.ready &&
      this.follow &&
      !this.stage.scopeOn &&
      this.stage.followTo(this.mesh.bounds.center, this.mesh.bounds.radius)
    )
      this.dirty = true;
    if (this.stage.animate(now)) this.dirty = true;
    if (this.blade.animate(now)) this.touch(!this.blade.visible);
    this.drewLast = false;
    if (this.ready && (this.dirty || this.latency.hasWaiting)) {
      const shadows = this.moved && (this.level !== 'lite' || ++this.liteTurn % this.shadowEvery === 0);
      this.stage.fineness = 1;
      this.stage.render(shadows);
      this.dirty = this.moved && !shadows;
      if (shadows) this.moved = false;
      this.drewLast = true;
      this.drewAt = now;
      this.fine = this.level !== 'lite';
      this.fpsCount++;
    } else if (this.ready && !this.fine && !this.stroke && now - this.drewAt > kStillMs) {
      // What stands still is drawn once more, without stairs at its edges.
      this.fine = true;
      this.stage.fineness = kFineness;
      this.stage.render(false);
    }
    this.ink.draw();
    if (this.lastSeq !== this.ackedSeq) {
      this.ackedSeq = this.lastSeq;
      this.engine.ack(this.lastSeq);
    }
    if (now - this.fpsSince >= 1000) {
      this.fps = (1000 * this.fpsCount) / (now - this.fpsSince);
      this.fpsSince = now;
      this.fpsCount = 0;
    }
    if (now - this.lastProgress > 250) {
      this.lastProgress = now;
      this.listener?.progress();
    }
  };

  private sendHover(now: number): void {
    if (this.rayOut !== 0 && now - this.raySince > kRayPatienceMs) this.rayOut = 0;
    if (
      !this.hoverChanged ||
      !this.pointerAt ||
      this.rayOut !== 0 ||
      this.connection !== 'live' ||
      this.tool === 'hand' ||
      this.tool === 'rigid'
    )
      return;
    if (!this.toolAllowed || this.showing) {
      if (!this.showing && this.blade.leave()) this.touch(true);
      return;
    }
    this.hoverChanged = false;
    this.rayAt = this.stage.ray(this.pointerAt.x, this.pointerAt.y);
    this.rayOut = this.engine.ray(
      this.rayAt.origin,
      this.rayAt.direction,
      (toolInfo(this.tool).size?.near ?? 0) * this.instrumentSize(this.tool),
    );
    this.raySince = now;
  }

  private pushCounts(c: Counts): void {
    this.countSeries.push(
      this.cutNumber,
      c.visualVertices,
      c.visualTriangles,
      c.collisionVertices,
      c.collisionTriangles,
      c.nodes,
      c.hexahedra,
    );
  }
  private clearSeries(): void {
    this.cutNumber = 0;
    this.stepSeries.clear();
    this.contactSeries.clear();
    this.cutSeries.clear();
    this.countSeries.clear();
  }

  // -------------------------------------------------------------------------------------------------------------------
  // For tests

  snapshot(): Record<string, unknown> {
    const s = this.mesh.state,
      camera = this.stage.camera.position,
      target = this.stage.controls.target;
    return {
      connection: this.connection,
      scene: this.info?.name ?? null,
      version: s?.version ?? null,
      counts: this.counts,
      drawn: s ? { vertices: s.nv, skin: s.ns, wall: s.nw, copies: s.nc, nodes: s.nn } : null,
      pieces: this.pieces,
      cut: this.lastCut,
      cuts: this.cutNumber,
      stats: this.lastStats,
      latency: { ...this.latency.summary(), motion: this.latency.summary('motion'), last: this.latency.last },
      fps: this.fps,
      quality: this.quality,
      qualityMode: this.qualityMode,
      role: this.roleNow,
      readOnly: this.readOnly,
      tool: this.tool,
      showing: this.showing,
      toolAllowed: this.toolAllowed,
      stroke: this.stroke !== null,
      ink: this.ink.waiting,
      playing: this.playing,
      speed: this.speed,
      time: this.time,
      undoDepth: this.undoDepth,
      redoDepth: this.redoDepth,
      views: { ...this.overlays.shown },
      frames: this.frames,
      patches: this.patches,
      bodies: this.bodies,
      errors: this.errors,
      lastError: this.lastError,
      ready: this.ready && s !== null,
      software: this.stage.software,
      camera: { position: camera.toArray(), target: target.toArray() },
      outOfView: this.pieceView.count(),
      bounds: { center: this.mesh.bounds.center.toArray(), radius: this.mesh.bounds.radius },
      blade: this.blade.visible,
      bladeLevel: this.blade.level,
      bladeTip: this.blade.tip.toArray(),
      loading: this.loadingNow,
      things: this.things.list.map((t) => ({ name: t.name, shape: t.shape, tool: t.tool })),
      floor: this.stage.floorShown,
      scopeOn: this.stage.scopeOn,
      score: this.scoreNow,
      lesion: this.info?.lesion ?? null,
      instrument: this.instrumentSize(this.tool),
      rigid: this.things.tools,
      touching: this.things.touching,
      press: this.things.press,
      unit: this.info?.unit ?? null,
      fixed: this.mesh.fixed.length,
    };
  }

  /** Window position of a vertex of the drawn mesh that is nearest to a rest position. */
  pickRest(x: number, y: number, z: number): [number, number] | null {
    const s = this.mesh.state;
    if (!s) return null;
    let best = -1,
      near = Infinity;
    for (let v = 0; v < s.nv; v++) {
      const d = Math.hypot(s.rest[3 * v]! - x, s.rest[3 * v + 1]! - y, s.rest[3 * v + 2]! - z);
      if (d < near) {
        near = d;
        best = v;
      }
    }
    if (best < 0) return null;
    const p = skinPoint(
      s,
      this.mesh.cells.pose,
      s.copy[best]!,
      s.rest[3 * best]!,
      s.rest[3 * best + 1]!,
      s.rest[3 * best + 2]!,
    );
    return this.pickPoint(...p);
  }
  /** Window position of a point of space. */
  pickPoint(x: number, y: number, z: number): [number, number] {
    this.stage.camera.updateMatrixWorld();
    const p = this.stage.project([x, y, z]),
      box = this.canvas.getBoundingClientRect();
    return [p[0] + box.left, p[1] + box.top];
  }
}

function boxOf(s: BodyState): Box {
  const lo: [number, number, number] = [Infinity, Infinity, Infinity],
    hi: [number, number, number] = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < 3 * s.nv; i++) {
    const k = i % 3,
      x = s.rest[i]!;
    if (x < lo[k]!) lo[k] = x;
    if (x > hi[k]!) hi[k] = x;
  }
  return s.nv > 0 ? { min: lo, max: hi } : { min: [-0.1, -0.1, -0.1], max: [0.1, 0.1, 0.1] };
}
