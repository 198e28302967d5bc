// The poses of all cell copies, in textures that every skinned material reads.
import { DataTexture, FloatType, Matrix3, NearestFilter, RGBAFormat, Vector3 } from 'three';
import type { BodyState } from './body_state';
import type { Uniforms } from './materials';
import { NormalScratch, fillMarks, fillNormals, fillPose, kTextureWidth, normalRows, poseRows } from './skinning';

function makeTexture(rows: number): DataTexture {
  const t = new DataTexture(new Float32Array(4 * kTextureWidth * rows), kTextureWidth, rows, RGBAFormat, FloatType);
  t.minFilter = t.magFilter = NearestFilter;
  t.generateMipmaps = false;
  t.needsUpdate = true;
  return t;
}

export class CellTextures {
  readonly uniforms: Uniforms = {
    uPose: { value: makeTexture(1) },
    uNormals: { value: makeTexture(1) },
    uOrigin: { value: new Vector3() },
    uToCells: { value: new Matrix3() },
    uToAxes: { value: new Matrix3() },
    uInverseSize: { value: new Vector3(1, 1, 1) },
    uTextureScaleV: { value: 1 },
  };
  smooth = true;
  /** Nodes to be hatched. */
  marked: ReadonlySet<number> | null = null;
  private readonly scratch = new NormalScratch();

  get pose(): Float32Array {
    return this.texture('uPose').image.data as Float32Array;
  }
  private texture(name: string): DataTexture {
    return this.uniforms[name]!.value as DataTexture;
  }

  setBody(b: BodyState): void {
    const u = this.uniforms,
      a = b.axes,
      s = b.cellSize;
    (u.uOrigin!.value as Vector3).fromArray(b.origin);
    (u.uToAxes!.value as Matrix3).set(a[0]!, a[1]!, a[2]!, a[3]!, a[4]!, a[5]!, a[6]!, a[7]!, a[8]!);
    (u.uToCells!.value as Matrix3).set(
      a[0]! / s[0]!,
      a[1]! / s[0]!,
      a[2]! / s[0]!,
      a[3]! / s[1]!,
      a[4]! / s[1]!,
      a[5]! / s[1]!,
      a[6]! / s[2]!,
      a[7]! / s[2]!,
      a[8]! / s[2]!,
    );
    (u.uInverseSize!.value as Vector3).set(1 / s[0]!, 1 / s[1]!, 1 / s[2]!);
    this.update(b);
  }

  /** Recomputes all poses from the nodes. */
  update(b: BodyState): void {
    this.reserve('uPose', poseRows(b.nc));
    fillPose(b, this.pose);
    fillMarks(b, this.marked, this.pose);
    this.texture('uPose').needsUpdate = true;
    if (!this.smooth) return;
    this.reserve('uNormals', normalRows(b.nc));
    fillNormals(b, this.pose, this.texture('uNormals').image.data as Float32Array, this.scratch);
    this.texture('uNormals').needsUpdate = true;
  }

  private reserve(name: string, rows: number): void {
    const old = this.texture(name);
    if (old.image.height >= rows) return;
    this.uniforms[name]!.value = makeTexture(Math.ceil(1.5 * rows));
    old.dispose();
  }
}
