// Materials of the body: solid textures sampled at the rest position, so that skin and cut surface are one material.
import {
  DoubleSide,
  FrontSide,
  MeshDepthMaterial,
  MeshLambertMaterial,
  MeshPhysicalMaterial,
  MeshStandardMaterial,
  type Data3DTexture,
  type IUniform,
  type Material,
  type WebGLProgramParametersWithUniforms,
} from 'three';
import { kSkinningDeclarations } from './skinning';

export type Look = 'steak' | 'meniscus' | 'sheet';
export type QualityLevel = 'full' | 'low' | 'lite';
export type Uniforms = Record<string, IUniform>;

export const toLook = (name: unknown): Look => (name === 'meniscus' || name === 'sheet' ? name : 'steak');

/**
 * Each look defines kSurface(rest position in texture units): albedo, roughness and height. One texture unit is chosen so
 * that a body of 0.26 "units" across looks like the demo steak, whatever its size in metres.
 */
const kLooks: Record<Look, string> = {
  steak: /* glsl */ `
void kSurface(vec3 r, out vec3 albedo, out float rough, out float height, out float glow) {
  vec3 p = r + (texture(uNoise, r / 0.17).rgb - 0.5) * 0.040;
#ifndef KERF_LITE
  p += (texture(uNoise, p.yzx / 0.046 + 0.37).rgb - 0.5) * 0.0105;
#endif
  vec3 s = p * vec3(1.0, 1.25, 1.0);
  vec4 a = texture(uNoise, s / 0.150 + 0.11);
  vec4 b = texture(uNoise, s.zxy / 0.066 + 0.53);
  float slow = smoothstep(0.38, 0.64, texture(uNoise, r / 0.30 + 0.7).g);
  float thick = mix(0.35, 1.5, smoothstep(0.35, 0.7, a.b));
  float v1 = 1.0 - smoothstep(0.004, 0.026 * thick, abs(a.r - 0.5));
  v1 *= smoothstep(0.50, 0.62, b.g) * smoothstep(0.40, 0.52, a.g);
  float v2 = (1.0 - smoothstep(0.004, 0.040 * thick, abs(b.r - 0.5))) * smoothstep(0.53, 0.66, a.g) * (0.35 + 0.65 * slow);
  float fat = max(v1, v2);
#ifndef KERF_LITE
  vec4 c = texture(uNoise, s.yzx / 0.028 + 0.29);
  float v3 = (1.0 - smoothstep(0.012, 0.075, abs(c.g - 0.5))) * smoothstep(0.52, 0.66, b.b) * smoothstep(0.42, 0.6, c.r);
  fat = max(fat, (0.45 + 0.5 * slow) * v3);
  vec4 fine = texture(uNoise, vec3(r.x, r.y * 0.35, r.z) / 0.021);
#else
  vec4 fine = vec4(0.5);
#endif
  float rim = uBoxMax.y - 0.0135 + 0.020 * (a.b - 0.5) + 0.008 * (b.r - 0.5) - 0.9 * r.x * r.x;
  float cap = smoothstep(rim - 0.0010, rim + 0.0012, r.y);
  fat = max(fat, cap);
  float deep = clamp(0.5 + 1.5 * (a.g - 0.5) + 0.9 * (b.b - 0.5), 0.0, 1.0);
  vec3 meat = mix(vec3(0.150, 0.0085, 0.012), vec3(0.395, 0.030, 0.030), deep);
  meat *= 0.84 + 0.32 * fine.a;
  vec3 tallow = mix(vec3(0.74, 0.56, 0.42), vec3(0.83, 0.71, 0.58), b.r) * (0.93 + 0.14 * fine.a);
  tallow = mix(tallow, vec3(0.66, 0.30, 0.22), 0.35 * (1.0 - smoothstep(0.25, 1.0, fat)));
  albedo = mix(meat, tallow, 0.94 * fat);
  rough = mix(0.40 + 0.16 * (fine.r - 0.5), 0.52, fat);
  height = 0.00030 * fine.a + 0.00050 * fine.r + 0.00045 * fat + 0.0007 * b.g;
  glow = mix(0.16, 0.05, fat);
}`,
  meniscus: /* glsl */ `
void kSurface(vec3 r, out vec3 albedo, out float rough, out float height, out float glow) {
  vec3 w = texture(uNoise, r / 0.30).rgb - 0.5;
  vec3 p = r + w * 0.024;
  // Whole turns are whole tiles of the noise: no seam.
  float angle = atan(p.y - uFibre.y, p.x - uFibre.x), radius = length(p.xy - uFibre.xy);
  vec4 a = texture(uNoise, r / 0.19 + 0.3);
  vec4 coarse = texture(uNoise, vec3(radius * 9.0, angle * 0.318310, p.z * 8.0));
  vec4 fibre = texture(uNoise, vec3(radius * 26.0, angle * 0.636620, p.z * 24.0));
  float band = smoothstep(0.25, 0.75, 0.55 * coarse.r + 0.45 * fibre.g);
  float outer = smoothstep(0.45, 1.05, radius / uFibre.z);
  vec3 pearl = mix(vec3(0.315, 0.335, 0.330), vec3(0.395, 0.380, 0.320), smoothstep(0.35, 0.65, a.r));
  vec3 warm = mix(vec3(0.400, 0.315, 0.205), vec3(0.360, 0.190, 0.145), smoothstep(0.50, 0.72, a.g));
  albedo = mix(pearl, warm, clamp(0.9 * outer * (0.5 + 1.6 * (a.b - 0.35)), 0.0, 0.85));
  albedo *= 0.74 + 0.46 * band;
  rough = 0.24 + 0.26 * (1.0 - band);
  height = 0.0010 * band + 0.0008 * a.g;
  glow = 0.20;
}`,
  sheet: /* glsl */ `
void kSurface(vec3 r, out vec3 albedo, out float rough, out float height, out float glow) {
  vec4 a = texture(uNoise, r / 0.24);
  vec4 b = texture(uNoise, r.yzx / 0.033);
  albedo = mix(vec3(0.250, 0.470, 0.640), vec3(0.300, 0.535, 0.705), a.r) * (0.965 + 0.07 * b.a);
  float speck = smoothstep(0.74, 0.80, b.r);
  albedo = mix(albedo, vec3(0.52, 0.68, 0.78), 0.25 * speck);
  rough = 0.42 + 0.14 * (b.g - 0.5);
  height = 0.00022 * b.a + 0.0004 * a.g;
  glow = 0.12;
}`,
};

const kFragmentDeclarations = /* glsl */ `
uniform highp sampler3D uNoise;
uniform vec3 uBoxMin, uBoxMax, uFibre;
uniform float uTextureScale;
varying vec3 vRest;
varying float vMarked;
vec3 kAlbedo; float kRough, kHeight, kGlow;
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

/** Adds skinning to a built-in material; `fragment` may patch the fragment shader. */
export function patchSkinning(
  material: Material,
  uniforms: Uniforms,
  defines: string[],
  key: string,
  patch?: (shader: WebGLProgramParametersWithUniforms) => void,
): void {
  const head = defines.map((d) => `#define ${d}\n`).join('');
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, uniforms);
    shader.vertexShader = shader.vertexShader
      .replace(
        '#include <common>',
        `#include <common>\n${head}${kSkinningDeclarations}\nvarying vec3 vRest;\nvarying float vMarked;`,
      )
      .replace(
        'void main() {',
        'void main() {\n\tkSkin(position, normal);\n\tvRest = position * uTextureScaleV;\n\tvMarked = kMarked;',
      )
      .replace(
        '#include <beginnormal_vertex>',
        'vec3 objectNormal = kNrm;\n#ifdef USE_TANGENT\n\tvec3 objectTangent = tangent.xyz;\n#endif',
      )
      .replace('#include <begin_vertex>', 'vec3 transformed = kPos;')
      .replace('uniform vec3 uOrigin;', 'uniform vec3 uOrigin;\nuniform float uTextureScaleV;');
    patch?.(shader);
  };
  material.customProgramCacheKey = () => `kerf-${key}-${defines.join('-')}`;
}

function surfacePatch(look: Look, level: QualityLevel): (shader: WebGLProgramParametersWithUniforms) => void {
  return (shader) => {
    const lite = level === 'lite' ? '#define KERF_LITE\n' : '';
    let f = shader.fragmentShader
      .replace('#include <common>', `#include <common>\n${lite}${kFragmentDeclarations}${kLooks[look]}`)
      .replace(
        '#include <color_fragment>',
        'kSurface(vRest, kAlbedo, kRough, kHeight, kGlow);\n\tkMark(vRest, kAlbedo);\n\tkHatch(vRest, kAlbedo);\n\tdiffuseColor.rgb = kAlbedo * diffuse;',
      )
      .replace('#include <roughnessmap_fragment>', 'float roughnessFactor = clamp(kRough * roughness, 0.08, 1.0);');
    if (level !== 'lite') f = f.replace('#include <normal_fragment_maps>', kBump);
    // Light that has wandered through the body: strongest where one looks along the surface.
    f = f.replace(
      '#include <emissivemap_fragment>',
      'totalEmissiveRadiance += kAlbedo * kGlow * (0.25 + 0.75 * pow(1.0 - clamp(dot(normalize(vViewPosition), normal), 0.0, 1.0), 2.0));',
    );
    shader.fragmentShader = f;
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
  const defines = level === 'lite' ? [] : ['KERF_SMOOTH'];
  const make = (wall: boolean): Material => {
    let m: MeshPhysicalMaterial | MeshStandardMaterial | MeshLambertMaterial;
    if (level === 'full') {
      const coat = look === 'steak' ? (wall ? 0.22 : 0.4) : look === 'meniscus' ? (wall ? 0.3 : 0.55) : 0.12;
      m = new MeshPhysicalMaterial({
        side: wall ? FrontSide : side,
        clearcoat: coat,
        clearcoatRoughness: look === 'sheet' ? 0.45 : 0.22,
        roughness: 1,
        metalness: 0,
        ior: 1.4,
      });
    } else if (level === 'low') {
      m = new MeshStandardMaterial({ side: wall ? FrontSide : side, roughness: 0.82, metalness: 0 });
    } else {
      m = new MeshLambertMaterial({ side: wall ? FrontSide : side });
    }
    if (wall) m.color.setRGB(0.97, 0.94, 0.94);
    patchSkinning(m, uniforms, defines, `${look}-${level}-${open ? 'open' : 'closed'}`, surfacePatch(look, level));
    return m;
  };
  const depth = new MeshDepthMaterial({ side: open ? DoubleSide : FrontSide });
  patchSkinning(depth, uniforms, [], 'depth');
  return { skin: make(false), wall: make(true), depth, level };
}

export function disposeMaterials(m: BodyMaterials): void {
  m.skin.dispose();
  m.wall.dispose();
  m.depth.dispose();
}
