// The visual mesh on the GPU: rest positions and copies once, poses every frame, and of a cut only what changed.
import {
  BufferAttribute,
  BufferGeometry,
  DynamicDrawUsage,
  Group,
  Mesh,
  Sphere,
  Vector3,
  Vector4,
  type Data3DTexture,
} from 'three';
import { BodyState, type PatchEffect } from './body_state';
import { CellTextures } from './cell_textures';
import { Crease } from './crease';
import {
  type BodyMaterials,
  type Look,
  type QualityLevel,
  type Uniforms,
  disposeMaterials,
  makeBodyMaterials,
} from './materials';
import { Occlusion } from './occlusion';
import { kDryAfter } from './looks';
import { PlacedMesh, type Sight } from './placed_mesh';
import type { Range } from './ranges';
import type { Fading, Patch } from '../engine/protocol';

export interface Attributes {
  rest: BufferAttribute;
  normal: BufferAttribute;
  copy: BufferAttribute;
  offset: BufferAttribute;
  birth: BufferAttribute;
  mark: BufferAttribute;
}

const kNone = new Uint32Array(0);
const kDryStep = kDryAfter / 40; // seconds between pictures that only drying asks for; twice of it is seen to jump

function upload(attribute: BufferAttribute, ranges: Range[], items: number): void {
  for (const r of ranges) attribute.addUpdateRange(items * r.start, items * (r.end - r.start));
  if (ranges.length > 0) attribute.needsUpdate = true;
}

export class BodyMesh {
  readonly group = new Group();
  readonly cells = new CellTextures();
  readonly occlusion = new Occlusion();
  readonly crease = new Crease(this.cells.uniforms);
  state: BodyState | null = null;
  attributes: Attributes | null = null;
  /** Counts how often buffers were replaced: overlays that share attributes rebuild when it changes. */
  generation = 0;
  readonly bounds = new Sphere();
  open = false;
  lastEffect: PatchEffect | null = null;
  private readonly frame: Uniforms = {
    uBoxMin: { value: new Vector3() },
    uBoxMax: { value: new Vector3() },
    uFibre: { value: new Vector3(0, 0, 1) },
    ...this.occlusion.uniforms,
    uTextureScale: { value: 1 },
    uTime: { value: 0 },
    uWindow: { value: 1 },
    uLesion: { value: 0 },
    uLesionA: { value: new Vector4() },
    uLesionB: { value: new Vector4() },
  };
  private readonly skin = new Mesh();
  private readonly wall = new Mesh();
  private materials: BodyMaterials | null = null;
  private look: Look = 'steak';
  private level: QualityLevel = 'full';

  constructor(private readonly noise: Data3DTexture) {
    for (const mesh of [this.skin, this.wall]) {
      mesh.frustumCulled = false;
      mesh.castShadow = mesh.receiveShadow = true;
      mesh.matrixAutoUpdate = false;
      this.group.add(mesh);
    }
    this.group.add(this.crease.mesh);
    this.group.visible = false;
  }

  /** Nodes that supports hold; shown with `held`, vertices that they hold, while a tool is chosen that fixes or releases. */
  fixed: Uint32Array = kNone;
  private held: Uint32Array = kNone;
  private fixedShown = false;
  setFixed(nodes: Uint32Array, vertices: Uint32Array): void {
    this.fixed = nodes;
    this.held = vertices;
    this.hatch();
  }
  set showFixed(on: boolean) {
    if (on === this.fixedShown) return;
    this.fixedShown = on;
    this.hatch();
  }
  private hatch(): void {
    this.cells.marked = this.fixedShown ? new Set(this.fixed) : null;
    if (!this.state) return;
    this.state.setMarked(this.fixedShown ? this.held : kNone);
    if (this.attributes) this.attributes.mark.needsUpdate = true;
    this.follow(this.state);
  }

  /** In lite the CPU finds places and normals; otherwise shaders do. */
  private placed: PlacedMesh | null = null;
  private follow(state: BodyState): void {
    this.cells.update(state);
    this.placed?.moved();
  }
  /** Before every picture. */
  prepare(sight: Sight): void {
    if (this.skin.visible) this.placed?.prepare(this.cells.texels, sight);
  }

  /** For what lies around the body: its shade, and the window that it mirrors. */
  get around(): Uniforms {
    return { ...this.occlusion.uniforms, uWindow: this.frame.uWindow! };
  }
  /** Within a joint there is no window to mirror. */
  set inJoint(on: boolean) {
    this.frame.uWindow!.value = on ? 0 : 1;
  }

  set shaded(on: boolean) {
    this.skin.visible = this.wall.visible = this.crease.shown = on;
  }

  setLook(look: Look, level: QualityLevel): void {
    this.look = look;
    this.level = level;
    this.crease.setLook(look);
    const old = this.materials;
    this.materials = makeBodyMaterials(look, level, this.open, this.cells.uniforms, this.noise, this.frame);
    this.skin.material = this.materials.skin;
    this.wall.material = this.materials.wall;
    this.skin.customDepthMaterial = this.wall.customDepthMaterial = this.materials.depth;
    if (old) disposeMaterials(old);
    if (!this.state) return;
    this.cells.update(this.state);
    if (this.attributes && (level === 'lite') !== (this.placed !== null)) this.build();
  }

  setBody(state: BodyState): void {
    this.state = state;
    this.fixed = this.held = kNone;
    this.cells.marked = null;
    this.lastEffect = null;
    this.lastBirth = -Infinity;
    this.frameTextures(state);
    const open = isOpen(state);
    if (open !== this.open || !this.materials) {
      this.open = open;
      this.setLook(this.look, this.level);
    }
    this.cells.setBody(state);
    this.occlusion.fill(state, this.cells.pose);
    this.build();
    this.crease.setBody(0.26 / (this.frame.uTextureScale!.value as number), this.open);
    this.group.visible = true;
    this.updateBounds();
  }

  /** Marks what should be taken out, on skin and cut surfaces alike; after setBody. */
  setLesion(lesion: { shape: 'sphere' | 'box' | 'half_space'; values: number[] } | null): void {
    const s = this.frame.uTextureScale!.value as number,
      v = lesion?.values.map((x) => s * x) ?? [];
    this.frame.uLesion!.value = lesion ? { sphere: 1, box: 2, half_space: 3 }[lesion.shape] : 0;
    (this.frame.uLesionA!.value as Vector4).set(
      v[0] ?? 0,
      v[1] ?? 0,
      v[2] ?? 0,
      lesion?.shape === 'sphere' ? v[3]! : 0,
    );
    (this.frame.uLesionB!.value as Vector4).set(v[3] ?? 0, v[4] ?? 0, v[5] ?? 1, 0);
  }

  applyPatch(patch: Patch): PatchEffect {
    const state = this.state!;
    const effect = state.apply(patch, this.time);
    this.lastBirth = this.time;
    this.lastEffect = effect;
    if (effect.regrown) {
      this.build();
    } else {
      const a = this.attributes!;
      upload(a.rest, effect.vertices, 3);
      upload(a.normal, effect.vertices, 4);
      upload(a.copy, effect.vertices, 1);
      upload(a.offset, effect.offsets, 3);
      upload(a.birth, effect.vertices, 1);
      if (!this.placed) {
        upload(this.skin.geometry.index!, effect.skin, 3);
        upload(this.wall.geometry.index!, effect.wall, 3);
        this.skin.geometry.setDrawRange(0, 3 * state.ns);
        this.wall.geometry.setDrawRange(0, 3 * state.nw);
      }
    }
    this.follow(state);
    this.occlusion.moved();
    this.crease.patched(state);
    this.updateBounds();
    return effect;
  }

  /** New node positions and offsets of vertices; false when nothing moved. */
  setNodes(nodes: Float32Array, fading: Fading): boolean {
    const state = this.state!,
      offsets = state.setFading(fading);
    upload(this.attributes!.offset, offsets, 3);
    if (offsets.length > 0) {
      this.crease.refresh(state);
      this.placed?.moved();
    }
    let moved = false;
    for (let i = 0; i < nodes.length; i++) {
      if (state.nodes[i] !== nodes[i]) {
        moved = true;
        break;
      }
    }
    if (!moved) return offsets.length > 0;
    state.nodes.set(nodes);
    this.follow(state);
    this.occlusion.moved();
    this.updateBounds();
    return true;
  }

  /** Time of the body, by which walls dry; true while one looks different for it. */
  setTime(time: number): boolean {
    const before = this.time;
    this.time = time;
    if (Math.abs(time - (this.frame.uTime!.value as number)) < kDryStep) return false;
    this.frame.uTime!.value = time;
    return Math.min(before, time) < this.lastBirth + kDryAfter;
  }
  private time = 0;
  private lastBirth = -Infinity;

  private updateBounds(): void {
    const s = this.state!,
      n = 3 * s.nn;
    const lo = [Infinity, Infinity, Infinity],
      hi = [-Infinity, -Infinity, -Infinity];
    for (let i = 0; i < n; i += 3) {
      for (let k = 0; k < 3; k++) {
        const x = s.nodes[i + k]!;
        if (x < lo[k]!) lo[k] = x;
        if (x > hi[k]!) hi[k] = x;
      }
    }
    if (n === 0) return;
    this.bounds.center.set((lo[0]! + hi[0]!) / 2, (lo[1]! + hi[1]!) / 2, (lo[2]! + hi[2]!) / 2);
    this.bounds.radius = Math.hypot(hi[0]! - lo[0]!, hi[1]! - lo[1]!, hi[2]! - lo[2]!) / 2;
  }

  private build(): void {
    const s = this.state!;
    // Old geometries first: disposing frees the buffers of the attributes that they have now.
    this.skin.geometry.dispose();
    this.wall.geometry.dispose();
    const rest = new BufferAttribute(s.rest, 3),
      normal = new BufferAttribute(s.normal, 4, true);
    const copy = new BufferAttribute(s.copy, 1),
      offset = new BufferAttribute(s.offset, 3);
    const birth = new BufferAttribute(s.birth, 1),
      mark = new BufferAttribute(s.mark, 1);
    this.attributes = { rest, normal, copy, offset, birth, mark };
    const geometry = (index: Uint32Array, count: number): BufferGeometry => {
      const g = new BufferGeometry();
      g.setAttribute('position', rest);
      g.setAttribute('normal', normal);
      g.setAttribute('copyId', copy);
      g.setAttribute('kOffset', offset);
      g.setAttribute('kMark', mark);
      g.setAttribute('kBirth', birth);
      g.boundingSphere = this.bounds;
      if (this.level === 'lite') return g;
      g.setIndex(new BufferAttribute(index, 1).setUsage(DynamicDrawUsage));
      g.setDrawRange(0, 3 * count);
      return g;
    };
    for (const a of [rest, normal, copy, offset, birth, mark]) a.setUsage(DynamicDrawUsage);
    this.skin.geometry = geometry(s.skin, s.ns);
    this.wall.geometry = geometry(s.wall, s.nw);
    const meshes = [this.skin, this.wall];
    for (const mesh of meshes) mesh.onBeforeShadow = mesh.onAfterShadow = () => undefined;
    this.placed = this.level === 'lite' ? new PlacedMesh(s, this.open, meshes) : null;
    this.generation++;
  }

  /** Places textures by the rest shape. */
  private frameTextures(s: BodyState): void {
    const lo = new Vector3(Infinity, Infinity, Infinity),
      hi = lo.clone().negate();
    for (let i = 0; i < 3 * s.nv; i += 3) {
      const x = s.rest[i]!,
        y = s.rest[i + 1]!,
        z = s.rest[i + 2]!;
      lo.set(Math.min(lo.x, x), Math.min(lo.y, y), Math.min(lo.z, z));
      hi.set(Math.max(hi.x, x), Math.max(hi.y, y), Math.max(hi.z, z));
    }
    if (s.nv === 0) {
      lo.set(0, 0, 0);
      hi.set(1, 1, 1);
    }
    const scale = 0.26 / Math.max(1e-9, lo.distanceTo(hi));
    this.frame.uTextureScale!.value = scale;
    this.cells.uniforms.uTextureScaleV!.value = scale;
    (this.frame.uBoxMin!.value as Vector3).copy(lo).multiplyScalar(scale);
    (this.frame.uBoxMax!.value as Vector3).copy(hi).multiplyScalar(scale);
    const c = lo
      .clone()
      .add(hi)
      .multiplyScalar(0.5 * scale);
    (this.frame.uFibre!.value as Vector3).set(c.x, c.y, 0.5 * scale * Math.max(hi.x - lo.x, hi.y - lo.y));
  }
}

/** Whether the skin has border edges: a sheet without thickness. Uses rest positions, since vertices may be doubled. */
function isOpen(s: BodyState): boolean {
  // Signed volume is no proof, but a closed skin's directed area sums to zero: an open one's hardly ever does.
  let ax = 0,
    ay = 0,
    az = 0,
    total = 0;
  const add = (index: Uint32Array, count: number): void => {
    for (let t = 0; t < 3 * count; t += 3) {
      const a = 3 * index[t]!,
        b = 3 * index[t + 1]!,
        c = 3 * index[t + 2]!,
        r = s.rest;
      const ux = r[b]! - r[a]!,
        uy = r[b + 1]! - r[a + 1]!,
        uz = r[b + 2]! - r[a + 2]!;
      const vx = r[c]! - r[a]!,
        vy = r[c + 1]! - r[a + 1]!,
        vz = r[c + 2]! - r[a + 2]!;
      const nx = uy * vz - uz * vy,
        ny = uz * vx - ux * vz,
        nz = ux * vy - uy * vx;
      ax += nx;
      ay += ny;
      az += nz;
      total += Math.hypot(nx, ny, nz);
    }
  };
  add(s.skin, s.ns);
  add(s.wall, s.nw);
  return Math.hypot(ax, ay, az) > 1e-3 * total;
}
