// Materials of the body: solid textures sampled at the rest position, so that skin and cut surface are one material.
import {
  DoubleSide,
  FrontSide,
  MeshDepthMaterial,
  MeshPhongMaterial,
  MeshPhysicalMaterial,
  MeshStandardMaterial,
  type Data3DTexture,
  type IUniform,
  type Material,
  type WebGLProgramParametersWithUniforms,
} from 'three';
import { kDryAfter, kFilm, kLooks } from './looks';
import { withFewerVaryings } from './fewer_varyings';
import { kOcclusionSource } from './occlusion';
import { readShadowOnce } from './soft_shadow';
import { kPlacedDeclarations, kSkinningDeclarations } from './skinning';

export type Look = 'steak' | 'meniscus' | 'sheet';
export type QualityLevel = 'full' | 'low' | 'lite';
export type Uniforms = Record<string, IUniform>;

export const toLook = (name: unknown): Look => (name === 'meniscus' || name === 'sheet' ? name : 'steak');

const kFragmentDeclarations = /* glsl */ `
uniform highp sampler3D uNoise;
uniform vec3 uBoxMin, uBoxMax, uFibre;
uniform float uTextureScale, uWindow;
varying vec3 vRest;
varying float vMarked;
vec3 kAlbedo; float kRough, kHeight, kGlow;
const float kShadeOfSun = 0.35; // share of a place's shade that the sun's light takes too; the shadow map does the rest
float kWet = 0.8; // 0 to 1: film of liquid
const float kWindowLight = 3.0; // of the mirrored window, in units of white
float kFat; // share of fat, or of bright fibres
uniform int uLesion;
uniform vec4 uLesionA, uLesionB;
// Distance into the marked region (texture units); negative outside.
float kIntoLesion(vec3 r) {
  if (uLesion == 1) return uLesionA.w - distance(r, uLesionA.xyz);
  if (uLesion == 2) { vec3 d = min(r - uLesionA.xyz, uLesionB.xyz - r); return min(d.x, min(d.y, d.z)); }
  return dot(r - uLesionA.xyz, normalize(uLesionB.xyz));
}
// What supports hold is hatched.
void kHatch(vec3 r, inout vec3 albedo) {
  if (vMarked < 0.4) return;
  float d = abs(fract(48.0 * (r.x + r.y + r.z)) - 0.5), w = 48.0 * (fwidth(r.x) + fwidth(r.y) + fwidth(r.z));
  albedo = mix(albedo, vec3(0.02, 0.13, 0.42), smoothstep(0.4, 0.5, vMarked) * (0.22 + 0.55 * smoothstep(-w, w, d - 0.30)));
}
void kMark(vec3 r, inout vec3 albedo) {
  if (uLesion == 0) return;
  float d = kIntoLesion(r), w = max(fwidth(d), 1e-6), line = 0.0011;
  float ragged = 0.0022 * (texture(uNoise, r / 0.021).r - 0.5);
  albedo = mix(albedo, albedo * vec3(0.98, 0.52, 0.42) + vec3(0.035, 0.0, 0.0), 0.85 * smoothstep(-0.0006, 0.0030, d + ragged));
  albedo = mix(albedo, vec3(0.45, 0.015, 0.03), 0.9 * (1.0 - smoothstep(0.35 * line, 0.35 * line + 1.5 * w, abs(d))));
}
`;

// A normal from the derivatives of a height given in texture units.
const kBump = /* glsl */ `
{
  vec3 px = dFdx(-vViewPosition), py = dFdy(-vViewPosition);
  float h = kHeight / uTextureScale;
  vec2 dh = vec2(dFdx(h), dFdy(h));
  vec3 r1 = cross(py, normal), r2 = cross(normal, px);
  float det = dot(px, r1);
  vec3 g = sign(det) * (dh.x * r1 + dh.y * r2);
  float fade = clamp(abs(det) / (dot(g, g) * 0.6 + 1e-30) , 0.0, 1.0);
  normal = normalize(abs(det) * normal - g * min(1.0, fade + 0.65));
}
`;

// The sky that walls of a slit shut out, and what the body lies on below it.
const kShade = /* glsl */ `
#include <aomap_fragment>
{
  vec3 upright = kInWorld(normal);
  float high = (vInSpace.z - uBulkLowest) / (0.10 * uBulkSize);
  float open = kOpen(vInSpace, upright) * mix(1.0, mix(0.62, 1.0, smoothstep(0.0, 1.0, high)), clamp(0.6 - upright.z, 0.0, 1.0));
  reflectedLight.indirectDiffuse *= open;
  reflectedLight.directDiffuse *= mix(1.0, open, kShadeOfSun);
  reflectedLight.indirectSpecular *= open;
  reflectedLight.directSpecular *= mix(1.0, open, kShadeOfSun);
  totalEmissiveRadiance *= open;
#ifdef USE_CLEARCOAT
  clearcoatSpecularIndirect *= open;
#endif
}`;

// Sharper and stronger where it is wet; the window is mirrored beside the sun, which the light itself brings.
const kLiteFilm = /* glsl */ `
#include <lights_phong_fragment>
material.specularShininess = mix(26.0, 110.0, kWet);
material.specularStrength = kWet * (1.4 - 1.6 * kRough);
{
  vec3 eye = normalize(vViewPosition);
  totalEmissiveRadiance += kWet * kWindowLight * uWindow * kFresnel(dot(eye, normal)) * kWindow(kInWorld(reflect(-eye, normal)));
}`;

/** For patchSkinning: the mesh has its places as attributes. */
export const kPlaced = 'KERF_PLACED';

/** Adds skinning to a built-in material; `fragment` may patch the fragment shader. */
export function patchSkinning(
  material: Material,
  uniforms: Uniforms,
  defines: string[],
  key: string,
  patch?: (shader: WebGLProgramParametersWithUniforms) => void,
): void {
  const head = defines.map((d) => `#define ${d}\n`).join('');
  const places = defines.includes(kPlaced) ? kPlacedDeclarations : kSkinningDeclarations;
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, uniforms);
    shader.vertexShader = shader.vertexShader
      .replace(
        '#include <common>',
        `#include <common>\n${head}${places}\nuniform float uTextureScaleV;\nvarying vec3 vRest, vInSpace;\nvarying float vMarked;`,
      )
      .replace(
        'void main() {',
        'void main() {\n\tkSkin(position, normal);\n\tvRest = position * uTextureScaleV;\n\tvInSpace = kPos;\n\tvMarked = kMarked;',
      )
      .replace(
        '#include <beginnormal_vertex>',
        'vec3 objectNormal = kNrm;\n#ifdef USE_TANGENT\n\tvec3 objectTangent = tangent.xyz;\n#endif',
      )
      .replace('#include <begin_vertex>', 'vec3 transformed = kPos;');
    patch?.(shader);
  };
  material.customProgramCacheKey = () => `kerf-${key}-${defines.join('-')}`;
}

/** Walls know when they were cut: vFresh goes from 1 to 0 while they dry. */
function addDrying(vertexShader: string): string {
  return vertexShader
    .replace('void main() {', 'in float kBirth;\nuniform float uTime;\nvarying float vFresh;\nvoid main() {')
    .replace(
      'vec3 transformed = kPos;',
      `vec3 transformed = kPos;\n\tvFresh = 1.0 - smoothstep(0.0, ${kDryAfter.toFixed(1)}, max(0.0, uTime - kBirth));`,
    );
}

function surfacePatch(
  look: Look,
  level: QualityLevel,
  wall: boolean,
): (shader: WebGLProgramParametersWithUniforms) => void {
  return (shader) => {
    const lite = level === 'lite' ? '#define KERF_LITE\n' : '';
    let f = shader.fragmentShader
      .replace(
        '#include <common>',
        `#include <common>\n${lite}${wall ? 'varying float vFresh;\n' : ''}${kFragmentDeclarations}${kFilm}${kOcclusionSource}${kLooks[look]}`,
      )
      .replace(
        '#include <color_fragment>',
        `kSurface(vRest);${wall ? '\n\tkFreshWall(vFresh, vRest);' : ''}\n\tkMark(vRest, kAlbedo);\n\tkHatch(vRest, kAlbedo);\n\tdiffuseColor.rgb = kAlbedo * diffuse;`,
      )
      .replace('#include <roughnessmap_fragment>', 'float roughnessFactor = clamp(kRough * roughness, 0.08, 1.0);');
    if (level !== 'lite') f = f.replace('#include <normal_fragment_maps>', kBump);
    // Light that has wandered through the body: strongest where one looks along the surface.
    f = f.replace(
      '#include <emissivemap_fragment>',
      'totalEmissiveRadiance += kAlbedo * kGlow * (0.25 + 0.75 * pow(1.0 - clamp(dot(normalize(vViewPosition), normal), 0.0, 1.0), 2.0));',
    );
    f = f.replace('#include <aomap_fragment>', kShade);
    if (level === 'full')
      f = f.replace(
        '#include <lights_physical_fragment>',
        '#include <lights_physical_fragment>\n\tmaterial.clearcoat = saturate(material.clearcoat * (0.4 + 0.75 * kWet));',
      );
    if (level === 'lite') f = withFewerVaryings(f.replace('#include <lights_phong_fragment>', kLiteFilm));
    shader.fragmentShader = f;
    if (wall) shader.vertexShader = addDrying(shader.vertexShader);
  };
}

export interface BodyMaterials {
  skin: Material;
  wall: Material;
  depth: Material;
  level: QualityLevel;
}

/** Materials for a look and quality. `open`: the skin is a sheet without thickness, seen from both sides. */
export function makeBodyMaterials(
  look: Look,
  level: QualityLevel,
  open: boolean,
  cells: Uniforms,
  noise: Data3DTexture,
  frame: Uniforms,
): BodyMaterials {
  const uniforms: Uniforms = { ...cells, ...frame, uNoise: { value: noise } };
  const side = open ? DoubleSide : FrontSide;
  const placed = level === 'lite' ? [kPlaced] : [];
  const defines = [...placed, 'KERF_SMOOTH'];
  const make = (wall: boolean): Material => {
    let m: MeshPhysicalMaterial | MeshStandardMaterial | MeshPhongMaterial;
    if (level === 'full') {
      const coat = look === 'steak' ? 0.75 : look === 'meniscus' ? 0.55 : 0.12;
      m = new MeshPhysicalMaterial({
        side: wall ? FrontSide : side,
        clearcoat: coat,
        clearcoatRoughness: look === 'sheet' ? 0.45 : 0.22,
        roughness: 1,
        metalness: 0,
        ior: 1.4,
        specularIntensity: look === 'sheet' ? 1 : 0.45, // the coat mirrors before the tissue does
      });
    } else if (level === 'low') {
      m = new MeshStandardMaterial({ side: wall ? FrontSide : side, roughness: 0.82, metalness: 0 });
    } else {
      m = readShadowOnce(new MeshPhongMaterial({ side: wall ? FrontSide : side, specular: 0x383838 }));
    }
    if (wall) m.color.setRGB(0.97, 0.94, 0.94);
    patchSkinning(
      m,
      uniforms,
      defines,
      `${look}-${level}-${open ? 'open' : 'closed'}-${wall ? 'wall' : 'skin'}`,
      surfacePatch(look, level, wall),
    );
    return m;
  };
  const depth = new MeshDepthMaterial({ side: open ? DoubleSide : FrontSide });
  patchSkinning(depth, uniforms, placed, 'depth');
  return { skin: make(false), wall: make(true), depth, level };
}

export function disposeMaterials(m: BodyMaterials): void {
  m.skin.dispose();
  m.wall.dispose();
  m.depth.dispose();
}
