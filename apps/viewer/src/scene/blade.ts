// The tools as one sees them: blade, forceps, pin, and the ring that shows where they would touch.
import {
  BufferAttribute,
  BufferGeometry,
  CapsuleGeometry,
  CircleGeometry,
  CylinderGeometry,
  ExtrudeGeometry,
  Group,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshBasicMaterial,
  MeshStandardMaterial,
  Path,
  RingGeometry,
  Shape,
  SphereGeometry,
  Vector3,
  DoubleSide,
  Quaternion,
  Matrix4,
  InstancedMesh,
  type Material,
} from 'three';
import { Presence } from './presence';
import type { ToolName } from '../tools/tools';

// Of an instrument's length: so far a shaft goes on where one looks from within a joint. Four times the eye's distance: it leaves the picture
// or goes into what is around.
const kShaft = 14;
/** Of the view's distance: an instrument looks no larger than it does where a scene opens. */
const kMostOfDistance = 0.53;

/** Instruments are modelled 1 unit long, tip at the origin, pointing down. */
function scalpel(steel: MeshStandardMaterial, grip: MeshStandardMaterial): Group {
  const g = new Group();
  const s = new Shape();
  s.moveTo(0, 0);
  s.bezierCurveTo(0.03, 0.03, 0.058, 0.085, 0.06, 0.155);
  s.lineTo(0.048, 0.215);
  s.lineTo(-0.012, 0.215);
  s.bezierCurveTo(-0.014, 0.13, -0.012, 0.06, 0, 0);
  const slot = new Path();
  slot.absellipse(0.02, 0.165, 0.007, 0.03, 0, Math.PI * 2);
  s.holes.push(slot);
  const blade = new Mesh(
    new ExtrudeGeometry(s, {
      depth: 0.004,
      bevelEnabled: true,
      bevelSize: 0.002,
      bevelThickness: 0.002,
      bevelSegments: 1,
      curveSegments: 10,
    }),
    steel,
  );
  blade.position.z = -0.002;
  const h = new Shape();
  h.moveTo(-0.004, 0.2);
  h.lineTo(0.038, 0.2);
  h.bezierCurveTo(0.05, 0.3, 0.034, 0.55, 0.04, 0.98);
  h.quadraticCurveTo(0.018, 1.01, -0.004, 0.98);
  h.bezierCurveTo(0.002, 0.6, -0.012, 0.32, -0.004, 0.2);
  const handle = new Mesh(
    new ExtrudeGeometry(h, {
      depth: 0.01,
      bevelEnabled: true,
      bevelSize: 0.005,
      bevelThickness: 0.006,
      bevelSegments: 3,
      curveSegments: 12,
    }),
    grip,
  );
  handle.position.z = -0.005;
  g.add(blade, handle);
  g.rotation.x = Math.PI / 2; // y of the shapes is up
  return wrap(g);
}

function forceps(steel: MeshStandardMaterial): Group {
  const g = new Group();
  for (const side of [-1, 1]) {
    const arm = new Mesh(new CylinderGeometry(0.02, 0.006, 0.9, 10), steel);
    arm.position.set(side * 0.04, 0, 0.45);
    arm.rotation.set(Math.PI / 2, 0, side * -0.055);
    arm.rotation.order = 'ZYX';
    g.add(arm);
  }
  return wrap(g);
}

function pin(head: MeshStandardMaterial, steel: MeshStandardMaterial): Group {
  const g = new Group();
  const needle = new Mesh(new CylinderGeometry(0.006, 0.001, 0.22, 8), steel);
  needle.rotation.x = Math.PI / 2;
  needle.position.z = 0.11;
  const ball = new Mesh(new SphereGeometry(0.034, 18, 12), head);
  ball.position.z = 0.24;
  g.add(needle, ball);
  return wrap(g);
}

/** A tube with a rounded end, as punches, shavers and suction tubes have. */
function tube(steel: MeshStandardMaterial, grip: MeshStandardMaterial, radius: number): Group {
  const g = new Group();
  const shaft = new Mesh(new CapsuleGeometry(radius, 0.62, 6, 16), steel);
  shaft.rotation.x = Math.PI / 2;
  shaft.position.z = 0.31 + radius;
  const handle = new Mesh(new CylinderGeometry(2.1 * radius, 1.6 * radius, 0.34, 18), grip);
  handle.rotation.x = Math.PI / 2;
  handle.position.z = 0.82;
  g.add(shaft, handle);
  return wrap(g);
}

function scissors(steel: MeshStandardMaterial, grip: MeshStandardMaterial): Group {
  const g = new Group();
  for (const side of [-1, 1]) {
    const s = new Shape();
    s.moveTo(0, 0);
    s.quadraticCurveTo(0.034, 0.1, 0.024, 0.3);
    s.lineTo(-0.006, 0.3);
    s.lineTo(-0.004, 0.04);
    s.closePath();
    const blade = new Mesh(
      new ExtrudeGeometry(s, {
        depth: 0.005,
        bevelEnabled: true,
        bevelSize: 0.002,
        bevelThickness: 0.002,
        bevelSegments: 1,
      }),
      steel,
    );
    blade.scale.x = side;
    blade.rotation.set(Math.PI / 2, 0, 0);
    const half = new Group();
    half.add(blade);
    half.rotation.y = side * -0.14;
    half.position.y = side * 0.003;
    g.add(half);
  }
  const shaft = new Mesh(new CylinderGeometry(0.022, 0.018, 0.66, 14), grip);
  shaft.rotation.x = Math.PI / 2;
  shaft.position.z = 0.62;
  g.add(shaft);
  return wrap(g);
}

function wrap(inner: Group): Group {
  const g = new Group();
  g.add(inner);
  g.traverse((o) => {
    if (o instanceof Mesh) o.castShadow = true;
  });
  return g;
}

/** What goes on behind instruments: radius, where it begins, and how far beside the middle. */
const kShafts = [
  ['scalpel', 0.02, 0.95, 0.018],
  ['forceps', 0.085, 0.85, 0],
  ['punch', 0.0273, 0.98, 0],
  ['scissors', 0.022, 0.9, 0],
  ['shaver', 0.021, 0.98, 0],
  ['suction', 0.0357, 0.98, 0],
] as const;

export class Blade {
  readonly group = new Group();
  private readonly steel = new MeshStandardMaterial({ color: 0xcfd6dc, metalness: 0.55, roughness: 0.28 });
  private readonly grip = new MeshStandardMaterial({ color: 0x8b98a4, metalness: 0.5, roughness: 0.38 });
  private readonly red = new MeshStandardMaterial({ color: 0xc02030, roughness: 0.35 });
  private readonly green = new MeshStandardMaterial({ color: 0x2a9a58, roughness: 0.35 });
  private readonly metals = [this.steel, this.grip].map((m) => [m, m.metalness] as const);
  private readonly instruments: Record<
    'scalpel' | 'forceps' | 'fix' | 'release' | 'punch' | 'scissors' | 'shaver' | 'suction',
    Group
  >;
  /** Where a sized instrument works: a circle as wide as its bite, or the line along which scissors close. */
  private readonly bite: Mesh;
  private readonly disc: Mesh;
  private readonly closing: LineSegments;
  /** Of the instrument, metres; 0: it has none. */
  bites = 0;
  private readonly ring: Mesh;
  private readonly graspLines: LineSegments;
  private readonly graspBalls: InstancedMesh;
  private size = 0.26;
  private tool: ToolName = 'scalpel';
  private readonly presence = new Presence();
  /** What fades, and how opaque it is when all of it is there. */
  private readonly fading: [Material, number][];
  readonly tip = new Vector3();
  readonly normal = new Vector3(0, 0, 1);
  private readonly shafts: Mesh[] = [];
  private readonly heading = new Vector3(1, 0, 0);
  private readonly lastPoint = new Vector3(NaN, 0, 0);

  constructor() {
    this.instruments = {
      scalpel: scalpel(this.steel, this.grip),
      forceps: forceps(this.steel),
      fix: pin(this.red, this.steel),
      release: pin(this.green, this.steel),
      punch: tube(this.steel, this.grip, 0.013),
      scissors: scissors(this.steel, this.grip),
      shaver: tube(this.steel, this.grip, 0.01),
      suction: tube(this.steel, this.grip, 0.017),
    };
    for (const [name, radius, from, aside] of kShafts) {
      const shaft = new Mesh(new CylinderGeometry(radius, radius, kShaft, 14), this.grip);
      shaft.rotation.x = Math.PI / 2;
      shaft.position.set(aside, 0, from + kShaft / 2);
      shaft.visible = false;
      this.instruments[name].add(shaft);
      this.shafts.push(shaft);
    }
    this.ring = new Mesh(
      new RingGeometry(0.78, 1, 40),
      new MeshBasicMaterial({
        color: 0xffffff,
        transparent: true,
        opacity: 0.85,
        side: DoubleSide,
        depthTest: false,
        toneMapped: false,
      }),
    );
    this.ring.renderOrder = 5;
    const flat = (colour: number, opacity: number): MeshBasicMaterial =>
      new MeshBasicMaterial({
        color: colour,
        transparent: true,
        opacity,
        side: DoubleSide,
        depthTest: false,
        depthWrite: false,
        toneMapped: false,
      });
    this.bite = new Mesh(new RingGeometry(0.94, 1, 64), flat(0xffffff, 0.9));
    this.disc = new Mesh(new CircleGeometry(0.94, 48), flat(0x101820, 0.16));
    this.closing = new LineSegments(
      new BufferGeometry().setAttribute(
        'position',
        new BufferAttribute(new Float32Array([0, 0, 0, 1, 0, 0, 1, -0.08, 0, 1, 0.08, 0]), 3),
      ),
      new LineBasicMaterial({ color: 0xffffff, transparent: true, opacity: 0.95, depthTest: false, toneMapped: false }),
    );
    for (const o of [this.bite, this.closing]) o.renderOrder = 5;
    this.disc.renderOrder = 4;
    for (const o of [this.bite, this.disc, this.closing]) o.frustumCulled = false;
    this.graspLines = new LineSegments(
      new BufferGeometry(),
      new LineBasicMaterial({ color: 0xffffff, transparent: true, opacity: 0.8, depthTest: false, toneMapped: false }),
    );
    this.graspBalls = new InstancedMesh(new CapsuleGeometry(1, 0.01, 4, 12), this.green.clone(), 64);
    this.graspBalls.count = 0;
    this.graspBalls.frustumCulled = this.graspLines.frustumCulled = false;
    this.graspLines.renderOrder = 4;
    this.group.add(
      ...Object.values(this.instruments),
      this.ring,
      this.bite,
      this.disc,
      this.closing,
      this.graspLines,
      this.graspBalls,
    );
    // Always transparent: a material that becomes so is compiled anew.
    for (const m of [this.steel, this.grip, this.red, this.green]) m.transparent = true;
    this.fading = [
      ...[this.steel, this.grip, this.red, this.green],
      ...[this.ring, this.bite, this.disc, this.closing].map((o) => o.material as Material),
    ].map((m) => [m, m.opacity]);
    this.hide();
  }

  setSize(size: number): void {
    this.size = size;
  }
  /** Lite has no surroundings for metal to mirror: it would be black. */
  setLite(lite: boolean): void {
    for (const [m, metal] of this.metals) m.metalness = lite ? 0 : metal;
  }
  /** Seen from within a joint, instruments come in from outside. */
  set inJoint(on: boolean) {
    for (const shaft of this.shafts) shaft.visible = on;
  }
  setTool(tool: ToolName): void {
    this.tool = tool;
  }
  get visible(): boolean {
    return this.ring.visible || this.bite.visible || Object.values(this.instruments).some((g) => g.visible);
  }

  hide(): boolean {
    const was = this.visible;
    for (const g of Object.values(this.instruments)) g.visible = false;
    this.ring.visible = this.bite.visible = this.disc.visible = this.closing.visible = false;
    this.lastPoint.x = NaN;
    this.presence.end();
    return was;
  }
  /** The pointer is elsewhere. True when there is something to fade. */
  leave(): boolean {
    return this.visible && (this.presence.go() || this.hide());
  }
  /** Comes or goes on at this time (ms); true when the picture changed. */
  animate(now: number): boolean {
    if (!this.presence.at(now)) return false;
    this.shade();
    if (this.presence.level === 0) this.hide();
    return true;
  }
  private shade(): void {
    for (const [m, opacity] of this.fading) m.opacity = opacity * this.presence.level;
  }
  /** How much of it is there: 0 to 1. */
  get level(): number {
    return this.visible ? this.presence.level : 0;
  }

  /** Places the instrument; `touching`: the point is on the body, otherwise only near it; `own`: not one of the scene's, which is drawn already. */
  place(point: Vector3, normal: Vector3, eye: Vector3, touching: boolean, pressed: boolean, own = true): void {
    this.hideInstruments();
    if (this.tool === 'hand' || this.tool === 'rigid') {
      this.hide();
      return;
    }
    this.presence.come(pressed);
    this.shade();
    this.tip.copy(point);
    this.normal.copy(normal);
    const size = Math.min(this.size, kMostOfDistance * eye.distanceTo(point));
    const cutting = this.tool === 'scalpel' || this.tool === 'line' || this.tool === 'closed';
    const tool = this.tool,
      held = tool === 'grasp' || tool === 'take';
    const g =
      tool === 'scalpel' || tool === 'line' || tool === 'closed'
        ? this.instruments.scalpel
        : held
          ? this.instruments.forceps
          : tool === 'fix' || tool === 'release'
            ? this.instruments[tool]
            : tool === 'probe' || !own
              ? null
              : this.instruments[tool];
    if (Number.isFinite(this.lastPoint.x)) {
      const step = point.clone().sub(this.lastPoint);
      step.addScaledVector(normal, -step.dot(normal));
      // Forceps that hold do not turn in the hand.
      if (step.length() > 0.004 * this.size && !(held && pressed)) {
        this.heading.lerp(step.normalize(), 0.35);
        if (this.heading.lengthSq() < 1e-6) this.heading.set(1, 0, 0);
        this.heading.normalize();
        this.lastPoint.copy(point);
      }
    } else {
      this.lastPoint.copy(point);
    }
    // The handle leans back along the stroke and away from the eye, so that the tip can be seen.
    const view = eye.clone().sub(point).normalize();
    const axis = normal.clone();
    if (cutting) axis.addScaledVector(this.heading, -0.75);
    else axis.addScaledVector(view.clone().cross(normal).normalize(), 0.5);
    axis.normalize();
    const forward = this.heading.clone();
    forward.addScaledVector(axis, -forward.dot(axis));
    if (forward.lengthSq() < 1e-8) forward.set(axis.y, -axis.x, 0);
    forward.normalize();
    const side = axis.clone().cross(forward);
    const m = new Matrix4().makeBasis(forward, side, axis);
    if (g) {
      g.quaternion.copy(new Quaternion().setFromRotationMatrix(m));
      g.scale.setScalar(size * (tool === 'fix' || tool === 'release' ? 0.75 : 0.55));
      g.position.copy(point);
      if (pressed && cutting) g.position.addScaledVector(axis, -0.03 * size);
      g.visible = true;
    }
    this.placeBite(point, normal, touching);
    this.ring.visible = touching && !this.bite.visible;
    this.ring.position.copy(point).addScaledVector(normal, 0.002 * this.size);
    this.ring.quaternion.setFromUnitVectors(new Vector3(0, 0, 1), normal);
    this.ring.scale.setScalar((pressed ? 0.01 : 0.016) * size);
  }

  private placeBite(point: Vector3, normal: Vector3, touching: boolean): void {
    const round = touching && (this.tool === 'punch' || this.tool === 'shaver' || this.tool === 'suction');
    this.bite.visible = this.disc.visible = round;
    this.closing.visible = touching && this.tool === 'scissors';
    for (const o of [this.bite, this.disc]) {
      o.position.copy(point);
      o.quaternion.setFromUnitVectors(new Vector3(0, 0, 1), normal);
      o.scale.setScalar(this.bites);
    }
    const x = this.heading.clone().addScaledVector(normal, -this.heading.dot(normal));
    if (x.lengthSq() < 1e-8) x.set(normal.y, -normal.x, 0.1);
    x.normalize();
    this.closing.quaternion.setFromRotationMatrix(new Matrix4().makeBasis(x, normal.clone().cross(x), normal));
    this.closing.position.copy(point);
    this.closing.scale.setScalar(this.bites);
  }

  private hideInstruments(): void {
    for (const g of Object.values(this.instruments)) g.visible = false;
  }

  /** Grasps: six numbers each, held point and target. True when the picture changed. */
  setGrasps(grasps: Float32Array): boolean {
    const n = Math.min(64, grasps.length / 6),
      had = this.graspBalls.count;
    if (n === 0 && had === 0) return false;
    this.graspLines.geometry.dispose();
    this.graspLines.geometry = new BufferGeometry();
    this.graspLines.geometry.setAttribute('position', new BufferAttribute(grasps.slice(), 3));
    const m = new Matrix4(),
      r = 0.012 * this.size;
    for (let i = 0; i < n; i++) {
      m.makeScale(r, r, r).setPosition(grasps[6 * i + 3]!, grasps[6 * i + 4]!, grasps[6 * i + 5]!);
      this.graspBalls.setMatrixAt(i, m);
    }
    this.graspBalls.count = n;
    this.graspBalls.instanceMatrix.needsUpdate = true;
    this.graspLines.visible = n > 0;
    return true;
  }
}
