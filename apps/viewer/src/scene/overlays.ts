// The meshes behind the picture, drawn as in the paper's figures: wireframe, collision mesh, hexahedra, binding.
import {
  BoxGeometry,
  BufferAttribute,
  BufferGeometry,
  DoubleSide,
  EdgesGeometry,
  Group,
  InstancedBufferGeometry,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshBasicMaterial,
  Points,
  PointsMaterial,
  Vector2,
  Float32BufferAttribute,
  type Material,
  type WebGLProgramParametersWithUniforms,
} from 'three';
import type { BodyMesh } from './body_mesh';
import { patchSkinning, type Uniforms } from './materials';
import type { Range } from './ranges';
import type { Overlay } from '../engine/protocol';

/** As they are drawn. */
export const kOverlayColours = { wireframe: 0x101418, collision: 0xff7a00, bound: 0xf01818, links: 0x2a62ff };

export type ViewName = 'shaded' | 'wireframe' | 'collision' | 'hexahedra' | 'bound' | 'links' | 'feet';

/** Draws lines a little nearer than the surface that they lie on. */
const nearer =
  (amount: number) =>
  (shader: WebGLProgramParametersWithUniforms): void => {
    shader.vertexShader = shader.vertexShader.replace(
      '#include <project_vertex>',
      `#include <project_vertex>\n\tgl_Position.z -= ${amount.toFixed(6)} * gl_Position.w;`,
    );
  };

/** Lines of more than a pixel: each is drawn five times, moved by half of the extra width (WebGL's own are one pixel wide). */
const kTimes = 5;
const thicker =
  (pixel: Uniforms) =>
  (shader: WebGLProgramParametersWithUniforms): void => {
    Object.assign(shader.uniforms, pixel);
    shader.vertexShader = shader.vertexShader.replace('void main() {', 'uniform vec2 uPixel;\nvoid main() {').replace(
      '#include <project_vertex>',
      `#include <project_vertex>
  vec2 kAside = gl_InstanceID == 0 ? vec2(0.0) : gl_InstanceID < 3 ? vec2(float(2 * gl_InstanceID - 3), 0.0) : vec2(0.0, float(2 * gl_InstanceID - 7));
  gl_Position.xy += 0.5 * kAside * uPixel * gl_Position.w;`,
    );
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
    shader.fragmentShader = shader.fragmentShader
      .replace('#include <common>', '#include <common>\nvarying vec3 vHex;')
      .replace('#include <color_fragment>', `diffuseColor.rgb = vHex * ${gain.toFixed(2)};`);
  };
  material.customProgramCacheKey = () => `kerf-hex-${gain}`;
  return material;
}

export class Overlays {
  readonly group = new Group();
  readonly shown: Record<ViewName, boolean> = {
    shaded: true,
    wireframe: false,
    collision: false,
    hexahedra: false,
    bound: false,
    links: false,
    feet: false,
  };
  private readonly wire: LineSegments;
  private wireGeneration = -1;
  private readonly collisionLines: LineSegments;
  private readonly collisionFaces: Mesh;
  private readonly boundLines: LineSegments;
  private readonly boundPoints: Points;
  private readonly links: LineSegments;
  private readonly feet: LineSegments;
  private readonly footPoints: Points;
  private readonly footNet: LineSegments;
  private readonly pixel: Uniforms = { uPixel: { value: new Vector2(0.002, 0.002) } };
  private readonly hexFaces: Mesh;
  private readonly hexEdges: LineSegments;
  private message: Overlay | null = null;

  constructor(private readonly body: BodyMesh) {
    const skinned = <T extends Material>(m: T, amount: number, thick = false): T => {
      patchSkinning(m, body.cells.uniforms, [], `overlay-${m.type}-${amount}-${thick}`, (shader) => {
        if (thick) thicker(this.pixel)(shader);
        nearer(amount)(shader);
        if (m instanceof PointsMaterial) {
          shader.fragmentShader = shader.fragmentShader.replace(
            '#include <color_fragment>',
            '#include <color_fragment>\n\tif (distance(gl_PointCoord, vec2(0.5)) > 0.5) discard;',
          );
        }
      });
      return m;
    };
    const line = (
      color: number,
      amount: number,
      depthTest = true,
      thick = true,
      vertexColors = false,
    ): LineBasicMaterial =>
      skinned(
        new LineBasicMaterial({ color, transparent: true, toneMapped: false, depthTest, vertexColors }),
        amount,
        thick,
      );
    this.wire = new LineSegments(new BufferGeometry(), line(kOverlayColours.wireframe, 0.0003, true, false));
    this.collisionLines = new LineSegments(new BufferGeometry(), line(kOverlayColours.collision, 0.0012, false));
    this.collisionFaces = new Mesh(
      new BufferGeometry(),
      skinned(
        new MeshBasicMaterial({
          color: 0xff9a30,
          transparent: true,
          opacity: 0.22,
          side: DoubleSide,
          depthWrite: false,
          depthTest: false,
          toneMapped: false,
        }),
        0.0006,
      ),
    );
    this.boundLines = new LineSegments(new BufferGeometry(), line(kOverlayColours.bound, 0.0009));
    this.boundPoints = new Points(
      new BufferGeometry(),
      skinned(
        new PointsMaterial({
          color: kOverlayColours.bound,
          size: 5,
          sizeAttenuation: false,
          toneMapped: false,
        }),
        0.001,
      ),
    );
    this.links = new LineSegments(new BufferGeometry(), line(kOverlayColours.links, 0.0009, false));
    this.feet = new LineSegments(new BufferGeometry(), line(0xffffff, 0.0009, false, false, true));
    this.footNet = new LineSegments(new BufferGeometry(), line(0x6d7680, 0.0009, false, false));
    this.footPoints = new Points(
      new BufferGeometry(),
      skinned(
        new PointsMaterial({
          vertexColors: true,
          size: 5,
          sizeAttenuation: false,
          toneMapped: false,
          depthTest: false,
          transparent: true,
        }),
        0.001,
      ),
    );
    const box = new BoxGeometry(1, 1, 1),
      instanced = (g: BufferGeometry): InstancedBufferGeometry => {
        const i = new InstancedBufferGeometry();
        i.index = g.index;
        i.setAttribute('position', g.getAttribute('position'));
        i.instanceCount = 0;
        return i;
      };
    this.hexFaces = new Mesh(
      instanced(box),
      hexMaterial(
        new MeshBasicMaterial({
          transparent: true,
          opacity: 0.24,
          side: DoubleSide,
          depthWrite: false,
          toneMapped: false,
        }),
        body,
        1,
      ),
    );
    this.hexEdges = new LineSegments(
      instanced(new EdgesGeometry(box)),
      hexMaterial(
        new LineBasicMaterial({
          toneMapped: false,
          transparent: true,
          opacity: 0.85,
          depthTest: false,
        }),
        body,
        0.75,
      ),
    );
    const all = [
      this.wire,
      this.collisionLines,
      this.collisionFaces,
      this.boundLines,
      this.boundPoints,
      this.links,
      this.feet,
      this.footNet,
      this.footPoints,
      this.hexFaces,
      this.hexEdges,
    ];
    for (const o of all) {
      o.frustumCulled = false;
      o.visible = false;
      o.renderOrder = 2;
      this.group.add(o);
    }
    // What lies inside the body is drawn over it: faces, then edges, then links.
    this.collisionLines.renderOrder = this.hexEdges.renderOrder = 3;
    this.hexFaces.renderOrder = 1;
    this.boundLines.renderOrder = this.boundPoints.renderOrder = 4; // chains cover the collision edges that they follow on a sheet
    this.links.renderOrder = this.feet.renderOrder = this.footNet.renderOrder = 5;
    this.footPoints.renderOrder = 6;
  }

  /** What the toggles need of the engine's Overlay message: 0 none, 1 the message, 2 with feet. */
  get wanted(): number {
    const s = this.shown;
    return s.feet ? 2 : s.collision || s.bound || s.links ? 1 : 0;
  }
  /** Size of the picture in pixels of the page. */
  setPixels(width: number, height: number): void {
    (this.pixel.uPixel!.value as Vector2).set(2 / width, 2 / height);
  }

  set(view: ViewName, on: boolean): void {
    this.shown[view] = on;
    this.sync();
  }

  setMessage(m: Overlay): void {
    this.message = {
      ...m,
      rest: m.rest.slice(),
      copy: m.copy.slice(),
      triangles: m.triangles.slice(),
      bound: m.bound.slice(),
      links: m.links.slice(),
      feet: m.feet.slice(),
      footRest: m.footRest.slice(),
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
    const b = this.body,
      s = this.shown,
      ready = b.state !== null;
    b.shaded = s.shaded;
    this.hexFaces.visible = this.hexEdges.visible = ready && s.hexahedra;
    if (b.state) {
      for (const o of [this.hexFaces, this.hexEdges])
        (o.geometry as InstancedBufferGeometry).instanceCount = b.state.nc;
    }
    const m =
      this.message && b.state && this.message.body === b.state.body && this.message.version === b.state.version
        ? this.message
        : null;
    this.collisionLines.visible = this.collisionFaces.visible = m !== null && s.collision;
    this.boundLines.visible = this.boundPoints.visible = m !== null && s.bound;
    this.links.visible = m !== null && s.links;
    this.feet.visible = this.footPoints.visible = this.footNet.visible = m !== null && s.feet && m.feet.length > 0;
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
    const s = this.body.state!,
      a = this.body.attributes!;
    this.wire.geometry.dispose();
    const g = new BufferGeometry();
    g.setAttribute('position', a.rest);
    g.setAttribute('copyId', a.copy);
    g.setAttribute('kOffset', a.offset);
    // Walls after the room that the skin has.
    g.setIndex(new BufferAttribute(new Uint32Array(2 * (s.skin.length + s.wall.length)), 1));
    g.boundingSphere = this.body.bounds;
    this.wire.geometry = g;
    this.wireGeneration = this.body.generation;
    this.updateWire([{ start: 0, end: s.ns }], [{ start: 0, end: s.nw }]);
    g.index!.clearUpdateRanges();
  }

  private updateWire(skin: Range[], wall: Range[]): void {
    const s = this.body.state!,
      index = this.wire.geometry.index!,
      out = index.array as Uint32Array;
    const write = (triangles: Uint32Array, ranges: Range[], offset: number): void => {
      for (const { start, end } of ranges) {
        for (let t = start; t < end; t++) {
          const a = triangles[3 * t]!,
            b = triangles[3 * t + 1]!,
            c = triangles[3 * t + 2]!,
            o = offset + 6 * t;
          out[o] = a;
          out[o + 1] = b;
          out[o + 2] = b;
          out[o + 3] = c;
          out[o + 4] = c;
          out[o + 5] = a;
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
    const m = this.message,
      s = this.body.state;
    if (!m || !s || m.version !== s.version || m.body !== s.body) return;
    const copyable = m.copy.every((c) => c < s.nc);
    const fits =
      m.bound.every((v) => v < s.nv) &&
      m.feet.every((v, i) => i % 2 === 1 || v < s.nv) &&
      m.links.every((v, i) => i % 2 === 0 || v < s.nv);
    for (const o of [
      this.collisionLines,
      this.collisionFaces,
      this.boundLines,
      this.boundPoints,
      this.links,
      this.feet,
      this.footPoints,
      this.footNet,
    ])
      o.geometry.dispose();
    if (!copyable || !fits) {
      this.message = null;
      return;
    }
    const thick = (): BufferGeometry => {
      const g = new InstancedBufferGeometry();
      g.instanceCount = kTimes;
      return g;
    };
    const own = (g: BufferGeometry): BufferGeometry => {
      g.setAttribute('position', new BufferAttribute(m.rest, 3));
      g.setAttribute('copyId', new BufferAttribute(m.copy, 1));
      g.boundingSphere = this.body.bounds;
      return g;
    };
    const faces = own(new BufferGeometry()),
      lines = own(thick());
    faces.setIndex(new BufferAttribute(m.triangles, 1));
    lines.setIndex(new BufferAttribute(uniqueEdges(m.triangles), 1));
    this.collisionFaces.geometry = faces;
    this.collisionLines.geometry = lines;
    // Own copies: geometries that share attributes with the body must not be disposed while it lives.
    const pairs = (
      ids: Uint32Array,
      put: (k: number, o: number, rest: Float32Array, copy: Uint32Array) => void,
      g = new BufferGeometry(),
    ): BufferGeometry => {
      const rest = new Float32Array(3 * ids.length),
        copy = new Uint32Array(ids.length);
      for (let k = 0; k < ids.length; k++) put(ids[k]!, k, rest, copy);
      g.setAttribute('position', new BufferAttribute(rest, 3));
      g.setAttribute('copyId', new BufferAttribute(copy, 1));
      g.boundingSphere = this.body.bounds;
      return g;
    };
    const fromBody = (v: number, o: number, rest: Float32Array, copy: Uint32Array): void => {
      rest.set(s.rest.subarray(3 * v, 3 * v + 3), 3 * o);
      copy[o] = s.copy[v]!;
    };
    this.boundLines.geometry = pairs(m.bound, fromBody, thick());
    this.boundPoints.geometry = pairs(m.bound, fromBody);
    this.links.geometry = pairs(
      m.links,
      (id, o, rest, copy) => {
        if (o % 2 === 1) {
          fromBody(id, o, rest, copy);
          return;
        }
        rest.set(m.rest.subarray(3 * id, 3 * id + 3), 3 * o);
        copy[o] = m.copy[id]!;
      },
      thick(),
    );
    // A foot follows the copy of its visual vertex.
    const nf = m.feet.length / 2,
      footOf = new Int32Array(nf > 0 ? s.nv : 0).fill(-1),
      ends = new Uint32Array(2 * nf);
    for (let i = 0; i < nf; i++) {
      footOf[m.feet[2 * i]!] = i;
      ends[2 * i] = ends[2 * i + 1] = i;
    }
    const toFoot = (i: number, o: number, rest: Float32Array, copy: Uint32Array): void => {
      rest.set(m.footRest.subarray(3 * i, 3 * i + 3), 3 * o);
      copy[o] = s.copy[m.feet[2 * i]!]!;
    };
    const coloured = (g: BufferGeometry, times: number): BufferGeometry => {
      const colours: number[] = [];
      for (let i = 0; i < nf; i++) for (let k = 0; k < times; k++) colours.push(...kFootColours[m.feet[2 * i + 1]!]!);
      g.setAttribute('color', new Float32BufferAttribute(colours, 3));
      return g;
    };
    this.feet.geometry = coloured(
      pairs(ends, (i, o, rest, copy) => {
        if (o % 2 === 1) toFoot(i, o, rest, copy);
        else fromBody(m.feet[2 * i]!, o, rest, copy);
      }),
      2,
    );
    this.footPoints.geometry = coloured(
      pairs(
        Uint32Array.from({ length: nf }, (_, i) => i),
        toFoot,
      ),
      1,
    );
    const net = nf > 0 ? uniqueEdges(s.skin.subarray(0, 3 * s.ns)) : new Uint32Array(0),
      kept: number[] = [];
    for (let i = 0; i < net.length; i += 2) {
      const a = footOf[net[i]!]!,
        b = footOf[net[i + 1]!]!;
      if (a >= 0 && b >= 0) kept.push(a, b);
    }
    this.footNet.geometry = pairs(Uint32Array.from(kept), toFoot);
  }
}

/** Linear light, of feet on a collision vertex, edge and triangle. */
export const kFootColours: [number, number, number][] = [
  [0.01, 0.45, 0.04],
  [0.03, 0.13, 1],
  [0.87, 0.01, 0.01],
];

/** Pairs of vertices, each edge of the triangles once. */
export function uniqueEdges(triangles: Uint32Array): Uint32Array {
  const seen = new Set<number>(),
    out: number[] = [];
  for (let t = 0; t < triangles.length; t += 3) {
    for (let k = 0; k < 3; k++) {
      const a = triangles[t + k]!,
        b = triangles[t + ((k + 1) % 3)]!,
        lo = Math.min(a, b),
        hi = Math.max(a, b);
      const key = lo * 4294967296 + hi;
      if (seen.has(key)) continue;
      seen.add(key);
      out.push(lo, hi);
    }
  }
  return new Uint32Array(out);
}
