// The tools as one sees them: blade, forceps, pin, and the ring that shows where they would touch.
import {
  BufferAttribute, BufferGeometry, CapsuleGeometry, CylinderGeometry, ExtrudeGeometry, Group, LineBasicMaterial, LineSegments,
  Mesh, MeshBasicMaterial, MeshStandardMaterial, Path, RingGeometry, Shape, SphereGeometry, Vector3, DoubleSide, Quaternion,
  Matrix4, InstancedMesh,
} from 'three';
import type { ToolName } from '../tools/tools';

/** Instruments are modelled 1 unit long, tip at the origin, pointing down. */
function scalpel(steel: MeshStandardMaterial, grip: MeshStandardMaterial): Group {
  const g = new Group();
  const s = new Shape();
  s.moveTo(0, 0);
  s.bezierCurveTo(0.030, 0.030, 0.058, 0.085, 0.060, 0.155);
  s.lineTo(0.048, 0.215);
  s.lineTo(-0.012, 0.215);
  s.bezierCurveTo(-0.014, 0.13, -0.012, 0.06, 0, 0);
  const slot = new Path();
  slot.absellipse(0.020, 0.165, 0.007, 0.030, 0, Math.PI * 2);
  s.holes.push(slot);
  const blade = new Mesh(new ExtrudeGeometry(s, { depth: 0.004, bevelEnabled: true, bevelSize: 0.002, bevelThickness: 0.002, bevelSegments: 1, curveSegments: 10 }), steel);
  blade.position.z = -0.002;
  const h = new Shape();
  h.moveTo(-0.004, 0.20);
  h.lineTo(0.038, 0.20);
  h.bezierCurveTo(0.050, 0.30, 0.034, 0.55, 0.040, 0.98);
  h.quadraticCurveTo(0.018, 1.01, -0.004, 0.98);
  h.bezierCurveTo(0.002, 0.6, -0.012, 0.32, -0.004, 0.20);
  const handle = new Mesh(new ExtrudeGeometry(h, { depth: 0.010, bevelEnabled: true, bevelSize: 0.005, bevelThickness: 0.006, bevelSegments: 3, curveSegments: 12 }), grip);
  handle.position.z = -0.005;
  g.add(blade, handle);
  g.rotation.x = Math.PI / 2; // y of the shapes is up
  return wrap(g);
}

function forceps(steel: MeshStandardMaterial): Group {
  const g = new Group();
  for (const side of [-1, 1]) {
    const arm = new Mesh(new CylinderGeometry(0.020, 0.006, 0.9, 10), steel);
    arm.position.set(side * 0.040, 0, 0.45);
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

function wrap(inner: Group): Group {
  const g = new Group();
  g.add(inner);
  g.traverse((o) => { if (o instanceof Mesh) o.castShadow = true; });
  return g;
}

export class Blade {
  readonly group = new Group();
  private readonly steel = new MeshStandardMaterial({ color: 0xcfd6dc, metalness: 0.55, roughness: 0.28 });
  private readonly grip = new MeshStandardMaterial({ color: 0x8b98a4, metalness: 0.5, roughness: 0.38 });
  private readonly red = new MeshStandardMaterial({ color: 0xc02030, roughness: 0.35 });
  private readonly green = new MeshStandardMaterial({ color: 0x2a9a58, roughness: 0.35 });
  private readonly instruments: Record<'scalpel' | 'forceps' | 'fix' | 'release', Group>;
  private readonly ring: Mesh;
  private readonly graspLines: LineSegments;
  private readonly graspBalls: InstancedMesh;
  private size = 0.26;
  private tool: ToolName = 'scalpel';
  private readonly heading = new Vector3(1, 0, 0);
  private readonly lastPoint = new Vector3(NaN, 0, 0);

  constructor() {
    this.instruments = {
      scalpel: scalpel(this.steel, this.grip), forceps: forceps(this.steel), fix: pin(this.red, this.steel), release: pin(this.green, this.steel),
    };
    this.ring = new Mesh(new RingGeometry(0.78, 1, 40), new MeshBasicMaterial({
      color: 0xffffff, transparent: true, opacity: 0.85, side: DoubleSide, depthTest: false, toneMapped: false,
    }));
    this.ring.renderOrder = 5;
    this.graspLines = new LineSegments(new BufferGeometry(), new LineBasicMaterial({ color: 0xffffff, transparent: true, opacity: 0.8, depthTest: false, toneMapped: false }));
    this.graspBalls = new InstancedMesh(new CapsuleGeometry(1, 0.01, 4, 12), this.green, 64);
    this.graspBalls.count = 0;
    this.graspBalls.frustumCulled = this.graspLines.frustumCulled = false;
    this.graspLines.renderOrder = 4;
    this.group.add(...Object.values(this.instruments), this.ring, this.graspLines, this.graspBalls);
    this.hide();
  }

  setSize(size: number): void { this.size = size; }
  setTool(tool: ToolName): void { this.tool = tool; }
  get visible(): boolean { return this.ring.visible || Object.values(this.instruments).some((g) => g.visible); }

  hide(): boolean {
    const was = this.visible;
    for (const g of Object.values(this.instruments)) g.visible = false;
    this.ring.visible = false;
    this.lastPoint.x = NaN;
    return was;
  }

  /** Places the instrument; `touching`: the point is on the body, otherwise only near it. */
  place(point: Vector3, normal: Vector3, eye: Vector3, touching: boolean, pressed: boolean): void {
    this.hideInstruments();
    if (this.tool === 'hand' || this.tool === 'rigid') { this.ring.visible = false; return; }
    const cutting = this.tool === 'scalpel' || this.tool === 'line' || this.tool === 'closed';
    const g = cutting ? this.instruments.scalpel : this.tool === 'grasp' ? this.instruments.forceps
      : this.tool === 'fix' ? this.instruments.fix : this.instruments.release;
    if (Number.isFinite(this.lastPoint.x)) {
      const step = point.clone().sub(this.lastPoint);
      step.addScaledVector(normal, -step.dot(normal));
      if (step.length() > 0.004 * this.size) {
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
    g.quaternion.copy(new Quaternion().setFromRotationMatrix(m));
    g.scale.setScalar(this.size * (cutting || this.tool === 'grasp' ? 0.55 : 0.75));
    g.position.copy(point);
    if (pressed && cutting) g.position.addScaledVector(axis, -0.03 * this.size);
    g.visible = true;
    this.ring.visible = touching;
    this.ring.position.copy(point).addScaledVector(normal, 0.002 * this.size);
    this.ring.quaternion.setFromUnitVectors(new Vector3(0, 0, 1), normal);
    this.ring.scale.setScalar((pressed ? 0.010 : 0.016) * this.size);
  }

  private hideInstruments(): void { for (const g of Object.values(this.instruments)) g.visible = false; }

  /** Grasps: six numbers each, held point and target. True when the picture changed. */
  setGrasps(grasps: Float32Array): boolean {
    const n = Math.min(64, grasps.length / 6), had = this.graspBalls.count;
    if (n === 0 && had === 0) return false;
    this.graspLines.geometry.dispose();
    this.graspLines.geometry = new BufferGeometry();
    this.graspLines.geometry.setAttribute('position', new BufferAttribute(grasps.slice(), 3));
    const m = new Matrix4(), r = 0.012 * this.size;
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
