// What lite's shaders read of a body: places and normals as they are now, and the triangles that show their front to the eye and
// their back to the sun, which are what a closed body's picture and shadow need.
//
//   index of skin, of walls:   | seen by the eye ...  free | casting a shadow ...  free |
import { BufferAttribute, DynamicDrawUsage, type BufferGeometry, type Mesh } from 'three';
import type { BodyState } from './body_state';
import { facing, placeVertices, turnNormals, type CellTexels, type Viewpoint } from './placed';

/** From where a picture is seen and lit. */
export interface Sight {
  eye: Viewpoint;
  sun: Viewpoint;
  shadows: boolean;
}

interface Part {
  triangles: Uint32Array;
  count: number;
}

/** The triangles of a mesh for its two passes, in one buffer. */
class Chosen {
  readonly index: BufferAttribute;
  private readonly room: number;
  private readonly counts = { seen: 0, casting: 0 };

  constructor(mesh: Mesh, geometry: BufferGeometry, room: number) {
    this.room = room;
    this.index = new BufferAttribute(new Uint32Array(2 * room), 1).setUsage(DynamicDrawUsage);
    geometry.setIndex(this.index);
    mesh.onBeforeShadow = () => geometry.setDrawRange(this.room, 3 * this.counts.casting);
    mesh.onAfterShadow = () => geometry.setDrawRange(0, 3 * this.counts.seen);
  }

  choose(geometry: BufferGeometry, part: Part, place: Float32Array, sight: Sight, open: boolean): void {
    const { index, room, counts } = this,
      all = index.array as Uint32Array;
    const take = (to: number, from: Viewpoint, side: 1 | -1): number =>
      facing(part.triangles, part.count, place, from, open ? 0 : side, all.subarray(to, to + room));
    counts.seen = take(0, sight.eye, 1);
    if (sight.shadows) counts.casting = take(room, sight.sun, -1);
    const owed = sight.shadows || index.updateRanges.some((r) => r.start === room);
    send(index, [
      { start: 0, count: 3 * counts.seen },
      { start: room, count: owed ? 3 * counts.casting : 0 },
    ]);
    geometry.setDrawRange(0, 3 * counts.seen);
  }

  markSeen(wanted: Uint8Array): void {
    const all = this.index.array;
    for (let i = 0; i < 3 * this.counts.seen; i++) wanted[all[i]!] = 1;
  }
}

export class PlacedMesh {
  private readonly place: BufferAttribute;
  private readonly turned: BufferAttribute;
  private readonly wanted: Uint8Array;
  private readonly chosen: Chosen[];
  private stale = true;
  private eye: Viewpoint = { x: NaN, y: NaN, z: NaN, w: 1 };

  /** Gives the geometries of both meshes what they draw from: skin first, then walls. */
  constructor(
    private readonly state: BodyState,
    private readonly open: boolean,
    private readonly meshes: readonly Mesh[],
  ) {
    const vertices = state.copy.length;
    this.place = new BufferAttribute(new Float32Array(4 * vertices), 4).setUsage(DynamicDrawUsage);
    this.turned = new BufferAttribute(new Int16Array(4 * vertices), 4, true).setUsage(DynamicDrawUsage);
    this.wanted = new Uint8Array(vertices);
    this.chosen = meshes.map((mesh, i) => {
      mesh.geometry.setAttribute('kPlace', this.place);
      mesh.geometry.setAttribute('kTurned', this.turned);
      return new Chosen(mesh, mesh.geometry, this.parts[i]!.triangles.length);
    });
  }

  private get parts(): [Part, Part] {
    const s = this.state;
    return [
      { triangles: s.skin, count: s.ns },
      { triangles: s.wall, count: s.nw },
    ];
  }

  /** Nodes, triangles, offsets or marks changed. */
  moved(): void {
    this.stale = true;
  }

  /** Before every picture. */
  prepare(cells: CellTexels, sight: Sight): void {
    const { eye } = sight,
      old = this.eye,
      place = this.place.array as Float32Array;
    if (!this.stale && !sight.shadows && eye.x === old.x && eye.y === old.y && eye.z === old.z) return;
    if (this.stale) placeVertices(this.state, cells, place);
    this.wanted.fill(0, 0, this.state.nv);
    this.chosen.forEach((c, i) => {
      c.choose(this.meshes[i]!.geometry, this.parts[i]!, place, sight, this.open);
      c.markSeen(this.wanted);
    });
    turnNormals(this.state, cells, this.wanted, this.turned.array as Int16Array);
    const whole = [{ start: 0, count: 4 * this.state.nv }];
    if (this.stale) send(this.place, whole);
    send(this.turned, whole);
    this.eye = { ...eye };
    this.stale = false;
  }
}

/** In place of what was to be sent. WebGL takes a count of 0 for "to the end". */
function send(attribute: BufferAttribute, ranges: { start: number; count: number }[]): void {
  attribute.clearUpdateRanges();
  for (const r of ranges) if (r.count > 0) attribute.addUpdateRange(r.start, r.count);
  if (attribute.updateRanges.length > 0) attribute.needsUpdate = true;
}
