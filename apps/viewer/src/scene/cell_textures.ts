// The poses of all cell copies, in textures that every skinned material reads.
import { DataTexture, FloatType, NearestFilter, RGBAFormat } from 'three';
import type { BodyState } from './body_state';
import type { Uniforms } from './materials';
import { cellSize, frameAxes, frameOrigin, kFrameFloats } from '../engine/frames';
import type { CellTexels } from './placed';
import { NormalScratch, fillMarks, fillNormals, fillPose, kTextureWidth, normalRows, poseRows } from './skinning';

function makeTexture(rows: number, width = kTextureWidth): DataTexture {
  const t = new DataTexture(new Float32Array(4 * width * rows), width, rows, RGBAFormat, FloatType);
  t.minFilter = t.magFilter = NearestFilter;
  t.generateMipmaps = false;
  t.needsUpdate = true;
  return t;
}

/** Per frame: the rows of the map from metres to cells, (x, y, z, 1) each. */
const kFrameTexels = 3;

export class CellTextures {
  readonly uniforms: Uniforms = {
    uPose: { value: makeTexture(1) },
    uNormals: { value: makeTexture(1) },
    uFrames: { value: makeTexture(1, kFrameTexels) },
    uTextureScaleV: { value: 1 },
  };
  smooth = true;
  /** Nodes to be hatched. */
  marked: ReadonlySet<number> | null = null;
  private readonly scratch = new NormalScratch();

  get pose(): Float32Array {
    return this.texture('uPose').image.data as Float32Array;
  }
  /** What the textures hold. */
  get texels(): CellTexels {
    const data = (name: string): Float32Array => this.texture(name).image.data as Float32Array;
    return { pose: data('uPose'), normals: data('uNormals'), frames: data('uFrames') };
  }
  private texture(name: string): DataTexture {
    return this.uniforms[name]!.value as DataTexture;
  }

  setBody(b: BodyState): void {
    const count = b.frames.length / kFrameFloats;
    this.texture('uFrames').dispose();
    const table = makeTexture(count, kFrameTexels),
      out = table.image.data as Float32Array;
    for (let f = 0; f < count; f++) {
      const o = frameOrigin(b.frames, f),
        axes = frameAxes(b.frames, f),
        size = cellSize(b.frames, f);
      for (let i = 0; i < kFrameTexels; i++) {
        const row = [0, 1, 2].map((k) => axes[3 * i + k]! / size[i]!),
          at = 4 * (kFrameTexels * f + i);
        out.set(row, at);
        out[at + 3] = -(row[0]! * o[0]! + row[1]! * o[1]! + row[2]! * o[2]!);
      }
    }
    this.uniforms.uFrames!.value = table;
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
