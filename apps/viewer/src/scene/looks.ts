// What tissue is made of: solid textures of the rest position, and how wet light comes back from them. GLSL.
import type { Look } from './materials';

/** Seconds of the body's time after which the wall of a cut looks like its skin. Less than two is not noticed. */
export const kDryAfter = 8;

/**
 * Each look also defines kFreshWall(0: dry, 1: just cut; rest position): what it changes of what kSurface set. Each look
 * defines kSurface(rest position in texture units), which sets kAlbedo, kRough, kHeight, kGlow and kFat. One
 * texture unit is chosen so that a body of 0.26 "units" across looks like the demo steak, whatever its size in metres.
 */
export const kLooks: Record<Look, string> = {
  steak: /* glsl */ `
const float kMuscle = 0.21;   // units a tile: bends of the muscle; smaller: wavier seams of fat
const float kSeams = 0.150;   // units a tile: long seams; features are a quarter to an eighth of it
const float kFlecks = 0.050;  // units a tile: flecks; half of it reads as sand, twice of it as curls
const float kThreads = 0.026; // units a tile: threads between flecks, seen near
const float kSoft = 0.022;    // of the noise's range: half the width of an edge of fat seen near; 0 looks cut out

// How much of a pixel lies within the fat; d: noise units into it. Edges keep about a pixel, near and far.
float kCover(float d) {
  float w = max(kSoft, 0.8 * fwidth(d));
  return smoothstep(-w, w, d);
}
void kSurface(vec3 r) {
  vec4 muscle = texture(uNoise, r / kMuscle + 0.7);
  vec3 p = r + (muscle.rgb - 0.5) * 0.036;
  vec4 a = texture(uNoise, p * vec3(1.0, 1.2, 1.0) / kSeams + 0.11);
  vec4 b = texture(uNoise, (p.zxy + 0.012 * (a.gbr - 0.5)) / kFlecks + 0.53);
  // Fat lies along surfaces where a noise is one half. Their width follows other noises and ends them: strokes that taper.
  float rich = 0.9 * (a.g - 0.5) + 0.6 * (muscle.g - 0.5);
  float flecks = 0.50 * (b.g - 0.575 + 0.42 * rich) - abs(b.r - 0.5);
  float seams = 0.26 * (a.b - 0.585 + 0.55 * (b.b - 0.5)) - abs(a.r - 0.5);
  float lumps = 1.3 * (a.b - 0.775 + 0.34 * (b.b - 0.5));
  float d = max(max(flecks, seams), lumps);
#ifndef KERF_LITE
  vec4 c = texture(uNoise, (p.yzx + 0.006 * (b.rgb - 0.5)) / kThreads + 0.29);
  float threads = 0.60 * (c.b - 0.60 + 0.6 * rich) - abs(c.g - 0.5);
  vec4 fine = texture(uNoise, vec3(r.x, r.y * 0.35, r.z) / 0.021);
  d = max(d, threads) + 0.10 * (c.a - 0.5);
  float grain = fine.a;
#else
  float grain = b.a;
#endif
  float fat = kCover(d);
  float rim = uBoxMax.y - 0.0135 + 0.020 * (a.b - 0.5) + 0.008 * (b.r - 0.5) - 0.9 * r.x * r.x;
  float cap = smoothstep(rim - 0.0010, rim + 0.0012, r.y);
  kFat = max(0.94 * fat, cap);
  float deep = clamp(0.5 + 1.6 * (a.g - 0.5) + 1.1 * (b.b - 0.5) + 0.8 * (muscle.b - 0.5), 0.0, 1.0);
  vec3 meat = mix(vec3(0.205, 0.014, 0.020), vec3(0.440, 0.048, 0.052), deep) * (0.80 + 0.40 * grain);
  vec3 tallow = mix(vec3(0.66, 0.47, 0.36), vec3(0.80, 0.67, 0.54), b.r) * (0.93 + 0.14 * grain);
  // Thin fat lets the red through.
  tallow = mix(tallow, vec3(0.62, 0.25, 0.19), 0.45 * (1.0 - smoothstep(0.0, 0.16, max(d, cap))));
  kAlbedo = mix(meat, tallow, kFat);
  kRough = mix(0.40, 0.50, kFat) + 0.20 * (grain - 0.5);
  kHeight = 0.00014 * grain + 0.00012 * kFat + 0.0006 * b.g;
#ifndef KERF_LITE
  kHeight += 0.00012 * fine.r;
#endif
  kGlow = mix(0.16, 0.05, kFat);
}
// Juice makes meat darker and fat yellower until air has dried it.
void kFreshWall(float fresh, vec3 r) {
  kAlbedo *= mix(vec3(1.0), mix(vec3(0.62, 0.52, 0.58), vec3(0.94, 0.86, 0.76), kFat), fresh);
  kRough = mix(kRough, 0.22, 0.8 * fresh);
  kWet = mix(kWet, 1.0, fresh);
  kGlow = mix(kGlow, 0.10, fresh);
}`,
  meniscus: /* glsl */ `
void kSurface(vec3 r) {
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
  kAlbedo = mix(pearl, warm, clamp(0.9 * outer * (0.5 + 1.6 * (a.b - 0.35)), 0.0, 0.85));
  kAlbedo *= 0.74 + 0.46 * band;
  kRough = 0.24 + 0.26 * (1.0 - band);
  kHeight = 0.0010 * band + 0.0008 * a.g;
  kGlow = 0.20;
  kFat = fibre.r;
}
// Bundles of collagen that the blade has just parted: whiter than the skin, in lines along the bow.
void kFreshWall(float fresh, vec3 r) {
  float radius = length(r.xy - uFibre.xy);
  float bundle = texture(uNoise, vec3(radius * 30.0, 0.37, r.z * 52.0)).r;
  float line = smoothstep(0.42, 0.58, bundle);
  kAlbedo = mix(kAlbedo, mix(vec3(0.52, 0.50, 0.45), vec3(0.78, 0.77, 0.73), line), 0.85 * fresh);
  kHeight += 0.0008 * line * fresh;
  kRough = mix(kRough, 0.20, 0.7 * fresh);
  kWet = mix(kWet, 1.0, fresh);
}`,
  sheet: /* glsl */ `
void kSurface(vec3 r) {
  vec4 a = texture(uNoise, r / 0.24);
  vec4 b = texture(uNoise, r.yzx / 0.033);
  kAlbedo = mix(vec3(0.250, 0.470, 0.640), vec3(0.300, 0.535, 0.705), a.r) * (0.965 + 0.07 * b.a);
  float speck = smoothstep(0.74, 0.80, b.r);
  kAlbedo = mix(kAlbedo, vec3(0.52, 0.68, 0.78), 0.25 * speck);
  kRough = 0.42 + 0.14 * (b.g - 0.5);
  kHeight = 0.00022 * b.a + 0.0004 * a.g;
  kGlow = 0.12;
  kWet = 0.35;
}
void kFreshWall(float fresh, vec3 r) {
  kAlbedo *= mix(1.0, 0.80, fresh);
  kWet = mix(kWet, 0.8, fresh);
}`,
};

/** The window above the table that wet surfaces mirror: kWindow(unit direction in space), 0 to 1. */
export const kWindowSource = /* glsl */ `
const vec2 kWindowAt = vec2(-0.34, 0.42);    // where it is, per height above
const vec2 kWindowSize = vec2(0.30, 0.22);   // half its sides, per height above
const float kWindowEdge = 0.16;              // how far its edge fades; 0 glitters on faceted bodies
float kWindow(vec3 dir) {
  vec2 q = abs(dir.xy / max(dir.z, 0.05) - kWindowAt) - kWindowSize;
  vec2 inside = 1.0 - smoothstep(-kWindowEdge, kWindowEdge, q);
  return inside.x * inside.y;
}
`;

/** The film of liquid on a surface: highlights of lite, whose material has none of its own. */
export const kFilm = /* glsl */ `
vec3 kInWorld(vec3 v) { return (vec4(v, 0.0) * viewMatrix).xyz; }
${kWindowSource}// Schlick's law for water: 2 % straight on, all along the surface.
float kFresnel(float cosine) {
  float x = 1.0 - clamp(cosine, 0.0, 1.0), x2 = x * x;
  return 0.02 + 0.98 * x2 * x2 * x;
}
`;
