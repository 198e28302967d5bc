// The dark line that a slit shows where its lips touch: a narrow band along them that fades as they part. A body at rest
// closes its cuts so well that nothing else would tell where it has been cut.
import {
  BufferAttribute,
  BufferGeometry,
  Color,
  DoubleSide,
  DynamicDrawUsage,
  FrontSide,
  Mesh,
  MeshBasicMaterial,
} from 'three';
import type { BodyState } from './body_state';
import { findLips, type Lips } from './lips';
import { patchSkinning, type Look, type Uniforms } from './materials';

const kWidth = 0.0045; // of the body's diagonal, to either side
const kLeastPixels = 1.3;
const kPatience = 10; // times as long as it took to find the lips nobody looks for them again
const kLongMs = 8; // longer than this is no work for the middle of a stroke
const kInk: Record<Look, number> = { steak: 0x1c0204, meniscus: 0x3a2616, sheet: 0x06182a };

const kVertex = /* glsl */ `
  kSkinAs(kTwin, position, normal);
  vec3 kOther = kPos + kTwinOffset;
  kSkin(position, normal);
  float kGap = distance(kPos, kOther);
  float kDeep = -(modelViewMatrix * vec4(kPos, 1.0)).z;
  float kWide = max(uWide, uLeast * 2.0 * kDeep / projectionMatrix[1][1]);
  vAcross = vec2(kSide, 1.0 - smoothstep(0.35 * kWide, 1.6 * kWide, kGap));
  kSkin(position + kWide * kInward, normal);
  vRest = position;`;

export class Crease {
  readonly mesh: Mesh<BufferGeometry, MeshBasicMaterial>;
  private readonly uniforms: Uniforms = { uWide: { value: 0.001 }, uLeast: { value: 0.002 } };
  /** False in views without the skin. */
  set shown(on: boolean) {
    this.wanted = on;
    this.show();
  }
  private wanted = true;
  private lips: Lips | null = null;
  private stale = false;
  private notBefore = 0;
  private cost = 0;
  /** Vertices of the body as it came, if it came without cuts. */
  private base = 0;
  private fresh = true;

  constructor(cells: Uniforms) {
    const material = new MeshBasicMaterial({ transparent: true, depthWrite: false, toneMapped: false });
    patchSkinning(material, { ...cells, ...this.uniforms }, [], 'crease', (shader) => {
      shader.vertexShader = shader.vertexShader
        .replace(
          'void main() {',
          'uniform float uWide, uLeast;\nin uint kTwin;\nin vec3 kTwinOffset, kInward;\nin float kSide;\nvarying vec2 vAcross;\nvoid main() {',
        )
        .replace(/kSkin\(position, normal\);\s*vRest = position \* uTextureScaleV;/, kVertex)
        // Towards the eye, so that the band lies on the skin beside it and does not sink into its curvature.
        .replace(
          '#include <project_vertex>',
          '#include <project_vertex>\n\tmvPosition.xyz *= 1.0 - 0.5 * kWide / max(1e-6, length(mvPosition.xyz));\n\tgl_Position = projectionMatrix * mvPosition;',
        );
      shader.fragmentShader = shader.fragmentShader
        .replace('#include <common>', '#include <common>\nvarying vec2 vAcross;')
        .replace(
          '#include <color_fragment>',
          'float kIn = 1.0 - vAcross.x;\n\tdiffuseColor.a = vAcross.y * (0.42 * kIn * kIn + 0.46 * smoothstep(0.5, 1.0, kIn));',
        );
    });
    this.mesh = new Mesh(new BufferGeometry(), material);
    this.mesh.frustumCulled = false;
    this.mesh.matrixAutoUpdate = false;
    this.mesh.renderOrder = 1;
    this.mesh.visible = false;
  }

  /** `size`: diagonal of the body, metres. */
  setBody(size: number, open: boolean): void {
    this.uniforms.uWide!.value = kWidth * size;
    this.mesh.material.side = open ? DoubleSide : FrontSide;
    this.lips = null;
    this.show();
    this.base = 0;
    this.fresh = true;
    this.notBefore = this.cost = 0;
    this.stale = true;
  }
  setLook(look: Look): void {
    this.mesh.material.color = new Color(kInk[look]);
  }
  private show(): void {
    this.mesh.visible = this.wanted && (this.lips?.count ?? 0) > 0;
  }
  /** Of the picture, in pixels of the page. */
  setHeight(height: number): void {
    this.uniforms.uLeast!.value = kLeastPixels / Math.max(1, height);
  }

  /** A patch came: the bands that are there follow; those that are new or gone, when there is time. */
  patched(state: BodyState): void {
    this.stale = true;
    this.refresh(state);
  }

  /** Finds the lips again if they changed and there is time for it; true when it did. `busy`: a stroke is under way. */
  update(state: BodyState, now: number, busy: boolean): boolean {
    if (!this.stale || now < this.notBefore || (busy && this.cost > kLongMs)) return false;
    this.stale = false;
    const started = performance.now();
    this.lips = findLips(state, this.base);
    if (this.fresh && this.lips.count === 0) this.base = state.nv;
    this.fresh = false;
    this.build(state, this.lips);
    this.cost = performance.now() - started;
    this.notBefore = now + kPatience * this.cost;
    return true;
  }

  private build(state: BodyState, lips: Lips): void {
    this.mesh.geometry.dispose();
    const n = lips.count,
      g = new BufferGeometry();
    this.mesh.geometry = g;
    this.show();
    if (n === 0) return;
    // Four corners an edge: both ends on the lip, then both inward.
    const floats = (size: number): BufferAttribute =>
      new BufferAttribute(new Float32Array(4 * n * size), size).setUsage(DynamicDrawUsage);
    const whole = (): BufferAttribute => new BufferAttribute(new Uint32Array(4 * n), 1).setUsage(DynamicDrawUsage);
    g.setAttribute('position', floats(3));
    g.setAttribute('copyId', whole());
    g.setAttribute('kTwin', whole());
    g.setAttribute('kOffset', floats(3));
    g.setAttribute('kTwinOffset', floats(3));
    const inward = floats(3),
      side = floats(1),
      index = new Uint32Array(6 * n);
    for (let e = 0; e < n; e++) {
      for (let end = 0; end < 2; end++) {
        inward.set(lips.inward.subarray(6 * e + 3 * end, 6 * e + 3 * end + 3), 3 * (4 * e + 2 + end));
        side.setX(4 * e + 2 + end, 1);
      }
      index.set([4 * e, 4 * e + 1, 4 * e + 3, 4 * e, 4 * e + 3, 4 * e + 2], 6 * e);
    }
    g.setAttribute('kInward', inward);
    g.setAttribute('kSide', side);
    g.setIndex(new BufferAttribute(index, 1));
    this.refresh(state);
  }

  /** Copies, rest positions and offsets as they are now. */
  refresh(state: BodyState): void {
    const lips = this.lips,
      g = this.mesh.geometry;
    if (!lips || lips.count === 0) return;
    const array = <T extends Float32Array | Uint32Array>(name: string): T =>
      (g.getAttribute(name) as BufferAttribute).array as T;
    const place = array<Float32Array>('position'),
      copy = array<Uint32Array>('copyId'),
      twin = array<Uint32Array>('kTwin');
    const offset = array<Float32Array>('kOffset'),
      twinOffset = array<Float32Array>('kTwinOffset');
    for (let i = 0; i < 4 * lips.count; i++) {
      const end = 2 * (i >> 2) + (i & 1),
        v = lips.ends[end]!,
        w = lips.others[end]!;
      if (v >= state.nv || w >= state.nv) {
        this.lips = null;
        this.show();
        return;
      } // taken back
      for (let k = 0; k < 3; k++) {
        place[3 * i + k] = state.rest[3 * v + k]!;
        offset[3 * i + k] = state.offset[3 * v + k]!;
        twinOffset[3 * i + k] = state.offset[3 * w + k]!;
      }
      copy[i] = state.copy[v]!;
      twin[i] = state.copy[w]!;
    }
    for (const name of ['position', 'copyId', 'kTwin', 'kOffset', 'kTwinOffset'])
      (g.getAttribute(name) as BufferAttribute).needsUpdate = true;
  }
}
