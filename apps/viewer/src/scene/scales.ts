// What the pieces weigh, and what lies on trays: obstacles of that name are scales.
import { Box3, Quaternion, Ray, Vector3 } from 'three';
import type { Masses } from '../engine/protocol';
import type { Thing } from '../engine/things';
import type { BodyMesh } from './body_mesh';
import type { Pieces } from './pieces';
import type { ThingsView } from './things';

const kTray = 'tray';
const kNear = 0.04; // of the body's size: so near the top, or near a piece that lies there, a piece lies there too

export interface Weight {
  /** kg */
  mass: number;
  /** Of the uncut body. */
  share: number;
}
export interface Block {
  /** In its own axes, metres. */
  box: Box3;
  position: Vector3;
  turn: Quaternion;
}
export type Tray = Block;

export function isTray(thing: Thing): boolean {
  return !thing.tool && thing.name === kTray && thing.parts.length > 0;
}

/** The axis of a tray that points upwards most, and which way along it is up. */
function upright(tray: Tray, up: Vector3): { axis: 0 | 1 | 2; way: number } {
  const own = up.clone().applyQuaternion(tray.turn.clone().invert()).toArray();
  const axis = ([0, 1, 2] as const).reduce((a, b) => (Math.abs(own[b]) > Math.abs(own[a]) ? b : a));
  return { axis, way: Math.sign(own[axis]) || 1 };
}

/** The corners of a tray's top. */
export function topOf(tray: Tray, up: Vector3): Vector3[] {
  const { axis, way } = upright(tray, up),
    { min, max } = tray.box;
  return [0, 1, 2, 3].map((i) => {
    const p = new Vector3();
    for (let k = 0, bit = 0; k < 3; k++) {
      const high = k === axis ? way > 0 : ((i >> bit++) & 1) === 1;
      p.setComponent(k, (high ? max : min).getComponent(k));
    }
    return p.applyQuaternion(tray.turn).add(tray.position);
  });
}

const kAlong = 0.2; // sine of the angle below which a top is seen along: half of it, and words of a tray stand on the body before it
const kBefore = 1 - 1e-3; // of the way to a place: what is met there lies before it, not at it

/** Whether a block lies between an eye and a place: a place on the block itself is hidden from its other side. */
export function hides(block: Block, eye: Vector3, place: Vector3): boolean {
  const back = block.turn.clone().invert(),
    own = (p: Vector3): Vector3 => p.clone().sub(block.position).applyQuaternion(back);
  const from = own(eye),
    way = own(place).sub(from),
    length = way.length();
  const met = new Ray(from, way.normalize()).intersectBox(block.box, new Vector3());
  return met !== null && met.distanceTo(from) < kBefore * length;
}

/**
 * Which pieces lie on a tray. A piece's centre is over the tray, and its lowest place is within `near` metres of the top, or
 * of the highest place of one that lies there: of a stack all are counted.
 */
export function liesOn(tray: Tray, pieces: Vector3[][], near: number, up: Vector3): boolean[] {
  const { axis, way } = upright(tray, up),
    back = tray.turn.clone().invert(),
    height = (p: Vector3): number => way * p.getComponent(axis);
  const over = pieces.map((places, piece) => {
    const own = places.map((p) => p.clone().sub(tray.position).applyQuaternion(back));
    const box = new Box3().setFromPoints(own),
      centre = own.reduce((sum, p) => sum.add(p), new Vector3()).divideScalar(Math.max(1, own.length));
    const inside = ([0, 1, 2] as const).every(
      (k) =>
        k === axis ||
        (centre.getComponent(k) >= tray.box.min.getComponent(k) &&
          centre.getComponent(k) <= tray.box.max.getComponent(k)),
    );
    const ends = [height(box.min), height(box.max)];
    return { piece, inside, lowest: Math.min(...ends), highest: Math.max(...ends) };
  });
  const lies = pieces.map(() => false),
    top = Math.max(height(tray.box.min), height(tray.box.max));
  let reach = top;
  for (const p of over.filter((o) => o.inside).sort((a, b) => a.lowest - b.lowest)) {
    if (p.lowest < top - near || p.lowest > reach + near) continue;
    lies[p.piece] = true;
    reach = Math.max(reach, p.highest);
  }
  return lies;
}

function blockOf({ thing, group }: ThingsView['placed'][number]): Block {
  const box = new Box3();
  for (const p of thing.parts) box.union(new Box3().setFromArray(p.positions));
  return { box, position: group.position, turn: group.quaternion };
}

export class Scales {
  private message: Masses | null = null;
  private weighed = '';
  /** kg, by piece of the page. */
  private masses: number[] = [];
  private blocks: (Block & { tray: boolean })[] = [];

  constructor(
    private readonly mesh: BodyMesh,
    private readonly pieces: Pieces,
    private readonly things: ThingsView,
  ) {}

  take(m: Masses): void {
    this.message = { ...m, mass: m.mass.slice(), copy: m.copy.slice() };
    this.weighed = '';
  }

  /** kg by piece; null while nobody knows: in a cut. */
  private now(): number[] | null {
    const s = this.mesh.state,
      m = this.message;
    if (!s || !m || m.body !== s.body || m.version !== s.version || !(m.uncut > 0)) return null;
    const at = `${s.body} ${s.version}`;
    if (at !== this.weighed) {
      this.pieces.update(s);
      this.masses = Array.from({ length: this.pieces.count }, () => 0);
      m.copy.forEach((copy, i) => {
        const piece = copy < s.nc ? this.pieces.of(s, copy) : -1;
        if (piece >= 0) this.masses[piece]! += m.mass[i]!;
      });
      this.weighed = at;
    }
    return this.masses;
  }
  private weight(mass: number): Weight {
    return { mass, share: mass / this.message!.uncut };
  }

  /** The heaviest first. */
  list(): Weight[] | null {
    return (
      this.now()
        ?.filter((m) => m > 0)
        .sort((a, b) => b - a)
        .map((m) => this.weight(m)) ?? null
    );
  }
  /** Of the piece that a copy belongs to. */
  of(copy: number): Weight | null {
    const masses = this.now(),
      s = this.mesh.state;
    const piece = masses && s && copy < s.nc ? this.pieces.of(s, copy) : -1;
    return piece >= 0 ? this.weight(masses![piece]!) : null;
  }

  /** The corners of all trays' tops. */
  tops(up: Vector3): Vector3[] {
    return this.things.placed
      .filter(({ thing, placed }) => placed && isTray(thing))
      .flatMap((p) => topOf(blockOf(p), up));
  }
  /** What lies on each tray of the scene, and the corners of its top. `up`: a unit vector; `size`: of the body, metres. */
  trays(up: Vector3, size: number): { top: Vector3[]; on: Weight | null }[] {
    this.blocks = this.things.placed
      .filter(({ thing }) => !thing.tool && (thing.shape === 'box' || isTray(thing)))
      .map((p) => ({ tray: isTray(p.thing), ...blockOf(p) }));
    const trays = this.blocks.filter((b) => b.tray);
    if (trays.length === 0) return [];
    const s = this.mesh.state,
      masses = this.now();
    const places = s && masses ? this.pieces.places(s, this.mesh.cells.pose) : [];
    return trays.map((tray) => {
      const lies = liesOn(tray, places, kNear * size, up);
      const mass = masses?.reduce((sum, m, i) => (lies[i] ? sum + m : sum), 0);
      return { top: topOf(tray, up), on: mass === undefined ? null : this.weight(mass) };
    });
  }

  /** Whether a place of a tray's top is seen from above it, and no box of the scene hides it; boxes are those of the last `trays`. */
  sees(eye: Vector3, place: Vector3, up: Vector3): boolean {
    const away = eye.clone().sub(place);
    return away.dot(up) > kAlong * away.length() && !this.blocks.some((b) => hides(b, eye, place));
  }
}
