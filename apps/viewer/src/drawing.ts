// When and how finely a picture is drawn.
import type { App } from './app';
import { kRound } from './scene/arthroscope';
import type { QualityLevel } from './scene/materials';
import { QualityChooser, kQualitySteps } from './stats/quality';

// s for which what was done is looked at before hands come
// ms without a new picture after which lite draws one that is finer: it takes as long as four, and a hand must not wait for it
const kStillMs = 600;
const kFineness = 2; // pixels along each side of one; 3 takes twice as long again, and shows no more
// Pictures between two with new shadows in lite, where every triangle counts: one more for so many triangles. Half as many: shadows of a
// sheet of 106,496 lag by half a second; double: its pictures take a tenth longer.
const kTrianglesPerTurn = 25_000;
const kFewestTurns = 2;
const kMostTurns = 8;

export class Drawing {
  /** Pictures a second. */
  fps = 0;
  level: QualityLevel = 'full';
  /** There is a body to draw, and programs for it. */
  ready = false;
  width = 1;
  height = 1;
  private readonly chooser: QualityChooser;
  private dirty = true;
  private moved = true;
  private fine = true; // nothing is to be drawn finer
  private liteTurn = 0;
  private drewAt = 0;
  private drewLast = false;
  private lastFrameAt = 0;
  private fpsCount = 0;
  private fpsSince = 0;

  constructor(
    private readonly app: App,
    public mode: QualityLevel | 'auto',
    software: boolean,
  ) {
    // The CPU as a GPU starts with the cheapest materials and stays there.
    const first = software ? kQualitySteps.findIndex((s) => s.level === 'lite') : 0;
    this.chooser = new QualityChooser(first, first);
  }

  /** The last picture, if there was one, has been handed to the screen by now. */
  handedOn(now: number): void {
    if (this.drewLast) {
      this.app.latency.shown(performance.now());
      if (this.mode === 'auto' && this.chooser.frame(now - this.lastFrameAt)) this.applyQuality();
    }
    this.lastFrameAt = now;
  }

  /** The next frame must be drawn; `shadows`: something that throws one moved. */
  touch(shadows: boolean): void {
    this.dirty = true;
    if (shadows) this.moved = true;
  }

  resize(): void {
    const w = this.app.canvas.clientWidth || 1,
      h = this.app.canvas.clientHeight || 1;
    if (w === this.width && h === this.height) return;
    this.app.hand.leaveWindow();
    this.width = w;
    this.height = h;
    this.app.stage.resize(w, h);
    this.app.overlays.setPixels(w, h);
    this.app.mesh.crease.setHeight(h);
    this.app.ink.resize(window.devicePixelRatio || 1);
    if (this.ready && !this.app.ownView) this.app.openingView();
    this.touch(false);
  }

  get quality(): { level: QualityLevel; scale: number } {
    return this.mode === 'auto' ? this.chooser.current : { level: this.mode, scale: 1 };
  }

  applyQuality(): void {
    const q = this.quality,
      ratio = Math.min(window.devicePixelRatio || 1, q.level === 'full' ? 2 : q.level === 'low' ? 1.5 : 1);
    const changed = q.level !== this.level || this.app.bodies === 0;
    this.level = q.level;
    this.app.blade.setLite(q.level === 'lite');
    this.app.stage.setQuality(q.level, ratio * q.scale);
    this.app.stage.resize(this.width, this.height);
    if (changed) {
      this.app.mesh.setLook(this.app.look, q.level);
      if (this.app.things.any) this.app.furnish();
      if (this.app.mesh.state) this.compile();
    }
    this.touch(true);
  }

  /** Pictures between two with new shadows where every triangle counts. */
  private get shadowEvery(): number {
    const turns = Math.round((this.app.mesh.state?.ns ?? 0) / kTrianglesPerTurn);
    return Math.max(kFewestTurns, Math.min(kMostTurns, turns));
  }

  compile(): void {
    this.ready = true;
    // Programs of walls and tools too, or the first cut waits for the compiler.
    const group = this.app.blade.group;
    const hidden: { visible: boolean }[] = [];
    group.traverse((o) => {
      if (!o.visible) {
        hidden.push(o);
        o.visible = true;
      }
    });
    this.app.stage.renderer.compile(this.app.stage.scene, this.app.stage.camera);
    for (const o of hidden) o.visible = false;
  }

  /** Draws when there is something to draw. */
  frame(now: number): void {
    const { stage } = this.app;
    const follows = this.ready && this.app.follow && !stage.scopeOn && (this.moved || stage.following);
    if (follows && stage.followTo(this.app.subject())) this.dirty = true;
    if (this.app.stage.animate(now)) this.dirty = true;
    if (this.app.blade.animate(now)) this.touch(!this.app.blade.visible);
    this.drewLast = false;
    if (this.ready && (this.dirty || this.app.latency.hasWaiting)) {
      const shadows = this.moved && (this.level !== 'lite' || ++this.liteTurn % this.shadowEvery === 0);
      this.app.stage.fineness = 1;
      this.render(shadows);
      this.dirty = this.moved && !shadows;
      if (shadows) this.moved = false;
      this.drewLast = true;
      this.drewAt = now;
      this.fine = this.level !== 'lite';
      this.fpsCount++;
    } else if (this.ready && !this.fine && !this.app.hand.stroke && now - this.drewAt > kStillMs) {
      // What stands still is drawn once more, without stairs at its edges.
      this.fine = true;
      this.app.stage.fineness = kFineness;
      this.render(false);
    }
    if (now - this.fpsSince >= 1000) {
      this.fps = (1000 * this.fpsCount) / (now - this.fpsSince);
      this.fpsSince = now;
      this.fpsCount = 0;
    }
  }

  private render(shadows: boolean): void {
    this.app.things.fromBelow = this.app.stage.eyeBelow;
    this.app.stage.render(shadows, (sight) => this.app.mesh.prepare(sight));
  }

  /** The picture as a PNG file. */
  async picture(): Promise<Blob> {
    const shown = this.app.blade.visible;
    if (shown) this.app.blade.group.visible = this.app.hand.stroke !== null;
    this.render(true);
    this.app.blade.group.visible = true;
    const source = this.app.stage.scopeOn ? this.roundPicture() : this.app.canvas;
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
      { width: w, height: h } = this.app.canvas;
    round.width = w;
    round.height = h;
    g.fillRect(0, 0, w, h);
    g.beginPath();
    g.arc(w / 2, h / 2, (kRound * Math.min(w, h)) / 2, 0, 7);
    g.clip();
    g.drawImage(this.app.canvas, 0, 0);
    return round;
  }
}
