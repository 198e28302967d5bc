// The camera on its way to where a person sent it.
import { Vector3 } from 'three';

const kTakes = 600; // ms

export interface View {
  position: Vector3;
  target: Vector3;
}

export class Flight {
  constructor(
    private readonly from: View,
    private readonly began: number,
  ) {}

  /** Where it is on the way to a goal, which may move. */
  at(now: number, goal: View): View {
    const t = Math.min(1, Math.max(0, (now - this.began) / kTakes)),
      part = t * t * (3 - 2 * t);
    return {
      position: this.from.position.clone().lerp(goal.position, part),
      target: this.from.target.clone().lerp(goal.target, part),
    };
  }
  over(now: number): boolean {
    return now - this.began >= kTakes;
  }
}
