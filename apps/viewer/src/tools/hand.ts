// The pointers over the view: strokes of tools, the camera and the arthroscope led by hand. What a pointer is for, PointerMap says.
import type { App } from '../app';
import { Modifier, type ToolSample } from '../engine/protocol';
import { PointerMap, TwoFingers, type PointerKind } from './mapping';
import { FreshSamples, Pacer } from './pacing';
import { Stroke, type StrokeMessage, type ToolName } from './tools';

const kPinch = 0.6; // of the body's size that fingers push the arthroscope in, for each height of the window that they come apart
const kFingerPixels = 22; // half as wide as what a fingertip hits
const kPointerPixels = 8; // of a mouse or pen: as far as a hand in motion misses by
const kToTheRim: ReadonlySet<ToolName> = new Set(['scalpel', 'line'] as const);
const kToCut: ReadonlySet<ToolName> = new Set(['scalpel', 'line', 'closed', 'scissors'] as const);
const kToHold: ReadonlySet<ToolName> = new Set(['grasp', 'take'] as const);
const kMotions: ReadonlySet<ToolName> = new Set(['grasp', 'take', 'probe', 'suction'] as const);

export class Hand {
  readonly pointers = new PointerMap();
  readonly pacer = new Pacer();
  stroke: Stroke | null = null;
  /** Where the pointer is over the view, pixels. */
  at: { x: number; y: number } | null = null;
  /** Samples of the stroke that are not sent yet. */
  private held: ToolSample[] = [];
  private heldModifiers = 0;
  private lastSample: ToolSample | null = null;
  /** So near the rim the stroke begins and ends beside the body, in parts of the distance from the eye. */
  private rimReach = 0;
  private readonly fresh = new FreshSamples();
  private readonly fingers = new TwoFingers();
  /** The pointer that leads the arthroscope. */
  private steering: { id: number; x: number; y: number; turns: boolean } | null = null;
  /** The pointer that turns the view. */
  private turning: number | null = null;

  constructor(private readonly app: App) {
    this.listen();
  }

  private sample(e: PointerEvent): ToolSample {
    const box = this.app.canvas.getBoundingClientRect();
    const { origin, direction } = this.app.stage.ray(e.clientX - box.left, e.clientY - box.top);
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
    const [a, b] = [-0.5, 0.5].map(
      (s) => this.app.stage.ray(0.5 * this.app.drawing.width + s * pixels, 0.5 * this.app.drawing.height).direction,
    );
    return Math.hypot(a![0] - b![0], a![1] - b![1], a![2] - b![2]);
  }

  /** Returns the number of the last message; 0: none was sent. */
  private send(messages: StrokeMessage[], e: { timeStamp: number }, modifiers: number): number {
    let last = 0;
    for (const m of messages) {
      const input = (last = this.app.engine.tool({
        ...m,
        modifiers,
        size: this.app.instrumentSize(this.app.tool) || this.rimReach,
      }));
      this.app.latency.sent(input, e.timeStamp, kMotions.has(this.app.tool) ? 'motion' : 'cut');
      this.pacer.sent(input, performance.now());
      this.app.ink.sent(input);
    }
    return last;
  }

  /** Takes the samples of an event that did not come with an earlier one; sends them if the engine keeps up. */
  private gather(e: PointerEvent, raw: boolean): void {
    const events = e.getCoalescedEvents?.() ?? [];
    const box = this.app.canvas.getBoundingClientRect();
    for (const x of this.fresh.of(events.length > 0 ? events : [e], raw)) {
      this.app.ink.add(x.clientX - box.left, x.clientY - box.top);
      this.lastSample = this.sample(x);
      this.held.push(this.lastSample);
    }
    this.heldModifiers = this.modifiers(e);
    this.sendHeld(false);
  }

  sendHeld(now: boolean): void {
    if (!this.stroke || this.held.length === 0 || !(now || this.pacer.ready(performance.now()))) return;
    const samples = this.held;
    this.held = [];
    this.send(this.stroke.move(samples), { timeStamp: samples[0]!.time }, this.heldModifiers);
  }

  private listen(): void {
    const c = this.app.canvas,
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
          if (this.app.stage.scopeOn) this.steering = { id: e.pointerId, x: e.clientX, y: e.clientY, turns: false };
          return;
        }
        if (decision === 'orbit') {
          if (this.app.stage.scopeOn) {
            this.steering = { id: e.pointerId, x: e.clientX, y: e.clientY, turns: e.shiftKey || e.button === 1 };
            c.setPointerCapture(e.pointerId);
            return;
          }
          this.turning = e.pointerId;
          this.leave();
          // Alt-drag turns the view with the first button too, and so does a finger beside a pen.
          this.app.stage.setOrbitOnly(
            this.app.tool === 'hand' || !this.app.toolAllowed || e.altKey || kind === 'touch',
          );
          this.app.touch(false);
          return;
        }
        c.setPointerCapture(e.pointerId);
        this.place(e);
        this.app.follow = false;
        if (this.app.tool === 'rigid') {
          this.app.lead.take(e);
          return;
        }
        this.stroke = new Stroke(this.app.tool);
        this.rimReach = kToTheRim.has(this.app.tool)
          ? this.partOfDistance(kind === 'touch' ? kFingerPixels : kPointerPixels)
          : 0;
        this.held = [];
        this.fresh.begin();
        const at = this.at!;
        this.app.ink.begin(this.app.tool, at.x, at.y);
        this.heldModifiers = this.modifiers(e);
        this.lastSample = this.sample(e);
        const closed = this.send(this.stroke.down(this.lastSample), e, this.heldModifiers);
        if (kToHold.has(this.app.tool)) this.app.grip.close(closed, this.lastSample);
        else this.app.grip.open();
        this.app.listener?.used(this.app.tool);
      },
      capture,
    );
    c.addEventListener(
      'pointermove',
      (e) => {
        const two = this.fingers.move(e.pointerId, e.clientX, e.clientY);
        if (two && this.steering && this.app.stage.scopeOn) {
          this.app.stage.scope.push((kPinch * two.apart) / Math.max(1, this.app.drawing.height));
          this.leanScope(two.x, two.y);
        } else if (this.steering?.id === e.pointerId) {
          this.steer(e);
        } else if (this.app.lead.active && this.pointers.owns(e.pointerId)) {
          this.app.lead.to(e);
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
        if (e.buttons !== 0) this.app.touch(false);
      },
      capture,
    );
    // Moves come once a picture; raw ones, where the browser has them, as they happen: half a picture sooner.
    c.addEventListener(
      'pointerrawupdate',
      (e) => {
        const p = e as PointerEvent;
        if (!this.pointers.owns(p.pointerId)) return;
        if (this.app.lead.active) this.app.lead.to(p);
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
        this.app.updateAllowed();
        return;
      }
      this.app.lead.drop();
      if (!this.stroke) return;
      if (good) {
        this.heldModifiers = this.modifiers(e);
        this.place(e);
        this.app.ink.add(this.at!.x, this.at!.y);
        this.liftStroke(this.sample(e));
      } else {
        this.send(this.stroke.cancel(), e, 0);
        this.stroke = null;
        this.app.ink.drop();
      }
      if (e.pointerType === 'touch' || !onView) this.leave();
      this.app.touch(true);
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
        if (!this.app.lead.active && this.app.stage.scopeOn) {
          e.preventDefault();
          this.app.stage.scope.push(-4e-4 * e.deltaY * (e.deltaMode === 1 ? 30 : 1));
          this.app.stage.placeScope();
          this.app.hover.changed = true;
          this.app.touch(false);
          return;
        }
        if (!this.app.lead.active) return;
        e.preventDefault();
        e.stopImmediatePropagation(); // the view does not zoom meanwhile
        this.app.lead.push(-3e-4 * e.deltaY * (e.deltaMode === 1 ? 30 : 1), e.timeStamp);
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
  }

  /** The arthroscope is led by its handle: the picture goes the way of the pointer. */
  private steer(e: PointerEvent): void {
    const s = this.steering!,
      dx = e.clientX - s.x,
      dy = e.clientY - s.y;
    s.x = e.clientX;
    s.y = e.clientY;
    if (!s.turns) return this.leanScope(dx, dy);
    this.app.turnScope((200 * dx) / Math.max(1, this.app.drawing.height));
    this.app.stage.placeScope();
    this.app.touch(false);
  }
  /** Pixels. */
  private leanScope(dx: number, dy: number): void {
    const h = Math.max(1, this.app.drawing.height);
    this.app.stage.scope.lean((-0.7 * dx) / h, (0.7 * dy) / h);
    this.app.stage.placeScope();
    this.app.touch(false);
  }

  place(e: PointerEvent): void {
    const box = this.app.canvas.getBoundingClientRect();
    this.at = { x: e.clientX - box.left, y: e.clientY - box.top };
    this.app.hover.changed = true;
  }

  /** The pointer is not over the view, or turns it: the instrument fades. */
  private leave(): void {
    this.at = null;
    if (!this.app.showing && this.app.blade.leave()) this.app.touch(true);
  }

  /** Takes the stroke back, for a second finger came down. */
  private abandon(timeStamp: number): void {
    if (!this.stroke) return;
    this.send(this.stroke.cancel(), { timeStamp }, 0);
    this.stroke = null;
    this.app.ink.drop();
    this.app.touch(true);
  }

  /** Ends the current stroke at a sample. */
  private liftStroke(last: ToolSample): void {
    this.sendHeld(true);
    this.send(this.stroke!.up(last), { timeStamp: last.time }, this.heldModifiers);
    this.stroke = null;
    this.app.ink.end();
  }

  /** Nothing is heard of the pointer any more: what was drawn for a cut is cut, other strokes end without. */
  private leavePage(): void {
    if (!this.stroke || !kToCut.has(this.app.tool) || !this.lastSample) {
      this.cancelStroke(true);
      return;
    }
    this.pointers.cancel();
    this.liftStroke({ ...this.lastSample, time: performance.now() });
    this.app.touch(true);
  }

  /** The window gets another size, and the pointer is over another place: the stroke ends where it was. What waits for its end is taken back. */
  leaveWindow(): void {
    const { stroke, lastSample } = this;
    if (!stroke || !lastSample || stroke.deferred || stroke.tool === 'take') {
      this.cancelStroke(true);
    } else {
      this.pointers.cancel();
      this.liftStroke({ ...lastSample, time: performance.now() });
    }
    this.app.ink.clear(); // its places are those of the former window
    if (stroke) this.leave();
  }

  /** Ends the current stroke without a cut; `tell`: the engine is there to hear it. */
  cancelStroke(tell: boolean): void {
    this.pointers.cancel();
    this.app.lead.drop();
    if (!this.stroke) return;
    if (tell) this.send(this.stroke.cancel(), { timeStamp: performance.now() }, 0);
    this.stroke = null;
    this.app.ink.drop();
    this.app.touch(true);
  }
}
