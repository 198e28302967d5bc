// What the hand holds, and where: the engine lifts what lies free, so that it is not under the pointer.
import { Vector3 } from 'three';
import type { App } from '../app';
import type { Frame, Vec3 } from '../engine/protocol';
import { skinPlace, skinUnder, type SkinPlace } from '../scene/skin_ray';

interface Held {
  copy: number;
  point: Vec3;
}

export class Grip {
  /** The message with which the hand closed; 0: it is open. */
  private closed = 0;
  /** Grasps that were there when it closed: a hand leaves some. */
  private before = 0;
  private known = 0;
  /** What was under the pointer then, in this version of the body. */
  private under: { body: number; version: number; place: SkinPlace } | null = null;
  private readonly normal = new Vector3(0, 0, 1);
  /** A copy of what is held, and the engine's place of it: between the sides of a thin body. */
  get holds(): Held | null {
    return this.app.hand.stroke ? this.held : null;
  }
  private held: Held | null = null;

  constructor(private readonly app: App) {}

  /** The hand closes where this ray goes; `input` says so to the engine. */
  close(input: number, ray: { origin: Vec3; direction: Vec3 }): void {
    const s = this.app.mesh.state;
    this.closed = input;
    this.before = this.known;
    this.held = null;
    const place = s && skinUnder(s, this.app.mesh.cells.pose, ray.origin, ray.direction);
    this.under = place ? { body: s.body, version: s.version, place } : null;
    if (this.app.blade.visible) this.normal.copy(this.app.blade.normal);
    else if (place) this.normal.copy(place.normal);
  }
  open(): void {
    this.closed = 0;
    this.held = null;
  }

  /** The hand's own grasp is the last, once the engine knows of it. */
  frame({ input, held, grasps }: Pick<Frame, 'input' | 'held' | 'grasps'>): void {
    this.known = held.length;
    if (this.closed === 0) return;
    if (input < this.closed) this.before = this.known;
    const last = this.known - 1,
      [x, y, z] = grasps.subarray(6 * last);
    this.held = this.known > this.before ? { copy: held[last]!, point: [x!, y!, z!] } : null;
  }

  /** Puts the instrument to what is held. False: nothing is. */
  place(): boolean {
    const { app, holds } = this,
      s = app.mesh.state;
    if (!holds || !s) return false;
    app.blade.place(this.at(holds), this.normal, app.stage.camera.position, true, true);
    return true;
  }
  /** Where the drawn surface is held; the engine's place where it is not known. */
  private at(holds: Held): Vector3 {
    const s = this.app.mesh.state!,
      { under } = this;
    if (under?.body === s.body && under.version === s.version) {
      const { pieces } = this.app.pieceView;
      pieces.update(s);
      if (holds.copy >= s.nc || pieces.of(s, holds.copy) === pieces.of(s, s.copy[under.place.corners[0]]!))
        return skinPlace(s, this.app.mesh.cells.pose, under.place);
    }
    return new Vector3(...holds.point);
  }
}
