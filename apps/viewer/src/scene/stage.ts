// Renderer, camera, light, and the ground of scenes that have one.
import {
  ACESFilmicToneMapping,
  CircleGeometry,
  Color,
  DirectionalLight,
  Fog,
  HemisphereLight,
  MathUtils,
  Mesh,
  MeshLambertMaterial,
  MeshStandardMaterial,
  MOUSE,
  Object3D,
  PCFShadowMap,
  PerspectiveCamera,
  PMREMGenerator,
  Scene,
  SpotLight,
  TOUCH,
  Vector2,
  Vector3,
  WebGLRenderer,
  type Data3DTexture,
  type Texture,
} from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
import { Arthroscope, type ScopePlace } from './arthroscope';
import { makeBackdrop, makeTheatre } from './backdrop';
import { Flight, type View } from './flight';
import { frameSubject, isFree, kNothingOver, type Insets, type Subject } from './framing';
import { Joint } from './joint';
import type { Look, QualityLevel, Uniforms } from './materials';
import { installNearLight } from './near_light';
import { receiveContact } from './occlusion';
import type { Sight } from './placed_mesh';
import { installSoftShadows, readShadowOnce, shadowFromBelow } from './soft_shadow';
import { disposeSurroundings, makeSurroundings } from './surroundings';
import type { Vec3 } from '../engine/protocol';

Object3D.DEFAULT_UP.set(0, 0, 1);

export interface Box {
  min: Vec3;
  max: Vec3;
}

// How the view goes after what sinks or swings away, in sizes of the body and parts of the way for each picture.
const kAstray = 0.15;
const kArrived = 0.01;
const kFollow = 0.15;
const kFieldOfView = 32; // degrees, of the free camera
/** Towards the eye, where a scene opens. */
const kHome: Vec3 = [-0.42, -1.18, 0.98];
const kHomeDistance = 1.88; // sizes of the body: it fills a third of a wide window, and what lies around it is seen
const kReach = 12; // diagonals of the scene's bodies
/** Orders of drawing: bodies have 0. */
export const kBehindBodies = 1;
const kBehindAll = 2;
// Half the side of the region that casts and takes shadows, in sizes of the body. Less cuts the shadows of instruments; more
// makes them coarse, and costs the CPU as a GPU a tenth of a picture.
const kShadows = 1.3;
const kShadowsLite = 0.75;
// Where light comes from, in sizes of the body: a window, or the lamps over a table.
const kSun = [-0.9, 0.75, 2.1] as const;
const kLamps = [-0.45, 0.3, 2.35] as const;
// Where the fluid of a joint begins to hide things and hides them, in sizes of the body: as an optic in saline sees.
const kClearFluid = 0.12;
const kHazyFluid = 2.2;
// What the light at the tip brings to the target, times pi what white throws back. It falls with the square of the way, so near things glare
// and far ones sink; it is set for the way to the target, as a camera does, within these sizes of the body.
const kTip = 2.7;
const kNearest = 0.1;
const kFarthest = 0.7;
const kCone = 0.92; // radians from its middle to where its light ends: the picture is darker towards its edge
const kBesideOptic = 0.02; // sizes from the optic to where its light leaves the shaft; at 0 nothing that is wet glints
const kEnvironmentBlur = 0.01; // radians; the window's edges are soft by themselves
const kJoint = 0x35191a; // light that the fluid of a joint scatters back: what is far fades into it; brighter is muddy

const kFromBelow = 0xf2f0ec; // light on undersides where the ground is not drawn
const kDrape = 0x24474d; // around an operation

const kOiled = 0.6; // of the wood's colour, where the surroundings light it too: at 1 its grain is pale, at a third it is burnt
const kWood = /* glsl */ `
uniform highp sampler3D uNoise;
uniform float uScale;
varying vec3 vPlace;
vec3 kWood(vec3 q) {
  vec3 p = q * uScale;
  float plank = floor(p.y / 0.075 + 0.5), edge = abs(fract(p.y / 0.075 + 0.5) - 0.5);
  vec3 o = vec3(plank * 0.37, plank * 0.61, plank * 0.83);
  vec4 w = texture(uNoise, vec3(p.x * 0.9, p.y * 3.0, p.z * 3.0) + o);
  float rings = sin((p.y * 190.0 + w.r * 26.0 + w.g * 11.0) * (0.75 + 0.25 * sin(plank * 2.3)));
  vec4 grain = texture(uNoise, vec3(p.x * 2.6, p.y * 60.0, p.z * 60.0) + o);
  float tone = 0.5 + 0.30 * (w.b - 0.5) + 0.22 * (fract(plank * 0.618) - 0.5);
  vec3 c = mix(vec3(0.235, 0.112, 0.048), vec3(0.490, 0.272, 0.128), clamp(tone + 0.10 * rings + 0.35 * (grain.a - 0.5), 0.0, 1.0));
  return c * (1.0 - 0.62 * smoothstep(0.488, 0.497, edge));
}
`;

export class Stage {
  readonly renderer: WebGLRenderer;
  readonly scene = new Scene();
  readonly camera = new PerspectiveCamera(kFieldOfView, 1, 0.01, 10);
  readonly controls: OrbitControls;
  readonly software: boolean;
  size = 0.26;
  /** White, without ground: for figures. */
  plain = false;
  private readonly sun = new DirectionalLight(0xfff0dd, 2.55);
  private readonly fill = new DirectionalLight(0xcfe0ff, 0.45);
  private readonly sky = new HemisphereLight(0xf2f5ff, 0x6b5a4c, 0.9);
  readonly scope = new Arthroscope();
  private scopeIsOn = false;
  private readonly tipLight = new SpotLight(0xf6f8ff, 0, 0, kCone, 1, 2);
  private readonly joint: Joint;
  /** Uniforms of the body's shade, which falls on the ground. */
  contact: Uniforms = {};
  private environment: Texture | null = null;
  private readonly ground = new Mesh();
  private readonly wood = { uNoise: { value: null as Data3DTexture | null }, uScale: { value: 1 } };
  private level: QualityLevel = 'full';
  private dark = false;
  /** Height of the ground: a level plane among the scene's obstacles. Null: it has none, and none is drawn. */
  private floor: number | null = null;
  private look: Look = 'steak';
  /** Pixels of the window that something lies over. */
  over: Insets = kNothingOver;
  /** From where things are looked at that nobody has turned: towards the eye. */
  private towards = new Vector3(...kHome).normalize();

  constructor(canvas: HTMLCanvasElement, noise: Data3DTexture, antialias: boolean, software: boolean) {
    this.software = software;
    this.renderer = new WebGLRenderer({
      canvas,
      antialias,
      powerPreference: 'high-performance',
      preserveDrawingBuffer: false,
    });
    this.renderer.toneMapping = ACESFilmicToneMapping;
    installSoftShadows();
    installNearLight();
    this.renderer.shadowMap.type = PCFShadowMap;
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.autoUpdate = false;
    this.wood.uNoise.value = noise;
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = true;
    this.controls.dampingFactor = 0.12;
    this.controls.zoomToCursor = true;
    this.controls.screenSpacePanning = true;
    this.controls.maxPolarAngle = 0.98 * Math.PI;
    this.controls.addEventListener('start', () => (this.flight = null));
    this.setOrbitOnly(false);
    this.sun.castShadow = true;
    this.scene.add(
      this.sun,
      this.sun.target,
      this.fill,
      this.fill.target,
      this.sky,
      this.tipLight,
      this.tipLight.target,
      this.ground,
    );
    this.joint = new Joint(noise);
    this.joint.mesh.renderOrder = kBehindAll;
    this.scene.add(this.joint.mesh);
    this.ground.receiveShadow = true;
    // What lies under other things is drawn after them: what they hide costs nothing.
    this.ground.renderOrder = kBehindAll;
    this.scene.fog = new Fog(0x808080, 1, 4);
    this.setTheme(false);
  }

  /** Whether the first button and one finger move the camera too, or belong to the tool. */
  setOrbitOnly(on: boolean): void {
    this.controls.mouseButtons = { LEFT: on ? MOUSE.ROTATE : null, MIDDLE: MOUSE.PAN, RIGHT: MOUSE.ROTATE };
    this.controls.touches = { ONE: on ? TOUCH.ROTATE : (null as unknown as TOUCH), TWO: TOUCH.DOLLY_ROTATE };
  }

  setTheme(dark: boolean): void {
    this.dark = dark;
    const back = this.plain ? 0xffffff : this.scopeIsOn ? kJoint : dark ? 0x1c2126 : 0xa9b1b8;
    (this.scene.background as Texture | null)?.dispose?.();
    this.scene.background = this.theatre
      ? makeTheatre(dark, this.tall)
      : this.bottomless
        ? makeBackdrop(back)
        : new Color(back);
    (this.scene.fog as Fog).color.set(this.theatre ? kDrape : back);
    const ground = this.ground.material as MeshStandardMaterial | MeshLambertMaterial;
    if ('color' in ground && !Array.isArray(ground)) ground.color.set(this.groundColour());
  }

  /** The window is taller than wide: backdrops have two shapes. */
  private tall = false;

  private get bottomless(): boolean {
    return this.floor === null && !this.plain && !this.scopeIsOn;
  }
  /** What is operated on lies in the light of lamps, with drapes around it. */
  private get theatre(): boolean {
    return this.bottomless && this.look === 'meniscus';
  }
  private groundColour(): number {
    if (this.look === 'meniscus') return this.dark ? 0x123a40 : 0x2f7077;
    return this.dark ? 0x30363c : 0x8b949b;
  }

  private pixelRatio = 1;
  /** Times as many pixels along each side as pictures have that move: for edges without stairs. */
  set fineness(times: number) {
    if (this.renderer.getPixelRatio() !== times * this.pixelRatio) this.renderer.setPixelRatio(times * this.pixelRatio);
  }

  setQuality(level: QualityLevel, pixelRatio: number): void {
    this.level = level;
    this.pixelRatio = pixelRatio;
    this.controls.enableDamping = level !== 'lite'; // it is counted in frames: sluggish where frames are few
    this.renderer.setPixelRatio(pixelRatio);
    const shadow = this.sun.shadow,
      size = level === 'full' ? 2048 : 1024;
    if (shadow.mapSize.x !== size) {
      shadow.mapSize.set(size, size);
      shadow.map?.dispose();
      shadow.map = null;
    }
    shadow.radius = level === 'full' ? 3.5 : 2.5;
    if (level !== 'lite' && !this.environment) {
      const generator = new PMREMGenerator(this.renderer);
      const surroundings = makeSurroundings();
      this.environment = generator.fromScene(surroundings, kEnvironmentBlur).texture;
      disposeSurroundings(surroundings);
      generator.dispose();
    }
    this.scene.environment = level === 'lite' ? null : this.environment;
    this.light();
    this.buildGround();
    this.renderer.shadowMap.needsUpdate = true;
  }

  /** The sun and the sky, or the light at the tip of an arthroscope. */
  private light(): void {
    const inside = this.scopeIsOn,
      lite = this.level === 'lite';
    this.scene.environmentIntensity = inside ? 0.05 : 0.8;
    this.sky.intensity = inside ? 0.12 : (lite ? 1.9 : 0.75) * (this.theatre ? 0.66 : 1);
    this.sky.groundColor.set(this.below ? kFromBelow : this.theatre ? 0x2f6268 : 0x6b5a4c);
    this.sun.intensity = this.theatre ? 2.3 : 2.55;
    const [x, y, z] = this.theatre ? kLamps : kSun;
    this.sun.position.set(x, y, z).multiplyScalar(this.size).add(this.centre);
    this.sun.visible = !inside;
    this.fill.visible = !inside && this.level === 'full';
    const shadow = this.sun.shadow.camera,
      half = (lite ? kShadowsLite : kShadows) * this.size;
    shadow.left = shadow.bottom = -half;
    shadow.right = shadow.top = half;
    shadow.near = 0.3 * this.size;
    shadow.far = 5 * this.size;
    shadow.updateProjectionMatrix();
    this.tipLight.visible = inside;
    this.joint.mesh.visible = inside;
    const fog = this.scene.fog as Fog;
    fog.near = (inside ? kClearFluid : 3.2 * this.wide) * this.size;
    fog.far = (inside ? kHazyFluid : 9 * this.wide) * this.size;
  }

  get scopeOn(): boolean {
    return this.scopeIsOn;
  }
  /** Looks through the arthroscope, or from outside again; the free camera stays where it was. */
  setScope(on: boolean): void {
    if (on === this.scopeIsOn) return;
    this.scopeIsOn = on;
    const c = this.camera;
    if (on) {
      this.free.position.copy(c.position);
      this.controls.enabled = false;
      this.placeScope();
    } else {
      c.position.copy(this.free.position);
      c.fov = kFieldOfView;
      c.near = 0.02 * this.size;
      c.updateProjectionMatrix();
      this.controls.enabled = true;
      this.controls.update();
    }
    this.light();
    this.furnish();
    this.setTheme(this.dark);
  }
  private readonly free = { position: new Vector3() };
  /** Where it goes in and what it looks at; without a place of the scene it comes the way the free camera looks. */
  setScopePlace(place: ScopePlace | null): void {
    const away = new Vector3(...kHome).normalize();
    this.scope.set(
      place ?? {
        entry: this.centre.clone().addScaledVector(away, 0.95 * this.size),
        target: this.centre,
        angle: Math.PI / 6,
      },
    );
    if (this.scopeIsOn) this.placeScope();
  }
  placeScope(): void {
    this.scope.place(this.camera, this.camera.aspect, this.size);
    this.tipLight.position.set(0, kBesideOptic * this.size, 0).applyMatrix4(this.camera.matrixWorld);
    this.tipLight.target.position.set(0, 0, -this.size).applyMatrix4(this.camera.matrixWorld);
    const way = MathUtils.clamp(this.scope.way, kNearest * this.size, kFarthest * this.size);
    this.tipLight.intensity = kTip * way * way;
  }

  private buildGround(): void {
    this.ground.geometry.dispose();
    (this.ground.material as MeshStandardMaterial).dispose();
    const d = this.size;
    this.ground.geometry = new CircleGeometry(12 * d, 48);
    this.wood.uScale.value = 0.26 / d;
    this.ground.material =
      this.level === 'lite'
        ? readShadowOnce(new MeshLambertMaterial({ color: this.groundColour() }))
        : new MeshStandardMaterial({ color: this.groundColour(), roughness: 0.85 });
    shadowFromBelow(receiveContact(this.ground.material, this.contact, true));
    this.furnish();
  }

  /** Planks, for obstacles that are boards. */
  makeWood(): MeshStandardMaterial | MeshLambertMaterial {
    const tone = (this.level === 'lite' ? 1 : kOiled).toFixed(2);
    const material =
      this.level === 'lite'
        ? readShadowOnce(new MeshLambertMaterial())
        : new MeshStandardMaterial({ roughness: 0.68, metalness: 0 });
    material.onBeforeCompile = (shader) => {
      Object.assign(shader.uniforms, this.wood);
      shader.vertexShader = shader.vertexShader
        .replace('#include <common>', '#include <common>\nvarying vec3 vPlace;')
        .replace('void main() {', 'void main() {\n\tvPlace = position;');
      shader.fragmentShader = shader.fragmentShader
        .replace('#include <common>', `#include <common>\n${kWood}`)
        .replace('#include <color_fragment>', `diffuseColor.rgb = ${tone} * kWood(vPlace);`);
    };
    material.customProgramCacheKey = () => `kerf-wood-${tone}`;
    return shadowFromBelow(receiveContact(material, this.contact));
  }

  private furnish(): void {
    this.ground.visible = this.floor !== null && !this.plain && !this.scopeIsOn && !this.below;
    this.ground.position.set(this.centre.x, this.centre.y, this.floor ?? 0);
  }
  /** Height of the ground that is drawn. */
  get floorShown(): number | null {
    return this.ground.visible ? this.floor : null;
  }
  /** What is drawn as a floor is an obstacle of the scene. */
  setFloor(floor: number | null): void {
    if (floor === this.floor) return;
    const other = (floor === null) !== (this.floor === null);
    this.floor = floor;
    this.furnish();
    if (!other) return;
    this.light();
    this.setTheme(this.dark);
  }
  /** The eye is under the ground, which would hide the body's other side. */
  private below = false;

  /** A new body: fits light and ground to its box. */
  setBox(box: Box, look: Look, keepCamera: boolean): void {
    const lo = new Vector3(...box.min),
      hi = new Vector3(...box.max);
    const centre = lo.clone().add(hi).multiplyScalar(0.5),
      d = Math.max(1e-6, lo.distanceTo(hi));
    this.size = d;
    this.look = look;
    this.centre.copy(centre);
    this.joint.setBody(centre, d);
    this.flight = null;
    if (!keepCamera) this.wide = 1;
    this.ground.scale.setScalar(this.wide);
    this.camera.near = 0.02 * d;
    this.camera.far = 30 * this.wide * d;
    this.camera.updateProjectionMatrix();
    this.controls.minDistance = 0.15 * d;
    this.controls.maxDistance = 6 * this.wide * d;
    this.light();
    this.sun.target.position.copy(centre);
    this.fill.position.copy(centre).add(new Vector3(1.4 * d, -1.2 * d, 0.8 * d));
    this.fill.target.position.copy(centre);
    const s = this.sun.shadow;
    s.bias = -0.0004;
    s.normalBias = 0.0045 * d;
    this.buildGround();
    this.setTheme(this.dark);
  }
  private readonly centre = new Vector3();

  /** Where the scene's bodies began. */
  get middle(): Vector3 {
    return this.centre;
  }
  /** What is farther from there is gone: from where one could see it, nothing else could be seen. */
  get reach(): number {
    return kReach * this.size;
  }

  /** From where a subject is seen whole, beside what lies over the window. */
  private viewOf(subject: Subject): View {
    const { x: width, y: height } = this.renderer.getSize(new Vector2());
    return frameSubject(subject, this.towards, kHomeDistance * this.size, {
      width,
      height,
      field: kFieldOfView,
      over: this.over,
    });
  }
  /** Looks at a subject, from the home direction unless another is given. */
  lookAt(subject: Subject, towards: Vec3 = kHome): void {
    if (this.scopeIsOn) return;
    this.flight = null;
    this.following = false;
    this.towards.set(...towards).normalize();
    this.widen(subject);
    const { position, target } = this.viewOf(subject);
    this.camera.position.copy(position);
    this.controls.target.copy(target);
    this.controls.update();
  }
  /** Goes there bit by bit once it has left the free part of the window, or gone far; true while it moves. */
  followTo(subject: Subject): boolean {
    if (this.scopeIsOn) return false;
    const { position, target } = this.viewOf(subject),
      gap = target.distanceTo(this.controls.target);
    this.following ||= gap > kAstray * this.size || !this.isFree(subject.places);
    this.following &&= Math.max(gap, position.distanceTo(this.camera.position)) > kArrived * this.size;
    if (!this.following) return false;
    this.controls.target.lerp(target, kFollow);
    this.camera.position.lerp(position, kFollow);
    return true;
  }
  following = false;
  private isFree(places: readonly Vector3[]): boolean {
    const { x: width, y: height } = this.renderer.getSize(new Vector2());
    return places.every((p) => isFree(this.project([p.x, p.y, p.z]), width, height, this.over));
  }
  /** As lookAt, on a way of a moment; a person who moves the view ends it. */
  flyTo(subject: () => Subject, now: number): void {
    if (this.scopeIsOn) return;
    this.towards.set(...kHome).normalize();
    const from = { position: this.camera.position.clone(), target: this.controls.target.clone() };
    this.flight = { way: new Flight(from, now), subject };
  }
  private flight: { way: Flight; subject: () => Subject } | null = null;
  private fly(now: number): void {
    const { way, subject } = this.flight!;
    const shown = subject();
    this.widen(shown);
    const { position, target } = way.at(now, this.viewOf(shown));
    this.camera.position.copy(position);
    this.controls.target.copy(target);
    if (way.over(now)) this.flight = null;
  }
  /** What is seen is so many times larger than the scene's bodies: mist and the far end of the view give way. */
  private widen({ ball }: Subject): void {
    const times = Math.max(1, (2.4 * ball.radius) / this.size - 0.2);
    if (times === this.wide) return;
    this.wide = times;
    this.camera.far = 30 * times * this.size;
    this.camera.updateProjectionMatrix();
    this.controls.maxDistance = 6 * times * this.size;
    this.ground.scale.setScalar(times);
    this.light();
  }
  private wide = 1;

  /** Looks at the body from a direction given in degrees; distance and target stay what they were unless given. */
  lookFrom(azimuth: number, elevation: number, distance?: number, target?: Vec3): void {
    this.flight = null;
    this.setScope(false);
    const a = (azimuth * Math.PI) / 180,
      e = (elevation * Math.PI) / 180;
    const r = distance ?? this.camera.position.distanceTo(this.controls.target);
    if (target) this.controls.target.set(...target);
    this.camera.position
      .set(Math.cos(a) * Math.cos(e), Math.sin(a) * Math.cos(e), Math.sin(e))
      .multiplyScalar(r)
      .add(this.controls.target);
    this.controls.update();
  }

  /** Turns the camera by degrees and changes its distance. */
  turn(azimuth: number, elevation: number, zoom: number): void {
    this.flight = null;
    if (this.scopeIsOn) {
      this.scope.lean((-azimuth * Math.PI) / 720, (elevation * Math.PI) / 720);
      if (zoom !== 1) this.scope.push(zoom < 1 ? 0.04 : -0.04);
      return this.placeScope();
    }
    const offset = this.camera.position.clone().sub(this.controls.target),
      r = offset.length();
    const a = Math.atan2(offset.y, offset.x) + (azimuth * Math.PI) / 180;
    const e = Math.max(-1.5, Math.min(1.5, Math.asin(offset.z / r) + (elevation * Math.PI) / 180));
    const d = Math.max(this.controls.minDistance, Math.min(this.controls.maxDistance, r * zoom));
    this.camera.position
      .set(Math.cos(a) * Math.cos(e), Math.sin(a) * Math.cos(e), Math.sin(e))
      .multiplyScalar(d)
      .add(this.controls.target);
    this.controls.update();
  }

  /** Moves what moves by itself; true while it does. */
  animate(now: number): boolean {
    if (this.flight) this.fly(now);
    return (!this.scopeIsOn && this.controls.update()) || this.flight !== null;
  }

  resize(width: number, height: number): void {
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / Math.max(1, height);
    this.camera.updateProjectionMatrix();
    const tall = this.camera.aspect < 1;
    if (tall !== this.tall) {
      this.tall = tall;
      this.setTheme(this.dark);
    }
    if (this.scopeIsOn) this.placeScope();
  }

  /** The view ray through a point of the window (in pixels of the canvas box). */
  ray(x: number, y: number): { origin: Vec3; direction: Vec3 } {
    const size = this.renderer.getSize(new Vector2());
    this.camera.updateMatrixWorld();
    const far = new Vector3((2 * x) / size.x - 1, 1 - (2 * y) / size.y, 0.5).unproject(this.camera);
    const o = this.camera.getWorldPosition(new Vector3()),
      d = far.sub(o).normalize();
    return { origin: [o.x, o.y, o.z], direction: [d.x, d.y, d.z] };
  }

  /** Whether a point of space is in the picture. */
  sees(p: Vector3): boolean {
    const q = p.clone().project(this.camera);
    return Math.abs(q.x) <= 1 && Math.abs(q.y) <= 1 && Math.abs(q.z) <= 1;
  }

  /** Where a point of space appears in the window. */
  project(p: Vec3): [number, number] {
    const size = this.renderer.getSize(new Vector2()),
      q = new Vector3(...p).project(this.camera);
    return [((q.x + 1) / 2) * size.x, ((1 - q.y) / 2) * size.y];
  }

  /** The eye is under the ground: neither that nor what lies on it is drawn. */
  get eyeBelow(): boolean {
    return !this.scopeIsOn && this.floor !== null && this.camera.position.z < this.floor;
  }

  /** `prepare` is told from where the picture is seen and lit. */
  render(shadows: boolean, prepare: (sight: Sight) => void): void {
    const below = this.eyeBelow;
    if (below !== this.below) {
      this.below = below;
      this.light();
      this.furnish();
      shadows = true;
    }
    if (shadows) this.renderer.shadowMap.needsUpdate = true;
    const { x, y, z } = this.camera.position,
      sun = this.sun.position.clone().sub(this.sun.target.position);
    prepare({
      eye: { x, y, z, w: 1 },
      sun: { x: sun.x, y: sun.y, z: sun.z, w: 0 },
      shadows: this.renderer.shadowMap.needsUpdate && this.sun.visible,
    });
    this.renderer.render(this.scene, this.camera);
  }
}

/** Whether WebGL runs on the CPU; null when there is no WebGL 2 at all. */
export function softwareRendering(): boolean | null {
  const gl = document.createElement('canvas').getContext('webgl2');
  if (!gl) return null;
  const info = gl.getExtension('WEBGL_debug_renderer_info');
  const name = String(gl.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
  gl.getExtension('WEBGL_lose_context')?.loseContext();
  return /llvmpipe|swiftshader|softpipe|software|basic render/i.test(name);
}
