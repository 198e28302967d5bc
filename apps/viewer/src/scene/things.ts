// Obstacles and tools of the scene, and what touches: rigid meshes that are placed in every frame, forces as arrows.
import {
  Box3,
  BufferAttribute,
  BufferGeometry,
  DynamicDrawUsage,
  Group,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshBasicMaterial,
  MeshLambertMaterial,
  MeshPhongMaterial,
  MeshPhysicalMaterial,
  MeshStandardMaterial,
  Points,
  PointsMaterial,
  Quaternion,
  Vector3,
  type Material,
} from 'three';
import { toCreasedNormals } from 'three/examples/jsm/utils/BufferGeometryUtils.js';
import { ContactWith, kContactFloats, kPlaceFloats, kToolFloats } from '../engine/protocol';
import type { Thing, ThingPart } from '../engine/things';
import { isTray } from './scales';
import { kFilm } from './looks';
import type { Look, QualityLevel } from './materials';
import { kBehindBodies } from './stage';
import { readShadowOnce, shadowFromBelow } from './soft_shadow';
import type { Vec3 } from '../engine/protocol';

interface Jaw {
  group: Group;
  side: number;
}
interface Shown {
  thing: Thing;
  group: Group;
  jaws: Jaw[];
  placed: boolean; // it has been where it belongs; whether it is seen is another matter
}

const kMostContacts = 2000;
const kCrease = 1.1; // radians: edges that turn less are shaded smooth
/** Linear light, by what touches. */
export const kContactColours: Record<number, [number, number, number]> = {
  [ContactWith.Obstacle]: [0.1, 0.45, 0.95],
  [ContactWith.Tool]: [0.98, 0.55, 0.05],
  [ContactWith.Body]: [0.75, 0.15, 0.75],
};

function geometryOf(part: ThingPart): BufferGeometry {
  const g = new BufferGeometry();
  g.setAttribute('position', new BufferAttribute(part.positions, 3));
  g.setIndex(new BufferAttribute(part.triangles, 1));
  const creased = toCreasedNormals(g, kCrease);
  g.dispose();
  return creased;
}

const kWetCartilage = 1.5; // of the mirrored window, in units of white
const kPearl = 0.3; // light that has wandered through cartilage, where one looks along it

// Cartilage is bluish white where it is thick, and lets light through at its edges; a film on it mirrors the window.
const kCartilage = /* glsl */ `
{
  vec3 eye = normalize(vViewPosition);
  float along = 1.0 - clamp(dot(eye, normal), 0.0, 1.0);
  totalEmissiveRadiance += ${kPearl.toFixed(2)} * uWindow * along * along * vec3(0.42, 0.47, 0.50);
#ifdef KERF_ONE_READ
  totalEmissiveRadiance += ${kWetCartilage.toFixed(2)} * uWindow * kFresnel(dot(eye, normal)) * kWindow(kInWorld(reflect(-eye, normal)));
#endif
}`;

/** Bone under cartilage: pale, smooth and wet. */
function cartilage(lite: boolean): Material {
  const color = 0xbdb8a6,
    material = lite
      ? readShadowOnce(new MeshPhongMaterial({ color, specular: 0x3a3a3a, shininess: 60 }))
      : new MeshPhysicalMaterial({ color, roughness: 0.55, clearcoat: 0.8, clearcoatRoughness: 0.22, ior: 1.4 });
  material.onBeforeCompile = (shader) => {
    shader.fragmentShader = shader.fragmentShader
      .replace('#include <common>', `#include <common>\nuniform float uWindow;\n${kFilm}`)
      .replace('#include <emissivemap_fragment>', `#include <emissivemap_fragment>\n${kCartilage}`);
  };
  material.customProgramCacheKey = () => 'kerf-cartilage';
  return material;
}

const kRim = 0.05; // of a tray's longest side: wider is no rim, narrower is no line from afar
const kLine = 0.4; // of the rim

// A tray of steel: a bright rim, a groove along it, and a floor. On a face, the middle one of the distances to the sides is that to its edge.
const kDish = /* glsl */ `
{
  vec3 q = uHalf - abs(vPlace - uMiddle);
  float edge = max(min(q.x, q.y), min(max(q.x, q.y), q.z)) / uRim;
  float floorOf = smoothstep(1.0, 1.0 + ${kLine.toFixed(1)}, edge);
  float groove = smoothstep(1.0 - ${kLine.toFixed(1)}, 1.0, edge) * (1.0 - smoothstep(1.0, 2.5, edge));
  diffuseColor.rgb *= mix(1.0, 0.86, floorOf) * (1.0 - 0.5 * groove);
}`;

/** `parts`: of one tray. */
function steelTray(lite: boolean, parts: readonly ThingPart[]): Material {
  const box = new Box3();
  for (const p of parts) box.union(new Box3().setFromArray(p.positions));
  const half = box.getSize(new Vector3()).multiplyScalar(0.5);
  const color = 0xcdd5da,
    material = lite
      ? readShadowOnce(new MeshLambertMaterial({ color }))
      : new MeshStandardMaterial({ color, roughness: 0.36, metalness: 0.25 });
  material.onBeforeCompile = (shader) => {
    shader.uniforms.uMiddle = { value: box.getCenter(new Vector3()) };
    shader.uniforms.uHalf = { value: half };
    shader.uniforms.uRim = { value: 2 * kRim * Math.max(half.x, half.y, half.z) };
    shader.vertexShader = shader.vertexShader
      .replace('#include <common>', '#include <common>\nvarying vec3 vPlace;')
      .replace('void main() {', 'void main() {\n\tvPlace = position;');
    shader.fragmentShader = shader.fragmentShader
      .replace(
        '#include <common>',
        '#include <common>\nuniform vec3 uMiddle, uHalf;\nuniform float uRim;\nvarying vec3 vPlace;',
      )
      .replace('#include <color_fragment>', `#include <color_fragment>\n${kDish}`);
  };
  material.customProgramCacheKey = () => 'kerf-tray';
  return material;
}

/** Bone above what is operated on, which hides it from everywhere but within the joint. */
const isAbove = (thing: Thing): boolean => thing.name === 'femur';

export interface ThingPose {
  position: Vec3;
  quaternion: readonly [number, number, number, number];
}
export interface ToolReading {
  pose: ThingPose;
  place: ThingPose;
  jaws: number;
  force: Vec3;
  torque: Vec3;
}

export class ThingsView {
  readonly group = new Group();
  /** Height of a level plane that carries everything: the stage puts its ground there. */
  floor: number | null = null;
  tools: ToolReading[] = [];
  touching = 0;
  press = 0;
  showContacts = false;
  private within = false;
  private shown: Shown[] = [];
  private ghosts: Shown[] = [];
  private readonly solid = new Group();
  private readonly ghostGroup = new Group();
  private readonly contactLines: LineSegments;
  private readonly contactPoints: Points;
  private readonly linePositions = new Float32Array(12 * kMostContacts);
  private readonly lineColours = new Float32Array(12 * kMostContacts);
  private readonly pointPositions = new Float32Array(3 * kMostContacts);
  private readonly pointColours = new Float32Array(3 * kMostContacts);
  private materials: Material[] = [];
  private size = 0.2;
  private largest = 0; // of the forces drawn lately, N: arrows keep their scale

  constructor() {
    const attribute = (a: Float32Array): BufferAttribute => new BufferAttribute(a, 3).setUsage(DynamicDrawUsage);
    const lines = new BufferGeometry(),
      points = new BufferGeometry();
    lines.setAttribute('position', attribute(this.linePositions));
    lines.setAttribute('color', attribute(this.lineColours));
    points.setAttribute('position', attribute(this.pointPositions));
    points.setAttribute('color', attribute(this.pointColours));
    this.contactLines = new LineSegments(
      lines,
      new LineBasicMaterial({ vertexColors: true, depthTest: false, transparent: true, toneMapped: false }),
    );
    this.contactPoints = new Points(
      points,
      new PointsMaterial({
        vertexColors: true,
        size: 6,
        sizeAttenuation: false,
        depthTest: false,
        transparent: true,
        toneMapped: false,
      }),
    );
    for (const o of [this.contactLines, this.contactPoints]) {
      o.frustumCulled = false;
      o.renderOrder = 5;
      o.geometry.setDrawRange(0, 0);
    }
    this.group.add(this.solid, this.ghostGroup, this.contactLines, this.contactPoints);
  }

  get list(): readonly Thing[] {
    return this.shown.map((s) => s.thing);
  }
  /** Things with where they are. */
  get placed(): readonly { thing: Thing; group: Group; placed: boolean }[] {
    return this.shown;
  }
  /** All are where they belong: a frame has said so. */
  get allPlaced(): boolean {
    return this.shown.every((s) => s.placed);
  }
  get toolCount(): number {
    return this.tools.length;
  }
  get any(): boolean {
    return this.shown.length > 0;
  }

  /** New things; nothing is placed yet. `wood`: the stage's own board; `shaded` gives obstacles the body's shade and light. */
  set(
    things: Thing[],
    size: number,
    look: Look,
    level: QualityLevel,
    wood: Material,
    shaded: (m: Material) => Material,
  ): void {
    this.clear();
    this.size = size;
    const lite = level === 'lite';
    const make = (color: number, roughness: number, metalness: number): Material =>
      lite
        ? readShadowOnce(new MeshLambertMaterial({ color }))
        : new MeshStandardMaterial({ color, roughness, metalness });
    const steel = make(lite ? 0xb4bbc2 : 0xb9c1c8, 0.34, 0.5),
      jaw = make(lite ? 0xcdd3d8 : 0xc9d0d6, 0.28, 0.5);
    const obstacle =
      look === 'meniscus'
        ? shadowFromBelow(shaded(cartilage(lite)))
        : look === 'steak'
          ? wood
          : shaded(make(0x5d7f99, 0.55, 0.05));
    const ball = look === 'steak' ? make(0x6b7a86, 0.5, 0.1) : obstacle;
    const ghost = new MeshBasicMaterial({ color: 0xffffff, transparent: true, opacity: 0.28, depthWrite: false });
    this.materials = [steel, jaw, ball, ghost, ...(obstacle === wood ? [] : [obstacle])];
    this.floor = null;
    for (const thing of things) {
      const tray = isTray(thing) ? shadowFromBelow(shaded(steelTray(lite, thing.parts))) : null;
      if (tray) this.materials.push(tray);
      const material = tray ?? (thing.tool ? steel : thing.shape === 'box' ? obstacle : ball);
      this.shown.push(this.build(thing, material, jaw, this.solid, true));
      if (thing.tool) this.ghosts.push(this.build(thing, ghost, ghost, this.ghostGroup, false));
    }
  }

  private build(thing: Thing, material: Material, jaw: Material, into: Group, shadows: boolean): Shown {
    const group = new Group(),
      jaws: Jaw[] = [];
    for (const part of thing.parts) {
      const mesh = new Mesh(geometryOf(part), part.side === 0 ? material : jaw);
      mesh.castShadow = mesh.receiveShadow = shadows;
      if (!thing.tool && shadows) mesh.renderOrder = kBehindBodies;
      if (part.side === 0) {
        group.add(mesh);
        continue;
      }
      // A jaw turns about the hinge.
      const hinge = new Group();
      hinge.position.set(0, 0, thing.hinge);
      mesh.position.set(0, 0, -thing.hinge);
      hinge.add(mesh);
      group.add(hinge);
      jaws.push({ group: hinge, side: part.side });
    }
    group.visible = false;
    into.add(group);
    return { thing, group, jaws, placed: false };
  }

  private clear(): void {
    for (const s of [...this.shown, ...this.ghosts]) {
      s.group.traverse((o) => {
        if (o instanceof Mesh) (o.geometry as BufferGeometry).dispose();
      });
      s.group.removeFromParent();
    }
    for (const m of this.materials) m.dispose();
    this.materials = [];
    this.shown = [];
    this.ghosts = [];
    this.tools = [];
    this.largest = 0;
    this.contactLines.geometry.setDrawRange(0, 0);
    this.contactPoints.geometry.setDrawRange(0, 0);
  }

  /** Seen from within the joint: through the arthroscope. */
  set inJoint(on: boolean) {
    this.within = on;
    this.show();
  }
  /** Seen from under the ground: what bodies lie on would hide them, as the ground does. */
  set fromBelow(on: boolean) {
    if (on === this.below) return;
    this.below = on;
    this.show();
  }
  private below = false;
  private isSeen(s: Shown): boolean {
    return s.placed && (!isAbove(s.thing) || this.within) && !(this.below && s.thing.shape === 'box');
  }
  private show(): void {
    for (const s of this.shown) if (s.thing.shape !== 'plane') s.group.visible = this.isSeen(s);
  }

  /** Places as a frame says. True when something moved. */
  place(places: Float32Array, tools: Float32Array): boolean {
    const n = this.shown.length,
      nt = tools.length / kToolFloats;
    if (places.length !== kPlaceFloats * n) return false;
    let moved = false;
    const put = (s: Shown, p: Float32Array, jaws: number): void => {
      const g = s.group;
      if (
        !s.placed ||
        g.position.x !== p[0] ||
        g.position.y !== p[1] ||
        g.position.z !== p[2] ||
        g.quaternion.x !== p[3] ||
        g.quaternion.y !== p[4] ||
        g.quaternion.z !== p[5] ||
        g.quaternion.w !== p[6]
      )
        moved = true;
      g.position.set(p[0]!, p[1]!, p[2]!);
      g.quaternion.set(p[3]!, p[4]!, p[5]!, p[6]!);
      if (!s.placed) {
        s.placed = true;
        g.visible = this.isSeen(s);
      }
      for (const j of s.jaws) {
        const angle = (j.side * jaws * s.thing.opening) / 2;
        if (j.group.rotation.y !== angle) moved = true;
        j.group.rotation.y = angle;
      }
    };
    const pose = (a: Float32Array): ThingPose => ({
      position: [a[0]!, a[1]!, a[2]!],
      quaternion: [a[3]!, a[4]!, a[5]!, a[6]!],
    });
    this.floor = null;
    const up = new Vector3(),
      turn = new Quaternion();
    this.shown.forEach((s, i) => {
      const p = places.subarray(kPlaceFloats * i, kPlaceFloats * (i + 1));
      put(s, p, p[7]!);
      if (s.thing.shape !== 'plane') return;
      up.set(0, 0, 1).applyQuaternion(turn.set(p[3]!, p[4]!, p[5]!, p[6]!));
      s.group.visible = up.z < 1 - 1e-6;
      if (!s.group.visible) this.floor = Math.max(this.floor ?? -Infinity, p[2]!); // the ground is drawn there
    });
    this.tools = [];
    for (let i = 0; i < nt; i++) {
      const t = tools.subarray(kToolFloats * i, kToolFloats * (i + 1));
      const p = places.subarray(kPlaceFloats * (n - nt + i), kPlaceFloats * (n - nt + i + 1));
      this.tools.push({
        pose: pose(t),
        place: pose(p),
        jaws: p[7]!,
        force: [t[7]!, t[8]!, t[9]!],
        torque: [t[10]!, t[11]!, t[12]!],
      });
      const ghost = this.ghosts[i];
      if (!ghost) continue;
      put(ghost, t, p[7]!);
      // The ghost shows where the hand is when the tool can't follow.
      const apart = Math.hypot(t[0]! - p[0]!, t[1]! - p[1]!, t[2]! - p[2]!);
      const seen = apart > 0.004 * this.size;
      if (ghost.group.visible !== seen) moved = true;
      ghost.group.visible = seen;
    }
    return moved;
  }

  /** Contacts of a frame: points, normals and force arrows. */
  setContacts(contacts: Float32Array, partners: Uint32Array, touching: number, press: number): boolean {
    this.touching = touching;
    this.press = press;
    const n = this.showContacts ? Math.min(kMostContacts, partners.length) : 0;
    const had = this.contactPoints.geometry.drawRange.count;
    if (n === 0 && had === 0) return false;
    let strongest = 0;
    for (let i = 0; i < n; i++)
      strongest = Math.max(
        strongest,
        Math.hypot(
          contacts[kContactFloats * i + 6]!,
          contacts[kContactFloats * i + 7]!,
          contacts[kContactFloats * i + 8]!,
        ),
      );
    this.largest = Math.max(strongest, 0.97 * this.largest);
    const scale = this.largest > 0 ? (0.16 * this.size) / this.largest : 0,
      tick = 0.012 * this.size;
    for (let i = 0; i < n; i++) {
      const c = contacts.subarray(kContactFloats * i, kContactFloats * (i + 1)),
        kind = partners[i]! & 15;
      const [r, g, b] = kContactColours[kind] ?? [0.5, 0.5, 0.5],
        dim = (partners[i]! & ContactWith.Sliding) !== 0 ? 0.6 : 1;
      for (let k = 0; k < 3; k++) {
        const p = c[k]!;
        this.pointPositions[3 * i + k] = p;
        this.linePositions[12 * i + k] = this.linePositions[12 * i + 6 + k] = p;
        this.linePositions[12 * i + 3 + k] = p + tick * c[3 + k]!;
        this.linePositions[12 * i + 9 + k] = p + scale * c[6 + k]!;
      }
      for (let v = 0; v < 4; v++) {
        const arrow = v >= 2,
          o = 12 * i + 3 * v;
        this.lineColours[o] = arrow ? r * dim : 0.15;
        this.lineColours[o + 1] = arrow ? g * dim : 0.15;
        this.lineColours[o + 2] = arrow ? b * dim : 0.15;
      }
      this.pointColours.set([r * dim, g * dim, b * dim], 3 * i);
    }
    for (const [object, count] of [
      [this.contactLines, 4 * n],
      [this.contactPoints, n],
    ] as const) {
      object.geometry.setDrawRange(0, count);
      for (const name of ['position', 'color']) object.geometry.getAttribute(name).needsUpdate = true;
    }
    return true;
  }
}
