// An arthroscope: a rigid optic that goes into a joint through one point of the skin and turns about it. It looks aside of its
// shaft, by 30 degrees mostly, so that turning it about its own axis looks around.
import { MathUtils, Quaternion, Vector3, type PerspectiveCamera } from 'three';

const kField = 78; // degrees across the round picture
export const kRound = 0.94; // of the shorter side of the window that the round picture takes
const kWidest = MathUtils.degToRad(62); // that the shaft leans away from its first direction
const kFirstDepth = 0.66;
const kUp = new Vector3(0, 0, 1);

export interface ScopePlace {
  entry: Vector3;
  target: Vector3;
  angle: number;
}

export class Arthroscope {
  private readonly entry = new Vector3();
  private readonly target = new Vector3();
  private readonly first = new Vector3(0, 0, -1);
  private reach = 1;
  private angle = Math.PI / 6;
  /** Radians that the shaft leans sideways and up, and is turned about itself (0: it looks down); insertion, 1: to the target. */
  private side = 0;
  private lift = 0;
  private roll = 0;
  private depth = kFirstDepth;

  /** `entry`: where it goes through the skin, `target`: what is looked at to begin with, metres; `angle` radians. */
  set(place: ScopePlace): void {
    this.entry.copy(place.entry);
    this.target.copy(place.target);
    this.angle = place.angle;
    const way = place.target.clone().sub(place.entry);
    this.reach = Math.max(1e-9, way.length());
    this.side = this.lift = this.roll = 0;
    this.depth = kFirstDepth;
    // The shaft is led so that the oblique view, not the shaft, points at the target to begin with.
    const lean = this.angle - Math.asin(this.depth * Math.sin(this.angle)); // law of sines: entry, tip, target
    this.first.copy(way.divideScalar(this.reach));
    this.first.applyAxisAngle(this.sideAxis(), lean);
  }

  /** Leans the shaft about the entry, radians: to the right and up as seen from outside. */
  lean(side: number, lift: number): void {
    this.side = MathUtils.clamp(this.side + side, -kWidest, kWidest);
    this.lift = MathUtils.clamp(this.lift + lift, -kWidest, kWidest);
  }
  /** Turns it about its shaft, radians. */
  turn(by: number): void {
    this.roll = MathUtils.euclideanModulo(this.roll + by + Math.PI, 2 * Math.PI) - Math.PI;
  }
  /** Pushes it in by parts of the way from entry to target. */
  push(by: number): void {
    this.depth = MathUtils.clamp(this.depth + by, 0.02, 1.35);
  }
  get turnedBy(): number {
    return this.roll;
  }

  private sideAxis(): Vector3 {
    const side = this.first.clone().cross(kUp);
    if (side.lengthSq() < 1e-6) side.set(1, 0, 0);
    return side.normalize();
  }

  shaft(): Vector3 {
    const side = this.sideAxis(),
      up = side.clone().cross(this.first).normalize();
    return this.first.clone().applyAxisAngle(side, this.lift).applyAxisAngle(up, -this.side).normalize();
  }
  tip(): Vector3 {
    return this.entry.clone().addScaledVector(this.shaft(), this.depth * this.reach);
  }
  /** From the tip to its first target, metres. */
  get way(): number {
    return this.tip().distanceTo(this.target);
  }
  /** Where it looks. */
  view(): Vector3 {
    const shaft = this.shaft();
    const side = shaft.clone().cross(kUp);
    if (side.lengthSq() < 1e-6) side.set(1, 0, 0);
    return shaft.clone().applyAxisAngle(side.normalize(), -this.angle).applyAxisAngle(shaft, this.roll).normalize();
  }

  /** Puts the camera where the optic is; `aspect` of the window. */
  place(camera: PerspectiveCamera, aspect: number, size: number): void {
    const view = this.view(),
      right = view.clone().cross(kUp);
    if (right.lengthSq() < 1e-4) right.copy(this.sideAxis());
    right.normalize();
    camera.position.copy(this.tip());
    camera.quaternion.copy(
      new Quaternion().setFromRotationMatrix(
        camera.matrix.makeBasis(right, right.clone().cross(view), view.clone().negate()),
      ),
    );
    camera.near = 0.002 * size;
    // The field is that of the round picture.
    const half = Math.tan(MathUtils.degToRad(kField / 2)) / kRound / Math.min(1, aspect);
    camera.fov = MathUtils.radToDeg(2 * Math.atan(half));
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
  }
}
