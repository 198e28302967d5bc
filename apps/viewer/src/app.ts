// The page without its controls: engine, scene, tools and measurements, tied together.
import { Vector3 } from 'three';
import type { Engine, EngineEvents, EngineState } from './engine/engine';
import {
  CommandCode,
  FrameFlag,
  LoadState,
  kNoNode,
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
  type Vec3,
} from './engine/protocol';
import { Blade } from './scene/blade';
import { BodyMesh } from './scene/body_mesh';
import { BodyState } from './scene/body_state';
import { Drawing } from './drawing';
import { Ink } from './scene/ink';
import { kNothingOver, type Insets, type Subject } from './scene/framing';
import type { Look, QualityLevel } from './scene/materials';
import { makeNoiseTexture } from './scene/noise';
import { receiveContact } from './scene/occlusion';
import { Overlays, type ViewName } from './scene/overlays';
import { readSceneInfo, type SceneInfo } from './scene_info';
import { readThings, type Thing } from './engine/things';
import { ThingsView } from './scene/things';
import { PieceView } from './scene/piece_view';
import { Scales } from './scene/scales';
import { type Box, Stage } from './scene/stage';
import { LatencyMeter } from './stats/latency';
import { Records } from './stats/records';
import { toolInfo, type ToolName } from './tools/tools';
import { ghostAt } from './tools/ghost';
import { Grip } from './tools/grip';
import { Hand } from './tools/hand';
import { Hover } from './tools/hover';
import { Lead } from './tools/lead';

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
  /** Pixels of the window that controls lie over. */
  overView(): Insets;
}

const kShownAfter = 0.6;
export class App implements EngineEvents {
  readonly stage: Stage;
  readonly mesh: BodyMesh;
  readonly overlays: Overlays;
  readonly pieceView: PieceView;
  readonly scales: Scales;
  readonly blade = new Blade();
  readonly things = new ThingsView();
  readonly ink: Ink;
  readonly hand: Hand;
  readonly drawing: Drawing;
  readonly lead = new Lead(this);
  readonly hover = new Hover(this);
  readonly grip = new Grip(this);
  readonly latency = new LatencyMeter();
  readonly records = new Records();
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
  frames = 0;
  patches = 0;
  bodies = 0;
  errors = 0;
  lastError = '';
  recording = false;
  loadingNow: Loading | null = null;

  private engineSession: bigint | null = null;
  private playAsked = 0;
  readonly canvas: HTMLCanvasElement;
  look: Look = 'steak';
  private shownScene = '';
  private bodyNumber = '';
  private shownFrom: Vec3 | null = null;
  private pendingNodes = new Float32Array(0);
  private pending: { version: number; input: number; n: number; fading: Fading } | null = null;
  private lastSeq = 0;
  private ackedSeq = 0;
  private thingList: Thing[] = [];
  private lastProgress = 0;
  private uploads = 0;
  private uploadInput = 0;
  /** Hears what becomes of the last upload; without it trouble is a toast. */
  uploadWatch: UploadWatch | null = null;
  /** The camera follows a body that sinks or swings away, until a person moves it or uses a tool. */
  follow = true;
  /** A person has turned the view: a window that changes leaves it. */
  ownView = false;

  constructor(
    readonly engine: Engine,
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
    this.drawing = new Drawing(this, options.quality, options.software);
    this.hand = new Hand(this);
    this.stage.controls.addEventListener('start', () => {
      this.follow = false;
      this.ownView = true;
    });
    this.stage.controls.addEventListener('change', () => {
      this.hover.changed = true; // under the pointer is another place
      this.touch(false);
    });
    this.canvas.addEventListener('webglcontextlost', (e) => e.preventDefault());
    this.canvas.addEventListener('webglcontextrestored', () => {
      if (this.mesh.state) this.stage.setBox(this.info?.box ?? boxOf(this.mesh.state), this.look, true);
      this.touch(true);
    });
    new ResizeObserver(() => this.drawing.resize()).observe(canvas);
    this.drawing.resize();
    this.drawing.applyQuality();
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
      this.hand.cancelStroke(false);
      this.latency.forget();
      this.hand.pacer.forget();
      this.ink.clear();
      this.hover.forget();
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
    this.hand.cancelStroke(false);
    this.ink.clear();
    this.hover.under = kNoNode;
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
    const same = this.bodyShown && this.drawing.ready;
    this.shownScene = this.sceneKey();
    if (!same && this.stage.scopeOn) this.setScope(false); // another scene opens in its own view
    this.stage.setBox(info?.box ?? boxOf(state), look, same);
    if (!same) this.ownView = false;
    this.viewOfShow(!same);
    this.blade.setSize(this.stage.size);
    const scope = info?.scope;
    if (!same)
      this.stage.setScopePlace(
        scope ? { entry: new Vector3(...scope.entry), target: new Vector3(...scope.target), angle: scope.angle } : null,
      );
    if (!same) {
      this.records.clear();
      this.follow = true;
    }
    // A body that starts anew has another number; one that is sent again has its own.
    const number = `${this.engineSession} ${body.body}`;
    if (number !== this.bodyNumber) {
      this.bodyNumber = number;
      this.lastCut = null;
      this.listener?.cut(null);
    }
    if (look !== this.look) {
      this.look = look;
      this.mesh.setLook(look, this.drawing.level);
    }
    this.counts = null;
    this.touch(true);
    this.drawing.compile();
  }

  /** Opened files may have the name of those before. */
  private sceneKey(): string {
    return JSON.stringify([this.info?.name, this.info?.opened, this.info?.box]);
  }
  /** A scene is announced first; its body follows. */
  get bodyShown(): boolean {
    return this.shownScene === this.sceneKey();
  }

  /** What a scene does is watched from where it is seen well, and its body worked on in the view of all bodies. A person's own view stays. */
  private viewOfShow(opens: boolean): void {
    const view = this.shown ? (this.info?.script?.view ?? null) : null;
    const turns = (view !== this.shownFrom || opens) && !this.ownView;
    this.shownFrom = view;
    if (turns) this.openingView();
  }
  /** The view that nobody has chosen: of all bodies, or of what the scene does. */
  openingView(): void {
    this.stage.over = this.listener?.overView() ?? kNothingOver;
    this.stage.lookAt(this.subject(), this.shownFrom ?? undefined);
  }
  /** All pieces, and the trays that pieces are laid on. */
  subject(): Subject {
    return { ...this.pieceView.subject(), beside: this.scales.tops(this.up) };
  }
  /** Against gravity; without any, along z. */
  get up(): Vector3 {
    const up = new Vector3(...(this.info?.gravity ?? [0, 0, -1])).negate();
    return up.length() > 0 ? up.normalize() : up.set(0, 0, 1);
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
      this.hover.changed = true;
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
      const placed = this.things.allPlaced;
      if (this.things.place(frame.places, frame.tools)) this.touch(true);
      if (!placed && this.things.allPlaced) {
        this.listener?.things(this.things.tools.length);
        // A scene's trays are seen from the first.
        if (this.follow && !this.ownView && this.scales.tops(this.up).length > 0) this.openingView();
      }
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
    this.grip.frame(frame);
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
    this.lead.renew();
    this.furnish();
    const tools = things.filter((t) => t.tool).length;
    if ((tools === 0 && this.tool === 'rigid') || (!this.hasProbe && this.tool === 'probe')) this.setTool('scalpel');
    this.listener?.things(tools);
    this.drawing.compile();
    this.touch(true);
  }

  hit(hit: Hit): void {
    this.hover.hit(hit);
  }

  fixed(fixed: Fixed): void {
    if (fixed.body !== this.mesh.state?.body) return;
    this.mesh.setFixed(fixed.nodes.slice(), fixed.vertices.slice());
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
    this.records.stats(stats, this.drawing.fps, this.things);
    this.listener?.stats(stats);
  }

  cut(report: CutReport): void {
    this.lastCut = report;
    this.counts = report.counts;
    this.pieces = report.pieces;
    this.records.cut(report);
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

  /** The engine has done all inputs up to this one. */
  private answered(input: number): void {
    this.hand.pacer.answered(input);
    this.ink.done(input);
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
  /** The page shows at once what is asked for. */
  play(on: boolean): void {
    if (!this.toolAllowed || on === this.playing) return;
    this.playing = on;
    this.playAsked = this.command(on ? CommandCode.Play : CommandCode.Pause);
    this.listener?.play(this.playing, this.speed, this.undoDepth, this.redoDepth);
  }
  setTool(tool: ToolName): void {
    this.hand.cancelStroke(true);
    this.tool = tool;
    this.blade.setTool(tool);
    this.mesh.showFixed = tool === 'fix' || tool === 'release';
    this.hand.pointers.handTool = tool === 'hand';
    this.updateAllowed();
    this.hover.changed = true;
    if (tool === 'hand') this.blade.hide();
    this.touch(true);
  }
  hasTool(shape: string): boolean {
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
    this.hover.changed = true;
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
  setQuality(mode: QualityLevel | 'auto'): void {
    this.drawing.mode = mode;
    this.drawing.applyQuality();
  }
  setTheme(dark: boolean): void {
    this.stage.setTheme(dark);
    this.touch(false);
  }
  get strokeActive(): boolean {
    return this.hand.stroke !== null || this.lead.active;
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
    this.hand.cancelStroke(true);
    this.stage.setScope(on);
    this.mesh.inJoint = this.things.inJoint = this.blade.inJoint = on;
    document.documentElement.toggleAttribute('data-scope', on);
    this.hover.changed = true;
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
    this.stage.over = this.listener?.overView() ?? kNothingOver;
    if (fly && !matchMedia('(prefers-reduced-motion: reduce)').matches)
      this.stage.flyTo(() => this.subject(), performance.now());
    else this.stage.lookAt(this.subject());
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
  async picture(): Promise<Blob> {
    return this.drawing.picture();
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
  /** The scene's own commands have run, or run: the body is not as a person found it. */
  get shown(): boolean {
    return this.info?.script?.runs === true;
  }
  /** Plays what the scene was made for; again, or before it has ended: the scene anew, for a person's hands. */
  show(on: boolean): void {
    if (!this.info?.script) return;
    this.command(CommandCode.Scene, [on ? 1 : 0], this.info.name);
    if (on) this.play(true);
  }
  /** Starts again. A scene that was shown starts for a person's hands. */
  reset(): void {
    if (this.info?.script?.runs) this.show(false);
    else this.command(CommandCode.Reset);
  }

  updateAllowed(): void {
    this.hand.pointers.toolAllowed = this.toolAllowed && !this.showing;
    this.stage.setOrbitOnly(this.tool === 'hand' || !this.hand.pointers.toolAllowed);
    this.canvas.dataset.tool = this.tool;
    this.canvas.dataset.paused = String(!this.toolAllowed && this.tool !== 'hand');
    document.documentElement.toggleAttribute('data-paused', !this.toolAllowed);
  }

  furnish(): void {
    this.things.set(this.thingList, this.stage.size, this.look, this.drawing.level, this.stage.makeWood(), (m) =>
      receiveContact(m, this.mesh.around),
    );
  }

  // -------------------------------------------------------------------------------------------------------------------
  // Drawing

  touch(shadows: boolean): void {
    this.drawing.touch(shadows);
  }

  private readonly loop = (now: number): void => {
    requestAnimationFrame(this.loop);
    this.drawing.handedOn(now);
    const pending = this.pending,
      state = this.mesh.state;
    if (pending && state && pending.version === state.version) {
      this.pending = null;
      if (this.mesh.setNodes(this.pendingNodes.subarray(0, pending.n), pending.fading)) {
        this.touch(true);
        if (this.hand.at) this.hover.changed = true;
      }
      if (this.grip.place()) this.touch(true);
      this.latency.echoed(pending.input, performance.now(), 'motion');
    }
    if (state && this.mesh.crease.update(state, now, this.strokeActive)) this.touch(false);
    if (state && this.mesh.occlusion.update(state, this.mesh.cells.pose, now)) this.touch(false);
    this.hand.sendHeld(false);
    this.lead.send();
    this.hover.send(now);
    this.drawing.frame(now);
    this.ink.draw();
    if (this.lastSeq !== this.ackedSeq) {
      this.ackedSeq = this.lastSeq;
      this.engine.ack(this.lastSeq);
    }
    if (now - this.lastProgress > 250) {
      this.lastProgress = now;
      this.listener?.progress();
    }
  };
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
