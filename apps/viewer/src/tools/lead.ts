// The scene's own tools: the pointer leads the nearest one in the plane that faces the eye.
import { Vector3 } from 'three';
import type { App } from '../app';
import type { Vec3 } from '../engine/protocol';

export class Lead {
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
  private toolIndex = 0;
  private jawsOpen: boolean[] = [];

  constructor(private readonly app: App) {}

  get active(): boolean {
    return this.led !== null;
  }
  drop(): void {
    this.led = this.ledTo = null;
  }
  /** Other tools have come: their jaws are open. */
  renew(): void {
    this.jawsOpen = [];
  }
  /** Towards the eye, in sizes of the body. */
  push(by: number, time: number): void {
    if (!this.led) return;
    this.led.depth += by * this.app.stage.size;
    this.ledTo = { x: this.led.at.x, y: this.led.at.y, time };
    this.send();
  }
  /** Opens or closes the jaws of the tool that was held last. */
  toggleJaws(): void {
    const reading = this.app.things.tools[this.toolIndex];
    if (!reading || !this.app.toolAllowed) return;
    this.jawsOpen[this.toolIndex] = !(this.jawsOpen[this.toolIndex] ?? true);
    this.tell(this.toolIndex, reading.pose.position, reading.pose.quaternion, performance.now());
  }

  take(e: PointerEvent): void {
    const at = this.app.hand.at!,
      tools = this.app.things.tools;
    let best = -1,
      near = Infinity;
    tools.forEach((t, i) => {
      const [x, y] = this.app.stage.project(t.place.position as Vec3),
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
      normal = this.app.stage.camera.getWorldDirection(new Vector3());
    const grab = this.onPlane(e, from, normal);
    if (!grab) return;
    this.led = { from, grab, normal, depth: 0, turn: reading.pose.quaternion, at: { ...at } };
    this.app.listener?.used('rigid');
  }
  private onPlane(at: { clientX: number; clientY: number }, point: Vector3, normal: Vector3): Vector3 | null {
    const box = this.app.canvas.getBoundingClientRect();
    const { origin, direction } = this.app.stage.ray(at.clientX - box.left, at.clientY - box.top);
    const o = new Vector3(...origin),
      d = new Vector3(...direction),
      along = d.dot(normal);
    if (along < 1e-3) return null;
    return o.addScaledVector(d, point.clone().sub(o).dot(normal) / along);
  }
  to(e: PointerEvent): void {
    const led = this.led!;
    this.app.hand.place(e);
    const at = this.app.hand.at!;
    if (e.shiftKey) {
      // Up is away from the eye; sideways stays.
      led.depth += ((led.at.y - at.y) / Math.max(1, this.app.drawing.height)) * 1.5 * this.app.stage.size;
      const here = this.onPlane(e, led.from, led.normal),
        before = this.onPlane({ clientX: e.clientX, clientY: e.clientY + (led.at.y - at.y) }, led.from, led.normal);
      if (here && before) led.grab.add(here.sub(before));
    }
    led.at = { ...at };
    this.ledTo = { x: at.x, y: at.y, time: e.timeStamp };
    this.send();
  }
  send(): void {
    const led = this.led,
      to = this.ledTo;
    if (!led || !to || !this.app.hand.pacer.ready(performance.now())) return;
    this.ledTo = null;
    const box = this.app.canvas.getBoundingClientRect();
    const now = this.onPlane({ clientX: to.x + box.left, clientY: to.y + box.top }, led.from, led.normal);
    if (!now) return;
    const p = led.from.clone().add(now).sub(led.grab).addScaledVector(led.normal, led.depth);
    this.tell(this.toolIndex, [p.x, p.y, p.z], led.turn, to.time);
  }
  private tell(tool: number, position: Vec3, q: readonly [number, number, number, number], started: number): void {
    const s = Math.hypot(q[0], q[1], q[2]),
      angle = 2 * Math.atan2(s, q[3]),
      f = s > 1e-12 ? angle / s : 0;
    const input = this.app.engine.device(
      tool,
      position,
      [f * q[0], f * q[1], f * q[2]],
      this.jawsOpen[tool] === false ? 0 : 1,
    );
    this.app.latency.sent(input, started, 'motion');
    this.app.hand.pacer.sent(input, performance.now());
  }
}
