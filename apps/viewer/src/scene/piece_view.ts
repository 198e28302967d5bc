// Which pieces of the body are in the picture, and a ball round those that can be.
import type { Vector3 } from 'three';
import type { BodyMesh } from './body_mesh';
import type { Subject } from './framing';
import { ballOf, Pieces, within } from './pieces';
import type { Stage } from './stage';

export class PieceView {
  readonly pieces = new Pieces();

  constructor(
    private readonly mesh: BodyMesh,
    private readonly stage: Stage,
  ) {}

  private places(): Vector3[][] {
    const s = this.mesh.state;
    if (!s) return [];
    this.pieces.update(s);
    return this.pieces.places(s, this.mesh.cells.pose);
  }

  /** All that have not fallen away for good. */
  subject(): Subject {
    const s = this.mesh.state;
    if (s) this.pieces.update(s);
    const all = s ? this.pieces.outlines(s, this.mesh.cells.pose) : [];
    if (all.length === 0) return { places: [this.stage.middle.clone()], beside: [], ball: this.mesh.bounds };
    const pieces = within(all, this.stage.middle, this.stage.reach);
    return { places: pieces.flat(), beside: [], ball: ballOf(pieces) };
  }

  /** Pieces of the body, and how many of those within reach are wholly outside the picture. */
  count(): { all: number; outside: number } {
    if (this.stage.scopeOn) return { all: 0, outside: 0 };
    const { middle, reach } = this.stage,
      pieces = this.places();
    const near = pieces.filter((p) => p.some((x) => x.distanceTo(middle) < reach));
    return { all: pieces.length, outside: near.filter((p) => !p.some((x) => this.stage.sees(x))).length };
  }
}
