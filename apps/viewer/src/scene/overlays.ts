// The meshes behind the picture, drawn as in the paper's figures: wireframe, collision mesh, hexahedra, binding.
import {
  BoxGeometry, BufferAttribute, BufferGeometry, DoubleSide, EdgesGeometry, Group, InstancedBufferGeometry, LineBasicMaterial,
  LineSegments, Mesh, MeshBasicMaterial, Points, PointsMaterial, type Material, type WebGLProgramParametersWithUniforms,
} from 'three';
import type { BodyMesh } from './body_mesh';
import { patchSkinning } from './materials';
import type { Range } from './ranges';
import type { Overlay } from '../engine/protocol';

export type ViewName = 'shaded' | 'wireframe' | 'collision' | 'hexahedra' | 'bound' | 'links';

/** Draws lines a little nearer than the surface that they lie on. */
const nearer = (amount: number) => (shader: WebGLProgramParametersWithUniforms): void => {
  shader.vertexShader = shader.vertexShader.replace('#include <project_vertex>',
    `#include <project_vertex>\n\tgl_Position.z -= ${amount.toFixed(6)} * gl_Position.w;`);
};

const kHexVertex = /* glsl */ `
  ivec2 kp = ivec2((gl_InstanceID & 63) << 3, gl_InstanceID >> 6);
  vec3 kq = 0.5 + 0.86 * position;
  vec3 transformed = texelFetch(uPose, kp, 0).xyz + texelFetch(uPose, kp + ivec2(1, 0), 0).xyz * kq.x
    + texelFetch(uPose, kp + ivec2(2, 0), 0).xyz * kq.y + texelFetch(uPose, kp + ivec2(3, 0), 0).xyz * kq.z
    + texelFetch(uPose, kp + ivec2(4, 0), 0).xyz * (kq.x * kq.y) + texelFetch(uPose, kp + ivec2(5, 0), 0).xyz * (kq.y * kq.z)
    + texelFetch(uPose, kp + ivec2(6, 0), 0).xyz * (kq.x * kq.z) + texelFetch(uPose, kp + ivec2(7, 0), 0).xyz * (kq.x * kq.y * kq.z);
  float kHue = fract(float(gl_InstanceID) * 0.61803398875);
  vHex = clamp(abs(mod(kHue * 6.0 + vec3(0.0, 4.0, 2.0), 6.0) - 3.0) - 1.0, 0.0, 1.0);`;

function hexMaterial<T extends Material>(material: T, body: BodyMesh, gain: number): T {
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, body.cells.uniforms);
    shader.vertexShader = shader.vertexShader
      .replace('#include <common>', '#include <common>\nuniform highp sampler2D uPose;\nvarying vec3 vHex;')
      .replace('#include <begin_vertex>', kHexVertex);
    shader.fragmentShader = shader.fragmentShader.replace('#include <common>', '#include <common>\nvarying vec3 vHex;')
      .replace('#include <color_fragment>', `diffuseColor.rgb = vHex * ${gain.toFixed(2)};`);
  };
  material.customProgramCacheKey = () => `kerf-hex-${gain}`;
  return material;
}

export class Overlays {
  readonly group = new Group();
  readonly shown: Record<ViewName, boolean> = {
    shaded: true, wireframe: false, collision: false, hexahedra: false, bound: false, links: false,
  };
  private readonly wire: LineSegments;
  private wireGeneration = -1;
  private readonly collisionLines: LineSegments;
  private readonly collisionFaces: Mesh;
  private readonly boundLines: LineSegments;
  private readonly boundPoints: Points;
  private readonly links: LineSegments;
  private readonly hexFaces: Mesh;
  private readonly hexEdges: LineSegments;
  private message: Overlay | null = null;

  constructor(private readonly body: BodyMesh) {
    const skinned = <T extends Material>(m: T, amount: number): T => {
      patchSkinning(m, body.cells.uniforms, [], `overlay-${m.type}-${amount}`, nearer(amount));
      return m;
    };
    const line = (color: number, amount: number, depthTest = true): LineBasicMaterial =>
      skinned(new LineBasicMaterial({ color, transparent: true, toneMapped: false, depthTest }), amount);
    this.wire = new LineSegments(new BufferGeometry(), line(0x101418, 0.0003));
    this.collisionLines = new LineSegments(new BufferGeometry(), line(0xff7a00, 0.0012, false));
    this.collisionFaces = new Mesh(new BufferGeometry(), skinned(new MeshBasicMaterial({
      color: 0xff9a30, transparent: true, opacity: 0.22, side: DoubleSide, depthWrite: false, depthTest: false, toneMapped: false,
    }), 0.0006));
    this.boundLines = new LineSegments(new BufferGeometry(), line(0xf01818, 0.0009));
    this.boundPoints = new Points(new BufferGeometry(), skinned(new PointsMaterial({
      color: 0xf01818, size: 5, sizeAttenuation: false, toneMapped: false,
    }), 0.0010));
    this.links = new LineSegments(new BufferGeometry(), line(0x2a62ff, 0.0009, false));
    const box = new BoxGeometry(1, 1, 1), instanced = (g: BufferGeometry): InstancedBufferGeometry => {
      const i = new InstancedBufferGeometry();
      i.index = g.index;
      i.setAttribute('position', g.getAttribute('position'));
      i.instanceCount = 0;
      return i;
    };
    this.hexFaces = new Mesh(instanced(box), hexMaterial(new MeshBasicMaterial({
      transparent: true, opacity: 0.24, side: DoubleSide, depthWrite: false, toneMapped: false,
    }), body, 1));
    this.hexEdges = new LineSegments(instanced(new EdgesGeometry(box)), hexMaterial(new LineBasicMaterial({
      toneMapped: false, transparent: true, opacity: 0.85, depthTest: false,
    }), body, 0.75));
    const all = [this.wire, this.collisionLines, this.collisionFaces, this.boundLines, this.boundPoints, this.links, this.hexFaces, this.hexEdges];
    for (const o of all) {
      o.frustumCulled = false;
      o.visible = false;
      o.renderOrder = 2;
      this.group.add(o);
    }
    // What lies inside the body is drawn over it: faces, then edges, then links.
    this.collisionLines.renderOrder = this.hexEdges.renderOrder = 3;
    this.links.renderOrder = 4;
  }

  /** Whether a toggle is on that needs the engine's Overlay message. */
  get wantsMessage(): boolean { return this.shown.collision || this.shown.bound || this.shown.links; }
  set pixelRatio(ratio: number) { (this.boundPoints.material as PointsMaterial).size = 5 * ratio; }

  set(view: ViewName, on: boolean): void {
    this.shown[view] = on;
    this.sync();
  }

  setMessage(m: Overlay): void {
    this.message = {
      ...m, rest: m.rest.slice(), copy: m.copy.slice(), triangles: m.triangles.slice(), bound: m.bound.slice(), links: m.links.slice(),
    };
    this.rebuild();
    this.sync();
  }

  /** Forgets what belongs to the last body. */
  clear(): void {
    this.message = null;
    this.wireGeneration = -1;
    this.sync();
  }

  /** Follows toggles, body and patches. */
  sync(): void {
    const b = this.body, s = this.shown, ready = b.state !== null;
    b.shaded = s.shaded;
    this.hexFaces.visible = this.hexEdges.visible = ready && s.hexahedra;
    if (b.state) {
      for (const o of [this.hexFaces, this.hexEdges]) (o.geometry as InstancedBufferGeometry).instanceCount = b.state.nc;
    }
    const m = this.message && b.state && this.message.body === b.state.body && this.message.version === b.state.version ? this.message : null;
    this.collisionLines.visible = this.collisionFaces.visible = m !== null && s.collision;
    this.boundLines.visible = this.boundPoints.visible = m !== null && s.bound;
    this.links.visible = m !== null && s.links;
    this.wire.visible = ready && s.wireframe;
    if (this.wire.visible && this.wireGeneration !== b.generation) this.buildWire();
  }

  /** Follows a patch in the wireframe. */
  patched(): void {
    const e = this.body.lastEffect;
    if (this.wireGeneration === this.body.generation && e && !e.regrown) {
      this.updateWire(e.skin, e.wall);
    }
    this.sync();
  }

  private buildWire(): void {
    const s = this.body.state!, a = this.body.attributes!;
    this.wire.geometry.dispose();
    const g = new BufferGeometry();
    g.setAttribute('position', a.rest);
    g.setAttribute('copyId', a.copy);
    // Walls after the room that the skin has.
    g.setIndex(new BufferAttribute(new Uint32Array(2 * (s.skin.length + s.wall.length)), 1));
    g.boundingSphere = this.body.bounds;
    this.wire.geometry = g;
    this.wireGeneration = this.body.generation;
    this.updateWire([{ start: 0, end: s.ns }], [{ start: 0, end: s.nw }]);
    g.index!.clearUpdateRanges();
  }

  private updateWire(skin: Range[], wall: Range[]): void {
    const s = this.body.state!, index = this.wire.geometry.index!, out = index.array as Uint32Array;
    const write = (triangles: Uint32Array, ranges: Range[], offset: number): void => {
      for (const { start, end } of ranges) {
        for (let t = start; t < end; t++) {
          const a = triangles[3 * t]!, b = triangles[3 * t + 1]!, c = triangles[3 * t + 2]!, o = offset + 6 * t;
          out[o] = a; out[o + 1] = b; out[o + 2] = b; out[o + 3] = c; out[o + 4] = c; out[o + 5] = a;
        }
        if (end > start) index.addUpdateRange(offset + 6 * start, 6 * (end - start));
      }
    };
    const offset = 2 * s.skin.length;
    write(s.skin, skin, 0);
    write(s.wall, wall, offset);
    // Unused room between the two draws nothing: all its indices are one vertex.
    out.fill(0, 6 * s.ns, offset);
    const from = 6 * s.ns;
    if (offset > from) index.addUpdateRange(from, offset - from);
    this.wire.geometry.setDrawRange(0, offset + 6 * s.nw);
    index.needsUpdate = true;
  }

  private rebuild(): void {
    const m = this.message, s = this.body.state;
    if (!m || !s || m.version !== s.version || m.body !== s.body) return;
    const copyable = m.copy.every((c) => c < s.nc);
    const fits = m.bound.every((v) => v < s.nv) && m.links.every((v, i) => i % 2 === 0 || v < s.nv);
    for (const o of [this.collisionLines, this.collisionFaces, this.boundLines, this.boundPoints, this.links]) o.geometry.dispose();
    if (!copyable || !fits) { this.message = null; return; }
    const own = (): BufferGeometry => {
      const g = new BufferGeometry();
      g.setAttribute('position', new BufferAttribute(m.rest, 3));
      g.setAttribute('copyId', new BufferAttribute(m.copy, 1));
      g.boundingSphere = this.body.bounds;
      return g;
    };
    const faces = own(), lines = own();
    faces.setIndex(new BufferAttribute(m.triangles, 1));
    lines.setIndex(new BufferAttribute(uniqueEdges(m.triangles), 1));
    this.collisionFaces.geometry = faces;
    this.collisionLines.geometry = lines;
    // Own copies: geometries that share attributes with the body must not be disposed while it lives.
    const pairs = (ids: Uint32Array, put: (k: number, o: number, rest: Float32Array, copy: Uint32Array) => void): BufferGeometry => {
      const rest = new Float32Array(3 * ids.length), copy = new Uint32Array(ids.length);
      for (let k = 0; k < ids.length; k++) put(ids[k]!, k, rest, copy);
      const g = new BufferGeometry();
      g.setAttribute('position', new BufferAttribute(rest, 3));
      g.setAttribute('copyId', new BufferAttribute(copy, 1));
      g.boundingSphere = this.body.bounds;
      return g;
    };
    const fromBody = (v: number, o: number, rest: Float32Array, copy: Uint32Array): void => {
      rest.set(s.rest.subarray(3 * v, 3 * v + 3), 3 * o);
      copy[o] = s.copy[v]!;
    };
    this.boundLines.geometry = pairs(m.bound, fromBody);
    this.boundPoints.geometry = pairs(m.bound, fromBody);
    this.links.geometry = pairs(m.links, (id, o, rest, copy) => {
      if (o % 2 === 1) { fromBody(id, o, rest, copy); return; }
      rest.set(m.rest.subarray(3 * id, 3 * id + 3), 3 * o);
      copy[o] = m.copy[id]!;
    });
  }
}

/** Pairs of vertices, each edge of the triangles once. */
export function uniqueEdges(triangles: Uint32Array): Uint32Array {
  const seen = new Set<number>(), out: number[] = [];
  for (let t = 0; t < triangles.length; t += 3) {
    for (let k = 0; k < 3; k++) {
      const a = triangles[t + k]!, b = triangles[t + (k + 1) % 3]!, lo = Math.min(a, b), hi = Math.max(a, b);
      const key = lo * 4294967296 + hi;
      if (seen.has(key)) continue;
      seen.add(key);
      out.push(lo, hi);
    }
  }
  return new Uint32Array(out);
}
