// What the pointer is over: a ray is asked about, and the instrument placed at the answer.
import { Vector3 } from 'three';
import type { App } from '../app';
import { kNoNode, type Hit, type Vec3 } from '../engine/protocol';
import { toolInfo, type Stroke } from './tools';

const kRayPatienceMs = 1000;

export class Hover {
  /** Under the pointer may be another place. */
  changed = false;
  /** A copy of what the pointer is over; kNoNode: nothing. */
  under = kNoNode;
  /** The last stroke that met the body, or was told that it does not. */
  private settled: Stroke | null = null;
  private rayOut = 0;
  private raySince = 0;
  private rayAt: { origin: Vec3; direction: Vec3 } | null = null;
  /** The stroke in which that ray was sent. A ray sent before the press is of another place. */
  private rayStroke: Stroke | null = null;

  constructor(private readonly app: App) {}

  /** No answer comes any more. */
  forget(): void {
    this.rayOut = 0;
  }

  send(now: number): void {
    if (this.rayOut !== 0 && now - this.raySince > kRayPatienceMs) this.rayOut = 0;
    if (
      !this.changed ||
      !this.app.hand.at ||
      this.rayOut !== 0 ||
      this.app.connection !== 'live' ||
      this.app.tool === 'hand' ||
      this.app.tool === 'rigid'
    )
      return;
    if (!this.app.toolAllowed || this.app.showing) {
      if (!this.app.showing && this.app.blade.leave()) this.app.touch(true);
      return;
    }
    this.changed = false;
    this.rayAt = this.app.stage.ray(this.app.hand.at.x, this.app.hand.at.y);
    this.rayOut = this.app.engine.ray(
      this.rayAt.origin,
      this.rayAt.direction,
      (toolInfo(this.app.tool).size?.near ?? 0) * this.app.instrumentSize(this.app.tool),
    );
    this.raySince = now;
    this.rayStroke = this.app.hand.stroke;
  }

  hit(hit: Hit): void {
    if (hit.input !== this.rayOut) return;
    this.rayOut = 0;
    if (!this.app.hand.at || !this.rayAt) return;
    const eye = this.app.stage.camera.position,
      o = this.rayAt.origin,
      d = this.rayAt.direction;
    const point = new Vector3(...hit.point),
      normal = new Vector3(...hit.normal),
      touching = hit.triangle >= 0;
    this.under = hit.copy;
    this.tell(touching);
    if (this.app.grip.holds) return; // the instrument is at what it holds
    if (!touching) {
      // Beside the body the tool hovers where the view ray meets the height of the body's middle.
      const c = this.app.mesh.bounds.center.z,
        t = Math.abs(d[2]) > 0.05 ? (c - o[2]) / d[2] : -1;
      if (!(t > 0)) {
        if (this.app.blade.leave()) this.app.touch(true);
        return;
      }
      point.set(o[0] + t * d[0], o[1] + t * d[1], c);
      normal.set(0, 0, d[2] < 0 ? 1 : -1);
      if (point.distanceTo(this.app.mesh.bounds.center) > 1.6 * this.app.stage.size) {
        if (this.app.blade.leave()) this.app.touch(true);
        return;
      }
    } else if (normal.dot(eye.clone().sub(point)) < 0) {
      normal.negate();
    }
    this.app.blade.bites = this.app.instrumentSize(this.app.tool);
    this.app.blade.place(
      point,
      normal,
      eye,
      touching,
      this.app.hand.stroke !== null,
      !(this.app.hand.stroke && this.app.tool === 'shaver' && this.app.hasTool('shaver')),
    );
    this.app.touch(true);
  }

  /** A probe stays where it is until it has met the body: whoever holds it elsewhere is told so. */
  private tell(touching: boolean): void {
    const { stroke } = this.app.hand;
    if (!stroke || stroke !== this.rayStroke || stroke === this.settled || stroke.tool !== 'probe') return;
    this.settled = stroke;
    if (!touching) this.app.listener?.toast(toolInfo('probe').missed!, false);
  }
}
